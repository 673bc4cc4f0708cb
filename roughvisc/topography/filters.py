"""Filters of scans, on their own cells: levelling, masking of outliers, filling of missing points, Gaussian filter."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import scipy  # imports its submodules on first use: scipy.ndimage takes 0.1 s
import xarray as xr

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.topography.grid import checked, like, noted, require_heights, spacing
from roughvisc.units import Quantity, number, quantities

#: Memory of the windows that are sorted together. [byte]
_MEMORY = 1 << 24
#: Largest shift of a limit by rounding, relative to it.
_ROUNDING = 1e-9
#: Largest share of isolated points.
_MOST_ISOLATED = 0.1


def level(h: xr.DataArray, order: int = 1) -> xr.DataArray:
    """Subtract the least-squares polynomial of the points present.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    order : {0, 1, 2, 3}, default 1
        Total degree: mean, plane, quadratic, cubic.

    Returns
    -------
    xarray.DataArray
        Levelled height with zero mean. [m]

    Raises
    ------
    InputError
        If the order is not one of these, or the points present do not determine the polynomial.

    See Also
    --------
    roughvisc.inspect, roughvisc.gaussian_filter

    Examples
    --------
    >>> import roughvisc as rv
    >>> tilted = rv.from_array([[0.0, 1e-6], [2e-6, 3e-6], [4e-6, 5e-6]], spacing="1 um")
    >>> bool(abs(rv.level(tilted)).max() < 1e-15)
    True
    """
    order = int(one_of("order", order, range(4)))
    h = checked(h, "level")
    require_heights(h, "level")
    kept = {} if order == 0 else {"period": None}  # a polynomial does not repeat
    return noted(like(h, less_polynomial(h.values, order)), f"levelled: polynomial of order {order} removed", **kept)


def less_polynomial(heights: np.ndarray, order: int) -> np.ndarray:
    """Return heights minus their least-squares polynomial of total degree `order`; strips are allowed. [m]

    Only the finite points determine the polynomial. The normal equations are built from moments, so that no design
    matrix is stored.

    Raises
    ------
    InputError
        If the points present do not determine the polynomial.
    """
    heights = heights - np.nanmean(heights)  # large absolute heights would cost digits
    present = np.isfinite(heights)
    along_x, along_y = bases = [np.polynomial.legendre.legvander(np.linspace(-1, 1, n), order) for n in heights.shape]
    i, j = np.indices((order + 1, order + 1)).reshape(2, -1)
    # heights do not vary across a strip
    kept = (i + j <= order) & ((i == 0) | (heights.shape[0] > 1)) & ((j == 0) | (heights.shape[1] > 1))
    i = i[kept]
    j = j[kept]
    products = [(base[:, :, None] * base[:, None, :]).reshape(len(base), -1) for base in bases]
    moments = np.reshape(products[0].T @ present.astype(float) @ products[1], [order + 1] * 4)
    normal = moments[i[:, None], i, j[:, None], j]
    if np.linalg.cond(normal) > 1e12:
        raise InputError(f"level: the {present.sum()} points present do not determine a polynomial of order {order}")
    coefficients = np.zeros((order + 1, order + 1))
    for _ in range(2):  # the second pass refines the first: normal equations lose half the digits
        right = along_x.T @ np.where(present, heights, 0.0) @ along_y
        coefficients[i, j] = np.linalg.solve(normal, right[i, j])
        heights -= along_x @ coefficients @ along_y.T
    return heights


def off_plane(h: xr.DataArray) -> xr.DataArray:
    """Return heights minus their mean plane, or minus their mean if the finite points determine no plane. [m]"""
    try:
        return like(h, less_polynomial(h.values, 1))
    except InputError:
        return like(h, less_polynomial(h.values, 0))


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

    See Also
    --------
    roughvisc.fill, roughvisc.inspect

    Notes
    -----
    Instruments fail at steep flanks and often have spikes next to missing points. Mask these before :func:`fill`, which
    would otherwise use the spikes as the rim of the hole. Isolated points inside a large hole are outliers at any
    height, see :func:`isolated`.

    Examples
    --------
    >>> import numpy as np
    >>> import roughvisc as rv
    >>> heights = np.random.default_rng(1).normal(0.0, 1e-9, (15, 15))
    >>> heights[7, 7] = 1e-6
    >>> rv.mask_outliers(rv.from_array(heights, spacing="1 um")).attrs["outliers"]
    1
    """
    if not isinstance(window, int) or window < 3 or window % 2 == 0:
        raise InputError(key="window", found=window, expected="an odd whole number of at least 3")
    threshold = number(threshold, "1", "threshold", above=0)
    h = checked(h, "mask_outliers")
    require_heights(h, "mask_outliers")
    off = np.abs(h.values - _local_median(h.values, window))
    faintest = 1e-12 * np.nanmax(np.abs(h.values))
    # 1.4826 median absolute deviations are the standard deviation of normal noise
    scale = np.fmax(_local_median(off, window), np.nanmedian(off)) * 1.4826
    alone = isolated(np.isfinite(h.values), window)
    outlier = (off > np.maximum(threshold * scale, faintest)) | alone
    count = int(outlier.sum())
    line = f"outliers masked: {count} points beyond {threshold:g} deviations from the median of {window} x {window}"
    line += f", {alone.sum()} of them isolated" if alone.any() else ""
    return noted(like(h, np.where(outlier, np.nan, h.values)), line, outliers=count + h.attrs.get("outliers", 0))


