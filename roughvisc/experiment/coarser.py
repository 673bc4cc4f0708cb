"""A surface on a coarser grid, and pressures of one grid seen on another."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.mechanics.grid import Boundary
from roughvisc.topography.grid import cell_edges
from roughvisc.topography.indenters import remade
from roughvisc.topography.resampling import resample

Array = NDArray[np.float64]


def coarser_shape(shape: tuple[int, int], factor: float, same_parity: bool) -> tuple[int, int]:
    """Numbers of cells of a grid whose cells are about so many times longer, at least two each way.

    An indenter's apex lies in a cell or between cells as their number is odd or even; ``same_parity`` keeps that.

    Examples
    --------
    >>> coarser_shape((31, 64), 2, True), coarser_shape((31, 64), 2, False), coarser_shape((8, 1), 2, True)
    ((17, 32), (16, 32), (4, 1))
    """
    counts = []
    for count in shape:
        fewer = max(round(count / factor), min(2, count))
        counts.append(fewer + (same_parity and (fewer - count) % 2 != 0))
    return counts[0], counts[1]


def coarser(height: xr.DataArray, factor: float, boundary: Boundary) -> xr.DataArray:
    """A surface on cells about so many times longer. [m]

    An indenter is made anew. Any other surface keeps the waves that the cells can hold, by :func:`on_fewer_cells`.

    Parameters
    ----------
    height : xarray.DataArray
        Of the surface. [m]
    factor : float
        How many times longer the cells are.
    boundary : {"free", "periodic", "mirror"}
        Of the run: with "periodic" every surface repeats, with "mirror" it does with its mirror images.
    """
    shape = (height.sizes["x"], height.sizes["y"])
    few = remade(height, coarser_shape(shape, factor, True))
    return on_fewer_cells(height, coarser_shape(shape, factor, False), boundary) if few is None else few


def on_fewer_cells(height: xr.DataArray, shape: tuple[int, int], boundary: Boundary) -> xr.DataArray:
    """A surface with the waves that a coarser grid can hold. [m]"""
    return resample(height, shape, periodic={"periodic": True, "mirror": False}.get(boundary))


def block_means(field: Array, cells: tuple[Array, Array], onto: tuple[Array, Array]) -> Array:
    """Means of a field over the cells of another grid; it is zero outside its own.

    Parameters
    ----------
    field : ndarray, shape (..., nx, ny)
        Constant in each cell.
    cells, onto : tuple of ndarray
        Borders of its cells and of the other grid's, along x and along y. [m]
    """
    along_x, along_y = (_shares(a, b) for a, b in zip(cells, onto, strict=True))
    return np.asarray(along_x @ field @ along_y.T)


def _shares(cells: Array, onto: Array) -> Array:
    """Which part of each new cell (rows) lies in each old one (columns)."""
    common = np.minimum(onto[1:, None], cells[1:]) - np.maximum(onto[:-1, None], cells[:-1])
    return np.asarray(np.maximum(common, 0.0) / np.diff(onto)[:, None])


def pressure_distance(found: xr.Dataset, wanted: xr.Dataset) -> Array:
    """Largest part of the force that pressures of two grids do not share, at each common time. [N]

    Parameters
    ----------
    found, wanted : xarray.Dataset
        Results at the same times with ``pressure``; the pressures of both are taken as means over the coarser cells.

    Returns
    -------
    ndarray, shape (time,)
        The integral of the absolute difference (L1).
    """
    grids = [tuple(cell_edges(ds[axis].values) for axis in ("x", "y")) for ds in (found, wanted)]
    fields = [ds["pressure"].values for ds in (found, wanted)]
    sides = [np.diff(grid[0])[0] for grid in grids]
    common = grids[int(np.argmax(sides))]
    low, high = ([reach(grid[axis][end] for grid in grids) for axis in (0, 1)] for end, reach in ((0, min), (-1, max)))
    onto = (_extended(common[0], low[0], high[0]), _extended(common[1], low[1], high[1]))
    means = [block_means(field, grid, onto) for field, grid in zip(fields, grids, strict=True)]  # type: ignore[arg-type]
    area = np.diff(onto[0])[:, None] * np.diff(onto[1])
    return np.asarray((np.abs(means[0] - means[1]) * area).sum(axis=(-2, -1)))


def _extended(edges: Array, low: float, high: float) -> Array:
    """Cell borders with further cells of the same side, until both ends are reached."""
    side = edges[1] - edges[0]
    before, after = (max(0, math.ceil(gap / side - 1e-9)) for gap in (edges[0] - low, high - edges[-1]))
    return np.concatenate(
        [edges[0] - side * np.arange(before, 0, -1), edges, edges[-1] + side * np.arange(1, after + 1)]
    )
