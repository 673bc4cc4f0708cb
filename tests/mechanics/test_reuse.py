"""Memory of wide fields that is used again."""

import gc
import threading

import numpy as np
import pytest

from roughvisc.mechanics import arrays as reuse
from roughvisc.mechanics.arrays import empty, reused

SHAPE = (33, 25)


@pytest.fixture(autouse=True)
def small_fields_too(monkeypatch):
    monkeypatch.setattr(reuse, "_FROM", 1)


def address(field):
    return field.__array_interface__["data"][0]


def test_memory__is_taken_again_when_the_last_view_is_gone():
    with reused():
        field = empty(SHAPE)
        field[...] = np.arange(field.size).reshape(SHAPE)
        there, row = address(field), field[3, 2:5]
        del field
        gc.collect()
        other = empty(SHAPE)
        assert address(other) != there
        other.fill(np.nan)
        assert row.tolist() == [77.0, 78.0, 79.0]
        del row
        assert address(empty(SHAPE)) == there


def test_memory__goes_by_its_size_not_by_shape_and_kind():
    with reused():
        there = address(empty(SHAPE))
        again = empty((50, 33), np.float32)
        assert address(again) == there
        assert again.shape == (50, 33)
        assert again.dtype == np.float32
        assert again.flags.writeable
        assert again.flags.c_contiguous
        assert empty((33, 24)).nbytes == 33 * 24 * 8


def test_fields__outlive_the_block_and_keep_nothing_else_alive():
    with reused():
        kept, dropped = empty(SHAPE), empty(SHAPE)
        kept.fill(1.5)
        pool = reuse._kept.get()
        del dropped
        assert sum(map(len, pool._by_size.values())) == 1
    assert pool._by_size == {}
    assert (kept == 1.5).all()
    del kept
    assert pool._by_size == {}
    assert isinstance(empty(SHAPE).base, type(None))


def test_blocks__within_each_other_are_one():
    with reused():
        outer = reuse._kept.get()
        with reused():
            assert reuse._kept.get() is outer
            field = empty(SHAPE)
            there = address(field)
            del field
        assert address(empty(SHAPE)) == there
    assert reuse._kept.get() is None


def test_block_apart__has_memory_of_its_own_and_gives_it_back():
    with reused():
        outer = reuse._kept.get()
        with reused(separate=True):
            inner = reuse._kept.get()
            empty(SHAPE)
            assert (sum(map(len, inner._by_size.values())), outer._by_size) == (1, {})
        assert reuse._kept.get() is outer
        assert inner._by_size == {}


def test_blocks__end_on_errors():
    with pytest.raises(ZeroDivisionError), reused():
        1 / 0  # noqa: B018
    assert reuse._kept.get() is None


def test_threads__have_memory_of_their_own():
    found = []

    def other():
        found.append(reuse._kept.get())
        with reused():
            found.append(reuse._kept.get())

    with reused():
        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
        assert found[0] is None
        assert found[1] is not reuse._kept.get()


def test_small_fields__are_left_to_numpy(monkeypatch):
    monkeypatch.setattr(reuse, "_FROM", 33 * 25 * 8 + 1)
    with reused():
        assert empty(SHAPE).base is None
        assert empty((33, 26)).base is not None
