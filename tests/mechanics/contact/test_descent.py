"""One step of the contact solver: direction, length and energy, by dense linear algebra."""

import math

import numpy as np
import pytest
from support import rough_gap

from roughvisc.mechanics import arrays as passes
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import solver
from roughvisc.mechanics.contact.problem import ContactProblem
from roughvisc.mechanics.contact.solver import (
    Iterate,
    Search,
    SearchStep,
    SearchTrial,
    admissible_fraction,
    minimum_along,
)

SHAPE, SPACING = (7, 6), (0.5, 0.8)
CONTROLS = pytest.mark.parametrize("known", [{"load": 3.0}, {"approach": 0.9}], ids=["load", "approach"])


def scaled(known, boundary="free", present=None):
    """A problem, and the matrix that displaces its cells, both in its own units."""
    operator = Operator(SHAPE, SPACING, boundary)
    wanted = {"load": None, "approach": None} | known
    problem = ContactProblem.scaled(operator, rough_gap(SHAPE), **wanted, tolerance=1e-6, present=present)
    cells = np.eye(problem.gap.size).reshape(-1, *SHAPE)
    matrix = (
        np.array([operator.displacement(cell).ravel() for cell in cells])
        * problem.pressure_scale
        / problem.length_scale
    )
    return problem, matrix


def energy(problem, matrix, pressure):
    """What is minimised, with what the approach given takes from the gap."""
    p, gap = pressure.ravel(), problem.gap.ravel()
    return 0.5 * p @ matrix @ p + p @ (gap - (0.0 if problem.load is not None else problem.target))


def some_pressure(problem, seed=0):
    pressure = np.random.default_rng(seed).random(SHAPE) + 0.5
    return pressure if problem.load is None else pressure * problem.load / pressure.sum()


def judged(problem, matrix, pressure):
    """Gap at zero approach, and the level of the contact."""
    separation = problem.gap + (matrix @ pressure.ravel()).reshape(SHAPE)
    return separation, problem.target if problem.load is None else float(separation[pressure > 0].mean())


def trial_of(problem, pressure, separation, level, **options):
    """The preconditioned trial of a pressure of known separation."""
    free = problem.free_set(pressure, separation - problem.gap, level)
    return solver.conjugate_gradient(problem, free, level, 1.0, **options)


def applied(trial, pressure):
    after = pressure.copy()
    after.reshape(-1)[trial.free_set] = trial.pressure
    return after


@CONTROLS
def test_preconditioned_step__descends_as_it_says(known):
    problem, matrix = scaled(known)
    pressure = some_pressure(problem)
    separation, level = judged(problem, matrix, pressure)
    trial = trial_of(problem, pressure, separation, level, step_length=0.2, previous=None, measured=True)
    after = applied(trial, pressure)
    assert trial.change == pytest.approx(trial.pressure - trial.held)
    assert trial.held == pytest.approx(pressure.ravel()[trial.free_set])
    gradient = (separation - level).ravel()
    assert trial.slope == pytest.approx(gradient @ (after - pressure).ravel(), rel=1e-9)
    assert trial.slope < 0
    if problem.load is not None:
        assert after.sum() == pytest.approx(problem.load)
    # without the cut, the change is the one asked for times the step's length
    short = trial_of(problem, pressure, separation, level, step_length=1e-3, previous=None, measured=True)
    assert np.abs(short.change).sum() == pytest.approx(1e-3 * short.requested, rel=1e-6)
    silent = trial_of(problem, pressure, separation, level, step_length=1e-3, previous=None, measured=False)
    assert math.isnan(silent.requested)


@CONTROLS
def test_next_step__is_conjugate_to_the_step_really_taken(known):
    problem, matrix = scaled(known)
    pressure = some_pressure(problem)
    separation, level = judged(problem, matrix, pressure)
    rng = np.random.default_rng(2)
    found = 0
    for _ in range(20):
        change = rng.standard_normal(problem.gap.size)
        change -= change.mean() if problem.load is not None else 0.0
        displaced, unit = matrix @ change, 0.3
        previous = SearchStep(
            np.arange(change.size), change, (displaced / unit).reshape(SHAPE), unit, float(change @ displaced)
        )
        options = {"step_length": 1e-4, "measured": False}
        plain = trial_of(problem, pressure, separation, level, previous=None, **options)
        trial = trial_of(problem, pressure, separation, level, previous=previous, **options)
        if trial.change == pytest.approx(plain.change, rel=1e-12):
            continue  # the direction itself where it leads away from the previous step
        found += 1
        angle = trial.change @ displaced
        assert abs(angle) < 1e-6 * np.linalg.norm(trial.change) * np.linalg.norm(displaced)
        assert trial.slope < 0
    assert found > 5