def isolated(present: np.ndarray, window: int = 9) -> np.ndarray:
    """Return the mask of isolated points: groups of at most `window` points where most points are missing.

    If more than a tenth of all points are isolated, the scan was measured at distant points, and none counts as
    isolated.

    Parameters
    ----------
    present : ndarray of bool, shape (nx, ny)
        Points with a height. Points with a common side or corner belong to one group.
    window : int
        Side of the square window, and largest group. [points]
    """
    if present.all():
        return np.zeros_like(present)
    groups, _ = scipy.ndimage.label(present, np.ones((3, 3)))
    alone = present & (np.bincount(groups.ravel())[groups] <= window) & in_large_holes(~present, window)
    return alone & (alone.sum() <= _MOST_ISOLATED * present.sum())


def in_large_holes(missing: np.ndarray, window: int = 9) -> np.ndarray:
    """Return the mask of points in large holes, missing or not: most of the points around them are missing."""
    return scipy.ndimage.uniform_filter(missing.astype(float), window, mode="nearest") > 0.5


def fill(h: xr.DataArray) -> xr.DataArray:
    """Fill missing points by a membrane over each hole, and mark them as filled.

    The membrane satisfies Laplace's equation, without flux through the border of the scan.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]

    Returns
    -------
    xarray.DataArray
        Height without missing points. The coordinate ``filled`` over (x, y) marks the filled points; steps that
        make another grid drop it. The attributes ``filled_points`` and ``filled_fraction`` state their number and
        their share of the points. [m]

    Raises
    ------
    InputError
        If all points are missing, or they are absent on purpose (no material there).

    See Also
    --------
    roughvisc.mask_outliers, roughvisc.level

    Examples
    --------
    >>> import numpy as np
    >>> import roughvisc as rv
    >>> heights = np.ones((5, 5))
    >>> heights[2, 2] = np.nan
    >>> filled = rv.fill(rv.from_array(1e-6 * heights, spacing="1 um"))
    >>> round(float(filled[2, 2]), 9), filled.attrs["filled_points"]
    (1e-06, 1)
    """
    h = checked(h, "fill")
    if h.attrs.get("missing") == "absent":
        raise InputError("fill: the missing cells are absent (without material): expected a scan with missing points")
    require_heights(h, "fill")
    missing = np.isnan(h.values)
    before = h["filled"].values.astype(bool) if "filled" in h.coords else False
    mask = (("x", "y"), missing | before, {"long_name": "height was missing and filled in"})
    return noted(like(h, membrane(h.values)).assign_coords(filled=mask), f"filled: {missing.sum()} missing points")


