"""The shortest octave of a surface's waves."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.topography.spectrum import without_last_octave


def wave(number, cells, amplitude=1.0):
    return amplitude * np.cos(2 * np.pi * number * (np.arange(cells) + 0.3) / cells)


def test_without_last_octave__leaves_waves_twice_as_long_as_the_shortest():
    cells = (0.5, 0.25)  # 20.5 long, 9.5 wide
    long = wave(2, 41)[:, None] + wave(1, 38, 0.5) + 3  # the short wave has 3 % of the mean square slope
    kept, shortest = without_last_octave(long + wave(9, 38, 0.02), cells)
    np.testing.assert_allclose(kept, long, atol=1e-12)
    assert shortest == pytest.approx(2 * 9.5 / 9)


def test_without_last_octave__does_not_take_noise_of_the_instrument_for_waves():
    noise = 1e-3 * np.random.default_rng(1).standard_normal((40, 30))
    kept, shortest = without_last_octave(wave(8, 40)[:, None] + wave(2, 40)[:, None] + noise, (1.0, 1.0))
    np.testing.assert_allclose(kept, wave(2, 40)[:, None] + np.zeros((40, 30)), atol=4e-3)
    assert shortest == pytest.approx(10)


def test_without_last_octave__of_a_generated_surface_is_below_its_short_cut_off():
    rough = rv.self_affine(1.0, (60, 50), hurst=0.8, rms_slope=0.1, shortcut=0.1, seed=1)
    _, shortest = without_last_octave(rough.values, (1 / 60, 1 / 50))
    assert 0.2 <= shortest < 0.23


def test_without_last_octave__of_a_plane_is_the_plane():
    kept, shortest = without_last_octave(np.full((4, 3), 2.0), (1.0, 1.0))
    assert (kept == 2).all()
    assert shortest == 0
