"""Histories at every accepted step beside fields at kept times, and where kept times lie."""

import numpy as np
import pytest
from references.half_space import punch_approach

import roughvisc as rv
from roughvisc.experiment.kept_times import spread_times

RADIUS, SIDE, CELLS = 1e-3, 2e-4, 33
BALL = rv.sphere(RADIUS, SIDE, CELLS)


def test_histories__follow_the_closed_form():
    """Of Lee and Radok at every step; the grid's part is of second order in the cell over the contact's radius."""
    rubber, program = rv.zener(3e6, 1e6, 2e6), rv.Program().load(1e-4, over=0.5).hold(4.0)
    ds = rv.simulate(BALL, rubber, program, times=[4.5], tolerance=1e-3, progress=False)
    steps = rv.observables.history(ds)
    exact = rv.closed_forms.lee_radok(RADIUS, rubber, program).approach(steps.time.values[1:])
    assert (abs(steps.approach.values[1:] - exact) < 1e-3 * exact + 0.1 * (SIDE / CELLS) ** 2 / RADIUS).all()


def test_errors_of_many_pairs__do_not_add_up_beyond_the_tolerance():
    """The approach of a flat punch of cells is that of a round one, times a factor; under a load errors do not fade."""
    times = np.linspace(0.0, 4.0, 201)
    program = rv.Program.table(times, 0.5 * (1 - np.cos(0.9 * np.pi * times)) + 0.02 * times)
    body = rv.Prony(1e-8, 0.0, (7e-8, 6e-8, 1e-6), (0.05, 0.25, 0.5))
    punch, kept = rv.flat_punch(1.0, 2.6, 13), np.linspace(0.08, 4.0, 50)
    ds = rv.simulate(punch, body, program, times=kept, tolerance=1e-3, progress=False, fields=())
    at_once = rv.simulate(punch, rv.elastic(1.0), rv.Program().load(1.0, over=0), tolerance=1e-8, progress=False)
    factor = float(at_once.approach[-1]) / (rv.elastic(1.0).contact_compliance(0.0) / 2)
    exact = factor * punch_approach(1.0, body, program, kept)
    assert (abs(ds.approach - exact) <= 1e-3 * np.maximum.accumulate(exact)).all()


def test_fixed_step__is_the_longest():
    for step, over, times in ((0.1, 0.24, [0.24]), (0.27, 1.0, [0.3, 1.0])):
        program, numerics = rv.Program().load(1e-4, over=over), rv.Numerics(time_step=step)
        ds = rv.simulate(BALL, rv.zener(3e6, 1e6, 2e6), program, times=times, numerics=numerics, progress=False)
        assert np.diff(ds.roughvisc.steps.time).max() <= step * (1 + 1e-9)


def test_force_of_a_whole_step__is_no_history():
    # no compliance at once: under given approach the force of an implicit step is not that at its end
    soft = rv.kelvin_voigt(1e6, 1e6)
    program = rv.Program().approach(1e-6, over=0.5).hold(1.0)
    ds = rv.simulate(BALL, soft, program, times=[0.5, 1.5], tolerance=1e-2, progress=False)
    kept = set(ds.time.values)
    assert set(rv.observables.history(ds).time.values) - {0.0} <= kept


def test_spread_times__of_a_hold_lie_evenly_in_the_logarithm():
    times = spread_times(rv.Program().load(1.0, over=0.03).hold(10.0), 30) - 0.03
    since = times[(times > 1e-9) & (times < 9.999)]
    ends = np.concatenate([[0.01], since, [10.0]])  # from a third of the ramp before it
    np.testing.assert_allclose(np.diff(np.log(ends)), np.diff(np.log(ends))[0])


@pytest.mark.parametrize(
    ("control", "high", "low"),
    [
        pytest.param("approach", 2e-5, -2e-5, id="opens"),
        pytest.param("approach", 2e-5, 0.5e-5, id="opens_on_its_imprint"),
        pytest.param("load", 0.5, 0.0, id="is_unloaded"),
    ],
)
@pytest.mark.parametrize(
    "body", [rv.zener(1e6, 1e6, 1e5), rv.Prony(1e-7, 5e-7, (1e-6,), (0.1,))], ids=["zener", "burgers"]
)
def test_one_kept_row__takes_no_more_steps_than_many_where_the_force_vanishes(body, control, high, low):
    """Errors are relative to the force of kept rows; where it vanishes in between, no step has to resolve it."""
    program = rv.Program()
    for _ in range(4):
        program = getattr(getattr(program, control)(high, over=0.1), control)(low, over=0.1)

    def convolutions(rows):
        times = (program.duration * np.arange(1, rows + 1) / rows).tolist()
        ball = rv.sphere(1e-2, 2e-3, 16)
        ds = rv.simulate(ball, body, program, times=times, fields=(), grid_error=False, progress=False)
        return int(rv.observables.history(ds).convolutions.sum())

    assert convolutions(1) < 2 * convolutions(40)


