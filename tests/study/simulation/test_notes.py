"""What a result says of its own accuracy, in words."""

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
    assert "accuracy_note" not in ds.attrs


@pytest.mark.parametrize(
    ("material", "says"),
    [
        (rv.kelvin_voigt(1e6, 1e5), "no instantaneous compliance"),
        (rv.zener(1e8, 1e6, 1e5), "% of the compliance is there at once"),
    ],
)
def test_note__names_what_jumps(material, says):
    note = press(material).attrs["accuracy_note"]
    assert says in note
    assert "The approach keeps the tolerance" in note


def test_note__counts_the_rows_that_state_more_than_the_tolerance():
    ds = press(rv.zener(3e6, 1e6, 1e5), time_step=0.05)
    errors = ds.stated_error.values
    missed = np.count_nonzero(errors > 1e-2)
    assert missed
    assert f"{missed} of 3 rows state" in ds.attrs["accuracy_note"]
    assert f"{errors.max():.2g} at worst" in ds.attrs["accuracy_note"]
    assert "time step is fixed" in ds.attrs["accuracy_note"]


@pytest.mark.parametrize(
    ("residual", "says"), [(0.02, "(estimated error of the pressure up to 0.02)"), (np.nan, "s: try")]
)
def test_unconverged__quotes_the_error_where_it_is_known(residual, says):
    histories = {"status": np.array([0, 1]), "time": np.array([0.0, 0.5]), "residual": np.array([0.0, residual])}
    told = unconverged(histories)
    assert told.startswith("1 of 2 kept times did not converge, first at t = 0.5 s")
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
    note = ds.attrs["border_note"]
    assert "repeats with a step" in note
    assert note in caplog.text
    seam = [ds.pressure[-1].isel({axis: [0, -1]}).mean() for axis in ("x", "y")]
    assert f"carry {float(max(seam) / ds.pressure[-1].mean()):.2g} times the mean pressure" in note
    for height, boundary in ((ROUGH, "periodic"), (rv.mirror(part), "periodic"), (part, "free")):
        assert "border_note" not in pressed(height, boundary).attrs


def test_section__is_not_cut_along_the_seam():
    part = ROUGH.isel(x=slice(0, 33), y=slice(0, 25))
    part = part.where(part.y > part.y[1], part + 1e-6)  # a ridge along one border
    ds = pressed(part)
    assert ds.attrs["border_note"]
    assert int(ds.pressure[-1].sum("x").values.argmax()) < 2
    assert 2 <= cut_position(ds, 0, "y") < 23
