"""The gap as a network of cells and of the faces between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]


@dataclass(frozen=True)
class Faces:
    """Conductances of the faces of a grid, relative to the mobility of the widest cell.

    Attributes
    ----------
    along : ndarray, shape (nx + 1, ny)
        Conductances of the faces across the flow; the first and the last row are the two sides. [-]
    across : ndarray, shape (nx, ny)
        Conductance of the face of each cell to its neighbour at larger y; the last column joins the borders or is zero.
        [-]
    scale : float
        Mobility of the widest cell, its gap cubed over 12. [m^3]
    """

    along: Array
    across: Array
    scale: float


@dataclass(frozen=True)
class Network:
    """Network of the cells on a path from one side to the other.

    Attributes
    ----------
    cells : ndarray of int, shape (n,)
        Indices in the flattened map.
    first, second : ndarray of int, shape (m,)
        Numbers of the cells that each face joins, the first below the second; sorted, each pair once.
    conductance : ndarray, shape (m,)
        Conductances of these faces. [-]
    entrance, exit : ndarray, shape (n,)
        Conductances of the faces to the inlet and to the outlet; zero for interior cells. [-]
    """

    cells: Numbers
    first: Numbers
    second: Numbers
    conductance: Array
    entrance: Array
    exit: Array


def faces_of(gap: Array, spacing: tuple[float, float], wrap: bool) -> Faces:
    """Return the conductances of all faces of a map.

    Parameters
    ----------
    gap : ndarray, shape (nx, ny)
        Gap, never missing; cells without a positive gap are closed. [m]
    spacing : tuple of float
        Cell sides ``(dx, dy)``. [m]
    wrap : bool
        Whether the borders across the flow are joined; otherwise they are walls.

    Returns
    -------
    Faces

    Notes
    -----
    The mobility of a cell is its gap cubed over 12. The two half cells between the centres of neighbours
    are in series. The conductance is the harmonic mean of the mobilities, times the length of the face over the
    distance of the centres. A side lies at half this distance: its conductance is twice the mobility of the cell times
    the same ratio.
    """
    widest = float(gap.max(initial=0.0))
    if not widest > 0:
        nothing = np.zeros((gap.shape[0] + 1, gap.shape[1]))
        return Faces(nothing, nothing[:-1], 0.0)
    mobility = (np.maximum(gap, 0.0) / widest) ** 3
    aspect = spacing[1] / spacing[0]
    along = np.concatenate([2 * mobility[:1], _in_series(mobility[:-1], mobility[1:]), 2 * mobility[-1:]])
    across = _in_series(mobility, np.roll(mobility, -1, axis=1))
    if not wrap or gap.shape[1] == 1:
        across[:, -1] = 0.0
    return Faces(along * aspect, across / aspect, widest**3 / 12)


def _in_series(one: Array, other: Array) -> Array:
    """Return the harmonic mean without a product, which may underflow."""
    low, high = np.minimum(one, other), np.maximum(one, other)
    return 2 * low / (1 + np.divide(low, high, where=high > 0, out=np.zeros_like(low)))


def network_of(faces: Faces) -> Network | None:
    """Return the network of the cells connected to both sides, including dead ends; None if no path connects them.

    Cells that share only a corner are not connected.
    """
    nx, ny = faces.across.shape
    number = np.arange(nx * ny).reshape(nx, ny)
    first = np.concatenate([number[:-1].ravel(), number.ravel()])
    second = np.concatenate([number[1:].ravel(), np.roll(number, -1, axis=1).ravel()])
    conductance = np.concatenate([faces.along[1:-1].ravel(), faces.across.ravel()])
    entrance, exit_ = np.zeros((2, nx, ny))
    entrance[0], exit_[-1] = faces.along[0], faces.along[-1]
    open_ = np.flatnonzero(conductance)
    graph = sparse.coo_array((np.ones(open_.size), (first[open_], second[open_])), shape=(nx * ny, nx * ny))
    _, part = sparse.csgraph.connected_components(graph, directed=False)
    at_sides = (entrance.ravel() > 0, exit_.ravel() > 0)
    touched = [np.bincount(part[side], minlength=part.max(initial=0) + 1) > 0 for side in at_sides]
    kept = (touched[0] & touched[1])[part]
    if not kept.any():
        return None
    cells = np.flatnonzero(kept)
    new = np.cumsum(kept) - 1
    open_ = open_[kept[first[open_]]]
    one, other = new[first[open_]], new[second[open_]]
    ends = np.minimum(one, other), np.maximum(one, other)
    # with two periodic cells across the flow, a pair shares two faces, whose conductances are added
    joined = sparse.coo_array((conductance[open_], ends), shape=(len(cells), len(cells))).tocsr()
    rows = np.repeat(np.arange(len(cells), dtype=joined.indices.dtype), np.diff(joined.indptr))
    return Network(cells, rows, joined.indices, joined.data, entrance.ravel()[cells], exit_.ravel()[cells])


def equations(network: Network) -> sparse.csr_array:
    """Return the matrix whose product with the pressures is the net outflow of each cell."""
    count = len(network.cells)
    diagonal = network.entrance + network.exit
    diagonal += np.bincount(network.first, network.conductance, count)
    diagonal += np.bincount(network.second, network.conductance, count)
    every = np.arange(count, dtype=network.first.dtype)
    entries = np.concatenate([-network.conductance, -network.conductance, diagonal])
    rows = np.concatenate([network.first, network.second, every])
    columns = np.concatenate([network.second, network.first, every])
    return sparse.coo_array((entries, (rows, columns)), shape=(count, count)).tocsr()


def factors(matrix: sparse.csr_array) -> Callable[[Array], Array]:
    """Return a solver of symmetric equations by direct factors, after scaling by the root of the diagonal."""
    from scipy.sparse.linalg import splu  # slow to import

    scale = 1 / np.sqrt(matrix.diagonal())
    scaling = sparse.diags_array(scale)
    scaled = (scaling @ matrix @ scaling).tocsc()
    # positive definite: no pivoting, and the ordering of symmetric matrices
    options = {"SymmetricMode": True}
    found = splu(scaled, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    return lambda source: scale * found.solve(scale * source)


def imbalance(network: Network, pressure: Array) -> Array:
    """Return inflow less outflow of each cell for given pressures of the cells. [-]"""
    flux = network.conductance * (pressure[network.first] - pressure[network.second])
    into, out = (np.bincount(cells, flux, len(pressure)) for cells in (network.second, network.first))
    return network.entrance * (1.0 - pressure) - network.exit * pressure + into - out


def dissipation(network: Network, pressure: Array) -> float:
    """Return the sum of conductance times squared jump over all faces: the conductance, for the exact pressures. [-]"""
    jump = pressure[network.first] - pressure[network.second]
    at_sides = network.entrance @ (1.0 - pressure) ** 2 + network.exit @ pressure**2
    return float(network.conductance @ jump**2 + at_sides)
