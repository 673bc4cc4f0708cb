"""What is left of the error of a step, against the ordinary differential equations that it stands for."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import scene

import roughvisc as rv
from roughvisc.mechanics.stepping import controller as control
from roughvisc.mechanics.stepping import controller as module
from roughvisc.mechanics.stepping.controller import Fading
from roughvisc.mechanics.stepping.march import march

SERIES = {
    "zener": rv.Prony(1.0, 0.0, (2.0,), (0.7,)),
    "three": rv.Prony(1.0, 0.0, (0.5, 2.0, 3.0), (0.05, 0.4, 6.0)),
    "maxwell": rv.Prony(1.0, 1.5),
    "burgers": rv.Prony(0.8, 0.4, (1.0,), (0.2,)),
}


def pressure_left(series, begin, step, end):
    """Error of the pressure at a time after an error ``6 s (1 - s)`` of the interpolation in a step, its mean one."""
    times, weights = np.array(series.times), np.array(series.compliances)

    def rates(t, errors, amiss):
        elements, flow = errors[:-1], errors[-1]
        pressure = -(weights @ elements + series.fluidity * flow) / series.glassy
        return np.append((pressure + amiss(t) - elements) / times, pressure + amiss(t))

    def interpolated(t):
        s = (t - begin) / step
        return 6 * s * (1 - s)

    settings = {"method": "LSODA", "rtol": 1e-10, "atol": 1e-14}
    errors = solve_ivp(rates, (begin, begin + step), np.zeros(times.size + 1), args=(interpolated,), **settings).y[
        :, -1
    ]
    if end > begin + step:
        errors = solve_ivp(rates, (begin + step, end), errors, args=(lambda t: 0.0,), **settings).y[:, -1]
    return -(weights @ errors[:-1] + series.fluidity * errors[-1]) / series.glassy


@pytest.mark.parametrize("name", SERIES)
@pytest.mark.parametrize(("step", "after"), [(1e-3, 0.0), (0.02, 0.0), (0.02, 0.1), (0.3, 0.0), (0.3, 1.0), (2.0, 0.5)])
def test_last_step__is_weighed_by_what_it_leaves_of_its_own_error(name, step, after, monkeypatch):
    monkeypatch.setattr(module, "_LAST", 1e-9)  # nothing else counts
    found = 1e-9 * Fading(SERIES[name], 10.0).weight(step + after, step)
    expected = abs(pressure_left(SERIES[name], 1.0, step, 1.0 + step + after))
    # the pressure answers within the step, too: what is counted is more than that, the same where steps are short
    crept = float(SERIES[name].mean_contact_compliance(0.0, step) / SERIES[name].contact_compliance(0.0))
    assert 0.999 * expected <= found <= crept**2.2 * expected


def test_mean_error__counts_as_the_closed_form_of_one_relaxation_time(monkeypatch):
    monkeypatch.setattr(module, "_LAST", 1e9)
    series = SERIES["zener"]
    rate = (1 + 2.0 / 1.0) / 0.7  # of relaxation: faster than creep by the ratio of the compliances
    fading = Fading(series, 50.0)
    ages = np.geomspace(1e-3, 1.5, 23)  # to an eighth of the largest weight, within which a table is read
    later = ages[:, None] + np.linspace(0, 10.0, 2001)
    weight = 3 * (2 / 3) * np.exp(-2 * rate * later / 3) * -np.expm1(-rate * later / 3)
    found = [fading.weight(age, 0.0) for age in ages]
    assert found == pytest.approx(weight.max(axis=1), rel=0.06)


@pytest.mark.parametrize("name", SERIES)
def test_steps_that_use_up_what_each_may__leave_a_few_times_that(name, monkeypatch):
    """Short steps to a kept time, each of which errs by what is allowed over its weight."""
    monkeypatch.setattr(module, "_LAST", 1e9)
    fading, edges = Fading(SERIES[name], 5.0), np.geomspace(1e-3, 5.0, 61)
    middles = np.sqrt(edges[1:] * edges[:-1])
    left = [
        abs(pressure_left(SERIES[name], 5.0 - b, b - a, 5.0)) / fading.weight(m, 0.0)
        for a, b, m in zip(edges[:-1], edges[1:], middles, strict=True)
    ]
    assert 1 < sum(left) < 4.5


PROGRAMS = {
    "step": rv.Program().load(0.05, over=0).hold(2.0),
    "ramp": rv.Program().load(0.05, over=0.5).hold(1.5),
    "triangle": rv.Program().load(0.05, over=1.0).load(0.01, over=1.0),
}


@pytest.mark.parametrize("what", PROGRAMS)
@pytest.mark.parametrize("name", ["three", pytest.param("zener", marks=pytest.mark.thorough)])
def test_one_kept_time__costs_less_and_is_as_right_as_asked(name, what, monkeypatch):
    made = scene(replace(SERIES[name], glassy=0.5), PROGRAMS[what], shape=(27, 24), tolerance=1e-3)
    last = list(march(replace(made, times=(2.0,))))[-1]
    exact = list(march(replace(made, times=(2.0,), tolerance=2e-5)))[-1]
    monkeypatch.setattr(
        control, "counted", lambda scene, state, length: control.remaining_creep_fraction(scene, length)
    )
    all_alike = list(march(replace(made, times=(2.0,))))[-1]
    assert last.state.convolutions < 0.9 * all_alike.state.convolutions
    off = np.abs(last.shown.pressure - exact.shown.pressure).sum() * made.operator.cell_area
    assert off <= 1e-3 * exact.state.largest_force
    assert abs(last.work - exact.work) <= 1e-3 * exact.state.largest_work
    assert last.uncertainty.relative(last.state.largest_force, last.state.largest_approach) <= 1e-3 * 1.5


@pytest.mark.parametrize("name", SERIES)
def test_error_of_the_pressure__is_left_as_a_kick_of_long_ago_is(name):
    fading = Fading(SERIES[name], 10.0)
    now = pressure_left(SERIES[name], 1.0, 1e-4, 1.0 + 1e-4)
    for after in (0.0, 0.03, 0.3, 2.0):
        later = pressure_left(SERIES[name], 1.0, 1e-4, 1.0 + 1e-4 + after)
        assert fading.remaining(after) == pytest.approx(later / now, rel=0.05, abs=1e-3)
