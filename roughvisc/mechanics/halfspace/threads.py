"""Work on parts of a grid, side by side on some threads.

What the parts are does not depend on how many threads there are, so that results are equal to the last bit.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import TypeVar

Part = TypeVar("Part")
Found = TypeVar("Found")


def side_by_side(work: Callable[[Part], Found], parts: Sequence[Part], threads: int) -> list[Found]:
    """What some work gives of each part, in their order.

    Parameters
    ----------
    work : callable
        It holds the interpreter's lock for short times only.
    parts : sequence
    threads : int
        One works in the caller's thread.
    """
    if threads == 1 or len(parts) == 1:
        return [work(part) for part in parts]
    return list(_pool(threads, os.getpid()).map(work, parts))


def blocks(length: int, size: int) -> Iterator[slice]:
    """Slices of a size, the last one shorter."""
    return (slice(first, min(first + size, length)) for first in range(0, length, size))


@lru_cache(maxsize=4)
def _pool(threads: int, _process: int) -> ThreadPoolExecutor:
    """Threads of this process: a forked one has none of its parent's."""
    return ThreadPoolExecutor(threads, thread_name_prefix="roughvisc")
