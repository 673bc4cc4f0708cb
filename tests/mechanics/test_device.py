"""Contact, time steps and steady sliding on a stand-in for CuPy's arrays: the results of NumPy's, to rounding."""

from dataclasses import replace

import device
import numpy as np
import pytest
import support

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE, Body
from roughvisc.mechanics.contact import solve_contact, solver
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.layer import Layers, layer_series
from roughvisc.mechanics.layer_memory import LayerMemory
from roughvisc.mechanics.memory import Memory
from roughvisc.mechanics.steady_sliding import Sliding, steady_state
from roughvisc.mechanics.stepping import Scene, march
from roughvisc.mechanics.tangential import tangential_force

BOUNDARIES = pytest.mark.parametrize("boundary", ["free", "periodic", "mirror"])
SHAPE, SPACING = (23, 18), (1.0, 1.2)
ZENER, SOFT = rv.zener(1.0, 0.5, 0.5), rv.kelvin_voigt(1.0, 0.3)
SERIES = rv.Prony(1.0, 0.2, (1.0, 2.0), (0.3, 3.0))
CYCLE = rv.Program().load(2.0, over=0.2).hold(0.2).load(0.5, over=0.2)
STROKE = rv.Program().load(2.0, over=0).slide(4.0, speed=20.0).hold(0.02)
#: Pressed, pulled off, and pressed again before the surface has recovered.
APPROACHES = rv.Program().approach(1.5, over=0.2).approach(-1.0, over=0.2).approach(1.5, over=0.3)


@pytest.fixture(autouse=True)
def xp(monkeypatch):
    """The device in CuPy's place. SciPy transforms plain arrays too, as the stand-in does."""
    monkeypatch.setenv("ROUGHVISC_TRANSFORMS", "scipy")
    return device.install(monkeypatch)


def absent_cells():
    present = np.ones(SHAPE, bool)
    present[5:9, 3:6] = present[-1] = False
    return present


def assert_equal(one, other):
    """Compare an array of the device with one of the host."""
    np.testing.assert_allclose(one.get(), other, rtol=0, atol=1e-12 * np.abs(other).max(initial=1e-300))


# ------------------------------------------------------------------------------------------------------------ contact


@BOUNDARIES
@pytest.mark.parametrize("prescribed", ["load", "approach"])
@pytest.mark.parametrize("present", [None, absent_cells()], ids=["all", "absent"])
def test_contact__is_the_same_on_a_device(xp, boundary, prescribed, present):
    gap = support.rough_gap(SHAPE)
    given = {"load": 20.0} if prescribed == "load" else {"approach": 0.7 * float(gap.mean())}
    there = None if present is None else xp.asarray(present)
    found = solve_contact(Grid(SHAPE, SPACING, boundary), gap, present=present, **given)
    other = solve_contact(Grid(SHAPE, SPACING, boundary, xp=xp), xp.asarray(gap), present=there, **given)
    assert found.iterations > 3
    assert (other.convolutions, other.iterations) == (found.convolutions, found.iterations)
    assert_equal(other.pressure, found.pressure)
    assert_equal(other.displacement, found.displacement)
    assert other.approach == pytest.approx(found.approach, rel=1e-12)
    assert other.load == pytest.approx(found.load, rel=1e-12)


@BOUNDARIES
def test_wide_contact__is_the_same_on_a_device(monkeypatch, xp, boundary):
    """With a first guess on half the cells, steps in single precision and the second level of the preconditioner."""
    for name, value in {"COARSE_FROM": 40, "SINGLE_FROM": 1, "BLOCKS_FROM": 40, "SPOTS": 0.0}.items():
        monkeypatch.setattr(solver, name, value)
    used, blocks = [], solver.LongWaves.pressure
    monkeypatch.setattr(solver.LongWaves, "pressure", lambda self, rest: used.append(rest) or blocks(self, rest))
    gap = support.rough_gap((52, 41))
    found = solve_contact(Grid(gap.shape, SPACING, boundary), gap, load=30.0)
    of_host = len(used)
    other = solve_contact(Grid(gap.shape, SPACING, boundary, xp=xp), xp.asarray(gap), load=30.0)
    assert of_host > 3
    assert len(used) == 2 * of_host
    assert_equal(other.pressure, found.pressure)
    assert_equal(other.displacement, found.displacement)


