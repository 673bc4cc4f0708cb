"""Work on a grid by blocks: what NumPy does at once, whatever the blocks and the threads."""

import threading
import tracemalloc
from itertools import pairwise

import numpy as np
import pytest

from roughvisc.mechanics import arrays
from roughvisc.mechanics.bodies import operator
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import long_waves, solve_contact

THREADS = pytest.mark.parametrize("threads", [1, 2, 3])


@pytest.fixture(autouse=True)
def in_small_parts(monkeypatch):
    monkeypatch.setattr(arrays, "_BLOCK", 13)


@THREADS
def test_blocks__do_what_numpy_does_at_once(threads):
    rng = np.random.default_rng(0)
    a, b, out = rng.standard_normal((3, 9, 11))
    arrays.blockwise(np.add, a, b, out=out, threads=threads)
    assert np.array_equal(out, a + b)
    single, onto = b.astype(np.float32), a.copy()
    arrays.add_scaled(onto, single, 0.3, threads)
    assert np.array_equal(onto, a + 0.3 * single.astype(float))
    present = rng.random((9, 11)) > 0.8
    assert arrays.lowest(a, None, threads) == a.min()
    assert arrays.lowest(a, present, threads) == a[present].min()
    flat = a.reshape(-1)
    found = arrays.cells_where(lambda part: flat[part] > 0.5, a.size, threads)
    assert np.array_equal(found, np.flatnonzero(a > 0.5))
    assert np.array_equal(arrays.gather(a, found, threads), flat[found])
    values = rng.standard_normal(found.size)
    expected = np.ones(a.size)
    expected[found] = values
    out[...] = 1
    arrays.scatter(out.reshape(-1), found, values, threads)
    assert np.array_equal(out.reshape(-1), expected)


