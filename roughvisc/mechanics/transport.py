r"""Leakage through the gap, conduction through contact spots, and connected clusters of cells. Arrays only.

**Leakage** follows from Reynolds' equation by finite volumes on the cells of the contact's grid.

The cells on a path from one side to the other and the faces between them form a network of resistors. A small network
is solved by direct factors, a large one by conjugate gradients on two grids.

Direct factors lose all digits if conductances span more than about twelve decades: the weak faces of a wide basin are
rounded away in the diagonal of the equations. Then the network is eliminated cell by cell in sums of positive numbers
only [3]_.

A cell of the coarse network is a set of cells of a block that strong faces connect. Smoothed aggregation [1]_ carries
its pressure to the cells: the pressure of the coarse cell, :math:`T p`, followed by one Jacobi step,
:math:`(1 - \omega D^{-1} A) T`. Jacobi steps before and after reduce errors that differ from one cell to the
next. The coarse equations are solved directly. Therefore a channel that is one cell wide in a narrow place does not
slow the iterations down, as it does with an algebraic multigrid of many levels.

**Conduction** follows from the stiffness of a contact at constant area, as one flat punch.

A body of resistivity ``rho`` whose surface is at one potential ``V`` on the spots and insulated elsewhere carries the
current ``I = 2 k V / rho``, where ``k`` is the stiffness ``F = E* k delta`` of a flat punch with the outline of the
spots. The Green's function of both problems is ``1/(2 pi r)``, times ``rho`` for the potential and ``2 / E*`` for the
displacement [2]_. Two bodies in series conduct ``2 k / (rho_1 + rho_2)``.

Grid error, measured on discs, squares at any angle, strips and Hertz contacts:

1. At an edge where the gap opens, counting cells overestimates the spot, and a punch of cells is too soft. The two
   errors cancel: the punch has the stiffness of the spot with the corrected area, and it is the derivative of force by
   approach on the same grid. A correction is not needed.
2. At an edge of the material the outline is known, and the punch is too soft to first order. The problem is solved
   again on cells of half the side, and the stiffness is extrapolated: by twice the difference for an outline along the
   cells, and by 1.2 times the difference for an oblique outline. The cells of an oblique outline form a staircase. The
   share of faces that belong to steps distinguishes the two.

.. [1] P. Vaněk, J. Mandel, M. Brezina, Algebraic multigrid by smoothed aggregation for second and fourth order elliptic
   problems, Computing 56 (1996) 179-196.
.. [2] J. R. Barber, *Proc. R. Soc. A* 459 (2003) 53-66.
.. [3] W. K. Grassmann, M. I. Taksar, D. P. Heyman, Oper. Res. 33 (1985) 1107-1116.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse

from roughvisc.mechanics.contact.solver import neighbours, solve_contact
from roughvisc.mechanics.grid import Boundary, Grid

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Numbers = NDArray[np.integer[Any]]

#: Relative error of the conductance at which the iteration ends.
_CLOSE = 1e-9
#: Number of cells from which two grids are used, and relative error of the energy in each round on them.
_LARGE = 2**12
_ON_TWO_GRIDS = (1e-16, 1e-2, 1e-2, 1e-2)
#: Largest number of rounds with direct factors.
_BY_FACTORS = 8
#: Largest number of rounds of the elimination without subtractions, and its largest number of multiplications: some
#: seconds.
_BY_ELIMINATION = 9
_MOST_PRODUCTS = 2**32
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

# Factors of the difference to cells of half the side: along the cells, oblique, and the share of faces in steps from
# which an outline counts as oblique (a disc has 0.59). Squares of 64 cells at 0 to 45 degrees: within 9e-4.
_ALONG = 2.0
_OBLIQUE = 1.2
_STEPS = 0.6
# Error of the extrapolated value over the same difference.
_OFF = 0.4
# Error of the position of an edge where the gap opens, in cells: the error common to all faces, and three standard
# deviations of one face, since the edge lies anywhere in its cell. Rough surfaces of 32 to 128 cells: within 0.6 of the
# estimate.
_SHARED = 0.03
_SCATTER = 1.0
# Error of the pressure over the square root of the error of the stiffness, which is of second order.
_OF_PRESSURE = 0.1


def label_clusters(mask: Mask, wrap: tuple[bool, bool] = (False, False)) -> NDArray[np.intp]:
    """Number the connected clusters of one map. Cells that share only a corner are not connected.

    Parameters
    ----------
    mask : ndarray of bool, shape (nx, ny)
        Cells that belong to any cluster.
    wrap : pair of bool
        Whether a cluster continues across the opposite borders of each axis.

    Returns
    -------
    ndarray of int, shape (nx, ny)
        Numbers from 1 on; 0 outside the clusters.

    Examples
    --------
    >>> ends = np.array([[True], [False], [True]])
    >>> int(label_clusters(ends).max()), int(label_clusters(ends, (True, False)).max())
    (2, 1)
    """
    labels, count = ndimage.label(mask)
    borders = [labels.take((0, -1), axis).swapaxes(0, axis) for axis in (0, 1) if wrap[axis]]
    links = np.concatenate([np.zeros((2, 1), int), *borders], axis=1)
    links = links[:, (links > 0).all(axis=0)]
    graph = sparse.coo_array((np.ones(links.shape[1]), links), shape=(count + 1, count + 1))
    return sparse.csgraph.connected_components(graph, directed=False)[1][labels]


class Flow(NamedTuple):
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
    span too many decades for two grids, direct factors follow. If they span too many decades for the factors, the cells
    are eliminated without subtractions. Networks too large for this elimination, from about 256 cells a side, state an
    error as large as the conductance.

    By Dirichlet's principle the dissipation of approximate pressures exceeds the conductance [2]_. The excess is the
    work of the net flow into the cells on the remaining error of the pressures, which the next round
    solves for. The iteration ends when it is below 1e-9 of the conductance.

    References
    ----------
    .. [1] B. J. Hamrock, S. R. Schmid, B. O. Jacobson, Fundamentals of Fluid Film Lubrication, 2004, chapter 7.
    .. [2] P. G. Doyle, J. L. Snell, Random Walks and Electric Networks, MAA, 1984, section 1.3.5.
    """
    widest = float(gap.max(initial=0.0))
    nx, ny = gap.shape
    mobility = (np.maximum(gap, 0.0) / (widest or 1.0)) ** 3
    labels = label_clusters(mobility > 0, (False, wrap))
    on_path = np.isin(labels, np.intersect1d(labels[0], labels[-1])) & (labels > 0)
    cells = np.flatnonzero(on_path)
    scale = widest**3 / 12
    if not cells.size:
        return Flow(0.0, 0.0, np.zeros(gap.shape), np.zeros(gap.shape))
    faces = _conductances(np.where(on_path, mobility, 0.0), spacing[1] / spacing[0], wrap)
    difference = _differences(cells, nx, ny)
    inlet = np.zeros(faces.size)  # the pressure is 1 at the inlet, 0 at the outlet
    inlet[:ny] = 1.0
    matrix = (difference.T @ sparse.diags_array(faces) @ difference).tocsr()
    pressure = np.zeros(cells.size)
    conductance = 0.0
    error = np.inf
    for solve in _solvers(matrix, cells, ny):
        drop = inlet - difference @ pressure
        left = difference.T @ (faces * drop)
        step = solve(left)
        conductance = float(faces @ drop**2)
        if step is None:
            continue
        error = abs(float(left @ step))
        # the factors lose digits for a wide basin behind narrow slits; each round recovers some
        pressure = np.clip(pressure + step, 0.0, 1.0)
        if error <= _CLOSE * conductance:
            drop = inlet - difference @ pressure
            break
    else:
        if cells.size * ny**2 > _MOST_PRODUCTS:  # any pressures give an upper bound, and zero is a lower bound
            drop = inlet - difference @ np.nan_to_num(pressure)
            conductance = error = float(faces @ drop**2)
        else:
            solve_exactly = _elimination(faces, cells, (nx, ny))
            drop = inlet.copy()
            for _ in range(_BY_ELIMINATION):
                left = difference.T @ (faces * drop)
                step = solve_exactly(left)
                conductance = float(faces @ drop**2)
                error = abs(float(left @ step))
                drop -= difference @ step  # not from the pressures, whose differences lose digits in a basin
                if max(error, float(abs(left).max())) <= _CLOSE * conductance:
                    break
    flux = scale * faces * drop
    along = flux[: (nx + 1) * ny].reshape(nx + 1, ny)
    across = flux[(nx + 1) * ny :].reshape(nx, ny)
    along = along[1:] + along[:-1]
    across = across + np.roll(across, 1, axis=1)
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

    def in_series(first: Array, second: Array) -> Array:
        # no product, which may underflow
        low = np.minimum(first, second)
        high = np.maximum(first, second)
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


