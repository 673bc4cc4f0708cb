"""Cost and error of one case under several tolerances and grids."""
