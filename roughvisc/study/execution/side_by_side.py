"""How many cases run side by side on this machine, and with how many threads each: by its cores and its memory."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from roughvisc.experiment.refusal import PART, WORTH_ASKING
from roughvisc.experiment.resources import PROCESS, cores, memory_available
from roughvisc.study.statement.case import Case
from roughvisc.topography.grid import nominal_area

#: A file that is smaller holds no surface of :data:`WORTH_ASKING` cells. [byte]
_SMALL_FILE = WORTH_ASKING


def processes_that_fit(sizes: Iterable[float], most: int, free: float) -> int:
    """Processes side by side, one at least: as many of the largest as there is memory for.

    Parameters
    ----------
    sizes : iterable of float
        Memory of each case, that of its process included; missing ones count as none. [byte]
    most : int
        Processes at most.
    free : float
        Memory there is. [byte]

    Examples
    --------
    >>> processes_that_fit([1e9, 3e9, 2e9, 2e9], 4, 8e9), processes_that_fit([9e9, 1e9], 2, 8e9)
    (3, 1)
    """
    largest = sorted((size for size in sizes if size > 0), reverse=True)[:most]
    together = 0.0
    for count, size in enumerate(largest):
        together += size
        if together > PART * free:
            return max(count, 1)
    return most


def side_by_side(cases: Sequence[Case], most: int) -> int:
    """Processes for some cases on this machine, ``most`` at most: fewer where the memory does not hold so many."""
    if most <= 1:
        return most
    sizes = list(_sizes(cases))
    return processes_that_fit(sizes, most, memory_available().size) if any(sizes) else most


def threads_each(processes: int) -> int:
    """Threads of each of some cases that run side by side on this machine."""
    return max(1, cores() // max(processes, 1))


def _sizes(cases: Sequence[Case]) -> Iterable[float]:
    """Memory of each case that is large; zero of the others. [byte]"""
    surfaces: dict[str, tuple[int, float]] = {}
    for case in cases:
        name = json.dumps(json.loads(case.to_json())["surface"], sort_keys=True)
        if name not in surfaces:
            surfaces[name] = _cells_and_area(case)
        cells, area = surfaces[name]
        if cells < WORTH_ASKING:
            yield 0.0
            continue
        settings, experiment = case.solving(), case.experiment()
        yield PROCESS + experiment.bytes_needed(settings, case.body(), cells, area)


def _cells_and_area(case: Case) -> tuple[int, float]:
    """Cells of a case's surface, and its area [m2]; no cells where it is small, or cannot be had."""
    surface = case.settings.surface
    shape = surface.resample or surface.band_limit or case.made_shape
    if shape is not None:
        return math.prod(shape) * (4 if surface.mirror else 1), 1.0
    file = getattr(surface, "file", None)
    try:
        if file is None or Path(file).stat().st_size < _SMALL_FILE:
            return 0, 1.0
        height = case.height()
    except (OSError, ValueError):  # it fails in its own time
        return 0, 1.0
    return height.size, nominal_area(height)