@CONTROLS
@pytest.mark.parametrize("absent", [False, True])
def test_projected_gradient__is_the_nearest_admissible_point_down_the_slope(known, absent):
    """Among admissible pressures none is nearer to the gradient's step: angles with all directions are obtuse."""
    present = None
    if absent:
        present = np.ones(SHAPE, bool)
        present[2:4, 1] = False
    problem, matrix = scaled(known, present=present)
    pressure = some_pressure(problem)
    if absent:
        pressure[~present] = 0
        pressure *= 1 if problem.load is None else problem.load / pressure.sum()
    separation, level = judged(problem, matrix, pressure)
    trial = solver.projected_gradient(problem, pressure, separation - problem.gap, level)
    after = applied(trial, pressure)
    assert after.min() >= 0
    assert absent is False or not after[~present].any()
    aim = pressure - (separation - level) / problem.influence.largest
    rng = np.random.default_rng(3)
    for _ in range(50):
        other = rng.random(SHAPE) * (rng.random(SHAPE) < 0.5) * (True if present is None else present)
        if problem.load is not None:
            other *= problem.load / other.sum()
        assert ((aim - after) * (other - after)).sum() <= 1e-12
    assert problem.load is None or after.sum() == pytest.approx(problem.load, rel=1e-12)
    assert trial.slope == pytest.approx(((separation - level) * (after - pressure)).sum())
    assert energy(problem, matrix, after) < energy(problem, matrix, pressure)


def test_simplex_projection__keeps_a_small_sum_beside_large_values():
    values = 1e9 + np.array([[0.0, 3.0], [1.0, 2.5]])
    assert solver.onto_simplex(values, 1.0) == pytest.approx(np.array([[0, 0.75], [0, 0.25]]), abs=1e-6)
    assert solver.onto_simplex(np.zeros((2, 3)), 6.0) == pytest.approx(np.ones((2, 3)))


@pytest.mark.parametrize(
    ("slope", "curvature", "expected"), [(-3.0, 2.0, 1.5), (-3.0, 0.01, 30.0), (-3.0, 0.0, 30.0), (-3.0, -1.0, 30.0)]
)
def test_minimum__is_that_of_the_parabola_and_not_too_far(slope, curvature, expected):
    nothing = np.zeros(1)
    trial = SearchTrial(np.zeros(1, int), nothing, nothing, nothing, slope)
    assert minimum_along(trial, curvature) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("held", "tried", "minimum", "expected"),
    [
        # no cell is emptied: to the minimum, or to where the first cell reaches zero
        ((1.0, 2.0, 0.0), (0.6, 3.0, 0.0), 0.7, (0.7, False)),
        ((1.0, 2.0, 0.0), (0.6, 3.0, 0.0), 1.0, (1.0, False)),
        ((1.0, 2.0, 0.0), (0.6, 3.0, 0.5), 2.0, (2.0, False)),
        ((1.0, 2.0, 0.0), (0.6, 1.8, 0.5), 4.0, (2.5, True)),
        ((1.0, 2.0, 0.0), (1.0, 2.0, 0.5), 4.0, (4.0, False)),
        # one is: all of it if the energy falls by that, so that the cell leaves the contact
        ((1.0, 2.0), (0.0, 3.0), 0.4, (0.4, False)),
        ((1.0, 2.0), (0.0, 3.0), 0.5, (0.5, False)),
        ((1.0, 2.0), (0.0, 3.0), 0.6, (1.0, False)),
        ((1.0, 2.0), (0.0, 3.0), 1.0, (1.0, False)),
        ((1.0, 2.0), (0.0, 3.0), 1.7, (1.0, True)),
    ],
)
@pytest.mark.parametrize("part", [1, 100])
def test_step__goes_as_far_as_the_energy_falls_and_no_pressure_turns_to_tension(
    held, tried, minimum, expected, part, monkeypatch
):
    monkeypatch.setattr(passes, "_BLOCK", part)
    held, tried = np.array(held), np.array(tried)
    trial = SearchTrial(np.arange(held.size), held, tried, tried - held, -1.0)
    fraction, cut = admissible_fraction(trial, minimum, 1)
    assert (fraction, cut) == (pytest.approx(expected[0]), expected[1])
    assert (held + fraction * (tried - held)).min() >= -1e-15


