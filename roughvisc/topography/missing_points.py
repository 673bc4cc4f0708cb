"""Missing points: masking of outliers, filling."""

from __future__ import annotations

from collections.abc import Iterator
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
    number,
    require_heights,
    spacing,
    with_filled_points,
)

#: 1.4826 median absolute deviations are the standard deviation of normal noise.
_MAD = 1.4826
#: Side of the window that distinguishes large holes from small ones, in points.
_HOLE = 9
#: Largest count of numbers sorted in one block.
_AT_ONCE = 2_000_000


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
    threshold = number("threshold", threshold, "-")
    h = checked(h, "mask_outliers")
    require_heights(h, "mask_outliers")
    off = np.empty_like(h.values)
    for rows, median in _local_median(h.values, window):
        off[rows] = np.abs(h.values[rows] - median)
    typical, faintest = np.nanmedian(off), 1e-12 * np.nanmax(np.abs(h.values))
    outlier = np.empty(h.shape, dtype=bool)
    for rows, median in _local_median(off, window):
        scale = np.fmax(median, typical) * _MAD
        outlier[rows] = off[rows] > np.maximum(threshold * scale, faintest)
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
    heights = h.values.copy()
    if missing.any():
        spanned = harmonic(h.values, missing) if method == "harmonic" else _nearest(h.values, missing, spacing(h))
        heights[missing] = spanned
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


def _local_median(values: np.ndarray, window: int) -> Iterator[tuple[slice, np.ndarray]]:
    """Yield blocks of rows, and the median of the finite values in a square window about each of their points.

    The median is NaN if a window has no finite value. Windows are smaller at the border. Blocks limit the memory, which
    holds one copy of the rows for each point of a window.
    """
    reach = window // 2
    rows = max(1, _AT_ONCE // (window**2 * values.shape[1]))
    for start in range(0, len(values), rows):
        stop = min(start + rows, len(values))
        first, last = max(start - reach, 0), min(stop + reach, len(values))
        beyond = (first - (start - reach), stop + reach - last)
        block = np.pad(values[first:last], [beyond, (reach, reach)], constant_values=np.nan)
        stacked = np.lib.stride_tricks.sliding_window_view(block, (window, window)).reshape(
            *(-1, values.shape[1]), window**2
        )
        ordered = np.sort(stacked, axis=-1)  # NaN last
        count = np.isfinite(ordered).sum(axis=-1)[..., None]
        low = np.take_along_axis(ordered, np.maximum((count - 1) // 2, 0), axis=-1)
        high = np.take_along_axis(ordered, np.minimum(count // 2, window**2 - 1), axis=-1)
        yield slice(start, stop), np.where(count > 0, (low + high) / 2, np.nan)[..., 0]


def harmonic(heights: np.ndarray, missing: np.ndarray) -> np.ndarray:
    r"""Return the heights of a membrane over each hole, row by row. [m]

    :math:`\sum_n (h_n - h_p) = 0` over the neighbours of every missing point: four, or fewer at the border of the scan,
    which has zero flux.
    """
    from scipy.sparse.linalg import spsolve  # slow to import

    number = np.cumsum(missing).reshape(missing.shape) - 1  # of the missing points
    count, mean = int(number[-1, -1]) + 1, np.nanmean(heights)
    diagonal, right = np.zeros(count), np.zeros(count)
    rows, columns = [np.arange(count)], [np.arange(count)]
    low, high, every = slice(None, -1), slice(1, None), slice(None)
    for here, there in (((low, every), (high, every)), ((every, low), (every, high))):
        for one, other in ((here, there), (there, here)):
            diagonal[number[one][missing[one]]] += 1.0
            both, rim = missing[one] & missing[other], missing[one] & ~missing[other]
            rows.append(number[one][both])
            columns.append(number[other][both])
            right[number[one][rim]] += heights[other][rim] - mean
    entries = np.concatenate([diagonal, np.full(sum(map(len, rows)) - count, -1.0)])
    laplace = scipy.sparse.csc_array((entries, (np.concatenate(rows), np.concatenate(columns))), shape=(count, count))
    return np.asarray(mean + spsolve(laplace, right, permc_spec="MMD_AT_PLUS_A"))


def _nearest(heights: np.ndarray, missing: np.ndarray, sides: tuple[float, float]) -> np.ndarray:
    """Return the nearest present height for each missing point. [m]"""
    nearest = scipy.ndimage.distance_transform_edt(missing, sides, return_distances=False, return_indices=True)
    return heights[nearest[0][missing], nearest[1][missing]]
