"""Bandwidth of scans: removal of form, Gaussian filter."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import scipy.fft
import xarray as xr

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.topography.grid import checked, like, noted, require_heights, spacing
from roughvisc.units import Quantity, format_quantity, quantities


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
    """
    order = int(one_of("order", order, range(4)))
    h = checked(h, "level")
    require_heights(h, "level")
    kept = {} if order == 0 else {"period": None}  # a polynomial does not repeat
    return noted(like(h, less_polynomial(h.values, order)), f"levelled: polynomial of order {order} removed", **kept)


def less_polynomial(heights: np.ndarray, order: int) -> np.ndarray:
    """Return heights minus their least-squares polynomial of total degree `order`; strips are allowed. [m]

    Only the finite points determine the polynomial.

    Raises
    ------
    InputError
        If the points present do not determine the polynomial.
    """
    heights = heights - np.nanmean(heights)  # large absolute heights would cost digits
    for _ in range(2):  # the second pass refines the first: normal equations lose half the digits
        left, coefficients, right = _polynomial(heights, order)
        heights -= left @ coefficients @ right.T
    return heights


def off_plane(h: xr.DataArray) -> xr.DataArray:
    """Return heights minus their mean plane, or minus their mean if the finite points determine no plane. [m]"""
    try:
        return like(h, less_polynomial(h.values, 1))
    except InputError:
        return like(h, less_polynomial(h.values, 0))


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

    Notes
    -----
    The weight is :math:`\exp(-\pi (r / \alpha \lambda_c)^2)` with :math:`\alpha = \sqrt{\ln 2 / \pi}`, so the
    transmission at the wavelength :math:`\lambda` is :math:`\exp(-\pi (\alpha \lambda_c / \lambda)^2)`: 50 % at the
    cut-off. At missing points and at the border, the weights of the remaining points are scaled to a sum of one.

    References
    ----------
    .. [1] ISO 16610-61:2015, Linear areal filters: Gaussian filters.
    """
    one_of("keep", keep, ("long", "short"))
    h = checked(h, "gaussian_filter")
    sides = spacing(h)
    longest = max(side * count for side, count in zip(sides, h.shape, strict=True))
    if not 3 * max(sides) <= cutoff <= longest:
        least, most = (format_quantity(one, "m") for one in (3 * max(sides), longest))
        expected = f"a length [m], or text with a unit, from three cells ({least}) to the longest side ({most})"
        raise InputError(key="cutoff", found=cutoff, expected=expected)
    require_heights(h, "gaussian_filter")
    mean, present = np.nanmean(h.values), np.isfinite(h.values)
    long, share = np.where(present, h.values - mean, 0.0), present.astype(float)
    for axis, side in enumerate(sides):
        long, share = (_smoothed(field, axis, cutoff / side) for field in (long, share))
    with np.errstate(invalid="ignore", divide="ignore"):
        heights = np.where(present, long / share + mean, np.nan)
    line = f"Gaussian filter (ISO 16610-61), {keep} waves kept, cut-off {cutoff:.6g} m"
    return noted(like(h, heights if keep == "long" else h.values - heights), line, period=None)


def _polynomial(heights: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the least-squares polynomial over the finite points: basis along x, coefficients, basis along y.

    The normal equations are built from moments, so that no design matrix is stored.
    """
    bases = [np.polynomial.legendre.legvander(np.linspace(-1, 1, n), order) for n in heights.shape]
    degrees = [order if n > 1 else 0 for n in heights.shape]  # heights do not vary across a strip
    i, j = np.transpose([(i, j) for i in range(degrees[0] + 1) for j in range(min(degrees[1], order - i) + 1)])
    products = [(b[:, :, None] * b[:, None, :]).reshape(len(b), -1) for b in bases]
    present = np.isfinite(heights)
    moments = np.reshape(products[0].T @ present.astype(float) @ products[1], [order + 1] * 4)
    right = bases[0].T @ np.where(present, heights, 0.0) @ bases[1]
    normal = moments[i[:, None], i, j[:, None], j]
    if np.linalg.cond(normal) > 1e12:
        raise InputError(f"level: the {present.sum()} points present do not determine a polynomial of order {order}")
    coefficients = np.zeros((order + 1, order + 1))
    coefficients[i, j] = np.linalg.solve(normal, right[i, j])
    return bases[0], coefficients, bases[1]


def _smoothed(field: np.ndarray, axis: int, cutoff: float) -> np.ndarray:
    """Apply a Gaussian filter along one axis (cut-off in cells), without normalisation at the border."""
    count = field.shape[axis]  # zeros beyond the border, as far as the weights reach
    length = scipy.fft.next_fast_len(count + min(math.ceil(1.5 * cutoff), count), real=True)
    at = np.minimum(np.arange(length), length - np.arange(length))
    weights = np.exp(-np.pi * (at / (math.sqrt(math.log(2) / math.pi) * cutoff)) ** 2)
    transmission = scipy.fft.rfft(weights / weights.sum())
    field_q = scipy.fft.rfft(field, length, axis=axis)
    field_q *= transmission[:, None] if axis == 0 else transmission
    return np.take(scipy.fft.irfft(field_q, length, axis=axis), range(count), axis)
