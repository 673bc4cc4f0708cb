"""Generated surfaces: shapes, spectra and moments against the recipe, on any grid."""

import json
import math

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, shapes
from support import refused

from roughvisc.errors import InputError
from roughvisc.topography.recipes import cone, flat_punch, grown, self_affine, sphere, wavy

SIZE, SHAPE = (3e-3, 2e-3), (31, 24)


def spectral(h):
    """Wavevectors [1/m] and amplitudes [m] of all modes of a periodic grid, by the full complex transform."""
    steps = [float(h[axis][1] - h[axis][0]) for axis in ("x", "y")]
    q = np.meshgrid(*(2 * np.pi * np.fft.fftfreq(n, d) for n, d in zip(h.shape, steps, strict=True)), indexing="ij")
    return q[0], q[1], np.fft.fft2(h.values) / h.size


@pytest.mark.parametrize(
    "h",
    [
        sphere(1e-2, SIZE, SHAPE),
        cone(0.1, SIZE, SHAPE),
        flat_punch(5e-4, SIZE, SHAPE),
        wavy(1e-6, 1e-3, SIZE, SHAPE),
        self_affine(SIZE, SHAPE, hurst=0.8, rms_slope=0.1, seed=1),
    ],
    ids=["sphere", "cone", "flat_punch", "wavy", "self_affine"],
)
def test_recipe__gives_a_labelled_grid_at_cell_centres(h):
    assert isinstance(h, xr.DataArray)
    assert (h.name, h.dims, h.shape, h.dtype) == ("height", ("x", "y"), SHAPE, np.float64)
    np.testing.assert_allclose(h.x, (np.arange(31) + 0.5) * 3e-3 / 31, rtol=1e-14)
    np.testing.assert_allclose(h.y, (np.arange(24) + 0.5) * 2e-3 / 24, rtol=1e-14)
    assert h.attrs["units"] == h.x.attrs["units"] == h.y.attrs["units"] == "m"
    assert "axis" not in h.x.attrs
    assert json.loads(h.attrs["recipe"])["shape"] == list(SHAPE)


def test_sphere__is_the_paraboloid_about_the_centre():
    h = sphere(0.02, SIZE, SHAPE)
    r2 = (h.x - 1.5e-3) ** 2 + (h.y - 1e-3) ** 2
    np.testing.assert_allclose(h, -r2 / 0.04, rtol=1e-12)
    assert h.sel(x=1.5e-3, method="nearest").max() == pytest.approx(-((1e-3 / 24) ** 2) / 0.04)  # y: between two cells


def test_cone__has_the_slope_given():
    h = cone(0.2, 1.0, 101)
    along = h.isel(y=50)
    np.testing.assert_allclose(np.abs(along.differentiate("x").values[[10, -10]]), 0.2, rtol=1e-12)
    assert float(h.max()) == h.values[50, 50] == 0.0


def test_flat_punch__is_absent_outside_its_radius():
    h = flat_punch(0.3, (1.0, 1.2), (201, 240))
    assert h.attrs["missing"] == "absent"
    assert set(np.unique(h.values[~np.isnan(h.values)])) == {0.0}
    area = float((~np.isnan(h)).sum()) * (1.0 / 201) * (1.2 / 240)
    assert area == pytest.approx(math.pi * 0.09, rel=5e-3)


@pytest.mark.parametrize(("waves", "modes"), [(1, 2), (2, 4)])
def test_wavy__holds_the_modes_of_its_wavelength_alone(waves, modes):
    h = wavy(2e-6, 1e-3, SIZE, SHAPE, waves=waves)
    q_x, q_y, h_q = spectral(h)
    large = np.abs(h_q) > 1e-12 * 2e-6
    assert large.sum() == modes
    np.testing.assert_allclose(np.abs(h_q[large]), 2e-6 / modes, rtol=1e-12)
    np.testing.assert_allclose(np.abs(q_x[large]), 2 * np.pi / 1e-3, rtol=1e-12)
    np.testing.assert_allclose(np.abs(q_y[large]), 0 if waves == 1 else 2 * np.pi / 1e-3, rtol=1e-12)
    fine = wavy(2e-6, 1e-3, SIZE, (301, 241), waves=waves)
    assert float(fine[0, 0]) == pytest.approx(2e-6, rel=1e-2)  # a crest at the corner


@examples(25)
@given(
    shape=shapes(8, 41),
    hurst=st.floats(0.1, 1.0),
    anisotropy=st.floats(0.5, 2.0),
    seed=st.integers(0, 2**32),
)
def test_self_affine__meets_slope_and_height_exactly(shape, hurst, anisotropy, seed):
    options = {"hurst": hurst, "anisotropy": anisotropy, "seed": seed}
    h = self_affine(SIZE, shape, rms_height=3e-7, **options)
    assert float(np.sqrt((h**2).mean())) == pytest.approx(3e-7, rel=1e-10)
    assert abs(float(h.mean())) < 1e-20
    h = self_affine(SIZE, shape, rms_slope=0.1, **options)
    q_x, q_y, h_q = spectral(h)
    assert np.sqrt(((q_x**2 + q_y**2) * np.abs(h_q) ** 2).sum()) == pytest.approx(0.1, rel=1e-10)


