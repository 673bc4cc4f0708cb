"""The corrected contact area: the edge of contact is known to a cell on the material, exactly where that ends."""

import numpy as np
import pytest
from samples import UNIT

import roughvisc as rv


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


def test_ball_on_a_part_of_the_surface__is_corrected_as_on_the_whole(monkeypatch):
    ball, program = rv.sphere(1.0, 12.0, (121, 120)), rv.Program().load(1.0, over=0)
    monkeypatch.setattr("roughvisc.experiment.profile.WORTH_CROPPING", 10**9)
    whole = rv.simulate(ball, UNIT, program, progress=False)
    monkeypatch.undo()
    followed = rv.simulate(ball, UNIT, program, progress=False)
    assert float(followed.contact_area[0]) == float(whole.contact_area[0])
    assert float(whole.contact_area[0]) == pytest.approx(np.pi * 0.75 ** (2 / 3), rel=0.03)
