"""Self-affine parameters read off a scan."""

import math
from pathlib import Path

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.topography.fitting import fit_self_affine
from roughvisc.topography.readers import from_array
from roughvisc.topography.synthesis import self_affine

SIZE, SHAPE = (1e-3, 0.9e-3), (256, 240)
KNOWN = {"rms_slope": 0.1, "rolloff": 2e-4, "shortcut": 2e-5}


def cut_out(seed, **parameters):
    """A scan of a quarter of a larger surface, which does not repeat, and is tilted."""
    h = self_affine([2 * s for s in SIZE], [2 * n for n in SHAPE], seed=seed, **parameters)
    part = h.isel(x=slice(40, 40 + SHAPE[0]), y=slice(10, 10 + SHAPE[1]))
    return part + 0.05 * part.x - 0.02 * part.y + 7e-2


@pytest.mark.parametrize("hurst", [0.3, 0.8, 1.0])
@pytest.mark.parametrize("anisotropy", [1.0, 2.5])
def test_fit__of_a_periodic_surface_gives_its_parameters_back(hurst, anisotropy):
    h = self_affine(SIZE, SHAPE, hurst=hurst, anisotropy=anisotropy, seed=3, **KNOWN)
    fit = fit_self_affine(h, periodic=True)
    assert fit["hurst"] == pytest.approx(hurst, abs=0.02)
    assert fit["rolloff"] == pytest.approx(2e-4, rel=0.02)
    assert fit["shortcut"] == pytest.approx(2e-5, rel=0.02)
    assert fit["anisotropy"] == pytest.approx(anisotropy, rel=0.02)
    assert fit["rms_slope"] == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("hurst", [0.4, 0.8])
def test_fit__of_a_scan_of_five_rolloff_lengths_is_within_bounds(hurst, seed):
    """A scan five roll-off lengths wide has some twenty of the longest waves: the roll-off is known to a third."""
    fit = fit_self_affine(cut_out(seed, hurst=hurst, **KNOWN))
    assert fit["hurst"] == pytest.approx(hurst, abs=0.1)
    assert fit["rolloff"] == pytest.approx(2e-4, rel=0.4)
    assert fit["shortcut"] == pytest.approx(2e-5, rel=0.03)
    assert fit["anisotropy"] == pytest.approx(1, abs=0.1)
    assert fit["rms_slope"] == pytest.approx(0.1, rel=0.1)


def test_fit__is_right_in_the_mean_of_many_scans():
    fits = [fit_self_affine(cut_out(seed, hurst=0.7, **KNOWN)) for seed in range(12)]
    mean = {key: np.mean([fit[key] for fit in fits]) for key in fits[0]}
    assert mean["hurst"] == pytest.approx(0.7, abs=0.05)
    assert mean["rolloff"] == pytest.approx(2e-4, rel=0.15)
    assert mean["shortcut"] == pytest.approx(2e-5, rel=0.02)
    assert mean["rms_slope"] == pytest.approx(0.1, rel=0.03)


