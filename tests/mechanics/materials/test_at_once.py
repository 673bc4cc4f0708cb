"""The instant after a jump, and the first moments after a short ramp, of materials that are pressed as a series.

References: a flat punch sinks by its load times the compliance, on any grid; a sphere by Lee and Radok's solution.
"""

import numpy as np
import pytest
import references

import roughvisc as rv

ROWS = np.geomspace(1e-6, 10.0, 60)
LAWS = [rv.power_law(glassy, 1.0, exponent) for glassy in (0.3, 0.01) for exponent in (0.1, 0.5)]


def creep(t):
    return 0.1 + np.asarray(t) ** 0.3


def sunk(material, program, times, tolerance=1e-3):
    """Approach of a flat punch over what it would be for a unit of contact compliance and of load."""
    punch = rv.flat_punch(1.0, 2.5, 17)
    settings = {"fields": (), "progress": False, "edge": "accept"}
    unit = rv.simulate(punch, rv.elastic(0.25), rv.Program().load(1.0, over=0), tolerance=1e-5, **settings)
    ds = rv.simulate(punch, material, program, times=times, tolerance=tolerance, **settings)
    return ds.approach.values / float(unit.approach[-1]), ds


@pytest.mark.parametrize("material", LAWS, ids=str)
def test_power_law__jumps_by_what_is_there_at_once(material):
    times = [0.0, 1e-6, 1e-3, 1.0, 10.0]
    found, _ = sunk(material, rv.Program().load(2.0, over=0).hold(10.0), times)
    assert found == pytest.approx(2.0 * material.contact_compliance(times), rel=1e-3, abs=0)


@pytest.mark.parametrize("first", [(), (0.0,)])
def test_table__jumps_by_what_is_there_at_once(first):
    t = np.append(first, ROWS)
    table = rv.creep_table(t, creep(t))
    times = [0.0, 1e-4, 1.0, 10.0]
    found, ds = sunk(table, rv.Program().load(2.0, over=0).hold(10.0), times, tolerance=1e-2)
    assert 0 < ds.attrs["series_error"] <= 1e-3
    assert found == pytest.approx(2.0 * table.contact_compliance(times), rel=5e-3, abs=0)


def test_table_with_little_at_once__can_jump():
    """13 % of the compliance at once is an instantaneous compliance, however fast the rest comes."""
    t = np.append(0.0, ROWS)
    table = rv.creep_table(t, 0.13 - 0.87 * np.expm1(-((t / 1e-5) ** 0.5)))
    _, ds = sunk(table, rv.Program().approach(1.0, over=0).hold(1.0), [0.0, 1.0])
    assert ds.force.values[0] > 3 * ds.force.values[1] > 0


@pytest.mark.parametrize("material", [rv.power_law(0.3, 1.0, 0.1), rv.power_law(0.0, 1.0, 0.5)], ids=str)
def test_short_ramp_before_a_long_hold__is_resolved(material):
    """A ramp of 1 ms before a hold of 10 000 s: seven decades, both ends to be right."""
    program = rv.Program().load(2.0, over=1e-3).hold(1e4)
    # with nothing there at once, a first step that goes straight to a kept time is a coarse one
    times = [1e-3, *([2e-3, 1.0] if material.contact_compliance(0.0) > 0 else []), 1e4 + 1e-3]
    found, ds = sunk(material, program, times)
    exact = references.punch_approach(1.0, material, program, times)
    scale = references.punch_approach(1.0, rv.elastic(0.25), rv.Program().load(1.0, over=0), [0.0])
    assert found == pytest.approx(exact / scale, rel=1e-3, abs=0)
    assert ds.attrs["series_error"] <= 1e-4


def test_sphere__follows_lee_and_radok_from_the_jump_on():
    material, times = rv.power_law(0.3e-6, 1e-6, 0.1), [0.0, 1e-2, 10.0]
    ball, settings = rv.sphere(1e-3, 2e-4, 65), {"fields": (), "progress": False}
    elastic = rv.elastic(1e6)
    press = rv.Program().load(5e-4, over=0)
    at_once = rv.closed_forms.lee_radok(1e-3, elastic, 5e-4).approach(0.0)
    grid = rv.simulate(ball, elastic, press, **settings).approach[-1] / at_once
    ds = rv.simulate(ball, material, press.hold(10.0), times=times, **settings)
    exact = rv.closed_forms.lee_radok(1e-3, material, 5e-4).approach(np.array(times)) * float(grid)
    assert ds.approach.values == pytest.approx(exact, rel=1e-3, abs=0)


def test_wide_table__takes_few_steps():
    """60 rows from 1e-9 of the program on: with kinks between them they are not passive to a tenth of the tolerance."""
    t = np.geomspace(1e-9, 1.0, 60)
    table = rv.creep_table(t, 1e-6 * creep(t))
    ball, program = rv.sphere(1e-3, 2e-4, 33), rv.Program().load(1e-4, over=0.1).hold(0.9)
    ds = rv.simulate(ball, table, program, times=[0.1, 1.0], tolerance=1e-4, fields=(), progress=False)
    assert ds.attrs["series_error"] <= 1e-5
    assert int(ds.roughvisc.steps.sizes["step"]) < 600


def test_noisy_table__dissipates():
    """Under a held approach the force of a passive material falls at every moment, whatever the noise of the rows."""
    noise = 1 + 0.03 * np.random.default_rng(2).standard_normal(ROWS.size)
    table = rv.creep_table(ROWS, creep(ROWS) * noise, noise=0.4)
    times = np.append(0, np.geomspace(1e-4, 10.0, 40))
    _, ds = sunk(table, rv.Program().approach(1.0, over=0).hold(10.0), times)
    assert (np.diff(ds.force.values) < 0).all()
