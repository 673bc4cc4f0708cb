"""Cases, their execution and their results: one case gives one Dataset, many cases a folder of files."""
