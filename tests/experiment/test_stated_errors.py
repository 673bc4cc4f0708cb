"""Stated errors, kept times and unsolved contacts, seen through ``rv.simulate``."""

from functools import partial

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics import stepping
from roughvisc.mechanics.contact.solver import solve_contact

BALL = rv.sphere(10e-3, 1e-3, 25)
FLUID = rv.maxwell(3e6, 1e5)


def test_unsolved_contact__raises_and_names_the_time(monkeypatch):
    monkeypatch.setattr(stepping, "solve_contact", partial(solve_contact, max_iterations=2))
    program = rv.Program().load(0.0, over=0.25).load(1e-3, over=0).hold(1.0)
    with pytest.raises(rv.ConvergenceError, match=r"0\.25 s .* error .* after 2 iterations"):
        rv.simulate(BALL, FLUID, program, boundary="free", progress=False)


def test_stiff_plate__is_solved():
    """A plate 1,000 times stiffer than its base, pressed over four times its thickness."""
    side, cells = 1.6e-3, 129
    ball = rv.from_array(rv.sphere(10e-3, side, cells).values, spacing=side / cells)
    plate = rv.layer(rv.elastic(3e9), 1e-4, on=rv.elastic(3e6))
    loose, tight = (
        rv.simulate(ball, plate, rv.Program().load(1.3, over=0), boundary="free", tolerance=one, progress=False)
        for one in (1e-3, 1e-5)
    )
    off = np.abs(loose.pressure - tight.pressure).sum() / tight.pressure.sum()
    assert 0.8 * off <= loose.stated_error[-1] <= min(10 * off, 1e-3)
    assert loose.approach.values == pytest.approx(tight.approach.values, rel=1e-6)


@pytest.mark.parametrize("body", [FLUID, rv.layer(FLUID, 1e-4, on=rv.elastic(3e6)), rv.layer(FLUID, 1e-4, on=FLUID)])
def test_stated_error__of_full_contact_by_creep(body):
    """A wave in full contact has its mean plane at the approach; a relaxed fluid stores hardly any energy there."""
    amplitude = 1e-7
    wave = rv.wavy(amplitude, 1e-3, 1e-3, (31, 32))
    program = rv.Program().load(0.002, over=0.01).hold(10.0)
    ds = rv.simulate(wave, body, program, boundary="periodic", times=[10.01], fields=(), progress=False)
    assert float(ds.contact_fraction[0]) == 1.0
    mean_gap = float((wave.max() - wave.mean()).item())
    error = abs(float(ds.approach[0]) / mean_gap - 1)
    assert error <= float(ds.stated_error[0]) <= 1e-3


def test_every_requested_time__has_a_row():
    """However short it is beside the program; the approach of a ball goes as the compliance to the power 2/3."""
    material = rv.zener(3e6, 1e6, 1e5)
    program = rv.Program().load(1e-3, over=0).hold(1e9).load(1e-3, over=1.0)
    times = [1e-4, 1e-3, 1.0, 1e9, 1e9 + 1e-3, 1e9 + 1.0]
    ds = rv.simulate(BALL, material, program, times=times, fields=(), progress=False)
    assert ds.time.values.tolist() == times
    compliance = material.contact_compliance(np.array(times))
    expected = (compliance / compliance[-1]) ** (2 / 3)
    np.testing.assert_allclose(ds.approach / ds.approach[-1], expected, rtol=2e-2)


def test_stated_error__covers_rows_after_a_jump_that_is_not_kept():
    """At constant approach the contact stays, and the force relaxes as the modulus: to 1/6000, over ten decades."""
    equilibrium, moduli, relaxation = 1e3, (3e6, 3e6, 3e5), (1e-9, 1e-2, 1.0)
    times = np.array([1.0, 2.0, 10.0])
    program = rv.Program().approach(5e-6, over=0).hold(10.0)
    settings = {"fields": (), "progress": False}
    material = rv.from_relaxation(equilibrium, moduli, relaxation)
    ds = rv.simulate(BALL, material, program, times=times.tolist(), **settings)
    glassy = rv.simulate(BALL, rv.elastic(equilibrium + sum(moduli)), program, times=[10.0], tolerance=1e-8, **settings)
    left = equilibrium + sum(g * np.exp(-times / tau) for g, tau in zip(moduli, relaxation, strict=True))
    expected = float(glassy.force[-1]) * left / (equilibrium + sum(moduli))
    error = np.abs(ds.force.values - expected) / np.maximum.accumulate(expected)
    assert error.max() < 1e-3
    assert (error <= ds.stated_error.values).all()
    assert ds.stated_error.values.max() < 10 * error.max()


def test_missed_tolerance__gives_one_warning_and_an_attribute():
    """Fixed steps of a tenth of the ramp miss the tolerance; of an elastic body they do not."""
    program = rv.Program().load(5e-3, over=0.1).hold(1.0)
    settings = {"times": 8, "fields": (), "numerics": rv.Numerics(time_step=0.01), "progress": False}
    with pytest.warns(UserWarning, match="tolerance") as warned:
        ds = rv.simulate(BALL, rv.zener(3e6, 1e6, 1e5), program, **settings)
    assert ds.stated_error.max() > ds.attrs["tolerance"]
    assert len(warned) == 1
    assert "tolerance: " in ds.attrs["warnings"]
    ds = rv.simulate(BALL, rv.elastic(3e6), program, **settings)
    assert ds.stated_error.max() <= ds.attrs["tolerance"]
    assert "tolerance: " not in ds.attrs.get("warnings", "")


@pytest.mark.filterwarnings("ignore:.*table:UserWarning")
@pytest.mark.parametrize(("rows", "sparse"), [(3, True), (13, False)])
def test_creep_table__warns_if_rows_are_more_than_a_decade_apart(rows, sparse):
    exact = rv.power_law(1e-6, 1e-6, 0.5)
    times = np.geomspace(1e-3, 1e3, rows)
    table, program = (
        rv.creep_table(times, exact.creep_compliance(times), kind="shear"),
        rv.Program().load(1e-4, over=0).hold(1e3),
    )
    found, expected = (rv.simulate(BALL, one, program, times=[10.0], progress=False) for one in (table, exact))
    assert ("material: " in found.attrs.get("warnings", "")) == sparse
    assert (abs(float(found.approach[0] / expected.approach[0]) - 1) > 0.1) == sparse


@pytest.mark.thorough
def test_every_step__of_a_body_without_instantaneous_compliance_states_the_tolerance_or_less():
    """If each step is asked for, those that state more are no rows; the corners of the program always are."""
    ball, rubber = rv.sphere(1e-2, 1e-3, (21, 18)), rv.kelvin_voigt(1e6, 1e6, 0.3)
    press = rv.Program().load(5e-3, over=0.5).approach(4e-6, over=0.5)
    ds = rv.simulate(ball, rubber, press, tolerance=1e-3, fields=(), progress=False)
    inner = ~np.isin(ds.time, [0.0, 0.5, 1.0])
    assert inner.sum() > 5
    assert (ds.stated_error[inner] <= 1e-3).all()
    assert ds.roughvisc.steps.sizes["step"] >= ds.sizes["time"]
