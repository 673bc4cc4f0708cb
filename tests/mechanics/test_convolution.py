"""Displacement on a grid against direct sums, closed forms and the unfolded surface; SciPy against ducc0."""

import numpy as np
import pytest
from hypothesis import given
from strategies import examples, seeds, shapes
from support import direct

from roughvisc.mechanics import grid as grids
from roughvisc.mechanics.grid import Grid, transform_library

SHAPES = [(7, 5), (8, 6), (1, 9), (13, 1), (1, 1), (31, 34)]
BOUNDARIES = pytest.mark.parametrize("boundary", ["free", "periodic", "mirror"])


def unfolded(field):
    """The field and its mirror images: one period."""
    return np.block([[field, field[:, ::-1]], [field[::-1], field[::-1, ::-1]]])


# ---------------------------------------------------------------------------------------------------- displacement


@pytest.mark.parametrize("shape", SHAPES)
def test_free_displacement__is_the_sum_over_cells(shape):
    pressure = np.random.default_rng(1).random(shape)
    found = Grid(shape, (1.3, 0.7)).displacement(pressure)
    expected = direct(pressure, (1.3, 0.7))
    assert np.abs(found - expected).max() < 1e-14 * expected.max()


@pytest.mark.parametrize(
    ("shape", "waves"), [((9, 8), (0, 3)), ((9, 8), (2, 1)), ((12, 15), (3, 2)), ((12, 15), (0, 3)), ((1, 21), (0, 3))]
)
def test_periodic_displacement__of_a_wave(shape, waves):
    """A wave of pressure of wave number q causes a displacement 2/q times as large."""
    spacing = (0.4, 0.9)
    phase = sum(2 * np.pi * k * index / n for k, index, n in zip(waves, np.indices(shape), shape, strict=True))
    wave_number = np.hypot(*(2 * np.pi * k / (n * d) for k, n, d in zip(waves, shape, spacing, strict=True)))
    found = Grid(shape, spacing, "periodic").displacement(np.cos(phase))
    assert found == pytest.approx(2 / wave_number * np.cos(phase), abs=1e-13)


@pytest.mark.parametrize("shape", SHAPES)
def test_mirror__is_a_quarter_of_the_unfolded_surface(shape):
    pressure = np.random.default_rng(3).random(shape)
    mirror, whole = Grid(shape, (1.3, 0.7), "mirror"), Grid((2 * shape[0], 2 * shape[1]), (1.3, 0.7), "periodic")
    assert mirror.cell_area == whole.cell_area
    for name, kind, precision in (("displacement", np.float64, 1e-13), ("inverse", np.float32, 3e-6)):
        field = (pressure - pressure.mean()).astype(kind)  # of the mean, the inverse is a convention
        expected, found = getattr(whole, name)(unfolded(field)), getattr(mirror, name)(field)
        assert found.dtype == kind
        np.testing.assert_allclose(unfolded(found), expected, rtol=0, atol=precision * np.abs(expected).max())


@given(shape=shapes(1, 12), seed=seeds)
@examples(40)
@BOUNDARIES
def test_convolutions__are_symmetric_and_positive(shape, boundary, seed):
    grid = Grid(shape, (1.0, 0.6), boundary)
    a, b = np.random.default_rng(seed).standard_normal((2, *shape))
    for applied, precision in ((grid.displacement, 1e-12), (grid.inverse, 1e-5)):
        scale = np.linalg.norm(applied(a)) * np.linalg.norm(b) + 1e-300
        assert np.sum(applied(a) * b) == pytest.approx(np.sum(a * applied(b)), abs=precision * scale)
        assert np.sum(applied(a) * a) >= -precision * scale


# ------------------------------------------------------------------------------------------- numbers of a grid


@pytest.mark.parametrize("shape", [(7, 5), (8, 6), (1, 9)])
def test_self_influence__is_that_of_a_uniformly_loaded_rectangle(shape):
    """Johnson, Contact Mechanics, eq. (3.25) at the centre."""
    a, b = 1.3, 0.7
    expected = 2 / np.pi * (a * np.arcsinh(b / a) + b * np.arcsinh(a / b))
    assert Grid(shape, (a, b)).self_influence == pytest.approx(expected, rel=1e-12)


@BOUNDARIES
@pytest.mark.parametrize("shape", [(4, 5), (5, 4), (1, 6)])
def test_self_influence__is_the_mean_over_all_cells(shape, boundary):
    grid = Grid(shape, (1.3, 0.7), boundary)
    alone = np.eye(grid.size).reshape(-1, *shape)
    own = [float((grid.displacement(pressure) * pressure).sum()) for pressure in alone]
    assert grid.self_influence == pytest.approx(np.mean(own), rel=1e-12)


# --------------------------------------------------------------------------------------------------- SciPy and ducc0


@pytest.fixture
def by_ducc0(monkeypatch):
    monkeypatch.delenv("ROUGHVISC_TRANSFORMS")
    assert transform_library().startswith("ducc0 ")


@BOUNDARIES
@pytest.mark.parametrize("shape", [(33, 150), (9, 15), (8, 14), (1, 11), (7, 1)])
def test_half_space__is_the_same_by_both(boundary, shape, monkeypatch):
    pressure = np.random.default_rng(0).random(shape)
    found = []
    for engine in ("scipy", "ducc0"):
        monkeypatch.setenv("ROUGHVISC_TRANSFORMS", engine)
        grid = Grid(shape, (1.0, 0.7), boundary)
        found.append((grid.displacement(pressure), grid.inverse(pressure.astype(np.float32))))
    for a, b in zip(*found, strict=True):
        assert a.dtype == b.dtype
        precision = 1e-14 if a.dtype == np.float64 else 1e-5
        np.testing.assert_allclose(a, b, rtol=0, atol=precision * np.abs(a).max())


def test_ducc0__is_used_if_installed_and_not_refused(by_ducc0, monkeypatch):
    calls, transform = [], grids.ducc0.fft.r2c
    monkeypatch.setattr(grids.ducc0.fft, "r2c", lambda *given, **how: calls.append(1) or transform(*given, **how))
    Grid((9, 8), (1.0, 1.0)).displacement(np.ones((9, 8)))
    monkeypatch.setenv("ROUGHVISC_TRANSFORMS", "scipy")
    used = len(calls)
    Grid((9, 8), (1.0, 1.0)).displacement(np.ones((9, 8)))
    assert len(calls) == used > 0


def test_without_ducc0__scipy_is_taken(by_ducc0, monkeypatch):
    monkeypatch.setattr(grids, "ducc0", None)
    assert transform_library().startswith("scipy.fft ")
    Grid((5, 4), (1.0, 1.0)).displacement(np.ones((5, 4)))
