"""Big maps by blocks of rows: what comes of a map does not depend on how it is cut."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from strategies import examples

import roughvisc as rv
from roughvisc.topography import blocks, borders, bridging, inspection, missing_points, parameters, writers

#: Heights of a map with missing points, some of them alike.
maps = arrays(
    float,
    st.tuples(st.integers(1, 9), st.integers(1, 9)),
    elements=st.one_of(st.floats(-1e3, 1e3), st.sampled_from([0.0, 1.0, np.nan])),
)


@pytest.fixture
def few_rows(monkeypatch):
    """Blocks of two or three rows."""
    monkeypatch.setattr(blocks, "BLOCK", 8 * 29 * 3)


def scan(periodic=False, missing=True):
    """A tilted rough scan with a spike, holes and a missing corner, of unequal odd sides."""
    h = rv.self_affine((37e-6, 29e-6), (37, 29), hurst=0.7, rms_slope=0.3, seed=4)
    if not periodic:
        h = h + 0.2 * h.x - 0.1 * h.y
    h.attrs["units"] = "m"
    h.values[20, 11] += 5e-4
    if missing:
        h.values[4:9, 3:6] = h.values[15:24, 20] = h.values[:2, :2] = h.values[30, ::5] = np.nan
    return h


@given(maps, st.integers(1, 200))
def test_blocks__numbers_of_a_map_are_those_of_numpy(values, most):
    known = values[np.isfinite(values)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "BLOCK", most)
        assert sum(rows.stop - rows.start for rows in blocks.row_blocks(values.shape)) == len(values)
        assert blocks.count_of(values) == known.size
        if not known.size:
            assert np.isnan([blocks.mean_of(values), blocks.deviation_of(values), *blocks.extremes_of(values)]).all()
            return
        spread = max(1e-300, np.abs(known).max())
        assert blocks.mean_of(values) == pytest.approx(known.mean(), abs=1e-13 * spread)
        assert blocks.deviation_of(values) == pytest.approx(known.std(), abs=1e-13 * spread)
        assert blocks.extremes_of(values) == (known.min(), known.max())
        assert blocks.order_statistics(values, range(known.size)) == sorted(known)
        assert blocks.median_of(values) == np.median(known)
        shares = [0, 12.5, 50, 99.8, 100]
        assert blocks.percentiles_of(values, shares) == pytest.approx(np.percentile(known, shares), rel=1e-12)


@pytest.mark.parametrize(
    "step",
    [
        rv.level,
        lambda h: rv.level(h, 3),
        rv.mask_outliers,
        rv.fill,
        lambda h: rv.fill(h, "nearest"),
        lambda h: rv.fill(h, "linear"),
        lambda h: rv.gaussian_filter(h, 5e-6),
        lambda h: rv.gaussian_filter(h.fillna(0), 5e-6, keep="short"),
        lambda h: rv.gaussian_filter(h.fillna(0), 5e-6, periodic=True),
        lambda h: rv.resample(h, (11, 50)),
        lambda h: rv.resample(rv.fill(h), 23),
        rv.mirror,
    ],
)
def test_conditioning__in_blocks_is_that_in_one_go(step, monkeypatch):
    h = scan()
    whole = step(h)
    monkeypatch.setattr(blocks, "BLOCK", 8 * 29 * 3)
    monkeypatch.setattr(bridging, "_AT_ONCE", 5)
    monkeypatch.setattr(missing_points, "_AT_ONCE", 81 * 29 * 3)
    cut = step(h)
    np.testing.assert_allclose(cut.values, whole.values, rtol=0, atol=1e-12 * np.nanmax(np.abs(h.values)))
    assert cut.attrs == whole.attrs
    if "filled" in whole.coords:
        np.testing.assert_array_equal(cut["filled"], whole["filled"])
    xr.testing.assert_identical(h, scan())


@pytest.mark.parametrize("periodic", [False, True])
def test_numbers_of_a_scan__in_blocks_are_those_in_one_go(periodic, few_rows):
    h = scan(periodic)
    cut = rv.parameters(h, periodic=periodic), rv.psd(h.fillna(0), "hann"), borders.border_mismatch(h)
    slope = parameters.rms_slope(h, periodic, depth=4e-6)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "BLOCK", 1 << 20)
        xr.testing.assert_allclose(cut[0], rv.parameters(h, periodic=periodic), rtol=1e-12)
        xr.testing.assert_allclose(cut[1], rv.psd(h.fillna(0), "hann"), rtol=1e-9)
        whole = borders.border_mismatch(h)
        assert slope == pytest.approx(parameters.rms_slope(h, periodic, depth=4e-6), rel=1e-12)
    assert (*cut[2].of_rms, *cut[2].of_neighbours) == pytest.approx((*whole.of_rms, *whole.of_neighbours))


def test_psd__is_that_of_a_transform_of_the_whole():
    h = scan(missing=False)
    weights = np.outer(*(np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 for n in h.shape))
    z = (h.values - h.values.mean()) * weights / np.sqrt((weights**2).mean())
    found = rv.psd(h, "hann")
    whole = (np.abs(np.fft.fft2(z)) ** 2).ravel()[1:].sum() / h.size**2
    assert float((found.psd * found.modes).sum()) / found.attrs["area"] == pytest.approx(whole, rel=1e-12)


def test_inspection__in_blocks_sees_the_same(few_rows, monkeypatch):
    h = scan()
    monkeypatch.setattr(inspection, "BLOCK", 8 * 29 * 12)
    cut = inspection.inspect_scan(h)
    monkeypatch.setattr(blocks, "BLOCK", 1 << 20)
    monkeypatch.setattr(inspection, "BLOCK", 1 << 20)
    whole = inspection.inspect_scan(h)
    assert cut.steps == whole.steps
    assert "fill" in cut.steps
    for name in ("points", "missing", "spikes", "holes", "shape"):
        assert getattr(cut, name) == getattr(whole, name)
    for name in ("rms_raw", "rms_levelled", "rms_despiked", "rms_flat", "rms_slope", "tilt"):
        assert getattr(cut, name) == pytest.approx(getattr(whole, name), rel=1e-6), name
    assert whole.tilt == pytest.approx((0.2, -0.1), abs=0.05)


def test_harmonic__is_flat_over_a_plane_and_holes_do_not_know_of_each_other(monkeypatch):
    x, y = np.meshgrid(np.arange(12.0), np.arange(9.0), indexing="ij")
    plane = 3 + 2 * x - y
    holed = plane.copy()
    for place in (np.s_[2:5, 2:4], np.s_[8, 6], np.s_[7, 5], np.s_[5:7, 5:8]):
        holed[place] = np.nan
    for most in (1, 4, 1000):
        monkeypatch.setattr(bridging, "_AT_ONCE", most)
        missing = np.isnan(holed)
        np.testing.assert_allclose(bridging.harmonic(holed, missing), plane[missing], rtol=1e-13)


@examples(20)
@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
def test_harmonic__is_that_of_surface_topography(seed, most):
    topography = pytest.importorskip("SurfaceTopography")
    random = np.random.default_rng(seed)
    heights = random.standard_normal((9, 8))
    missing = random.random(heights.shape) < 0.4
    missing[0, 0] = False
    heights[missing] = np.nan
    masked = np.ma.masked_invalid(heights)
    expected = topography.Topography(masked, heights.shape).interpolate_undefined_data().heights()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bridging, "_AT_ONCE", most)
        found = bridging.harmonic(heights, missing)
    np.testing.assert_allclose(found, np.asarray(expected)[missing], rtol=0, atol=1e-12)


@pytest.mark.parametrize("suffix", [".nc", ".sdf"])
def test_save_scan__in_blocks_is_read_back_in_blocks(tmp_path, few_rows, monkeypatch, suffix):
    monkeypatch.setattr(writers, "BLOCK", 0)
    monkeypatch.setattr(writers, "_CHUNK", 8)
    h = rv.fill(scan())
    h.values[3, 4] = np.nan
    rv.save_scan(h, tmp_path / f"scan{suffix}")
    found = rv.open_scan(tmp_path / f"scan{suffix}")
    np.testing.assert_array_equal(found.values, h.values)
    if suffix == ".nc":
        np.testing.assert_array_equal(found["filled"], h["filled"])
        with xr.open_dataset(tmp_path / "scan.nc") as stored:
            assert stored["height"].encoding["chunksizes"] == (8, 8)
