"""A layered body in time: against half-space and sheet where it is one, and a slide against the steady state."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.errors import EdgeContactError, InputError
from roughvisc.experiment.loading import Loading
from roughvisc.mechanics.body import body_of
from roughvisc.problem import Problem
from roughvisc.recorder import Checkpoint
from roughvisc.settings import Settings
from roughvisc.study.storage.checkpoint import load_checkpoint, save_checkpoint

RUBBER = rv.zener(3e6, 1e6, 1e5, poisson=0.4)
#: The same but for rounding, so that the waves are solved for.
SAME = rv.zener(3e6 * (1 + 1e-9), 1e6, 1e5, poisson=0.4)
ROUGH = rv.self_affine(size=1e-3, shape=(21, 18), hurst=0.8, rms_slope=0.1, rolloff=5e-4, seed=1)
BALL = rv.sphere(radius=1e-3, size=2e-4, shape=(19, 18))
FLUID, SAME_FLUID = (rv.maxwell(modulus, 1e5, poisson=0.4) for modulus in (3e6, 3e6 * (1 + 1e-9)))
TOLERANCE = 3e-4
PRESS = rv.Program().pressure(1e5, over=0.05).hold(0.5).pressure(3e4, over=0.02)


def pressed(body, height=ROUGH, program=PRESS, **settings):
    return rv.simulate(height, body, program, times=6, progress=False, tolerance=TOLERANCE, **settings)


def off(found, expected):
    """Error of the pressure (L1), over the largest load."""
    apart = abs(found["pressure"] - expected["pressure"]).sum(("x", "y"))
    return float(apart.max() / expected["pressure"].sum(("x", "y")).max())


@pytest.mark.parametrize("control", ["load", "approach"])
def test_equal_materials__are_a_half_space(control):
    program = PRESS if control == "load" else rv.Program().approach(2e-6, over=0).hold(0.3)
    found, expected = (
        pressed(body, program=program, boundary="periodic") for body in (rv.layer(RUBBER, 1e-4, on=SAME), RUBBER)
    )
    assert "that all waves share" in found.attrs["memory"]
    assert off(found, expected) < TOLERANCE
    np.testing.assert_allclose(found["approach"][1:], expected["approach"][1:], rtol=TOLERANCE)
    assert float(found["stated_error"].max()) <= TOLERANCE


def test_rigid_base__is_a_sheet():
    found = pressed(rv.layer(RUBBER, 1e-4, on=rv.elastic(1e13)), boundary="periodic")
    expected = pressed(rv.sheet(RUBBER, 1e-4), boundary="periodic")
    assert off(found, expected) < TOLERANCE


@pytest.mark.parametrize("shape", [(24, 23), (24, 22)])  # the second one is solved on a quarter
def test_free_space__a_ball_on_equal_materials_is_one_on_a_half_space(shape):
    ball, program = rv.sphere(radius=1e-3, size=2e-4, shape=shape), rv.Program().load(5e-4, over=0.05).hold(0.5)
    found, expected = (pressed(body, ball, program) for body in (rv.layer(RUBBER, 5e-5, on=SAME), RUBBER))
    assert off(found, expected) < TOLERANCE
    np.testing.assert_allclose(found["approach"][1:], expected["approach"][1:], rtol=TOLERANCE)


@pytest.mark.parametrize("direction", ["x", "-y"])
def test_slide__settles_at_what_steady_sliding_finds(direction):
    quick, base = rv.zener(3e6, 1e6, 1e4, poisson=0.4), rv.zener(1e7, 2e6, 2e3)
    body, period, speed = rv.layer(quick, 1e-4, on=base), 5e-4, 1e-2
    height = rv.wavy(amplitude=1e-6, wavelength=period, size=period, shape=(48, 1), waves=1)
    if direction != "x":
        height = height.rename(x="y", y="x").transpose("x", "y")
    program = rv.Program().pressure(2e3, over=0.01).slide(distance=3 * period, speed=speed, direction=direction)
    found = pressed(body, height, program, boundary="periodic")
    steady = rv.friction(height, body, pressure=2e3, speeds=[speed], direction=direction, tolerance=1e-5)
    assert float(steady["contact_fraction"][0]) < 0.3
    # of second order in the cell
    np.testing.assert_allclose(found["friction_coefficient"][-1], steady["friction_coefficient"][0], rtol=0.02)


def test_resume__goes_on_to_the_same_bits(tmp_path):
    body = rv.layer(RUBBER, 1e-4, on=rv.zener(1e7, 2e6, 2e4))
    problem = Problem(ROUGH, body_of(body), Settings(boundary="periodic", times=4, tolerance=1e-3))
    loading = Loading(PRESS)
    whole = list(loading.rows(problem))
    middle = whole[len(whole) // 2].state
    save_checkpoint(tmp_path / "reached", Checkpoint(state=middle), "key")
    again = load_checkpoint(tmp_path / "reached", "key", loading.states)
    resumed = list(loading.rows(problem, again.state))
    np.testing.assert_array_equal(resumed[-1].fields["pressure"], whole[-1].fields["pressure"])
    assert len(resumed) == len(whole) - len(whole) // 2 - 1


def test_jump__of_a_layer_without_instantaneous_compliance_is_refused():
    body = rv.layer(rv.kelvin_voigt(1e6, 1e5), 1e-4, on=rv.kelvin_voigt(1e7, 1e5))
    with pytest.raises(InputError, match="no instantaneous compliance"):
        pressed(body, program=rv.Program().approach(1e-6, over=0).hold(0.1), boundary="periodic")


@pytest.mark.parametrize(
    ("height", "program", "boundary", "materials"),
    [
        (ROUGH, PRESS, "periodic", (RUBBER, SAME)),
        (ROUGH, rv.Program().pressure(1e5, over=0).hold(0.2), "periodic", (RUBBER, SAME)),
        (ROUGH, PRESS, "mirror", (RUBBER, SAME)),
        (ROUGH, rv.Program().pressure(1e4, over=0.05).hold(0.05), "periodic", (FLUID, SAME_FLUID)),
        (ROUGH, rv.Program().pressure(1e5, over=0.05).slide(distance=5e-4, speed=1e-2), "periodic", (RUBBER, SAME)),
        (BALL, rv.Program().load(5e-4, over=0.05).hold(0.2), "free", (RUBBER, SAME)),
    ],
    ids=["ramp", "jump", "mirror", "flow", "slide", "free space"],
)
def test_work__of_equal_materials_is_that_of_a_half_space(height, program, boundary, materials):
    found, expected = (
        pressed(body, height, program, boundary=boundary).roughvisc.steps
        for body in (rv.layer(materials[0], 1e-4, on=materials[1]), materials[0])
    )
    assert float(expected.work[-1]) > 0
    np.testing.assert_allclose(found.work[-1], expected.work[-1], rtol=3e-4)


@pytest.mark.parametrize("thickness", [1e-12, 1e2])
def test_thin_and_thick_layers__are_half_spaces_of_one_material(thickness):
    base = rv.elastic(1e7)
    found = pressed(rv.layer(RUBBER, thickness, on=base), boundary="periodic")
    assert rv.audit(found)["thickness"].sentence.startswith("Modelled: layer(zener(")
    for alone, at in ((base, 1e-12), (RUBBER, 1e2)):
        if thickness == at:
            assert off(found, pressed(alone, boundary="periodic")) < TOLERANCE


def test_free_space__contact_beyond_the_grid_is_an_error_and_not_a_larger_grid():
    ball, program = rv.sphere(radius=1e-3, size=4e-5, shape=(9, 9)), rv.Program().load(5e-4, over=0.05)
    with pytest.raises(EdgeContactError, match="contact reaches the border"):
        pressed(rv.layer(RUBBER, 5e-5, on=rv.elastic(1e7)), ball, program)
