"""Fields held by some of their cells, and sums that are not added up: the numbers of whole fields."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from roughvisc.mechanics import arrays as arrays_module
from roughvisc.mechanics import sparse
from roughvisc.mechanics.sparse import Sparse, Sum

SHAPE = (9, 11)
FIELDS = arrays(float, SHAPE, elements=st.sampled_from([0.0, 0.0, 0.0, 1.5, -2.25, 1e-300]))


@pytest.fixture(autouse=True)
def of_small_grids(monkeypatch):
    monkeypatch.setattr(sparse, "_ABOVE", 10)
    monkeypatch.setattr(arrays_module, "_BLOCK", 13)


def some(part, seed=1):
    """A field that is not zero on about so many of its cells."""
    rng = np.random.default_rng(seed)
    return rng.standard_normal(SHAPE) * (rng.random(SHAPE) < part)


@given(FIELDS)
def test_sparse__is_the_field(field):
    found = Sparse.of(field)
    np.testing.assert_array_equal(found.field(), field)
    assert (found.shape, found.size, found.count) == (SHAPE, 99, np.count_nonzero(field))
    for part in (slice(0, 99), slice(20, 57), slice(98, 99)):
        np.testing.assert_array_equal(found.part(part), field.reshape(-1)[part])
    np.testing.assert_array_equal(found.positive(), field > 0)
    assert found.total() == sum(np.sum(field.reshape(-1)[first : first + 13]) for first in range(0, 99, 13))
    cells, values = found.not_zero()
    np.testing.assert_array_equal(cells, np.flatnonzero(field))
    np.testing.assert_array_equal(values, field[field != 0])


@pytest.mark.parametrize("part", [0.0, 0.1, 0.9])
def test_sparse__is_added_in_memory_of_its_own(part):
    field, onto = some(part), some(1.0, seed=2)
    found, expected = Sparse.of(field), onto + 0.3 * field
    mine = found.times(-0.7)
    np.testing.assert_array_equal(mine, -0.7 * field)
    mine[...] = 5.0
    found.add_to(onto, 0.3)
    np.testing.assert_allclose(onto, expected, rtol=1e-15)
    np.testing.assert_array_equal(found.field(), field)


@pytest.mark.parametrize("part", [0.1, 0.9])
def test_sparse__is_as_far_from_another_as_the_fields_are(part):
    a, b = some(part), some(0.2, seed=3)
    assert Sparse.of(a).apart_from(Sparse.of(b)) == pytest.approx(np.abs(a - b).sum(), rel=1e-14)
    assert Sparse.of(a).apart_from(Sparse.of(a.copy())) == 0


def test_sparse__takes_what_its_cells_take():
    """Twelve bytes a cell, or eight of each cell of the grid; and nothing is copied of what is held whole."""
    few, many = Sparse.of(some(0.2)), some(0.9)
    assert few.cells.dtype == np.int32
    assert few.cells.nbytes + few.values.nbytes == 12 * few.count
    assert Sparse.of(many).values is many
    assert Sparse.of(many).field() is many


def test_narrow_grids__are_held_whole(monkeypatch):
    monkeypatch.setattr(sparse, "_ABOVE", 99)
    field = some(0.1)
    assert Sparse.of(field).values is field


def test_sum__is_added_up_where_it_is_asked_for():
    a, b, c = some(1.0, 1), some(0.5, 2), some(1.0, 3)
    found, expected = Sum(((0.5, a), (-2.0, b), (1.0, c))), 0.5 * a - 2.0 * b + c
    before = a.copy()
    np.testing.assert_allclose(found.field(), expected, rtol=1e-14)
    np.testing.assert_allclose(found.part(slice(20, 57)), expected.reshape(-1)[20:57], rtol=1e-14)
    np.testing.assert_array_equal(a, before)
    assert Sum.whole(a).field() is a
    np.testing.assert_array_equal(Sum.whole(a).part(slice(3, 8)), a.reshape(-1)[3:8])
    np.testing.assert_array_equal(Sum(((3.0, a),)).field(), 3.0 * a)


@pytest.mark.parametrize("threads", [1, 3])
def test_cut_at_zero__says_whether_anything_was_below_zero(threads):
    field = some(1.0)
    cut = field.copy()
    assert arrays_module.cut_at_zero(cut, threads)
    np.testing.assert_array_equal(cut, np.maximum(field, 0))
    assert not arrays_module.cut_at_zero(cut, threads)
    np.testing.assert_array_equal(cut, np.maximum(field, 0))