def test_self_affine__spectrum_follows_the_power_law_between_rolloff_and_shortcut():
    rolloff, shortcut, hurst = 8e-4, 2.2e-4, 0.7
    h = self_affine(SIZE, (63, 48), hurst=hurst, rms_slope=0.1, rolloff=rolloff, shortcut=shortcut, seed=3)
    q_x, q_y, h_q = spectral(h)
    q, power = np.hypot(q_x, q_y), np.abs(h_q) ** 2
    law = np.maximum(q, 2 * np.pi / rolloff) ** (-2 - 2 * hurst) * (q > 0) * (q < 2 * np.pi / shortcut)
    np.testing.assert_allclose(power / power.max(), law / law.max(), atol=1e-12)
    assert ((law > 0) & (q < 2 * np.pi / rolloff)).sum() > 4
    assert (law > 0).sum() > 50


def test_self_affine__phases_are_random_and_the_seed_decides():
    first, again, other = (self_affine(1.0, (45, 32), hurst=0.5, rms_slope=1.0, seed=seed) for seed in (5, 5, 6))
    assert first.equals(again)
    assert abs(float(xr.corr(first, other))) < 0.6
    phases = np.angle(np.fft.rfft2(first.values)[1:20, 1:10])
    assert abs(np.exp(1j * phases).mean()) < 0.25


