"""Judgement of cases: their cost, the error from each setting and input, and the assumptions of the model."""
