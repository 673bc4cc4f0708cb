"""Closed forms and independent solutions that only the tests compare the solver with."""
