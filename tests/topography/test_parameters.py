"""Parameters of a surface: closed forms of waves, convergence of differences, missing points."""

import numpy as np
import pytest
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.filters import off_plane
from roughvisc.topography.grid import labelled, rms_slope, spacing
from roughvisc.topography.parameters import PARAMETERS, parameters
from roughvisc.topography.readers import from_array
from roughvisc.topography.recipes import self_affine, surrogates, wavy
from roughvisc.topography.spectrum import psd

SIZE, SHAPE = (3e-4, 2e-4), (61, 48)
ROUGH = self_affine(SIZE, SHAPE, hurst=0.8, rms_slope=0.2, rolloff=1e-4, shortcut=2e-5, seed=4)


def theirs(h, periodic):
    """The same surface in SurfaceTopography."""
    topography = pytest.importorskip("SurfaceTopography").Topography
    size = tuple(n * d for n, d in zip(h.shape, spacing(h), strict=True))
    return topography(np.ma.masked_invalid(h.values), size, periodic=periodic)


def mirror_images(h):
    """The surface and its images, each read from another corner, on the same coordinates."""
    return [h.copy(data=h.values[::i, ::j]) for i in (1, -1) for j in (1, -1)]


@pytest.mark.parametrize("waves", [1, 2])
def test_parameters__of_waves_are_the_closed_forms(waves):
    amplitude, wavelength = 2e-6, 1e-4
    q = 2 * np.pi / wavelength
    h = wavy(amplitude, wavelength, SIZE, (601, 400), waves=waves)
    found = parameters(h, periodic=True)
    assert float(found["Sq"]) == pytest.approx(amplitude / np.sqrt(2) ** waves, rel=1e-10)
    assert float(found["Sa"]) == pytest.approx(amplitude * (2 / np.pi) ** waves, rel=1e-3)
    assert float(found["Sku"]) == pytest.approx(1.5**waves, rel=1e-10)
    assert abs(float(found["Ssk"])) < 1e-10
    assert float(found["Sz"]) == pytest.approx(2 * amplitude, rel=1e-3)
    slope = amplitude * q / np.sqrt(2)
    assert float(found["Sdq"]) == pytest.approx(slope, rel=1e-3)
    assert float(found["Sdr"]) == pytest.approx(slope**2 / 2, rel=0.01)  # small slopes


def test_rms_slope__of_what_is_near_the_highest_point():
    """A roof of slope 0.1 on walls of slope 2, at the top of a plane."""
    x = np.arange(40) * 1.0
    ridge = labelled(np.repeat(np.where(x <= 30, 0.1 * x, 3 - 2 * (x - 30))[:, None], 5, 1), (1.0, 1.0))
    assert rms_slope(ridge) == pytest.approx(np.sqrt((30 * 0.01 + 9 * 4) / 39), rel=1e-12)
    assert rms_slope(ridge, depth=1.05) == pytest.approx(np.sqrt((11 * 0.01 + 4) / 12), rel=1e-12)
    assert np.isnan(rms_slope(ridge.where(ridge.x < 1)[:1, :1] * np.nan))


@pytest.mark.parametrize("periodic", [False, True])
def test_parameters__agree_with_surface_topography(periodic):
    """They take one corner of each square of four points; the mean over the mirror images takes all four corners."""
    found, their = parameters(ROUGH, periodic=periodic), theirs(ROUGH, periodic)
    assert float(found["Sq"]) == pytest.approx(their.Sq(), rel=1e-12)
    slopes = [theirs(image, periodic).rms_gradient() for image in mirror_images(ROUGH)]
    assert float(found["Sdq"]) == pytest.approx(np.sqrt(np.mean(np.square(slopes))), rel=1e-12)


def test_parameters__leave_missing_points_out():
    h = ROUGH.where(np.random.default_rng(0).random(SHAPE) > 0.1)
    found, z = parameters(h), h.values[np.isfinite(h.values)]
    assert float(found["Sq"]) == pytest.approx(z.std(), rel=1e-12)
    assert float(found["missing_fraction"]) == pytest.approx(1 - z.size / h.size)
    assert float(found["Sq"]) == pytest.approx(theirs(h, False).Sq(), rel=1e-12)
    slopes = []
    for i, j in np.ndindex(SHAPE):
        for k, m in ((i - 1, j - 1), (i - 1, j + 1), (i + 1, j - 1), (i + 1, j + 1)):
            if 0 <= k < SHAPE[0] and 0 <= m < SHAPE[1]:
                a, b, c = h.values[i, j], h.values[k, j], h.values[i, m]
                slopes.append(((b - a) / (SIZE[0] / 61)) ** 2 + ((c - a) / (SIZE[1] / 48)) ** 2)
    slopes = [slope for slope in slopes if np.isfinite(slope)]
    assert float(found["Sdq"]) == pytest.approx(np.sqrt(np.mean(slopes)), rel=1e-10)
    assert float(found["Sdr"]) == pytest.approx(np.mean(np.sqrt(1 + np.array(slopes)) - 1), rel=1e-6)
    checkerboard = h.where((np.arange(61)[:, None] + np.arange(48)) % 2 == 0)
    assert np.isnan(parameters(checkerboard)["Sdq"])
    with pytest.raises(InputError, match="all 2928 points are missing"):
        parameters(h * np.nan)