@pytest.mark.parametrize("seed", range(3))
def test_fit__without_rolloff_and_shortcut_says_so(seed):
    cell = [s / n for s, n in zip(SIZE, SHAPE, strict=True)]
    fit = fit_self_affine(self_affine(SIZE, SHAPE, hurst=0.7, rms_slope=0.1, seed=seed), periodic=True)
    assert fit["rolloff"] is None
    assert fit["shortcut"] == pytest.approx(2 * max(cell), rel=0.02)
    assert fit["hurst"] == pytest.approx(0.7, abs=0.02)
    scan = fit_self_affine(cut_out(seed, hurst=0.7, rms_slope=0.1))
    assert scan["hurst"] == pytest.approx(0.7, abs=0.1)
    assert scan["shortcut"] == pytest.approx(2 * max(cell), rel=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_fit__takes_the_floor_of_noise_for_the_end_of_the_surface(seed):
    h = cut_out(seed, hurst=0.8, rms_slope=0.1, rolloff=3e-4)
    noisy = h + np.random.default_rng(seed).normal(0, 2e-7, h.shape)
    fit = fit_self_affine(noisy)
    # the law falls to the noise: C(q_s) = (noise) x (area of a cell), by the law of the surface without noise
    clean = rv.psd(rv.level(h), "hann")
    floor = 4e-14 * np.prod(SIZE) / np.prod(SHAPE)
    crossing = 2 * np.pi / float(clean.wavevector[np.flatnonzero(clean.psd > floor)[-1]])
    assert 0.8 < fit["shortcut"] / crossing < 2
    assert fit["hurst"] == pytest.approx(0.8, abs=0.15)
    assert float(rv.parameters(rv.level(noisy))["Sdq"]) > 1.4 * fit["rms_slope"]  # noise is no slope of the surface


@pytest.mark.parametrize("meet", ["rms_slope", "rms_height"])
def test_fit__extends_a_scan_into_an_ensemble(meet):
    scan = cut_out(1, hurst=0.8, **KNOWN)
    fit = fit_self_affine(scan, meet=meet)
    assert ({"rms_slope", "rms_height"} & set(fit)) == {meet}
    found = rv.parameters(rv.level(scan))
    for seed in range(3):
        larger = self_affine((3e-3, 2e-3), (768, 512), **fit, seed=seed)
        assert float(rv.parameters(larger)["rms_slope"]) == pytest.approx(float(found["rms_slope"]), rel=0.15)
        assert float(rv.parameters(larger)["Sq"]) == pytest.approx(float(found["Sq"]), rel=0.25)


def test_fit__reads_the_texture_of_ground_steel():
    h = rv.open_scan(Path(__file__).parents[2] / "surfaces" / "ground_steel.toml")
    fit = fit_self_affine(h)
    assert fit["hurst"] == pytest.approx(0.8, abs=0.1)
    assert fit["rolloff"] == pytest.approx(60e-6, rel=0.15)
    assert fit["shortcut"] == pytest.approx(17e-6, rel=0.05)
    assert fit["anisotropy"] == pytest.approx(4, rel=0.05)


def test_fit__is_the_same_in_nanometres_and_turned():
    h = cut_out(2, hurst=0.6, anisotropy=2.0, **KNOWN)
    fit = fit_self_affine(h)
    small = fit_self_affine((h * 1e-3).assign_coords(x=h.x * 1e-3, y=h.y * 1e-3))
    turned = fit_self_affine(rv.rotate90(h))
    for key, value in fit.items():
        assert small[key] == pytest.approx(value * (1e-3 if key in ("rolloff", "shortcut") else 1), rel=1e-3), key
        expected = 1 / value if key == "anisotropy" else value
        assert turned[key] == pytest.approx(expected, rel=0.05), key
    assert h.roughvisc.fit_self_affine() == fit


def test_fit__refuses():
    h = self_affine(SIZE, (64, 60), hurst=0.8, rms_slope=0.1, seed=0)
    lines = from_array(np.broadcast_to(np.sin(np.arange(64))[:, None], (64, 60)), 1e-6)
    for wrong, fragment in [
        (h.where(h.x > 1e-5), "points are missing"),
        (h * 0, "flat"),
        (h.isel(x=slice(0, 10)), "10 x 60 cells: expected at least 16"),
    ]:
        with pytest.raises(InputError, match="expected") as refused:
            fit_self_affine(wrong)
        assert fragment in str(refused.value)
    with pytest.raises(InputError, match="lines along one axis"):
        fit_self_affine(lines, periodic=True)
    with pytest.raises(InputError, match="meet is 'both'"):
        fit_self_affine(h, meet="both")
    assert math.isfinite(fit_self_affine(h.isel(x=slice(0, 16), y=slice(0, 16)))["hurst"])


def test_fit__of_white_noise_is_a_bounded_guess():
    noise = from_array(np.random.default_rng(0).normal(size=(64, 60)), 1e-6)
    fit = fit_self_affine(noise)
    assert 0 < fit["hurst"] <= 1
    assert fit["shortcut"] >= 2e-6 * (1 - 1e-9)
