"""The work and its stated error, against closed forms, independent integrals and finer marches."""

import numpy as np
import pytest
from references.half_space import punch_approach, punch_force

import roughvisc as rv

PUNCH, BALL = rv.flat_punch(1.0, 2.6, 13), rv.sphere(1.0, 1.6, (17, 15))
MATERIALS = {
    "zener": rv.zener(1.0, 1.0, 0.5),
    "maxwell": rv.maxwell(1.0, 2.0),
    "kelvin_voigt": rv.kelvin_voigt(1.0, 0.3),
}
JUMPS = rv.Program().load(1.0, over=0).hold(0.5).load(0.3, over=0).hold(0.5)
RAMPS = rv.Program().load(1.0, over=0.5).hold(0.5).load(0.2, over=0.3).hold(0.3)
APPROACHES = rv.Program().approach(0.5, over=0.5).hold(0.3).approach(0.45, over=0.2).approach(0.7, over=0.4)


def pressed(surface, material, program, tolerance=1e-3, **settings):
    settings = {"fields": (), "times": 9, "progress": False} | settings
    return rv.simulate(surface, material, program, tolerance=tolerance, **settings)


def assert_stated(ds, exact, most=np.inf):
    """Compare the error of the work with the stated one, which is not far above a part of the largest work."""
    error, stated = np.abs(ds.work.values - exact), ds.work_error.values
    assert (error <= stated + 1e-14 * np.abs(exact).max()).all(), (error, stated)
    assert (stated <= most * np.abs(exact).max()).all(), stated


def compliance_of_cells():
    """Approach of a punch of cells over that of a round punch; the same at all times."""
    at_once = rv.Program().load(1.0, over=0)
    found = pressed(PUNCH, rv.elastic(1.0), at_once, 1e-8, times=1)
    return 2 * float(found.approach[-1]) / rv.elastic(1.0).contact_compliance(0.0)


def work_of(times, force, approach, kept):
    work = np.append(0.0, np.cumsum((force[1:] + force[:-1]) * np.diff(approach) / 2))
    return work[np.searchsorted(times, kept)]


@pytest.mark.parametrize("material", MATERIALS)
def test_work_of_a_punch_under_load__is_the_integral_over_its_creep(material):
    """A punch touches with all its cells: its approach is that of a round punch, times a factor."""
    body = MATERIALS[material]
    ds = pressed(PUNCH, body, RAMPS)
    times = np.unique(np.append(np.linspace(0, RAMPS.duration, 40001), ds.time.values))
    force = np.interp(times, RAMPS.corners, [0.0, 1.0, 1.0, 0.2, 0.2])
    approach = compliance_of_cells() * punch_approach(1.0, body, RAMPS, times)
    assert_stated(ds, work_of(times, force, approach, ds.time.values), most=1e-2)


@pytest.mark.parametrize("material", ["zener", "maxwell"])
def test_work_of_a_punch_under_approach__is_the_integral_over_its_relaxation(material):
    body = MATERIALS[material]
    ds = pressed(PUNCH, body, APPROACHES)
    times = np.unique(np.append(np.linspace(0, APPROACHES.duration, 40001), ds.time.values))
    approach = np.interp(times, APPROACHES.corners, [0.0, 0.5, 0.5, 0.45, 0.7])
    force = punch_force(1.0, body, APPROACHES, times) / compliance_of_cells()
    assert_stated(ds, work_of(times, force, approach, ds.time.values), most=1e-2)


@pytest.mark.parametrize("material", MATERIALS)
def test_work_of_jumps_of_the_load__is_load_times_creep(material):
    """Half of load times approach at the jump, then the load times the creep; of one step without a glassy part."""
    body, factor = MATERIALS[material], compliance_of_cells()
    ds = pressed(PUNCH, body, JUMPS, times=[0.5, 1.0])
    at_once, crept = factor * body.contact_compliance(np.array([0.0, 0.5])) / 2
    left = factor * float(punch_approach(1.0, body, JUMPS, np.array([1.0]))[0])
    first = at_once / 2 + (crept - at_once)
    jump = -(1.0 + 0.3) / 2 * 0.7 * at_once
    second = first + jump + 0.3 * (left - (crept - 0.7 * at_once))
    found = [first + (0 if at_once == 0 else jump), second]
    assert_stated(ds, np.array(found), most=5e-3)


def test_work_of_an_elastic_ball__is_two_fifths_of_load_times_approach():
    """Hertz; the cells leave an error, so that the energies of this grid are compared with sharper ones as well."""
    program = rv.Program().load(0.1, over=1.0).load(0.0, over=1.0)
    ds, exact = (pressed(BALL, rv.elastic(1.0), program, t, times=[0.5, 1.0, 2.0]) for t in (1e-2, 1e-8))
    assert_stated(ds, exact.work.values, most=1e-2)
    assert float(exact.work[1]) == pytest.approx(0.4 * 0.1 * float(exact.approach[1]), rel=0.02)
    assert abs(float(exact.work[2])) < 1e-12 * float(exact.work[1]), "what was put in comes back"


def test_work_of_a_nearly_elastic_ball__comes_back_within_its_error():
    """Long steps: what is wrong is the rule for the work, most of all where contact is lost."""
    material = rv.Prony(1.0, 0.0, (1e-6,), (0.1,))
    for program in (
        rv.Program().load(0.02, over=0.5).load(0.0, over=0.25),
        rv.Program().approach(0.05, over=0.5).approach(0.0, over=0.25),
    ):
        ds = pressed(BALL, material, program, times=[0.5, 0.75])
        assert float(ds.work_error[1]) < 0.2 * float(ds.work[0])
        assert abs(float(ds.work[1])) <= float(ds.work_error[1])
