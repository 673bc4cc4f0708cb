"""The second level of the preconditioner: symmetric, positive, right for long waves, and no part of the answer."""

import threading
import time

import numpy as np
import pytest

from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import long_waves, solve_contact
from roughvisc.mechanics.contact.influence import Influence
from roughvisc.mechanics.contact.long_waves import LongWaves
from roughvisc.topography.synthesis import self_affine

SHAPE, SPACING = (52, 37), (0.5, 0.7)


@pytest.fixture
def on_small_grids(monkeypatch):
    monkeypatch.setattr(long_waves, "_FROM", 1)
    monkeypatch.setattr(long_waves, "_SPOTS", 0.0)
    monkeypatch.setattr(long_waves, "_TOLERANCE", 1e-11)
    monkeypatch.setattr(long_waves, "_KIND", float)


def spots():
    """Small spots of contact, scattered over the grid: flat indices."""
    rng = np.random.default_rng(0)
    mask = np.zeros(SHAPE, bool)
    for x, y in rng.integers((0, 0), SHAPE, size=(20, 2)):
        mask[x : x + 2, y : y + 3] = True
    return np.flatnonzero(mask)


def waves_of(boundary="periodic", mirrored=False):
    influence = Influence(Operator(SHAPE, SPACING, boundary, mirrored=mirrored), 1.7)
    cells = spots()
    pressure = np.zeros(SHAPE)
    pressure.reshape(-1)[cells] = np.random.default_rng(1).random(cells.size) + 0.5
    energy = float((pressure * influence.displacement(pressure)).sum())
    waves = LongWaves.of(influence, cells, pressure.reshape(-1)[cells], energy)
    return influence, cells, waves


def matrix(columns, count):
    """Of a linear map on the cells."""
    return np.stack([columns(unit) for unit in np.eye(count)], axis=1)


BODIES = pytest.mark.parametrize(("boundary", "mirrored"), [("periodic", False), ("free", False), ("periodic", True)])


@BODIES
def test_both_levels__are_symmetric_and_positive(on_small_grids, boundary, mirrored):
    influence, cells, waves = waves_of(boundary, mirrored)

    def fine(values):
        return influence.approximate_pressure(values, cells)

    both = matrix(lambda unit: waves.preconditioned(unit, fine), cells.size)
    assert np.abs(both - both.T).max() < 1e-5 * np.abs(both).max()  # the cells' level is in single precision
    assert np.linalg.eigvalsh(0.5 * (both + both.T)).min() > 0


@BODIES
def test_blocks__are_answered_by_the_inverse_of_their_own_equations(on_small_grids, boundary, mirrored):
    influence, _, waves = waves_of(boundary, mirrored)
    count = waves.cells.size
    coarse = influence.operator.coarse
    assert coarse.shape == (7, 5)
    assert np.multiply(coarse.shape, coarse.spacing) == pytest.approx(np.multiply(SHAPE, SPACING))
    kernel = matrix(influence.of_blocks, count)
    assert np.diag(kernel) == pytest.approx(np.full(count, influence.of_one_block)) or mirrored
    number = np.diag(waves.cells)
    equations = number @ kernel @ number + waves.local * number
    uniform = np.random.default_rng(3).random(count) * (waves.cells > 0)
    residual = (equations @ uniform / np.maximum(waves.cells, 1))[waves.blocks]  # the same all over each block
    found = waves.preconditioned(residual, np.zeros_like) / influence.scale
    assert found == pytest.approx(uniform[waves.blocks], rel=1e-6)


