"""Steady sliding of a cylinder against the closed form for one cylinder alone."""

import math

import numpy as np
import pytest
from references.cylinder import sliding_cylinder

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE, Body
from roughvisc.mechanics.steady_sliding import Sliding, steady_state

RADIUS, LOAD, TIME = 1e-2, 100.0, 1e-3
RUBBER = rv.zener(1e6, 1e6 / 3, 1e6 / 3 * TIME)
CELL = 2e-3 / 128
NEAR, FAR = 2046, 4092  # cells from one cylinder to the next


def slid(cells, speed):
    """One cylinder in each period of so many cells."""
    x = (np.arange(cells) - (cells - 1) / 2) * CELL
    gap = x[:, None] ** 2 / (2 * RADIUS)
    sliding = Sliding(Body(RUBBER, HALF_SPACE), (cells, 1), (CELL, CELL), speed)
    return steady_state(sliding, gap, LOAD * CELL, tolerance=1e-6)


@pytest.mark.parametrize("speed", [0.1, 0.5, 2.0])
def test_cylinder__is_that_of_hunter_without_its_neighbours(speed):
    """Neighbours at the distance L flatten the surface by a curvature that falls as 1 / L^2, and that is taken off.

    Of a contact of the half-width a it is about (pi^2 / 6) (a / L)^2 of the cylinder's, 0.2 % at the shorter distance,
    and four times that where a wake is left behind. The rest is the grid's: 5e-4 of the friction at 80 cells and more.
    """
    exact = sliding_cylinder(RADIUS, RUBBER, LOAD, speed)
    near, far = (slid(cells, speed) for cells in (NEAR, FAR))
    friction = [found.power_force / (LOAD * CELL) for found in (near, far)]
    assert friction == pytest.approx([exact.friction_coefficient] * 2, rel=0.01)
    assert (4 * friction[1] - friction[0]) / 3 == pytest.approx(exact.friction_coefficient, rel=5e-4)
    widths = [np.count_nonzero(found.pressure) * CELL for found in (near, far)]
    assert widths == pytest.approx([2 * exact.half_width] * 2, abs=2 * CELL)
    middle = [CELL * (np.flatnonzero(found.pressure).mean() - (n - 1) / 2) for found, n in ((near, NEAR), (far, FAR))]
    assert middle == pytest.approx([exact.offset] * 2, abs=CELL)
    assert math.isclose(far.pressure.sum() * CELL, LOAD, rel_tol=1e-12)
