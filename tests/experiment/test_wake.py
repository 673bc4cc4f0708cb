"""An indenter that slides with periodic boundaries is a row of indenters: when results say so, and that it is true."""

import math

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.labels import warnings_of

CELL, TIME = 2.2e-5, 1e-3
#: Retarded compliance over the whole: a half.
RUBBER = rv.zener(1e6, 1e6, 1e6 * TIME)
SLOW, FAST = 0.01, 1.0
SLIDE = {"load": 2e-2, "speeds": [SLOW, FAST]}


def ball(cells):
    return rv.sphere(1e-2, (cells * CELL, 45 * CELL), (cells, 45))


def left(period, speed):
    """Part of the creep that is left after a period, in per cent, in closed form."""
    return 50 * math.exp(-period / (speed * TIME))


def test_wake_note__is_of_speeds_at_which_a_longer_period_changes_friction(caplog):
    """With periods of 2.5 and 7.5 contact diameters: the same friction without a note, half of it with one."""
    short, long = rv.friction(ball(49), RUBBER, **SLIDE), rv.friction(ball(147), RUBBER, **SLIDE)
    ratio = (short.friction_force / long.friction_force).values
    assert ratio[0] == pytest.approx(1, abs=0.05)
    assert ratio[1] < 0.6
    note = warnings_of(short.attrs)["wake"]
    assert note in caplog.text
    assert f"every {49 * CELL * 1e3:.6g} mm, and at 1 m/s the contact slides into the wake" in note
    assert f"up to {left(49 * CELL, FAST):.2g} % of the creep" in note
    assert "wake:" not in rv.friction(ball(49), RUBBER, load=2e-2, speeds=SLOW).attrs.get("warnings", "")


def test_wake_note__is_along_the_motion():
    assert "every 990 µm" in rv.friction(ball(89), RUBBER, **SLIDE, direction="-y").attrs["warnings"]
    # along x a period takes 5.4 retardation times at the higher speed
    far = rv.friction(ball(89), RUBBER, load=2e-2, speeds=89 * CELL / (5.4 * TIME))
    assert "wake:" not in far.attrs.get("warnings", "")


def test_wake_note__of_a_surface_without_a_recipe_goes_by_what_touches():
    shape = ball(45)
    measured = rv.from_array(shape.values, spacing=CELL)
    few, many = (rv.friction(measured, RUBBER, load=load, speeds=FAST) for load in (2e-3, 0.5))
    assert "wake:" in few.attrs.get("warnings", "")
    assert "wake:" not in many.attrs.get("warnings", ""), "what touches reaches almost from one period to the next"
    rough = rv.self_affine(1e-3, (45, 40), hurst=0.8, rms_slope=0.1, rolloff=4e-4, seed=1)
    assert "wake:" not in rv.friction(rough, RUBBER, pressure=2e4, speeds=FAST).attrs.get("warnings", "")
    wave = rv.wavy(1e-5, 45 * CELL, (45 * CELL, 3 * CELL), (45, 3), waves=1)
    found = rv.friction(wave, RUBBER, pressure=2e3, speeds=FAST, fields=("pressure",))
    assert float((found.pressure > 0).mean()) < 0.5
    assert "wake:" not in found.attrs.get("warnings", ""), "it is a row of ridges by its recipe"


def test_wake_note__of_a_program_is_of_slides_that_come_as_far_as_the_next_wake(caplog):
    """Of a measured ridge along x that slides along y, on cells of 2 : 1."""
    period = 45 * CELL
    y = (np.arange(45) - 22) * CELL
    ridge = rv.from_array(np.tile(-(y**2) / 2e-2, (45, 1)), spacing=(2 * CELL, CELL))
    press = rv.Program().pressure(2e4, over=0)
    settings = {"boundary": "periodic", "tolerance": 1e-2, "times": 1, "progress": False}
    programs = (press.slide(n * period, speed=FAST, direction="-y") for n in (0.4, 2.0))
    near, far = (rv.simulate(ridge, RUBBER, program, **settings) for program in programs)
    along_x = rv.simulate(ridge, RUBBER, press.slide(2 * period, speed=FAST), **settings)
    for one in (near, along_x):
        assert "wake:" not in one.attrs.get("warnings", "")
    creep = [1 + -math.expm1(-n * period / (FAST * TIME)) for n in (1, 2)]
    assert f"up to {100 * (1 - creep[0] / creep[1]):.2g} % of the creep" in far.attrs["warnings"]
    assert warnings_of(far.attrs)["wake"] in caplog.text