def _solvers(matrix: sparse.csr_array, cells: Numbers, width: int) -> Iterator[Callable[[Array], Array | None]]:
    """Yield the solver of each round: two grids for a large network, then direct factors, unless they are singular."""
    with suppress(RuntimeError):
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
    factors = splu((scaling @ matrix @ scaling).tocsc(), **options)
    return lambda source: scale * factors.solve(scale * source)


def _elimination(faces: Array, cells: Numbers, shape: tuple[int, int]) -> Callable[[Array], Array]:
    """Return a solver that eliminates the cells in order, each replaced by faces between its neighbours.

    All numbers are sums, products and ratios of conductances. Therefore each pressure due to positive sources is
    accurate to rounding.

    Parameters
    ----------
    faces : ndarray
        Conductances, see :func:`_conductances`.
    cells : ndarray of int, shape (n,)
        Indices of the cells in the flattened map, ascending.
    shape : tuple of int
        Shape of the map.
    """
    nx, ny = shape
    along = faces[: (nx + 1) * ny].reshape(nx + 1, ny)
    across = faces[(nx + 1) * ny :].reshape(nx, ny)
    # The front: for each column, the first cell that is not eliminated yet. Its faces to the others and to both sides.
    between = np.zeros((ny, ny))
    outside = along[0].copy()
    shares = np.zeros((cells.size, ny))
    totals = np.zeros(cells.size)
    number = np.full(nx * ny, -1)
    number[cells] = np.arange(cells.size)

    def enter(row: int, column: int) -> None:
        """Add the faces of a cell of the front to the outlet and to the cells before it in its row."""
        if row == nx - 1:
            outside[column] += along[nx, column]
        neighbours_before = [(column - 1, across[row, column - 1])] if column else []
        if column == ny - 1:
            neighbours_before.append((0, across[row, column]))
        for other, face in neighbours_before:
            between[column, other] += face
            between[other, column] += face

    for column in range(ny):
        enter(0, column)
    for index, (row, column) in enumerate(np.ndindex(nx, ny)):
        weights = between[column].copy()
        own = outside[column]
        weights[column] = along[row + 1, column] if row < nx - 1 else 0.0  # the next cell of the column takes the place
        between[column] = 0.0
        between[:, column] = 0.0
        outside[column] = 0.0
        total = float(weights.sum() + own)
        if number[index] >= 0 and total > 0:
            share = weights / total
            shares[number[index]] = share
            totals[number[index]] = total
            between += weights[:, None] * share
            outside += own * share
        if row < nx - 1:
            enter(row + 1, column)
    columns = cells % ny

    def solve(source: Array) -> Array:
        received = source.copy()
        pressure = np.zeros_like(source)
        passed_on = np.zeros(ny)
        front = np.zeros(ny)
        for cell, column in enumerate(columns):
            received[cell] += passed_on[column]
            passed_on[column] = 0.0
            passed_on += shares[cell] * received[cell]
        for cell in range(cells.size - 1, -1, -1):
            driven = received[cell] / totals[cell] if totals[cell] > 0 else 0.0
            pressure[cell] = front[columns[cell]] = driven + shares[cell] @ front
        return pressure

    return solve


