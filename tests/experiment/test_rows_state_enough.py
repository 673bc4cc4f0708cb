"""Rows whose error a closed form knows state enough: one cell in contact, and waves in full contact."""

import functools
import math

import numpy as np
import pytest
from scipy import optimize

import roughvisc as rv
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.memory import choose_memory
from roughvisc.mechanics.stated_error import StepErrors

SIDE, AMPLITUDE = 1e-3, 1e-6
#: A row may be beyond its stated error, or beyond the tolerance, by this factor.
BEYOND = 1.5


def assert_states_enough(ds, error, stated=None, tolerance=None):
    """Compare errors with the stated ones; the least error that counts is the tolerance."""
    stated = ds.stated_error.values if stated is None else stated
    tolerance = ds.attrs["tolerance"] if tolerance is None else tolerance
    assert (error <= BEYOND * np.maximum(stated, tolerance)).all(), np.c_[error, stated]


def relaxing_modes(glassy, terms, times):
    """Return the rates of a body under a constant approach [1/s], and the parts of its first force that they relax."""
    terms, times = np.array(terms), np.array(times)
    root = np.sqrt(terms / glassy / times)
    rates, modes = np.linalg.eigh(np.diag(1 / times) + np.outer(root, root))
    return rates, (modes.T @ root) ** 2 / rates


def relaxation(glassy, terms, times):
    """Return the force of a body under a constant approach over its first value, as a function of time."""
    rates, parts = relaxing_modes(glassy, terms, times)
    return lambda t: 1 + (parts * np.expm1(-rates * np.asarray(t)[..., None])).sum(-1)


@functools.cache
def one_cell():
    """Return a surface with one cell in contact, and its force for a shear compliance of 1e-6 / Pa and 1 um. [N]"""
    surface, program = rv.flat_punch(3e-4, (SIDE, SIDE), (3, 3)), rv.Program().approach(AMPLITUDE, over=0.0)
    ds = rv.simulate(surface, rv.elastic(1e6, 0.5), program, tolerance=1e-8, progress=False)
    return surface, float(ds.force[-1])


def held(glassy, terms, times, duration, kept, tolerance):
    """Return the result of one cell whose approach jumps and is held, and its error."""
    surface, unit = one_cell()
    program = rv.Program().approach(AMPLITUDE, over=0.0).hold(duration)
    body = rv.Prony(glassy, 0.0, tuple(terms), tuple(times))
    ds = rv.simulate(surface, body, program, times=kept, tolerance=tolerance, progress=False)
    exact = unit * 1e-6 / glassy * relaxation(glassy, terms, times)(ds.time.values)
    return ds, np.abs(ds.force.values - exact) / np.maximum.accumulate(exact)


@pytest.mark.parametrize("exponent", [0.15, 0.65])
def test_first_ages_of_a_power_law(exponent):
    """Under a ramp the displacement is the integral of the compliance, whose first ages the series does not know."""
    memory = choose_memory(Body(rv.power_law(0.0, 1e-6, exponent, 1.0)), 1.0, 1e-3, 1e-6)
    for age in np.geomspace(1.01e-6, 1e-4, 8):
        exact = 0.25e-6 * age ** (1 + exponent) / (1 + exponent)
        off = abs(float(memory.crept(age)[0]) / exact - 1)
        assert off <= memory.error_of_young(age) + memory.series_error <= 1


#: A body with fast and slow terms: the slow ones are wrong if the first pair steps over the fast one.
FAST = 1e-6, (4.9e-6, 15e-6, 7e-6), (3.1e-4, 11.0, 0.53)
#: A body that relaxes over decades, whose glassy compliance is small.
DECADES = 5.014e-8, (1.082e-6, 8.228e-6, 6.418e-6, 0.169e-6), (0.2853, 128.6, 1.747, 1.391e-4)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
def test_early_row_after_a_jump_of_the_approach(tolerance):
    assert_states_enough(*held(*DECADES, 2.51, [0.00335, 2.51], tolerance))
    assert_states_enough(*held(*FAST, 489.0, np.geomspace(0.0489, 489.0, 20).tolist(), tolerance))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
