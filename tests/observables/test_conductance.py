"""Conductance of the spots of whole results, against Hertz and Lee and Radok."""

import math

import numpy as np
import pytest
import xarray as xr
from samples import RUBBER

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.observables import conductance

RADIUS = 1e-2


@pytest.fixture(scope="module")
def ball():
    height, press = rv.sphere(RADIUS, 1.2e-3, (63, 62)), rv.Program().load(0.02, over=0).hold(1.0)
    return rv.simulate(height, RUBBER, press, times=[0.0, 0.1, 1.0], fields=("pressure",), progress=False)


def test_ball__conducts_as_a_disc_of_its_radius(ball):
    """``4 a / (rho_1 + rho_2)`` with the exact radius of the growing contact."""
    radius = rv.closed_forms.lee_radok(RADIUS, RUBBER, 0.02).radius(ball["time"].values)
    found = conductance(ball, (5.0, 0.02))
    off = np.abs(found["thermal_conductance"] / (4 * radius / 5.02) - 1)
    stated = found["thermal_conductance_error"] / found["thermal_conductance"]
    assert off.max() < 1.5e-2
    assert (off < stated).all()
    assert stated.max() < 10 * off.max()
    assert found["thermal_conductance"].attrs["units"] == "W/K"
    assert conductance(ball, ("2 ohm m", 0))["electrical_conductance"].attrs["units"] == "S"


def test_resistivities__say_what_flows(ball):
    heat = conductance(ball, ("0.2 K m/W", 0))["thermal_conductance"]
    xr.testing.assert_allclose(conductance(ball, [0.1, 0.1])["thermal_conductance"], heat)
    charge = conductance(ball, ("0.2 ohm m", 0.0))
    np.testing.assert_allclose(charge["electrical_conductance"], heat)
    assert not set(charge) & set(conductance(ball, (1, 1)))


@pytest.mark.parametrize(
    ("resistivity", "message"),
    [
        (1.0, "resistivity: found 1.0: expected a list of two"),
        ("1 ohm m", "expected a list of two"),
        ((1.0,), "expected a list of two"),
        ((0.0, 0), "not both zero"),
        ((1.0, -1), "none below zero"),
        (("1 ohm m", "1 K m/W"), "resistivity: found '1 K m/W'"),
        ((np.nan, 1), "found nan"),
    ],
)
def test_wrong_resistivities__are_refused(ball, resistivity, message):
    with pytest.raises(InputError) as caught:
        conductance(ball, resistivity)
    assert message in str(caught.value)


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_no_contact_and_full_contact(boundary):
    cells = (np.arange(8) + 0.5) * 1e-6
    pressure = np.stack([np.zeros((8, 8)), np.ones((8, 8))])
    ds = xr.Dataset(
        {"pressure": (("time", "x", "y"), pressure)},
        {"time": [0.0, 1.0], "x": cells, "y": cells},
        attrs={"boundary": boundary},
    )
    found = conductance(ds, (1.0, 1.0))
    assert (found.isel(time=0).to_array() == 0).all()
    square = math.pi * 0.36678742 * 8e-6 if boundary == "free" else math.inf
    assert float(found["thermal_conductance"][1]) == pytest.approx(square, rel=2e-3)
    if boundary == "free":  # the outline of a punch is known where its surface is absent
        around = {axis: (np.arange(-2, 10) + 0.5) * 1e-6 for axis in "xy"}
        punch = ds.assign(height=(("x", "y"), np.zeros((8, 8)))).reindex(around, method="nearest", tolerance=1e-9)
        punch = punch.assign(pressure=punch.pressure.fillna(0.0))
        assert float(conductance(punch, (1.0, 1.0))["thermal_conductance"][1]) == pytest.approx(square, rel=2e-3)
