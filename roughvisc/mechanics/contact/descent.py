"""Descent steps of the contact solver: the trial pressure and the length of the step towards it.

Vectors live on the free set (the cells that may change pressure), as flat indices into the grid; only what the
transforms take and give, and the search for cells that enter, runs over the whole grid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.contact.influence import Array, Cells
from roughvisc.mechanics.contact.problem import FreeSet, Problem
from roughvisc.mechanics.fields import passes

# No step goes farther than this many times its trial: along a uniform pressure the periodic kernel has no curvature.
# Measured on 400 solutions: the same iterations with 100, 1 % more with 10.
_FARTHEST = 30.0
# Of its trial, a step that empties cells goes the whole way or to the minimum along it; a parabola has fallen at the
# whole way if its minimum is beyond half of it.
_HALF_WAY = 0.5


@dataclass(frozen=True)
class Trial:
    """A pressure to try on the free set.

    Attributes
    ----------
    free_set : ndarray of int
        The cells that it changes.
    held, pressure, change : ndarray
        Pressure on them before, the one to try, and the difference.
    slope : float
        Derivative of ``f`` along the change.
    asked : float
        L1 norm of the change that the preconditioner asked for, but for the scale, and times what makes it as cautious
        a measure as one level's; NaN where it was not wanted.
    """

    free_set: Cells
    held: Array
    pressure: Array
    change: Array
    slope: float
    asked: float = math.nan


@dataclass(frozen=True)
class Step:
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


def conjugate_gradient(
    problem: Problem,
    free: FreeSet,
    level: float,
    energy: float,
    *,
    step_length: float,
    previous: Step | None,
    measured: bool,
) -> Trial:
    """Preconditioned trial, conjugate to the previous step.

    Parameters
    ----------
    problem : Problem
        What is asked.
    free : FreeSet
        Of the pressure so far; its separation is used up.
    level : float
        Approach of the contact.
    energy : float
        ``p.Kp``.
    step_length : float
        Length of the step along the search direction.
    previous : Step or None
        What to conjugate to.
    measured : bool
        Whether to measure the change that the preconditioner asks for.
    """
    threads = problem.influence.threads
    free_set, residual, held = free
    reference = level if problem.load is None else passes.total(residual, threads) / residual.size
    passes.lower(residual, reference, threads)
    search, caution = problem.precondition(residual, free_set, held, energy)
    asked = caution * passes.magnitude(search, threads) if measured else math.nan
    if previous is not None:
        search = _conjugate(problem, search, residual, free_set, previous)

    def moved(here: Array, before: Array) -> float:
        here *= -step_length
        here += before
        np.maximum(here, 0, out=here)  # in the manner of Polonsky and Keer: cut at zero, then scaled to the load
        return passes.summed(here)

    carried = sum(passes.of_vectors(moved, threads, search, held))
    scale = 1.0 if problem.load is None else problem.load / carried
    change = np.empty_like(search)

    def scaled(here: Array, before: Array, by: Array, downhill: Array) -> float:
        here *= scale
        np.subtract(here, before, out=by)
        return passes.summed(by * downhill)

    slope = sum(passes.of_vectors(scaled, threads, search, held, change, residual))
    return Trial(free_set, held, search, change, slope, asked)


def _conjugate(problem: Problem, search: Array, residual: Array, free_set: Cells, previous: Step) -> Array:
    """Search direction conjugate to the previous step, if it descends still."""
    influence, threads = problem.influence, problem.influence.threads
    response, unit = previous.displacement.reshape(-1), previous.unit / previous.curvature

    def along(here: Array, cells: Cells) -> float:
        return passes.summed(here * (response.take(cells) * unit))

    beta = sum(passes.of_vectors(along, threads, search, free_set))
    if beta > 0:
        former = passes.regather(previous.change, previous.free_set, free_set, influence.size, threads)
        mean = 0.0 if problem.load is None else passes.total(former, threads) / former.size

        def conjugated(here: Array, there: Array, downhill: Array) -> float:
            here -= mean
            here *= beta
            np.subtract(there, here, out=here)
            return passes.summed(downhill * here)

        if sum(passes.of_vectors(conjugated, threads, former, search, residual)) > 0:
            return former
    return search


def projected_gradient(problem: Problem, pressure: Array, displacement: Array, level: float) -> Trial:
    """Trial along the negative gradient, projected onto what is admissible: descends in any case."""
    stiffest, separation = problem.influence.largest, problem.separation(displacement)
    moved = pressure - (separation - level) / stiffest
    if problem.present is not None:
        moved = np.where(problem.present, moved, -math.inf)
    trial = np.maximum(moved, 0) if problem.load is None else onto_simplex(moved, problem.load)
    free_set = np.flatnonzero((trial > 0) | (pressure > 0))
    held, tried = pressure.take(free_set), trial.take(free_set)
    change = tried - held
    return Trial(free_set, held, tried, change, float((change * (separation - level).take(free_set)).sum()))


def onto_simplex(values: Array, total: float) -> Array:
    """Nearest non-negative array of given sum."""
    largest = float(values.max())
    shifted = values - largest  # a small sum is lost beside large values otherwise
    ordered = np.sort(shifted, axis=None)[::-1]
    excess = (np.cumsum(ordered) - total) / np.arange(1, ordered.size + 1)
    last = int(np.count_nonzero(ordered > excess)) - 1
    return np.maximum(shifted - excess[last], 0)


def minimum_along(trial: Trial, curvature: float) -> float:
    """Where ``f`` is least along a trial, in parts of it."""
    return min(-trial.slope / curvature, _FARTHEST) if curvature > 0 else _FARTHEST


def admissible_fraction(trial: Trial, minimum: float, threads: int) -> tuple[float, bool]:
    """Fraction of a trial to take, and whether the border of the feasible set cut it."""
    held, tried, change = trial.held, trial.pressure, trial.change

    def release(before: Array, after: Array) -> bool:
        return bool(np.count_nonzero((before > 0) & (after == 0)))

    if any(passes.of_vectors(release, threads, held, tried)):
        # whole if f falls by it, so that these cells leave the contact
        return (1.0, minimum > 1) if minimum > _HALF_WAY else (minimum, False)
    if minimum <= 1:
        return minimum, False

    def reached(by: Array, before: Array) -> float:
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.fmin.reduce(by / before, initial=math.inf))

    # of its own pressure, in the cell that reaches zero first
    steepest = min(passes.of_vectors(reached, threads, change, held))
    limit = -1 / steepest if steepest < 0 else math.inf
    return min(minimum, limit), minimum > limit
