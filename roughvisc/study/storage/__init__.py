"""Files: results, the index of a folder, checkpoints and records of failures."""

from roughvisc.study.storage import accessor as accessor  # registers ds.roughvisc
