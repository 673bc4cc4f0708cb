"""The contact of one instant on a stand-in for CuPy's arrays, to rounding; and what the stand-in refuses."""

import device
import numpy as np
import pytest
import support

from roughvisc.mechanics.contact import long_waves, passes, solver
from roughvisc.mechanics.grid import Grid

BOUNDARIES = pytest.mark.parametrize("boundary", ["free", "periodic", "mirror"])
SHAPE, SPACING = (23, 18), (1.0, 1.2)


@pytest.fixture(autouse=True)
def xp(monkeypatch):
    """The device in CuPy's place. SciPy transforms plain arrays too, as the stand-in does."""
    return device.install(monkeypatch)


def assert_equal(one, other):
    """Compare an array of the device with one of the host."""
    np.testing.assert_allclose(one.get(), other, rtol=0, atol=1e-12 * np.abs(other).max(initial=1e-300))


# ------------------------------------------------------------------------------------------------------------ contact


def solved_on_both(xp, boundary, gap, present=None, **given):
    """Solve on NumPy and on the device, compare, and return the state of NumPy."""
    there = None if present is None else xp.asarray(present)
    grids = Grid(gap.shape, SPACING, boundary), Grid(gap.shape, SPACING, boundary, xp=xp)
    found = solver.solve_contact(grids[0], gap, present=present, **given)
    other = solver.solve_contact(grids[1], xp.asarray(gap), present=there, **given)
    assert (grids[1].convolutions, other.iterations) == (grids[0].convolutions, found.iterations)
    assert_equal(other.pressure, found.pressure)
    assert_equal(other.displacement, found.displacement)
    assert other.approach == pytest.approx(found.approach, rel=1e-12)
    assert other.load == pytest.approx(found.load, rel=1e-12)
    return found


@BOUNDARIES
def test_wide_contact__is_the_same_on_a_device(monkeypatch, xp, boundary):
    """With a first guess on half the cells and the second level of the preconditioner."""
    monkeypatch.setattr(solver, "COARSE_FROM", 40)
    monkeypatch.setattr(solver, "BLOCKS_FROM", 40)
    monkeypatch.setattr(long_waves, "SPOTS", 0.0)
    used, blocks = [], passes.block_pressure
    monkeypatch.setattr(passes, "block_pressure", lambda *values: used.append(values) or blocks(*values))
    solved_on_both(xp, boundary, support.rough_gap((52, 41)), load=30.0)
    assert len(used) > 6


@BOUNDARIES
def test_projected_gradient_steps__are_the_same_on_a_device(monkeypatch, xp, boundary):
    monkeypatch.setattr(solver, "PATIENCE", 0)
    taken, projected = [], solver.onto_simplex
    monkeypatch.setattr(solver, "onto_simplex", lambda *values: taken.append(values) or projected(*values))
    solved_on_both(xp, boundary, support.rough_gap(SHAPE), load=20.0, tolerance=0.1)
    assert len(taken) > 6


@pytest.mark.parametrize("given", [{"load": 100.0}, {"load": 300.0}, {"approach": 1 - 1e-5}], ids=str)
def test_nearly_full_contact__is_the_same_on_a_device(xp, given):
    """The level is weighted by the pressure that opens the gap, and the approach needs a check of the load."""
    gap = support.rough_gap(SHAPE, slope=0.1)
    given = {name: value * (gap.mean() if name == "approach" else 1) for name, value in given.items()}
    assert (solved_on_both(xp, "periodic", gap, **given).pressure > 0).mean() > 0.7


# ------------------------------------------------------------------------------------------------------- the stand-in


@pytest.mark.parametrize(
    "mix",
    [
        lambda xp, here, there: there + here,
        lambda xp, here, there: here * there,
        lambda xp, here, there: xp.maximum(here, 0),
        lambda xp, here, there: np.stack([there, here]),
        lambda xp, here, there: there[here > 0],
        lambda xp, here, there: here[there > 0],
        lambda xp, here, there: there.__setitem__(slice(None), here),
        lambda xp, here, there: here.__iadd__(there),
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
