"""Warnings of a result: which, when, and with which numbers."""

import re

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.labels import warnings_of

BALL = rv.sphere(1e-3, 2e-4, 16)
PRESS = rv.Program().load(1e-4, over=0.05).hold(0.1)


def press(material, **settings):
    return rv.simulate(BALL, material, PRESS, **{"times": 3, "tolerance": 1e-2, "progress": False, **settings})


@pytest.mark.filterwarnings("ignore:.*table:UserWarning")
def test_series__warns_of_a_table_far_from_any_passive_material():
    """Creep that gathers speed; noise within the stated noise is no reason."""
    times, rows = np.linspace(0.0, 1.0, 21), np.geomspace(1e-3, 10.0, 40)
    gathering = rv.creep_table(times, 1e-6 * (1 + 20 * np.maximum(times - 0.3, 0)), kind="shear")
    noise = 1 + 0.01 * np.random.default_rng(1).standard_normal(40)
    noisy = rv.creep_table(rows, 1e-6 * rows**0.4 * noise, noise=0.1, kind="shear")
    assert "no passive material" in warnings_of(press(gathering).attrs)["series"]
    for material, tolerance in ((gathering, 0.99), (noisy, 1e-2)):
        assert "series" not in warnings_of(press(material, tolerance=tolerance).attrs)


ROUGH = rv.self_affine((64e-6, 48e-6), (64, 48), hurst=0.8, rms_slope=0.1, rolloff=3e-5, shortcut=8e-6, seed=1)


def pressed(height, boundary="periodic"):
    program = rv.Program().load(1e-5, over=0).hold(0.1)
    return rv.simulate(
        height, rv.elastic(1e6), program, boundary=boundary, times=1, tolerance=1e-2, edge="accept", progress=False
    )


def test_border__is_a_warning_for_periodic_surfaces_that_repeat_with_a_step(caplog):
    part = ROUGH.isel(x=slice(0, 33), y=slice(0, 25))
    ds = pressed(part)
    warning = warnings_of(ds.attrs)["border"]
    assert warning in caplog.text
    assert "opposite borders" in warning
    for height, boundary in ((ROUGH, "periodic"), (rv.mirror(part), "periodic"), (part, "mirror"), (part, "free")):
        assert "border" not in warnings_of(pressed(height, boundary).attrs)


def test_slope__is_of_what_is_pressed():
    """The flanks of a ball do not count before they are reached, whatever the boundary."""
    ball, body, settings = rv.sphere(1.0, 1.6, (17, 15)), rv.elastic(1e6), {"times": 1, "progress": False}
    found = [
        rv.simulate(ball, body, rv.Program().approach(depth, over=0), boundary=boundary, **settings)
        for boundary, depth in (("free", 0.03), ("free", 0.5), ("periodic", 0.03))
    ]
    assert ["slope" in warnings_of(ds.attrs) for ds in found] == [False, True, False]


def ball_pressed(depth, **options):
    """A ball over a square of 17 x 15 cells; its contact is within it to about the depth of the middle of a side."""
    ball = rv.sphere(radius=1e-3, size=(17e-6, 15e-6), shape=(17, 15))
    program = rv.Program().approach(depth, over=1.0).approach(1e-10, over=1.0)
    with_defaults = {"boundary": "free", "times": [0.1, 2.0], "numerics": rv.Numerics(time_step=0.05)} | options
    return rv.simulate(ball, rv.elastic(1e6), program, progress=False, **with_defaults)


def test_edge__states_when_contact_reached_the_border(caplog):
    """A ball reaches the middle of its nearer side, at 7 um, when its approach is ``a^2 / R``: Hertz."""
    depth = 4 * (7e-6) ** 2 / 1e-3
    ds = ball_pressed(depth, edge="accept")
    assert float(ds.pressure[0, :, [0, -1]].max()) == 0.0  # at the kept times it is not at the border
    assert float(ds.pressure[-1, :, [0, -1]].max()) == 0.0
    warning = warnings_of(ds.attrs)["edge"]
    assert 0.2 < float(re.search(r"step to ([\d.]+) s", warning)[1]) < 0.35
    assert warning in caplog.text
    assert "edge" not in warnings_of(ball_pressed(0.2 * depth, edge="accept").attrs)
    assert "edge" not in warnings_of(ball_pressed(0.05 * depth, edge="accept", boundary="periodic").attrs)