@BOUNDARIES
def test_projected_gradient_steps__are_the_same_on_a_device(monkeypatch, xp, boundary):
    monkeypatch.setattr(solver, "PATIENCE", 0)
    taken, projected = [], solver.onto_simplex
    monkeypatch.setattr(solver, "onto_simplex", lambda *values: taken.append(values) or projected(*values))
    gap = support.rough_gap(SHAPE)
    found = solve_contact(Grid(SHAPE, SPACING, boundary), gap, load=20.0, tolerance=0.1)
    of_host = len(taken)
    other = solve_contact(Grid(SHAPE, SPACING, boundary, xp=xp), xp.asarray(gap), load=20.0, tolerance=0.1)
    assert of_host > 3
    assert len(taken) == 2 * of_host
    assert_equal(other.pressure, found.pressure)


def test_nearly_full_contact__is_the_same_on_a_device(xp):
    """The level is weighted by the pressure that opens the gap, and the approach needs a check of the load."""
    gap = support.rough_gap(SHAPE, slope=0.1)
    grids = Grid(SHAPE, SPACING, "periodic"), Grid(SHAPE, SPACING, "periodic", xp=xp)
    fields = gap, xp.asarray(gap)
    for load in (100.0, 300.0):
        found, other = (solve_contact(*one, load=load) for one in zip(grids, fields, strict=True))
        assert (found.pressure > 0).mean() > 0.7
        assert_equal(other.pressure, found.pressure)
    approach = float(gap.mean()) * (1 - 1e-5)
    found, other = (solve_contact(*one, approach=approach) for one in zip(grids, fields, strict=True))
    assert_equal(other.pressure, found.pressure)


# --------------------------------------------------------------------------------------------------------- time steps


def scene_of(material, program, boundary="periodic", present=None, kept=(0.1, 0.2)):
    """Return a rough surface on the host."""
    gap = support.rough_gap(SHAPE)
    memory = Memory(material, program.duration)
    return Scene(Grid(SHAPE, SPACING, boundary), gap, memory, program, (*kept, program.duration), 1e-2, present=present)


def on_device(scene, xp):
    """Return the same scene on the device."""
    grid = Grid(SHAPE, SPACING, scene.grid.boundary, xp=xp)
    present = None if scene.present is None else xp.asarray(scene.present)
    return replace(scene, grid=grid, gap=xp.asarray(scene.gap), present=present)


def assert_same_march(scene, other):
    """Rows, errors, work and cost are the same; return both lists of steps."""
    steps, others = list(march(scene)), list(march(other))
    assert len(others) == len(steps) > 5
    for step, there in zip(steps, others, strict=True):
        assert_equal(there.point.pressure, step.point.pressure)
        assert_equal(other.memory.displacement(there.point.history), scene.memory.displacement(step.point.history))
        numbers, theirs = (
            [one.point.time, one.point.force, one.point.approach, one.state.work, *vars(one.difference).values()]
            for one in (step, there)
        )
        assert theirs == pytest.approx(numbers, rel=1e-9, abs=1e-12)
        assert there.state.convolutions == step.state.convolutions
    return steps, others


@BOUNDARIES
@pytest.mark.parametrize("material", [ZENER, SERIES, SOFT], ids=["zener", "prony", "kelvin-voigt"])
def test_march__is_the_same_on_a_device(xp, boundary, material):
    scene = scene_of(material, CYCLE, boundary, absent_cells() if boundary == "mirror" else None)
    assert_same_march(scene, on_device(scene, xp))


@pytest.mark.parametrize("material", [ZENER, SERIES], ids=["zener", "prony"])
def test_approach_with_loss_of_contact__is_the_same_on_a_device(xp, material):
    scene = scene_of(material, APPROACHES, "free")
    steps, _ = assert_same_march(scene, on_device(scene, xp))
    forces = [step.point.force for step in steps]
    apart = forces.index(0.0, 1)
    assert max(forces[:apart]) > 0
    assert forces[-1] > 0


