"""Work on the cells of a grid or of a contact: by blocks that stay in the cache, side by side on some threads.

What the blocks are does not depend on how many threads there are, and sums are those of the blocks, added up in their
order: what is found is the same to the last bit, whatever the number of threads. A gather from a wide grid waits for
the memory, more than all that is computed of it; so what is gathered is used while it is in the cache. Cells are flat
indices, ascending.
"""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from itertools import accumulate
from queue import SimpleQueue
from threading import Lock, Thread
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray
from scipy import fft

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Cells = NDArray[np.int32] | NDArray[np.int64]
Part = TypeVar("Part")
Found = TypeVar("Found")
# Cells of a block at most.
_BLOCK = 1 << 17


def blockwise(
    work: Callable[..., Found], *fields: Any, out: NDArray[Any] | None = None, threads: int = 1
) -> list[Found]:
    """Apply a function to each block of cells; return the results in order.

    Parameters
    ----------
    work : callable
        Takes the block of each field, and that of ``out`` by this name: a ufunc, or a function of vectors.
    *fields : ndarray or float
        Arrays of one size, the first among them; a number is given as it is.
    out : ndarray, optional
        Written to; its cells follow each other in memory.
    threads : int
        How many work side by side.

    Notes
    -----
    On narrow grids, where slices would take as long as the work, it is given the fields as they are: work that is no
    ufunc needs vectors then.
    """
    size = fields[0].size
    if size <= _BLOCK:
        return [work(*fields) if out is None else work(*fields, out=out)]
    if out is not None and not out.flags.c_contiguous:
        raise ValueError("expected a field whose cells follow each other in memory")
    flat = [one.reshape(-1) if isinstance(one, np.ndarray) else one for one in fields]
    written = None if out is None else out.reshape(-1)

    def on_block(part: slice) -> Found:
        given = [one[part] if isinstance(one, np.ndarray) else one for one in flat]
        return work(*given) if written is None else work(*given, out=written[part])

    return over_blocks(on_block, size, threads)


def sum_over(work: Callable[..., float], *fields: NDArray[Any], threads: int) -> float:
    """Sum of what some work gives of each block of cells, as :func:`blockwise` gives them."""
    if fields[0].size <= _BLOCK:
        return work(*fields)
    return sum(blockwise(work, *fields, threads=threads))


