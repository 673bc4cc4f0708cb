"""Figures, tables and quantities derived from results."""
