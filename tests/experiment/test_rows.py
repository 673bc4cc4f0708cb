"""What a row states of itself, in the result that a user gets."""

import numpy as np
import pytest
import xarray as xr

import roughvisc as rv
from roughvisc.experiment import loading
from roughvisc.experiment.stated import error_columns, meets_tolerance
from roughvisc.mechanics import arrays as passes
from roughvisc.mechanics import sparse
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.mechanics.stepping.march import march
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.variables import FIELDS

BALL = rv.sphere(1.0, 1.6, 17)
MATERIALS = {
    "elastic": rv.elastic(1.0),
    "zener": rv.zener(1.0, 1.0, 0.3),
    "maxwell": rv.maxwell(1.0, 1.0),
    "kelvin_voigt": rv.kelvin_voigt(1.0, 0.3),
    "power_law": rv.PowerLaw(1.0, 1.0, 0.3),
}
PROGRAMS = {
    "loads": rv.Program().load(0.02, over=0.3).hold(0.3).load(0.0, over=0.2).hold(0.2).load(0.01, over=0.2),
    "approaches": rv.Program().approach(0.05, over=0.3).hold(0.3).approach(-0.01, over=0.2).approach(0.03, over=0.3),
    "jump": rv.Program().load(0.02, over=0).hold(0.5).load(0.01, over=0),
    "taps": rv.Program.cycle(0.0, 0.03, 0.5, 2, control="approach"),
}


def result(material, program, **settings):
    settings = {"tolerance": 3e-2, "fields": (), "progress": False} | settings
    return rv.simulate(BALL, MATERIALS[material], PROGRAMS[program], **settings)


@pytest.mark.parametrize("absent", [False, True])
def test_rows__of_a_wide_grid_hold_the_same_numbers(monkeypatch, absent):
    """Of fields by parts, none of which lies in memory as a whole unless it is kept."""
    height = rv.self_affine(1.0, (33, 30), hurst=0.8, rms_slope=0.1, seed=1)
    if absent:
        height.values[3:9, 4:7] = np.nan
    program = rv.Program().load(0.02, over=0.3).hold(0.3)
    settings = {"boundary": "periodic", "tolerance": 3e-2, "fields": FIELDS, "missing": "absent", "times": 4}
    monkeypatch.setattr(sparse, "_ABOVE", 10)
    monkeypatch.setattr(passes, "_BLOCK", 100)

    def pressed():
        return rv.simulate(height, MATERIALS["zener"], program, progress=False, **settings).drop_vars("wall_time")

    narrow = pressed()
    monkeypatch.setattr(loading, "is_wide", lambda size: True)
    wide = pressed()
    assert 0 < float(wide.contact_fraction[-1]) < 0.6
    xr.testing.assert_identical(wide.drop_attrs(), narrow.drop_attrs())


@pytest.mark.parametrize("times", [None, 7])
@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("material", MATERIALS)
def test_every_row__states_an_error(material, program, times):
    ds = result(material, program, times=times)
    assert ds.sizes["time"] > 1
    for name in ("stated_error", "time_error", "residual", "force_error", "approach_error", "contact_area_error"):
        assert np.isfinite(ds[name]).all(), name
        assert (ds[name] >= 0).all(), name


def test_ancillary_variables__exist():
    seed = {"numerics": rv.Numerics(method="seed"), "times": 3}
    for settings in ({}, {"fields": ("pressure", "gap", "displacement")}, seed):
        ds = result("zener", "jump", **settings)
        named = {name: variable.attrs.get("ancillary_variables", "").split() for name, variable in ds.variables.items()}
        assert {other for others in named.values() for other in others} <= set(ds.variables)
    assert named["height"] == []


def test_dent_left_by_a_load__is_as_uncertain_as_the_load_made_it():
    # 1 % off in a compliance is 1 % of what it gave under load, however little of that is left
    program = rv.Program().load(0.02, over=0.3).hold(0.3).load(0.0, over=0.01).hold(30.0)
    ds = rv.simulate(BALL, MATERIALS["power_law"], program, times=[0.6, 30.6], tolerance=1e-2, progress=False)
    loaded, left = ds.approach.values
    assert left < 0.1 * loaded
    assert ds.approach_error[-1] > ds.attrs["series_error"] * loaded > 0


@pytest.mark.parametrize("control", ["approach", "load"])
def test_steps_in_which_cells_enter__are_rows_unless_the_force_jumps_with_them(control):
    steps = soft_steps(control, tolerance=5e-2)  # within three of which a cell may enter
    entered = np.array([np.any(step.state.now.pressure[step.state.before.pressure == 0] > 0) for step in steps])
    kept = np.array([meets_tolerance(step, 0.0) for step in steps])
    assert kept[~entered].any()
    assert kept[entered].any() == (control == "load")


def soft_steps(control, tolerance=1e-2):
    """Steps of a ball on a material that hardly gives way at once, by which pressure jumps with each cell."""
    shape = (33, 31)
    x, y = ((np.arange(n) - n // 2) * 0.1 for n in shape)
    gap, soft = 0.5 * (x[:, None] ** 2 + y[None, :] ** 2), rv.zener(1.0, 0.01, 0.01)
    program = getattr(rv.Program(), control)({"approach": 0.1, "load": 5e-3}[control], over=1.0)
    scene = Scene(Operator(shape, (0.1, 0.1)), gap, soft, Modes(soft), program, tolerance=tolerance)
    return [step for step in march(scene) if step.state.before is not None]


@pytest.mark.parametrize("control", ["approach", "load"])
def test_steps_that_state_more_than_three_tolerances__are_no_rows(control):
    over = []
    for step in soft_steps(control):
        over.append(error_columns(step, 0.0)["stated_error"] / step.scene.tolerance)
        if meets_tolerance(step, 0.0):
            assert over[-1] <= 3
    assert max(over) > 3
