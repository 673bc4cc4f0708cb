"""Files: results, the index of a folder, records of runs that are not finished."""
