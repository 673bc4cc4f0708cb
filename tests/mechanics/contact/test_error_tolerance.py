"""The solver stops where its estimate of the pressure's error is small enough, not sooner and not much later."""

import numpy as np
import pytest
from support import rough_gap

from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import solve_contact

WANTED = 1e-3


def relative(found, exact):
    return np.abs(found - exact).sum() / exact.sum()


def ball(shape=(25, 22)):
    x, y = ((np.arange(n) - 0.47 * n) for n in shape)
    return Operator(shape, (1.0, 1.0)), 0.01 * (x[:, None] ** 2 + y**2)


@pytest.mark.parametrize("off", [0.003, 0.01, 0.03])
def test_first_guess_that_the_duality_gap_accepts__is_improved_where_few_cells_touch(off):
    """Its gap falls with the square of what is off: 1 % of the pressure is some 1e-5 of the energy."""
    operator, gap = ball()
    exact = solve_contact(operator, gap, load=0.3, tolerance=1e-14).pressure
    touching = exact > 0
    assert 4 <= touching.sum() <= 40
    guess = exact * (1 + off * np.where(np.indices(gap.shape)[0] > 0.47 * gap.shape[0], 1.0, -1.0))
    guess *= exact.sum() / guess.sum()
    settings = {"load": 0.3, "start": guess, "estimate_error": True}
    accepting = solve_contact(operator, gap, max_iterations=0, **settings).bound ** 2 / 2 * 1.01
    plain = solve_contact(operator, gap, tolerance=accepting, **settings)
    assert plain.iterations == 0
    assert relative(plain.pressure, exact) > WANTED
    assert plain.error > 0.8 * relative(plain.pressure, exact)  # it is accepted, and its error told
    found = solve_contact(operator, gap, tolerance=accepting, error_tolerance=WANTED, **settings)
    assert found.converged
    assert found.iterations > 0
    assert relative(found.pressure, exact) <= WANTED
    assert found.error <= WANTED


@pytest.mark.parametrize("boundary", ["free", "periodic"])
@pytest.mark.parametrize("mean", [0.02, 0.2])
def test_rough_contact__stops_at_the_error_and_before_the_duality_gap_is_small(boundary, mean):
    gap = rough_gap((48, 45))
    operator = Operator(gap.shape, (1.0, 1.0), boundary)
    load = mean * gap.size * gap.std()
    exact = solve_contact(operator, gap, load=load, tolerance=1e-14).pressure
    strict = solve_contact(operator, gap, load=load, tolerance=1e-6)
    found = solve_contact(operator, gap, load=load, tolerance=1e-6, error_tolerance=1e-2, estimate_error=True)
    assert found.converged
    assert found.convolutions < strict.convolutions
    assert relative(found.pressure, exact) <= 1e-2
    assert found.bound**2 / 2 <= 10 * 1e-6  # the approach is as sure as that


def test_full_contact__goes_by_the_duality_gap():
    gap = 0.01 * rough_gap((20, 18))
    operator = Operator(gap.shape, (1.0, 1.0), "periodic")
    load = 50.0 * gap.size
    for tolerance in np.geomspace(1e-1, 1e-9, 9):
        plain = solve_contact(operator, gap, load=load, tolerance=tolerance)
        asked = solve_contact(operator, gap, load=load, tolerance=tolerance, error_tolerance=1.0)
        assert (plain.pressure > 0).all()
        assert asked.bound == plain.bound
