"""Memory of wide fields that is used again: to be given new pages costs a field as much as several passes over it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

# Bytes from which memory is kept: what is smaller, the C library keeps itself.
_FROM = 1 << 22


@contextmanager
def reused(apart: bool = False) -> Iterator[None]:
    """Within it, the memory of fields of :func:`empty` that nobody holds any more is taken for the next ones.

    What is left at its end is given back to the system. In another one it does nothing, unless its fields are to be
    `apart`: of another size than those of the other one, which has no use for their memory.
    """
    if _kept.get() is not None and not apart:
        yield
        return
    kept = _Kept()
    before = _kept.set(kept)
    try:
        yield
    finally:
        _kept.reset(before)
        kept.end()


def empty(shape: tuple[int, ...], kind: DTypeLike = np.float64) -> NDArray[Any]:
    """As ``numpy.empty``, within :func:`reused` in memory that was used before where there is some."""
    kept, size = _kept.get(), math.prod(shape) * np.dtype(kind).itemsize
    if kept is None or size < _FROM:
        return np.empty(shape, kind)
    return kept.lend(size).view(kind).reshape(shape)


class _Kept:
    """Memory that is in nobody's use, by its size."""

    def __init__(self) -> None:
        self._by_size: dict[int, list[NDArray[np.uint8]]] = {}
        self._ended = False

    def lend(self, size: int) -> NDArray[np.uint8]:
        """So many bytes, which come back when no array holds them any more."""
        free = self._by_size.setdefault(size, [])
        return np.asarray(_Lent(self, free.pop() if free else np.empty(size, np.uint8)))

    def take_back(self, memory: NDArray[np.uint8]) -> None:
        if not self._ended:
            self._by_size[memory.size].append(memory)

    def end(self) -> None:
        """From here on what comes back is not kept."""
        self._ended = True
        self._by_size.clear()


class _Lent:
    """What the arrays in some memory hold on to: the memory goes back when the last one lets go."""

    def __init__(self, kept: _Kept, memory: NDArray[np.uint8]) -> None:
        self._kept, self._memory = kept, memory

    @property
    def __array_interface__(self) -> dict[str, Any]:
        return self._memory.__array_interface__

    def __del__(self) -> None:
        self._kept.take_back(self._memory)


_kept: ContextVar[_Kept | None] = ContextVar("kept memory of fields", default=None)
