"""The report: one HTML page about results."""
