"""The pressure of a first study brings a stated share of the surface into contact."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.study import first_study as first_module
from roughvisc.study.first_study import first_pressure
from roughvisc.topography.conditioning import condition
from roughvisc.topography.grid import spacing
from roughvisc.topography.inspection import inspection_of


def touching(surface, pressure, compliance):
    """By the solver itself, on all cells; less 0.088 of the staircase at the rim."""
    operator = Grid(surface.shape, spacing(surface), "periodic")
    gap = float(surface.max()) - surface.values
    contact = solve_contact(operator, gap, load=pressure * gap.size * compliance, tolerance=1e-6).pressure > 0
    rim = sum((contact & ~np.roll(contact, turn, axis)).sum() for axis in (0, 1) for turn in (1, -1))
    return (contact.sum() - 0.088 * rim) / contact.size


@pytest.mark.parametrize(("hurst", "most"), [(0.8, 256), (0.5, 64), (0.8, 64)])
def test_first_pressure__brings_five_per_cent_into_contact(monkeypatch, hurst, most):
    """A rubber of 3 and 1 MPa has the contact compliance 1 / 3 MPa in the end."""
    monkeypatch.setattr(first_module, "MOST_PRESSED", most)
    scan = rv.self_affine((1e-3, 1e-3), (128, 120), hurst=hurst, rms_slope=0.1, shortcut=1.7e-5, seed=3)
    found = inspection_of(scan)
    assert found.boundary == "periodic"
    first = first_pressure(scan, found)
    assert max(first.shape) == min(most, 128)
    surface = condition(scan, found.steps)
    near = 0.02 if most > 128 else 0.1
    assert first.late == pytest.approx(0.05, rel=0.05), "the pressure has two digits"
    assert not first.miss
    assert touching(surface, first.pressure, 1 / 3e6) == pytest.approx(first.late, rel=near)


def test_first_pressure__of_what_is_flat_or_has_plateaus():
    flat = rv.from_array(np.zeros((20, 24)), (1e-6, 1e-6))
    first = first_pressure(flat, inspection_of(flat))
    assert (first.pressure, first.late) == (1e3, 1.0)
    assert first.miss
    heights = np.zeros((33, 33))
    heights[:, 11:22] = -1e-6  # the other two thirds touch under any pressure
    plateaus = rv.from_array(heights, (1e-6, 1e-6))
    first = first_pressure(plateaus, inspection_of(plateaus))
    assert first.pressure > 0
    assert first.late > 0.6
    assert "5 % requested" in first.miss
    assert not first_pressure(plateaus, inspection_of(plateaus), 0.8).miss
