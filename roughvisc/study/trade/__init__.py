"""Speed against accuracy: settings, each timed and held against the truth."""