def test_early_row_after_a_jump_of_the_load(tolerance):
    """In full contact the pressure of a wave relaxes, although the load is constant."""
    glassy, cells = DECADES[0], 8
    x = (np.arange(cells) + 0.5) / cells
    wave = rv.from_array(AMPLITUDE * np.cos(2 * np.pi * x)[:, None] * np.ones((1, 2)), SIDE / cells)
    unit = AMPLITUDE * np.pi / SIDE * 4 / glassy
    mean = 1.05 * unit
    program = rv.Program().load(mean * SIDE * 2 * SIDE / cells, over=0.0).hold(2.51)
    body = rv.Prony(glassy, 0.0, *DECADES[1:])
    options = {"times": [0.00335, 2.51], "tolerance": tolerance, "boundary": "periodic", "fields": ("pressure",)}
    ds = rv.simulate(wave, body, program, **options, progress=False)
    left = relaxation(*DECADES)(ds.time.values)[:, None]
    off = ds.pressure.values[:, :, 0] - mean - unit * left * np.cos(2 * np.pi * x)
    assert_states_enough(ds, np.abs(off).mean(axis=1) / mean)


def test_row_at_which_both_solutions_meet():
    """Their difference may vanish while both are off: a half of what relaxation leaves of the error remains stated.

    Of the error of friction all remains, because both solutions share it.
    """
    before, met = StepErrors(pressure=1.0, force=2.0, approach=3.0, friction=4.0), StepErrors()
    assert met.at_least(before, left=0.8) == StepErrors(pressure=0.4, force=0.8, approach=1.5, friction=3.2)
    assert before.at_least(met, left=1.0) == before
    assert met.or_larger(before, left=0.8) == StepErrors(pressure=0.8, force=1.6, approach=3.0, friction=3.2)
    terms = (8.87705394e-06, 2.18983982e-07, 1.68871794e-06, 1.19421571e-07, 1.52556064e-07)
    times = (8.70851432e-07, 7.64903669e4, 14.7892091, 1420.80128, 4.92916079e-9)
    kept = np.geomspace(53.18e-4, 53.18, 20).tolist()
    assert_states_enough(*held(1.063e-07, terms, times, 53.18, kept, 1e-3))


@pytest.mark.parametrize("ratio", [10, 1000])
def test_rows_after_a_fast_relaxation(ratio):
    """The force has fallen to a small part when the first row is kept: rows meet the tolerance of their own force."""
    ds, error = held(1e-6 / ratio, (1e-6, 2e-6), (1e-6, 0.3), 1.0, np.geomspace(1e-3, 1.0, 10).tolist(), 1e-4)
    assert_states_enough(ds, error)
    assert error.max() < 5e-4


@pytest.mark.parametrize("left", [0.3, 0.1, 0.03])
def test_row_at_the_end_of_a_long_relaxation(left):
    """The errors of twenty pairs and more add up: as errors of the force they relax no faster than the force."""
    compliances = 1e-6, (80e-6,)
    age = float(optimize.brentq(lambda t: relaxation(*compliances, (1.0,))(t) - left, 0.0, 5.0))
    ds, error = held(*compliances, (1.0,), 5.0, [age], 1e-4)
    assert_states_enough(ds, error)
    assert error[0] < 2e-4


# -------------------------------------------------------------------------------------------------------------- slides


