"""Histories of every accepted step, and the work done by the force in each loading cycle."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import label, steps_of
from roughvisc.observables.frames import need
from roughvisc.variables import STEPPED

#: Times closer than this part of a period count as equal.
_SAME = 1e-9


def history(dataset: xr.Dataset) -> xr.Dataset:
    """Return the histories at every accepted step, under the names of the histories at the kept times.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.

    Returns
    -------
    xarray.Dataset
        Force, approach, area, mean gap and work over ``time`` at every accepted step. If the Dataset carries no steps,
        its rows are returned.

    Raises
    ------
    InputError
        If the Dataset contains several cases.
    """
    need(dataset, "time")
    if "time" not in dataset.dims or "case" in dataset.dims:
        raise InputError(f"the Dataset has dimensions {', '.join(map(str, dataset.sizes))}: choose one case first")
    steps = steps_of(dataset)
    if steps is not None:
        return steps.swap_dims(step="time").drop_attrs(deep=False)
    rows = dataset[[name for name in STEPPED if name in dataset]].drop_attrs(deep=False)
    return rows.drop_vars([name for name, one in rows.coords.items() if not one.dims])


def cycle_work(dataset: xr.Dataset) -> xr.Dataset:
    r"""Return the work done by the force in every cycle of the program, :math:`W = \oint F \, d\delta`.

    If force and approach are equal at the start and the end of a cycle, the work is the energy dissipated in the cycle.
    Otherwise a part of the work is stored, or was stored before.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``work``, under a program with :meth:`Program.cycle`.

    Returns
    -------
    xarray.Dataset
        ``cycle_start`` [s] and ``cycle_work`` [J] over ``cycle``, the numbers of the cycles from 1. Cycles that the
        result does not cover are left out.

    Raises
    ------
    InputError
        If the program has no whole cycle.

    Notes
    -----
    The work of a cycle is the change of the variable ``work`` in the cycle, over all accepted steps. Between steps
    ``work`` is interpolated linearly.
    """
    steps = history(dataset)
    need(steps, "work")
    times = steps["time"].values
    segments = json.loads(dataset.attrs.get("cycles", "[]"))
    begin = np.array([start + number * period for start, period, count in segments for number in range(count)])
    period = np.repeat([one[1] for one in segments], [int(one[2]) for one in segments])
    if not begin.size:
        expected = "one case's result, under a program with a whole cycle: see Program.cycle"
        raise InputError(key="cycles", found=segments, expected=expected)
    covered = (times[0] <= begin + _SAME * period) & (begin + period <= times[-1] + _SAME * period)
    begin, end = begin[covered], (begin + period)[covered]
    work = np.interp(end, times, steps["work"]) - np.interp(begin, times, steps["work"])
    found = xr.Dataset(
        {"cycle_start": ("cycle", begin), "cycle_work": ("cycle", work)},
        coords={"cycle": np.flatnonzero(covered) + 1},
    )
    return label(found)
