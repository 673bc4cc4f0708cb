"""Audit of a result: size of each effect that the model neglects, as a number, a verdict and a sentence."""
