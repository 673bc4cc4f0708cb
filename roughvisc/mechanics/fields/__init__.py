"""Passes over fields of numbers, by parts and on threads: knows no grid, body or time."""
