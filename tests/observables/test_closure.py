"""Closure of a joint: stress, gaps and stiffness against closed forms."""

import numpy as np
import pytest
import xarray as xr

import roughvisc as rv

MODULUS, AMPLITUDE, WAVELENGTH = 1e9, 1e-6, 1e-3
FULL = np.pi * MODULUS * AMPLITUDE / WAVELENGTH
ROCK = rv.elastic(young_modulus=0.75 * MODULUS)


def pressed(height, pressures):
    program = rv.Program.table(np.arange(len(pressures) + 1.0), np.append(0.0, pressures), "pressure")
    times = np.arange(1.0, len(pressures) + 1)
    return rv.simulate(height, ROCK, program, boundary="periodic", times=times, tolerance=1e-4, progress=False)


def test_stiffness__of_waves_is_that_of_collinear_cracks():
    wave = rv.wavy(AMPLITUDE, WAVELENGTH, (WAVELENGTH, WAVELENGTH / 32), (256, 8), waves=1)
    ratio = np.array([0.3, 0.35, 0.4, 0.45])
    ds = pressed(wave, FULL * ratio)
    joint = rv.observables.closure(ds, along="y")
    assert joint.nominal_pressure.values == pytest.approx(FULL * ratio)
    exact = np.pi * MODULUS / (-np.log(ratio) * WAVELENGTH)  # Koiter, 1959: collinear cracks between strips in contact
    assert joint.normal_stiffness[1:-1].values == pytest.approx(exact[1:-1], rel=0.01)
    assert joint.closure.values == pytest.approx(ds.approach.values), "the mean plane of the body does not move"
    assert (joint.hydraulic_aperture > joint.mean_gap).all(), "along the channels"
    xr.merge([ds, joint], compat="equals", join="exact")


def test_closure__of_equal_faces_is_zero():
    face = rv.self_affine(1e-3, 16, hurst=0.8, rms_slope=0.1, seed=1)
    ds = pressed(rv.combine(face, rv.invert(face)), [1e5, 1e6])
    joint = rv.observables.closure(ds)
    for name in ("closure", "mean_gap", "hydraulic_aperture"):
        assert joint[name].values == pytest.approx([0, 0], abs=1e-18)
    assert joint.normal_stiffness.isnull().all()


@pytest.mark.parametrize("missing", ["gap", "height"])
def test_closure__without_gap_or_height_is_refused(missing):
    ds = pressed(rv.wavy(AMPLITUDE, WAVELENGTH, WAVELENGTH, 8), [FULL / 10])
    with pytest.raises(rv.InputError):
        rv.observables.closure(ds.drop_vars(missing))
