"""Which memory models a material, and what it says of itself."""

import re

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics.hereditary.choice import SERIES_SHARE, choose_memory
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.mechanics.materials.passive import smallest_loss

ROWS = np.geomspace(1e-3, 10.0, 40)
NOISY = 1 + 0.01 * np.random.default_rng(1).standard_normal(40)


@pytest.mark.parametrize(
    ("material", "note"),
    [
        (rv.elastic(1.0), "no memory: elastic"),
        (rv.zener(1.0, 1.0, 1.0), "1 exponential"),
        (rv.maxwell(1.0, 1.0), "a fluidity"),
        (rv.Prony(1.0, 1.0, (1.0, 2.0), (1.0, 3.0)), "2 exponentials and a fluidity"),
    ],
)
def test_series__is_its_own_memory(material, note):
    choice = choose_memory(material, 10.0, 1e-3)
    assert isinstance(choice.memory, Modes)
    assert choice.memory.material is material
    assert (choice.series_error, choice.note) == (0.0, note)


@pytest.mark.parametrize("exponent", [0.2, 0.5, 0.8])
def test_power_law__has_a_certified_series(exponent):
    material = rv.PowerLaw(0.1, 1.0, exponent)
    choice = choose_memory(material, 10.0, 1e-3)
    assert isinstance(choice.memory, Modes)
    assert choice.series_error <= SERIES_SHARE * 1e-3
    t = np.geomspace(1e-5, 10.0, 777)
    off = choice.memory.material.contact_compliance(t) / material.contact_compliance(t) - 1
    assert np.abs(off).max() <= 1.02 * choice.series_error


@pytest.mark.parametrize("exponent", [0.1, 0.5])
@pytest.mark.parametrize("glassy", [0.0, 0.01, 0.3])
def test_power_law__is_right_at_once_and_from_the_shortest_age_on(exponent, glassy):
    material = rv.PowerLaw(glassy, 1.0, exponent)
    choice = choose_memory(material, 1e4, 1e-3, shortest=1e-7)
    series = choice.memory.material
    assert series.glassy == glassy
    t = np.geomspace(1e-7, 1e4, 977)
    off = series.contact_compliance(t) / material.contact_compliance(t) - 1
    assert np.abs(off).max() <= 1.02 * choice.series_error <= 1.02 * SERIES_SHARE * 1e-3
    early = np.geomspace(1e-12, 1e-7, 200)
    crept = float(material.contact_compliance(1e-7) - material.contact_compliance(0.0))
    assert np.abs(series.contact_compliance(early) - material.contact_compliance(early)).max() <= 1.001 * crept
    assert choice.note.endswith(f"within {choice.series_error:.1e} of it at once and from 1e-07 s")


def percentages(note):
    return [float(number) / 100 for number in re.findall(r"([\d.]+) %", note)]


@pytest.mark.parametrize("first", [(), (0.0,)])
def test_noisy_table__is_made_passive_and_says_how_far_off_the_rows_are(first):
    t = np.append(first, ROWS)
    raw = np.append(np.zeros(len(first)), ROWS**0.4 * NOISY)
    material = rv.Tabulated(t, raw, noise=0.1)
    choice = choose_memory(material, 10.0, 1e-3)
    assert isinstance(choice.memory, Modes)
    assert choice.series_error == 0
    assert choice.material is choice.memory.material
    assert choice.material.glassy == material.creep_compliance(0.0)
    off = (choice.material.creep_compliance(t) - raw) / np.where(raw > 0, raw, 1.0)
    assert percentages(choice.note) == pytest.approx([np.abs(off).max(), np.sqrt(np.mean(off**2))], rel=0.05)
    assert np.abs(off).max() < 0.05, "noise of 1 %, evened out"


def test_direct_history__says_that_a_table_is_not_passive():
    smooth = rv.Tabulated(ROWS, 0.5 + ROWS**0.4)
    assert choose_memory(smooth, 10.0, 1e-3, kind="direct").note == "direct history of every pressure, as asked for"
    steep = rv.Tabulated((0.0, 1.0, 2.0, 3.0), (1.0, 1.0, 2.0, 2.0))
    note = choose_memory(rv.pair(steep, rv.elastic(1e9)), 3.0, 1e-3, kind="direct").note
    found = float(re.search(r"the table is not passive: .* falls to (-[\d.]+)", note)[1])
    assert found == pytest.approx(smallest_loss(steep), rel=0.02)


def test_table_shorter_than_the_program__is_refused():
    material = rv.Tabulated(tuple(ROWS), tuple(0.5 + ROWS**0.4))
    with pytest.raises(rv.InputError, match="the table ends at 10 s"):
        choose_memory(material, 11.0, 1e-3)
