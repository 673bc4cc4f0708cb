"""Smooth bridges over missing points, for measures of the short waves that are there: spectrum and noise."""

from __future__ import annotations

import numpy as np
import scipy.ndimage
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from roughvisc.topography.blocks import row_blocks
from roughvisc.topography.harmonic import harmonic

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Tension: bridges are as smooth as can be over less than some sixteen cells, and membranes over more.
_TENSION = (2 * np.pi / 16) ** 4
#: Cells from the rim of a hole beyond which it is left a membrane. What the rim bends has died away there.
_DEPTH = 10
#: Cells that the stencil of the equation reaches.
_REACH = 3


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
