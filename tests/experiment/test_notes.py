"""What a result says of its own accuracy, in words."""

import re

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.study.execution.run import unconverged
from roughvisc.views.figures.sections import cut_position

BALL = rv.sphere(1e-3, 2e-4, 16)
PRESS = rv.Program().load(1e-4, over=0.05).hold(0.1)


def press(material, **settings):
    return rv.simulate(BALL, material, PRESS, **{"times": 3, "tolerance": 1e-2, "progress": False, **settings})


def test_note__is_left_out_where_every_row_keeps_the_tolerance():
    ds = press(rv.zener(3e6, 1e6, 1e5))
    assert (ds.stated_error <= 1e-2).all()
    assert "accuracy_note" not in ds.roughvisc.attributes


@pytest.mark.parametrize(
    ("material", "says"),
    [
        (rv.kelvin_voigt(1e6, 1e5), "no instantaneous compliance"),
        (rv.zener(1e8, 1e6, 1e5), "% of the compliance is instantaneous"),
    ],
)
def test_note__names_what_jumps(material, says):
    note = press(material).roughvisc.attributes["accuracy_note"]
    assert says in note
    assert "The approach meets the tolerance" in note


def test_note__counts_the_rows_that_state_more_than_the_tolerance():
    ds = press(rv.zener(3e6, 1e6, 1e5), numerics=rv.Numerics(time_step=0.05))
    errors = ds.stated_error.values
    missed = np.count_nonzero(errors > 1e-2)
    assert missed
    assert f"{missed} of 3 rows state" in ds.roughvisc.attributes["accuracy_note"]
    assert f"{errors.max():.2g} at worst" in ds.roughvisc.attributes["accuracy_note"]
    assert "time step is fixed" in ds.roughvisc.attributes["accuracy_note"]


@pytest.mark.parametrize(
    ("residual", "says"), [(0.02, "(estimated error of the pressure up to 0.02)"), (np.nan, "s: try")]
)
def test_unconverged__quotes_the_error_where_it_is_known(residual, says):
    histories = {"status": np.array([0, 1]), "time": np.array([0.0, 0.5]), "residual": np.array([0.0, residual])}
    told = unconverged(histories)
    assert told.startswith("1 of 2 kept times did not converge, first at t = 500 ms")
    assert says in told
    assert "nan" not in told
    assert unconverged(histories | {"status": np.array([0, 0])}) == ""


ROUGH = rv.self_affine((64e-6, 48e-6), (64, 48), hurst=0.8, rms_slope=0.1, rolloff=3e-5, shortcut=8e-6, seed=1)


def pressed(height, boundary="periodic"):
    program = rv.Program().load(1e-5, over=0).hold(0.1)
    return rv.simulate(
        height, rv.elastic(1e6), program, boundary=boundary, times=1, tolerance=1e-2, edge="accept", progress=False
    )


def test_border_note__is_of_periodic_surfaces_that_repeat_with_a_step(caplog):
    part = ROUGH.isel(x=slice(0, 33), y=slice(0, 25))
    ds = pressed(part)
    note = ds.roughvisc.attributes["border_note"]
    assert "repeats with a step" in note
    assert note in caplog.text
    seam = [ds.pressure[-1].isel({axis: [0, -1]}).mean() for axis in ("x", "y")]
    assert f"carry {float(max(seam) / ds.pressure[-1].mean()):.2g} times the mean pressure" in note
    for height, boundary in ((ROUGH, "periodic"), (rv.mirror(part), "periodic"), (part, "free")):
        assert "border_note" not in pressed(height, boundary).attrs


def ball_pressed(depth, **options):
    """A ball over a square of 17 x 15 cells; its contact is within it to about the depth of the middle of a side."""
    ball = rv.sphere(radius=1e-3, size=(17e-6, 15e-6), shape=(17, 15), exact=False)
    program = rv.Program().approach(depth, over=1.0).approach(1e-10, over=1.0)
    with_defaults = {"boundary": "free", "times": [0.1, 2.0], "numerics": rv.Numerics(time_step=0.05)} | options
    return rv.simulate(ball, rv.elastic(1e6), program, progress=False, **with_defaults)


def test_edge_note__says_when_contact_came_to_the_border(caplog):
    """A ball reaches the middle of its nearer side, at 7 um, when its approach is ``a^2 / R``: Hertz."""
    depth = 4 * (7e-6) ** 2 / 1e-3
    ds = ball_pressed(depth, edge="accept")
    assert ds.roughvisc.attributes["edge"] == "accept"
    assert float(ds.pressure[0, :, [0, -1]].max()) == 0.0  # at the kept times it is not at the border
    assert float(ds.pressure[-1, :, [0, -1]].max()) == 0.0
    began = float(re.search(r"first in the step to ([\d.]+) s", ds.roughvisc.attributes["edge_note"])[1])
    assert 0.2 < began < 0.35
    assert "there the surface acts as a punch of its outline" in ds.roughvisc.attributes["edge_note"]
    assert ds.roughvisc.attributes["edge_note"] in caplog.text
    caplog.clear()
    inside = ball_pressed(0.2 * depth, edge="accept")
    assert inside.roughvisc.attributes["edge"] == "accept"
    assert "edge_note" not in inside.roughvisc.attributes
    assert "edge" not in ball_pressed(0.2 * depth).attrs
    periodic = ball_pressed(0.05 * depth, edge="accept", boundary="periodic")
    assert (periodic.roughvisc.attributes["edge"], "edge_note" in periodic.roughvisc.attributes) == ("accept", False)
    assert "punch" not in caplog.text


def test_section__is_not_cut_along_the_seam():
    part = ROUGH.isel(x=slice(0, 33), y=slice(0, 25))
    part = part.where(part.y > part.y[1], part + 1e-6)  # a ridge along one border
    ds = pressed(part)
    assert ds.roughvisc.attributes["border_note"]
    assert int(ds.pressure[-1].sum("x").values.argmax()) < 2
    assert 2 <= cut_position(ds, 0, "y") < 23
