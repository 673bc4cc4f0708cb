"""What all the cases of a plan come to together: processes, threads, time, memory and disk; and whether they fit."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.experiment.refusal import PART, amount
from roughvisc.experiment.resources import Available, cores
from roughvisc.study.execution.side_by_side import processes_that_fit, threads_each


def totals(dataset: xr.Dataset, folder: Path, workers: int | None, there: Available) -> dict[str, Any]:
    """Totals, what is free, and why it cannot fit."""
    place = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.exists())
    free_disk, total = shutil.disk_usage(place).free, dataset.sizes["case"]
    seconds = np.nan_to_num(dataset["wall_time"].values)
    largest = np.sort(np.nan_to_num(dataset["memory"].values))[::-1]
    processes = min(workers or cores(), total)
    if workers is None:
        processes = processes_that_fit(largest, processes, there.size)
    together = float(np.sum(largest[:processes]))
    size = float(np.nansum(dataset["disk"].values))
    refusals = Counter(str(text) for text in dataset["refusal"].values if text)
    reasons = [f"{count} of {total} cases: {why}" if total > 1 else why for why, count in refusals.most_common(3)]
    if together > PART * there.size >= largest[0]:
        needed = f"{processes} processes need {amount(together)} of memory, and {amount(there.size)} are {there.words}"
        reasons.append(f"{needed}: use --workers {processes_that_fit(largest, processes, there.size)}")
    if size > PART * free_disk:
        reasons.append(
            f"the results need {size:.3g} bytes of disk, {free_disk:.3g} are free in {place}: keep fewer times or "
            "fields, or use another folder"
        )
    return {
        "processes": processes,
        "threads": threads_each(processes),
        "wall_time": max(float(np.sum(seconds)) / processes, float(np.max(seconds, initial=0.0))),
        "memory": together,
        "free_memory": there.size,
        "disk": size,
        "free_disk": free_disk,
        "refusal": "; ".join(reasons),
    }
