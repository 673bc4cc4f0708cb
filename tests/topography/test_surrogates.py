"""Random surfaces with the spectrum of a surface: it is kept on any grid, and its short waves can be left out."""

import numpy as np
import pytest
import xarray as xr
from support import refused

import roughvisc as rv
from roughvisc.errors import InputError


def rough(shape=(45, 52), shortcut=8e-5):
    return rv.self_affine((1e-3, 0.9e-3), shape, hurst=0.7, rms_height=1e-6, shortcut=shortcut, seed=4)


def test_surrogates__have_the_radial_spectrum_of_the_surface_on_average():
    """The power of each independent wave, half of the modes of a ring, has an exponential distribution."""
    h, count = rough(), 60
    wanted = rv.psd(h)
    rings = (wanted.wavevector < 0.95 * np.pi * 45 / 1e-3) & (wanted.psd > 1e-9 * wanted.psd.max())  # whole, with waves
    found = sum(rv.psd(one).psd for one in rv.surrogates(h, count, seed=2)) / count
    scatter = 1 / np.sqrt(count * wanted.modes / 2)
    assert int(rings.sum()) > 8
    assert bool((abs(found / wanted.psd - 1) < 4 * scatter)[rings].all())


@pytest.mark.parametrize("sides", [(1e-6, 3e-6), (3e-6, 1e-6)])
def test_surrogates__of_unequal_cells_have_the_waves_of_complete_rings_only(sides):
    h = rv.from_array(np.random.default_rng(0).normal(0, 1e-7, (40, 33)), sides)
    found = rv.surrogates(h, 1, seed=1)[0]
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(40, sides[0])[:, None], np.fft.fftfreq(33, sides[1]))
    waves = np.abs(np.fft.fft2(found.values))
    assert waves[q > np.pi / 3e-6].max() < 1e-12 * waves.max()
    assert waves[(q > 0) & (q < 0.99 * np.pi / 3e-6)].min() > 0


def test_surrogates__are_one_surface_on_any_grid():
    h = rough((45, 52))
    coarse = rv.resample(h, (31, 36))  # holds all of its waves
    fine, few = (rv.surrogates(one, 1, seed=1)[0] for one in (h, coarse))
    np.testing.assert_allclose(rv.resample(fine, (31, 36), periodic=True), few, atol=1e-9 * float(fine.std()))


def test_surrogates__repeat_and_differ():
    h = rough()
    first, again, other = rv.surrogates(h, 2, seed=1), rv.surrogates(h, 1, seed=1), rv.surrogates(h, 1, seed=2)
    xr.testing.assert_equal(first.isel(realisation=[0]), again)
    assert abs(np.corrcoef(first[0].values.ravel(), first[1].values.ravel())[0, 1]) < 0.5
    assert abs(np.corrcoef(first[0].values.ravel(), other[0].values.ravel())[0, 1]) < 0.5
    assert first.realisation.values.tolist() == [1, 2]


def test_surrogates__of_mirror_images_are_as_large_as_what_was_measured():
    scan = rv.crop(rough(), x=(0, 6e-4), y=(1e-4, 8e-4))
    found, of_images = rv.surrogates(scan, 2, seed=3), rv.surrogates(rv.mirror(scan), 2, seed=3)
    np.testing.assert_allclose(of_images, found, rtol=0, atol=1e-12 * float(found.std()))
    for axis in ("x", "y"):
        np.testing.assert_allclose(of_images[axis], scan[axis], rtol=1e-12)
        np.testing.assert_array_equal(found[axis], scan[axis])


def test_surrogates__of_a_regular_wave_are_as_large_as_the_wave():
    """Its values are symmetric, but no part of it is the image of another one."""
    waves = rv.wavy(1e-6, 1e-4, (3e-4, 2e-4), (50, 44))
    assert rv.surrogates(waves, 1, seed=1)[0].shape == waves.shape


def test_surrogates__of_a_scan_are_periodic_and_have_its_slope():
    scan = rv.crop(rough((90, 104)), x=(0, 6e-4))
    found = rv.surrogates(scan, 8, seed=1)
    slopes = [float(rv.parameters(one, periodic=True).Sdq) for one in found]
    assert np.mean(slopes) == pytest.approx(float(rv.parameters(scan).Sdq), rel=0.15)


@pytest.mark.parametrize(("key", "value"), [("count", 0), ("count", 2.0), ("seed", -1), ("seed", None)])
def test_surrogates__refuse(key, value):
    with refused(key, value):
        rv.surrogates(rough(), **{"count": 1, "seed": 0, key: value})


def test_surrogates__refuse_missing_points():
    h = rough()
    h[3, 4] = np.nan
    with pytest.raises(InputError, match="points are missing"):
        rv.surrogates(h, 1, seed=0)


def test_without_short_waves__leaves_those_that_are_longer():
    wave, ripple = (rv.wavy(a, length, (1e-3, 8e-4), (50, 44)) for a, length in ((1e-6, 2e-4), (1e-7, 1e-4)))
    cut = rv.without_short_waves((wave + ripple).assign_attrs(wave.attrs), 1.2e-4, periodic=True)
    np.testing.assert_allclose(cut, wave, atol=1e-15)


def test_without_short_waves__of_a_scan_are_those_of_its_mirror_images():
    scan = rv.crop(rough(), x=(0, 6e-4))
    both = rv.mirror(rv.without_short_waves(scan, 1e-4)), rv.without_short_waves(rv.mirror(scan), 1e-4)
    np.testing.assert_allclose(both[0], both[1], atol=1e-18)
    assert 0.3 < float(both[0].std() / rv.mirror(scan).std()) < 0.999


@pytest.mark.parametrize("shortest", [1e-5, 9.1e-4, 0.0, float("nan")])
def test_without_short_waves__refuses_a_length_out_of_range(shortest):
    with refused("shortest", shortest):
        rv.without_short_waves(rough(), shortest)
