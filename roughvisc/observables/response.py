"""Histories of every accepted step."""

from __future__ import annotations

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.observables.derived import need_history
from roughvisc.steps import steps_of
from roughvisc.variables import STEPPED


def history(dataset: xr.Dataset) -> xr.Dataset:
    """Histories of every accepted step, under the names of those at the kept times.

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
    need_history(dataset, "time")
    if "time" not in dataset.dims or "case" in dataset.dims:
        raise InputError(f"the Dataset has dimensions {', '.join(map(str, dataset.sizes))}: choose one case first")
    steps = steps_of(dataset)
    if steps is not None:
        return steps.swap_dims(step="time").drop_attrs(deep=False)
    rows = dataset[[name for name in STEPPED if name in dataset]].drop_attrs(deep=False)
    return rows.drop_vars([name for name, one in rows.coords.items() if not one.dims])
