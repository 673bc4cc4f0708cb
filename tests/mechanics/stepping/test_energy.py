"""Stored and dissipated energy: inner products carried along against dense ones, cycles against the closed form."""

from functools import partial
from itertools import pairwise

import mpmath
import numpy as np
import pytest
import references

import roughvisc as rv
from roughvisc.mechanics import closed_forms
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.mechanics.materials.prony import one_less_mean_decay
from roughvisc.mechanics.sparse import Sparse
from roughvisc.mechanics.stepping import energy
from roughvisc.mechanics.stepping.march import march
from roughvisc.mechanics.stepping.scene import Scene

SHAPE, SPACING = (5, 4), (0.3, 0.2)
AREA = SPACING[0] * SPACING[1]
SOLID = rv.Prony(0.7, 0.0, (1.0, 0.4), (0.3, 2.0), poisson=0.3)
FLUID = rv.Prony(0.7, 0.2, (1.0, 0.4), (0.3, 2.0), poisson=0.3)
LENGTHS = (0.2, 0.5, 0.05, 1.1)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)
NODES, WEIGHTS = (NODES + 1) / 2, WEIGHTS / 2


def dense(boundary="free"):
    """The influence matrix, column by column."""
    operator = Grid(SHAPE, SPACING, boundary)
    return np.array([operator.displacement(unit.reshape(SHAPE)).ravel() for unit in np.eye(np.prod(SHAPE))])


def pressures(count, seed=3):
    """At rest, then random, with cells out of contact."""
    rng = np.random.default_rng(seed)
    return [np.zeros(SHAPE), *(np.maximum(rng.random(SHAPE) - 0.3, 0) for _ in range(count))]


def carried(material, fields, lengths, rule, acts_on="displacement", boundary="free", fresh=False):
    """The energies after steps between fields, a step of no length being a jump."""
    operator = Grid(SHAPE, SPACING, boundary)
    memory = Modes(material, acts_on)
    state, found = memory.start(SHAPE), energy.at_rest(memory)
    pairs = [(field, operator.displacement(field)) for field in fields]
    for number, (length, start, end) in enumerate(zip(lengths, *zip(*pairwise(pairs), strict=True), strict=True)):
        now = "euler" if rule == "bdf2" and number == 0 else rule
        held = Sparse.whole(end[0]), end[1]
        products = energy.inner_products(memory, state, now, start[1], held, AREA)
        found = energy.after_step(found, memory, state, length, now, products, fresh=fresh)
        kept = {"displacement": end[1], "pressure": end[0], "both": np.stack(end)}[acts_on]
        state = memory.advance(state, length, now, kept)
    return found


def relaxed(start, at, time, tau):
    """Internal variable after a time, from ``tau z' = p - z``."""
    kernel = time * WEIGHTS * np.exp(-time * (1 - NODES) / tau) / tau
    return start * np.exp(-time / tau) + sum(k * at(s) for k, s in zip(kernel, time * NODES, strict=True))


def quadrature(material, lengths, pressure, matrix):
    """Both energies by definition: ``pressure(number, time)`` within each step, everything else by Gauss' rule."""
    factor = 0.5 * (1 - material.poisson)
    held = [np.zeros(matrix.shape[0]) for _ in material.times]
    dissipated = 0.0

    def inner(field):
        return AREA * float(field @ matrix @ field)

    for number, length in enumerate(lengths):
        at = partial(lambda number, time: np.ravel(pressure(number, time)), number)
        for weight, node in zip(length * WEIGHTS, length * NODES, strict=True):
            dissipated += weight * material.fluidity * inner(at(node))
            for start, compliance, tau in zip(held, material.compliances, material.times, strict=True):
                dissipated += weight * compliance / tau * inner(at(node) - relaxed(start, at, node, tau))
        held = [relaxed(start, at, length, tau) for start, tau in zip(held, material.times, strict=True)]
    springs = zip((material.glassy, *material.compliances), (at(length), *held), strict=True)
    return factor * sum(0.5 * c * inner(z) for c, z in springs), factor * dissipated


