"""Files: results, the index of a folder, checkpoints and records of failures."""
