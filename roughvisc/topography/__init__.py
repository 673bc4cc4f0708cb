"""Surfaces: instrument files and recipes become labelled height grids ``height(x, y)``."""
