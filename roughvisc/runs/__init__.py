"""Computation of cases, in this process or on Dask, and their results in files."""
