"""Energy of loading cycles: the work done in each, and what of it is dissipated where the loop closes."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import describe
from roughvisc.observables.derived import need_history
from roughvisc.observables.response import history

#: Steps in a cycle below which its loop is not known.
_FEWEST = 8


def cycle_energy(dataset: xr.Dataset, *, program: Any = None, closed: float = 0.01) -> xr.Dataset:
    r"""Work in every cycle of the program, and the dissipated energy if force and approach return.

    Over an open loop the work is partly stored, or comes from energy stored before. The dissipated energy is then
    missing.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.
    program : Program, optional
        The program, with :meth:`Program.cycle` in it; default: that of the case in the attributes.
    closed : float
        Largest ``cycle_closure`` at which a loop counts as closed.

    Returns
    -------
    xarray.Dataset
        Over ``cycle``, counted from 1, of the cycles that the steps cover: ``cycle_start`` [s], ``cycle_work``
        [J], ``cycle_closure``, ``cycle_dissipated_energy`` [J].

    Raises
    ------
    InputError
        If no program is known, or it has no whole cycle.

    Notes
    -----
    Of each cycle :math:`W = \oint F \, d\delta`: the change of the variable ``work``, which every accepted step
    counts in, where a step ends at both ends; else the trapezoidal integral over the steps, of second order in their
    length, missing if they are fewer than 8. With the changes :math:`\Delta` between the ends and the ranges
    :math:`R` over the cycle, the closure is
    :math:`(|\Delta F| R_\delta + \max|F| \, |\Delta\delta|) / (R_F R_\delta)`.
    """
    need_history(dataset, "force", "approach")
    if dataset["force"].dims != ("time",):
        raise InputError(f"the force has dimensions {dataset['force'].dims}: choose one case first")
    steps = history(dataset)
    times = steps["time"].values
    spans = _cycles(_program_of(dataset) if program is None else program)
    if not spans:
        raise InputError("the program has no whole cycle: expected Program.cycle in it, or cycle in the study")
    covered = [span for span in spans if times[0] <= span[0] + _slack(span) and span[1] <= times[-1] + _slack(span)]
    rows = np.array([_measure(steps, *span) for span in covered]).reshape(-1, 2)
    work, closure = rows.T
    found = {
        "cycle_start": ("cycle", np.array([start for start, _ in covered])),
        "cycle_work": ("cycle", work),
        "cycle_closure": ("cycle", closure),
        "cycle_dissipated_energy": ("cycle", np.where(closure <= closed, work, np.nan)),
    }
    number = np.array([spans.index(span) + 1 for span in covered], dtype="int64")
    return describe(xr.Dataset(found).assign_coords(cycle=number))


def has_cycles(dataset: xr.Dataset) -> bool:
    """Whether the case in the attributes of a result has a whole cycle in its program."""
    segments = json.loads(dataset.attrs.get("case", "{}")).get("program", [])
    return any(segment.get("cycle", {}).get("cycles", 0) >= 1 for segment in segments)


def _program_of(dataset: xr.Dataset) -> Any:
    from roughvisc.study.statement.case import Case

    if "case" not in dataset.attrs:
        raise InputError("the result does not record its program: give program=")
    return Case.from_json(dataset.attrs["case"]).program()


def _cycles(program: Any) -> list[tuple[float, float]]:
    """Start and end of every whole cycle. [s]"""
    spans = []
    for start, segment in zip(program.corners, program.segments, strict=False):
        if segment.amplitude:
            whole = math.floor(segment.duration / segment.period * (1 + 1e-9))
            spans += [(start + k * segment.period, start + (k + 1) * segment.period) for k in range(whole)]
    return spans


def _slack(span: tuple[float, float]) -> float:
    return 1e-9 * (span[1] - span[0])


def _measure(dataset: xr.Dataset, start: float, end: float) -> tuple[float, float]:
    """Work in a cycle [J], and how far its ends are apart."""
    times, slack = dataset["time"].values, _slack((start, end))
    force, approach = (_between(times, dataset[name].values, start, end, slack) for name in ("force", "approach"))
    ends = [np.flatnonzero(np.abs(times - end) <= slack) for end in (start, end)]
    few = len(force) < _FEWEST + 1
    if "work" in dataset and all(len(found) for found in ends):
        first, last = (int(found[-1]) for found in ends)  # of a jump, the state after it
        work = float(dataset["work"][last] - dataset["work"][first])
    else:
        work = np.nan if few else float(np.sum(np.diff(approach) * (force[1:] + force[:-1]) / 2))
    across, up = np.ptp(approach), np.ptp(force)
    apart = abs(force[-1] - force[0]) * across + np.abs(force).max() * abs(approach[-1] - approach[0])
    return work, float(apart / (across * up)) if across * up > 0 and not few else np.nan


def _between(times: np.ndarray, values: np.ndarray, start: float, end: float, slack: float) -> np.ndarray:
    """Values at the ends of a span and at the kept times inside it."""
    inside = (times > start + slack) & (times < end - slack)
    return np.concatenate([[np.interp(start, times, values)], values[inside], [np.interp(end, times, values)]])