@quantities(cutoff="m > 0")
def gaussian_filter(h: xr.DataArray, cutoff: Quantity, keep: Literal["long", "short"] = "long") -> xr.DataArray:
    r"""Apply an areal Gaussian filter by normalised convolution.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    cutoff : float or str
        Wavelength at which half the amplitude passes, from three cells to the longest side. [m]
    keep : {"long", "short"}, default "long"
        "long": wavelengths above the cut-off (an S-filter). "short": those below (an L-filter, the roughness).

    Returns
    -------
    xarray.DataArray
        Filtered height; missing points stay missing and have no weight. [m]

    Raises
    ------
    InputError
        If the cut-off is less than three cells or longer than the surface, or `keep` is unknown.

    See Also
    --------
    roughvisc.without_short_waves, roughvisc.level, roughvisc.resample

    Notes
    -----
    The weight is :math:`\exp(-\pi (r / \alpha \lambda_c)^2)` with :math:`\alpha = \sqrt{\ln 2 / \pi}`, so the
    transmission at the wavelength :math:`\lambda` is :math:`\exp(-\pi (\alpha \lambda_c / \lambda)^2)`: 50 % at the
    cut-off. At missing points and at the border, the weights of the remaining points are scaled to a sum of one.

    References
    ----------
    .. [1] ISO 16610-61:2015, Linear areal filters: Gaussian filters.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rough = rv.self_affine("1 mm", 64, hurst=0.8, rms_height="1 um", seed=1)
    >>> smooth = rv.gaussian_filter(rough, cutoff="0.2 mm")
    >>> bool(rv.parameters(smooth).Sdq < rv.parameters(rough).Sdq)
    True
    """
    one_of("keep", keep, ("long", "short"))
    h = checked(h, "gaussian_filter")
    sides = spacing(h)
    longest = max(side * count for side, count in zip(sides, h.shape, strict=True))
    cutoff = number(cutoff, "m", "cutoff", least=3 * max(sides) * (1 - _ROUNDING), most=longest * (1 + _ROUNDING))
    require_heights(h, "gaussian_filter")
    mean = np.nanmean(h.values)
    present = np.isfinite(h.values)
    long = np.where(present, h.values - mean, 0.0)
    share = present.astype(float)
    for axis, side in enumerate(sides):
        long, share = (_smoothed(field, axis, cutoff / side) for field in (long, share))
    with np.errstate(invalid="ignore", divide="ignore"):
        heights = np.where(present, long / share + mean, np.nan)
    line = f"Gaussian filter (ISO 16610-61), {keep} waves kept, cut-off {cutoff:.6g} m"
    return noted(like(h, heights if keep == "long" else h.values - heights), line, period=None)


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


def _local_median(values: np.ndarray, window: int) -> np.ndarray:
    """Return the median of the finite values in a square window about each point; smaller windows at the border."""

    def median(windows: np.ndarray, axis: tuple[int, ...]) -> np.ndarray:
        ordered = np.sort(windows.reshape(*windows.shape[:-2], -1), axis=-1)  # NaN last
        count = np.isfinite(ordered).sum(axis=-1, keepdims=True)
        middle = np.concatenate([np.maximum(count - 1, 0) // 2, count // 2], axis=-1)
        return np.take_along_axis(ordered, middle, axis=-1).mean(axis=-1)

    options = {"size": window, "mode": "constant", "cval": np.nan, "batch_memory": _MEMORY}
    return scipy.ndimage.vectorized_filter(values, median, **options)


def _smoothed(field: np.ndarray, axis: int, cutoff: float) -> np.ndarray:
    """Apply a Gaussian filter along one axis (cut-off in cells), without normalisation at the border."""
    count = field.shape[axis]  # zeros beyond the border, as far as the weights reach
    length = scipy.fft.next_fast_len(count + min(math.ceil(1.5 * cutoff), count), real=True)
    distance = np.minimum(np.arange(length), length - np.arange(length))
    weights = np.exp(-np.pi * (distance / (math.sqrt(math.log(2) / math.pi) * cutoff)) ** 2)
    transmission = scipy.fft.rfft(weights / weights.sum())
    field_q = scipy.fft.rfft(field, length, axis=axis)
    field_q *= transmission[:, None] if axis == 0 else transmission
    return np.take(scipy.fft.irfft(field_q, length, axis=axis), range(count), axis)