def waves_of(h):
    """Waves of a periodic grid by their whole numbers (k_x, k_y >= 0), about the corner of the domain. [m]

    Row and column of the transform are found one by one, and half a cell is taken off the place of the centres.
    """
    h_q, found = np.fft.fft2(h.values) / h.size, {}
    for k_x in range(-(h.shape[0] - 1) // 2 + 1, (h.shape[0] + 1) // 2):
        for k_y in range((h.shape[1] + 1) // 2):
            found[k_x, k_y] = h_q[k_x, k_y] * np.exp(-1j * np.pi * (k_x / h.shape[0] + k_y / h.shape[1]))
    return found


SPECTRA = {
    "isotropic": {"hurst": 0.7, "rolloff": 1e-3, "rms_slope": 0.1},
    "gaussian, along x": {"hurst": 0.4, "rms_height": 1e-6, "anisotropy": 2.0, "amplitudes": "gaussian"},
}


@pytest.mark.parametrize("spectrum", SPECTRA.values(), ids=SPECTRA)
@examples(12)
@given(coarse=shapes(14, 27), fine=shapes(14, 41), seed=st.integers(0, 2**32))
def test_self_affine__a_seed_is_one_surface_on_every_grid_that_holds_its_waves(spectrum, coarse, fine, seed):
    cut = {"shortcut": 6e-4, "seed": seed, **spectrum}
    few, many = (waves_of(self_affine(SIZE, shape, **cut)) for shape in (coarse, fine))
    largest = max(map(abs, few.values()))
    held = few.keys() & many.keys()
    assert max(abs(few[k] - many[k]) for k in held) < 1e-12 * largest
    assert all(abs(both[k]) < 1e-12 * largest for both in (few, many) for k in both.keys() - held)
    # three cells for one: the one in the middle is at the same place
    h, third = (self_affine(SIZE, shape, **cut) for shape in (coarse, [3 * n for n in coarse]))
    np.testing.assert_allclose(third[1::3, 1::3], h, rtol=0, atol=1e-11 * float(abs(h).max()))


def test_self_affine__gaussian_amplitudes_scatter_as_those_of_a_random_field():
    """Moments of an exponential distribution for the power of each wave, and the phases of the fixed amplitudes."""
    made = {"hurst": 0.8, "rms_height": 2e-6, "rolloff": 8e-4, "shortcut": 4e-4}
    fixed = np.fft.rfft2(self_affine(SIZE, (19, 16), **made, seed=7).values)
    random = [self_affine(SIZE, (19, 16), **made, amplitudes="gaussian", seed=seed) for seed in range(200)]
    here = np.abs(fixed) > 3e-5 * np.abs(fixed).max()
    modes = np.array([np.fft.rfft2(h.values)[here] for h in random])
    ratio = np.abs(modes / fixed[here]) ** 2
    assert ratio.mean() == pytest.approx(1, abs=5 / np.sqrt(ratio.size))
    assert (ratio**2).mean() == pytest.approx(2, abs=5 * np.sqrt(20 / ratio.size))
    assert np.median(np.abs(np.corrcoef(ratio, rowvar=False))) < 0.1, "waves are independent"
    np.testing.assert_allclose(modes[7] / np.abs(modes[7]), fixed[here] / np.abs(fixed[here]), atol=1e-9)


def test_self_affine__anisotropy_stretches_the_texture_along_x():
    h = self_affine(1.0, (96, 85), hurst=0.8, rms_height=1.0, rolloff=0.2, anisotropy=4.0, seed=2)
    q_x, q_y, h_q = spectral(h)
    slopes = [np.sqrt((q**2 * np.abs(h_q) ** 2).sum()) for q in (q_x, q_y)]
    assert slopes[1] / slopes[0] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(
    "h",
    [
        sphere(1e-2, SIZE, SHAPE),
        cone(0.1, SIZE, SHAPE),
        flat_punch(5e-4, SIZE, SHAPE),
    ],
)
@pytest.mark.parametrize("factor", [1.001, 1.5, 3])
def test_grown__keeps_the_cells_that_exist_and_adds_the_same_profile(h, factor):
    larger = grown(h, factor)
    assert all(big >= factor * small for big, small in zip(larger.shape, h.shape, strict=True))
    inner = larger.sel(x=h.x, y=h.y)
    xr.testing.assert_identical(inner.drop_attrs(), h.drop_attrs())
    np.testing.assert_allclose(np.diff(larger.x), 3e-3 / 31, rtol=1e-9)
    mirrored = larger.values[::-1, ::-1]  # still about the same centre
    np.testing.assert_allclose(larger.values, mirrored, rtol=1e-9, atol=1e-18)
    assert all(2 * old <= new < 2 * old + 4 for new, old in zip(grown(larger, 2).shape, larger.shape, strict=True))


@pytest.mark.parametrize(
    "changed",
    [
        lambda h: -h,
        lambda h: h + 1e-9,
        lambda h: h.where(h.x > 1e-4),
        lambda h: h.assign_coords(x=h.x + 1e-3),
        lambda h: h.assign_coords(x=h.x * 2),
        lambda h: h.assign_attrs(recipe="{"),
        lambda h: h.assign_attrs(recipe='{"name": "sphere", "parameters": {}, "size": [1, 1], "shape": [0, 0]}'),
        lambda h: h.assign_attrs(recipe='{"name": "wavy"}'),
        lambda h: h.drop_attrs(),
    ],
)
def test_grown__gives_none_where_the_recipe_does_not_reproduce_the_heights(changed):
    h = sphere(1e-2, SIZE, SHAPE)
    assert grown(h) is not None
    with xr.set_options(keep_attrs=True):
        assert grown(changed(h)) is None


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: sphere(0.0, 1.0, 5), "radius"),
        (lambda: sphere("1 s", 1.0, 5), "radius"),
        (lambda: sphere(1.0, (1.0, math.nan), 5), "size"),
        (lambda: sphere(1.0, (1.0, 1.0, 1.0), 5), "size"),
        (lambda: sphere(1.0, 1.0, 5.0), "shape"),
        (lambda: sphere(1.0, 1.0, (5, 0)), "shape"),
        (lambda: cone(-0.1, 1.0, 5), "slope"),
        (lambda: flat_punch(0.01, 1.0, 4), "radius"),
        (lambda: wavy(1.0, 0.3, 1.0, 9), "size"),
        (lambda: wavy(1.0, 0.5, 1.0, 9, waves=3), "waves"),
        (lambda: self_affine(1.0, 9, hurst=0.5, seed=0), "rms_slope"),
        (lambda: self_affine(1.0, 9, hurst=1.5, rms_slope=1.0, seed=0), "hurst"),
        (lambda: self_affine(1.0, 9, hurst=0.5, rms_slope=1.0, shortcut=0.1, seed=0), "shortcut"),
        (lambda: self_affine(1.0, 9, hurst=0.5, rms_slope=1.0, rolloff=0.1, seed=0), "rolloff"),
        (lambda: self_affine(1.0, 9, hurst=0.5, rms_slope=1.0, shortcut=2.0, seed=0), "shortcut"),
        (lambda: self_affine(1.0, 9, hurst=0.5, rms_slope=1.0, seed="x"), "seed"),
        (lambda: self_affine(1.0, 9, hurst=0.5, rms_slope=1.0, amplitudes="x", seed=0), "amplitudes"),
    ],
)
def test_recipe__refuses_and_names_the_parameter(call, named):
    with pytest.raises(InputError, match=named):
        call()


def test_strip__of_one_cell_begins_at_zero():
    h = wavy(1e-6, 1e-3, (3e-3, 1e-4), (257, 1), waves=1)
    assert h.shape == (257, 1)
    assert float(h.y[0]) == pytest.approx(5e-5)
    np.testing.assert_allclose(h[:, 0], 1e-6 * np.cos(2 * np.pi * h.x / 1e-3), atol=1e-18)
    for indenter, value in ((sphere, 1e-2), (cone, 0.1)):
        strip, along_y = indenter(value, (1e-3, 1e-5), (33, 1)), indenter(value, (1e-5, 1e-3), (1, 33))
        np.testing.assert_allclose(strip[:, 0], strip[::-1, 0], rtol=1e-12)
        np.testing.assert_allclose(along_y.values.T, strip.values, rtol=1e-12, atol=1e-18)
        assert float(strip.max()) == pytest.approx(0, abs=1e-18)  # the middle cell is at the apex
        assert grown(strip).sizes["x"] == grown(along_y).sizes["y"] > 33
    assert flat_punch(1e-4, (1e-5, 1e-3), (1, 33)).shape == (1, 33)
    with refused("shape", (33, 1)):
        self_affine(1e-3, (33, 1), hurst=0.8, rms_slope=0.1, seed=0)
