"""Memory of layered bodies: against the memory of a half-space, a sum over all past steps, and limits."""

import numpy as np
import pytest
from samples import COMPRESSIBLE as RUBBER
from samples import POLYMER
from scipy import linalg

import roughvisc as rv
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.layer import Layers, layer_series
from roughvisc.mechanics.layer_memory import LayerMemory
from roughvisc.mechanics.memory import Memory

SHAPE, SPACING = (7, 6), (2e-5, 3e-5)
FLUID, SOFT = rv.maxwell(1e6, 1e5), rv.kelvin_voigt(1e6, 1e5)
PAIRS = {"rubber on polymer": (RUBBER, POLYMER), "fluid on rubber": (FLUID, RUBBER), "rubber on soft": (RUBBER, SOFT)}
DURATION = 1.0
STEPS = [0.0, 1e-3, 2e-3, 0.01, 0.02, 0.3, 0.6]


def pressures(count, seed=0):
    return np.random.default_rng(seed).uniform(0, 1e5, (count, *SHAPE))


def memory_of(pair, boundary="periodic", thickness=1e-4):
    waves = layer_series(Layers((thickness,), pair), 1e-6, DURATION, 1e-4)
    return LayerMemory(waves, DURATION, Grid(SHAPE, SPACING, boundary))


def marched(memory, steps, fields, grid, rule=None):
    """Displacement after each step, by the prediction before it and from the memory after it."""
    history, found = memory.start(np.zeros(SHAPE)), []
    for step, pressure in zip(steps, fields, strict=True):
        prediction = memory.predict(history, step, rule)
        kernel = prediction.grid or grid
        unit = kernel.displacement(pressure)
        predicted = prediction.compliance * unit + prediction.carried
        history = memory.advance(history, prediction, unit, pressure)
        np.testing.assert_allclose(
            memory.displacement(history)[0], predicted, rtol=1e-9, atol=1e-12 * abs(predicted).max()
        )
        found.append(predicted)
    return found, history


@pytest.mark.parametrize("boundary", ["free", "periodic", "mirror"])
@pytest.mark.parametrize("material", [RUBBER, FLUID, SOFT])
@pytest.mark.parametrize("rule", ["linear", "bdf2"])
def test_equal_materials__have_the_memory_of_a_half_space(boundary, material, rule):
    layered, grid = memory_of((material, material), boundary), Grid(SHAPE, SPACING, boundary)
    half_space, fields = Memory(material, DURATION), pressures(len(STEPS))

    def displaced(memory):
        history, found = memory.start(np.zeros(SHAPE)), []
        for number, (step, pressure) in enumerate(zip(STEPS, fields, strict=True)):
            used = "constant" if rule == "bdf2" and (number < 2 or not memory.may_ring) else rule
            prediction = memory.predict(history, step, used)
            unit = (prediction.grid or grid).displacement(pressure)
            found.append(prediction.compliance * unit + prediction.carried)
            history = memory.advance(history, prediction, unit, pressure)
        return found, memory.after_rest(history, 0.1)

    found, expected = displaced(layered), displaced(half_space)
    assert layered.may_ring == half_space.may_ring
    for one, other in zip((*found[0], found[1]), (*expected[0], expected[1]), strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=2e-7 * abs(other).max())


def test_at_once__is_the_response_to_a_jump():
    memory, [pressure] = memory_of(PAIRS["rubber on polymer"]), pressures(1)
    [found], history = marched(memory, [0.0], [pressure], memory.grid)
    np.testing.assert_allclose(memory.at_once(history), found, rtol=1e-9, atol=1e-12 * abs(found).max())
    assert memory.unit(history) is None


@pytest.mark.parametrize(("cells", "axis"), [(2, 0), (-1, 1)])
def test_roll__moves_the_displacement(cells, axis):
    memory = memory_of(PAIRS["fluid on rubber"])
    _, history = marched(memory, STEPS, pressures(len(STEPS)), memory.grid)
    rolled = memory.displacement(memory.roll(history, cells, axis))[0]
    np.testing.assert_allclose(rolled, np.roll(memory.displacement(history)[0], -cells, axis), rtol=1e-9, atol=1e-18)


@pytest.mark.thorough
def test_kernel_of_a_step__is_positive():
    memory = memory_of(PAIRS["rubber on polymer"], "free")
    kernel = memory.predict(memory.start(np.zeros(SHAPE)), DURATION).grid
    matrix = np.array([kernel.displacement(one.reshape(SHAPE)).ravel() for one in np.eye(SHAPE[0] * SHAPE[1])])
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-12 * matrix.max())
    assert linalg.eigvalsh(matrix).min() > 0


def test_elastic_layers__have_no_history():
    memory = memory_of((rv.elastic(1e6), rv.elastic(1e8, 0.3)))
    assert memory.is_elastic
    assert not memory.may_ring
    assert memory.start(np.zeros(SHAPE)).modes.shape[0] == 0
