"""Memory of a body: closed forms of the recursion, its order, and what relaxation leaves of an error."""

from itertools import pairwise

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics.memory import Memory

SHAPE = (3, 2)
FIELD = np.arange(1.0, 7.0).reshape(SHAPE)
SERIES = {
    "zener": rv.zener(1.0, 0.5, 0.1),
    "fluid": rv.Prony(1.0, 2.0, (0.5,), (0.3,)),
    "ten decades": rv.Prony(0.1, 0.0, (1.0, 2.0, 0.3), (1e-7, 0.2, 1e3)),
}


def history_after(memory, steps, unit_at, rule):
    """Memory after steps at whose ends the displacement per unit compliance is ``unit_at(t)`` times a field."""
    history, time = memory.start(np.zeros(SHAPE)), 0.0
    for step in steps:
        time += step
        used = "constant" if rule == "bdf2" and history.earlier is None else rule
        prediction = memory.predict(history, step, used)
        unit = unit_at(time) * FIELD
        predicted = prediction.compliance * unit + prediction.carried
        history = memory.advance(history, prediction, unit, unit)
        np.testing.assert_allclose(memory.displacement(history)[0], predicted, rtol=1e-12)
    return history


@pytest.mark.parametrize("name", SERIES)
def test_linear_rule__is_exact_for_a_ramp(name):
    """Under ``v = t`` the displacement is the integral of the compliance."""
    memory, time = Memory(SERIES[name], 10.0), 1.7
    history = history_after(memory, [0.1, 0.7, 0.05, 0.85], lambda t: t, "linear")
    exact = float(SERIES[name].contact_integral(time)) * FIELD
    np.testing.assert_allclose(memory.displacement(history)[0], exact, rtol=1e-12)


@pytest.mark.parametrize("name", SERIES)
def test_constant_rule__is_exact_for_a_step(name):
    """Under ``v = 1`` the displacement is the compliance."""
    memory = Memory(SERIES[name], 10.0)
    history = history_after(memory, [0.01, 0.4, 3.0], lambda _: 1.0, "constant")
    np.testing.assert_allclose(memory.displacement(history)[0], memory.compliance(3.41) * FIELD, rtol=1e-12)


@pytest.mark.parametrize("name", SERIES)
def test_bdf2__converges_at_second_order(name):
    """Under ``v = t^2`` the displacement is twice the integral of the integral of the compliance."""
    memory, errors = Memory(rv.Prony(1e-3, 0.0, SERIES[name].compliances, SERIES[name].times), 10.0), []
    assert memory.may_ring
    fine = history_after(memory, np.full(4000, 1 / 4000), lambda t: t**2, "linear")
    for count in (20, 40):
        steps = np.tile([0.7, 1.3], count // 2) / count
        history = history_after(memory, steps, lambda t: t**2, "bdf2")
        errors.append(np.abs(memory.displacement(history)[0] - memory.displacement(fine)[0]).max())
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.3)


def test_error__relaxes_faster_than_it_creeps():
    """One mode at a held displacement decays with the relaxation time, C(0)/C(inf) of the retardation time."""
    memory = Memory(rv.zener(1.0, 0.25, 0.25), 10.0)  # retarded in 1 s, five times as compliant in the end
    assert memory.remaining(0.3) == pytest.approx(np.exp(-0.3 * 5), rel=1e-12)
    assert Memory(rv.maxwell(1.0, 2.0), 10.0).remaining(0.3) == pytest.approx(np.exp(-0.15), rel=1e-12)
    assert Memory(rv.kelvin_voigt(1.0, 1.0), 10.0).remaining(0.3) == 1.0
    many = Memory(SERIES["ten decades"], 10.0)
    left = [many.remaining(time) for time in (0.0, 1e-3, 0.1, 10.0)]
    assert left[0] == pytest.approx(1.0)
    assert all(after < before for before, after in pairwise(left))
