"""Observables of histories: every accepted step, growth of the area, stiffness, work."""

from __future__ import annotations

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import describe
from roughvisc.observables.derived import along_time, need_history
from roughvisc.steps import steps_of
from roughvisc.units import Quantity, quantities
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


def _slope(value: np.ndarray, over: np.ndarray) -> np.ndarray:
    """Derivative along a path: second order where ``over`` runs on, the last secant where it turns or starts."""
    if len(over) < 2:
        return np.full(len(over), np.nan)
    step = np.diff(over)
    moving = np.abs(step) > 1e-12 * np.max(np.abs(over), initial=0.0, where=np.isfinite(over))
    secant = np.where(moving, np.diff(value) / np.where(moving, step, 1.0), np.nan)
    slope = np.concatenate([secant[:1], secant])
    before, after = step[:-1], step[1:]
    runs_on = moving[:-1] & moving[1:] & (before * after > 0)
    total = np.where(runs_on, before + after, 1.0)
    slope[1:-1] = np.where(runs_on, (secant[:-1] * after + secant[1:] * before) / total, slope[1:-1])
    return slope


@quantities(since="s")
def area_growth(dataset: xr.Dataset, *, since: Quantity = 0.0) -> xr.Dataset:
    """Growth exponent of the contact area, ``d ln(area) / d ln(time - since)``.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.
    since : float or str
        Time from which the growth is measured, such as the end of a loading ramp. [s]

    Returns
    -------
    xarray.Dataset
        ``area_growth_exponent`` over time; missing up to ``since`` and while there is no contact. [1]

    Raises
    ------
    InputError
        If the result holds no contact area.
    """
    need_history(dataset, "contact_area")

    def measure(area, time):
        grown = (time > since) & (area > 0)
        exponent = np.full(len(time), np.nan)
        exponent[grown] = _slope(np.log(area[grown]), np.log(time[grown] - since))
        return exponent

    return describe(xr.Dataset({"area_growth_exponent": along_time(measure, dataset["contact_area"], dataset["time"])}))


def secant_stiffness(dataset: xr.Dataset) -> xr.Dataset:
    """Slope of force against approach along the history, including creep between kept times.

    The stiffness of the contact itself at a time is :func:`~roughvisc.observables.incremental_stiffness`.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.

    Returns
    -------
    xarray.Dataset
        ``secant_stiffness`` over time: central differences while the approach is monotone, the last secant where it
        turns; missing while it is constant. [N/m]

    Raises
    ------
    InputError
        If the result holds no force or no approach.
    """
    need_history(dataset, "force", "approach")
    return describe(xr.Dataset({"secant_stiffness": along_time(_slope, dataset["force"], dataset["approach"])}))


def work(dataset: xr.Dataset) -> xr.Dataset:
    """Work done by the force since the first kept time: the trapezoidal integral of force over approach.

    Over a loop that closes in force and approach its change is the energy dissipated. A result's own ``work`` counts
    every accepted step.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result. What a jump at its very start did is not in it: one state of it is kept.

    Returns
    -------
    xarray.Dataset
        ``trapezoidal_work`` over time. [J]

    Raises
    ------
    InputError
        If the result holds no force or no approach.
    """
    need_history(dataset, "force", "approach")

    def measure(force, approach):
        done = np.diff(approach) * (force[1:] + force[:-1]) / 2
        return np.concatenate([np.zeros(min(len(force), 1)), np.cumsum(done)])

    return describe(xr.Dataset({"trapezoidal_work": along_time(measure, dataset["force"], dataset["approach"])}))
