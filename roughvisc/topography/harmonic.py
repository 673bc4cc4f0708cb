"""Harmonic filling of holes: Laplace's equation on the missing points, some holes at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse.csgraph
import scipy.sparse.linalg
from numpy.typing import NDArray

from roughvisc.topography.blocks import mean_of

Array = NDArray[np.float64]
Places = NDArray[np.intp]

#: Missing points from which holes are filled some at a time, each time about so many points.
_AT_ONCE = 200_000


def harmonic(heights: Array, missing: NDArray[np.bool_]) -> Array:
    r"""Heights of the membrane that is spanned over each hole.

    Parameters
    ----------
    heights : ndarray, shape (nx, ny)
        NaN where missing; some are there. [m]
    missing : ndarray of bool, shape (nx, ny)
        Where.

    Returns
    -------
    ndarray, shape (n,)
        Heights of the missing points, row by row. [m]

    Notes
    -----
    :math:`\sum_n (h_n - h_p) = 0` over the neighbours of every missing point: four, fewer at the border of the scan,
    across which nothing flows. Holes that share no side do not know of each other.
    """
    mean = mean_of(heights)
    places = np.flatnonzero(missing)
    found = np.empty(places.size)
    for chosen in _batches(places, heights.shape):
        found[chosen] = _solved(heights, mean, places[chosen])
    return mean + found


def _batches(places: Places, shape: tuple[int, ...]) -> Iterator[Places | slice]:
    """Numbers of missing points, of whole holes each time."""
    if places.size <= _AT_ONCE:
        yield slice(None)
        return
    after = [_neighbours(places, shape, axis, 1) for axis in (0, 1)]
    pairs = (
        np.concatenate([np.flatnonzero(beside >= 0) for beside in after]),
        np.concatenate([beside[beside >= 0] for beside in after]),
    )
    graph = scipy.sparse.coo_array((np.ones(pairs[0].size, bool), pairs), shape=(places.size, places.size))
    hole = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
    order = np.argsort(hole, kind="stable")
    ends = np.flatnonzero(np.diff(hole[order], append=-1)) + 1  # of the holes, in that order
    begin = 0
    while begin < places.size:
        fitting, next_one = np.searchsorted(ends, [begin + _AT_ONCE, begin], side="right")
        end = int(ends[max(fitting - 1, next_one)])
        yield np.sort(order[begin:end])
        begin = end


def _neighbours(places: Places, shape: tuple[int, ...], axis: int, step: int) -> Places:
    """Number of the missing point beside each, -1 where there is none. Places ascend."""
    there, inside = _beside(places, shape, axis, step)
    number = np.minimum(np.searchsorted(places, there), places.size - 1)
    return np.where(inside & (places[number] == there), number, -1)


def _beside(places: Places, shape: tuple[int, ...], axis: int, step: int) -> tuple[Places, NDArray[np.bool_]]:
    """Places one step further along an axis, and which of them are on the map."""
    at = places // shape[1] if axis == 0 else places % shape[1]
    inside = (at + step >= 0) & (at + step < shape[axis])
    return places + step * (shape[1] if axis == 0 else 1), inside


def _solved(heights: Array, mean: float, places: Places) -> Array:
    """Heights less the mean of the points of some whole holes. [m]"""
    count = places.size
    diagonal, right = np.zeros(count), np.zeros(count)
    rows, columns = [np.arange(count)], [np.arange(count)]
    for axis in (0, 1):
        for step in (-1, 1):
            there, inside = _beside(places, heights.shape, axis, step)
            beside = _neighbours(places, heights.shape, axis, step)
            diagonal[inside] -= 1
            rows.append(np.flatnonzero(beside >= 0))
            columns.append(beside[beside >= 0])
            rim = inside & (beside < 0)
            right[rim] -= heights[np.unravel_index(there[rim], heights.shape)] - mean
    entries = np.concatenate([diagonal, np.ones(sum(map(len, rows)) - count)])
    laplace = scipy.sparse.csr_array((entries, (np.concatenate(rows), np.concatenate(columns))), shape=(count, count))
    return np.asarray(scipy.sparse.linalg.spsolve(laplace, right))
