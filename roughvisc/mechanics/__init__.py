"""Contact mechanics on plain arrays: NumPy and SciPy only, SI units, no labels, no files."""
