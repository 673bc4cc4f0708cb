"""Measured creep: what the table says between its rows, what is repaired, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.tabulated import Tabulated

TABLE = Tabulated((0.0, 1.0, 100.0), (1.0, 3.0, 7.0), poisson=0.0)


def test_creep_compliance__between_the_rows():
    t = [0.0, 0.25, 1.0, 10.0, 100.0]
    assert TABLE.creep_compliance(t) == pytest.approx([1.0, 1.5, 3.0, 5.0, 7.0], rel=1e-15, abs=0)
    assert TABLE.contact_compliance(t) == pytest.approx(TABLE.creep_compliance(t) / 2, rel=1e-15, abs=0)
    assert TABLE.notes == ()
    assert TABLE.note == ""


def test_contact_integral__is_exact():
    # int (3 + 2 log10 t) dt = 3 t + 2 (t log t - t) / log 10 beyond the first row
    expected = (1.0 + 3.0) / 2 + 3 * 99 + 2 * (100 * np.log(100) - 99) / np.log(10)
    assert TABLE.contact_integral(100.0) == pytest.approx(expected / 2, rel=1e-14, abs=0)
    assert TABLE.contact_integral(0.5) == pytest.approx((1 * 0.5 + 0.5**2) / 2, rel=1e-15, abs=0)


def test_mean__over_spans_of_any_kind_at_once():
    """Steps within one piece of the table and across all of them, early and late, in one array."""
    s, h = np.array([0.0, 99.0, 0.5, 100.0, 1.0]), np.array([100.0, 1.0, 1.0, 0.0, 99.0])
    found = TABLE.mean_contact_compliance(s, h)
    assert found == pytest.approx([float(TABLE.mean_contact_compliance(*one)) for one in zip(s, h, strict=True)])
    assert found[0] * 100 == pytest.approx(float(TABLE.contact_integral(1.0)) + found[4] * 99, rel=1e-14, abs=0)


#: creep -> its compliance at time zero
BEGINNINGS = {
    "power": (lambda t: 2 + t**0.5, 2.0),
    "almost all at once": (lambda t: 2 - np.exp(-t / 0.4), 1.0),
    "stretched": (lambda t: 1 - 5 * np.expm1(-(t**0.4)), 1.0),
}


@pytest.mark.parametrize("name", BEGINNINGS)
def test_before_the_first_row__creep_goes_on_as_it_does_after(name):
    creep, at_once = BEGINNINGS[name]
    t = np.geomspace(1e-3, 10.0, 60)
    table = Tabulated(t, creep(t))
    assert float(table.creep_compliance(0.0)) == pytest.approx(at_once, rel=0.04, abs=0)
    early = np.geomspace(1e-5, 1e-3, 50)
    assert table.creep_compliance(early) == pytest.approx(creep(early), rel=0.08, abs=0)
    assert table.notes[0].startswith("nothing was measured before 0.001 s: the compliance at once is taken as ")


def test_before_the_first_row__a_logarithm_goes_on_for_a_decade():
    t = np.geomspace(2.0, 2e3, 20)
    table = Tabulated(t, 5.0 + 0.1 * np.log(t))
    first = 5 + 0.1 * np.log(2)
    expected = first - 0.1 * np.array([1 + np.log(10), np.log(10), np.log(2), 0])
    assert table.creep_compliance([0.0, 0.2, 1.0, 2.0]) == pytest.approx(expected, rel=1e-12, abs=0)
    assert Tabulated((2.0, 4.0), (5.0, 5.0)).creep_compliance(0.0) == 5.0
    assert Tabulated((2.0, 4.0), (5.0, 15.0)).creep_compliance(0.0) == pytest.approx(0.5)


@pytest.mark.parametrize(
    "ask",
    [
        lambda table, t: table.creep_compliance([1.0, t]),
        lambda table, t: table.contact_compliance(t),
        lambda table, t: table.contact_integral(t),
        lambda table, t: table.mean_contact_compliance(t - 1, 1.0),
    ],
)
def test_table__is_not_extrapolated(ask):
    ask(TABLE, 100.0 * (1 + 1e-13))  # rounding of a sum of steps
    with pytest.raises(InputError, match=r"asked for at 101 s, and the table ends at 100 s"):
        ask(TABLE, 101.0)
    with pytest.raises(InputError, match=r"asked for at nan s"):
        ask(TABLE, np.nan)


@pytest.mark.parametrize(
    ("times", "compliances", "message"),
    [
        ((0, 1, 2), (1, -2, 3), r"table row 1: compliance is -2: expected a finite number, not negative"),
        ((0, 1, 2), (1, 2, np.nan), r"table row 2: compliance is nan"),
        ((0, np.inf, 2), (1, 2, 3), r"table row 1: time is inf"),
        ((-1, 1, 2), (1, 2, 3), r"table row 0: time is -1"),
        ((0, 2, 1), (1, 2, 3), r"table row 2: time 1 after 2: expected ascending time"),
        ((0, 2, 2), (1, 2, 3), r"table row 2: time 2 after 2"),
        ((0, 1), (1, 2, 3), r"table has 2 of time, 3 of compliance: expected as many, at least two"),
        ((1,), (1,), r"at least two"),
        ((0, 1, 2), (1, 2, 1.9), r"table row 2: compliance 1\.9 1/Pa at 2 s is 5\.00% below an earlier row"),
        ((0, 1, 2), (0, 0, 0), r"all compliances are zero"),
    ],
)
def test_bad_table__names_the_row(times, compliances, message):
    with pytest.raises(InputError, match=message):
        Tabulated(times, compliances)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"noise": -0.1}, r"noise is -0\.1"),
        ({"noise": np.nan}, r"noise is nan"),
        ({"poisson": 0.6}, r"poisson is 0\.6"),
    ],
)
def test_bad_number__is_named(given, message):
    with pytest.raises(InputError, match=message):
        Tabulated((0, 1), (1, 2), **given)


def test_noise__is_evened_out_and_recorded():
    raw = (1.0, 2.0, 1.98, 3.0, 3.1)
    table = Tabulated((0.0, 1.0, 2.0, 3.0, 4.0), raw, noise=0.0101)
    assert table.compliances == raw
    # the mean of the two rows with relative weights 1/J^2
    level = (2.0 / 2.0**2 + 1.98 / 1.98**2) / (1 / 2.0**2 + 1 / 1.98**2)
    assert table.repaired == pytest.approx((1.0, level, level, 3.0, 3.1), rel=1e-14, abs=0)
    assert table.creep_compliance(1.5) == pytest.approx(level, rel=1e-14, abs=0)
    assert table.note == "2 of 5 rows were made to ascend by isotonic regression, by 0.51% at most"
    with pytest.raises(InputError, match=r"table row 2: .* 1\.00% below an earlier row, noise is 0\.0099"):
        Tabulated(table.times, raw, noise=0.0099)


def test_noise__counts_from_the_largest_earlier_row():
    """Small decreases that add up are no noise."""
    with pytest.raises(InputError, match="table row 3"):
        Tabulated((0, 1, 2, 3), (1.0, 0.996, 0.992, 0.988), noise=0.01)


@given(st.lists(st.floats(0.96, 1.04), min_size=4, max_size=30), st.floats(0.05, 0.9))
@examples(60)
def test_repair__ascends_within_the_noise(noise, exponent):
    t = np.geomspace(1e-3, 1e3, len(noise))
    raw = t**exponent * np.array(noise)
    table = Tabulated(t, raw, noise=0.08)
    repaired = np.array(table.repaired)
    assert (np.diff(repaired) >= 0).all()
    assert np.abs(repaired / raw - 1).max() <= 0.09
    sampled = table.creep_compliance(np.geomspace(1e-4, 1e3, 500))
    assert (np.diff(sampled) >= -1e-15 * sampled[1:]).all()
    assert ("isotonic" in table.note) == bool((np.diff(raw) < 0).any())


def test_table__is_a_plain_value():
    a, b = Tabulated([0, 1], [1, 2]), Tabulated(np.array([0.0, 1.0]), (1, 2))
    a.creep_compliance(0.5)
    assert a == b
    assert hash(a) == hash(b)
    assert a != Tabulated((0, 1), (1, 2), noise=0.1)
