"""Two faces on one grid: where the second lies on the first, and its heights on the cells of the first."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.bandwidth import averaged
from roughvisc.topography.grid import number, spacing, taper_weights, with_coordinates, with_taper_weights

#: Part of a cell that rounding may take off an overlap.
_ROUNDING = 1e-9


def laid_on(h1: xr.DataArray, h2: xr.DataArray, offset: Any = (0.0, 0.0)) -> tuple[xr.DataArray, xr.DataArray]:
    """Both faces on those cells of the first that the second covers wholly, laid centre on centre.

    Parameters
    ----------
    h1, h2 : xarray.DataArray
        Heights over (x, y). [m]
    offset : pair of float
        How far the second's centre lies from that of the first, along x and y. [m]

    Returns
    -------
    first, second : xarray.DataArray
        On the coordinates of the first. The second is averaged by area where its cells are not larger than those of the
        first, and linear between its cell centres where they are. [m]

    Raises
    ------
    InputError
        If the offset is no pair of numbers, or fewer than two cells are covered along an axis.
    """
    if not isinstance(offset, list | tuple | np.ndarray) or len(offset) != 2:
        raise InputError(f"combine: offset is {offset!r}: expected a pair of lengths, along x and along y [m]")
    apart = [number("offset", d, "m", low=-np.inf) for d in offset]
    kept, weights = {}, []
    for axis, d1, d2, by in zip(("x", "y"), spacing(h1), spacing(h2), apart, strict=True):
        n1, n2 = h1.sizes[axis], h2.sizes[axis]
        lower = ((np.arange(n1) - n1 / 2) * d1 - by) / d2 + n2 / 2  # borders of the first, in cells of the second
        side = d1 / d2
        covered = (lower >= -_ROUNDING) & (lower + side <= n2 + _ROUNDING)
        if covered.sum() < 2:
            raise InputError(
                f"combine: the second face covers {covered.sum()} of {n1} cells of the first along {axis}: they are "
                f"{n1 * d1:.6g} and {n2 * d2:.6g} m long, the centres {by:g} m apart: expected two cells at least"
            )
        kept[axis] = covered
        weights.append(_weights(lower[covered], side, n2))
    first = h1.isel(kept)
    heights, filled = averaged(h2, *weights)
    second = with_coordinates(heights, first["x"].values, first["y"].values, h2.attrs)
    tapered = taper_weights(h2)
    if tapered is not None:
        second = with_taper_weights(second, (weights[0] @ tapered[0], weights[1] @ tapered[1]))
    return first, second if filled is None else second.assign_coords(filled=(("x", "y"), filled, h2["filled"].attrs))


def _weights(lower: np.ndarray, side: float, count: int) -> scipy.sparse.csr_array:
    """Rows that sum to one: weights of the second's cells in each cell of the first.

    Parameters
    ----------
    lower : ndarray
        Lower borders of the first's cells, in cells of the second from its border.
    side : float
        Their side, likewise.
    count : int
        Cells of the second.
    """
    rows, columns, entries = [], [], []
    here = np.arange(lower.size)
    if side < 1 - _ROUNDING:
        at = np.clip(lower + side / 2 - 0.5, 0, count - 1)
        first = np.minimum(at.astype(int), max(count - 2, 0))
        rows, columns, entries = [here, here], [first, np.minimum(first + 1, count - 1)], [1 - at + first, at - first]
    else:
        begin = np.floor(lower + _ROUNDING).astype(int)
        for step in range(int(np.ceil(side)) + 2):
            cell = begin + step
            share = np.minimum(lower + side, cell + 1) - np.maximum(lower, cell)
            used = (share > _ROUNDING) & (cell >= 0) & (cell < count)
            rows.append(here[used])
            columns.append(cell[used])
            entries.append(share[used])
    shares = scipy.sparse.csr_array(
        (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))), shape=(lower.size, count)
    )
    return scipy.sparse.diags_array(1 / shares.sum(axis=1)) @ shares
