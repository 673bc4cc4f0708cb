"""Report: one HTML page about results."""