@pytest.mark.parametrize("acts_on", ["displacement", "pressure", "both"])
@pytest.mark.parametrize("boundary", ["free", "periodic"])
@pytest.mark.parametrize("material", [SOLID, FLUID], ids=["solid", "fluid"])
def test_linear_steps__are_exact(material, boundary, acts_on):
    fields = pressures(len(LENGTHS))

    def linear(number, time):
        return fields[number] + (fields[number + 1] - fields[number]) * time / LENGTHS[number]

    found = carried(material, fields, LENGTHS, "linear", acts_on, boundary)
    exact = quadrature(material, LENGTHS, linear, dense(boundary))
    assert (found.stored, found.dissipated) == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("acts_on", ["displacement", "pressure", "both"])
def test_steps_of_constant_pressure__are_exact(acts_on):
    fields = pressures(len(LENGTHS))
    found = carried(FLUID, fields, LENGTHS, "right", acts_on)
    exact = quadrature(FLUID, LENGTHS, lambda number, _: fields[number + 1], dense())
    assert (found.stored, found.dissipated) == pytest.approx(exact, rel=1e-10)


def test_jumps__store_their_work_in_the_spring_alone():
    first, second, third = pressures(3)[1:]
    fields = [0 * first, first, second, third, third]
    found = carried(FLUID, fields, (0.0, 0.4, 0.0, 0.7), "linear")

    def piecewise(number, time):
        return [first + (second - first) * time / 0.4, third][number]

    exact = quadrature(FLUID, (0.4, 0.7), piecewise, dense())
    assert (found.stored, found.dissipated) == pytest.approx(exact, rel=1e-10)
    at_once = carried(FLUID, fields[:2], (0.0,), "linear")
    assert at_once.dissipated == 0
    spring = 0.5 * 0.35 * FLUID.glassy * AREA
    assert at_once.stored == pytest.approx(spring * first.ravel() @ dense() @ first.ravel(), rel=1e-12)
    before, after = (carried(FLUID, fields[:n], (0.0, 0.4, 0.0)[: n - 1], "linear") for n in (3, 4))
    work = spring * (third.ravel() @ dense() @ third.ravel() - second.ravel() @ dense() @ second.ravel())
    assert after.stored - before.stored == pytest.approx(work, rel=1e-10)
    assert after.dissipated == before.dissipated


def test_first_step_after_an_event__is_exact_while_it_resolves_what_relaxes():
    fields, lengths = pressures(2), (0.2, 0.29)  # the shortest time is 0.3 s
    found, same = (carried(SOLID, fields, lengths, "linear", fresh=fresh) for fresh in (True, False))
    assert (found.stored, found.dissipated, found.unresolved) == (same.stored, same.dissipated, 0.0)


def test_step_that_stands_for_a_jump__works_as_a_held_load():
    """All of the pressure on all of the displacement, where nothing gives way at once."""
    material, step = rv.Prony(0.0, 0.2, (1.0, 0.4), (0.3, 2.0)), 0.1
    operator, memory = Grid(SHAPE, SPACING), Modes(material)
    rest, pressure = pressures(1)
    state = memory.start(SHAPE)
    ends = rest, (Sparse.whole(pressure), operator.displacement(pressure))
    products = energy.inner_products(memory, state, "euler", *ends, AREA)
    at_rest = energy.at_rest(memory)
    found = energy.after_step(at_rest, memory, state, step, "euler", products, fresh=True, jumped=True)
    crept = 0.25 * (sum(c * step / (tau + step) for c, tau in ((1.0, 0.3), (0.4, 2.0))) + 0.2 * step)
    work = crept * AREA * pressure.ravel() @ dense() @ pressure.ravel()
    assert found.stored + found.dissipated == pytest.approx(work, rel=1e-12)


