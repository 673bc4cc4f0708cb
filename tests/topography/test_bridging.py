"""Bridges over missing points, held against a dense solution; the spectrum and the noise that are measured by them."""

import numpy as np
import pytest
import scipy.fft

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.topography import blocks
from roughvisc.topography.bridging import _TENSION, bridged
from roughvisc.topography.inspection import inspect_scan
from roughvisc.topography.readers import from_array
from roughvisc.topography.spectrum import psd, unmeasured

CELL = 1e-6


def lowest_energy(heights, missing):
    """Heights whose cosines have the least ``sum((s^3 + k s) h_q^2)``: the same equation, all cells at once."""
    count = heights.size
    along = [2 - 2 * np.cos(np.pi * np.arange(n) / n) for n in heights.shape]
    symbol = along[0][:, None] + along[1]
    cosines = scipy.fft.dctn(np.eye(count).reshape(count, *heights.shape), axes=(1, 2), norm="ortho").reshape(count, -1)
    energy = cosines @ np.diag((symbol**3 + _TENSION * symbol).ravel()) @ cosines.T
    unknown = missing.ravel()
    found = heights.ravel().copy()
    found[unknown] = -np.linalg.solve(
        energy[np.ix_(unknown, unknown)], energy[np.ix_(unknown, ~unknown)] @ found[~unknown]
    )
    return found.reshape(heights.shape)


def scattered(shape, share, seed=3):
    return np.random.default_rng(seed).random(shape) < share


@pytest.mark.parametrize("share", [0.02, 0.3])
def test_bridged__is_the_solution_of_the_dense_equation(share):
    heights = 5.0 + np.random.default_rng(1).normal(size=(19, 14))
    missing = scattered(heights.shape, share)
    missing[:3, :4] = True  # a corner
    missing[9:13, 5:9] = True
    damaged = np.where(missing, np.nan, heights)
    np.testing.assert_allclose(bridged(damaged, missing), lowest_energy(heights, missing), rtol=0, atol=1e-9)


def test_bridged__goes_on_with_slope_and_curvature():
    """A membrane over a hole in a paraboloid is off by its sagitta."""
    x, y = np.meshgrid(np.arange(41.0), np.arange(38.0), indexing="ij")
    heights = 0.3 * x - 0.2 * y + 0.01 * (x - 20) ** 2 + 0.02 * (y - 20) ** 2
    missing = np.zeros(heights.shape, bool)
    missing[17:20, 12:15] = True
    membrane = rv.fill(from_array(np.where(missing, np.nan, heights), CELL)).values
    off = np.abs(bridged(heights, missing) - heights).max()
    assert off < 0.02 * np.abs(membrane - heights).max()


def test_bridged__in_blocks_of_rows_is_that_of_one_piece(monkeypatch):
    heights = np.random.default_rng(1).normal(size=(90, 31))
    missing = scattered(heights.shape, 0.1)
    missing[20:60, 10:20] = True  # the rim of a hole of several blocks
    whole = bridged(heights, missing)
    monkeypatch.setattr(blocks, "BLOCK", 8 * 31 * 20)
    np.testing.assert_allclose(bridged(heights, missing), whole, rtol=0, atol=0.02)
    assert np.abs(bridged(heights, missing) - whole).mean() < 1e-3


def rough(noise, shape=(120, 110), seed=1):
    """Waves down to eight cells, of 1 um, and white noise: a spectrum with a floor ``noise^2 dx dy``."""
    size = tuple(n * CELL for n in shape)
    smooth = rv.self_affine(size, shape, hurst=0.8, rms_height=1e-6, rolloff=4e-5, shortcut=8e-6, seed=seed)
    return smooth + noise * np.random.default_rng(9).normal(size=shape)


def bands(spectrum):
    """Mean density in each third of an octave that is seen whole. [m4]"""
    spectrum = spectrum.sel(wavevector=slice(np.pi / CELL))
    third = np.floor(3 * np.log2(spectrum.wavevector / spectrum.wavevector[0] + 1e-9)).astype(int)
    power = (spectrum.psd * spectrum.modes).groupby(third.rename("band")).sum()
    return (power / spectrum.modes.groupby(third.rename("band")).sum()).values


@pytest.mark.parametrize(("share", "off"), [(0.004, 0.04), (0.1, 0.35)])
@pytest.mark.parametrize("filled", [False, True])
def test_psd__by_measured_points_is_that_of_the_whole_scan(share, off, filled):
    whole = rough(3e-9)
    scan = whole.where(~scattered(whole.shape, share))
    found = psd(rv.fill(scan) if filled else scan, "hann", bridge=True)
    np.testing.assert_allclose(bands(found) / bands(psd(whole, "hann")), 1, atol=off)
    floor = found.psd.sel(wavevector=slice(0.6 * np.pi / CELL, np.pi / CELL))
    assert float(floor.mean()) / (9e-18 * CELL**2) == pytest.approx(1, rel=max(0.1, off / 2))
    naive = psd(rv.fill(scan), "hann").psd.sel(wavevector=floor.wavevector)
    assert float(naive.mean()) > (1.2 if share < 0.01 else 3) * float(floor.mean())


def test_psd__leaves_out_what_is_left_over_in_a_large_hole():
    """Its end is that of the whole scan, less the part of the window that the hole takes."""
    whole = rough(3e-9)
    scan = whole.copy()
    scan[70:100, 20:50] = np.nan
    scan[[75, 81, 90], [25, 40, 32]] = 1e-4  # where the instrument saw nothing
    scan[69, 40] = -1e-4  # and on the rim
    window = np.outer(*(np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 4 for n in scan.shape))
    left = window[~unmeasured(scan)].sum() / window.sum()
    ratio = bands(psd(scan, "hann", bridge=True)) / bands(psd(whole, "hann"))
    np.testing.assert_allclose(ratio[-2:], left, rtol=0.06)
    np.testing.assert_allclose(ratio[:9], 1, atol=0.2)  # all waves that the surface has


def test_psd__refuses_a_scan_of_which_most_is_missing():
    scan = rough(0).where(~scattered((120, 110), 0.6))
    with pytest.raises(InputError, match=r"psd: \d+ of 13200 points were not measured: expected half at most"):
        psd(scan, bridge=True)
    with pytest.raises(InputError, match="points are missing: expected none"):
        psd(scan)


@pytest.mark.parametrize("share", [0.004, 0.1])
def test_noise__of_known_strength_is_found_between_missing_points(share):
    for noise in (1e-9, 1e-8):
        whole = rough(noise)
        found = inspect_scan(whole.where(~scattered(whole.shape, share))).noise
        assert found.floor
        assert found.rms == pytest.approx(noise, rel=0.1)
        assert found.wavelength == pytest.approx(8e-6, rel=0.2)


@pytest.mark.parametrize("share", [0.004, 0.1])
def test_noise__is_none_on_a_surface_without(share):
    """What bridges add is no floor: with as many points again hidden it doubles."""
    found = inspect_scan(rough(0).where(~scattered((120, 110), share))).noise
    assert found.rms < 2e-4 * 1e-6
    assert not found.floor
