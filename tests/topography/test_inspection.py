"""What is seen in a scan: planted spikes, holes, noise, tilt, form and borders are found by their numbers."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.topography.conditioning import condition
from roughvisc.topography.inspection import inspection_of
from roughvisc.topography.readers import from_array

SMOOTH = rv.self_affine((96e-6, 80e-6), (96, 80), hurst=0.8, rms_height=1e-7, rolloff=4e-5, shortcut=1.2e-5, seed=3)


def with_values(values):
    return from_array(values, 1e-6)


def test_spikes__are_counted_and_what_they_do_to_sq():
    values = SMOOTH.values.copy()
    places = [(5, 7), (50, 60), (80, 12)]
    for place in places:
        values[place] += 5e-6
    found = inspection_of(with_values(values))
    spikes = found.findings["Spikes"].values
    assert spikes["points"] == len(places)
    assert found.steps["outliers"] is True
    assert spikes["rms_with"] == pytest.approx(float(rv.level(with_values(values)).std()), rel=1e-12)
    assert spikes["rms_with"] > 1.3 * spikes["rms_without"]
    plane = rv.level(SMOOTH)
    assert spikes["rms_without"] == pytest.approx(float(plane.std()), rel=1e-3)
    assert inspection_of(SMOOTH).findings["Spikes"].values["points"] == 0
    for count, is_few in ((140, True), (240, False)):  # of 7,680 points; more than 2 % may be the surface itself
        values = SMOOTH.values.copy()
        values.flat[7 : 31 * count + 7 : 31] += 5e-6
        found = inspection_of(with_values(values))
        assert found.findings["Spikes"].values["points"] == count
        assert ("outliers" in found.steps) == is_few


def test_tilt__and_form_by_their_coefficients():
    x, y = np.meshgrid(SMOOTH.x.values, SMOOTH.y.values, indexing="ij")
    tilted = inspection_of(with_values(SMOOTH.values + 0.02 * x - 0.03 * y))
    both = inspection_of(SMOOTH)
    (x_tilt, y_tilt), slopes = (one.findings["Tilt and form"].values["slopes"] for one in (both, tilted))
    np.testing.assert_allclose(slopes, (0.02 + x_tilt, -0.03 + y_tilt), rtol=1e-9)
    assert tilted.steps["level"] == 1
    assert "level" not in inspection_of(rv.level(SMOOTH)).steps
    flat, plane = rv.level(SMOOTH).values, x - x.mean()
    for share, is_tilted in ((0.005, False), (0.05, True)):  # of the rms height
        steps = inspection_of(with_values(flat + share * flat.std() / plane.std() * plane)).steps
        assert ("level" in steps) == is_tilted
    ball = (x - x.mean()) ** 2 / (2 * 1e-3)
    curved = inspection_of(with_values(SMOOTH.values + ball))
    assert curved.steps["level"] == 2
    form = curved.findings["Tilt and form"].values
    assert form["share"] > 0.9
    rms = [float(rv.level(with_values(SMOOTH.values + ball), order).std()) for order in (1, 2)]
    assert form["share"] == pytest.approx(1 - (rms[1] / rms[0]) ** 2, rel=1e-9)
    assert form["rms_without"] == pytest.approx(float(rv.level(SMOOTH, 2).std()), rel=1e-9)


def test_boundary__is_mirror_where_opposite_borders_differ():
    part = with_values(SMOOTH.values[:50, :41])
    found = inspection_of(part)
    assert found.boundary == "mirror"
    assert inspection_of(SMOOTH).boundary == "periodic"
    assert found.area == pytest.approx(50e-6 * 41e-6)


@pytest.mark.parametrize(
    ("shape", "cells"),
    [((96, 80), (1e-6, 1e-6)), ((97, 61), (1e-3, 1e-3)), ((320, 80), (1e-6, 4e-6)), ((80, 321), (4e-9, 1e-9))],
)
def test_noise__of_known_strength_is_found(shape, cells):
    longest, unit = max(cells), min(cells)
    size = [n * side for n, side in zip(shape, cells, strict=True)]
    shortest = 12 * longest
    waves = {"hurst": 0.8, "rms_height": 0.1 * unit, "rolloff": 40 * longest, "shortcut": shortest, "seed": 3}
    smooth = rv.self_affine(size, shape, **waves)
    noisy = smooth.values + np.random.default_rng(5).normal(0, 2e-3 * unit, shape)
    found = inspection_of(from_array(noisy, cells))
    noise = found.findings["Noise"].values
    assert noise["floor"]
    assert noise["rms"] == pytest.approx(2e-3 * unit, rel=0.1)
    assert noise["wavelength"] == pytest.approx(shortest, rel=0.25)  # the surface has no shorter waves
    assert found.steps["filter"] == pytest.approx(noise["wavelength"], rel=0.05)
    slope = float(rv.parameters(smooth).Sdq)
    assert found.rms_slope == pytest.approx(slope, rel=0.2)  # and a little of the surface
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(shape[0], cells[0])[:, None], np.fft.fftfreq(shape[1], cells[1]))
    noisy_slopes = (2e-3 * unit * q[(q > 2 * np.pi / shortest) & (q < np.pi / unit)]) ** 2
    share = noisy_slopes.sum() / q.size
    assert noise["noisy_slopes"] == pytest.approx(share / (share + slope**2), rel=0.4)  # under a window


def test_noise__is_not_seen_where_the_spectrum_falls_all_the_way():
    steep = rv.self_affine((96e-6, 80e-6), (96, 80), hurst=0.8, rms_height=1e-7, rolloff=4e-5, seed=3)
    found = inspection_of(steep)
    noise = found.findings["Noise"].values
    assert not noise["floor"]
    assert "filter" not in found.steps


@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize("cells", [(1e-6, 1e-6), (1e-6, 4e-6)])
def test_missing_points__are_filled_and_large_holes_cropped_away(transposed, cells):
    """Advice, steps and card agree; spikes and stray points next to the missing ones are found too."""
    values = SMOOTH.values.copy()
    values[70:, :] = np.nan
    values[:30, 60:] = np.nan
    values[90, 10:80:6] = 9e-6  # stray points in the hole
    few = [(10, 10), (30, 40)]
    for place in few:
        values[place] = np.nan
    spikes = [(10, 11), (50, 20)]
    for place in spikes:
        values[place] += 5e-6
    values, cells = (values.T, cells[::-1]) if transposed else (values, cells)
    scan = from_array(values, cells)
    scan = scan.assign_coords(x=scan.x + 3e-3, y=scan.y - 7e-3)  # a part of a larger map
    found = inspection_of(scan)
    missing = found.findings["Missing points"]
    assert missing.values["points"] == int(np.isnan(values).sum())
    assert "holes" in missing.seen
    assert "crop" in missing.advice
    assert found.findings["Spikes"].values["points"] == len(spikes)
    treated = condition(scan, found.steps)
    assert treated.shape == ((60, 70) if transposed else (70, 60)), "larger than the other part of 40 x 80 points"
    assert int(treated.filled.sum()) == len(few) + len(spikes)
    assert found.area == pytest.approx(treated.size * cells[0] * cells[1])
    assert float(np.abs(treated).max()) < 1e-6, "neither spikes nor stray points are left"


def test_missing_points__without_a_part_free_of_holes_are_filled():
    values = SMOOTH.values.copy()
    i, j = np.indices(values.shape)
    values[(np.abs(i % 24 - 12) < 7) & (np.abs(j % 24 - 12) < 7)] = np.nan
    wide = np.tile(values, (3, 3))
    wide[:18, :18] = SMOOTH.values[:18, :18]  # a part without holes, less than a tenth of the scan
    for holed in (values, wide):
        found = inspection_of(with_values(holed))
        assert found.steps["fill"] is True
        assert "crop" not in found.steps
        assert "crop" not in found.findings["Missing points"].advice
    values = SMOOTH.values.copy()
    values[10, 10] = values[30, 40] = np.nan
    few = inspection_of(with_values(values)).findings["Missing points"]
    assert few.values["points"] == 2
    assert "holes" not in few.seen
    assert few.step == {"fill": True}


@pytest.mark.parametrize(("factor", "is_doubtful"), [(1e-3, True), (1, False), (1e3, True)])
def test_slope__of_heights_in_a_wrong_unit_is_doubtful(factor, is_doubtful):
    slope = inspection_of(with_values(SMOOTH.values * factor)).findings["Slope"]
    assert bool(slope.advice) == is_doubtful
    assert slope.values["rms_slope"] == pytest.approx(factor * float(rv.parameters(SMOOTH).Sdq), rel=0.01)


@pytest.mark.parametrize(("share", "off"), [(0.004, 0.1), (0.1, 0.35)])
def test_noise__between_missing_points_is_found_and_overestimated_a_little(share, off):
    noisy = SMOOTH.values + np.random.default_rng(5).normal(0, 2e-9, SMOOTH.shape)
    gaps = np.random.default_rng(3).random(SMOOTH.shape) < share
    found = inspection_of(with_values(np.where(gaps, np.nan, noisy))).findings["Noise"].values
    assert found["floor"]
    assert 0.95 * 2e-9 < found["rms"] < (1 + off) * 2e-9
    none = inspection_of(with_values(np.where(gaps, np.nan, SMOOTH.values))).findings["Noise"].values
    assert not none["floor"], "with as many gaps again the floor of filled points grows"


@pytest.mark.parametrize("values", [np.zeros((20, 20)), SMOOTH.values[:15, :40]], ids=["flat", "few points"])
def test_noise__is_not_measured_on_a_flat_or_small_scan(values):
    found = inspection_of(with_values(values))
    assert found.findings["Noise"].values == {}
    assert "filter" not in found.steps
