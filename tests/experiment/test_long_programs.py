"""The pressure of a long program is that of a short one: what a step leaves of its error does not grow."""

import numpy as np
import pytest
from support import relative_errors

import roughvisc as rv


@pytest.mark.parametrize("tolerance", [1e-3, pytest.param(1e-5, marks=pytest.mark.thorough)])
def test_relaxed_contact_of_two_cells__is_the_elastic_one_after_many_steps(tolerance):
    """The displacement that steps extrapolate stays that of the pressure."""
    rng, y = np.random.default_rng(364), np.arange(40) / 40
    height = sum(0.01 * rng.normal() * k**-1.3 * np.cos(2 * np.pi * (k * y + rng.random())) for k in range(1, 9))
    ridge = rv.from_array(np.tile(height, (2, 1)), spacing=1 / 40)
    program = rv.Program().pressure(5.46e-3, over=0.2).hold(1.0)
    settings = {"boundary": "periodic", "times": [0.8, 1.0, 1.2], "fields": ("pressure",), "progress": False}
    found, exact = (
        rv.simulate(ridge, body, program, tolerance=tolerance, numerics=rv.Numerics(time_step=step), **settings)
        for body, step in ((rv.Prony(0.08, 0.0, (0.92,), (0.03,)), 2e-3), (rv.Prony(1.0), "auto"))
    )
    assert int((exact.pressure[0] > 0).sum()) == 4  # two cells in each of both rows
    assert relative_errors(found, exact).max() < tolerance


@pytest.mark.parametrize("cycles", [5, pytest.param(100, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("control", ["load", "approach"])
def test_last_of_many_cycles__is_the_first_one(control, cycles):
    """Contact opens in each cycle and the body recovers until the next one, within the stated errors."""
    ball = rv.sphere(1.0, (0.8, 0.7), (15, 13))
    largest = {"load": 0.02, "approach": 0.03}[control]
    program = rv.Program()
    for _ in range(cycles):
        program = getattr(program, control)(largest, over=0.5)
        program = getattr(program, control)(0.0, over=0.25).hold(1.25)
    body, period = rv.Prony(0.5, 0.0, (0.5,), (0.08,)), 2.0
    times = [start + time for start in (0, (cycles - 1) * period) for time in (0.25, 0.5, 0.6)]
    found = rv.simulate(ball, body, program, times=times, fields=("pressure",), progress=False)
    first, last = found.isel(time=slice(0, 3)), found.isel(time=slice(3, 6))
    apart = abs(last.pressure.values - first.pressure.values).sum((1, 2)) / first.pressure.values.sum((1, 2)).max()
    assert (last.force[:2] > 0).all()
    assert (apart <= first.stated_error.values + last.stated_error.values).all()


def test_many_segments__give_what_one_segment_gives():
    """A ramp and a return in 150 parts each, through which contact grows, shrinks and opens."""
    surface = rv.self_affine(1.0, (21, 18), hurst=0.8, rms_slope=0.1, rolloff=0.5, seed=3)
    body = rv.Prony(0.3, 0.0, (0.7,), (0.5,))
    few = rv.Program().pressure(0.02, over=1.0).pressure(0.0, over=0.5)
    many = rv.Program()
    for number in range(1, 151):
        many = many.pressure(0.02 * number / 150, over=1 / 150)
    for number in range(149, -1, -1):
        many = many.pressure(0.02 * number / 150, over=1 / 300)
    settings = {"boundary": "periodic", "times": [0.3, 1.0, 1.2, 1.45], "fields": ("pressure",), "progress": False}
    found, expected = (rv.simulate(surface, body, program, **settings) for program in (many, few))
    stated = found.stated_error.values + expected.stated_error.values
    assert (relative_errors(found, expected) <= 1.5 * stated).all()
