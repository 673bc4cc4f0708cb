"""The whole error of one number, source by source."""
