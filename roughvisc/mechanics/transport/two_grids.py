r"""Flow through a large network on two grids: conjugate gradients on its cells, direct factors of a coarse one.

A cell of the coarse network is a set of cells of a block that strong faces connect. Smoothed aggregation [1]_ carries
its pressure to the cells: the pressure of the coarse cell, :math:`T p`, followed by one Jacobi step,
:math:`(1 - \omega D^{-1} A) T`. Jacobi steps before and after reduce errors that differ from one cell to the
next. The coarse equations are solved directly. Therefore a channel that is one cell wide in a narrow place does not
slow the iterations down, as it does with an algebraic multigrid of many levels.

.. [1] P. Vaněk, J. Mandel, M. Brezina, Algebraic multigrid by smoothed aggregation for second and fourth order elliptic
   problems, Computing 56 (1996) 179-196.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse

from roughvisc.mechanics.transport.network import Array, Network, equations, factors

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


def solver_on_two_grids(network: Network, width: int) -> Callable[[float, Array], Array]:
    """Return a solver by preconditioned conjugate gradients: from a source in each cell to the pressures of the cells.

    Its first argument is the relative error of the energy at which the iteration ends. If it does not converge, it
    returns its last iterate.

    Parameters
    ----------
    network : Network
        Cells and faces.
    width : int
        Number of the map's cells across the flow.
    """
    matrix = equations(network)
    diagonal = matrix.diagonal()
    prolongation = _prolongation(network, width, matrix, diagonal)
    restriction = prolongation.T.tocsr()
    # rounding hides very weak connections between coarse cells; the shift keeps the equations positive definite
    shift = np.maximum(_SHIFT * (prolongation.power(2).T @ diagonal), np.finfo(float).tiny)
    on_coarse = factors(restriction @ (matrix @ prolongation) + sparse.diags_array(shift))
    weight = _RELAXATION / diagonal

    def precondition(left: Array) -> Array:
        found = weight * left
        found += prolongation @ on_coarse(restriction @ (left - matrix @ found))
        found += weight * (left - matrix @ found)
        return found

    def solve(enough: float, source: Array) -> Array:
        pressure, left = np.zeros_like(source), source.copy()
        direction, before, energy = np.zeros_like(source), 1.0, 0.0
        for _ in range(_MOST):
            better = precondition(left)
            product = float(left @ better)
            direction *= product / before
            direction += better
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


def _prolongation(network: Network, width: int, matrix: sparse.csr_array, diagonal: Array) -> sparse.csr_array:
    """Return the prolongation from coarse cells to cells; cells without a strong face belong to no coarse cell."""
    first, second, count = network.first, network.second, len(diagonal)
    strong = network.conductance > _STRONG * np.sqrt(diagonal[first] * diagonal[second])
    first, second = first[strong], second[strong]
    along, across = np.divmod(network.cells, width)
    block = along // _BLOCK * width + across // _BLOCK
    inside = block[first] == block[second]
    graph = sparse.coo_array((np.ones(inside.sum()), (first[inside], second[inside])), shape=(count, count))
    _, part = sparse.csgraph.connected_components(graph, directed=False)
    belongs = np.zeros(count, dtype=bool)
    belongs[first] = belongs[second] = True
    is_coarse = np.bincount(part, belongs) > 0
    coarse = (np.cumsum(is_coarse) - 1)[part[belongs]]
    starts = np.concatenate([[0], np.cumsum(belongs)])
    of_coarse = sparse.csr_array((np.ones(len(coarse)), coarse, starts), shape=(count, np.count_nonzero(is_coarse)))
    step = matrix @ of_coarse
    step.data *= np.repeat(-_RELAXATION / diagonal, np.diff(step.indptr))
    return of_coarse + step