def over_blocks(work: Callable[[slice], Found], size: int, threads: int) -> list[Found]:
    """What some work gives of each block of so many flat cells, in their order."""
    if size <= _BLOCK:
        return [work(slice(0, size))]
    pairs = -(-size // (2 * _BLOCK))  # of equal blocks: of three, one thread of two would wait for the last
    return parallel_map(work, list(blocks(size, -(-size // (2 * pairs)))), threads)


def over_rows(work: Callable[[slice], Found], shape: tuple[int, ...], threads: int) -> list[Found]:
    """The same of blocks of a field that are whole rows."""
    if shape[0] * shape[1] <= _BLOCK:
        return [work(slice(0, shape[0]))]
    return parallel_map(work, list(blocks(shape[0], max(_BLOCK // shape[1], 1))), threads)


def over_cells(work: Callable[[slice, slice], Found], size: int, cells: Cells, threads: int) -> list[Found]:
    """What some work gives of each block of a field of some size, and of those of some cells that lie in it."""
    if size <= _BLOCK:
        return [work(slice(0, size), slice(0, cells.size))]
    return over_blocks(lambda part: work(part, slice_of_sorted(part, cells)), size, threads)


def weighted(terms: Sequence[tuple[float, Array]], out: Array, threads: int) -> Array:
    """Sum of fields times their factors, in their order; ``out`` may be the first of them."""
    (first, *factors), fields = zip(*terms, strict=True)

    def add_up(field: Array, *others: Array, out: Array) -> None:
        np.multiply(field, first, out=out)
        for factor, other in zip(factors, others, strict=True):
            out += factor * other

    blockwise(add_up, *fields, out=out, threads=threads)
    return out


def add_scaled(out: Array, field: NDArray[Any], factor: float, threads: int) -> None:
    """``out += factor * field``, multiplied in double precision."""

    def add_to(added: NDArray[Any], out: Array) -> None:
        out += np.multiply(added, factor, dtype=np.float64)

    blockwise(add_to, field, out=out, threads=threads)


def cut_at_zero(out: Array, threads: int) -> bool:
    """``out = max(out, 0)``, and whether that has changed anything."""

    def cut(found: Array) -> bool:
        below = bool(np.minimum.reduce(found, axis=None, initial=0.0) < 0)
        if below:
            np.maximum(found, 0, out=found)
        return below

    return any(blockwise(cut, out, threads=threads))


def l1_distance(a: Array, b: Array, threads: int) -> float:
    """Sum of the magnitudes of ``a - b``."""
    return sum_over(lambda x, y: summed(np.abs(x - y)), a.reshape(-1), b.reshape(-1), threads=threads)


def lowest(field: Array, present: Mask | None, threads: int) -> float:
    """Least value of a field, of its present cells where there are others."""
    if present is None:
        return min(blockwise(lambda values: float(values.min()), field, threads=threads))
    return min(
        blockwise(lambda values, there: float(values.min(where=there, initial=np.inf)), field, present, threads=threads)
    )


def cells_where(test: Callable[[slice], Mask], size: int, threads: int) -> Cells:
    """Cells, as flat indices, at which a test of a slice of flat cells says yes."""

    def find(part: slice) -> Cells:
        [found] = test(part).nonzero()
        if part.start:
            found += part.start
        return found

    return concatenate(over_blocks(find, size, threads), threads)


def concatenate(parts: Sequence[NDArray[Any]], threads: int) -> NDArray[Any]:
    """What was found of all blocks, in their order; of a block that is alone, itself."""
    if len(parts) == 1:
        return parts[0]
    *begins, size = accumulate((part.size for part in parts), initial=0)
    found = np.empty(size, parts[0].dtype)

    def copy(number: int) -> None:
        found[begins[number] : begins[number] + parts[number].size] = parts[number]

    parallel_map(copy, range(len(parts)), threads)
    return found


def gather(field: Array, cells: Cells, threads: int) -> Array:
    """Values of a field at some cells."""
    if threads == 1 or cells.size <= _BLOCK:
        return field.take(cells)
    found, values = np.empty(cells.size), field.reshape(-1)

    def take(here: Cells, out: Array) -> None:
        out[...] = values.take(here)

    blockwise(take, cells, out=found, threads=threads)
    return found


def slice_of_sorted(part: slice, cells: Cells) -> slice:
    """Which of some cells lie in a block of a field."""
    # bounds of the same kind: for others, numpy makes a copy of all cells, for each block anew
    return slice(*cells.searchsorted(np.array((part.start, part.stop), cells.dtype)))


def local_index(part: slice, cells: Cells) -> Cells:
    """Where some cells of a block of a field lie in it."""
    return cells - part.start if part.start else cells


def part_of(values: Array, cells: Cells, part: slice) -> Array:
    """Block of a field that has values at some cells of it, and is zero elsewhere."""
    found = np.zeros(part.stop - part.start)
    found[local_index(part, cells)] = values
    return found


def summed(values: Array) -> float:
    """Sum of a block: without what the method of arrays does beside, which takes as long as the sum of a small one."""
    return float(np.add.reduce(values))


def inner(field: NDArray[Any], cells: Cells, values: Array, threads: int) -> float:
    """Inner product of a field with another, which has values at some cells and is zero elsewhere."""
    return sum_over(lambda few, there: summed(there * field.take(few)), cells, values, threads=threads)


# ------------------------------------------------------------------------------------------------------- threads

# Cells of a field from which several threads are faster than one (measured: slower at 512 squared, faster at 1024).
_THREADED = 1024**2


def is_wide(size: int) -> bool:
    """Whether several threads may work on a field of so many cells; a narrower one lies in the cache."""
    return size >= _THREADED


def threads_of(size: int, workers: int | None = None) -> int:
    """How many threads work on a field of so many cells; None: as ``scipy.fft.set_workers`` has it."""
    if size < _THREADED:
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
        begun = [task for task in tasks if not task.claim()]  # what nobody has begun is not needed any more
        for task in begun:
            task.result()
    return found


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

    def claim(self) -> bool:
        """Whether it is the caller's from here on: nobody else has taken it."""
        return self._free.acquire(blocking=False)

    def do(self) -> None:
        """Do it, unless another thread has taken it."""
        if not self.claim():
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


# ------------------------------------------------------------------------------------------------ memory of fields

# Bytes from which memory is kept: what is smaller, the C library keeps itself.
_FROM = 1 << 22


@contextmanager
def reused(separate: bool = False) -> Iterator[None]:
    """Within it, the memory of fields of :func:`empty` that nobody holds any more is taken for the next ones.

    What is left at its end is given back to the system. In another one it does nothing, unless its fields are to be
    `separate`: of another size than those of the other one, which has no use for their memory.
    """
    if _kept.get() is not None and not separate:
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
