"""Time steps through jumps and holds, and the pressure behind a displacement."""

import numpy as np
import pytest
from support import displaced, scene

import roughvisc as rv
from roughvisc.mechanics.stepping import march

BALL = rv.sphere(1.0, 1.6, (31, 28))


def pressed(material, program, **settings):
    return rv.simulate(BALL, material, program, fields=(), progress=False, **settings)


def test_memory_of_both_fields__knows_the_pressure_that_causes_the_displacement():
    material, program = rv.Prony(1.0, 0.0, (1.0, 2.0), (0.3, 3.0)), rv.Program().load(0.05, over=1.0)
    both, alone = (
        scene(material, program, time_step=0.1, keeps_pressure=kept, tolerance=1e-8) for kept in (True, False)
    )
    for step, other in zip(march(both), march(alone), strict=True):
        displacement, effective = both.memory.displacement(step.point.history)
        assert np.array_equal(displacement, displaced(alone, other))
        exact = both.grid.displacement(effective)
        assert np.abs(displacement - exact).max() <= 1e-6 * np.abs(exact).max()


def test_jump__shows_the_right_hand_state():
    program = rv.Program().load(0.01, over=0.5).load(0.04, over=0).hold(0.5).load(0.02, over=0)
    ds = pressed(rv.zener(1.0, 1.0, 1.0), program, tolerance=1e-2)
    assert ds.force[ds.time == 0.5].values.tolist() == [0.04]
    assert ds.time.values[-1] == 1.0
    assert ds.force.values[-1] == 0.02


def test_no_instantaneous_compliance__refuses_a_jump_of_approach_only():
    material = rv.kelvin_voigt(1.0, 1.0)
    with pytest.raises(rv.InputError, match=r"the approach jumps to 0\.01 m"):
        pressed(material, rv.Program().approach(0.01, over=0).hold(1.0))
    ds = pressed(material, rv.Program().load(0.05, over=0).hold(2.0), tolerance=1e-2, times=(0.0, 2.0))
    assert ds.force.values.tolist() == [0.0, 0.05], "at first the state before the jump"


@pytest.mark.parametrize("ratio", [1e4, 1e8])
def test_held_approach__relaxes_and_does_not_open(ratio):
    """The force falls to the ratio of the moduli within a millionth of the retardation time, and stays there."""
    relaxation = 1 / (1 + ratio)
    program = rv.Program().approach(0.05, over=0).hold(100 * relaxation)
    ds = pressed(rv.zener(1.0, 1 / ratio, 1 / ratio), program, times=(0.0, 50 * relaxation, 100 * relaxation))
    assert float(ds.force[2] / ds.force[0]) == pytest.approx(relaxation, rel=0.02)
    assert (ds.roughvisc.steps.force > 0).all()
