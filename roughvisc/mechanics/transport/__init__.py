"""Conduction through contact spots, and leakage through the gap. Arrays only."""
