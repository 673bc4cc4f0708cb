"""Which memory models a material, and what it says of itself."""

import re

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics.hereditary.choice import SERIES_SHARE, choose_memory
from roughvisc.mechanics.hereditary.direct import History
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


def fluid(relaxation):
    """Maxwell fluid with a compliance of one plus the age over the relaxation time, but for a factor."""
    return rv.Prony(1.0, 1 / relaxation)


@pytest.mark.parametrize("duration", [1.0, 5e-14, 3e6])
def test_direct_history__is_offered_where_steps_of_a_thousandth_do_not_ring(duration):
    """A linear step of a fluid rings from twice its relaxation time on; steps are halves of the program."""
    shortest = duration / 512  # of those of a thousandth at least
    choice = choose_memory(fluid(0.505 * shortest), duration, 1e-3, kind="direct")
    assert isinstance(choice.memory, History)
    assert (choice.series_error, choice.note) == (0.0, "direct history of every pressure, as asked for")
    with pytest.raises(rv.InputError, match="oscillates for this material"):
        choose_memory(fluid(0.495 * shortest), duration, 1e-3, kind="direct")


def test_direct_history__is_refused_where_nothing_gives_way_at_once():
    with pytest.raises(rv.InputError, match="an instantaneous compliance that is not small"):
        choose_memory(rv.kelvin_voigt(1.0, 1.0), 1.0, 1e-3, kind="direct")
    # jumps alone know no step that may ring
    for material in (rv.kelvin_voigt(1.0, 1.0), Dented(1.0)):
        assert isinstance(choose_memory(material, 0.0, 1e-3, kind="direct").memory, History)


class Dented:
    """A compliance of one that falls to a half for good at some age: no creep compliance."""

    def __init__(self, age):
        self.age = age

    def contact_compliance(self, t):
        return np.where(t < self.age, 1.0, 0.5)

    def contact_integral(self, t):
        return np.where(t < self.age, t, 0.5 * (t + self.age))


@pytest.mark.parametrize("age", [2e-6, 1e-3, 0.9])
def test_direct_history__looks_at_a_material_of_the_users_own_from_a_millionth_of_the_program_on(age):
    duration = 40.0
    with pytest.raises(rv.InputError, match=r"Dented\.contact_compliance is 0\.5") as refused:
        choose_memory(Dented(age * duration), duration, 1e-3, kind="direct")
    found = float(re.search(r" at ([\d.e+-]+) s", str(refused.value))[1])
    assert age * duration <= found < 1.03 * age * duration, "a hundred instants in a decade"


def test_jumps_alone__ask_for_the_instantaneous_compliance_only():
    for material, note in (
        (rv.PowerLaw(0.1, 1.0, 0.3), "instantaneous"),
        (rv.PowerLaw(0.0, 1.0, 0.3), "no instantaneous"),
    ):
        choice = choose_memory(material, 0.0, 1e-3)
        assert isinstance(choice.memory, History)
        assert (choice.series_error, choice.note) == (0.0, f"{note} compliance")


@pytest.mark.parametrize(
    ("material", "duration", "rings"),
    [
        # of a fluid (1 + h/t) / (1 + h/2t), which is 1.45 at h = 1.636 t
        (fluid(1.0), 1.60, False),
        (fluid(1.0), 1.67, True),
        # of what creeps tenfold a millionth of the program after the load, and no more later
        (rv.Prony(1.0, 0.0, (10.0,), (1e-6,)), 1.0, True),
        (rv.Prony(1.0, 0.0, (0.2,), (1e-6,)), 1.0, False),
        (fluid(1.0), 0.0, False),
    ],
)
def test_two_step_rule__is_there_where_a_linear_step_may_ring(material, duration, rings):
    memory = choose_memory(material, duration, 1e-3).memory
    assert set(memory.rules) == {"linear", "euler", "right"} | ({"bdf2"} if rings else set())
