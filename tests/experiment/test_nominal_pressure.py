"""Nominal pressure: what it is a load on, where it is told, and when full contact is foreseen."""

import numpy as np
import pytest

import roughvisc as rv

RUBBER = rv.elastic(shear_modulus=1e6)


def test_pressure__is_the_load_over_the_whole_area():
    height = rv.self_affine((3e-4, 2e-4), (15, 12), hurst=0.8, rms_slope=0.1, seed=2)
    options = {"boundary": "periodic", "progress": False, "fields": ("pressure",)}
    by_pressure = rv.simulate(height, RUBBER, rv.Program().pressure("0.1 MPa", over=0).hold("1 s"), **options)
    np.testing.assert_allclose(by_pressure.force, 0.1e6 * 6e-8, rtol=1e-12)
    load = float(by_pressure.force[-1])  # to the last bit, whose rounding single-precision steps would magnify
    by_load = rv.simulate(height, RUBBER, rv.Program().load(load, over=0).hold(1.0), **options)
    np.testing.assert_array_equal(by_pressure.pressure, by_load.pressure)
    np.testing.assert_allclose(by_pressure.nominal_pressure, 0.1e6, rtol=1e-9)
    np.testing.assert_allclose(by_pressure.pressure.mean(("x", "y")), 0.1e6, rtol=1e-9)


def test_pressure__refers_to_the_surface_as_given_where_the_grid_grows():
    ball = rv.sphere(1e-3, 1e-4, 16)
    ds = rv.simulate(ball, RUBBER, rv.Program().pressure("0.2 MPa", over=0), times=[0], progress=False)
    assert ds.sizes["x"] > 16
    pressure = ds.pressure.values[-1]
    assert not any(line.any() for line in (pressure[0], pressure[-1], pressure[:, 0], pressure[:, -1]))
    assert float(ds.force[0]) == pytest.approx(0.2e6 * 1e-8)
    assert float(ds.nominal_pressure[0]) == pytest.approx(0.2e6)
