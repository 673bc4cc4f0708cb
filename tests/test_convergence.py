"""Orders of convergence in time, as rates, and the histories that have an exact answer."""

import numpy as np
import pytest
from support import scene

import roughvisc as rv
from roughvisc.mechanics.materials.series import series
from roughvisc.mechanics.stepping import march

DURATION = 2.0
COMMON = np.array([0.5, 1.0, 1.5, 2.0])
MATERIALS = {
    "maxwell": rv.maxwell(1.0, 1.0),
    "zener_equal": rv.zener(1.0, 1.0, 1.0),
    "zener_soft": rv.zener(1.0, 0.01, 0.01),
    "power_law": rv.power_law(0.5, 1.0, 0.4),
    "two_branches": rv.Prony(1.0, 0.0, (1.0, 2.0), (0.3, 3.0)),
    "kelvin_voigt": rv.kelvin_voigt(1.0, 1.0),
    "pure_power_law": rv.power_law(0.0, 1.0, 0.5),
}
PROGRAMS = {
    "triangle": rv.Program().load(1.0, over=1.0).load(0.3, over=1.0),
    "jump": rv.Program().load(0.4, over=0.5).load(1.0, over=0).hold(0.5).load(0.6, over=0).hold(1.0),
    "opening": rv.Program().load(1.0, over=0.5).load(0.0, over=0.5).hold(0.5).load(1.0, over=0.5),
}


def scaled(program, load):
    segments = [type(s)(s.control, s.duration, None if s.end is None else s.end * load) for s in program.segments]
    return rv.Program(tuple(segments))


def run(material, program, times):
    """States at the common times, stepping exactly onto the given times and no others."""
    load = 4 / 3 * 0.36**3 / float(material.contact_compliance(DURATION))
    material = material if isinstance(material, rv.Prony) else series(material, 1e-6 * DURATION, DURATION, 1e-8)[0]
    given = {"shape": (13, 11), "size": 1.0, "tolerance": 1e-9, "time_step": 1e9}
    settings = scene(material, scaled(program, load), times=tuple(times), **given)
    steps = [s for s in march(settings) if np.isclose(s.point.time, COMMON, rtol=0, atol=1e-9).any()]
    unique = {round(s.point.time, 9): s.point for s in steps}
    assert len(unique) == COMMON.size
    return [(s.pressure / load, s.approach, s.force / load) for s in unique.values()]


def uniform(n):
    return np.linspace(0, DURATION, n + 1)[1:]


def random(n):
    """Mildly random steps between the common times."""
    rng = np.random.default_rng(n)
    parts = []
    for start in COMMON - 0.5:
        steps = rng.uniform(0.7, 1.3, n // 4)
        parts.append(start + 0.5 * np.cumsum(steps) / steps.sum())
        parts[-1][-1] = start + 0.5
    return np.concatenate(parts)


def graded(n):
    """Steps that shrink towards both ends of each half second, where jumps, corners, opening and closing are."""
    x = np.arange(1, n // 4 + 1) / (n // 4)
    return np.concatenate([start + 0.5 * (3 * x**2 - 2 * x**3) for start in COMMON - 0.5])


def orders(material, program, grid, coarsest):
    """Orders of the largest errors of the pressure (L1) and of the approach over the common times.

    While contact grows the approach is exact for any steps: errors at rounding count as any order.
    """
    counts = [coarsest, 2 * coarsest, 4 * coarsest]
    exact = run(material, program, grid(8 * counts[-1]))
    pressure, approach = [], []
    for n in counts:
        found = run(material, program, grid(n))
        pressure.append(max(np.abs(p - q).sum() for (p, _, _), (q, _, _) in zip(found, exact, strict=True)))
        approach.append(max(abs(a / b - 1) for (_, a, _), (_, b, _) in zip(found, exact, strict=True)))
    fits = [-np.polyfit(np.log(counts), np.log(errors), 1)[0] for errors in (pressure, approach)]
    if max(approach) < 5e-6:
        fits[1] = np.inf
    return fits


def thorough(*values):
    return pytest.param(*values, marks=pytest.mark.thorough)


def long(*values):
    return pytest.param(*values, marks=pytest.mark.long)


@pytest.mark.parametrize(
    ("name", "program", "grid", "coarsest"),
    [
        ("zener_equal", "jump", uniform, 16),
        thorough("maxwell", "triangle", uniform, 32),
        thorough("maxwell", "triangle", random, 16),
        thorough("power_law", "jump", graded, 32),  # the rate of creep after a jump is singular
        long("two_branches", "jump", random, 64),
        long("zener_soft", "triangle", random, 320),
    ],
)
def test_instantaneous_compliance__second_order(name, program, grid, coarsest):
    assert min(orders(MATERIALS[name], PROGRAMS[program], grid, coarsest)) > 1.7


@pytest.mark.parametrize(
    ("name", "program", "coarsest"),
    [
        *(thorough(name, "opening", 16) for name in ("zener_equal", "kelvin_voigt", "maxwell")),
        long("kelvin_voigt", "triangle", 128),
        long("pure_power_law", "jump", 64),
    ],
)
def test_graded_steps__approach_of_second_order(name, program, coarsest):
    assert orders(MATERIALS[name], PROGRAMS[program], graded, coarsest)[1] > 1.7