def sliding(cells, steps, turning, retarded, kept, tolerance=1e-3, hold=True, times=(1.0,)):
    """Return the result of a wave that slides in full contact and is held, with its errors of pressure and friction.

    `turning` is the phase of the slide in a second; `retarded` are compliances over the instantaneous one, with the
    retardation times `times` [s]; `kept` are times over that of the slide.
    """
    glassy, wave_number = 1e-6, 2 * np.pi / SIDE
    terms = glassy * np.atleast_1d(retarded)
    x = (np.arange(cells) + 0.5) * SIDE / cells
    wave = rv.from_array(AMPLITUDE * np.cos(wave_number * x)[:, None] * np.ones((1, 2)), SIDE / cells)
    speed, area = turning / wave_number, 2 * SIDE * SIDE / cells
    unit = AMPLITUDE * wave_number / 2 * 4 / glassy
    mean, lasting = 2.1 * unit, steps * SIDE / cells / speed
    program = rv.Program().load(mean * area, over=0.0).slide(steps * SIDE / cells, speed=speed)
    program = program.hold(lasting) if hold else program
    body = rv.Prony(glassy, 0.0, tuple(terms), times)
    options = {"times": [one * lasting for one in kept], "boundary": "periodic", "fields": ("pressure",)}
    ds = rv.simulate(wave, body, program, tolerance=tolerance, **options, progress=False)
    rates, parts = relaxing_modes(glassy, terms, times)
    rows, angle = ds.time.values, wave_number * speed
    slid = np.minimum(rows, lasting)
    turned, left = np.exp(-1j * angle * slid), np.exp(-np.outer(rates, rows - slid))
    then = (turned - np.exp(-np.outer(rates, slid))) * left / (rates - 1j * angle)[:, None]
    after = turned * (1 - left) / rates[:, None]
    pressed = unit * (turned - (parts * rates) @ (then + after)) * turned.conj()
    off = ds.pressure.values[:, :, 0] - mean - (pressed[:, None] * np.exp(1j * wave_number * x)).real
    friction = -0.5 * area * AMPLITUDE * wave_number * pressed.imag
    return ds, np.abs(off).mean(axis=1) / mean, np.abs(ds.friction_force.values - friction), friction


@pytest.mark.parametrize("turning", [0.3, 3.0, 30.0])
@pytest.mark.parametrize("steps", [1, 3, 4, 11])
def test_slide_by_some_cells(steps, turning):
    """Just after a slide by one cell or an odd number, both solutions have taken the last step alike."""
    ds, pressure, friction, _ = sliding(12, steps, turning, 4.0, [1, 1.001, 1.01, 1.1])
    assert_states_enough(ds, pressure)
    assert (friction[0] <= BEYOND * ds.friction_force_error.values[0]).all()


@pytest.mark.parametrize("retarded", [0.2, 1.8, 10.0])
@pytest.mark.parametrize("turning", [0.05, 0.2, 0.8])
def test_first_row_of_a_slide(turning, retarded):
    """A step that is longer than the relaxation misses it, in both solutions."""
    ds, pressure, _, _ = sliding(19, 5, turning, retarded, [1 / 5], hold=False)
    assert (pressure <= 1.1 * ds.stated_error.values).all()


@pytest.mark.parametrize("cells", [5, 7, 12])
def test_slow_slide_of_a_soft_body(cells):
    """With few cells a wave, steps of one and of two cells have nearly the same error of the friction force."""
    ds, _, off, friction = sliding(cells, 6 * cells, 0.01, 5.0, [5.5 / 6], hold=False)
    assert_states_enough(ds, off / friction, ds.friction_force_error.values / friction)


@pytest.mark.parametrize("steps", [3, 4])
def test_friction_of_a_hold_after_a_slow_slide(steps):
    """The friction force decays over two retardation times, and so does its error, which both solutions share."""
    retarded, times, kept = (1.18, 1.30), (2.287, 0.0445), [1, 1.02, 1.05, 1.1, 1.2, 1.5, 2.0]
    ds, _, off, friction = sliding(8, steps, 0.03, retarded, kept, times=times)
    largest = np.abs(friction).max()
    assert_states_enough(ds, off / largest, ds.friction_force_error.values / largest)


def test_friction_that_is_gone_within_a_step():
    """In a long step the friction force of both solutions passes through zero while some of it is left."""
    kept = [1, 1 + 0.0027, 1 + 0.0072, 1 + 0.019, 1 + 0.052, 1 + 0.14, 2]
    ds, _, off, friction = sliding(8, 16, 0.022, 0.32, kept)
    largest = np.abs(friction).max()
    assert_states_enough(ds, off / largest, ds.friction_force_error.values / largest)


