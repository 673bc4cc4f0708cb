"""Trade of speed against accuracy: one case under many settings, each timed and its error measured."""
