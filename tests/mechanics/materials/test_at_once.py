"""The instant after a jump, and the first moments after a short ramp, of materials that are pressed as a series.

References: a flat punch sinks by its load times the compliance, on any grid; a sphere by Lee and Radok's solution.
"""

import numpy as np
import pytest
from references.half_space import punch_approach
from samples import OF_EACH_KIND

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
    table = rv.creep_table(t, creep(t), kind="shear")
    times = [0.0, 1e-4, 1.0, 10.0]
    found, ds = sunk(table, rv.Program().load(2.0, over=0).hold(10.0), times, tolerance=1e-2)
    assert 0 < ds.attrs["series_error"] <= 1e-3
    assert found == pytest.approx(2.0 * table.contact_compliance(times), rel=5e-3, abs=0)


NOT_SERIES = [name for name, material in OF_EACH_KIND.items() if not isinstance(material, rv.Prony)]


@pytest.mark.filterwarnings("ignore:.*table:UserWarning")
@pytest.mark.parametrize("name", [*NOT_SERIES, "creep_table", "noisy table"])
def test_jump_alone__is_to_the_instantaneous_compliance(name):
    """No time passes: a material without this compliance has not moved yet."""
    material = OF_EACH_KIND[name]
    found, ds = sunk(material, rv.Program().load(2.0, over=0), None)
    compliance = float(material.contact_compliance(0.0))
    assert found.tolist() == pytest.approx([2.0 * compliance], rel=1e-4, abs=0)
    assert ds.force.values.tolist() == [2.0 if compliance > 0 else 0.0]
    assert ds.attrs["series_error"] == 0


@pytest.mark.parametrize("material", [rv.power_law(0.3, 1.0, 0.1), rv.power_law(0.0, 1.0, 0.5)], ids=str)
def test_short_ramp_before_a_long_hold__is_resolved(material):
    """A ramp of 1 ms before a hold of 10 000 s: seven decades, both ends to be right."""
    program = rv.Program().load(2.0, over=1e-3).hold(1e4)
    # with nothing there at once, a first step that goes straight to a kept time is a coarse one
    times = [1e-3, *([2e-3, 1.0] if material.contact_compliance(0.0) > 0 else []), 1e4 + 1e-3]
    found, ds = sunk(material, program, times)
    exact = punch_approach(1.0, material, program, times)
    scale = punch_approach(1.0, rv.elastic(0.25), rv.Program().load(1.0, over=0), [0.0])
    assert found == pytest.approx(exact / scale, rel=1e-3, abs=0)
    assert ds.attrs["series_error"] <= 1e-4
