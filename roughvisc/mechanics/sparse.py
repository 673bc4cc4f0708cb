"""Fields that take less memory than their cells: zero but at some cells, or a sum of others that are held anyway.

What is made of them by blocks never lies in memory as a whole.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from roughvisc.mechanics import arrays
from roughvisc.mechanics.arrays import Array, Cells, Mask, empty, threads_of

# Cells of a grid above which a field is held by some of them: on smaller ones that takes time and spares nothing.
_ABOVE = 1 << 14
# An index takes half as much as a value, so that a field is held whole above two thirds of its cells.
_INDEX = np.dtype(np.int32)
_FEW = 2 / 3


@dataclass(frozen=True)
class Sparse:
    """A field that is not changed any more.

    Attributes
    ----------
    shape : tuple of int
        Of the grid.
    cells : ndarray of int or None
        Cells that are not zero, as flat indices, ascending; None where the field is held whole.
    values : ndarray
        At these cells; or the field, of that shape.
    """

    shape: tuple[int, ...]
    cells: Cells | None
    values: Array

    @classmethod
    def of(cls, field: Array) -> Sparse:
        """The same numbers; the field itself where it is held whole."""
        if field.size <= _ABOVE or field.size > np.iinfo(_INDEX).max:
            return cls.whole(field)
        cells = _not_zero(field)
        if cells.size > _FEW * field.size:
            return cls.whole(field)
        values = arrays.gather(field, cells, threads_of(field.size))
        return cls(field.shape, cells.astype(_INDEX), values)

    @classmethod
    def whole(cls, field: Array) -> Sparse:
        """A field held as it is."""
        return cls(field.shape, None, field)

    @property
    def size(self) -> int:
        """Cells of the grid."""
        return math.prod(self.shape)

    @cached_property
    def threads(self) -> int:
        """How many work on it."""
        return threads_of(self.size)

    def field(self) -> Array:
        """All of it, not to be changed: where it is held whole, that is no copy."""
        return self.values if self.cells is None else self.times(1.0)

    def part(self, part: slice) -> Array:
        """Some of it by flat indices, not to be changed."""
        if self.cells is None:
            return self.values.reshape(-1)[part]
        few = arrays.slice_of_sorted(part, self.cells)
        return arrays.part_of(self.values[few], self.cells[few], part)

    def positive(self) -> Mask:
        """Where it is more than zero."""
        if self.cells is None:
            return self.values > 0
        found = np.zeros(self.size, bool)
        found[self.cells] = self.values > 0
        return found.reshape(self.shape)

    def total(self) -> float:
        """Sum over all cells."""
        return sum(arrays.over_blocks(lambda part: arrays.summed(self.part(part)), self.size, self.threads))

    def times(self, factor: float) -> Array:
        """``factor`` times all of it, in memory of its own."""
        if self.cells is None:
            whole = empty(self.shape)
            arrays.blockwise(np.multiply, self.values, factor, out=whole, threads=self.threads)
            return whole
        found, cells, values = empty(self.shape), self.cells, factor * self.values
        flat = found.reshape(-1)

        def fill(part: slice, few: slice) -> None:
            flat[part].fill(0)
            flat[cells[few]] = values[few]

        arrays.over_cells(fill, self.size, cells, self.threads)
        return found

    def add_to(self, out: Array, factor: float) -> None:
        """``out += factor`` times it."""
        if self.cells is None:
            arrays.add_scaled(out, self.values, factor, self.threads)
            return
        found, cells = out.reshape(-1), self.cells

        def work(part: slice) -> None:
            found[cells[part]] += factor * self.values[part]

        arrays.over_blocks(work, cells.size, self.threads)

    def apart_from(self, other: Sparse) -> float:
        """Sum of the magnitudes of the difference to another field."""

        def work(part: slice) -> float:
            return arrays.summed(np.abs(self.part(part) - other.part(part)))

        return sum(arrays.over_blocks(work, self.size, self.threads))

    def not_zero(self) -> tuple[Cells, Array]:
        """The cells that are not zero, and what is there."""
        if self.cells is not None:
            return self.cells, self.values
        cells = _not_zero(self.values)
        return cells, self.values.take(cells)

    @cached_property
    def count(self) -> int:
        """How many cells are not zero."""
        return int(np.count_nonzero(self.values)) if self.cells is None else self.cells.size


@dataclass(frozen=True)
class Sum:
    """A sum of fields times their factors, added up where it is asked for.

    Attributes
    ----------
    terms : tuple of (float, ndarray)
    """

    terms: tuple[tuple[float, Array], ...]

    @classmethod
    def whole(cls, field: Array) -> Sum:
        """A field held as it is."""
        return cls(((1.0, field),))

    @property
    def is_whole(self) -> bool:
        """Whether there is nothing to add up."""
        return len(self.terms) == 1 and self.terms[0][0] == 1

    def field(self) -> Array:
        """All of it, not to be changed: where it is held whole, that is no copy."""
        first = self.terms[0][1]
        return first if self.is_whole else arrays.weighted(self.terms, empty(first.shape), threads_of(first.size))

    def part(self, part: slice) -> Array:
        """Some of it by flat indices, not to be changed."""
        (factor, first), *others = self.terms
        if self.is_whole:
            return first.reshape(-1)[part]
        found = factor * first.reshape(-1)[part]
        for factor, field in others:
            found += factor * field.reshape(-1)[part]
        return found


def _not_zero(field: Array) -> Cells:
    values = field.reshape(-1)
    return arrays.cells_where(lambda part: values[part] != 0, values.size, threads_of(values.size))
