"""Heights in place of missing points: membranes that fill holes, and smooth bridges for measures of short waves.

A membrane obeys Laplace's equation on the missing points. Bridges go on from the rim as smoothly as the points there,
for spectrum and noise, which would take the kinks of membranes for short waves.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.ndimage
import scipy.sparse.csgraph
import scipy.sparse.linalg
from numpy.typing import NDArray

from roughvisc.topography.blocks import mean_of, row_blocks

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Places = NDArray[np.intp]

#: Missing points from which holes are filled some at a time, each time about so many points.
_AT_ONCE = 200_000
#: Tension: bridges are as smooth as can be over less than some sixteen cells, and membranes over more.
_TENSION = (2 * np.pi / 16) ** 4
#: Cells from the rim of a hole beyond which it is left a membrane. What the rim bends has died away there.
_DEPTH = 10
#: Cells that the stencil of the equation reaches.
_REACH = 3


def harmonic(heights: Array, missing: Mask) -> Array:
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


def _beside(places: Places, shape: tuple[int, ...], axis: int, step: int) -> tuple[Places, Mask]:
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


def bridged(heights: Array, missing: Mask) -> Array:
    r"""Heights with the missing points bridged so smoothly that they add next to nothing to short waves.

    Parameters
    ----------
    heights : ndarray, shape (nx, ny)
        Any value where missing; some are there. [m]
    missing : ndarray of bool, shape (nx, ny)
        Where.

    Returns
    -------
    ndarray, shape (nx, ny)
        The same heights where they are not missing. [m]

    Notes
    -----
    A membrane has a kink all along the rim of a hole. Kinks are as short waves, and raise the end of a steep spectrum
    by orders of magnitude. Bridges have :math:`(L^3 + \kappa L) h = 0` with the second difference :math:`L` of
    neighbours in place of :math:`L h = 0`: the curvature goes on beyond the rim. The tension :math:`\kappa` keeps
    wide ones from swinging. Nothing flows across the border of the scan.
    """
    found = heights.copy()
    if not missing.any():
        return found
    found[missing] = np.nan
    found[missing] = harmonic(found, missing)
    margin = _DEPTH + _REACH
    for rows in row_blocks(heights.shape):
        first, last = max(rows.start - margin, 0), min(rows.stop + margin, len(heights))
        ends = (first == 0, last == len(heights))
        inner = slice(rows.start - first, rows.stop - first)
        found[rows] = _smoothed(found[first:last], missing[first:last], ends)[inner]
    return found


def _smoothed(heights: Array, missing: Mask, ends: tuple[bool, bool]) -> Array:
    """Some rows with the membranes near the rims of holes made smooth. [m]

    ``ends`` says whether the first and the last row are those of the scan; where they are not, membranes near them
    stay.
    """
    if missing.all():  # nothing near to go by
        return heights
    depth = scipy.ndimage.distance_transform_cdt(np.pad(missing, 1, mode="edge"), "taxicab")[1:-1, 1:-1]
    wanted = missing & (depth <= _DEPTH)
    wanted[: 0 if ends[0] else _REACH] = False
    wanted[len(wanted) - (0 if ends[1] else _REACH) :] = False
    if not wanted.any():
        return heights
    near = scipy.ndimage.binary_dilation(wanted, iterations=_REACH)
    second = _second_difference(near)
    unknown = wanted[near]
    rows = second[unknown]
    equation = (rows @ second @ second + _TENSION * rows).tocsc()
    mean = heights.mean()
    known = np.where(unknown, 0.0, heights[near] - mean)
    smooth = heights.copy()
    smooth[wanted] = mean - scipy.sparse.linalg.spsolve(equation[:, unknown], equation @ known)
    return smooth


def _second_difference(near: Mask) -> scipy.sparse.csr_array:
    """Sum of the differences between each of some cells and its neighbours on the map, those of the cells alone kept.

    Cells whose neighbours are not all among them have rows that lack these.
    """
    number = np.cumsum(near.ravel()).reshape(near.shape) - 1
    count = int(number[-1, -1]) + 1
    diagonal = np.zeros(count)
    rows, columns = [np.arange(count)], [np.arange(count)]
    for here, there in (
        ((slice(None, -1), slice(None)), (slice(1, None), slice(None))),
        ((slice(None), slice(None, -1)), (slice(None), slice(1, None))),
    ):
        both = near[here] & near[there]
        one, other = number[here][both], number[there][both]
        np.add.at(diagonal, np.concatenate([one, other]), 1.0)
        rows += [one, other]
        columns += [other, one]
    entries = np.concatenate([diagonal, -np.ones(sum(map(len, rows)) - count)])
    matrix = scipy.sparse.coo_array((entries, (np.concatenate(rows), np.concatenate(columns))), shape=(count, count))
    return matrix.tocsr()
