"""One case becomes a Dataset ``(time, x, y)``."""
