"""Passes over the cells of a grid or of a contact, by parts that stay in the cache, side by side on some threads.

Nothing here sums: what is found is the same to the last bit, whatever the parts and the number of threads.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.halfspace.threads import blocks, side_by_side

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Cells = NDArray[np.intp]

# Cells of a part.
_PART = 1 << 17


def add(a: Array, b: Array, out: Array, threads: int) -> Array:
    """``out = a + b``."""
    first, second, found = a.reshape(-1), b.reshape(-1), out.reshape(-1)
    _through(out.size, lambda part: np.add(first[part], second[part], out=found[part]), threads)
    return out


def add_scaled(out: Array, field: NDArray[Any], factor: float, threads: int) -> None:
    """``out += factor * field``, multiplied in double precision."""
    found, added = out.reshape(-1), field.reshape(-1)

    def work(part: slice) -> None:
        found[part] += np.multiply(added[part], factor, dtype=np.float64)

    _through(out.size, work, threads)


def lowest(field: Array, present: Mask | None, threads: int) -> float:
    """Least value of a field, of its present cells where there are others."""
    values, there = field.reshape(-1), None if present is None else present.reshape(-1)

    def work(part: slice) -> float:
        if there is None:
            return float(values[part].min())
        return float(values[part].min(where=there[part], initial=np.inf))

    return min(_through(field.size, work, threads))


def cells_where(test: Callable[[slice], Mask], size: int, threads: int) -> Cells:
    """Cells, as flat indices, at which a test of a slice of flat cells says yes."""

    def work(part: slice) -> Cells:
        found = np.flatnonzero(test(part))
        found += part.start
        return found

    found = _through(size, work, threads)
    return found[0] if len(found) == 1 else np.concatenate(found)


def taken(field: NDArray[Any], cells: Cells, threads: int) -> NDArray[Any]:
    """Values of a field at some cells."""
    if threads == 1:
        return field.take(cells)
    found, values = np.empty(cells.size, field.dtype), field.reshape(-1)

    def work(part: slice) -> None:
        found[part] = values.take(cells[part])

    _through(cells.size, work, threads)
    return found


def _through(size: int, work: Callable[[slice], Any], threads: int) -> list[Any]:
    return side_by_side(work, list(blocks(size, _PART)), threads)
