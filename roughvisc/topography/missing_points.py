"""Missing points: masking of outliers, filling."""

from __future__ import annotations

import warnings
from typing import Literal

import numpy as np
import scipy.ndimage
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.arguments import FILL, WINDOW
from roughvisc.topography.grid import checked, like, noted, number, spacing, valid_values

#: 1.4826 median absolute deviations are the standard deviation of normal noise.
_MAD = 1.4826


def mask_outliers(h: xr.DataArray, window: int = 9, threshold: float = 8.0) -> xr.DataArray:
    """Height with spikes made missing.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    window : int, default 9
        Side of the square window of the local median, an odd number of points.
    threshold : float, default 8
        How far a point may be from the local median, in standard deviations as the median absolute deviation
        estimates them; the larger of the window's own and the whole scan's counts.

    Returns
    -------
    xarray.DataArray
        The same heights, NaN at the outliers; the attribute ``outliers`` counts them. [m]

    Raises
    ------
    InputError
        If `window` is not an odd number of at least 3, or `threshold` not positive.

    Notes
    -----
    Instruments fail at steep flanks and put spikes beside the missing points. Mask them before :func:`fill`, which
    would take the spikes for the rim of the hole.
    """
    h = checked(h, "mask_outliers")
    WINDOW.check("mask_outliers: window", window)
    threshold = number("threshold", threshold, "-")
    valid_values(h, "mask_outliers")
    off = np.abs(h.values - _local_median(h.values, window))
    scale = np.fmax(_local_median(off, window), np.nanmedian(off)) * _MAD
    outlier = off > np.maximum(threshold * scale, 1e-12 * np.nanmax(np.abs(h.values)))
    count = int(outlier.sum())
    line = f"outliers masked: {count} points beyond {threshold:g} deviations from the median of {window} x {window}"
    return noted(like(h, np.where(outlier, np.nan, h.values)), line, outliers=count + h.attrs.get("outliers", 0))


def fill(h: xr.DataArray, method: Literal["harmonic", "nearest", "linear"] = "harmonic") -> xr.DataArray:
    """Height with its missing points filled in, and marked as such.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    method : {"harmonic", "nearest", "linear"}, default "harmonic"
        "harmonic": the membrane spanned over each hole (Laplace's equation, no flux through the scan's border).
        "nearest": the value of the nearest point present. "linear": on the triangles between points present, the
        nearest outside of them.

    Returns
    -------
    xarray.DataArray
        Height without missing points; the coordinate ``filled`` over (x, y) marks those that were, the attributes
        ``filled_points`` and ``fill_method`` say how many and how. [m]

    Raises
    ------
    InputError
        If the method is another, all points are missing, or they are absent on purpose (no material there).
    """
    h = checked(h, "fill")
    FILL.check("fill: method", method)
    if h.attrs.get("missing") == "absent":
        raise InputError(
            "fill: the missing cells are absent (there is no material): expected a scan with missing points"
        )
    valid_values(h, "fill")
    missing = np.isnan(h.values)
    heights = np.where(missing, _FILLS[method](h, missing), h.values) if missing.any() else h.values.copy()
    marked = missing | (h["filled"].transpose("x", "y").values.astype(bool) if "filled" in h.coords else False)
    filled = like(h, heights).assign_coords(
        filled=(("x", "y"), marked, {"long_name": "height was missing and filled in"})
    )
    line = f"filled: {int(missing.sum())} missing points, {method}"
    return noted(filled, line, fill_method=method)


def _local_median(values: np.ndarray, window: int) -> np.ndarray:
    """Median over a square window of the finite values, NaN where there are none; smaller windows at the border."""
    reach = window // 2
    padded = np.pad(values, reach, constant_values=np.nan)
    result = np.empty_like(values)
    rows = max(1, 2_000_000 // (window**2 * values.shape[1]))
    for start in range(0, len(values), rows):  # in blocks: a window's worth of copies of the whole would be large
        block = padded[start : start + rows + 2 * reach]
        stacked = np.lib.stride_tricks.sliding_window_view(block, (window, window)).reshape(
            *(-1, values.shape[1]), window**2
        )
        ordered = np.sort(stacked, axis=-1)  # NaN last
        count = np.isfinite(ordered).sum(axis=-1)[..., None]
        low = np.take_along_axis(ordered, np.maximum((count - 1) // 2, 0), axis=-1)
        high = np.take_along_axis(ordered, np.minimum(count // 2, window**2 - 1), axis=-1)
        result[start : start + rows] = np.where(count > 0, (low + high) / 2, np.nan)[..., 0]
    return result


def _harmonic(h: xr.DataArray, missing: np.ndarray) -> np.ndarray:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the library's imports
        from SurfaceTopography import Topography

    offset = np.nanmean(h.values)
    masked = np.ma.masked_array(np.where(missing, 0.0, h.values - offset), mask=missing)
    return offset + np.asarray(Topography(masked, h.shape).interpolate_undefined_data().heights())


def _nearest(h: xr.DataArray, missing: np.ndarray) -> np.ndarray:
    nearest = scipy.ndimage.distance_transform_edt(missing, spacing(h), return_distances=False, return_indices=True)
    return h.values[tuple(nearest)]


def _linear(h: xr.DataArray, missing: np.ndarray) -> np.ndarray:
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError

    heights = _nearest(h, missing)
    # the points that border a hole are enough; all would be triangulated for minutes
    rim = scipy.ndimage.binary_dilation(missing, np.ones((3, 3)), iterations=2) & ~missing
    sides = np.array(spacing(h))
    try:
        between = LinearNDInterpolator(np.argwhere(rim) * sides / sides.max(), h.values[rim])
    except QhullError:  # all on one line: the nearest are all there is
        return heights
    inside = between(np.argwhere(missing) * sides / sides.max())
    heights[missing] = np.where(np.isnan(inside), heights[missing], inside)
    return heights


_FILLS = {"harmonic": _harmonic, "nearest": _nearest, "linear": _linear}
