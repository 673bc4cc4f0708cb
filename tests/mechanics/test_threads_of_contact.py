"""Threads: the same bits on any number of them."""

import numpy as np
import pytest

from roughvisc.mechanics import grid as grids
from roughvisc.mechanics import threads as threading
from roughvisc.mechanics.contact import solve_contact, solver
from roughvisc.mechanics.grid import Grid


@pytest.mark.parametrize("boundary", ["free", "periodic", "mirror"])
def test_contact__has_the_same_bits_on_any_threads(monkeypatch, boundary):
    monkeypatch.setattr(threading, "THREADED_FROM", 1)
    for name, value in {"BLOCKS_FROM": 1, "COLUMN_BYTES": 1, "COLUMNS": 5, "ROWS": 7}.items():
        monkeypatch.setattr(grids, name, value)
    monkeypatch.setattr(solver, "BLOCKS_FROM", 1)
    monkeypatch.setattr(solver, "SPOTS", 0.0)
    gap = np.random.default_rng(5).random((48, 37))
    one, *others = (
        solve_contact(Grid((48, 37), (1.0, 1.3), boundary, workers=threads), gap, load=60.0) for threads in (1, 2, 3)
    )
    assert one.iterations > 3
    for other in others:
        assert np.array_equal(one.pressure, other.pressure)
        assert np.array_equal(one.displacement, other.displacement)
        assert one.approach == other.approach
