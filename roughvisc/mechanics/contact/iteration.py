"""Safeguarded, preconditioned conjugate gradients: the loop. See the package's notes for the method.

The pressure and its displacement are two fields that every step changes in place. The values that pass from step to
step say how they are to be read: an :class:`Iterate` which cells carry pressure and whether the displacement is exact,
a :class:`Search` how the next step is chosen, a :class:`Step` what it is conjugate to.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.contact.certificate import Certificate, certify
from roughvisc.mechanics.contact.descent import (
    Step,
    Trial,
    admissible_fraction,
    conjugate_gradient,
    minimum_along,
    projected_gradient,
)
from roughvisc.mechanics.contact.error_estimate import Asked, error_left, estimated_error, is_measured
from roughvisc.mechanics.contact.full_contact import approach_under_load, carries_excess
from roughvisc.mechanics.contact.influence import Array, Cells, Influence
from roughvisc.mechanics.contact.problem import Problem
from roughvisc.mechanics.contact.state import ContactState
from roughvisc.mechanics.fields import passes

# Iterations in which the duality gap must halve; otherwise a projected-gradient step is taken. Measured, like the
# factors below, by the iterations of 400 solutions of workflows/benchmarks/solver_error.py's problems at 64 squared:
# 7 % less with 10, 1 % more with 60 or without end.
_PATIENCE = 30
# From one step to the next the step length may shrink and grow by these factors, and by the last where the border of
# the feasible set cut the step. Measured: 3 % more iterations with 0.5 for the first, 1 % or less with 0.1, and with 2
# or 5 for the second; 9 % more with 1 for the last, 4 % less with 2.
_SHRINKAGE, _GROWTH, _GROWTH_IF_CUT = 0.3, 3.0, 1.3
# Steps are convolved in single precision on so many cells, from so many times the tolerance: some four steps pay for
# the convolution in double precision that follows them (measured: 0.6 of the time of one in double).
_SINGLE_FROM, _FAR = 96**2, 30.0
# Where the error of the pressure is asked for, a duality gap of so many times its tolerance will do.
_SLACK = 10.0


@dataclass(frozen=True)
class Iterate:
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


@dataclass(frozen=True)
class Search:
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


def pcg(
    problem: Problem,
    start: Array | None,
    start_displacement: Array | None,
    *,
    max_iterations: int,
    estimate_error: bool,
    error_tolerance: float | None,
) -> ContactState:
    """Iterate from a first guess, which is used up, until the certificate settles the problem."""
    iterate = _first(problem, start, start_displacement)
    search = Search(1 / problem.influence.scale)
    previous: Step | None = None  # to conjugate to
    asked: Asked | None = None
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
        return asked is not None and error_left(problem, iterate.pressure, certificate, asked) <= error_tolerance

    for iteration in range(max_iterations + 1):
        last = iteration == max_iterations
        iterate, certificate, separation = _certified(problem, iterate, is_enough, last)
        settled = is_enough(certificate, iterate)
        if settled or last:
            break
        if carries_excess(problem, iterate.contact):
            iterate, previous = _without_excess(iterate), None
            continue
        if iteration == 0:
            search = replace(search, single=_is_far(problem, certificate))
        search = search.after(certificate.duality_gap)

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
            first, asked = asked is None, Asked(trial.asked, certificate.duality_gap) if measured else None
            if first and is_enough(certificate, iterate):  # what is asked of the first guess is little
                settled = not iterate.approximate
                if settled:
                    break
                iterate, previous = _exact(problem, iterate), None
                continue
        if not trial.slope < 0:  # no descent
            if search.spacer and not iterate.approximate:
                break  # the projected gradient does not descend either: this is the minimum, to rounding
            iterate, search, previous = *_forgetting(problem, iterate, search, previous), None
            continue
        previous = None  # the memory of its displacement is needed
        iterate, search, previous = _stepped(problem, iterate, search, trial)
        del trial
    error = math.nan
    if estimate_error:
        error = estimated_error(problem, iterate.pressure, iterate.contact, iterate.displacement, certificate, asked)
    converged = certificate.converged or (settled and not certificate.hopeless)
    return _result(problem, iterate, replace(certificate, converged=converged), iteration, error)


def _first(problem: Problem, start: Array | None, start_displacement: Array | None) -> Iterate:
    """The first guess, made admissible."""
    pressure, displacement = problem.initial_iterate(start, start_displacement)
    approximate = displacement is not None
    if displacement is None:
        displacement = problem.influence.displacement(pressure)
    carried = pressure.reshape(-1)
    contact = passes.cells_where(lambda part: carried[part] != 0, carried.size, problem.influence.threads)
    return Iterate(pressure, displacement, contact, approximate)


def _exact(problem: Problem, iterate: Iterate) -> Iterate:
    """The same pressure with its displacement computed anew in double precision, in the place of the old one."""
    displacement = problem.influence.displacement(iterate.pressure, out=iterate.displacement)
    return Iterate(iterate.pressure, displacement, iterate.contact, approximate=False)


def _certified(
    problem: Problem, iterate: Iterate, is_enough: Callable[[Certificate, Iterate], bool], last: bool
) -> tuple[Iterate, Certificate, Array | None]:
    """The iterate, its certificate, which is never accepted of an approximate displacement, and its separation."""
    while True:
        certificate, separation = certify(problem, iterate.pressure, iterate.contact, iterate.displacement)
        if not (iterate.approximate and (last or is_enough(certificate, iterate))):
            return iterate, certificate, separation
        del separation  # a field less while the pressure is convolved anew
        iterate = _exact(problem, iterate)


def _without_excess(iterate: Iterate) -> Iterate:
    """Too much load for any gap is cut: a uniform pressure displaces nothing, and the energy falls without it."""
    pressure = iterate.pressure
    pressure -= pressure.min()
    return Iterate(pressure, iterate.displacement, np.flatnonzero(pressure), iterate.approximate)


def _is_far(problem: Problem, certificate: Certificate) -> bool:
    """Whether single precision pays."""
    return problem.gap.size >= _SINGLE_FROM and certificate.duality_gap > _FAR * problem.tolerance * certificate.energy


def _forgetting(problem: Problem, iterate: Iterate, search: Search, previous: Step | None) -> tuple[Iterate, Search]:
    """After a step that would not descend: forget what is not exact, then the history, then the preconditioner too."""
    if iterate.approximate:
        return _exact(problem, iterate), replace(search, single=False)
    return iterate, replace(search, spacer=previous is None, step_length=1 / problem.influence.scale)


def _stepped(problem: Problem, iterate: Iterate, search: Search, trial: Trial) -> tuple[Iterate, Search, Step | None]:
    """The iterate after a trial, as far along it as ``f`` falls and the pressure is admissible: one convolution."""
    influence, free_set, threads = problem.influence, trial.free_set, problem.influence.threads
    pressure, displacement = iterate.pressure.reshape(-1), iterate.displacement
    if not search.single:  # else its displacement is that of the change alone
        passes.scatter(pressure, free_set, trial.pressure, threads)
    response, unit = _response(influence, iterate, trial, search.single)
    curvature = unit * passes.inner(response, free_set, trial.change, threads)
    minimum = minimum_along(trial, curvature)
    fraction, cut = admissible_fraction(trial, minimum, threads)

    def taken(cells: Cells, here: Array, change: Array, held: Array) -> Cells:
        if fraction != 1:
            here = fraction * change
            here += held
            np.maximum(here, 0, out=here)
        if fraction != 1 or search.single:
            pressure[cells] = here
        return cells[here > 0]

    found = passes.of_vectors(taken, threads, free_set, trial.pressure, trial.change, trial.held)
    contact = passes.concatenate(found, threads)
    passes.add_scaled(displacement, response, fraction * unit, threads)
    stepped = Iterate(iterate.pressure, displacement, contact, approximate=search.single)
    if search.spacer:
        return stepped, replace(search, spacer=False), None
    factor = min(max(minimum, _SHRINKAGE), _GROWTH_IF_CUT if cut else _GROWTH)
    search = Search(search.step_length * factor, False, search.single, search.best, search.since)
    return stepped, search, Step(free_set, trial.change, response, unit, curvature) if curvature > 0 else None


def _response(influence: Influence, iterate: Iterate, trial: Trial, single: bool) -> tuple[NDArray[Any], float]:
    """Displacement by the change of a trial that the iterate's pressure has taken on, and its unit."""
    if single:
        return influence.displacement_single(trial.change, trial.free_set)
    response = influence.displacement(iterate.pressure)
    passes.subtract(response, iterate.displacement, influence.threads)
    return response, 1.0


def _result(
    problem: Problem, iterate: Iterate, certificate: Certificate, iterations: int, error: float
) -> ContactState:
    """The iterate in its own units."""
    pressure, displacement = iterate.pressure, iterate.displacement
    load, approach = passes.total(pressure.reshape(-1), problem.influence.threads), certificate.level
    if problem.load is not None:
        approach = approach_under_load(problem, pressure, iterate.contact, displacement, certificate.level)
    threads = problem.influence.threads
    passes.multiply(pressure, problem.unit, threads)
    passes.multiply(displacement, problem.length, threads)
    return ContactState(
        pressure=pressure,
        displacement=displacement,
        approach=approach * problem.length + problem.lowest,
        load=load * problem.unit,
        bound=certificate.bound,
        converged=certificate.converged,
        iterations=iterations,
        convolutions=problem.influence.convolutions,
        error=error,
    )
