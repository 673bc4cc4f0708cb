"""Flow on two grids: large maps as factors have them, channels in closed form, what is left to factors."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support import rough_gap

from roughvisc.mechanics.transport import flow as solvers
from roughvisc.mechanics.transport.flow import flow, fluxes

CELL = (2e-6, 3e-6)
FACTORS = solvers.factors


@pytest.fixture
def no_factors(monkeypatch):
    """All cells are left to two grids."""

    def fail(_):
        raise AssertionError("two grids did not do")

    monkeypatch.setattr(solvers, "factors", fail)
    monkeypatch.setattr(solvers, "_LARGE", 0)


def by_factors(gap, wrap=False):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solvers, "_LARGE", np.inf)
        patch.setattr(solvers, "factors", FACTORS)
        return flow(gap, CELL, wrap=wrap)


@pytest.mark.parametrize("wrap", [False, True])
@pytest.mark.parametrize("part", [0.0, 0.2, 0.35])
def test_rough_gap__as_factors_have_it(part, wrap, no_factors):
    whole = rough_gap((90, 97), seed=2)
    gap = 1e-7 * np.maximum(whole - np.quantile(whole, part), 0.0)
    found, expected = flow(gap, CELL, wrap=wrap), by_factors(gap, wrap)
    assert found.error <= 1e-9 * found.conductance
    assert_allclose(found.conductance, expected.conductance, rtol=1e-9, atol=0)
    for one, other in zip(*(fluxes(gap, CELL, by.pressure, wrap=wrap) for by in (found, expected)), strict=True):
        assert np.linalg.norm(one - other) < 1e-6 * np.linalg.norm(other)


def test_history__of_a_channel_that_closes_and_opens_again(no_factors):
    """A channel of one cell, next to a wide one that is not open all the time: both in closed form."""
    gap = np.zeros((80, 60))
    gap[:, 5] = 1e-7 * (1 + np.arange(80) / 80)
    narrow = CELL[1] / np.sum(CELL[0] / (gap[:, 5] ** 3 / 12))
    gap[:, 20:50] = 1e-6
    wide = 30 * CELL[1] / (80 * CELL[0]) * (1e-6) ** 3 / 12
    for open_ in (True, False, True):
        gap[40, 20:50] = 1e-6 if open_ else 0.0
        found = flow(gap, CELL)
        assert_allclose(found.conductance, narrow + wide * open_, rtol=1e-10, atol=0)
    gap[40] = 0.0
    assert flow(gap, CELL).is_closed


def test_cells_that_nothing_joins__in_one_row(no_factors):
    """Faces across the flow that are much narrower than the sides: there are no coarse cells."""
    gap = 1e-6 * (1 + np.arange(50) / 50)[None]
    cell = (1e-9, 1e-3)
    expected = np.sum(gap**3 / 12) * cell[1] / cell[0]
    assert_allclose(flow(gap, cell).conductance, expected, rtol=1e-12, atol=0)
