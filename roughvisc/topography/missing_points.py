"""Missing points: masking of outliers, filling."""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy  # imports its submodules on first use: scipy.ndimage takes 0.1 s
import xarray as xr

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.topography.grid import (
    checked,
    filled_points,
    like,
    noted,
    require_heights,
    spacing,
    with_filled_points,
)
from roughvisc.units import number

#: 1.4826 median absolute deviations are the standard deviation of normal noise.
_MAD = 1.4826
#: Side of the window that distinguishes large holes from small ones, in points.
_HOLE = 9
#: Memory of the windows that are sorted together. [byte]
_MEMORY = 1 << 24


def mask_outliers(h: xr.DataArray, window: int = 9, threshold: float = 8.0) -> xr.DataArray:
    """Replace spikes by missing points.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    window : int, default 9
        Side of the square window of the local median, an odd number of points.
    threshold : float, default 8
        Largest distance of a point from the local median, in standard deviations estimated from the median absolute
        deviation, of the window or of the whole scan, whichever is larger.

    Returns
    -------
    xarray.DataArray
        The same heights, NaN at the outliers; the attribute ``outliers`` counts them. [m]

    Raises
    ------
    InputError
        If `window` is not an odd number of at least 3, or `threshold` is not positive.

    Notes
    -----
    Instruments fail at steep flanks and often have spikes next to missing points. Mask these before :func:`fill`, which
    would otherwise use the spikes as the rim of the hole.
    """
    if not isinstance(window, int) or window < 3 or window % 2 == 0:
        raise InputError(key="window", found=window, expected="an odd whole number of at least 3")
    threshold = number(threshold, "1", "threshold", above=0)
    h = checked(h, "mask_outliers")
    require_heights(h, "mask_outliers")
    off = np.abs(h.values - _local_median(h.values, window))
    faintest = 1e-12 * np.nanmax(np.abs(h.values))
    scale = np.fmax(_local_median(off, window), np.nanmedian(off)) * _MAD
    outlier = off > np.maximum(threshold * scale, faintest)
    count = int(outlier.sum())
    line = f"outliers masked: {count} points beyond {threshold:g} deviations from the median of {window} x {window}"
    return noted(like(h, np.where(outlier, np.nan, h.values)), line, outliers=count + h.attrs.get("outliers", 0))


def fill(h: xr.DataArray, method: Literal["harmonic", "nearest"] = "harmonic") -> xr.DataArray:
    """Fill missing points, and mark them as filled.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    method : {"harmonic", "nearest"}, default "harmonic"
        "harmonic": a membrane over each hole (Laplace's equation, no flux through the border of the scan). "nearest":
        the value of the nearest valid point.

    Returns
    -------
    xarray.DataArray
        Height without missing points. The coordinate ``filled`` over (x, y) marks the filled points; the attributes
        ``filled_points`` and ``fill_method`` state their number and the method. [m]

    Raises
    ------
    InputError
        If the method is unknown, all points are missing, or they are absent on purpose (no material there).
    """
    one_of("method", method, ("harmonic", "nearest"))
    h = checked(h, "fill")
    if h.attrs.get("missing") == "absent":
        raise InputError("fill: the missing cells are absent (without material): expected a scan with missing points")
    require_heights(h, "fill")
    missing = np.isnan(h.values)
    if method == "nearest":
        nearest = scipy.ndimage.distance_transform_edt(missing, spacing(h), return_distances=False, return_indices=True)
    heights = membrane(h.values) if method == "harmonic" else h.values[tuple(nearest)]
    before = filled_points(h)
    marked = with_filled_points(like(h, heights), missing if before is None else missing | before)
    return noted(marked, f"filled: {int(missing.sum())} missing points, {method}", fill_method=method)


def in_large_holes(missing: np.ndarray) -> np.ndarray:
    """Return the mask of points in large holes, missing or not: most of the points around them are missing.

    Parameters
    ----------
    missing : ndarray of bool, shape (nx, ny)
        Mask of the missing points.
    """
    return scipy.ndimage.uniform_filter(missing.astype(float), _HOLE, mode="nearest") > 0.5


def _local_median(values: np.ndarray, window: int) -> np.ndarray:
    """Return the median of the finite values in a square window about each point; smaller windows at the border."""

    def median(windows: np.ndarray, axis: tuple[int, ...]) -> np.ndarray:
        ordered = np.sort(windows.reshape(*windows.shape[:-2], -1), axis=-1)  # NaN last
        count = np.isfinite(ordered).sum(axis=-1, keepdims=True)
        middle = np.concatenate([np.maximum(count - 1, 0) // 2, count // 2], axis=-1)
        return np.take_along_axis(ordered, middle, axis=-1).mean(axis=-1)

    options = {"size": window, "mode": "constant", "cval": np.nan, "batch_memory": _MEMORY}
    return scipy.ndimage.vectorized_filter(values, median, **options)


def membrane(heights: np.ndarray) -> np.ndarray:
    r"""Return heights with a membrane over each hole: Laplace's equation, no flux through the border. [m]

    :math:`\sum_n (h_n - h_p) = 0` over the neighbours of every missing point: four, or fewer at the border of the scan.
    """
    missing = np.isnan(heights)
    if not missing.any():
        return heights.copy()
    from SurfaceTopography import Topography  # slow to import

    mean = np.nanmean(heights)
    spanned = Topography(np.ma.array(heights - mean, mask=missing), heights.shape).interpolate_undefined_data()
    return np.where(missing, mean + spanned.heights(), heights)