def test_blocks__cover_the_grid_in_equal_parts(on_small_grids):
    _, cells, waves = waves_of()
    x, y = np.divmod(cells, SHAPE[1])
    assert np.array_equal(waves.blocks, (x * 7 // 52) * 5 + y * 5 // 37)
    assert np.array_equal(waves.cells, np.bincount(waves.blocks, minlength=35))


def test_local_compliance__is_what_spots_sink_in_beside_their_blocks(on_small_grids):
    """The energy under one pressure in all spots, by the matrix of all cells."""
    influence, cells, waves = waves_of()
    pressure = np.zeros(SHAPE)
    pressure.reshape(-1)[cells] = 1
    total = float((pressure * influence.displacement(pressure)).sum())
    smooth = float((waves.cells * influence.of_blocks(waves.cells)).sum())
    of_ones = LongWaves.of(influence, cells, np.ones(cells.size), total)
    assert of_ones.local == pytest.approx(long_waves._SHARE * (total - smooth) / cells.size)


def test_both_levels__need_fewer_iterations_on_a_wide_rough_surface(monkeypatch):
    """Those of one level grow with the width."""
    surface = self_affine((500.0, 490.0), (500, 490), hurst=0.8, rms_slope=1.0, rolloff=125.0, seed=3)
    operator, gap = Operator((500, 490), (1.0, 1.0), "free"), surface.values.max() - surface.values
    alone = solve_contact(operator, gap, load=0.05 * gap.size, tolerance=1e-4)
    monkeypatch.setattr(long_waves, "_FROM", 400)
    both = solve_contact(operator, gap, load=0.05 * gap.size, tolerance=1e-4)
    assert 0.05 < np.mean(alone.pressure > 0) < 0.15
    assert both.iterations < 0.75 * alone.iterations


def test_long_waves__are_left_to_large_grids_sparse_contact_and_kernels_that_give_way():
    influence, cells, _ = Influence(Operator(SHAPE, SPACING), 1.0), spots(), None
    ones = np.ones(cells.size)
    assert LongWaves.of(influence, cells, ones, 1e9) is None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(long_waves, "_FROM", 1)
        assert LongWaves.of(influence, cells, ones, 1e9) is None  # few spots
        patch.setattr(long_waves, "_SPOTS", 0.0)
        assert LongWaves.of(influence, cells, ones, 1e9) is not None
        assert LongWaves.of(influence, cells, ones, 0.0) is None  # no more energy than the blocks alone
        dense = np.arange(int(0.7 * influence.size))
        assert LongWaves.of(influence, dense, np.ones(dense.size), 1e9) is None


def test_spots__count_by_the_cells_whose_block_is_not_all_free(monkeypatch):
    """Half of the free cells fill their blocks, the others do not: 0.5 times 8 blocks a side."""
    influence = Influence(Operator((64, 72), (1.0, 1.0)), 1.0)
    mask = np.zeros((64, 72), bool)
    mask[8:16, :8] = mask[24:32, 16:24] = True
    mask[40:56, 4::9] = True
    monkeypatch.setattr(long_waves, "_FROM", 1)
    cells = np.flatnonzero(mask)
    for spots, pay in ((3.99, True), (4.01, False)):
        monkeypatch.setattr(long_waves, "_SPOTS", spots)
        assert (LongWaves.of(influence, cells, np.ones(cells.size), 1e9) is not None) is pay


def test_one_round_contact__needs_no_blocks(monkeypatch):
    """With them it took 117 iterations."""
    monkeypatch.setattr(long_waves, "_FROM", 384)
    gap = sum(np.square(x - 191.5) for x in np.indices((384, 384))) / 384.0
    state = solve_contact(Operator((384, 384), (1.0, 1.0), "free"), gap, load=0.1 * gap.size, tolerance=1e-6)
    assert 0.1 < np.mean(state.pressure > 0) < 0.4
    assert state.iterations < 25


@pytest.mark.parametrize("boundary", ["periodic", "free"])
@pytest.mark.parametrize("given", ["load", "approach"])
def test_contact__is_the_same_with_both_levels(monkeypatch, boundary, given):
    rng = np.random.default_rng(5)
    gap = rng.random((96, 75)) + 0.002 * ((np.indices((96, 75)).T - (50, 31)) ** 2).sum(-1).T
    operator = Operator((96, 75), (1.0, 1.3), boundary)
    known = {"load": 300.0} if given == "load" else {"approach": 1.2}
    alone = solve_contact(operator, gap, tolerance=1e-12, **known)
    monkeypatch.setattr(long_waves, "_FROM", 1)
    monkeypatch.setattr(long_waves, "_SPOTS", 0.0)
    both = solve_contact(operator, gap, tolerance=1e-12, **known)
    assert both.converged
    assert both.iterations != alone.iterations  # the second level was there
    assert np.abs(both.pressure - alone.pressure).sum() < 3e-6 * alone.pressure.sum()
    assert both.approach == pytest.approx(alone.approach, rel=1e-6)


def test_both_levels__leave_no_work_behind_where_one_fails(on_small_grids, monkeypatch):
    influence, _, waves = waves_of()
    influence.threads = 2
    ended = threading.Event()

    def precondition(self, sums):
        time.sleep(0.05)  # longer than the failure takes
        ended.set()
        return np.zeros_like(sums)

    def fails(residual):
        raise MemoryError("of the cells")

    monkeypatch.setattr(LongWaves, "_answered", precondition)
    with pytest.raises(MemoryError, match="of the cells"):
        waves.preconditioned(np.ones(spots().size), fails)
    assert ended.is_set()


@BODIES
@pytest.mark.parametrize("size", [1.0, 1e-60, 1e60])
def test_equations_of_the_blocks__are_solved_in_single_precision(on_small_grids, monkeypatch, boundary, mirrored, size):
    """The answer to a residual of any size, to what single precision leaves."""
    _, _, waves = waves_of(boundary, mirrored)
    sums = waves.cells * np.random.default_rng(4).standard_normal(waves.cells.size)
    double = waves._answered(sums)
    monkeypatch.setattr(long_waves, "_KIND", np.float32)
    monkeypatch.setattr(long_waves, "_TOLERANCE", 1e-5)
    single = waves._answered(size * sums)
    assert single.dtype == np.float64
    assert np.abs(single / size - double).max() < 1e-4 * np.abs(double).max()
