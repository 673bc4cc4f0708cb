"""Cases, their execution and their results: one Dataset for one case, a folder of files for many cases."""
