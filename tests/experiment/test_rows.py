"""Stated accuracy of each row of a result."""

import numpy as np
import pytest
from support import assert_missing_as_declared, at_rows

import roughvisc as rv
from roughvisc.variables import VARIABLES

ROWS = np.append(0.0, np.geomspace(1e-4, 10.0, 1200))
BALL = rv.sphere(1.0, 1.6, 17)
MATERIALS = {
    "elastic": rv.elastic(1.0),
    "zener": rv.zener(1.0, 1.0, 0.3),
    "maxwell": rv.maxwell(1.0, 1.0),
    "kelvin_voigt": rv.kelvin_voigt(1.0, 0.3),
    "power_law": rv.power_law(1.0, 1.0, 0.3),
    "own": rv.creep(lambda t: 1 + t / (1 + t)),
    "table": rv.creep_table(ROWS, 1 + ROWS / (1 + ROWS), kind="shear"),
}
PROGRAMS = {
    "loads": rv.Program().load(0.02, over=0.3).hold(0.3).load(0.0, over=0.2).hold(0.2).load(0.01, over=0.2),
    "approaches": rv.Program().approach(0.05, over=0.3).hold(0.3).approach(-0.01, over=0.2).approach(0.03, over=0.3),
    "jump": rv.Program().load(0.02, over=0).hold(0.5).load(0.01, over=0),
    "jump alone": rv.Program().load(0.02, over=0),
    "relaxation": rv.Program().load(0.02, over=0.2).hold(0.3, control="approach").load(0.01, over=0.1),
    "cycle": rv.Program().load(0.02, over=0.2).cycle(0.02, 0.01, 0.5, 1).hold(0.1),
    "taps": rv.Program().approach(0.03, over=0.2).cycle(0.03, 3e-4, 0.5, 1, control="approach"),
    "slide": rv.Program().load(0.02, over=0.2).slide(0.2, speed=1.0).hold(0.1).load(0.01, over=0.1),
    "slide at depth": rv.Program().approach(0.03, over=0.2).slide(0.2, speed=1.0, direction="-y").hold(0.1),
}


def assert_constant_load_or_approach_works_through_the_approach(ds, steps, program):
    """Under a constant load the work is the load times the approach, under a constant approach it is zero.

    The work on an elastic body is its energy, at most half the load times the approach, with the error of the solver.
    """
    error = 1e-12 * float(steps.work.max())
    if ds.memory == "no memory: elastic":
        error = 0.5 * float(steps.residual.max() * steps.force.max() * steps.approach.max())
    for segment, began, end in zip(program.segments, program.corners, program.corners[1:], strict=False):
        if began and segment.end is None:
            during = steps.sel(time=slice(began, end))
            during = during.isel(time=slice(int((during.time == began).sum()) - 1, None))  # after a jump
            work = during.force[0] * (during.approach - during.approach[0]) * (segment.control == "load")
            assert (during.work - during.work[0]).values == pytest.approx(work.values, abs=error)


def is_slow(material, program):
    """Return whether a case takes long, or is much like others."""
    return material in ("maxwell", "own") or (material == "kelvin_voigt" and "slide" in program)


