"""Threads for work on large fields."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

from scipy import fft

#: Cells of a field from which several threads are faster than one (measured: slower at 512 squared, faster at 1024).
THREADED_FROM = 1024**2


def threads_of(size: int, workers: int | None = None) -> int:
    """Return the number of threads for a field of a number of cells.

    Parameters
    ----------
    size : int
        Cells.
    workers : int, optional
        Threads for a large field. Default: those of ``scipy.fft.set_workers``.
    """
    if size < THREADED_FROM:
        return 1
    return fft.get_workers() if workers is None else workers


def parts_of(count: int, length: int) -> list[slice]:
    """Return slices of a length that cover so many rows, columns or cells; the last one may be shorter."""
    return [slice(first, min(first + length, count)) for first in range(0, count, length)]


def on_threads(work: Callable[[slice], Any], parts: Iterable[slice], threads: int) -> None:
    """Call a function for each of several parts of a field, on a number of threads."""
    if threads == 1:
        for part in parts:
            work(part)
    else:
        for _ in _pool(threads).map(work, parts):  # raises what a part has raised
            pass


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="roughvisc")


if hasattr(os, "register_at_fork"):  # a forked process has none of the threads
    os.register_at_fork(after_in_child=_pool.cache_clear)