@pytest.mark.parametrize(("rule", "order"), [("euler", 1), ("bdf2", 2)])
def test_damped_rules__converge_at_their_order(rule, order):
    (first, second), end = pressures(2)[1:], 3.0

    def smooth(time):
        return first * np.sin(time) ** 2 + second * time**2 / 4

    halves = 6
    panels = (end / halves,) * halves
    exact = np.array(quadrature(FLUID, panels, lambda n, t: smooth(n * end / halves + t), dense()))
    errors = []
    for count in (80, 160):
        times = np.linspace(0, end, count + 1)
        found = carried(FLUID, [smooth(t) for t in times], np.diff(times), rule)
        errors.append(np.abs(np.array([found.stored, found.dissipated]) / exact - 1))
    rates = np.log2(errors[0] / errors[1])
    assert np.all(np.abs(rates - order) < 0.25), rates
    assert errors[1].max() < {1: 0.05, 2: 0.002}[order]


# ----------------------------------------------------------------------------------------------------------------
# marches


def punch(material, program, cells=(11, 9), radius=3.6, **settings):
    """A flat punch of a few cells, and the radius of the round one that is as stiff."""
    x, y = (np.arange(n) - n // 2 for n in cells)
    present = x[:, None] ** 2 + y[None, :] ** 2 <= radius**2
    operator = Grid(cells, (1.0, 1.0))
    units = [unit.reshape(cells) for unit in np.eye(present.size)[present.ravel()]]
    matrix = np.array([operator.displacement(unit)[present] for unit in units])
    stiff_as = 0.5 * np.linalg.solve(matrix, np.ones(len(units))).sum()  # F = 2 a E* delta
    scene = Scene(operator, np.zeros(cells), material, Modes(material), program, present=present, **settings)
    return scene, float(stiff_as)


def sphere(material, program, **settings):
    shape, spacing = (17, 15), (0.1, 0.11)
    x, y = ((np.arange(n) - n // 2) * d for n, d in zip(shape, spacing, strict=True))
    gap = 0.5 * (x[:, None] ** 2 + y[None, :] ** 2)
    return Scene(Grid(shape, spacing), gap, material, Modes(material), program, **settings)


def rows(scene):
    """Kept instants: force, approach, stored, dissipated."""
    steps = [step for step in march(scene) if scene.keeps(step.shown.time)]
    columns = [(s.shown.time, s.shown.force, s.shown.approach, s.stored, s.dissipated) for s in steps]
    return np.array(columns).T


MATERIALS = {"maxwell": rv.maxwell(1.0, 1.0), "zener": rv.zener(1.0, 1.0, 1.0), "soft": rv.zener(1.0, 0.01, 0.01)}


@pytest.mark.parametrize("name", MATERIALS)
def test_held_load__works_by_what_it_sinks(name):
    force = 5e-4 if name == "soft" else 0.05
    program = rv.Program().load(force, over=0).hold(4.0)
    scene = sphere(MATERIALS[name], program, times=(0.0, 0.2, 1.0, 4.0), tolerance=1e-3)
    _, load, approach, stored, dissipated = rows(scene)
    work = np.diff(stored + dissipated)
    np.testing.assert_allclose(work, load[0] * np.diff(approach), rtol=3e-3)
    assert np.all(np.diff(dissipated) > 0)


@pytest.mark.parametrize("name", [*MATERIALS, "kelvin_voigt"])
def test_held_load_of_a_punch__works_by_half_the_jump_and_all_that_it_sinks(name):
    program = rv.Program().load(1.0, over=0).hold(4.0)
    material = MATERIALS.get(name, rv.kelvin_voigt(1.0, 1.0))
    scene, _ = punch(material, program, times=(0.0, 0.5, 4.0), tolerance=1e-4)
    _, load, approach, stored, dissipated = rows(scene)
    np.testing.assert_allclose(stored + dissipated, load * (approach - 0.5 * approach[0]), rtol=1e-4)


@pytest.mark.parametrize("name", MATERIALS)
def test_held_approach__takes_no_work_and_turns_what_is_stored_into_heat(name):
    program = rv.Program().approach(0.1, over=0).hold(3.0)
    scene = sphere(MATERIALS[name], program, times=(0.0, 0.1, 0.5, 3.0), tolerance=1e-3)
    _, _, _, stored, dissipated = rows(scene)
    np.testing.assert_allclose(stored + dissipated, stored[0], rtol=1e-3)
    assert dissipated[0] == 0
    assert dissipated[-1] > 0.3 * stored[0]


@pytest.mark.parametrize(
    "material", [rv.power_law(0.0, 1.0, 0.3), rv.power_law(0.001, 1.0, 0.3)], ids=["pure", "glassy"]
)
def test_step_load_on_hardly_any_compliance_at_once__works_by_what_it_sinks(material):
    """Contact grows many times over in the first step: no path within it would tell the work, the approach does."""
    force, times = 1e-3, (0.25, 1.0)
    exact = closed_forms.lee_radok_step(1.0, material, force)
    ball = rv.sphere(1.0, 0.2, (33, 31))
    ds = rv.simulate(
        ball, material, rv.Program().load(force, over=0).hold(1.0), times=times, tolerance=1e-2, progress=False
    )
    jump = 2 / 5 * float(exact.approach(0.0))  # Hertz: F is the power 3/2 of the approach
    np.testing.assert_allclose(ds.work, force * (exact.approach(times) - float(exact.approach(0.0)) + jump), rtol=1e-2)


def test_ramp_of_load__works_as_force_on_approach():
    program = rv.Program().load(0.05, over=1.0).load(0.01, over=1.0)
    times = tuple(np.linspace(0, 2, 201).tolist())
    _, force, approach, stored, dissipated = rows(sphere(MATERIALS["zener"], program, times=times, tolerance=1e-4))
    assert stored[-1] + dissipated[-1] == pytest.approx(np.trapezoid(force, approach), rel=2e-3)


@pytest.mark.parametrize("kept", [2, 64])
@pytest.mark.parametrize("loss", [5e-4, 0.005, 0.05, 0.5])
def test_cycles_of_a_punch__dissipate_the_closed_form(loss, kept):
    """However little is lost: the material's tan delta at this frequency is the largest that it has."""
    more = 2 * loss * (loss + np.sqrt(1 + loss**2))
    material, period, cycles = rv.Prony(1.0, 0.0, (more,), (1.0,)), 2 * np.pi / np.sqrt(1 + more), 4
    program = rv.Program.cycle(4.0, 1.0, period, cycles, control="approach")
    times = (*(period / kept * np.arange(kept * cycles)).tolist(), program.duration)
    scene, radius = punch(material, program, times=times, tolerance=1e-3)
    dissipated = rows(scene)[4][::kept]
    exact = references.punch_dissipation(radius, material, 1.0, period)
    np.testing.assert_allclose(np.diff(dissipated)[1:], exact, rtol=0.02)


def test_elastic__dissipates_nothing_at_all():
    program = rv.Program().load(0.05, over=1.0).load(0.01, over=0).hold(1.0) + rv.Program.cycle(0.03, 0.02, 1.0, 2)
    _, _, _, stored, dissipated = rows(sphere(rv.elastic(1.0), program))
    assert not dissipated.any()
    assert stored.max() > 0


# ----------------------------------------------------------------------------------------------------------------
# precision


@pytest.mark.parametrize("name", ["one_less_mean_decay", "both_rises"])
def test_parts_of_exponentials__keep_full_precision(name):
    x = np.concatenate([np.geomspace(1e-9, 1e3, 97), [0.3, np.nextafter(0.3, 0), np.nextafter(0.3, 1)]])
    found = one_less_mean_decay(x)
    if name == "both_rises":
        found = energy._both_rises(x, found, one_less_mean_decay(2 * x))

    def exact(y):
        if name == "one_less_mean_decay":
            return 1 - (1 - mpmath.exp(-y)) / y
        return (1 - 2 * (1 - mpmath.exp(-y)) / y + (1 - mpmath.exp(-2 * y)) / (2 * y)) / y

    with mpmath.workdps(60):
        errors = [
            abs(float(value / exact(mpmath.mpf(float(y))) - 1)) for y, value in zip(x, found.tolist(), strict=True)
        ]
    assert max(errors) < 1e-13
