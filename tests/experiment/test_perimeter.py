"""The corrected contact area: the edge of contact is known to a cell on the material, exactly where that ends."""

from types import SimpleNamespace

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.experiment.profile import Profile
from roughvisc.experiment.stated import staircase_area
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact.neighbours import PERIMETER_CORRECTION

UNIT = rv.elastic(0.25)


def counted(contact, present, sides, periodic):
    """Faces between a cell in contact and a present one out of contact, cell by cell."""
    (nx, ny), faces = contact.shape, 0
    for i in range(nx):
        for j in range(ny):
            for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                k, m = i + di, j + dj
                if periodic:
                    k, m = k % nx, m % ny
                elif not (0 <= k < nx and 0 <= m < ny):
                    continue
                faces += contact[i, j] and present[k, m] and not contact[k, m]
    return PERIMETER_CORRECTION * sides[0] * sides[1] * faces


@pytest.mark.parametrize("boundary", ["free", "periodic"])
@pytest.mark.parametrize("seed", range(4))
def test_perimeter__runs_between_contact_and_material_out_of_contact(seed, boundary):
    rng = np.random.default_rng(seed)
    shape, sides = (7, 6), (1.0, 0.7)
    present = rng.random(shape) < 0.8
    contact = present & (rng.random(shape) < 0.5)
    scene = SimpleNamespace(operator=Operator(shape, sides, boundary), present=present, outside=np.inf)
    assert staircase_area(contact, scene) == pytest.approx(counted(contact, present, sides, boundary == "periodic"))


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_perimeter__of_a_quarter_is_a_quarter(boundary):
    rng = np.random.default_rng(5)
    part, there = rng.random((4, 3)) < 0.5, rng.random((4, 3)) < 0.8
    contact, present = (np.block([[a[::-1, ::-1], a[::-1]], [a[:, ::-1], a]]) for a in (part & there, there))
    operator = Operator((4, 3), (1.0, 0.7), boundary, mirrored=True)
    scene = SimpleNamespace(operator=operator, present=there, outside=np.inf)
    whole = counted(contact, present, (1.0, 0.7), boundary == "periodic")
    assert operator.cell_area == pytest.approx(4 * 0.7)
    assert staircase_area(part & there, scene) == pytest.approx(whole)


@pytest.mark.parametrize("mirrored", [False, True])
def test_perimeter__goes_on_at_the_border_of_a_window(mirrored):
    contact = np.ones((4, 3), dtype=bool)
    scene = SimpleNamespace(operator=Operator((4, 3), (1.0, 1.0), "free", mirrored=mirrored), present=None, outside=1.0)
    faces = 4 * (4 + 3) if mirrored else 2 * (4 + 3)
    assert staircase_area(contact, scene) == pytest.approx(PERIMETER_CORRECTION * faces)


def pillars():
    """Two by two pillars of four by four cells, four apart; nothing between them."""
    x = np.arange(16) % 8
    inside = (x >= 2) & (x < 6)
    return rv.from_array(np.where(inside[:, None] & inside, 0.0, np.nan), 1.0)


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_pillars__have_the_area_of_their_cells(boundary):
    ds = rv.simulate(
        pillars(), UNIT, rv.Program().load(1.0, over=0), boundary=boundary, missing="absent", progress=False
    )
    assert ds.contact_area_counted.values == pytest.approx(64.0)
    assert ds.contact_area.values == pytest.approx(64.0)


def test_scan_pressed_as_a_punch__has_its_whole_area():
    flat = rv.from_array(np.zeros((6, 5)), 1.0)
    ds = rv.simulate(flat, UNIT, rv.Program().load(1.0, over=0), edge="accept", progress=False)
    assert float(ds.contact_area[0]) == pytest.approx(30.0)


def test_ball_on_a_window__is_corrected_as_on_the_whole_grid(monkeypatch):
    ball, program = rv.sphere(1.0, 12.0, (121, 120)), rv.Program().load(1.0, over=0)
    monkeypatch.setattr("roughvisc.experiment.profile._WORTH_FOLLOWING", 10**9)
    whole = rv.simulate(ball, UNIT, program, progress=False)
    monkeypatch.undo()
    assert Profile(ball, follow=True).window.shape != (121, 120)
    followed = rv.simulate(ball, UNIT, program, progress=False)
    assert float(followed.contact_area[0]) == float(whole.contact_area[0])
    assert float(whole.contact_area[0]) == pytest.approx(np.pi * 0.75 ** (2 / 3), rel=0.03)
