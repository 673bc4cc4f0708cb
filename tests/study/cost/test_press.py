"""The elastic press by which a plan estimates the contact, and the pressure of a first study."""

import math

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.study.cost import first_pressure as first_module
from roughvisc.study.cost.first_pressure import first_pressure
from roughvisc.study.cost.press import Push, press
from roughvisc.topography.grid import spacing
from roughvisc.topography.inspection import inspect_scan

RADIUS, SIZE = 1e-2, 1e-3


@pytest.mark.parametrize("shape", [(96, 80), (97, 81)], ids=["even", "odd"])
@pytest.mark.parametrize("given", ["load", "approach"])
def test_press__hertz(shape, given):
    """Hertz: approach ``a^2 / R``, load times compliance ``4 a^3 / 3 R``."""
    radius = 2.6e-4
    push = Push(load=4 * radius**3 / (3 * RADIUS)) if given == "load" else Push(approach=radius**2 / RADIUS)
    found = press(rv.sphere(RADIUS, SIZE, shape), push, "free", HALF_SPACE)
    assert found.shape == shape
    assert found.fraction == pytest.approx(math.pi * radius**2 / SIZE**2, rel=0.02)
    assert found.approach == pytest.approx(radius**2 / RADIUS, rel=0.01)
    for width, count in zip(found.width, shape, strict=True):
        assert width == pytest.approx(2 * radius, abs=1.5 * SIZE / count)
    assert not found.at_border


@pytest.mark.parametrize("shape", [(24, 30), (25, 31)], ids=["even", "odd"])
def test_press__sees_the_border(shape):
    ball = rv.sphere(RADIUS, SIZE, shape)
    inside, beyond = (
        press(ball, Push(approach=(0.5 * part * SIZE) ** 2 / RADIUS), "free", HALF_SPACE) for part in (0.85, 1.05)
    )
    assert (inside.at_border, beyond.at_border) == (False, True)


def test_press__nothing_and_everything():
    wave = rv.wavy(1e-6, 1e-4, 1e-3, (40, 40), waves=2)
    assert press(wave, Push(load=0.0), "periodic", HALF_SPACE).fraction == 0
    assert press(wave, Push(approach=0.0), "periodic", HALF_SPACE).fraction == 0
    mean_gap = float(wave.max() - wave.mean())
    for part in (1.01, 4.0):
        assert press(wave, Push(approach=part * mean_gap), "periodic", HALF_SPACE).fraction == 1
    assert press(wave, Push(approach=0.99 * mean_gap), "periodic", HALF_SPACE).fraction < 1


def touching(surface, pressure, compliance):
    """By the solver itself, on all cells; less 0.088 of the staircase at the rim."""
    operator = Grid(surface.shape, spacing(surface), "periodic")
    gap = float(surface.max()) - surface.values
    contact = solve_contact(operator, gap, load=pressure * gap.size * compliance, tolerance=1e-6).pressure > 0
    rim = sum((contact & ~np.roll(contact, turn, axis)).sum() for axis in (0, 1) for turn in (1, -1))
    return (contact.sum() - 0.088 * rim) / contact.size


@pytest.mark.parametrize(("hurst", "most"), [(0.8, 256), (0.5, 64), (0.8, 64)])
def test_first_pressure__brings_five_per_cent_into_contact(monkeypatch, hurst, most):
    """A rubber of 3 and 1 MPa has the contact compliance 1 / 12 MPa at once and 1 / 3 MPa in the end."""
    monkeypatch.setattr(first_module, "MOST_PRESSED", most)
    scan = rv.self_affine((1e-3, 1e-3), (128, 120), hurst=hurst, rms_slope=0.1, shortcut=1.7e-5, seed=3)
    found = inspect_scan(scan)
    assert found.boundary == "periodic"
    first = first_pressure(scan, found)
    assert max(first.shape) == min(most, 128)
    surface = rv.level(scan, found.steps["level"])
    near = 0.02 if most > 128 else 0.1
    assert first.late == pytest.approx(0.05, rel=0.05), "the pressure has two digits"
    assert touching(surface, first.pressure, 1 / 3e6) == pytest.approx(first.late, rel=near)
    assert touching(surface, first.pressure, 1 / 12e6) == pytest.approx(first.early, rel=2 * near)


def test_first_pressure__of_what_is_flat_or_has_plateaus():
    flat = rv.from_array(np.zeros((20, 24)), (1e-6, 1e-6))
    first = first_pressure(flat, inspect_scan(flat))
    assert (first.pressure, first.late, first.early) == (1e3, 1.0, 1.0)
    heights = np.zeros((33, 33))
    heights[:, 11:22] = -1e-6  # the other two thirds touch under any pressure
    plateaus = rv.from_array(heights, (1e-6, 1e-6))
    first = first_pressure(plateaus, inspect_scan(plateaus))
    assert first.pressure > 0
    assert first.late > 0.6
