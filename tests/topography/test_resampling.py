"""Surfaces on other grids: against waves, polynomials and contacts that are known on any grid."""

import numpy as np
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, shapes

import roughvisc as rv
from roughvisc.topography.borders import is_mirrored

SIZE = (1e-3, 0.8e-3)
#: Waves of a surface: numbers over the sides, amplitude [m] and phase; none shorter than a seventh of a side.
WAVES = [
    (*number, 4e-6 / (number[0] ** 2 + number[1] ** 2), phase)
    for number, phase in zip(
        [(1, 0), (0, 1), (2, 1), (-1, 2), (3, -2), (1, 4), (5, 1), (-4, 3), (6, -6), (2, 7)],
        np.random.default_rng(0).uniform(0, 2 * np.pi, 10),
        strict=True,
    )
]


def sum_of_waves(shape, waves=WAVES):
    """Heights at the cell centres, from the waves themselves. [m]"""
    x, y = ((np.arange(n) + 0.5) / n for n in shape)
    phase = [2 * np.pi * (i * x[:, None] + j * y) + at for i, j, _, at in waves]
    heights = sum(a * np.cos(p) for (_, _, a, _), p in zip(waves, phase, strict=True))
    return rv.from_array(heights, [side / n for side, n in zip(SIZE, shape, strict=True)])


@examples(60)
@given(
    old=shapes(3, 24),
    new=shapes(2, 30),
    number=st.tuples(st.integers(-12, 12), st.integers(-12, 12)),
    phase=st.floats(0, 6.3),
)
def test_resample__keeps_the_waves_that_both_grids_hold_at_their_place_and_no_others(old, new, number, phase):
    if not all(2 * abs(k) < n for k, n in zip(number, old, strict=True)):
        return  # another wave on the old grid
    held = all(2 * abs(k) < m or m == n for k, m, n in zip(number, new, old, strict=True))
    waves = [(0, 0, 3e-6, 0.0), (*number, 2e-6, phase)]
    found = rv.resample(sum_of_waves(old, waves), new, periodic=True)
    expected = sum_of_waves(new, waves[: 1 + held])
    xr.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-18)
    assert found.attrs["history"].endswith("cells, by Fourier interpolation")


def test_resample__a_wave_of_two_cells_is_a_sine_on_a_finer_grid_and_none_on_a_coarser_one():
    two = rv.from_array(1e-6 * np.outer((-1.0) ** np.arange(6), np.ones(5)), 1e-6)
    fine = rv.resample(two, (15, 5), periodic=True)
    np.testing.assert_allclose(fine, np.outer(1e-6 * np.sin(np.pi * fine.x / 1e-6), np.ones(5)), atol=1e-20)
    np.testing.assert_allclose(
        rv.resample(sum_of_waves((13, 5), [(2, 0, 1e-6, 0.4)]), (4, 5), periodic=True), 0, atol=1e-20
    )


def test_resample__a_mirrored_surface_stays_its_own_mirror_image():
    half = rv.self_affine(SIZE, (22, 17), hurst=0.8, rms_slope=0.1, seed=4)
    for shape in ((60, 44), (20, 26)):
        found = rv.resample(rv.mirror(half), shape)
        assert is_mirrored(found)
        quarter = rv.resample(half, [n // 2 for n in shape], periodic=False)  # cosines: the mirror images are in them
        np.testing.assert_allclose(found, rv.mirror(quarter), rtol=0, atol=1e-12 * float(abs(half).max()))
