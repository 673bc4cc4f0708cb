"""Predicted steps, time and memory of a case, before it runs."""
