"""The paper's algorithm: where its printed equations fail, and agreement with the package."""

import math

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.errors import ConvergenceError
from roughvisc.mechanics import closed_forms
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.paper import conjugate_gradients, press

ZENER = rv.zener(1.0, 1.0, 1.0)


def paraboloid(n, size):
    x = (np.arange(n) - n // 2) * size / n
    return Grid((n, n), (size / n, size / n)), (x[:, None] ** 2 + x[None, :] ** 2) / 2


def hertz_run(sign):
    operator, gap = paraboloid(65, 1.6)
    return conjugate_gradients(operator, gap, 0.25, 0.1, epsilon=1e-10, sign=sign, most=600)


def test_printed_sign_of_equation_9__stalls_where_the_right_one_converges():
    _, approach, iterations = hertz_run(+1.0)
    assert iterations < 100
    assert approach == pytest.approx(closed_forms.hertz(1.0, 4.0, 0.1).approach, rel=1e-3)
    with pytest.raises(ConvergenceError, match="600"):
        hertz_run(-1.0)


@pytest.mark.thorough
def test_pressure__comes_near_that_of_simulate_with_the_step():
    """Of first order: to the pressure at the end of a load that is held."""
    n, size, load, duration = 33, 1.6, 0.05, 2.0
    operator, gap = paraboloid(n, size)
    ball = rv.from_array(gap.max() - gap, size / n)
    program = rv.Program().load(load, over=0).hold(duration)
    settings = {"boundary": "free", "edge": "accept", "tolerance": 1e-6, "progress": False}
    ours = rv.simulate(ball, ZENER, program, times=[duration], **settings)
    steps, errors = np.array([10, 20, 40, 80]), []
    for count in steps:
        instants = np.linspace(0, duration, count + 1)
        *_, last = press(operator, gap, ZENER.contact_compliance, lambda _: load, instants, epsilon=1e-8)
        time, pressure, approach = last
        assert time == duration
        assert pressure.sum() * operator.cell_area == pytest.approx(load, rel=1e-12)
        errors.append(np.abs(pressure - ours.pressure[0].values).sum() / pressure.sum())
        # while the contact grows, its area and its approach depend on the compliance at the end alone
        assert approach == pytest.approx(float(ours.approach[0]), rel=1e-6)
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 0.8 < order < 1.3


@pytest.mark.parametrize("over_the_bound", [0.9, 1.1])
def test_rectangle_rule__is_unstable_beyond_its_bound(over_the_bound):
    """A wave in full contact: its pressure follows the relaxation modulus, or alternates and grows."""
    n, tau, ratio = 16, 1.0, 4.0
    step = over_the_bound * 2 * tau * math.atanh(1 / ratio)
    soft = rv.Prony(1.0, 0.0, (ratio,), (tau,))
    wave = 1e-3 * np.cos(2 * np.pi * np.arange(n) / n)[:, None] * np.ones((1, n))
    grid = Grid((n, n), (1.0, 1.0), "periodic")
    instants = step * np.arange(200)
    steps = press(grid, 1e-3 - wave, soft.contact_compliance, lambda _: 1.0 * n * n, instants, epsilon=1e-12)
    amplitudes = []
    for _, pressure, _ in steps:
        assert pressure.min() > 0
        amplitudes.append(2 * np.mean(pressure * wave) / 1e-3)
        if len(amplitudes) > 20 and abs(amplitudes[-1]) > 10 * amplitudes[0]:
            break
    if over_the_bound < 1:
        assert amplitudes[-1] == pytest.approx(amplitudes[0] / (1 + ratio), rel=1e-6)
    else:
        assert abs(amplitudes[-1]) > 10 * amplitudes[0]
