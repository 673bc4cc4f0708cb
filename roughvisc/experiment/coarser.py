"""Resampling of surfaces to coarser grids, and comparison of pressures on two grids."""

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
    """Return the shape of a grid with cells longer by about a factor, at least two cells along each axis.

    The apex of an indenter lies in a cell if the number of cells is odd, and between cells if it is even;
    ``same_parity`` keeps the position.

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
    """Return a surface on cells longer by about a factor. [m]

    An indenter is generated again. Any other surface keeps the waves that the new cells can resolve.

    Parameters
    ----------
    height : xarray.DataArray
        Heights of the surface. [m]
    factor : float
        Ratio of the new cell side to the old one.
    boundary : {"free", "periodic", "mirror"}
        Boundary of the run. With "periodic" the surface repeats, with "mirror" it repeats with its mirror images.
    """
    shape = (height.sizes["x"], height.sizes["y"])
    few = remade(height, coarser_shape(shape, factor, True))
    periodic = {"periodic": True, "mirror": False}.get(boundary)
    return resample(height, coarser_shape(shape, factor, False), periodic=periodic) if few is None else few


def _shares(cells: Array, onto: Array) -> Array:
    """Return the fraction of each new cell (rows) that lies in each old cell (columns)."""
    common = np.minimum(onto[1:, None], cells[1:]) - np.maximum(onto[:-1, None], cells[:-1])
    return np.asarray(np.maximum(common, 0.0) / np.diff(onto)[:, None])


def pressure_distance(found: xr.Dataset, wanted: xr.Dataset) -> Array:
    """Return the L1 distance of the pressures on two grids, at each common time. [N]

    Parameters
    ----------
    found, wanted : xarray.Dataset
        Results at the same times with ``pressure``. Both pressures are averaged over the coarser cells.

    Returns
    -------
    ndarray, shape (time,)
        Integral of the absolute difference.
    """
    grids = [tuple(cell_edges(ds[axis].values) for axis in ("x", "y")) for ds in (found, wanted)]
    sides = [np.diff(grid[0])[0] for grid in grids]
    common = grids[int(np.argmax(sides))]
    low, high = ([reach(grid[axis][end] for grid in grids) for axis in (0, 1)] for end, reach in ((0, min), (-1, max)))
    onto = (_extended(common[0], low[0], high[0]), _extended(common[1], low[1], high[1]))
    means = []
    for ds, grid in zip((found, wanted), grids, strict=True):
        along_x, along_y = (_shares(a, b) for a, b in zip(grid, onto, strict=True))
        means.append(along_x @ ds["pressure"].values @ along_y.T)
    area = np.diff(onto[0])[:, None] * np.diff(onto[1])
    return np.asarray((np.abs(means[0] - means[1]) * area).sum(axis=(-2, -1)))


def _extended(edges: Array, low: float, high: float) -> Array:
    """Return cell edges, extended by cells of the same side until they cover both limits."""
    side = edges[1] - edges[0]
    before, after = (max(0, math.ceil(gap / side - 1e-9)) for gap in (edges[0] - low, high - edges[-1]))
    return np.concatenate(
        [edges[0] - side * np.arange(before, 0, -1), edges, edges[-1] + side * np.arange(1, after + 1)]
    )