def _solver_on_two_grids(
    matrix: sparse.csr_array, cells: Numbers, width: int
) -> Callable[[float, Array], Array | None]:
    """Return a solver by preconditioned conjugate gradients: from a source in each cell to the pressures of the cells.

    Its first argument is the relative error of the energy at which the iteration ends. If it does not converge, it
    returns its last iterate. If rounding ends the iteration, it returns None.

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
        pressure = weight * left
        pressure += prolongation @ on_coarse(restriction @ (left - matrix @ pressure))
        return pressure + weight * (left - matrix @ pressure)

    def solve(enough: float, source: Array) -> Array | None:
        pressure = np.zeros_like(source)
        left = source.copy()
        direction = np.zeros_like(source)
        before = 1.0
        energy = 0.0
        for _ in range(_MOST):
            better = precondition(left)
            product = float(left @ better)
            direction = better + product / before * direction
            through = matrix @ direction
            power = float(direction @ through)
            if 0 <= product <= enough * energy:
                break
            if not (product > 0 and power > 0):
                return None
            length = product / power
            pressure += length * direction
            left -= length * through
            before = product
            energy = energy + length * product
        return pressure

    return solve


def _prolongation(matrix: sparse.csr_array, cells: Numbers, width: int) -> sparse.csr_array:
    """Return the prolongation from coarse cells to cells; cells without a strong face belong to no coarse cell."""
    diagonal = matrix.diagonal()
    faces = sparse.triu(matrix, 1).tocoo()
    first, second = faces.coords
    strong = -faces.data > _STRONG * np.sqrt(diagonal[first] * diagonal[second])
    first = first[strong]
    second = second[strong]
    along, across = np.divmod(cells, width)
    block = along // _BLOCK * width + across // _BLOCK
    inside = block[first] == block[second]
    graph = sparse.coo_array((np.ones(inside.sum()), (first[inside], second[inside])), shape=matrix.shape)
    _, component = sparse.csgraph.connected_components(graph, directed=False)
    belongs = np.zeros(cells.size, dtype=bool)
    belongs[first] = belongs[second] = True
    rows = np.flatnonzero(belongs)
    _, coarse = np.unique(component[rows], return_inverse=True)
    of_coarse = sparse.csr_array((np.ones(rows.size), (rows, coarse)), shape=(cells.size, coarse.max(initial=-1) + 1))
    return of_coarse - sparse.diags_array(_RELAXATION / diagonal) @ matrix @ of_coarse


def frozen_contact(
    contact: Mask,
    spacing: tuple[float, float],
    boundary: Boundary = "free",
    *,
    present: Mask | None = None,
    tolerance: float = 1e-6,
) -> tuple[float, float]:
    """Return the stiffness of a contact at constant area, and its error.

    Parameters
    ----------
    contact : ndarray of bool, shape (nx, ny)
        Cells in contact.
    spacing : tuple of float
        Cell sides ``(dx, dy)``. [m]
    boundary : {"free", "periodic", "mirror"}
        With periodic or mirror boundaries the approach is measured to the mean plane of a half-space, and the stiffness
        refers to one period, or to the map.
    present : ndarray of bool, shape (nx, ny), optional
        Cells with material; None: all. The outline of a spot is known exactly next to absent cells and at the border of
        free space.
    tolerance : float
        Approximate relative error of the stiffness due to the solver.

    Returns
    -------
    stiffness : float
        Force over approach, over the contact modulus; for a disc twice the radius. Infinite in full contact
        unless space is free. [m]
    error : float
        Error of the stiffness due to grid and solver. [m]
    """
    if not contact.any():
        return 0.0, 0.0
    if contact.all() and boundary != "free":
        return math.inf, 0.0
    present = np.ones(contact.shape, dtype=bool) if present is None else present
    beyond: Any = {"free": "constant", "periodic": "wrap", "mirror": "symmetric"}[boundary]
    rimmed, rim = (np.pad(mask, 1, mode=beyond) for mask in (contact, present))
    if boundary == "free":  # the surface outside the spots has no influence
        [(x, y)] = ndimage.find_objects(contact.astype(np.int8))
        around = slice(x.start, x.stop + 2), slice(y.start, y.stop + 2)
        contact = contact[x, y]
        rimmed = rimmed[around]
        rim = rim[around]
    stiffness, off, pressure = _punch(contact, spacing, boundary, tolerance)
    ends, opens, scatter = _edge_energies(rimmed, rim, pressure, spacing)
    # the faces of mirror images have equal errors
    images = 2 ** sum(np.array_equal(contact, np.flip(contact, axis)) for axis in (0, 1))
    error = off + _SHARED * opens + _SCATTER * math.sqrt(images) * scatter
    if ends == 0:
        return stiffness, error
    split = np.repeat(np.repeat(contact, 2, axis=0), 2, axis=1)  # edges of the material: cells of half the side
    finer, off, _ = _punch(split, (spacing[0] / 2, spacing[1] / 2), boundary, tolerance)
    difference = ends / (ends + opens) * max(finer - stiffness, 0.0)
    oblique = min(_staircase(rimmed) / _STEPS, 1.0)
    share = _OBLIQUE + (_ALONG - _OBLIQUE) * (1 - oblique) ** 2
    return stiffness + share * difference, error + share * off + _OFF * difference


def _punch(
    contact: Mask, spacing: tuple[float, float], boundary: Boundary, tolerance: float
) -> tuple[float, float, Array]:
    """Return a lower bound of the stiffness, a bound on its error [m], and the pressure of the punch.

    ``k = max 2 sum p - p.Kp`` has an error of second order in the pressure, at most twice the duality gap.
    """
    body = Grid((contact.shape[0], contact.shape[1]), spacing, boundary)
    nearness = _OF_PRESSURE * math.sqrt(tolerance)
    punch = solve_contact(body, np.zeros(contact.shape), approach=1.0, present=contact, tolerance=nearness)
    energy = float(np.sum(punch.pressure * punch.displacement))
    stiffness = body.cell_area * (2 * punch.load - energy)
    return stiffness, body.cell_area * energy * punch.bound**2, punch.pressure


def _edge_energies(
    contact: Mask, rim: Mask, pressure: Array, spacing: tuple[float, float]
) -> tuple[float, float, float]:
    """Return the change of the stiffness if the edge of the contact moves by one cell. [m]

    The first number is for edges of the material, the second for edges where the gap opens. The third is for edges
    where the gap opens whose faces move independently: the root of the sum of squares.

    If an edge moves out by ``ds``, the stiffness grows by ``K^2 ds / 2`` with the strength ``K`` of the singularity.
    The squared pressure of the edge cell times the cell side is in proportion to ``K^2``.

    Parameters
    ----------
    contact, rim : ndarray of bool, shape (nx + 2, ny + 2)
        Contact cells, and cells with material, with a rim of one cell.
    pressure : ndarray, shape (nx, ny)
        Pressure of the punch. [-]
    """
    touching, material = (np.stack([*neighbours(mask, "free")]) for mask in (contact, rim))
    faces = (contact & ~touching)[:, 1:-1, 1:-1]  # towards each of the four neighbours
    energy = (np.repeat(spacing, 2) * spacing[0] * spacing[1])[:, None, None] * pressure**2
    opens = faces & material[:, 1:-1, 1:-1]

    def total(terms: Array, counted: Mask) -> float:
        return float(np.sum(terms, axis=(1, 2), where=counted).sum())

    return total(energy, faces & ~opens), total(energy, opens), math.sqrt(total(energy**2, opens))


def _staircase(contact: Mask) -> float:
    """Return the share of the faces of the outline in steps, two per inner corner; the map has a rim of one cell."""
    faces = sum(int(np.count_nonzero((contact & ~seen)[1:-1, 1:-1])) for seen in neighbours(contact, "free"))
    around = contact[1:, 1:].astype(int) + contact[:-1, 1:] + contact[1:, :-1] + contact[:-1, :-1]
    return 2 * int(np.count_nonzero(around == 3)) / max(faces, 1)
