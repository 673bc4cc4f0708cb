"""A pair of steps whose second one is rejected: both are taken back, and the march goes on from where they began."""

from dataclasses import fields, is_dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from support import MATERIALS, scene

import roughvisc as rv
from roughvisc.mechanics.hereditary.direct import History
from roughvisc.mechanics.stepping import march as stepping
from roughvisc.mechanics.stepping.march import march

PULLED = rv.Program().approach(0.06, over=0.7).approach(0.02, over=1.3)
TRIANGLE = rv.Program().load(0.05, over=1.0).load(0.005, over=1.0)
QUICK = rv.zener(1.0, 0.2, 0.02)
CASES = {
    "soft": (MATERIALS["zener_soft"], PULLED, {}),
    "pulled": (QUICK, PULLED, {}),
    "triangle": (QUICK, TRIANGLE, {}),
    "pressures": (QUICK, PULLED, {"acts_on": "pressure"}),
    "both": (QUICK, PULLED, {"acts_on": "both"}),
    "direct": (QUICK, PULLED, {"memory": History(QUICK)}),
}


def case(name):
    material, program, settings = CASES[name]
    memory = settings.get("memory")
    settings = {key: value for key, value in settings.items() if key != "memory"}
    made = scene(material, program, shape=(15, 14), tolerance=1e-2, **settings)
    return made if memory is None else replace(made, memory=memory)


def recorded(settings, patched):
    """Accepted steps of a march, and each step tried: the instant it was taken from, and its length. [s]"""
    tried, choose = [], stepping.step_length

    def chosen(scene, state, *others):
        tried.append((state.now.time, choose(scene, state, *others)))
        return tried[-1][1]

    patched.setattr(stepping, "step_length", chosen)
    return list(march(settings)), tried


def replayed(settings, lengths, patched):
    """The march that takes steps of these lengths, and rejects none."""
    patched.setattr(stepping, "step_length", lambda scene, state, *others: lengths[state.now.time])
    patched.setattr(stepping, "_too_long", lambda *asked: False)
    return list(march(settings))


#: What a state keeps of rejected steps: what they cost, and what they say of the length of the next.
_SPENT = ("iterations", "convolutions", "pace")


def assert_same(one, other, where=""):
    """To the last bit, but for what was spent."""
    assert type(one) is type(other), where
    if is_dataclass(one):
        for field in fields(one):
            if field.name not in _SPENT:
                assert_same(getattr(one, field.name), getattr(other, field.name), f"{where}.{field.name}")
    elif isinstance(one, tuple | list):
        assert len(one) == len(other), where
        for a, b in zip(one, other, strict=True):
            assert_same(a, b, f"{where}[]")
    else:
        assert np.array_equal(one, other), where


@pytest.mark.parametrize("name", CASES)
def test_pair_taken_back__leaves_no_trace(name, monkeypatch):
    """The march is that of one who takes the accepted steps at once: pressures, memories, companions and energies."""
    settings = case(name)
    with monkeypatch.context() as patched:
        found, tried = recorded(settings, patched)
    with monkeypatch.context() as patched:
        expected = replayed(settings, dict(tried), patched)  # the last one tried was accepted
    times = [step.shown.time for step in found]
    assert any(later < earlier for (earlier, _), (later, _) in pairwise(tried)), "nothing was taken back"
    assert times == [step.shown.time for step in expected]
    for one, other in zip(found, expected, strict=True):
        assert_same(one.state, other.state, "state")
        assert_same(one.uncertainty, other.uncertainty, "uncertainty")
        assert np.array_equal(one.displacement, other.displacement)
    assert found[-1].state.iterations > expected[-1].state.iterations  # what was taken back has been paid for


@pytest.mark.parametrize("name", CASES)
def test_first_step_after_a_corner__is_halved_until_the_second_one_finds_it_good(name, monkeypatch):
    """Nothing is extrapolated at a corner: what is too long about the first step shows in the second."""
    judged, found = [], stepping._too_long

    def asked(scene, state, segment, trial, error, shown):
        judged.append((state, found(scene, state, segment, trial, error, shown)))
        return judged[-1][1]

    monkeypatch.setattr(stepping, "_too_long", asked)
    settings = case(name)
    times = [step.shown.time for step in march(settings)]
    corner = settings.program.corners[1]
    seconds = [(state.now.time, bad) for state, bad in judged if state.before and state.before.time == corner]
    assert [bad for _, bad in seconds] == [True] * (len(seconds) - 1) + [False]
    assert len(seconds) > 1
    assert times[times.index(corner) + 1] == seconds[-1][0]
    firsts = [time - corner for time, _ in seconds]
    assert all(after <= 0.51 * before for before, after in pairwise(firsts))
