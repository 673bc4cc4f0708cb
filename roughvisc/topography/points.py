"""Conversion of points x, y, z to a grid: on their own lattice, or in cells of a given size."""

from __future__ import annotations

import math

import numpy as np

from roughvisc.errors import InputError
from roughvisc.topography.grid import MOST_CELLS

#: Largest distance of a point from its lattice, in steps, and largest gap within a lattice line, in gaps between lines.
_OFF, _GAP = 0.01, 0.1
#: Largest deviation of the axes of a lattice from x and y. [rad]
_OBLIQUE = 0.01
#: Largest number of lattice nodes per point.
_SPARSE = 64


def laid_out(
    points: np.ndarray, side: float | None, metres: float, complaints: list[str]
) -> tuple[np.ndarray, tuple[float, float]]:
    """Return heights over x and y, and the sides of their cells.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        x, y and height.
    side : float, optional
        Side of the cells into which the points are sorted, in the unit of the points; None for their own lattice.
    metres : float
        Metres per unit of the points, for messages.
    complaints : list of str
        Gains a remark if cells hold no point.

    Raises
    ------
    InputError
        If the points lie on a line, or on no lattice if `side` is None.
    """
    spread = np.ptp(points[:, :2], axis=0)
    if not spread.all():
        raise InputError("its points lie on one line, a profile: expected an areal scan")
    if side is not None:
        heights = gridded(points, side)
        if empty := int(np.isnan(heights).sum()):
            complaints.append(f"{empty} of {heights.size} cells of the grid hold no point")
        return heights, (side, side)
    if (found := lattice(points)) is None:
        proposed = 2e6 * metres * math.sqrt(spread[0] * spread[1] / len(points))
        text = f'its {len(points)} points lie on no regular lattice: expected grid = "{proposed:.2g} um", or similar'
        raise InputError(text, key="grid", expected="the side of the cells into which the points are sorted")
    return found


def lattice(points: np.ndarray) -> tuple[np.ndarray, tuple[float, float]] | None:
    """Return the heights and steps of the lattice of some points, to a hundredth of a step; None without a lattice.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        x, y and height, in any order of the points.

    Returns
    -------
    heights : ndarray, shape (nx, ny)
        NaN at nodes without a point.
    steps : tuple of float
        Along x and y, in the unit of the points.
    """
    if len(points) < 4:
        return None
    at, nodes = points[:, :2], np.empty((len(points), 2))
    for axis in (0, 1):
        ordered = np.sort(at[:, axis])
        gaps = np.diff(ordered)
        starts = np.append(0, np.flatnonzero(gaps > _GAP * gaps.max()) + 1)
        lines = np.add.reduceat(ordered, starts) / np.diff(np.append(starts, ordered.size))
        if lines.size < 2:
            return None
        between = np.diff(lines)
        step = (lines[-1] - lines[0]) / np.round(between / np.median(between)).sum()
        nodes[:, axis] = np.round((at[:, axis] - lines[0]) / step)
    centred = np.column_stack([np.ones(len(points)), nodes - nodes.mean(axis=0)])
    fit = np.linalg.lstsq(centred, at, rcond=None)[0]
    steps = np.array([fit[1, 0], fit[2, 1]])
    off, oblique = np.abs(at - centred @ fit).max(axis=0), np.abs([fit[1, 1], fit[2, 0]])
    if (off > _OFF * steps).any() or (oblique > _OBLIQUE * steps).any():
        return None
    i, j = (nodes - nodes.min(axis=0)).astype(int).T
    shape = (int(i.max()) + 1, int(j.max()) + 1)
    if shape[0] * shape[1] > _SPARSE * len(points) or np.unique(i * shape[1] + j).size < len(points):
        return None
    heights = np.full(shape, np.nan)
    heights[i, j] = points[:, 2]
    return heights, (float(f"{steps[0]:.12g}"), float(f"{steps[1]:.12g}"))


def gridded(points: np.ndarray, side: float) -> np.ndarray:
    """Return the mean height of the points in each square cell; cells without a point are missing.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        x, y and height.
    side : float
        Side of the cells, in the unit of the points.
    """
    points = points[np.isfinite(points).all(axis=1)]
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    shape = np.maximum(np.ceil((high - low) / side - 1e-9), 1)
    if min(shape) < 2 or np.prod(shape) > MOST_CELLS:
        raise InputError(key="grid", found=side, expected=f"a side that fits at least twice into {high - low}")
    nx, ny = shape.astype(int)
    i, j = np.minimum((points[:, :2] - low) / side, shape - 1).astype(int).T
    count, total = (np.bincount(i * ny + j, weights, nx * ny) for weights in (None, points[:, 2]))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(nx, ny)
