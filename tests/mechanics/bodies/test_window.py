"""The window of a free-space domain: what it leaves out, and what it does to it."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roughvisc.mechanics.bodies.window import (
    FarFieldDisplacement,
    Window,
    mean_influence,
    whole_domain,
    window_around,
)
from roughvisc.mechanics.body import HALF_SPACE
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.hereditary.exponentials import padded


def paraboloid(shape, centre):
    x, y = (np.arange(n) - c for n, c in zip(shape, centre, strict=True))
    return 1e-3 * (x[:, None] ** 2 + 1.3 * y**2)


@given(extent=st.integers(1, 200), centre=st.tuples(st.integers(0, 130), st.integers(0, 150)))
def test_window__holds_all_that_lies_lower_than_what_is_outside(extent, centre):
    gap = paraboloid((131, 151), centre)
    window = window_around(gap, extent)
    beyond = np.ones(gap.shape, bool)
    beyond[window.cells] = False
    if window.whole:
        assert math.isinf(window.outside)
        return
    assert window.outside == gap[beyond].min() > 0
    assert gap[window.cells].min() == 0
    assert all(0 < i < i + m < n for i, m, n in zip(window.first, window.shape, gap.shape, strict=True))


def test_window__grows_with_its_extent_up_to_the_domain():
    gap = paraboloid((301, 281), (160, 130))
    windows = [window_around(gap, extent) for extent in (10, 40, 80, 160, 400)]
    sizes = [w.shape[0] * w.shape[1] for w in windows]
    assert sizes == sorted(sizes)
    assert [w.whole for w in windows] == [False, False, False, False, True]
    for small, large in itertools.pairwise(windows):
        assert all(a >= b for a, b in zip(small.first, large.first, strict=True))


@given(seed=st.integers(0, 10_000))
def test_window__contains_the_former_one(seed):
    rng = np.random.default_rng(seed)
    gap = rng.random((101, 133))  # whose low cells lie anywhere
    gap -= gap.min()
    window, extent = window_around(gap, 30), 30
    while not window.whole:
        extent = round(1.5 * extent)
        former, window = window, window_around(gap, extent, former=window)
        former_cells, cells = np.zeros(gap.shape, bool), np.zeros(gap.shape, bool)
        former_cells[former.cells] = cells[window.cells] = True
        assert not (former_cells & ~cells).any()
        assert window.whole or window.outside == gap[~cells].min()


@pytest.mark.parametrize(("shape", "offset"), [((5, 6), (-1, 0)), ((5, 6), (0, 4)), ((2, 9), (0, 0))])
def test_padding__refuses_a_grid_that_does_not_contain_the_present_one(shape, offset):
    with pytest.raises(ValueError, match="does not contain"):
        padded(np.ones((2, 3, 3)), shape, offset)


def test_window__takes_in_every_summit_of_the_same_height():
    gap = np.minimum(paraboloid((201, 191), (50, 60)), paraboloid((201, 191), (140, 130)))
    window = window_around(gap, 30)
    assert np.count_nonzero(gap[window.cells] == 0) == 2


@pytest.mark.parametrize("spacing", [(1e-6, 1e-6), (2.0, 0.7)])
@pytest.mark.parametrize(("first", "shape"), [((3, 30), (11, 8)), ((20, 1), (16, 24)), ((0, 0), (41, 53))])
def test_reach__is_the_displacement_of_the_whole_domain(spacing, first, shape):
    domain = (41, 53)
    pressure = np.random.default_rng(0).random(shape)
    expected = Grid(domain, spacing).displacement(padded(pressure, domain, first))
    window = Window(domain, first, shape)
    found = np.concatenate([rows for _, rows in FarFieldDisplacement(window, spacing, HALF_SPACE).rows(pressure)])
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    quick = np.concatenate(
        [rows for _, rows in FarFieldDisplacement(window, spacing, HALF_SPACE, single=True).rows(1e-300 * pressure)]
    )
    np.testing.assert_allclose(1e300 * quick, expected, rtol=0, atol=1e-6 * expected.max())
    mean = np.sum(pressure * mean_influence(window, spacing, HALF_SPACE))
    assert mean == pytest.approx(np.mean(expected), rel=1e-12)


def test_whole_domain__leaves_nothing_out():
    window = whole_domain((5, 7))
    assert window.whole
    assert np.zeros((5, 7))[window.cells].shape == (5, 7)


def test_window__that_would_begin_or_end_at_the_border_is_the_domain():
    """One point after the other lies lowest: the sides of the window are the same, where it lies is not."""
    shape = (131, 151)
    for centre in range(131):
        window = window_around(paraboloid(shape, (centre, 75)), 1)
        if not window.whole:
            assert 0 < window.first[0] < window.first[0] + window.shape[0] < 131
    sides = {window_around(paraboloid(shape, (centre, 75)), 1).whole for centre in (0, 65, 130)}
    assert sides == {True, False}
