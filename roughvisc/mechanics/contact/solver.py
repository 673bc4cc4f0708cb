r"""Contact of one instant: pressure and contact area of an elastic contact problem.

The pressure ``p`` minimises ``p.Kp/2 + g.p`` over ``p >= 0``, where ``K`` maps pressure to displacement and ``g`` is
the gap without pressure. Either the load or the approach is given. The solver depends on neither time nor material:
pressure is divided by the contact modulus, and the history of a viscoelastic material is part of ``g``.

The method is constrained conjugate gradients on an evolving contact area [1]_. It differs from the printed algorithm:

1. The residual is preconditioned by the inverse of the periodic kernel, so that the number of iterations grows slowly
   with the grid. The direction is conjugate to the last step taken, even if that step was cut at zero pressure.
2. A step is cut at zero pressure first. One convolution then gives the minimum along it and the new displacement.
3. The iteration stops at the estimated error of the pressure, not at the change of the pressure, which can stall. The
   preconditioned residual estimates this error.
4. A step that does not descend is shortened, and finally replaced by a projected-gradient step, which always descends.
   A projected-gradient step is also taken if the duality gap has not halved in 30 iterations.
5. Without a first guess, under a load and from 256 cells a side, the contact is solved on cells twice as long first.
6. From 768 cells a side the preconditioner has a second level for contact in many small spots.
7. Under periodic boundaries a uniform pressure does not displace a half-space. A given approach therefore needs a
   separate check of the load near full contact.

Vectors of an iteration hold the values of the *free* cells, which carry pressure or penetrate. All pressures and
lengths are divided by one pressure, so that loads of 1e-300 are solved like any others.

.. [1] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from roughvisc.errors import ConvergenceError
from roughvisc.mechanics.contact import passes as host
from roughvisc.mechanics.contact.free_cells import Free
from roughvisc.mechanics.contact.long_waves import LongWaves
from roughvisc.mechanics.contact.passes import Last, inner
from roughvisc.mechanics.grid import Boundary, Grid, namespace

Array = Any  # an array of NumPy or CuPy, depending on the grid

#: Change of the step length from one iteration to the next: smallest, largest, and largest after a cut step.
SHRINK = 0.3
GROW = 3.0
GROW_AFTER_CUT = 1.3
#: Shorter steps than this part of a trial are replaced by a projected-gradient step.
SHORTEST_STEP = 1e-3
#: Iterations in which the duality gap must halve.
PATIENCE = 30
#: The relative duality gap may be this many times the tolerance if the estimated error of the pressure is small enough.
GAP_SLACK = 1.5
#: A first step is taken whole. The next step is conjugate to it if the minimum along the first lies near its end,
#: within this part of its length.
NEARLY_MINIMUM = 0.1
#: Safety factor that makes the estimated error hardly ever too small; and the factor with the second level of the
#: preconditioner.
CAUTION = 1.3
CAUTION_WITH_BLOCKS = 2.4
#: Rounding of a displacement, relative to its largest value.
ROUNDING = 8 * float(np.finfo(float).eps)
#: Distance to the approach of full contact, over the approach, below which the load is undetermined.
NEAREST_TO_FULL = 1e-12
#: Distance to the approach of full contact, over the approach, below which the mean gap needs separate weights.
NEARLY_FULL = 1e-3
#: Number of cells a side from which a problem without a first guess is solved on half as many first; tolerance there.
COARSE_FROM = 256
COARSE_TOLERANCE = 0.03
#: Number of cells a side from which the second level of the preconditioner may pay. Measured at 512 squared: 3 to 14 %
#: more time for 10 to 15 % fewer iterations; at 768, 0 to 18 % less time; at 1024, 6 to 30 % less.
BLOCKS_FROM = 768
#: Counted contact cells overestimate the area by this part of the staircase perimeter times the cell side; measured
#: on Hertz contacts of 6 to 200 cells' radius (0.080 to 0.092).
PERIMETER_CORRECTION = 0.088


class ContactState(NamedTuple):
    """Solved contact problem.

    Attributes
    ----------
    pressure : array, shape (nx, ny)
        Pressure over the contact modulus, zero outside the contact. [-]
    displacement : array, shape (nx, ny)
        Displacement under this pressure. [m]
    approach : float
        Rigid-body approach ``omega``: the gap is ``g + displacement - omega``. [m]
    load : float
        Sum of the pressure over the cells. [-]
    error : float
        Estimated relative error of the pressure, ``sum |p - p*| / sum p*`` with the exact ``p*`` on this grid.
    bound : float
        Bound on the relative error of the pressure in the energy norm, ``sqrt(2 G / p.Kp)`` with the duality gap ``G``.
        Under a given approach it holds to first order only.
    approach_error : float
        Duality gap over the load: error of the approach under a given load. [m]
    iterations : int
        Number of steps.
    """

    pressure: Array
    displacement: Array
    approach: float
    load: float
    error: float
    bound: float
    approach_error: float
    iterations: int


def solve_contact(
    grid: Grid,
    gap: Array,
    *,
    load: float | None = None,
    approach: float | None = None,
    tolerance: float = 1e-4,
    start: Array | None = None,
    start_displacement: Array | None = None,
    overwrite: bool = False,
    present: Array | None = None,
    max_iterations: int = 10_000,
) -> ContactState:
    """Return the contact state under a given load or approach.

    Parameters
    ----------
    grid : Grid
        Cells, boundary and body.
    gap : array, shape (nx, ny)
        Gap without pressure at zero approach; ignored at absent cells. [m]
    load, approach : float
        Sum of the pressure over the cells [-], or rigid-body approach [m]; exactly one.
    tolerance : float
        Largest estimated relative error of the pressure, L1 norm. At least 1e-11 or so, because of rounding.
    start : array, shape (nx, ny), optional
        First guess of the pressure; negative values count as zero. [-]
    start_displacement : array, shape (nx, ny), optional
        Displacement under `start`, if known to 1e-6 or so; saves a convolution. [m]
    overwrite : bool
        Whether `gap`, `start` and `start_displacement` may be overwritten, which saves the memory of three fields.
    present : array of bool, shape (nx, ny), optional
        Cells with material. Default: all.
    max_iterations : int
        Limit of the iterations.

    Raises
    ------
    ConvergenceError
        If the tolerance is not reached, or if the approach reaches full contact.
    """
    passes = passes_of(grid.xp)
    if present is not None:
        present = None if present.all() else present.reshape(-1)
    if start is None or not (start > 0).any():
        start = start_displacement = None
    if not overwrite:
        gap = gap.copy()
        start = None if start is None else start.copy()
        start_displacement = None if start_displacement is None else start_displacement.copy()
    if start is None and load is not None and present is None and min(gap.shape) >= COARSE_FROM:
        start = coarse_guess(grid, gap, load)
    problem = ScaledProblem.of(grid, gap, load, approach, present)
    pressure, separation = problem.first_guess(start, start_displacement)

    under_load = problem.under_load
    rests_on_guess = start_displacement is not None  # until the first trial, whose displacement is computed
    has_blocks = min(gap.shape) >= BLOCKS_FROM  # the preconditioner may have a second level
    on_grid = passes.Scatter(grid.xp.zeros(gap.shape))
    cells = grid.xp.flatnonzero(pressure)
    touching = cells.size  # number of cells in contact
    previous: Last | None = None
    requested_size = requested_duality = math.nan  # L1 norm of the last preconditioned residual, duality gap then
    length = 1.0
    error = best = math.inf
    stalled = 0
    for iteration in range(max_iterations + 1):
        # The gap is closed under a given approach: the energy decreases if all cells carry less.
        if problem.is_blind and touching == gap.size:
            pressure -= pressure.min()
            previous = None

        # Approach of the present contact, equation (7) of the paper, and the cells that may change, (14).
        free = passes.measure(
            pressure, separation, problem.gap.reshape(gap.shape), cells, problem.level, under_load, present
        )
        cells = free.cells
        touching = free.touching
        duality = duality_gap(free, under_load)
        rounding = duality_rounding(grid, free)
        # as with a single cell: no step would correct the displacement
        if free.largest_residual == 0 and rests_on_guess:
            separation = problem.separation_under(pressure)
            rests_on_guess = False
            continue

        # The error estimate is the last requested change of pressure, scaled by the decrease of the duality gap since.
        if free.largest_residual == 0:
            error = 0.0
        elif iteration:
            error = requested_size * math.sqrt(duality / requested_duality) / max(free.total, 1e-300)
        if is_solved(free, error, tolerance, duality, rounding):
            error += load_error(problem, pressure, separation, free)
            if error <= tolerance:
                break
        if iteration == max_iterations:
            raise ConvergenceError(unsolved(iteration, error, tolerance))
        stalled += 1
        if duality < best / 2:
            best = duality
            stalled = 0

        # Direction, equation (9): the preconditioned residual.
        waves = LongWaves.of(grid, free, passes) if has_blocks else None
        direction = passes.preconditioned(grid, free, waves, on_grid)
        # Conjugate to the step before, on the cells that are free now.
        direction, requested_size = passes.conjugate(direction, free.residual, previous, on_grid, cells, under_load)
        previous = response = None  # frees the last response before the next one is computed
        requested_size *= CAUTION if waves is None else CAUTION_WITH_BLOCKS
        requested_duality = max(duality, 1e-300)
        # The preconditioned residual estimates the present error without another convolution. It does not count before
        # the first step, because the displacement of a first guess is not accurate enough.
        estimate = requested_size / max(free.total, 1e-300)
        if not rests_on_guess and is_solved(free, estimate, tolerance, duality, rounding):
            estimate += load_error(problem, pressure, separation, free)
            if estimate <= tolerance:
                error = estimate
                break

        # Trial: a step, equation (12), cut at zero pressure, (13), and scaled to the load, (15). The load is the sum of
        # the present pressure, because a step longer than the trial would magnify its rounding error.
        load_of_step = free.total if under_load else None
        slope = 0.0
        while stalled < PATIENCE and length >= SHORTEST_STEP:
            trial, change, slope = passes.cut_step(free.held, direction, free.residual, length, load_of_step)
            if slope < 0:
                break
            length /= 4
        if not slope < 0:
            trial, change, slope = projected_gradient_step(grid, free, under_load)
            length = 1.0
            best = duality
            stalled = 0
        if not slope < 0:  # the minimum, to rounding
            error = requested_size / max(free.total, 1e-300)
            if error > tolerance and duality > rounding:
                raise ConvergenceError(unsolved(iteration, error, tolerance))
            break

        # Minimize the energy along the search direction, equation (11): one convolution.
        if rests_on_guess:  # replaces the displacement of the first guess, so that rounding errors do not accumulate
            response = grid.displacement(on_grid(trial, cells)).reshape(-1)
            response -= separation
            response += problem.gap
        else:
            response = grid.displacement(on_grid(change, cells)).reshape(-1)
        curvature, minimum, fraction = passes.line_search(free.held, trial, change, slope, response, cells)
        longest = GROW_AFTER_CUT if fraction < minimum else GROW
        if rests_on_guess:  # take the whole step: the displacement is known exactly only for its end
            fraction = 1.0
            rests_on_guess = False
            curvature = curvature if abs(minimum - 1) < NEARLY_MINIMUM else 0.0
        passes.advance(pressure, separation, cells, (free.held, trial, change), response, fraction)
        previous = (cells, change, response, curvature) if curvature > 0 else None
        length *= min(max(minimum, SHRINK), longest)

    level = problem.approach_of(pressure, separation, free)
    separation -= problem.gap
    separation *= problem.unit
    pressure *= problem.unit
    return ContactState(
        pressure=pressure.reshape(gap.shape),
        displacement=separation.reshape(gap.shape),
        approach=level * problem.unit + problem.lowest_gap,
        load=free.total * problem.unit,
        error=error,
        bound=math.sqrt(2 * duality / free.energy) if free.energy > 0 else 0.0,
        approach_error=duality / free.total * problem.unit if free.total > 0 else 0.0,
        iterations=iteration,
    )


# -------------------------------------------------------------------------------- scaled problem, first guess, approach


@dataclass(frozen=True)
class ScaledProblem:
    """Contact problem with pressures and lengths over one pressure, and lengths from the lowest point of the gap.

    Under a load the pressures then add up to one.

    Attributes
    ----------
    grid : Grid
        Cells, boundary and body.
    gap : array, shape (nx ny,)
        Scaled gap without pressure at zero approach; zero at absent cells.
    present : array of bool, shape (nx ny,), or None
        Cells with material; None: all.
    under_load : bool
        Whether the load is given, not the approach.
    unit : float
        Pressure over the contact modulus that scales the problem: the load, or the overlap over the largest
        displacement under unit pressure. [-]
    lowest_gap : float
        Smallest gap of a present cell. [m]
    level : float
        Scaled overlap under a given approach; zero under a load.
    """

    grid: Grid
    gap: Array
    present: Array | None
    under_load: bool
    unit: float
    lowest_gap: float
    level: float

    @classmethod
    def of(
        cls, grid: Grid, gap: Array, load: float | None, approach: float | None, present: Array | None
    ) -> ScaledProblem:
        """Return the scaled problem; `gap` is overwritten.

        Parameters
        ----------
        grid, gap, load, approach
            See :func:`solve_contact`.
        present : array of bool, shape (nx ny,), or None
            Cells with material; None: all.

        Raises
        ------
        ConvergenceError
            If the approach reaches full contact, so that it does not determine the load.
        """
        lowest_gap = float(gap.min() if present is None else gap.reshape(-1)[present].min())
        overlap = 0.0 if approach is None else approach - lowest_gap
        unit = load if load is not None else (overlap / grid.largest_eigenvalue if overlap > 0 else 1.0)
        scaled_gap = gap.reshape(-1)
        scaled_gap -= lowest_gap
        scaled_gap /= unit
        if present is not None:
            scaled_gap[~present] = 0
        problem = cls(grid, scaled_gap, present, load is not None, unit, lowest_gap, overlap / unit)
        if problem.is_blind and problem.full_approach - problem.level <= NEAREST_TO_FULL * problem.level:
            raise ConvergenceError("the approach reaches full contact and does not determine the load")
        return problem

    @property
    def is_blind(self) -> bool:
        """Whether the approach is given and the energy does not depend on a uniform pressure."""
        return not self.under_load and not self.grid.definite

    @property
    def full_approach(self) -> float:
        """Scaled approach of full contact, if a uniform pressure does not displace the surface; otherwise infinite."""
        return math.inf if self.grid.definite or self.present is not None else float(self.gap.mean())

    def separation_under(self, pressure: Array) -> Array:
        """Return the scaled separation at zero approach under a pressure, shape (nx ny,): one convolution."""
        return self.gap + self.grid.displacement(pressure.reshape(self.grid.shape)).reshape(-1)

    def first_guess(self, start: Array | None, start_displacement: Array | None) -> tuple[Array, Array]:
        """Return the first guess of the scaled pressure, and the separation under it at zero approach.

        The pressure is the given one, or else uniform under a load, and proportional to the overlap of the surfaces
        under an approach.

        Parameters
        ----------
        start, start_displacement : array, shape (nx, ny), or None
            Given pressure [-], and displacement under it [m]; both are overwritten.

        Returns
        -------
        tuple of array, shape (nx ny,)
            Scaled pressure and separation.
        """
        grid = self.grid
        if start is not None:
            pressure = start.reshape(-1)
            pressure[pressure < 0] = 0
            pressure /= self.unit
        elif self.under_load:
            pressure = grid.xp.ones(grid.size)
        else:
            pressure = grid.xp.maximum(self.level - self.gap, 0) / grid.largest_eigenvalue
        if self.present is not None:
            pressure[~self.present] = 0
        scale = 1 / float(pressure.sum()) if self.under_load else 1.0
        pressure *= scale
        if start_displacement is None:
            return pressure, self.separation_under(pressure)
        separation = start_displacement.reshape(-1)
        separation *= scale / self.unit
        separation += self.gap
        return pressure, separation

    def approach_of(self, pressure: Array, separation: Array, free: Free) -> float:
        """Return the scaled approach of the solution.

        Under a load it is the separation in the contact, weighted by the pressure, and at most the approach of full
        contact.

        Parameters
        ----------
        pressure, separation : array, shape (nx ny,)
            Scaled pressure, and separation at zero approach.
        free : Free
            Free cells of the solution.
        """
        if not self.under_load:
            return free.level
        full = self.full_approach
        contact = self.grid.xp.flatnonzero(pressure)
        weight = pressure[contact]
        if full - free.level < NEARLY_FULL * full:
            weight = punch_pressure(self.grid, separation.reshape(self.grid.shape), contact, free.level)
        whole = float(weight.sum())
        if not whole > 0:
            return full
        return min(free.level + inner(weight, separation[contact] - free.level) / whole, full)


def coarse_guess(grid: Grid, gap: Array, load: float) -> Array:
    """Return the pressure of the same problem on half as many cells a side, on the cells of the grid. [-]"""
    shape = (gap.shape[0] // 2, gap.shape[1] // 2)
    xp = grid.xp
    coarse = grid.on(shape)
    sides = list(zip(gap.shape, shape, strict=True))
    rows, columns = (-(-xp.arange(m) * n // m) for n, m in sides)  # an odd number of cells: one is left out
    few = xp.stack([gap[xp.ix_(rows + i, columns + j)] for i in (0, 1) for j in (0, 1)]).mean(axis=0)
    coarse_state = solve_contact(coarse, few, load=load * few.size / gap.size, tolerance=COARSE_TOLERANCE)
    grid.convolutions += coarse.convolutions
    rows, columns = (xp.arange(n) * m // n for n, m in sides)
    return coarse_state.pressure[xp.ix_(rows, columns)]


# ----------------------------------------------------------------------------------------------- steps of an iteration


def passes_of(xp: Any) -> Any:
    """Return the module of the passes over the free cells for arrays of NumPy, or of CuPy on a GPU."""
    if not hasattr(xp, "RawKernel"):
        return host
    from roughvisc.mechanics.contact import kernels

    return kernels


def duality_gap(free: Free, under_load: bool) -> float:
    """Return the duality gap, an upper bound on the excess of the energy over its minimum."""
    lowest = min(free.least, free.level)
    if under_load:
        return max(free.weighted - lowest * free.total, 0.0)
    return abs(free.weighted - free.level * free.total) + free.total * (free.level - lowest)


def duality_rounding(grid: Grid, free: Free) -> float:
    """Return the rounding error of the duality gap."""
    highest = max(free.most, -free.least, 0.0)
    return ROUNDING * free.total * (highest + grid.self_influence * free.highest_pressure)


def is_solved(free: Free, error: float, tolerance: float, duality: float, rounding: float) -> bool:
    """Return whether the pressure is accurate enough.

    Parameters
    ----------
    free : Free
        Free cells. If they carry nothing although the surfaces overlap, a step has emptied all cells.
    error, tolerance : float
        Estimated relative error of the pressure, and the largest one.
    duality, rounding : float
        Duality gap, and its rounding error.
    """
    is_empty = free.largest_residual > 0 and free.total == 0
    return error <= tolerance and duality <= max(GAP_SLACK * tolerance * free.energy, rounding) and not is_empty


def projected_gradient_step(grid: Grid, free: Free, under_load: bool) -> tuple[Array, Array, float]:
    """Return the pressure after a projected-gradient step, its change, and the slope of the energy along the step.

    The slope is negative unless the pressure is the minimum, to rounding.
    """
    moved = free.held - free.residual / grid.largest_eigenvalue
    trial = onto_simplex(moved, free.total) if under_load else grid.xp.maximum(moved, 0)
    change = trial - free.held
    return trial, change, inner(change, free.residual)


def onto_simplex(values: Array, total: float) -> Array:
    """Return the nearest non-negative vector with a given sum."""
    # otherwise a small sum is lost next to large values
    xp = namespace(values)
    shifted = values - values.max()
    ordered = xp.sort(shifted)[::-1]
    excess = (xp.cumsum(ordered) - total) / xp.arange(1, ordered.size + 1)
    return xp.maximum(shifted - excess[int((ordered > excess).sum()) - 1], 0)


def unsolved(iterations: int, error: float, tolerance: float) -> str:
    """Return the message of an unsolved problem."""
    return (
        f"the contact is not solved: the estimated error of the pressure is {error:.2g} after {iterations} iterations, "
        f"expected {tolerance:.2g}"
    )


# ------------------------------------------------------------------------------------------------ near full contact


def opening_pressure(
    grid: Grid, separation: Array, contact: Array, level: float, present: Array | None
) -> tuple[Array, Array]:
    """Return the gap outside the contact over its mean, and approximately the pressure that opens it.

    Both are zero if no cell is open. Absent cells count as open as the widest gap.
    """
    opening = grid.xp.maximum(separation - level, 0)
    opening.reshape(-1)[contact] = 0
    if present is not None:
        absent = ~present.reshape(opening.shape)
        opening[absent] = 0
        opening[absent] = float(opening.max()) or 1.0
    mean = float(opening.mean())
    if not mean > 0:
        return opening, opening
    opening /= mean
    widest = float(opening.max())
    return opening, grid.inverse(((opening - 1) / widest).astype(np.float32)).astype(float) * widest


def load_error(problem: ScaledProblem, pressure: Array, separation: Array, free: Free) -> float:
    """Return the relative error of the load under a given approach with periodic boundaries.

    An error ``e`` of the gaps in the contact is equivalent to an error ``e`` of the surface. It changes the load by
    ``k`` times the mean of ``e``, where ``k = min w.(1/K)w / mean(w)^2`` over all ``w`` that vanish in the contact. The
    shape of the gap as ``w`` makes this a bound. Return zero if the energy depends on the load, or if no more than a
    quarter of the cells are in contact.
    """
    if not problem.is_blind or 4 * free.touching <= problem.grid.size:
        return 0.0
    xp = problem.grid.xp
    separation = separation.reshape(problem.grid.shape)
    contact = xp.flatnonzero(pressure)
    opening, opening_load = opening_pressure(problem.grid, separation, contact, free.level, problem.present)
    if not opening.any():
        return math.inf
    closed = xp.minimum(separation - free.level, 0)
    if problem.present is not None:
        closed[~problem.present.reshape(closed.shape)] = 0
    off = float(xp.maximum(separation.reshape(-1)[contact] - free.level, 0).sum()) - float(closed.sum())
    return inner(opening, opening_load) * off / separation.size / free.total


def punch_pressure(grid: Grid, separation: Array, contact: Array, level: float) -> Array:
    """Return about the pressure ``q`` of a flat punch at the cells of a contact; zero if no cell is open.

    Near full contact with periodic boundaries the mean gap must be accurate, and it is far smaller than the
    displacements. With ``q`` as the weight of the separation, an error ``e`` of the pressure changes the approach by
    ``q.Ke``, which vanishes because ``Kq`` is uniform.
    """
    flat = opening_pressure(grid, separation, contact, level, None)[1].reshape(-1)
    outside = (float(flat.sum()) - float(flat[contact].sum())) / max(flat.size - contact.size, 1)
    return grid.xp.maximum(outside - flat[contact], 0)


# ------------------------------------------------------------------------------------------------------ contact area


def neighbours(mask: Array, boundary: Boundary, outside: bool = False) -> Iterator[Array]:
    """Yield the mask of the neighbour across the lower and the upper face of each cell, along x, then along y.

    Parameters
    ----------
    mask : array of bool, shape (nx, ny)
        Mask of the cells.
    boundary : {"free", "periodic", "mirror"}
        Periodic: the first cell of a row is the neighbour of the last. Mirror: beyond the border, a cell's neighbour is
        its own image.
    outside : bool
        Value beyond the border in free space.

    Examples
    --------
    >>> [seen.ravel().tolist() for seen in neighbours(np.array([[True], [False]]), "free")][:2]
    [[False, True], [False, False]]
    >>> [seen.ravel().tolist() for seen in neighbours(np.array([[True], [False]]), "mirror")][:2]
    [[True, True], [False, False]]
    """
    for own in (mask, mask.T):
        lower = np.empty_like(own)
        upper = np.empty_like(own)
        lower[1:] = own[:-1]
        lower[0] = {"free": outside, "periodic": own[-1], "mirror": own[0]}[boundary]
        upper[:-1] = own[1:]
        upper[-1] = {"free": outside, "periodic": own[0], "mirror": own[-1]}[boundary]
        yield from (lower, upper) if own is mask else (lower.T, upper.T)


def contact_area(
    contact: Array, free: Array, cell_area: float, boundary: Boundary, outside: bool = False
) -> tuple[float, float, int]:
    """Return the counted area of the contact cells and their corrected area [m2], and the number of their faces.

    Counting cells overestimates the area by a part of the strip along the perimeter. The corrected area is without
    this part. Faces to free cells count.

    Parameters
    ----------
    contact, free : array of bool, shape (nx, ny)
        Contact cells, and cells with material out of contact.
    cell_area : float
        Area of a cell. [m2]
    boundary, outside
        See :func:`neighbours`.
    """
    counted = int(np.count_nonzero(contact)) * cell_area
    faces = 0
    for beside in neighbours(free, boundary, outside):
        faces += int(np.count_nonzero(contact & beside))
    # a face across x is dy long and lies in a strip dx wide, and the other way round
    return counted, max(counted - PERIMETER_CORRECTION * cell_area * faces, 0.0), faces
