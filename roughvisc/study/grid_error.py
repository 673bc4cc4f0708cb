"""What the grid alone costs in accuracy: the same history on cells twice as long, and Richardson's extrapolation."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable

import numpy as np
import xarray as xr

from roughvisc.errors import RoughviscError
from roughvisc.study.coarser import coarser, pressure_distance
from roughvisc.study.richardson import ORDERS

log = logging.getLogger("roughvisc")


def with_grid_error(
    dataset: xr.Dataset, height: xr.DataArray, press_again: Callable[[xr.DataArray, list[float]], xr.Dataset]
) -> xr.Dataset:
    """A result with ``grid_error`` and ``grid_error_area`` at its kept times.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result with ``pressure``.
    height : xarray.DataArray
        The surface that it was computed from, before the grid grew. [m]
    press_again : callable
        Computes the same on another surface, at given times, with ``pressure``.

    Notes
    -----
    From the difference ``d`` to the coarser solution, whose cells are ``r`` times longer, an error that vanishes with
    the power ``p`` of the cell's side is ``d / (r^p - 1)``. Both solutions have an error in time within the
    tolerance, so that this is no estimate much below it. Missing where there is no coarser solution.
    """
    try:
        few = coarser(height, 2.0)
        again = press_again(few, [float(t) for t in dataset["time"].values])
    except RoughviscError as error:
        log.warning("no grid error: the coarser solve failed: %s", error)
        nothing = np.full(dataset.sizes["time"], math.nan)
        return dataset.assign(grid_error=("time", nothing), grid_error_area=("time", nothing))
    ratio = math.sqrt(height.size / few.size)
    pressure = pressure_distance(again, dataset) / max(float(dataset["force"].max()), 1e-300)
    approach = _change(again["approach"].values, dataset["approach"].values)
    area = _change(again["contact_area_corrected"].values, dataset["contact_area_corrected"].values)
    over = {name: ratio**order - 1 for name, order in ORDERS.items()}
    error = np.maximum(pressure / over["pressure"], approach / over["approach"])
    return dataset.assign(grid_error=("time", error), grid_error_area=("time", area / over["contact_area_corrected"]))


def _change(found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Difference over the largest value."""
    return np.abs(found - wanted) / max(float(np.max(np.abs(wanted))), 1e-300)
