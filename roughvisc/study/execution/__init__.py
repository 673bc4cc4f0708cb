"""Execution of cases, in this process or on Dask."""
