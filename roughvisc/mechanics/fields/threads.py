"""Work on parts of a grid, side by side on some threads.

What the parts are does not depend on how many threads there are, so that results are equal to the last bit.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from queue import SimpleQueue
from threading import Lock, Thread
from typing import Any, Generic, TypeVar

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


def parallel_map(work: Callable[[Part], Found], parts: Sequence[Part], threads: int) -> list[Found]:
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
    # each thread takes the next: a task for each costs as much as a short part
    todo = deque(_interleaved(len(parts), threads))

    def take_on() -> None:
        try:
            while (number := _next(todo)) is not None:
                found[number] = work(parts[number])
        finally:
            todo.clear()  # where the work failed, for the others too

    tasks = [_begun(take_on, threads) for _ in range(min(threads, len(parts)) - 1)]
    try:
        take_on()
    finally:
        begun = [task for task in tasks if not task.taken()]  # what nobody has begun is not needed any more
        for task in begun:
            task.result()
    return found


def submit(work: Callable[[], Found], threads: int) -> Callable[[], Found]:
    """Begin some work beside the caller's where there is another thread; what is returned waits for what it gives."""
    if threads == 1:
        return work
    task = _begun(work, threads)
    return lambda: work() if task.taken() else task.result()


def blocks(length: int, size: int) -> Iterator[slice]:
    """Slices of a size, the last one shorter."""
    return (slice(first, min(first + size, length)) for first in range(0, length, size))


def _interleaved(count: int, threads: int) -> list[int]:
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


class _Task(Generic[Found]):
    """Some work, which the first thread that takes it does."""

    def __init__(self, work: Callable[[], Found]) -> None:
        self._work, self._free = work, Lock()
        self._done: SimpleQueue[tuple[Any, BaseException | None]] = SimpleQueue()

    def taken(self) -> bool:
        """Whether it is the caller's from here on: nobody else has taken it."""
        return self._free.acquire(blocking=False)

    def do(self) -> None:
        """Do it, unless another thread has taken it."""
        if not self.taken():
            return
        try:
            self._done.put((self._work(), None))
        except BaseException as error:  # noqa: BLE001 (raised where it is waited for)
            self._done.put((None, error))

    def result(self) -> Found:
        """What it gives, once it is done by another thread."""
        found, error = self._done.get()
        if error is not None:
            raise error
        return found


def _begun(work: Callable[[], Found], threads: int) -> _Task[Found]:
    """Work that the first of the other threads does that has nothing to do."""
    task = _Task(work)
    _tasks_of(threads, os.getpid()).put(task)
    return task


@cache
def _tasks_of(threads: int, _process: int) -> SimpleQueue[_Task[Any]]:
    """What the others of so many threads of this process take on; a forked one has none of its parent's threads.

    The executors of the standard library take as long to begin a task and to wait for it as a short pass takes.
    """
    tasks: SimpleQueue[_Task[Any]] = SimpleQueue()
    for number in range(1, threads):
        Thread(target=_serve, args=(tasks,), name=f"roughvisc-{number}", daemon=True).start()
    return tasks


def _serve(tasks: SimpleQueue[_Task[Any]]) -> None:
    """Do one task after the other, without end."""
    while True:
        tasks.get().do()
