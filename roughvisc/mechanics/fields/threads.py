"""Work on parts of a grid, side by side on some threads.

What the parts are does not depend on how many threads there are, so that results are equal to the last bit.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any, TypeVar

from scipy import fft

Part = TypeVar("Part")
Found = TypeVar("Found")


# Cells of a field from which several threads are faster than one (measured: slower at 512 squared, faster at 1024).
_THREADED = 1024**2


def is_wide(size: int) -> bool:
    """Whether several threads may work on a field of so many cells; a narrower one lies in the cache."""
    return size >= _THREADED


def threads_of(size: int, workers: int | None = None) -> int:
    """How many threads work on a field of so many cells; None: as ``scipy.fft.set_workers`` has it."""
    if not is_wide(size):
        return 1
    return fft.get_workers() if workers is None else workers


def side_by_side(work: Callable[[Part], Found], parts: Sequence[Part], threads: int) -> list[Found]:
    """What some work gives of each part, in their order.

    Parameters
    ----------
    work : callable
        It holds the interpreter's lock for short times only.
    parts : sequence
    threads : int
        The caller's is one of them.
    """
    if threads == 1 or len(parts) == 1:
        return [work(part) for part in parts]
    found: list[Any] = [None] * len(parts)
    todo = deque(_far_apart(len(parts), threads))  # each takes the next: a task for each costs as much as a short part

    def take_on() -> None:
        try:
            while (number := _next(todo)) is not None:
                found[number] = work(parts[number])
        finally:
            todo.clear()  # where the work failed, for the others too

    helpers = [_pool(threads, os.getpid()).submit(take_on) for _ in range(min(threads, len(parts)) - 1)]
    try:
        take_on()
    finally:
        begun = [helper for helper in helpers if not helper.cancel()]  # what has not begun is not needed any more
        for helper in begun:
            helper.result()
    return found


def beside(work: Callable[[], Found], threads: int) -> Callable[[], Found]:
    """Begin some work beside the caller's where there is another thread; what is returned waits for what it gives."""
    if threads == 1:
        return work
    begun = _pool(threads, os.getpid()).submit(work)
    return lambda: work() if begun.cancel() else begun.result()


def blocks(length: int, size: int) -> Iterator[slice]:
    """Slices of a size, the last one shorter."""
    return (slice(first, min(first + size, length)) for first in range(0, length, size))


def _far_apart(count: int, threads: int) -> list[int]:
    """Numbers of so many parts, in an order in which those that threads work on at a time do not lie side by side.

    A processor fetches ahead what the other one is about to change: neighbouring columns of a transform take 1.1 times
    as long by two threads (measured at 4096 squared).
    """
    share = -(-count // threads)
    return [number for first in range(share) for number in range(first, count, share)]


def _next(todo: deque[int]) -> int | None:
    """The first that is left, taken away; None where there is none."""
    try:
        return todo.popleft()
    except IndexError:
        return None


@lru_cache(maxsize=4)
def _pool(threads: int, _process: int) -> ThreadPoolExecutor:
    """The others of so many threads of this process: a forked one has none of its parent's."""
    return ThreadPoolExecutor(threads - 1, thread_name_prefix="roughvisc")
