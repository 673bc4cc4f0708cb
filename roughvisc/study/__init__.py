"""Cases and the study files that describe them."""
