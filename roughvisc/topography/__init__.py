"""Surfaces: instrument files and recipes become labelled height grids ``height(x, y)``."""

from roughvisc.topography import accessor as accessor  # h.roughvisc is there wherever heights are
