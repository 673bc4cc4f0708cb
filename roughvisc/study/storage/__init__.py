"""Files: results, the index of a folder, records of runs that are not finished."""

from roughvisc.study.storage import accessor as accessor  # ds.roughvisc is there wherever results are
