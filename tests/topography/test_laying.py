"""Two faces on one grid: planes stay planes, missing points stay missing, two balls press as one."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.errors import InputError


def plane(shape, spacing, slopes, at=(0.0, 0.0)):
    """Heights ``sx (x - x0) + sy (y - y0)`` about the scan's centre, on coordinates that begin anywhere. [m]"""
    h = rv.from_array(np.zeros(shape), spacing=spacing)
    x, y = (h[a] - n * d / 2 for a, n, d in zip("xy", shape, spacing, strict=True))
    return (h + slopes[0] * x + slopes[1] * y).assign_coords(x=h.x + at[0], y=h.y + at[1]).assign_attrs(h.attrs)


@pytest.mark.parametrize("flip", [None, "x", "y"])
@pytest.mark.parametrize(
    ("shape", "cell"),
    [((41, 30), (1e-6, 1.3e-6)), ((100, 95), (0.37e-6, 0.41e-6)), ((15, 14), (2.7e-6, 3.1e-6))],
    ids=["odd and even", "finer", "coarser"],
)
def test_combine__a_plane_on_another_grid_stays_a_plane(flip, shape, cell):
    """Away from the border, where cosines of a face with smaller cells do not meet its slope."""
    first, second = (
        plane((30, 21), (1e-6, 1.3e-6), (0.1, 0.0), (5e-3, 0.0)),
        plane(shape, cell, (0.03, -0.07), (0.0, 1)),
    )
    offset = (1.25e-6, -0.7e-6)
    both = rv.combine(first, second, flip, offset=offset)
    x, y = both.x - 5e-3 - 15e-6, both.y - 21 * 1.3e-6 / 2
    signs = {None: (1, 1), "x": (-1, 1), "y": (1, -1)}[flip]
    expected = 0.1 * x + 0.03 * signs[0] * (x - offset[0]) - 0.07 * signs[1] * (y - offset[1])
    inner = expected.isel(x=slice(8, -8), y=slice(6, -6))
    off = 0.02 * 0.1 * 1e-6 if cell[0] < 1e-6 else 1e-18
    np.testing.assert_allclose(both.sel(x=inner.x, y=inner.y), inner.transpose("x", "y"), rtol=0, atol=off)
    for axis, side, own in (("x", 1e-6, (30, shape[0] * cell[0])), ("y", 1.3e-6, (21, shape[1] * cell[1]))):
        assert np.isin(both[axis], first[axis]).all(), "the grid is that of the first"
        covered = (
            abs(first[axis] - float(first[axis].mean()) - offset["xy".index(axis)]) + side / 2 <= own[1] / 2 + 1e-15
        )
        np.testing.assert_array_equal(both[axis], first[axis][covered])


def test_combine__smaller_cells_keep_the_waves_that_the_larger_ones_hold():
    """Closed form: cosines of the face and its mirror images, the short one of which is left out."""
    x, y = ((np.arange(n) + 0.5) / n for n in (27, 16))
    fine = np.outer(np.cos(4 * np.pi * x) + np.cos(20 * np.pi * x), np.cos(3 * np.pi * y))
    first = rv.from_array(np.zeros((9, 8)), spacing=(3e-6, 4e-6))
    both = rv.combine(first, rv.from_array(1e-7 * fine, spacing=(1e-6, 2e-6)))
    x, y = ((np.arange(n) + 0.5) / n for n in (9, 8))
    expected = 1e-7 * np.outer(np.cos(4 * np.pi * x), np.cos(3 * np.pi * y))
    np.testing.assert_allclose(both, expected, rtol=0, atol=1e-18)


def test_combine__points_missing_in_the_second_are_missing_in_the_sum():
    first, heights = rv.from_array(np.zeros((4, 5)), spacing=2e-6), np.ones((8, 10)) * 1e-7
    heights[0:2, 0] = heights[2, 2] = np.nan  # half of a cell of the first, and a quarter of one
    second = rv.from_array(heights, spacing=1e-6)
    both = rv.combine(first, second)
    assert np.isfinite(both.values).all()
    second[0, 1] = np.nan  # three quarters
    both = rv.combine(first, second, "x")
    assert np.argwhere(np.isnan(both.values)).tolist() == [[3, 0]]
    for axis in (0, 1):  # a missing cell of equal size covers 0.7 of one cell and 0.3 of the next
        second = rv.from_array(np.where(np.arange(30).reshape(5, 6) == 15, np.nan, 0.0), spacing=2e-6)
        offset = [0.6e-6 * (axis == other) for other in (0, 1)]
        both = rv.combine(rv.from_array(np.zeros((5, 6)), spacing=2e-6), second, offset=offset)
        ((i, j),) = np.argwhere(np.isnan(both.values))
        assert (float(both.x[i]), float(both.y[j])) == pytest.approx((5e-6, 7e-6))


def test_combine__two_balls_press_as_one_of_the_harmonic_radius():
    # 1/R = 1/R1 + 1/R2; contact compliances add: 1/E* = (1 - nu1)/(2 G1) + (1 - nu2)/(2 G2)
    upper, lower = rv.sphere(1e-2, 1e-3, 41), rv.sphere(3e-2, (1.1e-3, 1.3e-3), (51, 45))
    both = rv.combine(upper, lower, "x")
    material = rv.pair(rv.elastic(2e6, 0.3), rv.elastic(1e6))
    press = rv.Program().load(0.02, over=0.0)
    ds = rv.simulate(both, material, press, boundary="free", tolerance=1e-4, progress=False)
    modulus = 1 / (0.7 / (2 * 2e6) + 0.5 / (2 * 1e6))
    exact = rv.closed_forms.hertz(1 / (1 / 1e-2 + 1 / 3e-2), modulus, 0.02)
    assert ds.approach.values[-1] == pytest.approx(exact.approach, rel=5e-3)
    assert ds.contact_area.values[-1] == pytest.approx(np.pi * exact.radius**2, rel=2e-2)


def test_combine__a_recipe_is_no_longer_one_and_what_is_absent_stays_so():
    punch, ball = rv.flat_punch(2e-5, 1e-4, 21), rv.sphere(1e-3, 1e-4, 21)
    both = rv.combine(punch, ball)
    assert "recipe" not in both.attrs
    assert both.attrs["missing"] == "absent"
    assert rv.combine(ball, punch).attrs["missing"] == "absent"
    gaps = ball.copy()
    gaps[0, 0] = np.nan  # of a measurement: what is there is not known
    assert "missing" not in rv.combine(punch, gaps).attrs


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"offset": 1e-6}, "offset"),
        ({"offset": (np.nan, 0)}, "offset"),
        ({"offset": (0, 4e-6)}, "covers 1 of 5 cells"),
        ({"flip": "z"}, "flip"),
    ],
)
def test_combine__refuses(options, named):
    h = rv.from_array(np.zeros((8, 5)), spacing=1e-6)
    with pytest.raises(InputError, match=named):
        rv.combine(h, h, **options)
