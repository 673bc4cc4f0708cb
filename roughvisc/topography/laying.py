"""Two faces on one grid: where the second lies on the first, and its heights on the cells of the first."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.grid import number, spacing, taper_weights, with_coordinates, with_taper_weights
from roughvisc.topography.resampling import Cells, lay_on_cells, marked

#: Part of a cell by which rounding may move a border.
_ROUNDING = 1e-9


def laid_on(h1: xr.DataArray, h2: xr.DataArray, offset: Any = (0.0, 0.0)) -> tuple[xr.DataArray, xr.DataArray, str]:
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
        first, and by cubic spline between its cell centres where they are (linear, if points of it are missing). [m]
    way : str
        Which of these it was.

    Raises
    ------
    InputError
        If the offset is no pair of numbers, or fewer than two cells are covered along an axis.
    """
    if not isinstance(offset, list | tuple | np.ndarray) or len(offset) != 2:
        raise InputError(f"combine: offset is {offset!r}: expected a pair of lengths, along x and along y [m]")
    apart = [number("offset", d, "m", low=-np.inf) for d in offset]
    kept, cells = {}, []
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
        cells.append(Cells(lower[covered], side, n2))
    first = h1.isel(kept)
    heights, way = lay_on_cells(h2, *cells)
    filled = marked(h2, *cells)
    second = with_coordinates(heights, first["x"].values, first["y"].values, h2.attrs)
    tapered = taper_weights(h2)
    if tapered is not None:
        second = with_taper_weights(second, (cells[0].weights() @ tapered[0], cells[1].weights() @ tapered[1]))
    if filled is not None:
        second = second.assign_coords(filled=(("x", "y"), filled, h2["filled"].attrs))
    return first, second, way
