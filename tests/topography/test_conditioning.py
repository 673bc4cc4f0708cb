"""Conditioning of scans: filters, fits, filling and outliers against closed forms, and what is refused."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import examples, shapes
from support import refused

from roughvisc.arguments import arguments
from roughvisc.errors import InputError
from roughvisc.topography.conditioning import STEPS, condition
from roughvisc.topography.filters import fill, gaussian_filter, level, mask_outliers
from roughvisc.topography.framing import combine, crop, invert, mirror, rotate90
from roughvisc.topography.grid import spacing
from roughvisc.topography.readers import from_array
from roughvisc.topography.recipes import flat_punch, self_affine, sphere
from roughvisc.topography.spectrum import resample

CELL = (2e-6, 3e-6)


def rough(shape=(45, 38), missing=0.0, seed=0):
    """Self-affine roughness of 1 um rms height, with some points missing."""
    size = tuple(n * d for n, d in zip(shape, CELL, strict=True))
    h = self_affine(size, shape, hurst=0.8, rms_height=1e-6, rolloff=4e-5, seed=seed)
    return h.where(np.random.default_rng(seed).random(shape) >= missing)


@pytest.mark.parametrize(
    ("step", "named"),
    [
        (lambda: level(rough(), 4), "order"),
        (lambda: level(rough().isel(y=[3, 4]).where(rough().x == rough().x[3])), "determine"),
        (lambda: level(rough() * np.nan), "missing"),
        (lambda: mask_outliers(rough(), window=4), "window"),
        (lambda: mask_outliers(rough(), threshold=0), "threshold"),
        (lambda: fill(flat_punch(2e-5, 1e-4, 21)), "absent"),
        (lambda: fill(rough() * np.nan), "missing"),
        (lambda: gaussian_filter(rough(), 8e-6), "cutoff"),
        (lambda: gaussian_filter(rough(), 2.9), "cutoff"),  # meant in micrometres, written without a unit
        (lambda: gaussian_filter(rough(), 2e-5, keep="both"), "keep"),
        (lambda: crop(rough(), x=(1.0, 2.0)), "x"),
        (lambda: crop(rough(), y=3e-5), "y"),
        (lambda: rotate90(rough(), 0.5), "turns"),
        (lambda: resample(rough(), 1), "shape"),
        (lambda: resample(rough(), 5, periodic="x"), "periodic"),
    ],
)
def test_step__refuses_a_wrong_argument_by_name(step, named):
    with pytest.raises(InputError, match=named):
        step()


@pytest.mark.parametrize(
    ("steps", "key", "found"),
    [
        ({"level": 4}, "surface.level", 4),
        ({"level": {"order": 4}}, "surface.level.order", 4),
        ({"filter": 2.9}, "surface.filter", 2.9),
        ({"resample": 1}, "surface.resample", 1),
        ({"rotate90": 0.5}, "surface.rotate90", 0.5),
        ({"realisation": 0}, "surface.realisation", 0),
        ({"shortest_wave": 1e-9}, "surface.shortest_wave", 1e-9),
        ({"outliers": 9}, "surface.outliers", 9),
        ({"outliers": {"window": 4}}, "surface.outliers.window", 4),
        ({"fill": "harmonic"}, "surface.fill", "harmonic"),
    ],
    ids=str,
)
def test_condition__refuses_a_plain_value_at_the_step_and_a_table_at_its_key(steps, key, found):
    with refused(key, found):
        condition(rough(), steps, "surface")


def test_step_without_keys__refuses_a_key_in_words():
    with pytest.raises(InputError, match=r"^surface.invert.a: unknown key: expected no key$"):
        condition(rough(), {"invert": {"a": 1}}, "surface")


@pytest.mark.parametrize("name", [name for name, step in STEPS.items() if step.argument])
def test_steps__plain_value_is_the_argument_after_the_heights(name):
    assert list(arguments(STEPS[name].function))[1] == STEPS[name].argument


@pytest.mark.parametrize(("offset", "off"), [(0.0, 1e-17), (1e-2, 1e-16)])
@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_level__is_the_least_squares_solution(order, offset, off):
    """Large absolute heights cost no more digits than their own rounding, 2e-18 m."""
    h = rough(missing=0.3) + offset
    present = np.isfinite(h.values)
    x, y = np.meshgrid(h.x / 1e-4, h.y / 1e-4, indexing="ij")
    design = np.stack([(x**i * y**j)[present] for i in range(order + 1) for j in range(order + 1 - i)], axis=1)
    heights = h.values[present] - offset
    solution = np.linalg.lstsq(design, heights, rcond=None)[0]
    np.testing.assert_allclose(level(h, order).values[present], heights - design @ solution, atol=off)


def test_mask_outliers__finds_spikes_and_nothing_else():
    h = rough((61, 54), missing=0.05)
    rng = np.random.default_rng(1)
    at = rng.choice(h.size, 30, replace=False)
    spiked = h.copy(deep=True)
    spiked.values.flat[at] += rng.choice([-1, 1], 30) * 3e-5
    done = mask_outliers(spiked)
    hit = np.zeros(h.shape, bool)
    hit.flat[at] = True
    np.testing.assert_array_equal(np.isnan(done.values), np.isnan(h.values) | hit)
    assert done.attrs["outliers"] == int((hit & np.isfinite(h.values)).sum())
    assert mask_outliers(h).attrs["outliers"] == 0


@pytest.mark.parametrize("threshold", [8.0, 5.0])
def test_mask_outliers__threshold_counts_standard_deviations_of_normal_noise(threshold):
    """In a window that is as noisy as the scan or noisier; in a quiet part the deviation of the whole scan counts."""
    noise = np.random.default_rng(2).normal(0, 1e-8, (72, 63))
    noise[:, 54:] *= 0.1
    for deviations, is_outlier in ((0.8 * threshold, False), (1.5 * threshold, True)):
        spiked = noise.copy()
        spiked[4::9, 4::9] = deviations * 1e-8
        found = np.isnan(mask_outliers(from_array(spiked, CELL), threshold=threshold).values[4::9, 4::9])
        np.testing.assert_array_equal(found, is_outlier)


@pytest.mark.parametrize("turned", [False, True])
def test_mask_outliers__finds_isolated_points_in_holes_at_any_height(turned):
    """Stray points of a confocal instrument: some have the height of the surface. The rim of the hole is no outlier."""
    h = rough((61, 54))
    h = h.transpose("y", "x").rename(x="y", y="x") if turned else h
    i, j = np.indices(h.shape)
    hole = np.hypot(i - 20, j - 22) < 15
    stray = hole & (i % 6 <= 1) & (j % 5 == 0) & (np.hypot(i - 20, j - 22) < 12)  # alone, and in pairs
    assert stray.sum() > 20
    island = (abs(i - 45) < 3) & (abs(j - 40) < 3)  # of 25 points: a pillar in another hole
    hole |= (abs(i - 45) < 10) & (abs(j - 40) < 10) & ~island
    holed = h.where(~hole | stray)
    for values in (holed, holed + 1e-4 * stray, holed - 1e-4 * stray):
        done = mask_outliers(values)
        np.testing.assert_array_equal(np.isnan(done.values), hole)
        assert done.attrs["outliers"] == stray.sum()
    assert mask_outliers(mask_outliers(holed)).attrs["outliers"] == stray.sum(), "none is counted twice or lost"
    sparse = h.where((i % 3 == 0) & (j % 3 == 0))  # a coarse scan on a fine lattice: all of its points are far apart
    assert mask_outliers(sparse).attrs["outliers"] == 0


def test_fill__keeps_the_points_present_and_says_what_it_did():
    h = rough(missing=0.1)
    done = fill(h)
    missing = np.isnan(h.values)
    assert np.isfinite(done.values).all()
    np.testing.assert_array_equal(done.values[~missing], h.values[~missing])
    np.testing.assert_array_equal(done["filled"].values, missing)
    assert done.attrs["filled_points"] == missing.sum()
    assert np.nanmin(h) <= done.min() <= done.max() <= np.nanmax(h)
    again = fill(done.where(done.x > 4e-6))
    assert again.attrs["filled_points"] == int((missing | (h.x.values <= 4e-6)[:, None]).sum())


def test_fill__solves_laplace_and_keeps_planes():
    x, y = np.meshgrid(np.arange(31.0), np.arange(26.0), indexing="ij")
    plane = from_array(1e-6 * (0.3 * x - 0.2 * y) + 7e-2, CELL)
    hole = plane.where((abs(plane.x - 3e-5) > 9e-6) | (abs(plane.y - 3e-5) > 9e-6))
    assert int(np.isnan(hole).sum()) > 30
    np.testing.assert_allclose(fill(hole), plane, rtol=0, atol=1e-15)
    curved = from_array(1e-6 * np.sin(0.3 * x) * np.cosh(0.25 * y), CELL).where(np.isfinite(hole))
    done, holes = fill(curved).values, np.argwhere(np.isnan(curved.values))
    for i, j in holes:
        mean = (done[i - 1, j] + done[i + 1, j] + done[i, j - 1] + done[i, j + 1]) / 4
        assert done[i, j] == pytest.approx(mean, rel=1e-9, abs=1e-15)


@examples(40)
@given(old=shapes(3, 24), new=shapes(2, 30), wave=st.tuples(st.integers(0, 23), st.integers(0, 23)))
def test_resample__keeps_the_cosines_that_both_grids_hold_and_no_others(old, new, wave):
    """Closed form: a cosine with so many half waves along each side, at the centres of the cells."""

    def cosine(shape):
        x, y = ((np.arange(n) + 0.5) / n for n in shape)
        return np.outer(np.cos(np.pi * wave[0] * x), np.cos(np.pi * wave[1] * y))

    assume(all(k < n for k, n in zip(wave, old, strict=True)))
    found = resample(from_array(3.0 + cosine(old), CELL), new)
    held = all(k < m for k, m in zip(wave, new, strict=True))
    np.testing.assert_allclose(found, 3.0 + held * cosine(new), atol=1e-12)
    for axis, d, n, m in zip(("x", "y"), CELL, old, new, strict=True):
        np.testing.assert_allclose(found[axis], (np.arange(m) + 0.5) * n * d / m, rtol=1e-12)


def test_resample__keeps_missing_points_missing():
    """A cell is missing if more than half of it is."""
    h = rough((30, 21))
    values = h.values.copy()
    values[:7, :8] = np.nan  # three and a half of the larger cells, by two and two thirds
    holed = from_array(values, CELL)
    coarse = resample(holed, (15, 7))
    share = np.isnan(values).reshape(15, 2, 7, 3).mean((1, 3))
    np.testing.assert_array_equal(np.isnan(coarse), share > 0.5)
    np.testing.assert_allclose(coarse, resample(fill(holed), (15, 7)).where(share <= 0.5), rtol=1e-12)
    fine = resample(holed, (45, 42))
    np.testing.assert_array_equal(np.isnan(fine[:10, :16]), True)
    np.testing.assert_array_equal(np.isnan(fine[11:, 16:]), False)


def test_resample__keeps_absent_material_absent():
    punch = flat_punch(2e-5, 1e-4, 20)
    few = resample(punch, 10)
    assert few.attrs["missing"] == "absent"
    np.testing.assert_allclose(few.values[few.notnull()], 0, atol=1e-20)
    assert int(few.notnull().sum()) == pytest.approx(int(punch.notnull().sum()) / 4, abs=6)


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0, 4.0])
def test_gaussian_filter__transmission_is_half_at_the_cutoff(axis, ratio):
    cutoff, cells = 2.4e-5, {"x": (240, 7), "y": (7, 160)}[axis]
    flat = from_array(np.zeros(cells), CELL)
    wave = flat + 1e-6 * np.cos(2 * np.pi * flat[axis] / (ratio * cutoff)) + 0.05
    passed = gaussian_filter(wave, cutoff) - 0.05
    # away from the border, where the weights are cut
    middle = passed.isel({axis: slice(50, -50)})
    expected = 0.5 ** (1 / ratio**2) * (wave - 0.05).isel({axis: slice(50, -50)})
    np.testing.assert_allclose(middle, expected, rtol=0, atol=1e-13)


def test_gaussian_filter__short_is_the_rest_and_missing_points_weigh_nothing():
    h = rough(missing=0.1)
    long, short = (gaussian_filter(h, 2e-5, keep) for keep in ("long", "short"))
    np.testing.assert_allclose(long + short, h, rtol=1e-12)
    np.testing.assert_array_equal(np.isnan(long), np.isnan(h))
    assert float(long.std()) < float(h.std())
    constant = gaussian_filter(h * 0 + 0.3, 2e-5)
    np.testing.assert_allclose(constant.values[np.isfinite(h)], 0.3, rtol=1e-14)


def test_gaussian_filter__equals_the_sum_that_the_standard_writes():
    h = rough((17, 14), missing=0.2)
    alpha, cutoff = np.sqrt(np.log(2) / np.pi), 1.5e-5
    present = np.isfinite(h.values)
    x, y = np.meshgrid(h.x, h.y, indexing="ij")
    i, j = 5, 2
    assert present[i, j]
    weight = np.exp(-np.pi * ((x - x[i, j]) ** 2 + (y - y[i, j]) ** 2) / (alpha * cutoff) ** 2)[present]
    expected = (weight * h.values[present]).sum() / weight.sum()
    assert float(gaussian_filter(h, cutoff)[i, j]) == pytest.approx(expected, rel=1e-9)


def test_rotate90__turns_counter_clockwise():
    h = sphere(1e-4, (6e-5, 3e-5), (15, 10))
    h = h + 1e-7 * xr.where((h.x > 5e-5) & (h.y < 1e-5), 1.0, 0.0)  # a mark at lower right
    once = rotate90(h)
    assert once.shape == (10, 15)
    np.testing.assert_allclose(spacing(once), spacing(h)[::-1], rtol=1e-14)
    # what was at (x, y) from the centre is at (-y, x)
    x, y = 2.6e-5, -1.2e-5
    was = h.sel(x=3e-5 + x, y=1.5e-5 + y, method="nearest")
    now = once.sel(x=1.5e-5 - y, y=3e-5 + x, method="nearest")
    assert float(was) == float(now)
    np.testing.assert_array_equal(rotate90(rotate90(h, 3)), h)
    np.testing.assert_array_equal(rotate90(h, -1), rotate90(h, 3))


def test_combine__adds_faces_on_equal_cells():
    a, b = rough(missing=0.05), rough(missing=0.05, seed=1)
    np.testing.assert_array_equal(combine(a, b), a.values + b.values)
    np.testing.assert_array_equal(combine(a, b, flip="y"), a.values + b.values[:, ::-1])
    np.testing.assert_array_equal(combine(a, b, "x", offset=(2 * CELL[0], 0.0)), a.values[2:] + b.values[:1:-1])
    np.testing.assert_array_equal(combine(a, invert(a)).fillna(0), 0)
    np.testing.assert_array_equal(np.isnan(combine(a, b)), np.isnan(a) | np.isnan(b))


def test_filled__goes_with_its_points_through_later_steps():
    h = rough((20, 16), missing=0.1)
    done = fill(h)
    x, y = slice(3e-6, 2.5e-5), slice(0, 3e-5)
    part = crop(done, x=(x.start, x.stop), y=(y.start, y.stop))
    np.testing.assert_array_equal(part["filled"], np.isnan(h.sel(x=x, y=y)))
    for step in (part, level(done), gaussian_filter(done, 2e-5)):
        assert step.attrs["filled_points"] == int(step["filled"].sum()) > 0
    for step in (
        resample(done, (10, 8)),
        rotate90(done),
        mirror(done),
        combine(done, done),
    ):  # other cells: their number is known
        assert "filled" not in step.coords
        assert step.attrs["filled_points"] == int(done["filled"].sum())
        assert step.attrs["filled_fraction"] == float(done["filled"].mean())
    whole = rough((20, 16))
    assert combine(whole, done).attrs["filled_fraction"] == float(done["filled"].mean())
    assert "filled_fraction" not in combine(whole, whole).attrs
