"""Surfaces that are apart: the first time at which they touch again, however late and however brief."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support import displaced, scene

import roughvisc as rv
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.memory import Memory
from roughvisc.mechanics.stepping import Scene, march

MATERIAL = rv.zener(1.0, 1.0, 0.05)


def sphere(program, material=MATERIAL, **settings):
    return scene(material, program, shape=(9, 7), size=0.9, **settings)


def contacts(steps):
    """How often contact begins."""
    touching = [False] + [step.point.force > 0 for step in steps]
    return sum(now and not before for before, now in pairwise(touching))


AMPLITUDE, PERIOD = 0.03, 1.0


def tapping(cycles):
    """About half an amplitude outside: contact in a third of each cycle."""
    return rv.Program.cycle(-0.5 * AMPLITUDE, AMPLITUDE, PERIOD, cycles, control="approach")


def test_taps__work_as_in_steps_eight_times_as_short():
    cycles = 3
    found, finer = (
        list(march(sphere(tapping(cycles), times=(cycles * PERIOD,), **how)))
        for how in ({"tolerance": 1e-4}, {"time_step": PERIOD / 512, "tolerance": 1e-6})
    )
    assert contacts(found) == contacts(finer) == cycles
    assert found[-1].state.work == pytest.approx(finer[-1].state.work, rel=5e-3)


def found_again(steps, after):
    """Time up to which surfaces that were apart stayed apart."""
    apart_since = next(i for i, step in enumerate(steps) if step.point.time >= after and step.point.force == 0)
    first = next(i for i, step in enumerate(steps) if i > apart_since and step.point.force > 0)
    return steps[first - 1].point.time


def test_dent_of_a_punch__is_touched_again_when_it_has_recovered_so_far():
    """One retarded mode is left in it, which decays as a whole: the time is known."""
    program = rv.Program().load(1.0, over=0).hold(0.5).load(0.0, over=0).hold(0.3)
    shape = (9, 7)
    x, y = (np.arange(n) - n // 2 for n in shape)
    present = x[:, None] ** 2 + y[None, :] ** 2 < 6
    half_space, material = Grid(shape, (1.0, 1.0)), rv.zener(1.0, 0.5, 0.5)  # retarded in 1 s
    memory = Memory(material, 3.0)
    first = Scene(half_space, np.zeros(shape), memory, program, present=present)
    left = list(march(first))[-1].point.approach  # where it would be touched
    assert left > 0
    second = replace(first, program=program.approach(0.6 * left, over=0).hold(2.0))
    assert found_again(list(march(second)), 0.8) == pytest.approx(0.8 + math.log(1 / 0.6), abs=1e-7)


@pytest.mark.parametrize("end", [-0.02, 0.012, 0.02], ids=["falling_fast", "falling", "held"])
def test_recovery__overtakes_an_approach(end):
    """A sphere pulled off its dent: the surface comes up faster than the approach goes down, or not at all."""
    pulled, over, height = 1.0, 4.0, 0.02
    program = rv.Program().approach(0.05, over=0).hold(pulled).approach(height, over=0).approach(end, over=over)
    scene = sphere(program, rv.zener(1.0, 0.2, 0.2), tolerance=1e-3, times=(pulled, pulled + over))
    steps = list(march(scene))
    dent = next(displaced(scene, step) for step in steps if step.point.time == pulled)
    assert next(step.point.force for step in steps if step.point.time == pulled) == 0
    times = np.linspace(0, over, 4001)
    limit = np.array([np.min(scene.gap + dent * np.exp(-t)) for t in times])  # retarded in 1 s
    above = height + (end - height) * times / over > limit
    if end < 0:
        assert not above.any()
        assert steps[-1].point.force == 0
    else:
        assert found_again(steps, pulled) - pulled == pytest.approx(times[np.argmax(above)], abs=over / 4000)


def test_load_that_is_zero_for_an_instant__is_no_gap_in_the_contact():
    program = rv.Program.cycle(0.01, 0.01, 1.0, 3)
    scene = sphere(program, times=(0.75, 1.75, 2.75, 3.0), tolerance=1e-2)
    steps = list(march(scene))
    forces = {step.point.time: step.point.force for step in steps}
    assert all(forces[t] <= 1e-12 for t in (0.75, 1.75, 2.75))
    assert forces[3.0] == pytest.approx(0.01)
    assert len([s for s in steps if s.point.force > 0]) > 30
    ramp = rv.Program().load(0.01, over=1.0).load(0.0, over=1.0).load(0.01, over=1.0)
    at = {step.point.time: step.point.force for step in march(sphere(ramp, times=(1.0, 2.0, 2.001, 3.0)))}
    assert at[2.0] == 0
    assert at[2.001] == pytest.approx(1e-5)


@pytest.mark.parametrize("lead", [0.0, 0.4])
def test_contact_at_the_very_first_instant__is_not_put_off(lead):
    """From rest at first touch, or on the dot of an event: whatever goes in touches at once."""
    program = rv.Program().approach(0.0, over=lead) if lead else rv.Program()
    scene = sphere(program.approach(0.02, over=1.0), times=(lead + 0.25, lead + 1.0), tolerance=1e-2)
    steps = list(march(scene))
    assert all(step.point.force > 0 for step in steps if step.point.time > lead)


@pytest.mark.thorough
def test_row_just_before_an_imprint_closes__states_the_force_to_which_it_jumps():
    """A Kelvin-Voigt body carries a large force as soon as its imprint closes: a row at that time may be either."""
    program = rv.Program().approach(0.05, over=0.5).approach(-0.02, over=0.1).approach(0.05, over=0.2)
    body = rv.kelvin_voigt(1.0, 1.0)
    apart = found_again(list(march(sphere(program, body, tolerance=1e-3))), 0.5)
    late = sphere(program, body, times=(apart - 1e-7,), tolerance=1e-3)  # hardly longer than the resolution of the time
    assert list(march(late))[-1].point.time == 0.8
    for _ in range(3):  # the steps, and with them the time, depend a little on the kept times
        kept = (apart - 1e-7, apart + 1e-4)
        apart = found_again(list(march(sphere(program, body, times=kept, tolerance=1e-3))), 0.5)
    kept = (apart - 1e-7, apart + 1e-4)
    before, after = (
        step for step in march(sphere(program, body, times=kept, tolerance=1e-3)) if step.point.time in kept
    )
    assert before.point.force == 0
    assert after.point.force > 0.05 * before.state.largest_force
    assert before.errors.force >= after.point.force
    (early,) = (one for one in march(sphere(program, body, times=(apart - 2e-3,))) if one.point.time == apart - 2e-3)
    assert early.point.force == early.errors.force == 0
