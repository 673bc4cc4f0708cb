"""Solver of the elastic contact problem of one instant, under a given load or approach."""
