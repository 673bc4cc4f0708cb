"""Passes over the cells of a grid or of a contact, by parts that stay in the cache, side by side on some threads.

Sums are those of the parts, added up in their order: what is found is the same to the last bit, whatever the number of
threads. A gather from a wide grid waits for the memory, more than all that is computed of it; so what is gathered is
used while it is in the cache. Cells are flat indices, ascending.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.fields.reuse import empty
from roughvisc.mechanics.fields.threads import blocks, parallel_map

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Cells = NDArray[np.int32] | NDArray[np.int64]
Found = TypeVar("Found")

# Cells of a part at most.
_PART = 1 << 17


def of_parts(work: Callable[[slice], Found], size: int, threads: int) -> list[Found]:
    """What some work gives of each part of a vector of some size, in their order."""
    if size <= _PART:
        return [work(slice(0, size))]
    pairs = -(-size // (2 * _PART))  # of equal parts: of three, one thread of two would wait for the last
    return parallel_map(work, list(blocks(size, -(-size // (2 * pairs)))), threads)


def of_vectors(work: Callable[..., Found], threads: int, *vectors: NDArray[Any]) -> list[Found]:
    """What some work gives of each part of vectors of one size, which it is given, in their order."""
    size = vectors[0].size
    if size <= _PART:  # on narrow grids slices would take as long as the work
        return [work(*vectors)]
    return of_parts(lambda part: work(*[vector[part] for vector in vectors]), size, threads)


def of_rows(work: Callable[[slice], Found], shape: tuple[int, ...], threads: int) -> list[Found]:
    """The same of parts of a field that are whole rows."""
    return parallel_map(work, list(blocks(shape[0], max(_PART // shape[1], 1))), threads)


def with_cells(work: Callable[[slice, slice], Found], size: int, cells: Cells, threads: int) -> list[Found]:
    """What some work gives of each part of a field of some size, and of those of some cells that lie in it."""

    if size <= _PART:
        return [work(slice(0, size), slice(0, cells.size))]
    return of_parts(lambda part: work(part, slice_of_sorted(part, cells)), size, threads)


def weighted(terms: Sequence[tuple[float, Array]], out: Array, threads: int) -> Array:
    """Sum of fields times their factors, in their order; ``out`` may be the first of them."""
    flat, found = [(factor, field.reshape(-1)) for factor, field in terms], _flat(out)

    def work(part: slice) -> None:
        here, (factor, field) = found[part], flat[0]
        np.multiply(field[part], factor, out=here)
        for factor, field in flat[1:]:
            here += factor * field[part]

    of_parts(work, out.size, threads)
    return out


def times(field: Array, factor: float, threads: int) -> Array:
    """``factor * field``, in memory of its own."""
    return weighted([(factor, field)], empty(field.shape), threads)


def add(a: Array, b: Array, out: Array, threads: int) -> Array:
    """``out = a + b``."""
    vectors = a.reshape(-1), b.reshape(-1), _flat(out)
    of_vectors(lambda first, second, found: np.add(first, second, out=found), threads, *vectors)
    return out


def add_scaled(out: Array, field: NDArray[Any], factor: float, threads: int) -> None:
    """``out += factor * field``, multiplied in double precision."""

    def work(found: Array, added: NDArray[Any]) -> None:
        here = added.astype(np.float64)
        here *= factor
        found += here

    of_vectors(work, threads, _flat(out), field.reshape(-1))


def subtract(out: Array, field: Array, threads: int) -> None:
    """``out -= field``."""
    of_vectors(lambda found, less: np.subtract(found, less, out=found), threads, _flat(out), field.reshape(-1))


def lower(out: Array, by: float, threads: int) -> None:
    """``out -= by``."""
    of_vectors(lambda found: np.subtract(found, by, out=found), threads, _flat(out))


def multiply(out: Array, factor: float, threads: int) -> None:
    """``out *= factor``."""
    of_vectors(lambda found: np.multiply(found, factor, out=found), threads, _flat(out))


def divide(out: Array, divisor: float, threads: int) -> None:
    """``out /= divisor``."""
    of_vectors(lambda found: np.divide(found, divisor, out=found), threads, _flat(out))


def scale(out: Array, origin: float, unit: float, threads: int) -> None:
    """``out = (out - origin) / unit``."""

    def work(found: Array) -> None:
        found -= origin
        found /= unit

    of_vectors(work, threads, _flat(out))


def cut(out: Array, threads: int) -> bool:
    """``out = max(out, 0)``, and whether that has changed anything."""

    def work(found: Array) -> bool:
        below = bool(found.min(initial=0.0) < 0)
        if below:
            np.maximum(found, 0, out=found)
        return below

    return any(of_vectors(work, threads, _flat(out)))


def cut_and_divide(out: Array, divisor: float, threads: int) -> None:
    """``out = max(out, 0) / divisor``."""

    def work(found: Array) -> None:
        np.maximum(found, 0, out=found)
        found /= divisor

    of_vectors(work, threads, _flat(out))


def l1_distance(a: Array, b: Array, threads: int) -> float:
    """Sum of the magnitudes of ``a - b``."""
    return sum(of_vectors(lambda first, second: summed(np.abs(first - second)), threads, a.reshape(-1), b.reshape(-1)))


def any_positive(field: Array) -> bool:
    """Whether any cell is: asked part by part, since one of the first mostly says so."""
    values = field.reshape(-1)
    return any(bool((values[part] > 0).any()) for part in blocks(field.size, _PART))


def lowest(field: Array, present: Mask | None, threads: int) -> float:
    """Least value of a field, of its present cells where there are others."""
    values, there = field.reshape(-1), None if present is None else present.reshape(-1)

    def work(part: slice) -> float:
        if there is None:
            return float(values[part].min())
        return float(values[part].min(where=there[part], initial=np.inf))

    return min(of_parts(work, field.size, threads))


def cells_where(test: Callable[[slice], Mask], size: int, threads: int) -> Cells:
    """Cells, as flat indices, at which a test of a slice of flat cells says yes."""

    def work(part: slice) -> Cells:
        found = np.flatnonzero(test(part))
        if part.start:
            found += part.start
        return found

    return concatenate(of_parts(work, size, threads), threads)


def concatenate(parts: Sequence[NDArray[Any]], threads: int) -> NDArray[Any]:
    """What was found of all parts, in their order; of a part that is alone, itself."""
    if len(parts) == 1:
        return parts[0]
    *begins, size = accumulate((part.size for part in parts), initial=0)
    found = np.empty(size, parts[0].dtype)

    def work(number: int) -> None:
        found[begins[number] : begins[number] + parts[number].size] = parts[number]

    parallel_map(work, range(len(parts)), threads)
    return found


def gather(field: Array, cells: Cells, threads: int) -> Array:
    """Values of a field at some cells."""
    if threads == 1 or cells.size <= _PART:
        return field.take(cells)
    found, values = np.empty(cells.size), field.reshape(-1)

    def work(part: slice) -> None:
        found[part] = values.take(cells[part])

    of_parts(work, cells.size, threads)
    return found


def scatter(out: Array, cells: Cells, values: Array, threads: int) -> None:
    """Set a field at some cells."""
    field = _flat(out)

    def work(part: slice) -> None:
        field[cells[part]] = values[part]

    of_parts(work, cells.size, threads)


def scatter_into_zeros(out: Array, cells: Cells, values: Array, threads: int) -> None:
    """Set a field to values at some cells, and to zero elsewhere."""
    field = _flat(out)

    def work(part: slice, few: slice) -> None:
        field[part].fill(0)
        field[cells[few]] = values[few]

    with_cells(work, field.size, cells, threads)


def slice_of_sorted(part: slice, cells: Cells) -> slice:
    """Which of some cells lie in a part of a field."""
    # bounds of the same kind: for others, numpy makes a copy of all cells, for each part anew
    return slice(*cells.searchsorted(np.array((part.start, part.stop), cells.dtype)))


def local_index(part: slice, cells: Cells) -> Cells:
    """Where some cells of a part of a field lie in it."""
    return cells - part.start if part.start else cells


def part_of(values: Array, cells: Cells, part: slice) -> Array:
    """Part of a field that has values at some cells of it, and is zero elsewhere."""
    found = np.zeros(part.stop - part.start)
    found[local_index(part, cells)] = values
    return found


def regather(values: Array, cells: Cells, onto: Cells, size: int, threads: int) -> Array:
    """What some cells of a field of some size have, at others: zero where these are not among them."""
    found = np.empty(onto.size)

    def work(part: slice, few: slice) -> None:
        asked = slice_of_sorted(part, onto)
        if np.array_equal(cells[few], onto[asked]):
            found[asked] = values[few]
        else:
            found[asked] = part_of(values[few], cells[few], part).take(local_index(part, onto[asked]))

    with_cells(work, size, cells, threads)
    return found


def summed(values: Array) -> float:
    """Sum of a part: without what the method of arrays does beside, which takes as long as the sum of a small one."""
    return float(np.add.reduce(values))


def inner(field: NDArray[Any], cells: Cells, values: Array, threads: int) -> float:
    """Inner product of a field with another, which has values at some cells and is zero elsewhere."""
    whole = field.reshape(-1)
    return sum(of_vectors(lambda few, there: summed(there * whole.take(few)), threads, cells, values))


def total(vector: Array, threads: int) -> float:
    """Sum of a vector."""
    return sum(of_vectors(summed, threads, vector))


def magnitude(vector: Array, threads: int) -> float:
    """Sum of its magnitudes."""
    return sum(of_vectors(lambda values: summed(np.abs(values)), threads, vector))


def largest(vector: Array, threads: int) -> float:
    """Largest magnitude in a vector; zero of none."""
    return max(of_vectors(lambda values: float(np.maximum.reduce(np.abs(values), initial=0.0)), threads, vector))


def _flat(out: NDArray[Any]) -> NDArray[Any]:
    """The same memory as a vector: of cells that do not follow each other that would be a copy."""
    if not out.flags.c_contiguous:
        raise ValueError("expected a field whose cells follow each other in memory")
    return out.reshape(-1)
