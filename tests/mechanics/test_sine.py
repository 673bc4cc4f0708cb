"""Loads that follow a sine: how finely its cycles are resolved where no error asks for it."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.memory import Memory
from roughvisc.mechanics.stepping import Scene, march

SHAPE, MEAN, AMPLITUDE, PERIOD = (5, 4), 1.0, 0.5, 1.0


def punch(material, program, **settings):
    """A flat punch of five by four cells, all of them always in contact: approach is linear in load."""
    operator = Grid(SHAPE, (1.0, 1.2))
    memory = Memory(material, program.duration)
    return march(Scene(operator, np.zeros(SHAPE), memory, program, settings.pop("times", None), **settings))


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
@pytest.mark.parametrize("creep", [1e-2, 1e-3])
def test_slightly_lossy_material__dissipates_what_a_linear_one_does(creep, tolerance):
    """A nearly elastic body creeps by less than the tolerance: steps longer than a cycle would err by no more.

    With ``C = C0 (1 + creep (1 - exp(-t/tau)))`` the loss compliance at ``omega tau = 1`` is ``C0 creep / 2``, and a
    cycle of the load loses ``pi F^2`` times that, times the punch's approach over load and compliance. The transient
    of the start has fallen to ``exp(-4 pi)`` when the third cycle begins.
    """
    elastic = rv.elastic(1.0)
    glassy = float(elastic.contact_compliance(0.0))
    (pressed,) = punch(elastic, rv.Program().load(1.0, over=0))
    exact = np.pi * AMPLITUDE**2 * pressed.point.approach * creep / 2
    lossy = rv.Prony(4 * glassy, 0.0, (4 * glassy * creep,), (PERIOD / (2 * np.pi),))
    program = rv.Program.cycle(MEAN, AMPLITUDE, PERIOD, 3)
    at = {step.point.time: step for step in punch(lossy, program, times=(2.0, 3.0), tolerance=tolerance)}
    cycle = at[3.0].state.work - at[2.0].state.work  # it ends as it began: nothing more is stored
    assert cycle == pytest.approx(exact, rel=2e-2)
