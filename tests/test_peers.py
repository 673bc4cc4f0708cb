"""Agreement with an independent program, where it is installed: `pip install .[peers]`."""

import numpy as np
import pytest
from support import rough_gap

from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.grid import Grid

tamaas = pytest.importorskip("tamaas")


@pytest.fixture(autouse=True)
def _quiet():
    tamaas.set_log_level(tamaas.LogLevel.error)


def tamaas_pressure(gap, mean, boundary):
    """Pressure over the contact modulus, by Tamaas' Polonsky-Keer solver."""
    model = tamaas.Model(tamaas.model_type.basic_2d, [float(n) for n in gap.shape], list(gap.shape))
    model.E, model.nu = 1.0, 0.0  # set before the operator is registered
    if boundary == "free":
        tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
    solver = tamaas.PolonskyKeerRey(model, gap.max() - gap, 1e-12)
    if boundary == "free":
        solver.setIntegralOperator("dcfft")
    solver.max_iter = 20_000
    solver.solve(mean)
    return np.array(model.traction)


@pytest.mark.parametrize("boundary", ["periodic", "free"])
@pytest.mark.parametrize("mean", [0.02, 0.15])
def test_rough_contact__agrees_with_tamaas(boundary, mean):
    # even sizes: on odd ones Tamaas 2.9 takes the highest wave number for a Nyquist one (displacement off by 5e-5)
    gap = rough_gap((64, 64), slope=0.7)
    expected = tamaas_pressure(gap, mean, boundary)
    state = solve_contact(Grid(gap.shape, (1.0, 1.0), boundary), gap, load=mean * gap.size, tolerance=1e-12)
    assert np.sum(np.abs(state.pressure - expected)) < 1e-8 * np.sum(expected)
    assert np.mean(state.pressure > 0) == pytest.approx(np.mean(expected > 0), abs=0.5 / gap.size)