@THREADS
@pytest.mark.parametrize("size", [10**6, 13, 4])
def test_values_of_some_cells__are_carried_over_to_others(threads, size, monkeypatch):
    """Cells that both have, that one has, that none has in a part: as through a field."""
    monkeypatch.setattr(arrays, "_BLOCK", size)
    rng = np.random.default_rng(3)
    cells, onto = (np.flatnonzero((rng.random(99) < 0.4) & (np.arange(99) // 20 != gap)) for gap in (1, 3))
    values = rng.standard_normal(cells.size)
    field = np.zeros(99)
    field[cells] = values
    found = arrays.regather(values, cells, onto, field.size, threads)
    assert np.array_equal(found, field[onto])
    assert 0 < np.count_nonzero(found) < onto.size
    assert arrays.regather(values[:0], cells[:0], onto, field.size, threads).sum() == 0
    moved = np.append(cells[:-1], 98)  # the same but in the last part
    assert cells[-1] < 98
    field[cells[-1]] = 0
    assert np.array_equal(arrays.regather(values[:-1], cells[:-1], moved, field.size, threads), field[moved])


@THREADS
def test_blocks__of_arithmetic(threads):
    a, b, c = np.random.default_rng(1).standard_normal((3, 9, 11))

    for ufunc, other in ((np.subtract, b), (np.multiply, 0.3), (np.divide, 0.3), (np.maximum, 0.0)):
        out = a.copy()
        arrays.blockwise(ufunc, out, other, out=out, threads=threads)
        assert np.array_equal(out, ufunc(a, other))
    out = a.copy()
    assert arrays.cut_at_zero(out, threads)
    assert np.array_equal(out, np.maximum(a, 0))
    assert not arrays.cut_at_zero(out, threads)
    out = a.copy()
    assert arrays.weighted([(0.2, out), (0.3, b), (-2.0, c)], out, threads) is out
    assert np.array_equal(out, 0.2 * a + 0.3 * b + -2.0 * c)


def test_sums__are_those_of_the_parts_in_their_order_on_any_threads():
    a, b = np.random.default_rng(2).standard_normal((2, 9 * 11))
    parts = [slice(first, first + 13) for first in range(0, a.size, 13)]
    for threads in (1, 2, 3):
        assert arrays.total(a, threads) == sum(a[part].sum() for part in parts)
        assert arrays.l1_distance(a, b, threads) == sum(np.abs(a[part] - b[part]).sum() for part in parts)
        assert arrays.total(a[:0], threads) == 0
        cells = np.flatnonzero(a > 0)
        there = [cells[part] for part in parts]
        assert arrays.inner(b, cells, a[cells], threads) == sum((a[few] * b[few]).sum() for few in there)


def test_blocks__write_into_no_copy():
    with pytest.raises(ValueError, match="follow each other in memory"):
        arrays.blockwise(np.multiply, np.ones((5, 4)), 2.0, out=np.ones((4, 5)).T)


@THREADS
@pytest.mark.parametrize("error", [KeyError, IndexError])
def test_error_in_a_part__ends_all(threads, error):
    done = []

    def work(part):
        if part == 5:
            raise error("of the part")
        done.append(part)

    with pytest.raises(error, match="of the part"):
        arrays.parallel_map(work, range(1000), threads)
    assert len(done) < 1000 - 1


@pytest.mark.parametrize("threads", [2, 3, 4])
@pytest.mark.parametrize("count", [7, 12, 65])
def test_parts_worked_on_at_a_time__do_not_lie_side_by_side(threads, count):
    order = arrays._interleaved(count, threads)
    assert sorted(order) == list(range(count))
    assert min(abs(a - b) for a, b in pairwise(order)) >= -(-count // threads) - 1


def test_side_by_side__within_itself_ends():
    def inner(part):
        return sum(arrays.parallel_map(lambda number: number * part, range(4), 2))

    assert arrays.parallel_map(inner, range(20), 2) == [6 * part for part in range(20)]


@pytest.mark.parametrize("size", [14, 26, 27, 39, 40, 131])
def test_parts__are_pairs_of_equal_ones(size):
    parts = arrays.over_blocks(lambda part: part, size, 1)
    assert len(parts) % 2 == 0
    assert np.array_equal(np.concatenate([np.arange(size)[part] for part in parts]), np.arange(size))
    lengths = [part.stop - part.start for part in parts]
    assert max(lengths) <= 13
    assert min(lengths) > max(lengths) - len(parts)  # the last one is what is left


@pytest.mark.parametrize("cell", [None, 0, 13, 98])
def test_any_positive__finds_one_cell_wherever_it_is(cell):
    field = np.zeros((9, 11))
    field[4] = -1.0
    if cell is not None:
        field.reshape(-1)[cell] = 1e-300
    assert arrays.any_positive(field) == (cell is not None)


@pytest.mark.parametrize("kind", [np.int32, np.int64])
def test_cells_of_a_part__are_found_without_a_copy_of_all(kind):
    cells = np.arange(0, 300_000, 3, dtype=kind)
    tracemalloc.start()
    few = arrays.slice_of_sorted(slice(100, 200), cells)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert cells[few].tolist() == list(range(102, 200, 3))
    assert peak < cells.nbytes / 10


@THREADS
def test_what_was_found_of_parts__is_joined_in_their_order(threads):
    parts = [np.arange(3, dtype=np.int32), np.empty(0, np.int32), np.array([9], np.int32)]
    found = arrays.concatenate(parts, threads)
    assert found.dtype == np.int32
    assert found.tolist() == [0, 1, 2, 9]
    assert arrays.concatenate(parts[:1], threads) is parts[0]


def test_work_beside__begins_at_once_on_another_thread():
    begun = threading.Event()

    def work():
        begun.set()
        return threading.get_ident()

    found = arrays.submit(work, 2)
    assert begun.wait(30)
    assert found() != threading.get_ident()
    begun.clear()
    found = arrays.submit(work, 1)
    assert not begun.is_set()  # the only thread is the caller's
    assert found() == threading.get_ident()


def test_work_beside__is_the_callers_where_no_other_thread_is_free():
    ended, busy = threading.Event(), threading.Event()
    waiting = arrays.submit(lambda: (busy.set(), ended.wait(30)), 2)
    assert busy.wait(30)
    assert arrays.submit(threading.get_ident, 2)() == threading.get_ident()
    ended.set()
    waiting()


@pytest.mark.parametrize("threads", [1, 2])
def test_error_beside__comes_where_it_is_waited_for(threads):
    def work():
        raise KeyError("of the work")

    found = arrays.submit(work, threads)
    with pytest.raises(KeyError, match="of the work"):
        found()


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_contact__has_the_same_bits_on_any_threads(monkeypatch, boundary):
    monkeypatch.setattr(arrays, "_THREADED", 1)
    for name, value in {"_BLOCKED": 1, "_COLUMN_BYTES": 1, "_COLUMNS": 5, "_ROW_POINTS": 500}.items():
        monkeypatch.setattr(operator, name, value)
    monkeypatch.setattr(long_waves, "_FROM", 1)
    monkeypatch.setattr(long_waves, "_SPOTS", 0.0)
    gap = np.random.default_rng(5).random((48, 37))
    one, *others = (
        solve_contact(Operator((48, 37), (1.0, 1.3), boundary, workers=threads), gap, load=60.0, tolerance=1e-6)
        for threads in (1, 2, 3)
    )
    assert one.iterations > 3
    for other in others:
        assert np.array_equal(one.pressure, other.pressure)
        assert np.array_equal(one.displacement, other.displacement)
        assert one.approach == other.approach


def test_rows__are_whole_and_come_in_their_order(monkeypatch):
    monkeypatch.setattr(arrays, "_BLOCK", 20)
    field = np.arange(7 * 9.0).reshape(7, 9)
    found = arrays.over_rows(lambda rows: (rows, float(field[rows].sum())), field.shape, 2)
    assert [rows for rows, _ in found] == [slice(0, 2), slice(2, 4), slice(4, 6), slice(6, 7)]
    assert [value for _, value in found] == [
        field[r].sum() for r in (slice(0, 2), slice(2, 4), slice(4, 6), slice(6, 7))
    ]
