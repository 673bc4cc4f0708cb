"""Surfaces on other grids: by Fourier interpolation, by splines, by cosines, or by means over cells.

Whatever makes a surface coarser or finer is here. Heights belong to cell centres, so that those of the old and the new
cells differ; all ways take heights at the centres of the new cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.fft
import scipy.sparse
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.blocks import column_blocks, row_blocks
from roughvisc.topography.borders import is_periodic, period_of
from roughvisc.topography.grid import (
    checked,
    counts,
    filled_points,
    like,
    noted,
    number,
    require_complete,
    spacing,
    with_coordinates,
)
from roughvisc.topography.missing_points import fill
from roughvisc.units import Quantity, quantities

Along = Callable[[np.ndarray, int], np.ndarray]

#: Part of a cell that rounding may take off an overlap.
_ROUNDING = 1e-9


def resample(h: xr.DataArray, shape: int | tuple[int, int], periodic: bool | None = None) -> xr.DataArray:
    r"""Resample to another number of cells over the same domain.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    shape : int or pair of int
        New number of cells ``(nx, ny)``.
    periodic : bool, optional
        Whether the surface is periodic in x and in y. Default: whether :func:`self_affine`, :func:`wavy` or
        :func:`mirror` made it periodic and it is still one period (attribute ``period``).

    Returns
    -------
    xarray.DataArray
        Height at the centres of the new cells; the last line of its ``history`` states the method. [m]

        A periodic surface is resampled by Fourier interpolation. A coarser grid keeps the wavelengths longer than two
        of its cells and removes the others.

        Any other surface is refined by a cubic spline through the old cell centres, constant beyond the outermost ones,
        and coarsened by the mean over each new cell, which conserves the volume, along each axis separately.
        (:func:`band_limit` keeps the wavelengths instead.)

        A surface with missing points, periodic or not, is coarsened by means as above, and refined by linear
        interpolation between the centres. A new cell is missing if less than half of it is present.

    Raises
    ------
    InputError
        If `shape` is not a pair of whole numbers of at least 2, or `periodic` is true and points are missing.

    Notes
    -----
    Along each axis of :math:`n` cells the transform :math:`h_k` gives, at the centres of :math:`m` cells,

    .. math:: h(X_j) = \frac{1}{n} \sum_{|k| < \min(n, m) / 2} h_k \, e^{2 \pi i k j / m} e^{i \pi k (1/m - 1/n)},

    where the last factor accounts for the distance between the first centres of both grids. A wavelength of exactly two
    old cells is kept on a finer grid, as the sine that is largest at the old centres.
    """
    h = checked(h, "resample")
    shape = counts("shape", shape)
    repeats = _repeats("resample", h, periodic)
    if periodic:
        require_complete(h, "resample", "none for periodic=True (see fill)")
    cells = [Cells.of(old, new) for old, new in zip(h.shape, shape, strict=True)]
    if repeats and _is_complete(h):
        heights, way = resample_periodic(h.values, shape), "by Fourier interpolation"
    else:
        heights, way = lay_on_cells(h, *cells)
    return _on_cells(h, heights, marked(h, *cells), "resampled", way, periodic)


def band_limit(h: xr.DataArray, shape: int | tuple[int, int], periodic: bool | None = None) -> xr.DataArray:
    """Resample to another number of cells, with exactly the wavelengths that both grids resolve.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y). [m]
    shape : int or pair of int
        New number of cells ``(nx, ny)``.
    periodic : bool, optional
        Whether the surface repeats in x and in y; default as in :func:`resample`.

    Returns
    -------
    xarray.DataArray
        Height at the centres of the new cells, with the same mean; missing where less than half of a cell is present.
        [m]

    Raises
    ------
    InputError
        If `shape` is not a pair of whole numbers of at least 2, or cells are absent (no material there).

    Notes
    -----
    A periodic surface is expanded in a Fourier series, as in :func:`resample`. Any other surface and its mirror images
    are expanded in cosines. A coarser grid keeps the wavelengths longer than two of its cells, and their slopes. The
    block means that :func:`resample` takes for a surface that is not periodic damp wavelengths of up to ten cells and
    alias shorter ones: on cells twice as long the error of the contact area is then 1.2 to 1.8 times as large, and that
    of mean gap and approach 2 to 100 times (docs/howto/big-scans.md). Missing points are bridged as :func:`fill` does.
    """
    h = checked(h, "band_limit")
    shape = counts("shape", shape)
    if h.attrs.get("missing") == "absent":
        raise InputError("band_limit: cells are absent (there is no material): expected a surface, or take resample")
    repeats = _repeats("band_limit", h, periodic)
    cells = [Cells.of(old, new) for old, new in zip(h.shape, shape, strict=True)]
    complete = _is_complete(h)
    whole = (h if complete else fill(h)).values
    if repeats:
        heights, way = resample_periodic(whole, shape), "by Fourier interpolation"
    else:
        heights = _along_both(whole, _cosines(shape[0]), _cosines(shape[1]))
        way = "by cosines (the surface and its mirror images)"
    if not complete:
        heights[np.isnan(lay_on_cells(h, *cells)[0])] = np.nan
    return _on_cells(h, heights, marked(h, *cells), "band-limited", way, periodic)


@quantities(shortest="m")
def without_short_waves(h: xr.DataArray, shortest: Quantity, periodic: bool | None = None) -> xr.DataArray:
    """Remove all wavelengths below a limit, on the same cells.

    Parameters
    ----------
    h : xarray.DataArray
        Height over (x, y), without missing points. [m]
    shortest : float or str
        Shortest wavelength to keep; at least two cells, and shorter than the sides. [m]
    periodic : bool, optional
        Whether the surface repeats in x and in y; default as in :func:`resample`.

    Returns
    -------
    xarray.DataArray
        Height with the same mean. A periodic surface is expanded in a Fourier series, any other surface and its mirror
        images in cosines. The cut-off is sharp: see :func:`gaussian_filter` for a smooth one. [m]

    Raises
    ------
    InputError
        If points are missing or the length is out of its range.
    """
    h = checked(h, "without_short_waves")
    shortest, sides = number("shortest", shortest, "m"), spacing(h)
    lengths = [n * d for n, d in zip(h.shape, sides, strict=True)]
    if not 2 * max(sides) * (1 - _ROUNDING) <= shortest < min(lengths):
        raise InputError(
            f"without_short_waves: shortest is {shortest!r}: expected at least two cells, {2 * max(sides):.6g} [m], "
            f"and less than the sides, {min(lengths):.6g} [m]"
        )
    require_complete(h, "without_short_waves")
    limit = (2 * np.pi / shortest) * (1 + _ROUNDING)
    if _repeats("without_short_waves", h, periodic):
        q_x = 2 * np.pi * scipy.fft.fftfreq(h.shape[0], sides[0])
        q_y = 2 * np.pi * scipy.fft.rfftfreq(h.shape[1], sides[1])
        heights_q = np.where(np.hypot(q_x[:, None], q_y) <= limit, scipy.fft.rfft2(h.values), 0.0)
        heights = scipy.fft.irfft2(heights_q, s=h.shape)
    else:
        q_x, q_y = (np.pi * np.arange(n) / length for n, length in zip(h.shape, lengths, strict=True))
        heights_q = np.where(np.hypot(q_x[:, None], q_y) <= limit, scipy.fft.dctn(h.values, norm="ortho"), 0.0)
        heights = scipy.fft.idctn(heights_q, norm="ortho")
    stated = {} if periodic is None else {"period": period_of(h) if periodic else None}
    return noted(like(h, heights), f"waves shorter than {shortest:.6g} m left out", **stated)


def resample_periodic(values: np.ndarray, shape: tuple[int, int], *, first_kept: bool = False) -> np.ndarray:
    """One period of a field at the centres of other cells, by Fourier interpolation.

    Parameters
    ----------
    values : ndarray, shape (nx, ny)
        Finite, at the cell centres.
    shape : tuple of int
        New number of cells.
    first_kept : bool
        Whether the new grid is moved so that the first centres coincide, which does where only the waves matter, not
        their place. Otherwise both grids cover the same domain.

    Returns
    -------
    ndarray
        Of that shape and the same mean; see :func:`resample`.
    """
    return _along_both(values, _waves(shape[0], first_kept), _waves(shape[1], first_kept))


@dataclass(frozen=True)
class Cells:
    """Where the new cells of an axis lie among the old ones.

    Parameters
    ----------
    lower : ndarray
        Lower borders of the new cells, in old cells from the border of the first. [-]
    side : float
        Side of the new cells, in old cells. [-]
    count : int
        Number of old cells.
    """

    lower: np.ndarray
    side: float
    count: int

    @classmethod
    def of(cls, old: int, new: int) -> Cells:
        """A number of cells in place of another one over the same domain."""
        return cls(np.arange(new) * old / new, old / new, old)

    @property
    def finer(self) -> bool:
        """Whether the new cells are smaller than the old ones."""
        return self.side < 1 - _ROUNDING

    @property
    def centres(self) -> np.ndarray:
        """New centres counted in old ones, none beyond the outermost of these."""
        return np.clip(self.lower + self.side / 2 - 0.5, 0, self.count - 1)

    def weights(self) -> scipy.sparse.csr_array:
        """Rows that sum to one: linear between the old centres where finer, shares of overlap where not."""
        rows, columns, entries = [], [], []
        here = np.arange(self.lower.size)
        if self.finer:
            at = self.centres
            first = np.minimum(at.astype(int), max(self.count - 2, 0))
            rows, entries = [here, here], [1 - at + first, at - first]
            columns = [first, np.minimum(first + 1, self.count - 1)]
        else:
            begin = np.floor(self.lower + _ROUNDING).astype(int)
            for step in range(math.ceil(self.side) + 2):
                cell = begin + step
                share = np.minimum(self.lower + self.side, cell + 1) - np.maximum(self.lower, cell)
                used = (share > _ROUNDING) & (cell >= 0) & (cell < self.count)
                rows.append(here[used])
                columns.append(cell[used])
                entries.append(share[used])
        shares = scipy.sparse.csr_array(
            (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))),
            shape=(self.lower.size, self.count),
        )
        return scipy.sparse.diags_array(1 / shares.sum(axis=1)) @ shares


def lay_on_cells(h: xr.DataArray, along_x: Cells, along_y: Cells) -> tuple[np.ndarray, str]:
    """Heights on other cells, which need not cover the grid, and the way in words.

    By cubic splines along an axis where the new cells are smaller, by means over them where they are not. Where points
    are missing splines are replaced by straight lines, and heights are missing that have less than half the weight.

    Returns
    -------
    heights : ndarray
        [m]
    way : str
        For the history.
    """
    axes = (along_x, along_y)
    if _is_complete(h):
        ways = ["by cubic spline" if cells.finer else "by means over cells" for cells in axes]
        heights = _along_both(h.values, *(_spline(cells) if cells.finer else _means(cells) for cells in axes))
    else:
        ways = ["linearly" if cells.finer else "by means over cells" for cells in axes]
        heights = _means_of_present(h.values, along_x, along_y)
    return heights, ways[0] if ways[0] == ways[1] else f"{ways[0]} along x, {ways[1]} along y"


def marked(h: xr.DataArray, along_x: Cells, along_y: Cells) -> np.ndarray | None:
    """Cells in which a point that was filled in has a part; None if the surface does not know of such points."""
    filled = filled_points(h)
    if filled is None:
        return None
    return _along_both(filled.astype(float), _means(along_x), _means(along_y)) > 0


def _is_complete(h: xr.DataArray) -> bool:
    return all(np.isfinite(h.values[rows]).all() for rows in row_blocks(h.shape))


def _repeats(step: str, h: xr.DataArray, periodic: bool | None) -> bool:
    if periodic not in (None, True, False):
        raise InputError(f"{step}: periodic is {periodic!r}: expected True, False or None (what the surface says)")
    return is_periodic(h) if periodic is None else bool(periodic)


def _along_both(values: np.ndarray, along_x: Along, along_y: Along) -> np.ndarray:
    """A map after a linear map along y and one along x."""
    return _blockwise(_blockwise(values, along_y, 1), along_x, 0)


def _blockwise(values: np.ndarray, along: Along, axis: int) -> np.ndarray:
    """A map after a linear map along one axis, some of the other axis at a time."""
    found = np.empty(0)
    blocks = column_blocks(values.shape) if axis == 0 else ((rows, slice(None)) for rows in row_blocks(values.shape))
    for block in blocks:
        part = along(values[block], axis)
        if not found.size:
            found = np.empty((part.shape[0], values.shape[1]) if axis == 0 else (values.shape[0], part.shape[1]))
        found[block] = part
    return found


def _waves(count: int, first_kept: bool) -> Along:
    """Fourier interpolation onto so many cells."""

    def along(values: np.ndarray, axis: int) -> np.ndarray:
        before = values.shape[axis]
        if count == before:
            return values
        values_q = scipy.fft.rfft(values, axis=axis)
        number = np.arange(values_q.shape[axis])
        moved = 0.0 if first_kept else 0.5 / count - 0.5 / before  # from the first old centre to the first new one
        turned = np.exp(2j * np.pi * number * moved)
        fewer = min(count, before)
        if fewer % 2 == 0:  # a wave of two cells: a coarser grid holds no such wave, a finer one has two halves of it
            turned[fewer // 2] *= 0.0 if count < before else 0.5
        values_q *= turned[:, None] if axis == 0 else turned
        return scipy.fft.irfft(values_q, n=count, axis=axis) * (count / before)

    return along


def _cosines(count: int) -> Along:
    """The cosines that both grids hold, at the centres of so many cells."""

    def along(values: np.ndarray, axis: int) -> np.ndarray:
        values_q = scipy.fft.dct(values, axis=axis, norm="ortho")
        return scipy.fft.idct(values_q, n=count, axis=axis, norm="ortho") * math.sqrt(count / values.shape[axis])

    return along


def _spline(cells: Cells) -> Along:
    """The cubic spline through the old centres at the new ones; of less than four centres the polynomial."""
    from scipy.interpolate import make_interp_spline  # slow to import

    degree = min(3, cells.count - 1)

    def along(values: np.ndarray, axis: int) -> np.ndarray:
        return make_interp_spline(np.arange(cells.count), values, degree, axis=axis)(cells.centres)

    return along


def _means(cells: Cells) -> Along:
    """The weights of cells as a linear map."""
    weights = cells.weights()
    return lambda values, axis: weights @ values if axis == 0 else values @ weights.T


def _means_of_present(values: np.ndarray, cells_x: Cells, cells_y: Cells) -> np.ndarray:
    """Means over the points present, missing where they have less than half the weight. [m]"""
    along_x, along_y = cells_x.weights(), cells_y.weights()
    found = np.empty((along_x.shape[0], along_y.shape[0]))
    for rows in row_blocks(found.shape):
        weights = along_x[rows]
        reach = slice(int(weights.indices.min()), int(weights.indices.max()) + 1)
        weights, known = weights[:, reach], values[reach]
        present = np.isfinite(known)
        total = weights @ np.where(present, known, 0.0) @ along_y.T
        share = weights @ present.astype(float) @ along_y.T
        with np.errstate(invalid="ignore", divide="ignore"):
            found[rows] = np.where(share >= 0.5 - 1e-12, total / share, np.nan)
    return found


def _on_cells(
    h: xr.DataArray, heights: np.ndarray, filled: np.ndarray | None, done: str, way: str, periodic: bool | None
) -> xr.DataArray:
    """Heights over the domain of a grid on another number of cells, with what was done. [m]"""
    axes = []
    for axis, d, old, new in zip(("x", "y"), spacing(h), h.shape, heights.shape, strict=True):
        axes.append(float(h[axis][0]) - d / 2 + (np.arange(new) + 0.5) * (d * old / new))
    grid = with_coordinates(heights, *axes, h.attrs, filled=filled)
    stated = {} if periodic is None else {"period": period_of(h) if periodic else None}
    line = f"{done}: {h.shape[0]} x {h.shape[1]} to {heights.shape[0]} x {heights.shape[1]} cells, {way}"
    return noted(grid, line, **stated)
