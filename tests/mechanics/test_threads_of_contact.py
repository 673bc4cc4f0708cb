"""Threads: the same bits on any number of them."""

import multiprocessing
import os

import numpy as np
import pytest
from scipy import fft

from roughvisc.mechanics import grid as grids
from roughvisc.mechanics.contact import long_waves, solver
from roughvisc.mechanics.grid import Grid


def on_threads(threads, boundary):
    with fft.set_workers(threads):
        return Grid((48, 37), (1.0, 1.3), boundary)


@pytest.mark.parametrize("boundary", ["free", "periodic", "mirror"])
def test_contact__has_the_same_bits_on_any_threads(monkeypatch, boundary):
    gap = np.random.default_rng(5).random((48, 37))
    whole = solver.solve_contact(Grid((48, 37), (1.0, 1.3), boundary), gap, load=60.0)
    unblocked = Grid((48, 37), (1.0, 1.3), boundary).displacement(whole.pressure)
    monkeypatch.setattr(grids, "THREADED_FROM", 1)
    for name, value in {"COLUMN_BYTES": 1, "COLUMNS": 5, "ROWS": 7}.items():
        monkeypatch.setattr(grids, name, value)
    monkeypatch.setattr(solver, "BLOCKS_FROM", 1)
    monkeypatch.setattr(long_waves, "SPOTS", 0.0)
    one, *others = (solver.solve_contact(on_threads(threads, boundary), gap, load=60.0) for threads in (1, 2, 3))
    assert one.iterations > 3
    assert np.abs(one.pressure - whole.pressure).sum() < 2e-3 * whole.pressure.sum()
    grid = on_threads(2, boundary)
    grid.inverse(whole.pressure.astype(np.float32))  # the first convolution does not determine the size of later ones
    blocked = grid.displacement(whole.pressure)
    np.testing.assert_allclose(blocked, unblocked, rtol=0, atol=1e-14 * unblocked.max())
    for other in others:
        assert np.array_equal(one.pressure, other.pressure)
        assert np.array_equal(one.displacement, other.displacement)
        assert one.approach == other.approach


def convolved(queue):
    queue.put(float(on_threads(2, "free").displacement(np.ones((48, 37))).sum()))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a system without fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_convolution_on_threads__works_in_a_forked_process_too(monkeypatch):
    """A forked process has none of the threads of its parent."""
    monkeypatch.setattr(grids, "THREADED_FROM", 1)
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    convolved(queue)
    expected = queue.get(timeout=30)
    child = context.Process(target=convolved, args=(queue,))
    child.start()
    try:
        assert queue.get(timeout=30) == expected
    finally:
        child.kill()
