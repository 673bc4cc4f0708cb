"""Borders of surfaces: periodicity, mirror symmetry, and steps between opposite borders."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from roughvisc.topography.grid import spacing

#: Opposite borders form a step if their difference exceeds this multiple of the difference of neighbouring rows.
JUMP = 2.0
#: History line of a surface that was extended by its mirror images.
MIRRORED = "mirrored along x and y"


def border_mismatch(h: xr.DataArray) -> tuple[float, float]:
    """Return the difference of opposite borders over the difference of neighbouring rows, along x and along y.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights; missing points are ignored. [m]

    Returns
    -------
    pair of float
        Ratio of root mean square differences. Zero along an axis of one cell, and for a flat surface. Above
        :data:`JUMP`, the repeated surface has a step. [-]
    """
    values = h.transpose("x", "y").values
    ratios = []
    for axis in (0, 1):
        sizes = []
        for step in (values.take(0, axis) - values.take(-1, axis), np.diff(values, axis=axis)):
            known = step[np.isfinite(step)]
            sizes.append(math.sqrt((known**2).mean()) if known.size else 0.0)
        across, beside = sizes
        ratios.append(across / beside if beside > 0 else 0.0)
    return ratios[0], ratios[1]


def period_of(h: xr.DataArray) -> list[float]:
    """Return the sides of a grid, which the attribute ``period`` of a periodic surface records. [m]"""
    nx, ny = h.shape
    dx, dy = spacing(h)
    return [nx * dx, ny * dy]


def is_periodic(h: xr.DataArray) -> bool:
    """Return whether a surface was generated as periodic and its grid is still one period.

    Attributes survive selection and arithmetic. Therefore the attribute ``period`` counts only under two conditions: it
    equals the sides of the grid, and the step at the borders is at most four times the difference of neighbouring rows.

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights. [m]
    """
    period = np.asarray(h.attrs.get("period", ()))
    if period.shape != (2,) or not np.allclose(period, period_of(h), rtol=1e-6, atol=0):
        return False
    return max(border_mismatch(h)) <= 2 * JUMP


def is_mirrored(h: xr.DataArray) -> bool:
    """Return whether a surface was extended by its mirror images and still repeats, see :func:`is_periodic`."""
    return MIRRORED in str(h.attrs.get("history", "")).split("\n") and is_periodic(h)
