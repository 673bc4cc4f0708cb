"""The second level of the preconditioner: symmetric, positive, right for long waves, and no part of the answer."""

import numpy as np
import pytest

from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import long_waves, solve_contact
from roughvisc.mechanics.contact.influence import Influence
from roughvisc.mechanics.contact.long_waves import LongWaves
from roughvisc.topography.synthesis import self_affine

SHAPE, SPACING = (52, 37), (0.5, 0.7)


@pytest.fixture
def on_small_grids(monkeypatch):
    monkeypatch.setattr(long_waves, "_FROM", 1)
    monkeypatch.setattr(long_waves, "_SPOTS", 0.0)
    monkeypatch.setattr(long_waves, "_TOLERANCE", 1e-11)
    monkeypatch.setattr(long_waves, "_KIND", float)


def spots():
    """Small spots of contact, scattered over the grid: flat indices."""
    rng = np.random.default_rng(0)
    mask = np.zeros(SHAPE, bool)
    for x, y in rng.integers((0, 0), SHAPE, size=(20, 2)):
        mask[x : x + 2, y : y + 3] = True
    return np.flatnonzero(mask)


def waves_of(boundary="periodic", mirrored=False):
    influence = Influence(Operator(SHAPE, SPACING, boundary, mirrored=mirrored), 1.7)
    cells = spots()
    pressure = np.zeros(SHAPE)
    pressure.reshape(-1)[cells] = np.random.default_rng(1).random(cells.size) + 0.5
    energy = float((pressure * influence.displacement(pressure)).sum())
    waves = LongWaves.of(influence, cells, pressure.reshape(-1)[cells], energy)
    return influence, cells, waves


def matrix(columns, count):
    """Of a linear map on the cells."""
    return np.stack([columns(unit) for unit in np.eye(count)], axis=1)


BODIES = pytest.mark.parametrize(("boundary", "mirrored"), [("periodic", False), ("free", False), ("periodic", True)])


@BODIES
def test_both_levels__are_symmetric_and_positive(on_small_grids, boundary, mirrored):
    influence, cells, waves = waves_of(boundary, mirrored)

    def fine(values):
        return influence.approximate_pressure(values, cells)

    both = matrix(lambda unit: waves.preconditioned(unit, fine), cells.size)
    assert np.abs(both - both.T).max() < 1e-5 * np.abs(both).max()  # the cells' level is in single precision
    assert np.linalg.eigvalsh(0.5 * (both + both.T)).min() > 0


def test_both_levels__need_fewer_iterations_on_a_wide_rough_surface(monkeypatch):
    """Those of one level grow with the width."""
    surface = self_affine((500.0, 490.0), (500, 490), hurst=0.8, rms_slope=1.0, rolloff=125.0, seed=3)
    operator, gap = Operator((500, 490), (1.0, 1.0), "free"), surface.values.max() - surface.values
    alone = solve_contact(operator, gap, load=0.05 * gap.size, tolerance=1e-4)
    monkeypatch.setattr(long_waves, "_FROM", 400)
    both = solve_contact(operator, gap, load=0.05 * gap.size, tolerance=1e-4)
    assert 0.05 < np.mean(alone.pressure > 0) < 0.15
    assert both.iterations < 0.75 * alone.iterations


@pytest.mark.parametrize("boundary", ["periodic", "free"])
@pytest.mark.parametrize("given", ["load", "approach"])
def test_contact__is_the_same_with_both_levels(monkeypatch, boundary, given):
    rng = np.random.default_rng(5)
    gap = rng.random((96, 75)) + 0.002 * ((np.indices((96, 75)).T - (50, 31)) ** 2).sum(-1).T
    operator = Operator((96, 75), (1.0, 1.3), boundary)
    known = {"load": 300.0} if given == "load" else {"approach": 1.2}
    alone = solve_contact(operator, gap, tolerance=1e-12, **known)
    monkeypatch.setattr(long_waves, "_FROM", 1)
    monkeypatch.setattr(long_waves, "_SPOTS", 0.0)
    both = solve_contact(operator, gap, tolerance=1e-12, **known)
    assert both.converged
    assert both.iterations != alone.iterations  # the second level was there
    assert np.abs(both.pressure - alone.pressure).sum() < 3e-6 * alone.pressure.sum()
    assert both.approach == pytest.approx(alone.approach, rel=1e-6)