@pytest.mark.parametrize(
    ("material", "program"),
    [
        pytest.param(material, program, marks=pytest.mark.thorough if is_slow(material, program) else ())
        for material in MATERIALS
        for program in PROGRAMS
    ],
)
def test_every_row__states_an_error_and_agrees_with_its_fields_and_steps(material, program):
    pressed = PROGRAMS[program]
    settings = {"boundary": "periodic" if pressed.slides else "free", "tolerance": 3e-2, "progress": False}
    ds = rv.simulate(BALL, MATERIALS[material], pressed, **settings)
    steps = rv.observables.history(ds)
    rows = at_rows(ds)
    both = rows.assign(ds.data_vars)
    assert_missing_as_declared(both)
    names = {variable.error for name, variable in VARIABLES.items() if variable.error and name in both.variables}
    assert names <= set(both.variables)
    for name in {"stated_error", "time_error", "residual", *names}:
        assert not (both[name] < 0).any(), name
    loaded = both.isel(time=(ds.force > 0).values)
    assert (loaded.mean_contact_pressure * loaded.contact_area).values == pytest.approx(loaded.force.values)
    for name in rows.data_vars.keys() & ds.data_vars.keys():
        np.testing.assert_array_equal(rows[name], ds[name], err_msg=name)
    cell = 1.6**2 / BALL.size
    assert cell * ds.pressure.sum(("x", "y")).values == pytest.approx(ds.force.values, rel=1e-12, abs=1e-16)
    assert ds.contact_fraction.values * 1.6**2 == pytest.approx(ds.contact_area.values, rel=1e-12)
    assert rows.contact_area_counted.values == pytest.approx(cell * (ds.pressure > 0).sum(("x", "y")).values)
    assert ds.mean_gap.values == pytest.approx(ds.gap.mean(("x", "y")).values, rel=1e-12)
    assert_constant_load_or_approach_works_through_the_approach(ds, steps, pressed)
    if pressed.slides:
        (stroke,) = (segment.slide.distance for segment in pressed.segments if segment.slide is not None)
        began, end = pressed.corners[1:3]
        distance = np.interp(steps.time, [began, end], [0.0, stroke])
        assert steps.sliding_distance.values == pytest.approx(distance, abs=0.5 * 1.6 / 17)  # whole cells
        assert (loaded.friction_coefficient * loaded.force).values == pytest.approx(loaded.friction_force.values)
        largest = float(steps.friction_force.max())
        assert largest < 1e-12 if material == "elastic" else largest > 1e-5
        assert float(abs(steps.friction_force_across).max()) < 3e-2 * largest + 1e-12


@pytest.mark.parametrize("material", sorted(MATERIALS.keys() - {"kelvin_voigt"}))
def test_jump_alone__is_that_of_the_instantaneous_compliance(material):
    settings = {"tolerance": 1e-3, "progress": False}
    ds, elastic = (
        rv.simulate(BALL, MATERIALS[name], PROGRAMS["jump alone"], **settings) for name in (material, "elastic")
    )
    assert ds.approach.values == pytest.approx(elastic.approach.values, rel=2e-3)


@pytest.mark.parametrize("control", ["load", "approach"])
def test_mean_contact_pressure__is_hertzs_within_its_errors(control):
    """Two thirds of the peak pressure, in each row: the small contacts of few cells state more."""
    program = rv.Program().load(0.1, over=1.0) if control == "load" else rv.Program().approach(0.2, over=1.0)
    ds = rv.simulate(rv.sphere(1.0, 1.6, 33), rv.elastic(1.0), program, times=5, grid_error=True, progress=False)
    rows = ds.isel(time=slice(1, None))
    exact = [rv.closed_forms.hertz(1.0, 4.0, float(force)).peak_pressure * 2 / 3 for force in rows.force]
    if control == "approach":  # a = sqrt(R d), and p = 4 E* a / (3 pi R)
        exact = 4 * 4.0 * np.sqrt(rows.approach.values) / (3 * np.pi)
    of_grid = rows.grid_error_mean_pressure * float(ds.mean_contact_pressure.max())
    error = (rows.mean_contact_pressure_error + of_grid).values
    assert (abs(rows.mean_contact_pressure.values - exact) <= error).all()
    assert error[-1] < 0.2 * exact[-1]


def test_ancillary_variables__exist():
    ds = rv.simulate(BALL, MATERIALS["zener"], PROGRAMS["jump"], tolerance=3e-2, progress=False)
    named = {name: variable.attrs.get("ancillary_variables", "").split() for name, variable in ds.variables.items()}
    assert {other for others in named.values() for other in others} <= set(ds.variables)
    assert named["contact_area"] == ["contact_area_error"]


def test_dent_left_by_a_load__is_as_uncertain_as_the_load_made_it():
    # 1 % off in a compliance is 1 % of what it gave under load, however little of that is left
    program = rv.Program().load(0.02, over=0.3).hold(0.3).load(0.0, over=0.01).hold(30.0)
    ds = rv.simulate(BALL, MATERIALS["power_law"], program, times=[0.6, 30.6], tolerance=1e-2, progress=False)
    loaded, left = ds.approach.values
    assert left < 0.1 * loaded
    assert ds.approach_error[-1] > ds.attrs["series_error"] * loaded > 0
