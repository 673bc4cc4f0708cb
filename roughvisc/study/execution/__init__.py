"""Here or on Dask: one case to its file, many cases, their progress."""
