"""The march through time: order, tolerance, events, contact lost and found, going on from a state."""

import numpy as np
import pytest
from support import MATERIALS, STEP_LOAD, UNIT_RADIUS, displaced, scene

import roughvisc as rv
from roughvisc.mechanics import closed_forms
from roughvisc.mechanics.stepping import march

TRIANGLE = rv.Program().load(0.05, over=1.0).load(0.01, over=1.0)


def test_memory_of_both_fields__knows_the_pressure_that_causes_the_displacement():
    settings = scene(MATERIALS["two_branches"], TRIANGLE, time_step=0.1, keeps_pressure=True, tolerance=1e-8)
    alone = scene(MATERIALS["two_branches"], TRIANGLE, time_step=0.1, tolerance=1e-8)
    for step, other in zip(march(settings), march(alone), strict=True):
        displacement, effective = settings.memory.displacement(step.point.history)
        assert np.array_equal(displacement, displaced(alone, other))
        exact = settings.grid.displacement(effective)
        assert np.abs(displacement - exact).max() <= 1e-6 * np.abs(exact).max()


def test_jump__shows_the_right_hand_state():
    program = rv.Program().load(0.01, over=0.5).load(0.04, over=0).hold(0.5).load(0.02, over=0)
    steps = list(march(scene(MATERIALS["zener"], program, tolerance=1e-2)))
    at_jump = [s for s in steps if s.point.time == 0.5]
    assert len(at_jump) == 1
    assert at_jump[0].point.force == 0.04
    assert steps[-1].point.force == 0.02
    assert steps[-1].point.time == 1.0


@pytest.mark.parametrize("material", [rv.kelvin_voigt(1.0, 1.0)], ids=["kelvin_voigt"])
def test_no_instantaneous_compliance__refuses_a_jump_of_approach_only(material):
    with pytest.raises(rv.InputError, match=r"the approach jumps to 0\.01 m"):
        list(march(scene(material, rv.Program().approach(0.01, over=0).hold(1.0))))
    steps = list(march(scene(material, STEP_LOAD, tolerance=1e-2, times=(0.0, 2.0))))
    assert steps[0].point.force == 0  # the left-hand state
    exact = closed_forms.lee_radok(UNIT_RADIUS, material, 0.05)
    assert steps[-1].point.approach == pytest.approx(float(exact.approach(2.0)), rel=1e-2)


@pytest.mark.parametrize("ratio", [1e4, 1e8])
def test_held_approach__relaxes_and_does_not_open(ratio):
    """The force falls to the ratio of the moduli within a millionth of the retardation time, and stays there."""
    material = rv.zener(1.0, 1 / ratio, 1 / ratio)
    relaxation = 1 / (1 + ratio)
    program = rv.Program().approach(0.05, over=0).hold(100 * relaxation)
    steps = list(march(scene(material, program, times=(0.0, 50 * relaxation, 100 * relaxation), tolerance=1e-3)))
    at = {s.point.time: s.point.force for s in steps}
    assert at[100 * relaxation] / at[0.0] == pytest.approx(relaxation, rel=0.02)
    assert all(s.point.force > 0 for s in steps)
