r"""The contact solver: constrained conjugate gradients on an evolving contact area.

Minimise ``f(p) = p.Kp/2 + g.p`` over ``p >= 0`` (and ``sum p`` given, under load), where ``g`` is the gap that the
surfaces would have without pressure. Nothing here knows of time or material: pressure is divided by the contact
modulus, and a memory of the past is part of ``g``.

The method is that of constrained conjugate gradients on an evolving contact area [1]_, with these changes:

1. Preconditioned by the inverse of the periodic kernel, and conjugated to the step really taken (Hestenes-Stiefel),
   also when that step was cut by the contact's border, instead of restarting whenever the area changes.
2. One convolution an iteration: the step is first cut at zero pressure, then its convolution gives both the exact
   minimum along it and the new displacement. Printed algorithms spend one convolution on the step length and
   another on the cut pressure.
3. Every step descends, and a projected-gradient step is taken wherever progress stalls (a spacer step), so that
   convergence is proven. No normal run needs it.
4. Stopped on the duality gap, a bound on the error that costs nothing, not on the stagnation of the pressure. Under
   given approach and periodic boundaries that norm does not see the mean pressure, since a uniform pressure displaces
   nothing: there the load must be certain, too.
5. Without a first guess, under a load and from 256 cells a side, the contact is solved on half as many cells a side
   first, and so on down.
6. Far from the solution, steps are convolved in single precision and added to the displacement in double. What that
   leaves is 1e-7 of the steps and not of the displacement; before the solution is accepted, its displacement is
   computed anew in double precision, and judged.

.. [1] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206.

:func:`solve_contact` is the entry, :func:`pcg` the loop. The pressure and its displacement are two fields that every
step changes in place. The values that pass from step to step say how they are to be read: an :class:`Iterate` which
cells carry pressure and whether the displacement is exact, a :class:`Search` how the next step is chosen, a
:class:`SearchStep` what it is conjugate to.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.arrays import (
    add_scaled,
    any_positive,
    blocks,
    blockwise,
    cells_where,
    concatenate,
    empty,
    inner,
    parallel_map,
    regather,
    reused,
    scatter,
    sum_over,
    summed,
    total,
)
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact.certificate import (
    Certificate,
    RequestedChange,
    approach_under_load,
    carries_excess,
    certify,
    error_left,
    estimated_error,
    is_measured,
)
from roughvisc.mechanics.contact.influence import Array, Cells
from roughvisc.mechanics.contact.problem import ContactProblem, FreeSet

# Iterations in which the duality gap must halve; otherwise a projected-gradient step is taken. Measured, like the
# factors below, by the iterations of 400 solutions on rough and round surfaces at 64 squared:
# 7 % less with 10, 1 % more with 60 or without end.
_PATIENCE = 30
# From one step to the next the step length may shrink and grow by these factors, and by the last where the border of
# the feasible set cut the step. Measured: 3 % more iterations with 0.5 for the first, 1 % or less with 0.1, and with 2
# or 5 for the second; 9 % more with 1 for the last, 4 % less with 2.
_SHRINKAGE, _GROWTH, _GROWTH_IF_CUT = 0.3, 3.0, 1.3
# No step goes farther than this many times its trial: along a uniform pressure the periodic kernel has no curvature.
# Measured on 400 solutions: the same iterations with 100, 1 % more with 10.
_FARTHEST = 30.0
# Of its trial, a step that empties cells goes the whole way or to the minimum along it; a parabola has fallen at the
# whole way if its minimum is beyond half of it.
_HALF_WAY = 0.5
# Steps are convolved in single precision on so many cells, from so many times the tolerance: some four steps pay for
# the convolution in double precision that follows them (measured: 0.6 of the time of one in double).
_SINGLE_FROM, _FAR = 96**2, 30.0
# Where the error of the pressure is asked for, a duality gap of so many times its tolerance will do.
_SLACK = 10.0
# A cold start on so many cells a side is guessed on a grid of half as many, which is guessed in the same way.
# Measured with 5 to 95 % in contact and on spheres: 0.8 to 0.9 of the time at 256 squared, 0.7 to 0.8 at 1024.
_COARSE_FROM = 256
# Tolerance of the guess: what the coarse grid leaves out is more.
_COARSE_TOLERANCE = 0.03
# Rows of a grid that are averaged or spread at a time.
_ROWS = 8


@dataclass(frozen=True)
class ContactState:
    """A solved contact problem.

    Attributes
    ----------
    pressure : ndarray, shape (nx, ny)
        Pressure over the contact modulus, zero outside the contact. [-]
    displacement : ndarray, shape (nx, ny)
        Displacement due to this pressure. [m]
    approach : float
        Rigid-body approach ``omega``: the gap is ``g + displacement - omega``. [m]
    load : float
        Sum of the pressure over the cells. [-]
    bound : float
        Bound on the relative error of the pressure in the energy norm, ``sqrt(2 G / p.Kp)`` with the duality gap ``G``.
    approach_error : float
        Duality gap over the load: error of the approach under a given load. [m]
    converged : bool
        Whether the relative duality gap is below the tolerance; under given approach with periodic boundaries, also
        whether the load is within 10 times the tolerance.
    iterations, convolutions : int
        Cost; a convolution is a displacement or an application of the preconditioner.
    error : float
        Estimated relative error of the pressure, ``sum |p - p*| / sum p*`` with the exact ``p*`` on this grid; NaN
        unless asked for or not converged, infinite where the approach does not determine the load. Measured on 4,173
        solutions: at least 0.8 times the true error in 98 % of them, 2.4 times in the median, 8.3 times at the 98th
        percentile; `bound` is 160 times it in the median.
    """

    pressure: NDArray[np.float64]
    displacement: NDArray[np.float64]
    approach: float
    load: float
    bound: float
    converged: bool
    iterations: int
    convolutions: int
    error: float = math.nan
    approach_error: float = 0.0


def solve_contact(
    operator: Operator,
    gap: Array,
    *,
    load: float | None = None,
    approach: float | None = None,
    tolerance: float = 1e-8,
    start: Array | None = None,
    start_displacement: Array | None = None,
    present: NDArray[np.bool_] | None = None,
    max_iterations: int = 1000,
    overwrite: bool = False,
    estimate_error: bool = False,
    error_tolerance: float | None = None,
) -> ContactState:
    """Contact state under given load or given approach.

    Parameters
    ----------
    operator : Operator
        Grid and boundary.
    gap : ndarray, shape (nx, ny)
        Gap without pressure at zero approach; ignored at absent cells. [m]
    load : float, optional
        Sum of the pressure over the cells, positive. [-]
    approach : float, optional
        Rigid-body approach; this or the load is given. [m]
    tolerance : float
        On the relative duality gap, ``G / p.Kp``; the square of the relative error in the energy norm. Near full
        contact under given approach 10 times it is the largest relative error of the load.
    start : ndarray, shape (nx, ny), optional
        First guess of the pressure; negative values count as zero. [-]
    start_displacement : ndarray, shape (nx, ny), optional
        Displacement due to `start`, where that is known and nowhere negative or absent: saves a convolution. [m]
    present : ndarray of bool, shape (nx, ny), optional
        Cells where there is material; None: all.
    max_iterations : int
        The state reached by then is returned as not converged.
    overwrite : bool
        Whether `gap`, `start` and `start_displacement` may be used up, which spares copies of them.
    estimate_error : bool
        Whether to estimate the error of the pressure. It costs nothing, but an application of the preconditioner where
        the first guess was good enough, in full contact, and under given approach with periodic boundaries.
    error_tolerance : float, optional
        On the estimated error of the pressure. The state counts as converged where that is met, and the relative
        duality gap is within 10 times its tolerance; in full contact, and under given approach, with periodic
        boundaries by the duality gap alone.

    Returns
    -------
    ContactState

    Raises
    ------
    ValueError
        If neither a load nor an approach is given, or both are.
    """
    if (load is None) == (approach is None):
        raise ValueError("give either a load or an approach")
    if present is not None and present.all():
        present = None
    if not overwrite:
        gap = np.array(gap, dtype=float, order="C")
        start = None if start is None else np.array(start, dtype=float, order="C")
        start_displacement = (
            None if start_displacement is None else np.array(start_displacement, dtype=float, order="C")
        )
    with reused():
        wide = min(gap.shape) >= _COARSE_FROM
        if wide and load is not None and present is None and (start is None or not any_positive(start)):
            start, start_displacement = coarse_guess(operator, gap, load), None
        problem = ContactProblem.scaled(
            operator, gap, load=load, approach=approach, tolerance=tolerance, present=present
        )
        return pcg(
            problem,
            start,
            start_displacement,
            max_iterations=max_iterations,
            estimate_error=estimate_error,
            error_tolerance=error_tolerance,
        )


def pcg(
    problem: ContactProblem,
    start: Array | None,
    start_displacement: Array | None,
    *,
    max_iterations: int,
    estimate_error: bool,
    error_tolerance: float | None,
) -> ContactState:
    """Iterate from a first guess, which is used up, until the certificate settles the problem."""
    iterate = first_iterate(problem, start, start_displacement)
    search = Search(1 / problem.influence.scale)
    previous: SearchStep | None = None  # to conjugate to
    requested: RequestedChange | None = None  # of the last preconditioned step
    measured = estimate_error or error_tolerance is not None

    def is_enough(certificate: Certificate, iterate: Iterate) -> bool:
        if error_tolerance is None or not is_measured(problem, iterate.contact):
            return certificate.settled
        if certificate.hopeless:
            return True
        if certificate.duality_gap > _SLACK * problem.tolerance * certificate.energy:
            return False
        if certificate.bound <= error_tolerance:
            return True
        return (
            requested is not None and error_left(problem, iterate.pressure, certificate, requested) <= error_tolerance
        )

    for iteration in range(max_iterations + 1):
        # 1. Judge the pressure: is its duality gap, or the estimate of its error, small enough?
        last = iteration == max_iterations
        iterate, certificate, separation = judge(problem, iterate, is_enough, last)
        settled = is_enough(certificate, iterate)
        if settled or last:
            break
        if carries_excess(problem, iterate.contact):
            iterate, previous = without_excess(iterate), None
            continue
        if iteration == 0:
            far = certificate.duality_gap > _FAR * problem.tolerance * certificate.energy
            search = search._replace(single=far and problem.gap.size >= _SINGLE_FROM)
        search = search.after(certificate.duality_gap)

        # 2. Choose a trial on the cells in contact or penetrating: a conjugate one, or the projected gradient.
        if search.spacer:
            trial = projected_gradient(problem, iterate.pressure, iterate.displacement, certificate.level)
        else:
            free = problem.free_set(iterate.pressure, iterate.displacement, certificate.level, separation)
            separation = None  # a field less while the preconditioner works
            trial = conjugate_gradient(
                problem,
                free,
                certificate.level,
                certificate.energy,
                step_length=search.step_length,
                previous=previous,
                measured=measured,
            )
            del free
            first, requested = (
                requested is None,
                RequestedChange(trial.requested, certificate.duality_gap) if measured else None,
            )
            if first and is_enough(certificate, iterate):  # the preconditioned residual of the first guess is small
                settled = not iterate.approximate
                if settled:
                    break
                iterate, previous = with_exact_displacement(problem, iterate), None
                continue
        if not trial.slope < 0:  # no descent
            if search.spacer and not iterate.approximate:
                break  # the projected gradient does not descend either: this is the minimum, to rounding
            iterate, search, previous = *forget(problem, iterate, search, previous), None
            continue

        # 3. Go as far along it as the energy falls and the pressure is admissible.
        previous = None  # the memory of its displacement is needed
        iterate, search, previous = take_step(problem, iterate, search, trial)
        del trial

    error, converged = math.nan, certificate.converged or (settled and not certificate.hopeless)
    if estimate_error or not converged:
        error = estimated_error(
            problem, iterate.pressure, iterate.contact, iterate.displacement, certificate, requested
        )
    return in_own_units(problem, iterate, certificate._replace(converged=converged), iteration, error)


class Iterate(NamedTuple):
    """A pressure on the way.

    Attributes
    ----------
    pressure, displacement : ndarray, shape (nx, ny)
        Changed in place by the next step.
    contact : ndarray of int
        Cells that carry pressure, as flat indices.
    approximate : bool
        Whether the displacement is extrapolated, or summed up from steps in single precision.
    """

    pressure: Array
    displacement: Array
    contact: Cells
    approximate: bool


class Search(NamedTuple):
    """How the next step is chosen.

    Attributes
    ----------
    step_length : float
        Along the search direction: the preconditioner is the inverse up to boundaries and the contact's outline.
    spacer : bool
        Whether the next is a projected-gradient step.
    single : bool
        Whether steps are convolved in single precision.
    best, since : float, int
        A duality gap that is to be halved, and the iterations spent on that.
    """

    step_length: float
    spacer: bool = False
    single: bool = False
    best: float = math.inf
    since: int = 0

    def after(self, duality_gap: float) -> Search:
        """The search that knows the present duality gap: a spacer step is due where that has stalled."""
        if duality_gap < self.best / 2:
            return Search(self.step_length, self.spacer, self.single, best=duality_gap, since=0)
        if self.since + 1 >= _PATIENCE:
            return Search(self.step_length, True, self.single, best=duality_gap, since=0)
        return Search(self.step_length, self.spacer, self.single, self.best, self.since + 1)


class SearchTrial(NamedTuple):
    """A pressure to try on the free set.

    Attributes
    ----------
    free_set : ndarray of int
        The cells that it changes.
    held, pressure, change : ndarray
        Pressure on them before, the one to try, and the difference.
    slope : float
        Derivative of ``f`` along the change.
    requested : float
        L1 norm of the preconditioned residual, which is not scaled, times ``CAUTION`` if both levels of the
        preconditioner were used; NaN unless the error is to be estimated.
    """

    free_set: Cells
    held: Array
    pressure: Array
    change: Array
    slope: float
    requested: float = math.nan


class SearchStep(NamedTuple):
    """A trial whose displacement is known.

    Attributes
    ----------
    free_set, change : ndarray
        The cells, and the change of their pressure if all of the trial is taken.
    displacement : ndarray, shape (nx, ny)
        Displacement by this change over `unit`, in single or double precision.
    unit : float
        Its unit.
    curvature : float
        ``change . K change``.
    """

    free_set: Cells
    change: Array
    displacement: NDArray[Any]
    unit: float
    curvature: float


def first_iterate(problem: ContactProblem, start: Array | None, start_displacement: Array | None) -> Iterate:
    """The first guess, made admissible."""
    pressure, displacement = problem.initial_iterate(start, start_displacement)
    approximate = displacement is not None
    if displacement is None:
        displacement = problem.influence.displacement(pressure)
    carried = pressure.reshape(-1)
    contact = cells_where(lambda part: carried[part] != 0, carried.size, problem.influence.threads)
    return Iterate(pressure, displacement, contact, approximate)


def judge(
    problem: ContactProblem, iterate: Iterate, is_enough: Callable[[Certificate, Iterate], bool], last: bool
) -> tuple[Iterate, Certificate, Array | None]:
    """The iterate, its certificate and its separation; no iterate is accepted by an approximate displacement."""
    while True:
        certificate, separation = certify(problem, iterate.pressure, iterate.contact, iterate.displacement)
        if not (iterate.approximate and (last or is_enough(certificate, iterate))):
            return iterate, certificate, separation
        del separation  # a field less while the pressure is convolved anew
        iterate = with_exact_displacement(problem, iterate)


def with_exact_displacement(problem: ContactProblem, iterate: Iterate) -> Iterate:
    """The same pressure with its displacement computed anew in double precision, in the place of the old one."""
    displacement = problem.influence.displacement(iterate.pressure, out=iterate.displacement)
    return Iterate(iterate.pressure, displacement, iterate.contact, approximate=False)


def without_excess(iterate: Iterate) -> Iterate:
    """The iterate less the load that no gap needs: a uniform pressure displaces nothing, and the energy falls."""
    pressure = iterate.pressure
    pressure -= pressure.min()
    return Iterate(pressure, iterate.displacement, np.flatnonzero(pressure), iterate.approximate)


def forget(
    problem: ContactProblem, iterate: Iterate, search: Search, previous: SearchStep | None
) -> tuple[Iterate, Search]:
    """After a trial that does not descend: drop what is not exact, then the history, then the preconditioner too."""
    if iterate.approximate:
        return with_exact_displacement(problem, iterate), search._replace(single=False)
    return iterate, search._replace(spacer=previous is None, step_length=1 / problem.influence.scale)


def conjugate_gradient(
    problem: ContactProblem,
    free: FreeSet,
    level: float,
    energy: float,
    *,
    step_length: float,
    previous: SearchStep | None,
    measured: bool,
) -> SearchTrial:
    """Preconditioned trial, conjugate to the previous step.

    Parameters
    ----------
    problem : ContactProblem
        What is asked.
    free : FreeSet
        Of the pressure so far; its separation is used up.
    level : float
        Approach of the contact, where it is given; under a load the mean over the free set takes its place.
    energy : float
        ``p.Kp``.
    step_length : float
        Length of the step along the search direction.
    previous : SearchStep or None
        What to conjugate to.
    measured : bool
        Whether to measure the change that the preconditioner asks for.
    """
    influence, threads = problem.influence, problem.influence.threads
    free_set, residual, held = free
    reference = level if problem.load is None else total(residual, threads) / residual.size
    blockwise(np.subtract, residual, reference, out=residual, threads=threads)
    direction, caution = problem.precondition(residual, free_set, held, energy)
    excess = problem.excess(direction)

    def keep_load(here: Array, cells: Cells) -> tuple[float, float]:
        here -= excess
        along = 0.0 if previous is None else summed(here * (response.take(cells) * unit))
        return summed(np.abs(here)) if measured else math.nan, along

    if previous is not None:
        response, unit = previous.displacement.reshape(-1), previous.unit / previous.curvature
    size, beta = map(sum, zip(*blockwise(keep_load, direction, free_set, threads=threads), strict=True))

    # Conjugate to the previous step, if the direction descends still.
    if previous is not None and beta > 0:
        former = regather(previous.change, previous.free_set, free_set, influence.size, threads)
        mean = problem.excess(former)

        def conjugate(here: Array, there: Array, downhill: Array) -> float:
            here -= mean
            here *= beta
            np.subtract(there, here, out=here)
            return summed(downhill * here)

        if sum_over(conjugate, former, direction, residual, threads=threads) > 0:
            direction = former
    trial = direction  # in whose memory the trial is made

    def move(here: Array, before: Array) -> float:
        here *= -step_length
        here += before
        np.maximum(here, 0, out=here)  # in the manner of Polonsky and Keer: cut at zero, then scaled to the load
        return summed(here)

    carried = sum_over(move, trial, held, threads=threads)
    scale = 1.0 if problem.load is None else problem.load / carried
    change = np.empty_like(trial)

    def scale_to_load(here: Array, before: Array, by: Array, downhill: Array) -> float:
        here *= scale
        np.subtract(here, before, out=by)
        return summed(by * downhill)

    slope = sum_over(scale_to_load, trial, held, change, residual, threads=threads)
    return SearchTrial(free_set, held, trial, change, slope, caution * size)


def projected_gradient(problem: ContactProblem, pressure: Array, displacement: Array, level: float) -> SearchTrial:
    """SearchTrial along the negative gradient, projected onto what is admissible: descends in any case."""
    stiffest, separation = problem.influence.largest, problem.separation(displacement)
    moved = pressure - (separation - level) / stiffest
    if problem.present is not None:
        moved = np.where(problem.present, moved, -math.inf)
    trial = np.maximum(moved, 0) if problem.load is None else onto_simplex(moved, problem.load)
    free_set = np.flatnonzero((trial > 0) | (pressure > 0))
    held, tried = pressure.take(free_set), trial.take(free_set)
    change = tried - held
    return SearchTrial(free_set, held, tried, change, float((change * (separation - level).take(free_set)).sum()))


def onto_simplex(values: Array, total: float) -> Array:
    """Nearest non-negative array of given sum."""
    largest = float(values.max())
    shifted = values - largest  # a small sum is lost beside large values otherwise
    ordered = np.sort(shifted, axis=None)[::-1]
    excess = (np.cumsum(ordered) - total) / np.arange(1, ordered.size + 1)
    last = int(np.count_nonzero(ordered > excess)) - 1
    return np.maximum(shifted - excess[last], 0)


def take_step(
    problem: ContactProblem, iterate: Iterate, search: Search, trial: SearchTrial
) -> tuple[Iterate, Search, SearchStep | None]:
    """The iterate after a trial, the search from there, and what to conjugate to: one convolution."""
    influence, free_set, threads = problem.influence, trial.free_set, problem.influence.threads
    pressure, displacement = iterate.pressure.reshape(-1), iterate.displacement
    response: NDArray[Any]
    if search.single:  # the displacement of the change alone
        response, unit = influence.displacement_single(trial.change, free_set)
    else:
        scatter(pressure, free_set, trial.pressure, threads)
        response, unit = influence.displacement(iterate.pressure, less=displacement), 1.0
    curvature = unit * inner(response, free_set, trial.change, threads)
    minimum = minimum_along(trial, curvature)
    fraction, cut = admissible_fraction(trial, minimum, threads)

    def settle(cells: Cells, here: Array, change: Array, held: Array) -> Cells:
        if fraction != 1:
            here = fraction * change
            here += held
            np.maximum(here, 0, out=here)
        if fraction != 1 or search.single:
            pressure[cells] = here
        return cells[here > 0]

    found = blockwise(settle, free_set, trial.pressure, trial.change, trial.held, threads=threads)
    contact = concatenate(found, threads)
    add_scaled(displacement, response, fraction * unit, threads)
    stepped = Iterate(iterate.pressure, displacement, contact, approximate=search.single)
    if search.spacer:
        return stepped, search._replace(spacer=False), None
    factor = min(max(minimum, _SHRINKAGE), _GROWTH_IF_CUT if cut else _GROWTH)
    search = Search(search.step_length * factor, False, search.single, search.best, search.since)
    return stepped, search, SearchStep(free_set, trial.change, response, unit, curvature) if curvature > 0 else None


def minimum_along(trial: SearchTrial, curvature: float) -> float:
    """Where ``f`` is least along a trial, in parts of it."""
    return min(-trial.slope / curvature, _FARTHEST) if curvature > 0 else _FARTHEST


def admissible_fraction(trial: SearchTrial, minimum: float, threads: int) -> tuple[float, bool]:
    """Fraction of a trial to take, and whether the border of the feasible set cut it."""
    held, tried, change = trial.held, trial.pressure, trial.change

    def empties(before: Array, after: Array) -> bool:
        return bool(np.count_nonzero((before > 0) & (after == 0)))

    if any(blockwise(empties, held, tried, threads=threads)):
        # whole if f falls by it, so that these cells leave the contact
        return (1.0, minimum > 1) if minimum > _HALF_WAY else (minimum, False)
    if minimum <= 1:
        return minimum, False

    def steepest_of(by: Array, before: Array) -> float:
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.fmin.reduce(by / before, initial=math.inf))

    # of its own pressure, in the cell that reaches zero first
    steepest = min(blockwise(steepest_of, change, held, threads=threads))
    limit = -1 / steepest if steepest < 0 else math.inf
    return min(minimum, limit), minimum > limit


def in_own_units(
    problem: ContactProblem, iterate: Iterate, certificate: Certificate, iterations: int, error: float
) -> ContactState:
    """The iterate in its own units."""
    pressure, displacement = iterate.pressure, iterate.displacement
    load, approach = total(pressure.reshape(-1), problem.influence.threads), certificate.level
    if problem.load is not None:
        approach = approach_under_load(problem, pressure, iterate.contact, displacement, certificate.level)
    threads = problem.influence.threads
    gap_over_load = max(certificate.duality_gap, 0.0) / load if load > 0 else 0.0
    blockwise(np.multiply, pressure, problem.pressure_scale, out=pressure, threads=threads)
    blockwise(np.multiply, displacement, problem.length_scale, out=displacement, threads=threads)
    return ContactState(
        pressure=pressure,
        displacement=displacement,
        approach=approach * problem.length_scale + problem.lowest,
        load=load * problem.pressure_scale,
        bound=certificate.bound,
        converged=certificate.converged,
        iterations=iterations,
        convolutions=problem.influence.convolutions,
        error=error,
        approach_error=gap_over_load * problem.length_scale,
    )


def coarse_guess(operator: Operator, gap: Array, load: float) -> Array | None:
    """First guess of the pressure under a load, constant over two by two cells; None where that does not pay. [-]"""
    if min(gap.shape) < _COARSE_FROM:
        return None
    coarse = operator.on((gap.shape[0] // 2, gap.shape[1] // 2))
    few = _averaged(gap, coarse.shape, operator.threads)
    load *= few.size / gap.size
    with reused(separate=True):  # none of its fields is as large as those to come
        found = solve_contact(coarse, few, load=load, tolerance=_COARSE_TOLERANCE, overwrite=True).pressure
    return _spread(found, gap.shape, operator.threads)


def _averaged(field: Array, shape: tuple[int, int], threads: int) -> Array:
    """Means over two by two cells; of an odd number, one row or column is left out."""
    rows, columns = (-(-np.arange(m) * n // m) for n, m in zip(field.shape, shape, strict=True))
    found = np.empty(shape)

    def work(part: slice) -> None:
        here = field.take(rows[part], axis=0)
        here += field.take(rows[part] + 1, axis=0)
        here *= 0.25
        np.add(here.take(columns, axis=1), here.take(columns + 1, axis=1), out=found[part])

    parallel_map(work, list(blocks(shape[0], _ROWS)), threads)
    return found


def _spread(values: Array, shape: tuple[int, ...], threads: int) -> Array:
    """The same values on a finer grid."""
    rows, columns = (np.arange(n) * m // n for n, m in zip(shape, values.shape, strict=True))
    found = empty(shape)

    def work(part: slice) -> None:
        found[part] = values.take(rows[part], axis=0).take(columns, axis=1)

    parallel_map(work, list(blocks(shape[0], _ROWS)), threads)
    return found
