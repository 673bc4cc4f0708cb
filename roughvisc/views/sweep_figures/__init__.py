"""Figures of many results, by what was varied in them."""