@CONTROLS
@pytest.mark.parametrize("single", [False, True], ids=["double", "single"])
@pytest.mark.parametrize("step_length", [1e-4, 0.3, 30.0])
def test_step__ends_where_the_energy_is_least_along_it(known, single, step_length):
    problem, matrix = scaled(known)
    pressure = some_pressure(problem)
    separation, level = judged(problem, matrix, pressure)
    displacement = separation - problem.gap
    trial = trial_of(problem, pressure, separation, level, step_length=step_length, previous=None, measured=False)
    whole = applied(trial, pressure) - pressure
    curvature = whole.ravel() @ matrix @ whole.ravel()
    minimum = min(-trial.slope / curvature, 30.0)
    before = energy(problem, matrix, pressure)
    iterate = Iterate(pressure.copy(), displacement.copy(), np.arange(pressure.size), False)
    search = Search(step_length, False, single, best=5.0, since=3)
    stepped, after, taken = solver.take_step(problem, iterate, search, trial)
    exact = (matrix @ stepped.pressure.ravel()).reshape(SHAPE)
    precision = (1e-5 if single else 1e-11) * np.abs(displacement).max()
    assert stepped.displacement == pytest.approx(exact, abs=precision)
    assert stepped.approximate == single
    assert np.array_equal(stepped.contact, np.flatnonzero(stepped.pressure))
    assert energy(problem, matrix, stepped.pressure) < before
    fraction, cut = admissible_fraction(trial, minimum, 1)
    assert stepped.pressure == pytest.approx(np.maximum(pressure + fraction * whole, 0), rel=1e-4, abs=1e-7)
    growth = min(max(minimum, 0.3), 1.3 if cut else 3.0)
    assert after == Search(pytest.approx(step_length * growth, rel=1e-4), False, single, 5.0, 3)
    assert taken.change is trial.change
    assert taken.curvature == pytest.approx(curvature, rel=1e-4)
    assert taken.displacement * taken.unit == pytest.approx(
        (matrix @ whole.ravel()).reshape(SHAPE), rel=1e-4, abs=1e-6 * np.abs(whole).max()
    )


def test_safeguarding_step__is_one_and_is_not_conjugated_to():
    problem, matrix = scaled({"load": 3.0})
    pressure = some_pressure(problem)
    separation, level = judged(problem, matrix, pressure)
    trial = solver.projected_gradient(problem, pressure, separation - problem.gap, level)
    iterate = Iterate(pressure, separation - problem.gap, np.arange(pressure.size), False)
    _, after, taken = solver.take_step(problem, iterate, Search(0.7, True, False, 5.0, 3), trial)
    assert taken is None
    assert after == Search(0.7, False, False, 5.0, 3)


def test_search__asks_for_a_safeguarding_step_where_the_duality_gap_does_not_halve():
    search = Search(0.7, False, True).after(8.0)
    assert search == Search(0.7, False, True, 8.0, 0)
    patient = search
    for spent in range(1, 30):
        patient = patient.after(4.0)
        assert patient == Search(0.7, False, True, 8.0, spent), "half of it is not less than half"
    assert patient.after(4.0) == Search(0.7, True, True, 4.0, 0)
    assert patient.after(3.9) == Search(0.7, False, True, 3.9, 0)


def test_step_that_does_not_descend__forgets_rounding_then_history_then_the_preconditioner():
    problem, matrix = scaled({"load": 3.0})
    pressure = some_pressure(problem)
    displacement = (matrix @ pressure.ravel()).reshape(SHAPE)
    contact = np.arange(pressure.size)
    off = Iterate(pressure, displacement * 1.01, contact, approximate=True)
    previous = SearchStep(contact, pressure.ravel(), displacement, 1.0, 1.0)
    exact, search = solver.forget(problem, off, Search(0.7, False, True, 5.0, 3), previous)
    assert exact.displacement == pytest.approx(displacement, rel=1e-12)
    assert not exact.approximate
    assert search == Search(0.7, False, False, 5.0, 3)
    first = problem.length_scale / problem.pressure_scale  # the preconditioner is the inverse at this length
    same, search = solver.forget(problem, exact, Search(0.7, False, False, 5.0, 3), previous)
    assert same is exact
    assert search == Search(pytest.approx(first), False, False, 5.0, 3)
    assert solver.forget(problem, exact, search, None)[1] == Search(pytest.approx(first), True, False, 5.0, 3)


def test_excess_load__is_cut_where_it_displaces_nothing():
    pressure = np.array([[2.0, 5.0], [3.0, 2.5]])
    displacement = np.ones((2, 2))
    less = solver.without_excess(Iterate(pressure, displacement, np.arange(4), False))
    assert less.pressure.tolist() == [[0.0, 3.0], [1.0, 0.5]]
    assert less.contact.tolist() == [1, 2, 3]
    assert less.displacement is displacement
