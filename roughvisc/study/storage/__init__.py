"""Files: results, the index of a folder, checkpoints and records of failures."""

from roughvisc.study.storage import accessor as accessor  # ds.roughvisc is there wherever results are