def test_parameters__are_the_same_from_any_side_in_nanometres_and_at_a_large_offset():
    holed = ROUGH.where(np.random.default_rng(0).random(SHAPE) > 0.1)
    holed[-1, -1] = 1e-4  # a spike in the last corner
    for h in (*mirror_images(holed), holed.transpose("y", "x").rename(x="y", y="x")):
        for name, value in parameters(h).items():
            assert float(value) == pytest.approx(float(parameters(holed)[name]), rel=1e-12), name
    small = (ROUGH * 1e-3).assign_coords(x=ROUGH.x * 1e-3, y=ROUGH.y * 1e-3)
    found, tiny, lifted = parameters(ROUGH), parameters(small), parameters(ROUGH + 7e-2)
    for name in found:
        scale = {"m": 1e-3, "1/m": 1e3}.get(found[name].attrs["units"], 1)
        assert float(tiny[name]) == pytest.approx(scale * float(found[name]), rel=1e-9), name
        assert float(lifted[name]) == pytest.approx(float(found[name]), rel=1e-6), name


@pytest.mark.parametrize("shape", [(61, 48), (48, 61), (2, 9), (30, 2)])
def test_psd__sums_to_the_variance(shape):
    h = from_array(np.random.default_rng(1).normal(size=shape), (2e-6, 3e-6))
    spectrum = psd(h)
    total = float((spectrum["psd"] * spectrum["modes"]).sum()) / spectrum.attrs["area"]
    assert total == pytest.approx(float(h.var()), rel=1e-12)
    assert int(spectrum["modes"].sum()) == h.size - 1
    assert (np.diff(spectrum["wavevector"]) > 0).all()
    assert spectrum.attrs["area"] == pytest.approx(h.size * 6e-12)


@pytest.mark.parametrize(
    ("shape", "sides"), [((64, 64), (1, 4)), ((40, 40), (4, 1)), ((64, 32), (1, 1)), ((33, 2), (1, 3))]
)
def test_psd__and_surrogates_are_the_same_in_any_unit_and_on_the_transpose(shape, sides):
    """With sides 1 : 2 and 1 : 4 many wavevectors lie on the border of two rings."""
    heights = np.random.default_rng(0).normal(0, 1e-7, shape)
    for unit in (1e-6, 1.5e-6, 2e-6, 3e-6):
        h, turned = from_array(heights, np.multiply(unit, sides)), from_array(heights.T, np.multiply(unit, sides[::-1]))
        found, first = psd(h), psd(from_array(heights, np.multiply(1e-3, sides)))
        np.testing.assert_array_equal(found["modes"], first["modes"])
        np.testing.assert_allclose(found["wavevector"] * unit, first["wavevector"] * 1e-3, rtol=1e-12)
        np.testing.assert_allclose(found["psd"] / unit**2, first["psd"] / 1e-3**2, rtol=1e-12)
        np.testing.assert_allclose(psd(turned)["psd"], found["psd"], rtol=1e-12)
        same = [surrogates(from_array(heights, np.multiply(one, sides)), 1, seed=1) for one in (unit, 1e-3)]
        np.testing.assert_allclose(*same, rtol=0, atol=1e-12 * float(np.std(heights)))


def test_psd__window_keeps_the_level_of_noise_and_stops_leakage():
    noise = from_array(np.random.default_rng(1).normal(size=(128, 125)), 1e-6)
    variances = [float((s["psd"] * s["modes"])[5:].sum()) for s in (psd(noise, "hann"), psd(noise))]
    assert variances[0] / variances[1] == pytest.approx(1, abs=0.05)
    tilted = ROUGH * 0 + xr.DataArray(np.sin(2 * np.pi * 2.5 * ROUGH.x / SIZE[0]), dims="x")
    far = {"wavevector": slice(4e5, None)}
    assert float(psd(tilted, "hann")["psd"].sel(far).max()) < 1e-2 * float(psd(tilted)["psd"].sel(far).max())


@pytest.mark.parametrize("along", ["x", "y"])
def test_strip__is_uniform_across(along):
    """A strip, one cell wide, has the numbers of the same profile drawn out in the other direction."""
    values, cell = 1e-6 * np.random.default_rng(3).normal(size=(61, 1)), (5e-6, 4e-6)
    wave = wavy(1e-6, 1e-4, (3e-4, 5e-6), (61, 1), waves=1)
    profile, wide = labelled(values, cell), labelled(np.tile(values, 7), cell)
    if along == "y":
        profile, wide, wave = (labelled(h.values.T, spacing(h)[::-1]) for h in (profile, wide, wave))
    for periodic in (False, True):
        found, wanted = parameters(profile, periodic), parameters(wide, periodic)
        for name in PARAMETERS:
            np.testing.assert_allclose(found[name], wanted[name], rtol=1e-9, atol=1e-20, err_msg=name)
    spectrum = psd(wave)
    assert spectrum.area == pytest.approx(3e-4 * 5e-6)
    ring = spectrum.sel(wavevector=2 * np.pi / 1e-4, method="nearest")
    assert float(ring["psd"] * ring["modes"]) == pytest.approx(2 * 1e-12 / 4 * spectrum.area, rel=1e-10)
    assert float((spectrum["psd"] * spectrum["modes"]).sum() / spectrum.area) == pytest.approx(0.5e-12, rel=1e-9)


def test_lone_cell__has_no_wave_and_no_slope():
    alone = labelled([[1e-6]], (2e-6, 3e-6))
    assert spacing(alone) == (2e-6, 3e-6)
    assert float(parameters(alone, periodic=True)["Sq"]) == 0
    assert psd(alone).sizes["wavevector"] == 0


def test_off_plane__subtracts_the_mean_where_points_determine_no_plane():
    line = from_array(np.outer([1.0, np.nan, np.nan], np.arange(8.0)) * 1e-6, spacing=1e-5)
    assert float(parameters(off_plane(line)).Sq) == pytest.approx(np.arange(8).std() * 1e-6, rel=1e-12)
