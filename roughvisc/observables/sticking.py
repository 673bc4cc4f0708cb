"""Separation of sticky surfaces: pull-off and work of separation of each cycle."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr

from roughvisc.labels import label, steps_of
from roughvisc.observables.history import expect_result


def pull_off(dataset: xr.Dataset) -> xr.Dataset:
    r"""Return the largest tension, its time, and the work of separation, of each cycle or of the whole program.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``force`` and ``approach``. All accepted steps count if the result has their history,
        otherwise its rows.

    Returns
    -------
    xarray.Dataset
        Over ``cycle``, the numbers of the whole cycles from 1, or 1 for the whole program: ``pull_off_force``, the
        largest tension or zero [N]; ``pull_off_time``, missing without tension [s]; ``work_of_separation`` [J].

    Raises
    ------
    InputError
        If the Dataset is not the result of one case over time.

    See Also
    --------
    roughvisc.adhesion, roughvisc.observables.cycle_work

    Notes
    -----
    The work of separation is the work of the tension while the surfaces recede,
    :math:`\int \min(F, 0) \, d\delta` over falling approaches :math:`\delta`. Force and approach are linear within
    steps.

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball, attraction = rv.sphere("1 mm", "0.2 mm", 24), rv.adhesion(work="50 mJ/m2", range="2 um")
    >>> press = rv.Program().approach("1 um", over="1 s").approach("-10 um", over="1 s")
    >>> body, settings = rv.elastic(1e6), {"tolerance": 0.1, "edge": "accept", "progress": False}
    >>> ds = rv.simulate(ball, body, press, adhesion=attraction, **settings)
    >>> bool(rv.observables.pull_off(ds).pull_off_force[0] > 0)
    True
    """
    dataset = expect_result(dataset, "time", "force", "approach")
    known = steps_of(dataset)
    steps = dataset if known is None else known
    time, force, approach = (np.asarray(steps[name].values) for name in ("time", "force", "approach"))
    segments = json.loads(dataset.attrs.get("cycles", "[]"))
    cycles = [
        (start + number * period, start + (number + 1) * period)
        for start, period, count in segments
        for number in range(count)
    ] or [(float(time[0]), float(time[-1]))]
    tension = np.minimum(force, 0.0)
    moved = np.minimum(np.diff(approach), 0.0)
    work = 0.5 * (tension[1:] + tension[:-1]) * moved
    columns = np.zeros((3, len(cycles)))
    for number, (begin, end) in enumerate(cycles):
        inside = np.flatnonzero((time >= begin) & (time <= end))
        lowest = inside[np.argmin(tension[inside])]
        pulls = tension[lowest] < 0
        columns[:, number] = -tension[lowest], time[lowest] if pulls else np.nan, work[inside[:-1]].sum()
    names = ("pull_off_force", "pull_off_time", "work_of_separation")
    variables = {name: ("cycle", values) for name, values in zip(names, columns, strict=True)}
    return label(xr.Dataset(variables, {"cycle": np.arange(len(cycles)) + 1}))
