"""Passive materials for tables: the nearest positive series."""

import numpy as np
import pytest

from roughvisc.mechanics.materials.passive import nearest_series
from roughvisc.mechanics.materials.tabulated import Tabulated

ROWS = np.geomspace(1e-3, 1e3, 60)


def noisy(seed, rms=0.03):
    noise = 1 + rms * np.random.default_rng(seed).standard_normal(ROWS.size)
    return Tabulated(ROWS, (0.5 + ROWS**0.3) * noise, noise=0.4)


@pytest.mark.parametrize("seed", range(4))
def test_nearest_series__finds_the_curve_below_the_noise(seed):
    """The rows are off by the noise, the curve that they were made from by much less."""
    table = noisy(seed)
    found = nearest_series(table)
    assert found.rms == pytest.approx(0.03, rel=0.35)
    off = found.prony.creep_compliance(ROWS) / (0.5 + ROWS**0.3) - 1
    assert np.sqrt(np.mean(off**2)) < 0.02
    assert found.prony.glassy == table.creep_compliance(0.0)
    assert min(found.prony.compliances) > 0
    assert len(found.prony.times) <= 15


def test_nearest_series__states_its_deviation_from_the_rows_as_measured():
    table = noisy(1)
    found = nearest_series(table)
    off = found.prony.creep_compliance(ROWS) / np.array(table.compliances) - 1
    assert (found.largest, found.rms) == pytest.approx((np.abs(off).max(), np.sqrt(np.mean(off**2))), rel=1e-9)


def test_nearest_series__has_the_least_largest_deviation():
    """A jump from 1 to 3 between neighbouring rows: no ascending curve without it is nearer than half way, 50 %.

    The nearest constant to 1 and 3 in relative deviation is 1.5.
    """
    times = np.array([0.0, 1.0, 1.0 + 1e-9, 1.0 + 2e-9])
    found = nearest_series(Tabulated(times, (0.0, 1.0, 3.0, 3.0)))
    assert found.largest == pytest.approx(0.5, rel=0.11)  # a tenth more for the sake of the others


def test_nearest_series__of_a_series_is_the_series():
    table = Tabulated(np.append(0, ROWS), 1 - np.expm1(-np.append(0, ROWS) / 0.37))
    found = nearest_series(table)
    assert found.largest < 5e-3  # the rows are joined by straight lines over the logarithm: so far off themselves
    assert len(found.prony.times) <= 12


def test_nearest_series__of_a_delay():
    """Nothing creeps for a second: the rows of no compliance count relative to the first that has some."""
    found = nearest_series(Tabulated((0.0, 1.0, 3.0), (0.0, 0.0, 4.0)))
    assert 0 < found.largest < 1
    assert found.prony.glassy == 0
