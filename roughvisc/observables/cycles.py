"""Work done by the force in each loading cycle."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import label
from roughvisc.observables.derived import need
from roughvisc.observables.response import history

#: Times closer than this part of a period are the same.
_SAME = 1e-9


def cycle_work(dataset: xr.Dataset, *, program: Any = None) -> xr.Dataset:
    r"""Work done by the force in every cycle of the program, :math:`W = \oint F \, d\delta`.

    If force and approach at the end of a cycle equal those at its start, this is the energy dissipated in the cycle.
    Otherwise a part of it is stored, or was stored before.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``work``.
    program : Program, optional
        The program, with :meth:`Program.cycle` in it. Default: that of the case in the attributes.

    Returns
    -------
    xarray.Dataset
        ``cycle_start`` [s] and ``cycle_work`` [J] over ``cycle``, the numbers of the cycles from 1. Cycles that the
        result does not cover are left out.

    Raises
    ------
    InputError
        If no program is known, or it has no whole cycle.

    Notes
    -----
    The work of a cycle is the change of the variable ``work`` over it, which counts every accepted step. Between steps
    it is interpolated linearly.
    """
    steps = history(dataset)
    need(steps, "work")
    times, work = steps["time"].values, steps["work"].values
    spans = _cycles(_program_of(dataset) if program is None else program)
    if not spans:
        raise InputError("the program has no whole cycle: expected Program.cycle in it, or cycle in the study")
    number, starts, ends = np.array([(i, *span) for i, span in enumerate(spans, 1)]).T
    slack = _SAME * (ends - starts)
    covered = (times[0] <= starts + slack) & (ends <= times[-1] + slack)
    before, after = (_work_at(at, slack, times, work) for at in (starts, ends))
    found = xr.Dataset(
        {"cycle_start": ("cycle", starts[covered]), "cycle_work": ("cycle", (after - before)[covered])},
        coords={"cycle": number[covered].astype("int64")},
    )
    return label(found)


def _work_at(at: np.ndarray, slack: np.ndarray, times: np.ndarray, work: np.ndarray) -> np.ndarray:
    """Return the work at given times: that of the step there, after a jump if there is one; else interpolated."""
    last = np.searchsorted(times, at + slack, side="right") - 1
    return np.where(np.abs(times[last] - at) <= slack, work[last], np.interp(at, times, work))


def _program_of(dataset: xr.Dataset) -> Any:
    from roughvisc.study.case import Case

    if "case" not in dataset.attrs:
        raise InputError("the result does not record its program: give program=")
    return Case.from_json(dataset.attrs["case"]).program()


def _cycles(program: Any) -> list[tuple[float, float]]:
    """Start and end of every whole cycle. [s]"""
    spans = []
    for start, segment in zip(program.corners, program.segments, strict=False):
        if segment.amplitude:
            whole = math.floor(segment.duration / segment.period * (1 + _SAME))
            spans += [(start + k * segment.period, start + (k + 1) * segment.period) for k in range(whole)]
    return spans