# ---------------------------------------------------------------------------------------------------------------- work


@pytest.mark.parametrize(
    ("retarded", "time", "ramp", "change", "count"),
    [(3.9, 0.052, 0.1, 0.19, 5), (2.0, 0.0064, 0.3, 0.28, 5), (6.4, 0.28, 0.0, 0.057, 5)],
)
def test_work_of_triangles(retarded, time, ramp, change, count):
    """Only the end is kept: after each corner the force relaxes in a small part of a pair."""
    surface, unit = one_cell()
    rate, part = (1 + retarded) / time, retarded / (1 + retarded)
    program = rv.Program().approach(AMPLITUDE, over=ramp).hold(1.0)
    segments = [(ramp, 1.0), (1.0, 1.0)]
    for value in [1 - change, 1.0] * count:
        program = program.approach(value * AMPLITUDE, over=0.5)
        segments.append((0.5, value))
    approach = memory = work = 0.0  # force = approach - part * memory, and memory' = rate * (approach - memory)
    for duration, value in segments:
        if duration == 0:
            work, approach = work + 0.5 * value**2, value
            continue
        slope = (value - approach) / duration
        lag = approach - memory - slope / rate
        mean = (approach + value) / 2 * duration
        work += slope * (
            (1 - part) * mean + part * (slope / rate * duration - lag * math.expm1(-rate * duration) / rate)
        )
        memory, approach = value - slope / rate - lag * math.exp(-rate * duration), value
    exact = work * unit * AMPLITUDE
    for tolerance in (1e-2, 1e-3, 1e-4):
        body = rv.Prony(1e-6, 0.0, (retarded * 1e-6,), (time,))
        ds = rv.simulate(surface, body, program, times=[program.duration], tolerance=tolerance, progress=False)
        assert abs(float(ds.work[-1]) - exact) <= BEYOND * max(float(ds.work_error[-1]), 0.1 * tolerance * exact)


def test_work_of_rows_in_a_hold_of_the_load():
    """The work is the load times the creep, wherever a kept row lies in a pair."""
    surface, unit = one_cell()
    program = rv.Program().load(1e-3, over=0.0).hold(1.0)
    times = np.linspace(0.05, 1.0, 20)
    body = rv.Prony(1e-6, 0.0, (3e-6,), (0.05,))
    ds = rv.simulate(surface, body, program, times=times.tolist(), tolerance=1e-3, progress=False)
    creep = 1 - 3 * np.expm1(-times / 0.05)
    exact = 1e-3 * (1e-3 / unit * AMPLITUDE) * (creep - 0.5)
    assert_states_enough(ds, np.abs(ds.work.values / exact - 1), ds.work_error.values / exact, 1e-6)


@pytest.mark.parametrize(("seed", "approach"), [(91, 1.235e-7), (158, 3.551e-7)])
def test_work_of_an_elastic_rough_ball(seed, approach):
    """The work is a state function: the exact one is that of the tightest tolerance."""
    rng = np.random.default_rng([9, seed])
    rng.integers(4, 12)
    x = (np.arange(5) - 2) * 1e-6
    rough = rng.standard_normal((5, 5)) * 0.5e-7 - (x[:, None] ** 2 + x[None] ** 2) / 2 / 1e-5
    program, options = rv.Program().approach(approach, over=0.0), {"boundary": "free", "edge": "accept"}
    *loose, sharp = (
        rv.simulate(rv.from_array(rough, 1e-6), rv.elastic(1e6), program, tolerance=one, progress=False, **options)
        for one in (3e-2, 1e-2, 3e-3, 1e-3, 1e-8)
    )
    exact = float(sharp.work[-1])
    for ds in loose:
        assert abs(float(ds.work[-1]) - exact) <= float(ds.work_error[-1]) <= 5 * ds.attrs["tolerance"] * exact