def steps_of(surface, body, program, times, tolerance):
    numerics = {"tolerance": tolerance, "fields": (), "grid_error": False, "edge": "accept", "progress": False}
    return rv.observables.history(rv.simulate(surface, body, program, times=times, **numerics))


def even(program, rows):
    return [program.duration * number / rows for number in range(1, rows + 1)]


def test_ball_that_touches_a_fluid_again__takes_more_steps_for_accuracy_only():
    """A cell is in contact in one solution only for a while, and shorter steps do not change that."""
    ball, fluid = rv.sphere(1.0, 1.6, (17, 15)), rv.Prony(1.0, 0.2, (1.0,), (1.0,))
    program = rv.Program().approach(0.3, over=0.1).hold(1.0).approach(0.15, over=0).hold(3.0)
    loose, sharp = (
        steps_of(ball, fluid, program, [program.duration], tolerance).sizes["time"] for tolerance in (1e-2, 1e-3)
    )
    assert sharp < 5 * loose  # an error of order 1.5 in the length


ROUGH = rv.self_affine((1.1, 1.05), (18, 15), hurst=0.8, rms_height=0.04, shortcut=0.35, seed=5)


@pytest.mark.parametrize(
    ("surface", "body", "program"),
    [
        pytest.param(
            rv.flat_punch(1.0, 2.6, 13),
            rv.Prony(0.08, 0.0, (1.0,), (1e-3,)),
            rv.Program().load(1.0, over=2).load(0.0, over=2),
            id="error_of_the_approach_fades",
        ),
        pytest.param(
            rv.flat_punch(1.0, 2.6, 13),
            rv.power_law(0.0, 3.5e-3, 0.2, 1.0),
            rv.Program().load(1.0, over=0.3).hold(1.0),
            id="error_of_the_surface_fades",
        ),
        pytest.param(
            ROUGH, rv.kelvin_voigt(1.0, 1.0), rv.Program().load(0.1, over=1).load(0.03, over=1), id="cells_enter"
        ),
    ],
)
def test_all_steps_as_rows__cost_little_more_than_fifty_rows(surface, body, program):
    all_steps, fifty = (
        int(steps_of(surface, body, program, times, 1e-2).convolutions.sum()) for times in (None, even(program, 50))
    )
    assert all_steps < 2.5 * fifty


@pytest.mark.parametrize("height", [0.04, 0.01])
def test_one_row_after_a_long_relaxation__costs_no_more_than_fifty(height):
    """The force falls 200 times. Steps need not resolve the error of the contact solver, nor one that fades."""
    rough = rv.self_affine((1.1, 1.05), (18, 15), hurst=0.8, rms_height=height, shortcut=0.35, seed=5)
    program = rv.Program().approach(1.5 * height, over=0.046).hold(2.0)
    law = rv.power_law(0.01, 1.0, 0.8, 1.0)
    one, fifty = (steps_of(rough, law, program, even(program, rows), 1e-3).sizes["time"] for rows in (1, 50))
    assert one < 2 * fifty


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_entry_of_a_cell_into_a_soft_body__is_uncertain_only_then(tolerance):
    """A pair in which a cell enters just before the last row is repeated, and later rows do not state the entry."""
    program = rv.Program().load(0.1, over=1)
    ball, body = rv.sphere(1.0, 1.6, (17, 15)), rv.kelvin_voigt(1.0, 1.0)
    ds = rv.simulate(ball, body, program, tolerance=tolerance, fields=(), edge="accept", progress=False)
    assert float(ds.stated_error[-1]) < tolerance


def test_row_next_to_the_entry_of_a_cell_into_a_soft_body__states_the_jump():
    """The pressure jumps there, before or after the computed instant."""
    program = rv.Program().load(0.1, over=1)
    ball, body = rv.sphere(1.0, 1.6, (17, 15)), rv.kelvin_voigt(1.0, 1.0)
    settings = {"times": even(program, 801), "fields": ("pressure",), "edge": "accept", "progress": False}
    rows, exact = (rv.simulate(ball, body, program, tolerance=tolerance, **settings) for tolerance in (1e-2, 5e-4))
    off = abs(rows.pressure - exact.pressure).sum(("x", "y")) / exact.pressure.sum(("x", "y"))
    assert float(off.max()) > 0.5
    assert (off <= 2 * np.maximum(rows.stated_error, 1e-2)).all()
