"""``boundary="mirror"``: what a surface and its mirror images give on the surface's own cells."""

import numpy as np
import pytest
from samples import GEL as ZENER
from samples import HOLED
from samples import SMALL_ROUGH as SCAN
from support import at_rows

import roughvisc as rv
from roughvisc.variables import FIELDS

PRESS = rv.Program().pressure(2e4, over=0).hold(0.3).pressure(0, over=0.1).hold(0.1).pressure(4e4, over=0.2)
UNIFORM = rv.Numerics(time_step=0.05)


CASES = {
    "pressure": (SCAN, ZENER, PRESS, {}),
    "approach": (SCAN, ZENER, rv.Program().approach(1e-6, over=0.2).hold(0.2), {}),
    "absent cells": (HOLED, ZENER, PRESS, {"missing": "absent"}),
    "sheet": (SCAN, rv.sheet(ZENER, 2e-4), PRESS, {}),
    "layer": (SCAN, rv.layer(ZENER, 1e-4, on=rv.elastic(5e6)), PRESS, {}),
    "odd": (SCAN[:, :13], ZENER, PRESS, {}),
}


def pressed(height, body, program, **settings):
    given = {"times": 5, "tolerance": 1e-6, "numerics": UNIFORM, "fields": FIELDS, "progress": False}
    return rv.simulate(height, body, program, **given | settings)


@pytest.mark.parametrize("name", CASES)
def test_mirror__gives_what_the_unfolded_surface_gives(name):
    height, body, program, settings = CASES[name]
    found = pressed(height, body, program, boundary="mirror", **settings)
    whole = pressed(rv.mirror(height), body, program, boundary="periodic", **settings)
    assert found.attrs["boundary"] == "mirror"
    assert found.pressure.shape[1:] == height.shape
    for field in FIELDS:
        images = [(0, 0), *((0, count) for count in height.shape)]
        unfolded = np.pad(found[field].values, images, mode="symmetric")
        scale = float(whole.displacement.max()) if field != "pressure" else float(whole.pressure.max())
        np.testing.assert_allclose(unfolded, whole[field], rtol=0, atol=2e-4 * scale, err_msg=field)
    for name in ("force", "contact_area", "work", "approach", "mean_gap", "contact_fraction", "nominal_pressure"):
        factor = 4 if name in ("force", "contact_area", "work") else 1
        here, expected = at_rows(found)[name], at_rows(whole)[name].values / factor
        np.testing.assert_allclose(here, expected, rtol=0, atol=1e-5 * abs(expected).max(), err_msg=name)


@pytest.fixture(scope="module")
def pair():
    settings = {"fields": ("pressure", "gap"), "numerics": rv.Numerics(), "tolerance": 1e-5}
    program = rv.Program().pressure(4e4, over=0).hold(0.3)
    scan = rv.resample(SCAN, (24, 16))  # coarser grids of the unfolded surface have twice as many cells a side
    one = pressed(scan, ZENER, program, boundary="mirror", grid_error=True, **settings)
    return one, pressed(rv.mirror(scan), ZENER, program, boundary="periodic", grid_error=True, **settings)


@pytest.mark.parametrize("along", ["x", "y"])
def test_leak_rate__is_that_of_the_unfolded_surface(pair, along):
    """Two halves in series and two side by side carry what one carries: no fluid crosses a mirror."""
    found, whole = (ds.roughvisc.leakage(pressure_drop=1e3, along=along) for ds in pair)
    assert found.leak_rate.values == pytest.approx(whole.leak_rate.values, rel=1e-4)


def test_stated_errors__are_those_of_the_unfolded_surface(pair):
    found, whole = pair
    assert found.contact_area_error.values == pytest.approx(whole.contact_area_error.values / 4, rel=0.02)
    for name in [name for name in found.variables if str(name).startswith("grid_error")]:
        assert found[name].values == pytest.approx(whole[name].values, rel=0.15, abs=1e-9), name


@pytest.mark.parametrize("direction", ["x", "-y"])
def test_steady_sliding__is_that_of_the_unfolded_surface(direction):
    given = {"pressure": 2e4, "speeds": [1e-3, 1e-2], "direction": direction, "progress": False}
    found = rv.friction(SCAN, ZENER, boundary="mirror", **given)
    whole = rv.friction(rv.mirror(SCAN), ZENER, **given)
    for name in ("friction_coefficient", "friction_force", "contact_area", "approach"):
        np.testing.assert_array_equal(found[name], whole[name])
    assert found.height.shape == (44, 34)
    assert "mirrored along x and y" in found.attrs["history"]
