"""The direct history: the recursion's numbers for any series, any steps, jumps, and a larger grid."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, seeds, series

import roughvisc as rv
from roughvisc.mechanics.hereditary.direct import History
from roughvisc.mechanics.hereditary.exponentials import Modes

SHAPE = (3, 4)


def run(memory, steps, fields):
    """Effective pressure after each step."""
    state = memory.start(SHAPE)
    found = []
    for step, field in zip(steps, fields, strict=True):
        alpha, carried = memory.predict(state, step, "linear")
        found.append(alpha * field + carried)
        state = memory.advance(state, step, "linear", field)
    return found, state


@given(
    material=series(st.floats(0.01, 1), st.floats(0.01, 10), st.floats(1e-3, 1e3), (0.0, 0.2)),
    steps=st.lists(st.one_of(st.just(0.0), st.floats(1e-3, 10.0)), min_size=1, max_size=80),
    seed=seeds,
)
@examples(60)
def test_direct_and_recursive_memory__agree(material, steps, seed):
    """The same weights, to rounding: jumps are steps of no length; cells come into contact and leave it."""
    rng = np.random.default_rng(seed)
    fields = [rng.random(SHAPE) * (rng.random(SHAPE) < 0.6) for _ in steps]
    direct, _ = run(History(material), steps, fields)
    recursive, _ = run(Modes(material), steps, fields)
    total = sum(steps)
    shortest = min((s for s in steps if s > 0), default=1.0)
    scale = float(material.contact_compliance(total))
    allowed = 50 * np.finfo(float).eps * max(total / shortest, 1) * scale
    assert np.abs(np.array(direct) - np.array(recursive)).max() <= allowed


@pytest.mark.parametrize(
    "material",
    [rv.PowerLaw(0.2, 1.0, 0.4), rv.Tabulated((0.0, 1.0, 3.0, 9.0), (1.0, 2.0, 2.5, 2.6))],
    ids=["power", "table"],
)
def test_direct_history__is_exact_for_linear_pressure(material):
    """A ramp, then a hold: against the antiderivative of the compliance."""
    times = np.array([0.0, 0.3, 1.0, 1.7, 2.2])
    pressure = np.minimum(times, 1.0)
    found, _ = run(History(material), np.diff(times), [np.full(SHAPE, p) for p in pressure[1:]])
    for t, q in zip(times[1:], found, strict=True):
        exact = material.contact_integral(t) - material.contact_integral(max(t - 1.0, 0.0))
        assert q == pytest.approx(np.full(SHAPE, exact), rel=1e-12)


def test_enlarged__is_the_same_history_on_a_larger_grid():
    rng = np.random.default_rng(2)
    steps, fields = [0.2] * 40, [rng.random(SHAPE) for _ in range(40)]
    for memory in (History(rv.zener(1.0, 1.0, 1.0)), Modes(rv.zener(1.0, 1.0, 1.0), "pressure")):
        _, state = run(memory, steps, fields)
        alpha, carried = memory.predict(state, 0.1, "linear")
        moved = memory.enlarged(state, (6, 9), (2, 3), np.cumsum)
        alpha_moved, carried_moved = memory.predict(moved, 0.1, "linear")
        assert alpha_moved == alpha
        assert np.array_equal(carried_moved[2:5, 3:7], carried)
        assert np.count_nonzero(carried_moved) == carried.size


def test_constant_pressure__by_the_rule_of_a_jump_at_the_start_of_the_step():
    """Each pressure came at the start of its step and has crept since."""
    memory = History(rv.PowerLaw(0.3, 1.0, 0.4))
    alpha, carried = memory.predict(memory.start(SHAPE), 0.7, "right")
    assert alpha == pytest.approx(float(memory.material.contact_compliance(0.7)))
    assert not carried.any()
