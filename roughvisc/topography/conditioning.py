"""Conditioning of scans: level, outliers, missing points, resampling, filters; cuts and turns from :mod:`.framing`.

Every function takes a grid and gives a new one; what was done stands in the attribute ``history``. Missing points are
NaN, and stay so until :func:`fill`.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import scipy.fft
import scipy.ndimage
import scipy.sparse
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.framing import combine, crop, invert, mirror, rotate90, taper
from roughvisc.topography.grid import (
    checked,
    counts,
    like,
    noted,
    number,
    spacing,
    valid_values,
    with_coordinates,
)

__all__ = [
    "level",
    "mask_outliers",
    "fill",
    "resample",
    "gaussian_filter",
    "crop",
    "rotate90",
    "invert",
    "combine",
    "taper",
    "mirror",
]

#: 1.4826 median absolute deviations are the standard deviation of normal noise.
_MAD = 1.4826


def level(h: xr.DataArray, order: int = 1) -> xr.DataArray:
    """Height less its least-squares polynomial over the points present.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    order : {0, 1, 2, 3}, default 1
        Total degree: mean, plane, quadratic, cubic.

    Returns
    -------
    xarray.DataArray
        Levelled height, of zero mean. [m]

    Raises
    ------
    InputError
        If the order is none of these, or the points present do not determine the polynomial.
    """
    h = checked(h, "level")
    if order not in (0, 1, 2, 3) or isinstance(order, bool):
        raise InputError(f"level: order is {order!r}: expected 0 (mean), 1 (plane), 2 or 3")
    valid_values(h, "level")
    heights = h.values - np.nanmean(h.values)  # absolute heights of instruments would cost digits
    for _ in range(2):  # the second pass refines the first: normal equations lose half the digits
        heights = heights - _polynomial(heights, order)
    return noted(like(h, heights), f"levelled: polynomial of order {order} removed")


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
    if isinstance(window, bool) or not isinstance(window, int) or window < 3 or window % 2 == 0:
        raise InputError(f"mask_outliers: window is {window!r}: expected an odd number of points of at least 3")
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
    if method not in _FILLS:
        raise InputError(f"fill: method is {method!r}: expected one of {', '.join(map(repr, _FILLS))}")
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
    return noted(filled, line, filled_points=int(marked.sum()), fill_method=method)


def resample(h: xr.DataArray, shape: int | tuple[int, int]) -> xr.DataArray:
    """Height on another number of cells over the same domain.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    shape : int or pair of int
        New number of cells ``(nx, ny)``.

    Returns
    -------
    xarray.DataArray
        Coarser: the average over the area of each new cell, which conserves the volume; missing where less than half
        of it is present. Finer: linear between the cell centres. [m]

    Raises
    ------
    InputError
        If the shape is no pair of whole numbers of at least 2.
    """
    h = checked(h, "resample")
    shape = counts("shape", shape)
    present = np.isfinite(h.values)
    along_x, along_y = (_weights(old, new) for old, new in zip(h.shape, shape, strict=True))
    total = along_x @ np.where(present, h.values, 0.0) @ along_y.T
    share = along_x @ present.astype(float) @ along_y.T
    with np.errstate(invalid="ignore", divide="ignore"):
        heights = np.where(share >= 0.5 - 1e-12, total / share, np.nan)
    axes = []
    for axis, d, old, new in zip(("x", "y"), spacing(h), h.shape, shape, strict=True):
        axes.append(float(h[axis][0]) - d / 2 + (np.arange(new) + 0.5) * (d * old / new))
    grid = with_coordinates(heights, *axes, h.attrs)
    if "filled" in h.coords:
        touched = along_x @ h["filled"].transpose("x", "y").values.astype(float) @ along_y.T > 0
        grid = grid.assign_coords(filled=(("x", "y"), touched, h["filled"].attrs))
    return noted(grid, f"resampled: {h.shape[0]} x {h.shape[1]} to {shape[0]} x {shape[1]} cells")


def gaussian_filter(
    h: xr.DataArray, cutoff: float, keep: Literal["long", "short"] = "long", periodic: bool = False
) -> xr.DataArray:
    r"""Areal Gaussian filter by normalised convolution.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    cutoff : float
        Wavelength of which half the amplitude passes; at least three cells. [m]
    keep : {"long", "short"}, default "long"
        "long": waves longer than the cut-off (an S-filter). "short": the rest (an L-filter, the roughness).
    periodic : bool, default False
        Whether the surface repeats; otherwise the weights end at its border.

    Returns
    -------
    xarray.DataArray
        Filtered height; what is missing stays missing and weighs nothing. [m]

    Raises
    ------
    InputError
        If the cut-off is less than three cells, or `keep` is neither.

    Notes
    -----
    The weight is :math:`\exp(-\pi (r / \alpha \lambda_c)^2)` with :math:`\alpha = \sqrt{\ln 2 / \pi}`, so that waves
    of length :math:`\lambda` pass by :math:`\exp(-\pi (\alpha \lambda_c / \lambda)^2)`: 50 % at the cut-off. Where
    points are missing or the scan ends, the weights of the points present are scaled to a sum of one.

    References
    ----------
    .. [1] ISO 16610-61:2015, Linear areal filters: Gaussian filters.
    """
    h = checked(h, "gaussian_filter")
    cutoff, sides = number("cutoff", cutoff, "m"), spacing(h)
    if cutoff < 3 * max(sides):
        raise InputError(
            f"gaussian_filter: cutoff is {cutoff!r}: expected at least three cells, {3 * max(sides):.6g} [m]"
        )
    if keep not in ("long", "short"):
        raise InputError(f"gaussian_filter: keep is {keep!r}: expected 'long' or 'short'")
    mean = valid_values(h, "gaussian_filter").mean()
    present = np.isfinite(h.values)
    long = np.where(present, h.values - mean, 0.0)
    share = present.astype(float)
    for axis, d in enumerate(sides):
        long, share = (_smoothed(field, axis, cutoff / d, periodic) for field in (long, share))
    with np.errstate(invalid="ignore", divide="ignore"):
        long = np.where(present, long / share + mean, np.nan)
    heights = long if keep == "long" else h.values - long
    return noted(like(h, heights), f"Gaussian filter (ISO 16610-61), {keep} waves kept, cut-off {cutoff:.6g} m")


def _polynomial(heights: np.ndarray, order: int) -> np.ndarray:
    """Least-squares polynomial over the finite points, from moments, so that no design matrix is stored."""
    present = np.isfinite(heights)
    bases = [np.polynomial.legendre.legvander(np.linspace(-1, 1, n), order) for n in heights.shape]
    terms = [(i, j) for i in range(order + 1) for j in range(order + 1 - i)]
    products = [(b[:, :, None] * b[:, None, :]).reshape(len(b), -1) for b in bases]
    moments = (products[0].T @ present.astype(float) @ products[1]).reshape([order + 1] * 4)
    normal = np.array([[moments[i, k, j, m] for k, m in terms] for i, j in terms])
    right = bases[0].T @ np.where(present, heights, 0.0) @ bases[1]
    if np.linalg.cond(normal) > 1e12:
        raise InputError(f"level: the {present.sum()} points present do not determine a polynomial of order {order}")
    coefficients = np.zeros((order + 1, order + 1))
    for (i, j), c in zip(terms, np.linalg.solve(normal, [right[i, j] for i, j in terms]), strict=True):
        coefficients[i, j] = c
    return bases[0] @ coefficients @ bases[1].T


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


def _weights(old: int, new: int) -> scipy.sparse.csr_array:
    """Rows that sum to one: shares of overlap where coarser, linear interpolation between centres where finer."""
    if new > old:
        at = np.clip((np.arange(new) + 0.5) * old / new - 0.5, 0, old - 1)
        first = np.minimum(at.astype(int), old - 2)
        share = at - first
        rows = np.arange(new)
        entries = (np.r_[1 - share, share], (np.r_[rows, rows], np.r_[first, first + 1]))
        return scipy.sparse.csr_array(entries, shape=(new, old))
    edges = np.unique(np.r_[np.arange(old + 1) * new, np.arange(new + 1) * old])  # exact, in units of 1 / (old new)
    middle = (edges[1:] + edges[:-1]) / 2
    entries = (np.diff(edges) / old, ((middle // old).astype(int), (middle // new).astype(int)))
    return scipy.sparse.csr_array(entries, shape=(new, old))


def _smoothed(field: np.ndarray, axis: int, cutoff: float, periodic: bool) -> np.ndarray:
    """Gaussian of a cut-off in cells along one axis, without normalisation at the border."""
    alpha = math.sqrt(math.log(2) / math.pi)
    if periodic:
        transmission = np.exp(-np.pi * (alpha * cutoff * scipy.fft.rfftfreq(field.shape[axis])) ** 2)
        field_q = scipy.fft.rfft(field, axis=axis)
        field_q *= transmission[:, None] if axis == 0 else transmission
        return scipy.fft.irfft(field_q, field.shape[axis], axis=axis)
    from scipy.signal import oaconvolve  # slow to import

    reach = min(math.ceil(1.5 * cutoff), field.shape[axis] - 1)  # the weight has fallen to 1e-14
    at = np.arange(-reach, reach + 1)
    weights = np.exp(-np.pi * (at / (alpha * cutoff)) ** 2)
    weights /= weights.sum()
    return oaconvolve(field, weights[:, None] if axis == 0 else weights[None], mode="same", axes=axis)
