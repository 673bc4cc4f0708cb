"""Bandwidth of scans: removal of form, Gaussian filter, other numbers of cells."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import scipy.fft
import scipy.sparse
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.arguments import KEEP, ORDER
from roughvisc.topography.blocks import column_blocks, mean_of, row_blocks
from roughvisc.topography.grid import (
    checked,
    counts,
    like,
    noted,
    number,
    require_heights,
    resampled_taper,
    spacing,
    with_coordinates,
    with_taper_weights,
)
from roughvisc.topography.missing_points import fill


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
    ORDER.check("level: order", order)
    require_heights(h, "level")
    return noted(like(h, less_polynomial(h.values, order)), f"levelled: polynomial of order {order} removed")


def less_polynomial(heights: np.ndarray, order: int) -> np.ndarray:
    """Heights less their least-squares polynomial of total degree `order` over the finite points; of a strip too. [m]

    Raises
    ------
    InputError
        If the points present do not determine the polynomial.
    """
    total = sum(np.nansum(heights[rows]) for rows in row_blocks(heights.shape))
    count = sum(np.count_nonzero(~np.isnan(heights[rows])) for rows in row_blocks(heights.shape))
    heights = heights - total / count  # absolute heights of instruments would cost digits
    for _ in range(2):  # the second pass refines the first: normal equations lose half the digits
        left, coefficients, right = _polynomial(heights, order)
        for rows in row_blocks(heights.shape):
            heights[rows] -= left[rows] @ coefficients @ right.T
    return heights


def off_plane(h: xr.DataArray) -> xr.DataArray:
    """Height less its mean plane; less its mean where the points present determine no plane. [m]"""
    try:
        return like(h, less_polynomial(h.values, 1))
    except InputError:
        return like(h, less_polynomial(h.values, 0))


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
    KEEP.check("gaussian_filter: keep", keep)
    require_heights(h, "gaussian_filter")
    heights = _long_waves(h.values, [cutoff / d for d in sides], periodic)
    if keep == "short":
        np.subtract(h.values, heights, out=heights)
    return noted(like(h, heights), f"Gaussian filter (ISO 16610-61), {keep} waves kept, cut-off {cutoff:.6g} m")


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
    heights, filled = _means(h, shape)
    return _on_cells(h, heights, filled, "resampled")


def band_limit(h: xr.DataArray, shape: int | tuple[int, int]) -> xr.DataArray:
    """Height on another number of cells over the same domain, with all waves that both grids hold and no others.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    shape : int or pair of int
        New number of cells ``(nx, ny)``.

    Returns
    -------
    xarray.DataArray
        Height at the centres of the new cells, of the same mean; missing where less than half of a cell is present. [m]

    Raises
    ------
    InputError
        If the shape is no pair of whole numbers of at least 2, or cells are absent (no material there).

    Notes
    -----
    The surface and its mirror images are a sum of cosines; a coarser grid keeps those longer than two of its cells, and
    their slopes. :func:`resample` takes means, which lessen waves up to ten cells long and let shorter ones through as
    waves that are not there: on cells twice as long the contact area is then off by 1.2 to 1.8 times as much, and mean
    gap and approach by 2 to 100 times (docs/howto/big-scans.md). Missing points are bridged as :func:`fill` does.
    """
    h = checked(h, "band_limit")
    shape = counts("shape", shape)
    if h.attrs.get("missing") == "absent":
        raise InputError("band_limit: cells are absent (there is no material): expected a surface, or take resample")
    whole = h if all(np.isfinite(h.values[rows]).all() for rows in row_blocks(h.shape)) else fill(h)
    heights, filled = _cosines(whole.values, shape), None
    if whole is not h or "filled" in h.coords:
        means, filled = _means(h, shape)
        heights[np.isnan(means)] = np.nan
    return _on_cells(h, heights, filled, "band-limited")


def _means(h: xr.DataArray, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray | None]:
    """Means over other cells, linear between centres where they are finer, and where a filled point has a part."""
    return averaged(h, *(_weights(old, new) for old, new in zip(h.shape, shape, strict=True)))


def _cosines(heights: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Heights at the centres of other cells, from the cosines that both grids hold. [m]"""
    (nx, ny), (mx, my) = heights.shape, shape
    along_y = np.empty((nx, min(ny, my)))
    for rows in row_blocks((nx, max(ny, my))):
        along_y[rows] = scipy.fft.dct(heights[rows], axis=1, norm="ortho")[:, :my]
    found = np.empty((mx, min(ny, my)))
    for columns in column_blocks(along_y.shape):
        along_x = scipy.fft.dct(along_y[columns], axis=0, norm="ortho")[:mx]
        found[columns] = scipy.fft.idct(along_x, n=mx, axis=0, norm="ortho")
    result = np.empty(shape)
    for rows in row_blocks((mx, max(ny, my))):
        result[rows] = scipy.fft.idct(found[rows], n=my, axis=1, norm="ortho") * math.sqrt(mx * my / (nx * ny))
    return result


