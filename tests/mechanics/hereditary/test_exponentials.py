"""The hereditary integral, one scalar cell: exactness, order, positivity at the extremes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, series
from support import direct as displaced

import roughvisc as rv
from roughvisc.mechanics.hereditary.exponentials import Modes, padded
from roughvisc.mechanics.hereditary.memory import mean_compliance, old_weight

CELL = (1, 1)


def remembered(material, times, pressures, rules):
    """``q`` at the end of each step of a given pressure history."""
    memory = Modes(material)
    state = memory.start(CELL)
    found = []
    for n, rule in enumerate(rules, start=1):
        step = times[n] - times[n - 1]
        if n == 1 and pressures[0]:
            state = memory.advance(state, 0.0, "linear", np.full(CELL, pressures[0]))
        alpha, carried = memory.predict(state, step, rule)
        found.append(float(alpha * pressures[n] + carried[0, 0]))
        state = memory.advance(state, step, rule, np.full(CELL, pressures[n]))
    return np.array(found)


def direct(material, times, pressures):
    """Exact hereditary integral of the piecewise-linear pressure, from the antiderivative of the compliance."""
    found = []
    for n in range(1, len(times)):
        total = material.contact_compliance(times[n]) * pressures[0]
        for k in range(1, n + 1):
            weight = material.contact_integral(times[n] - times[k - 1]) - material.contact_integral(times[n] - times[k])
            total += weight / (times[k] - times[k - 1]) * (pressures[k] - pressures[k - 1])
        found.append(float(total))
    return np.array(found)


@st.composite
def histories(draw):
    steps = draw(st.lists(st.floats(1e-2, 10.0), min_size=2, max_size=12))
    times = np.concatenate([[0.0], np.cumsum(steps)])
    pressures = draw(st.lists(st.floats(0, 1e3), min_size=times.size, max_size=times.size))
    material = draw(series(st.floats(0.01, 10), st.floats(0.01, 10), st.floats(1e-2, 1e2), (0.0, 0.3)))
    return material, times, np.array(pressures)


@given(histories())
@examples(60)
def test_linear_rule__is_exact_for_piecewise_linear_pressure(history):
    material, times, pressures = history
    found = remembered(material, times, pressures, ["linear"] * (times.size - 1))
    expected = direct(material, times, pressures)
    scale = float(material.contact_compliance(times[-1])) * (1 + np.max(pressures))
    steps = np.diff(times)
    assert np.abs(found - expected).max() <= 50 * np.finfo(float).eps * times[-1] / steps.min() * scale


@pytest.mark.parametrize(
    ("rule", "order"), [("linear", 2), ("bdf2", 2), ("euler", 1), ("right", 1)], ids=lambda v: str(v)
)
def test_rules__have_their_order(rule, order):
    """Smooth pressure; largest error at eight times, against the linear rule on a far finer grid."""
    material = rv.Prony(1.0, 0.5, (2.0, 1.0), (0.3, 2.0))

    def at_eighths(steps, rules):
        times = np.linspace(0, 2, steps + 1)
        return remembered(material, times, 1 - np.cos(times), rules)[steps // 8 - 1 :: steps // 8]

    exact = at_eighths(4000, ["linear"] * 4000)
    counts = np.array([16, 32, 64, 128, 256])
    errors = []
    for n in counts:
        rules = ["euler" if rule == "bdf2" else rule] + [rule] * (n - 1)
        errors.append(np.abs(at_eighths(n, rules) - exact).max())
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("rule", ["linear", "bdf2", "euler", "right"])
@pytest.mark.parametrize("x", [1e-15, 1e-6, 0.29, 0.31, 1e3, 1e15])
def test_coefficients__keep_a_constant_at_any_step(rule, x):
    """Steady pressure stays steady: the weights of each mode sum to one, and the new one is positive."""
    memory = Modes(rv.Prony(1.0, compliances=(1.0,), times=(1.0,)))
    state = memory.start(CELL)
    state = memory.advance(state, 1e9, "euler", np.ones(CELL))  # relaxed
    state = memory.advance(state, x, "euler", np.ones(CELL))
    alpha, carried = memory.predict(state, x, rule)
    assert alpha > 0.25  # (1 - nu)/2 times the glassy part
    assert float(alpha + carried[0, 0]) == pytest.approx(0.5, rel=1e-8)


def test_old_weight__tells_what_a_linear_step_does():
    def weight(material, step):
        return old_weight(float(material.contact_compliance(step)), mean_compliance(material, step))

    assert weight(rv.elastic(1.0), 1.0) == pytest.approx(0, abs=1e-15)
    assert weight(rv.kelvin_voigt(1.0, 1.0), 1e-6) == pytest.approx(1, rel=1e-5)
    assert weight(rv.maxwell(1.0, 1.0), 2.0) == pytest.approx(0.5)
    assert mean_compliance(rv.maxwell(1.0, 1.0), 0.0) == pytest.approx(0.25)


def test_jump__changes_the_field_and_nothing_of_what_is_remembered():
    memory = Modes(rv.Prony(1.0, 0.2, (1.0, 2.0), (0.3, 3.0)))
    rng = np.random.default_rng(1)
    before = memory.advance(memory.start((3, 2)), 0.4, "linear", rng.random((3, 2)))
    after = memory.advance(before, 0.0, "linear", field := rng.random((3, 2)))
    np.testing.assert_array_equal(after.modes, before.modes)
    assert after.field is field
    with pytest.raises(ValueError, match="two states"):  # none reaches behind a jump
        memory.predict(after, 0.1, "bdf2")
    # what a step after it sees is the new field from its beginning on
    alpha, carried = memory.predict(after, 0.1, "linear")
    held = memory.factor * float(memory.material.creep_compliance(0.1))
    past = memory.predict(memory.advance(before, 0.0, "linear", np.zeros((3, 2))), 0.1, "linear")[1]
    np.testing.assert_allclose(carried + alpha * field, past + held * field, rtol=1e-12)


def test_larger_grid__holds_what_the_smaller_displaces():
    """A memory of both forms: each pressure in its place, and displacements of it everywhere."""
    shape, larger, offset, spacing = (3, 2), (6, 7), (2, 3), (1.0, 0.7)
    rng = np.random.default_rng(5)
    memory = Modes(rv.Prony(1.0, 0.5, (1.0,), (0.3,)), "both")
    state, again = memory.start(shape), memory.start(larger)
    for step in (0.2, 0.4):
        p = rng.random(shape)
        wide = np.zeros(larger)
        wide[2:5, 3:5] = p
        state = memory.advance(state, step, "linear", np.stack((p, displaced(p, spacing))))
        again = memory.advance(again, step, "linear", np.stack((wide, displaced(wide, spacing))))
    moved = memory.enlarged(state, larger, offset, lambda pressure: displaced(pressure, spacing))
    assert moved.step == state.step
    for name in ("modes", "field", "earlier"):
        assert getattr(moved, name) == pytest.approx(getattr(again, name), rel=1e-12), name
    assert memory.enlarged(memory.restart(state), larger, offset, np.copy).earlier is None
    assert padded(np.ones((2, 1, 1)), (2, 3), (1, 2)).tolist() == [[[0, 0, 0], [0, 0, 1]]] * 2
    with pytest.raises(ValueError, match="cannot be enlarged"):
        Modes(rv.maxwell(1.0, 1.0)).enlarged(state, larger, offset, np.copy)


@pytest.mark.parametrize("rule", ["linear", "bdf2", "euler", "right"])
def test_next_state__is_what_was_foretold(rule):
    """``q = alpha p + carried`` is the compliance of the modes after the step, with unequal steps too."""
    series = rv.Prony(1.0, 0.5, (1.0, 2.0), (0.3, 3.0))
    memory = Modes(series)
    rng = np.random.default_rng(6)
    state = memory.advance(memory.start((2, 3)), 0.4, "euler", rng.random((2, 3)))
    state = memory.advance(state, 0.7, "euler", rng.random((2, 3)))
    alpha, carried = memory.predict(state, 0.25, rule)
    after = memory.advance(state, 0.25, rule, field := rng.random((2, 3)))
    weights = np.array([1.0, 2.0, 0.5])
    expected = memory.factor * (series.glassy * field + np.tensordot(weights, after.modes, 1))
    assert alpha * field + carried == pytest.approx(expected, rel=1e-12)
    assert after.earlier is state.modes
    assert after.step == 0.25


@pytest.mark.parametrize("rule", ["linear", "bdf2", "euler", "right"])
def test_fluidity__under_a_ramp_flows_as_each_rule_has_it(rule):
    """Flow ``t^2 / 2`` under the pressure ``t``: exact by both rules of second order, else with the last."""
    memory = Modes(rv.Prony(1.0, 0.8))
    state = memory.start(CELL)
    for step, time in ((0.5, 0.5), (0.3, 0.8)):
        state = memory.advance(state, step, "linear", np.full(CELL, time))
    alpha, carried = memory.predict(state, 0.2, rule)
    flow = 0.5 if rule in ("linear", "bdf2") else 0.32 + 0.2
    assert float(alpha + carried[0, 0]) == pytest.approx(memory.factor * (1.0 + 0.8 * flow), rel=1e-13)
    assert memory.advance(state, 0.2, rule, np.ones(CELL)).modes[0, 0, 0] == pytest.approx(flow, rel=1e-13)
