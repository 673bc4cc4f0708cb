"""Passes over a grid: what NumPy does at once, whatever the parts and the threads."""

import numpy as np
import pytest

from roughvisc.mechanics.contact import long_waves, passes, solve_contact
from roughvisc.mechanics.halfspace import operator
from roughvisc.mechanics.halfspace.operator import HalfSpace

THREADS = pytest.mark.parametrize("threads", [1, 2, 3])


@pytest.fixture(autouse=True)
def in_small_parts(monkeypatch):
    monkeypatch.setattr(passes, "_PART", 13)


@THREADS
def test_passes__do_what_numpy_does_at_once(threads):
    rng = np.random.default_rng(0)
    a, b, out = rng.standard_normal((3, 9, 11))
    assert passes.add(a, b, out, threads) is out
    assert np.array_equal(out, a + b)
    single, onto = b.astype(np.float32), a.copy()
    passes.add_scaled(onto, single, 0.3, threads)
    assert np.array_equal(onto, a + 0.3 * single.astype(float))
    present = rng.random((9, 11)) > 0.8
    assert passes.lowest(a, None, threads) == a.min()
    assert passes.lowest(a, present, threads) == a[present].min()
    flat = a.reshape(-1)
    found = passes.cells_where(lambda part: flat[part] > 0.5, a.size, threads)
    assert np.array_equal(found, np.flatnonzero(a > 0.5))
    assert np.array_equal(passes.taken(a, found, threads), flat[found])
    assert passes.taken(single, found[:0], threads).dtype == np.float32


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_contact__has_the_same_bits_on_any_threads(monkeypatch, boundary):
    for name, value in {"_THREADED": 1, "_BLOCKED": 1, "_POINTS": 1, "_COLUMNS": 5, "_ROWS": 8}.items():
        monkeypatch.setattr(operator, name, value)
    monkeypatch.setattr(long_waves, "_FROM", 1)
    gap = np.random.default_rng(5).random((48, 37))
    one, *others = (
        solve_contact(HalfSpace((48, 37), (1.0, 1.3), boundary, workers=threads), gap, load=60.0, tolerance=1e-6)
        for threads in (1, 2, 3)
    )
    assert one.iterations > 3
    for other in others:
        assert np.array_equal(one.pressure, other.pressure)
        assert np.array_equal(one.displacement, other.displacement)
        assert one.approach == other.approach
