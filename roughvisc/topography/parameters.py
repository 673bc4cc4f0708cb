"""Areal parameters of ISO 25178-2."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.topography.bandwidth import off_plane
from roughvisc.topography.blocks import count_of, extremes_of, known_values, mean_of, row_blocks
from roughvisc.topography.grid import checked, require_heights, spacing

#: name -> (units, long name)
PARAMETERS = {
    "Sa": ("m", "arithmetical mean height"),
    "Sq": ("m", "root mean square height"),
    "Ssk": ("1", "skewness"),
    "Sku": ("1", "kurtosis"),
    "Sz": ("m", "maximum height, highest peak to lowest valley"),
    "Sdq": ("1", "root mean square gradient, the rms slope"),
    "Sdr": ("1", "developed interfacial area ratio, excess of the surface over its projection"),
    "rms_slope_x": ("1", "root mean square slope along x"),
    "rms_slope_y": ("1", "root mean square slope along y"),
    "rms_curvature": ("1/m", "root mean square of the mean curvature, half the Laplacian"),
    "missing_fraction": ("1", "share of the points that are missing"),
}


def parameters(h: xr.DataArray, periodic: bool = False) -> xr.Dataset:
    r"""Areal surface parameters about the mean height.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), NaN where missing; level a tilted surface first. [m]
    periodic : bool, default False
        Whether differences are also taken across the border.

    Returns
    -------
    xarray.Dataset
        Scalars Sa, Sq, Sz [m], Ssk, Sku, Sdq, Sdr, rms_slope_x, rms_slope_y [-], rms_curvature [1/m] and
        missing_fraction [-], each with units and a name. Missing points and differences with them are ignored; a
        parameter without any valid point is NaN. On a strip one cell wide, heights do not vary across it.

    Raises
    ------
    InputError
        If all points are missing.

    Notes
    -----
    Slopes are first differences to the next point, curvatures second differences about a point, as in
    SurfaceTopography. They underestimate short wavelengths: a wavelength of :math:`n` cells by the factor
    :math:`\mathrm{sinc}(1/n)`. Sdr is a ratio, not in per cent.

    References
    ----------
    .. [1] ISO 25178-2:2021, Surface texture: Areal, terms, definitions and parameters.
    """
    h = checked(h, "parameters", least=1)
    require_heights(h, "parameters")
    mean, (low, high) = mean_of(h.values), extremes_of(h.values)
    centred = (known - mean for known in known_values(h.values))
    absolute, square, cube, fourth = _means((np.abs(z), z**2, z**3, z**4) for z in centred)
    gradient, excess, along_x, along_y = _means(_gradients(h, periodic))
    (curvature,) = _means(((part / 2) ** 2,) for part in _laplacian(h, periodic))
    with np.errstate(invalid="ignore", divide="ignore"):
        values = {
            "Sa": absolute,
            "Sq": np.sqrt(square),
            "Ssk": cube / square**1.5,
            "Sku": fourth / square**2,
            "Sz": (high - mean) - (low - mean),
            "Sdq": np.sqrt(gradient),
            "Sdr": excess,
            "rms_slope_x": np.sqrt(along_x),
            "rms_slope_y": np.sqrt(along_y),
            "rms_curvature": np.sqrt(curvature),
            "missing_fraction": (h.size - count_of(h.values)) / h.size,
        }
    declared = {name: {"units": units, "long_name": prose} for name, (units, prose) in PARAMETERS.items()}
    return xr.Dataset({name: ((), float(value), declared[name]) for name, value in values.items()})


def levelled_parameters(h: xr.DataArray) -> xr.Dataset:
    """:func:`parameters` of heights less their mean plane, as tables, pages and figures state them."""
    return parameters(off_plane(h))


def rms_slope(h: xr.DataArray, periodic: bool = False, depth: float = math.inf) -> float:
    """Root mean square slope, Sdq of :func:`parameters`, where the surface lies within a depth of its highest point.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), NaN where missing. [m]
    periodic : bool
        Whether differences are also taken across the border.
    depth : float
        A corner of three neighbouring points counts if one of them lies no deeper. [m]

    Returns
    -------
    float
        NaN where no point is left for it. [-]
    """
    slopes = _slopes(checked(h, "rms_slope", least=1), periodic, depth)
    return float(np.sqrt(_means((slope_x**2 + slope_y**2,) for slope_x, slope_y in slopes)[0]))


def _gradients(h: xr.DataArray, periodic: bool) -> Iterator[tuple[np.ndarray, ...]]:
    """Squared gradients, excesses of the area over the projection, and squared slopes along x and y, in blocks."""
    for slope_x, slope_y in _slopes(h, periodic):
        gradient = slope_x**2 + slope_y**2
        yield gradient, gradient / (1 + np.sqrt(1 + gradient)), slope_x**2, slope_y**2


def _slopes(h: xr.DataArray, periodic: bool, depth: float = math.inf) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """First differences along x and y where both are there, in the corner of the points (i, j), (i+1, j), (i, j+1).

    In blocks of rows.
    """
    dx, dy = spacing(h)
    lowest = extremes_of(h.values)[1] - depth if depth < math.inf else -math.inf
    for z in _with_neighbours(h.values, periodic, before=0):
        slope_x, slope_y = (z[1:, :-1] - z[:-1, :-1]) / dx, (z[:-1, 1:] - z[:-1, :-1]) / dy
        counts = np.isfinite(slope_x) & np.isfinite(slope_y)
        if depth < math.inf:
            counts &= np.maximum(np.maximum(z[1:, :-1], z[:-1, 1:]), z[:-1, :-1]) >= lowest
        yield slope_x[counts], slope_y[counts]


def _laplacian(h: xr.DataArray, periodic: bool) -> Iterator[np.ndarray]:
    """Sum of the second differences along x and y where all five points are there, in blocks of rows."""
    dx, dy = spacing(h)
    for z in _with_neighbours(h.values, periodic, before=1):
        middle = z[1:-1, 1:-1]
        laplacian = (z[2:, 1:-1] - 2 * middle + z[:-2, 1:-1]) / dx**2
        laplacian += (z[1:-1, 2:] - 2 * middle + z[1:-1, :-2]) / dy**2
        yield laplacian[np.isfinite(laplacian)]


def _with_neighbours(values: np.ndarray, periodic: bool, before: int) -> Iterator[np.ndarray]:
    """Blocks of rows with the row after them, and `before` of the ones before.

    Across the border of a map that repeats, or of a strip one cell wide, rows and columns come round; of others there
    are none beyond.
    """
    nx = len(values)
    round_x, round_y = (periodic or n == 1 for n in values.shape)
    for rows in row_blocks(values.shape):
        at = np.arange(rows.start - before, rows.stop + 1)
        block = values[at % nx if round_x else at[(at >= 0) & (at < nx)]]
        yield np.pad(block, [(0, 0), (before * round_y, int(round_y))], mode="wrap")


def _means(parts: Iterable[tuple[np.ndarray, ...]]) -> list[Any]:
    """Mean of each of several quantities that come in parts; NaN where there are no values."""
    totals, counts = [], []
    for part in parts:
        totals.append([one.sum() for one in part])
        counts.append([one.size for one in part])
    with np.errstate(invalid="ignore"):
        return [
            np.float64(total) / count
            for total, count in zip(np.sum(totals, axis=0), np.sum(counts, axis=0), strict=True)
        ]
