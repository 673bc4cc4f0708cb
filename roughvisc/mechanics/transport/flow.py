r"""Flow of a fluid through a gap by Reynolds' equation: finite volumes on the cells of the contact's grid.

The cells on a path from one side to the other and the faces between them form a network of resistors. A small network
is solved by direct factors, a large one by conjugate gradients on two grids.

A cell of the coarse network is a set of cells of a block that strong faces connect. Smoothed aggregation [1]_ carries
its pressure to the cells: the pressure of the coarse cell, :math:`T p`, followed by one Jacobi step,
:math:`(1 - \omega D^{-1} A) T`. Jacobi steps before and after reduce errors that differ from one cell to the
next. The coarse equations are solved directly. Therefore a channel that is one cell wide in a narrow place does not
slow the iterations down, as it does with an algebraic multigrid of many levels.

.. [1] P. Vaněk, J. Mandel, M. Brezina, Algebraic multigrid by smoothed aggregation for second and fourth order elliptic
   problems, Computing 56 (1996) 179-196.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from roughvisc.mechanics.transport.clusters import label_clusters

Array = NDArray[np.float64]
Numbers = NDArray[np.integer[Any]]

#: Relative error of the conductance at which the iteration ends.
_CLOSE = 1e-9
#: Number of cells from which two grids are used, and relative error of the energy in each round on them.
_LARGE, _ON_TWO_GRIDS = 2**12, (1e-16, 1e-2, 1e-2, 1e-2)
#: Largest number of rounds with direct factors.
_BY_FACTORS = 8
#: Number of cells along the side of a block: larger blocks mean fewer coarse cells and more iterations.
_BLOCK = 4
#: A face is strong if its conductance is at least this part of the geometric mean of the diagonals of its two cells.
_STRONG = 0.02
#: Relaxation factor of the Jacobi steps in prolongation and iterations; eigenvalues of ``D^-1 A`` lie below two.
_RELAXATION = 3 / 4
#: Largest number of iterations.
_MOST = 100
#: Shift of the diagonal of the coarse equations, relative to the diagonal of the cells.
_SHIFT = 1e-14


@dataclass(frozen=True)
class Flow:
    """Flow between two sides of a map, for a unit of pressure drop over viscosity.

    Attributes
    ----------
    conductance : float
        Volume flow times viscosity over pressure drop; zero if no path connects the sides. [m^3]
    error : float
        Estimated error of the conductance of the discrete equations. [m^3]
    along, across : ndarray, shape (nx, ny)
        Flux in the cells, the mean over opposite faces: volume flow per length of the face, zero in cells without
        flow. [m^2]
    """

    conductance: float
    error: float
    along: Array
    across: Array


def flow(gap: Array, spacing: tuple[float, float], *, wrap: bool = False) -> Flow:
    r"""Return the flow through a gap from one side of the map to the opposite side, along the first axis.

    Parameters
    ----------
    gap : ndarray, shape (nx, ny)
        Gap, finite everywhere; cells without a positive gap are closed. [m]
    spacing : tuple of float
        Cell sides ``(dx, dy)``. [m]
    wrap : bool
        Whether the other two sides are joined, as in a periodic map; otherwise they are walls.

    Returns
    -------
    Flow

    Raises
    ------
    ValueError
        If a gap is missing or infinite.

    Notes
    -----
    Reynolds' equation for creeping flow of a constant viscosity :math:`\eta`, without slip and with small slopes,

    .. math:: \nabla \cdot \left(\frac{g^3}{12 \eta} \nabla P\right) = 0,

    by cell-centred finite volumes. The mobility of a cell is its gap cubed over 12. The two half cells between the
    centres of neighbours are in series: the conductance of a face is the harmonic mean of both mobilities, times the
    length of the face over the distance of the centres. A side lies at half this distance: its conductance is twice the
    mobility of the cell times the same ratio. These conductances are exact for a gap that depends on one coordinate and
    is constant in each cell, and of second order in the sides of the cells for a smooth gap. Small maps are solved with
    SciPy's direct factors in minimum-degree order, large ones by conjugate gradients on two grids. If the conductances
    span too many decades for two grids, direct factors follow.

    By Dirichlet's principle the dissipation of approximate pressures exceeds the conductance [2]_. The excess is the
    work of what flows into the cells and not out of them on the remaining error of the pressures, which the next round
    solves for. The iteration ends when it is below 1e-9 of the conductance.

    References
    ----------
    .. [1] B. J. Hamrock, S. R. Schmid, B. O. Jacobson, Fundamentals of Fluid Film Lubrication, 2004, chapter 7.
    .. [2] P. G. Doyle, J. L. Snell, Random Walks and Electric Networks, MAA, 1984, section 1.3.5.
    """
    if not np.isfinite(gap).all():
        raise ValueError("the gap is missing or infinite in some cells")
    widest, (nx, ny) = float(gap.max(initial=0.0)), gap.shape
    mobility = (np.maximum(gap, 0.0) / (widest or 1.0)) ** 3
    labels, _ = label_clusters(mobility > 0, (False, wrap))
    on_path = np.isin(labels, np.intersect1d(labels[0], labels[-1])) & (labels > 0)
    cells, scale = np.flatnonzero(on_path), widest**3 / 12
    if not cells.size:
        return Flow(0.0, 0.0, np.zeros(gap.shape), np.zeros(gap.shape))
    faces = _conductances(np.where(on_path, mobility, 0.0), spacing[1] / spacing[0], wrap)
    difference = _differences(cells, nx, ny)
    inlet = np.zeros(faces.size)  # the pressure is 1 at the inlet, 0 at the outlet
    inlet[:ny] = 1.0
    matrix = (difference.T @ sparse.diags_array(faces) @ difference).tocsr()
    pressure, conductance, error = np.zeros(cells.size), 0.0, np.inf
    for solve in _solvers(matrix, cells, ny):
        drop = inlet - difference @ pressure
        left = difference.T @ (faces * drop)
        step = solve(left)
        conductance, error = float(faces @ drop**2), abs(float(left @ step))
        # the factors lose digits for a wide basin behind narrow slits; each round recovers some
        pressure = np.clip(pressure + step, 0.0, 1.0)
        if error <= _CLOSE * conductance:
            break
    flux = scale * faces * (inlet - difference @ pressure)
    along, across = flux[: (nx + 1) * ny].reshape(nx + 1, ny), flux[(nx + 1) * ny :].reshape(nx, ny)
    along, across = along[1:] + along[:-1], across + np.roll(across, 1, axis=1)
    return Flow(conductance * scale, error * scale, along / 2 / spacing[1], across / 2 / spacing[0])


def _conductances(mobility: Array, aspect: float, wrap: bool) -> Array:
    """Return the conductances of all faces, relative to the mobility of the widest cell. [-]

    Parameters
    ----------
    mobility : ndarray, shape (nx, ny)
        Mobilities, zero in cells without flow. [-]
    aspect : float
        Cell side across the flow over that along it.
    wrap : bool
        As in :func:`flow`.

    Returns
    -------
    ndarray, shape ((2 nx + 1) * ny,)
        First the faces that the flow along the map crosses, ``nx + 1`` rows from inlet to outlet. Then the face of each
        cell to its neighbour at larger y; the face of the last column joins the borders or is closed.
    """

    def in_series(one: Array, other: Array) -> Array:
        low, high = np.minimum(one, other), np.maximum(one, other)  # no product, which may underflow
        return 2 * low / (1 + np.divide(low, high, where=high > 0, out=np.zeros_like(low)))

    along = np.concatenate([2 * mobility[:1], in_series(mobility[:-1], mobility[1:]), 2 * mobility[-1:]])
    across = in_series(mobility, np.roll(mobility, -1, axis=1))
    if not wrap or mobility.shape[1] == 1:
        across[:, -1] = 0.0
    return np.concatenate([(along * aspect).ravel(), (across / aspect).ravel()])


def _differences(cells: Numbers, nx: int, ny: int) -> sparse.csr_array:
    """Return the matrix from the pressures of cells, given by their indices, to the differences across all faces."""
    number = np.full((nx + 2, ny), -1)
    number.flat[ny + cells] = np.arange(cells.size)
    before = np.concatenate([number[:-1].ravel(), number[1:-1].ravel()])
    behind = np.concatenate([number[1:].ravel(), np.roll(number[1:-1], -1, axis=1).ravel()])

    def pressures(ends: Numbers) -> sparse.csr_array:
        inside = np.flatnonzero(ends >= 0)
        return sparse.csr_array((np.ones(inside.size), (inside, ends[inside])), shape=(ends.size, cells.size))

    return pressures(behind) - pressures(before)


def _solvers(matrix: sparse.csr_array, cells: Numbers, width: int) -> Iterator[Callable[[Array], Array]]:
    """Yield the solver of each round: two grids for a large network, then direct factors."""
    if cells.size >= _LARGE:
        solve = _solver_on_two_grids(matrix, cells, width)
        yield from (partial(solve, enough) for enough in _ON_TWO_GRIDS)
    yield from repeat(_factors(matrix), _BY_FACTORS)


def _factors(matrix: sparse.csr_array) -> Callable[[Array], Array]:
    """Return a solver of symmetric equations by direct factors, after scaling by the root of the diagonal."""
    from scipy.sparse.linalg import splu  # slow to import

    scale = 1 / np.sqrt(matrix.diagonal())
    scaling = sparse.diags_array(scale)
    # positive definite: no pivoting, and the ordering of symmetric matrices
    options = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    found = splu((scaling @ matrix @ scaling).tocsc(), **options)
    return lambda source: scale * found.solve(scale * source)


def _solver_on_two_grids(matrix: sparse.csr_array, cells: Numbers, width: int) -> Callable[[float, Array], Array]:
    """Return a solver by preconditioned conjugate gradients: from a source in each cell to the pressures of the cells.

    Its first argument is the relative error of the energy at which the iteration ends. If it does not converge, it
    returns its last iterate.

    Parameters
    ----------
    matrix : sparse array, shape (n, n)
        Equations.
    cells : ndarray of int, shape (n,)
        Indices of the cells in the flattened map.
    width : int
        Number of the map's cells across the flow.
    """
    diagonal = matrix.diagonal()
    prolongation = _prolongation(matrix, cells, width)
    restriction = prolongation.T.tocsr()
    # rounding hides very weak connections between coarse cells; the shift keeps the equations positive definite
    shift = np.maximum(_SHIFT * (prolongation.power(2).T @ diagonal), np.finfo(float).tiny)
    on_coarse = _factors(restriction @ (matrix @ prolongation) + sparse.diags_array(shift))
    weight = _RELAXATION / diagonal

    def precondition(left: Array) -> Array:
        found = weight * left
        found += prolongation @ on_coarse(restriction @ (left - matrix @ found))
        return found + weight * (left - matrix @ found)

    def solve(enough: float, source: Array) -> Array:
        pressure, left = np.zeros_like(source), source.copy()
        direction, before, energy = np.zeros_like(source), 1.0, 0.0
        for _ in range(_MOST):
            better = precondition(left)
            product = float(left @ better)
            direction = better + product / before * direction
            through = matrix @ direction
            power = float(direction @ through)
            if not (product > enough * energy and power > 0):
                break
            length = product / power
            pressure += length * direction
            left -= length * through
            before, energy = product, energy + length * product
        return pressure

    return solve


def _prolongation(matrix: sparse.csr_array, cells: Numbers, width: int) -> sparse.csr_array:
    """Return the prolongation from coarse cells to cells; cells without a strong face belong to no coarse cell."""
    diagonal, faces = matrix.diagonal(), sparse.triu(matrix, 1).tocoo()
    first, second = faces.coords
    strong = -faces.data > _STRONG * np.sqrt(diagonal[first] * diagonal[second])
    first, second = first[strong], second[strong]
    along, across = np.divmod(cells, width)
    block = along // _BLOCK * width + across // _BLOCK
    inside = block[first] == block[second]
    graph = sparse.coo_array((np.ones(inside.sum()), (first[inside], second[inside])), shape=matrix.shape)
    _, part = sparse.csgraph.connected_components(graph, directed=False)
    belongs = np.zeros(cells.size, dtype=bool)
    belongs[first] = belongs[second] = True
    rows = np.flatnonzero(belongs)
    _, coarse = np.unique(part[rows], return_inverse=True)
    of_coarse = sparse.csr_array((np.ones(rows.size), (rows, coarse)), shape=(cells.size, coarse.max(initial=-1) + 1))
    return of_coarse - sparse.diags_array(_RELAXATION / diagonal) @ matrix @ of_coarse