def _on_cells(h: xr.DataArray, heights: np.ndarray, filled: np.ndarray | None, done: str) -> xr.DataArray:
    """Heights over the domain of a grid on another number of cells, with what was done. [m]"""
    axes = []
    for axis, d, old, new in zip(("x", "y"), spacing(h), h.shape, heights.shape, strict=True):
        axes.append(float(h[axis][0]) - d / 2 + (np.arange(new) + 0.5) * (d * old / new))
    grid = with_taper_weights(with_coordinates(heights, *axes, h.attrs), resampled_taper(h, heights.shape))
    if filled is not None:
        grid = grid.assign_coords(filled=(("x", "y"), filled, h["filled"].attrs))
    return noted(grid, f"{done}: {h.shape[0]} x {h.shape[1]} to {heights.shape[0]} x {heights.shape[1]} cells")


def averaged(
    h: xr.DataArray, along_x: scipy.sparse.csr_array, along_y: scipy.sparse.csr_array
) -> tuple[np.ndarray, np.ndarray | None]:
    """Heights on another grid by weights along each axis, whose rows sum to one.

    Returns
    -------
    heights : ndarray
        Means over the points present; missing where they have less than half the weight. [m]
    filled : ndarray or None
        Where a point that was filled in has a part.
    """
    filled = h["filled"].transpose("x", "y").values if "filled" in h.coords else None
    heights = np.empty((along_x.shape[0], along_y.shape[0]))
    marked = None if filled is None else np.empty(heights.shape, dtype=bool)
    for rows in row_blocks(heights.shape):
        weights = along_x[rows]
        reach = slice(int(weights.indices.min()), int(weights.indices.max()) + 1)
        weights, known = weights[:, reach], h.values[reach]
        present = np.isfinite(known)
        total = weights @ np.where(present, known, 0.0) @ along_y.T
        share = weights @ present.astype(float) @ along_y.T
        with np.errstate(invalid="ignore", divide="ignore"):
            heights[rows] = np.where(share >= 0.5 - 1e-12, total / share, np.nan)
        if filled is not None and marked is not None:
            marked[rows] = weights @ filled[reach].astype(float) @ along_y.T > 0
    return heights, marked


def _polynomial(heights: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Least-squares polynomial over the finite points: basis along x, coefficients, basis along y.

    From moments, so that no design matrix is stored.
    """
    bases = [np.polynomial.legendre.legvander(np.linspace(-1, 1, n), order) for n in heights.shape]
    degrees = [order if n > 1 else 0 for n in heights.shape]  # heights do not vary across a strip
    terms = [(i, j) for i in range(degrees[0] + 1) for j in range(min(degrees[1], order - i) + 1)]
    products = [(b[:, :, None] * b[:, None, :]).reshape(len(b), -1) for b in bases]
    found, moments, right = 0, 0.0, 0.0
    for rows in row_blocks(heights.shape):
        present = np.isfinite(heights[rows])
        found += int(present.sum())
        moments = moments + products[0][rows].T @ present.astype(float) @ products[1]
        right = right + bases[0][rows].T @ np.where(present, heights[rows], 0.0) @ bases[1]
    moments = np.reshape(moments, [order + 1] * 4)
    normal = np.array([[moments[i, k, j, m] for k, m in terms] for i, j in terms])
    if np.linalg.cond(normal) > 1e12:
        raise InputError(f"level: the {found} points present do not determine a polynomial of order {order}")
    coefficients = np.zeros((order + 1, order + 1))
    for (i, j), c in zip(terms, np.linalg.solve(normal, [right[i, j] for i, j in terms]), strict=True):
        coefficients[i, j] = c
    return bases[0], coefficients, bases[1]


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


def _long_waves(heights: np.ndarray, cutoffs: list[float], periodic: bool) -> np.ndarray:
    """Waves longer than cut-offs in cells along each axis, missing where the heights are. [m]"""
    mean = mean_of(heights)
    long = np.empty_like(heights)
    complete = True
    for rows in row_blocks(heights.shape):
        present = np.isfinite(heights[rows])
        long[rows] = np.where(present, heights[rows] - mean, 0.0)
        complete &= bool(present.all())
    if complete:  # the shares of all points are products of those along each axis
        shares = [_smoothed(np.ones((n, 1)), 0, c, periodic) for n, c in zip(heights.shape, cutoffs, strict=True)]
        share = None
    else:
        share = np.isfinite(heights).astype(float)
    for field in (long,) if share is None else (long, share):
        for columns in column_blocks(heights.shape):
            field[columns] = _smoothed(field[columns], 0, cutoffs[0], periodic)
        for rows in row_blocks(heights.shape):
            field[rows] = _smoothed(field[rows], 1, cutoffs[1], periodic)
    for rows in row_blocks(heights.shape):
        part = shares[0][rows] * shares[1].T if share is None else share[rows]
        with np.errstate(invalid="ignore", divide="ignore"):
            long[rows] = np.where(np.isfinite(heights[rows]), long[rows] / part + mean, np.nan)
    return long


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