def test_slide__is_the_same_on_a_device(xp):
    program = rv.Program().load(2.0, over=0).slide(7.0, speed=20.0).slide(3.6, speed=20.0, direction="-y").hold(0.1)
    scene = scene_of(ZENER, program, kept=(0.0, 0.35))
    other = on_device(scene, xp)
    steps, others = assert_same_march(scene, other)
    assert steps[-1].state.distance == pytest.approx(10.6)
    for step, there in zip(steps, others, strict=True):
        motion = scene.motions[step.segment]
        one, two = (
            [
                tangential_force(place.grid, row.point.pressure, support.displaced(place, row), motion, across)
                for across in (False, True)
            ]
            for place, row in ((scene, step), (other, there))
        )
        assert two == pytest.approx(one, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("boundary", "program"), [("free", CYCLE), ("periodic", CYCLE), ("mirror", CYCLE), ("periodic", STROKE)]
)
def test_creeping_layer__is_the_same_on_a_device(xp, boundary, program):
    waves = layer_series(Layers((6.0,), (ZENER, rv.zener(3.0, 1.0, 0.2))), 0.5, program.duration, 1e-3)
    scene = scene_of(ZENER, program, boundary)
    scene = replace(scene, memory=LayerMemory(waves, program.duration, scene.grid))
    other = on_device(scene, xp)
    assert_same_march(scene, replace(other, memory=LayerMemory(waves, program.duration, other.grid)))


# ------------------------------------------------------------------------------------------------------ steady sliding


@pytest.mark.parametrize("load", [0.5, 5.0, 500.0], ids=["sparse", "partial", "full"])
def test_steady_sliding__is_the_same_on_a_device(xp, load):
    gap = support.rough_gap(SHAPE, slope=0.1)
    body = Body(ZENER, HALF_SPACE)
    of_host, of_device = Sliding(body, SHAPE, SPACING, 3.0), Sliding(body, SHAPE, SPACING, 3.0, xp)
    found = steady_state(of_host, gap, load, tolerance=1e-5)
    other = steady_state(of_device, xp.asarray(gap), load, tolerance=1e-5)
    assert found.converged
    assert found.vectors > 3
    assert (other.converged, other.iterations, other.vectors) == (True, found.iterations, found.vectors)
    assert_equal(other.pressure, found.pressure)
    assert_equal(other.displacement, found.displacement)
    assert other.power_force == pytest.approx(found.power_force, rel=1e-12)
    assert of_device.force(other.pressure, axis=1) == pytest.approx(of_host.force(found.pressure, axis=1), rel=1e-9)


# ------------------------------------------------------------------------------------------------------- the stand-in


@pytest.mark.parametrize(
    "mix",
    [
        lambda xp, here, there: there + here,
        lambda xp, here, there: here * there,
        lambda xp, here, there: np.maximum(there, here),
        lambda xp, here, there: xp.maximum(here, 0),
        lambda xp, here, there: np.stack([there, here]),
        lambda xp, here, there: xp.where(there > 0, there, here),
        lambda xp, here, there: there[here > 0],
        lambda xp, here, there: there[np.arange(2)],
        lambda xp, here, there: here[there > 0],
        lambda xp, here, there: there.take(np.arange(2)),
        lambda xp, here, there: there.__setitem__(slice(None), here),
        lambda xp, here, there: here.__setitem__(slice(None), there),
        lambda xp, here, there: here.__iadd__(there),
        lambda xp, here, there: there.__iadd__(here),
        lambda xp, here, there: np.multiply(there, 2.0, out=here),
        lambda xp, here, there: np.asarray(there),
        lambda xp, here, there: np.add.reduce(there),
        lambda xp, here, there: np.linalg.norm(there),
        lambda xp, here, there: there.max(initial=0.0),
    ],
)
def test_stand_in__refuses_plain_arrays_and_what_cupy_lacks(xp, mix):
    here = np.ones(3)
    with pytest.raises(TypeError):
        mix(xp, here, xp.asarray(here))


@pytest.mark.parametrize("field", ["gap", "present", "history"])
def test_one_plain_array__is_refused_by_the_march(xp, field):
    scene = scene_of(ZENER, CYCLE, present=absent_cells())
    other = on_device(scene, xp)
    if field == "history":
        step = next(step for step in march(other) if step.is_end and step.point.time > 0)
        history = replace(step.point.history, modes=step.point.history.modes.get())
        start = replace(step.state, fine=replace(step.state.fine, history=history))
    else:
        other, start = replace(other, **{field: getattr(scene, field)}), None
    with pytest.raises(TypeError):
        list(march(other, start))
