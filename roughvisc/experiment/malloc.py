"""Settings of the C library's allocator, so that freed arrays are reused."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np

# Of the GNU C library: its own threshold does not rise beyond.
_HIGHEST = 31 << 20
# Its settings: from how many bytes arrays are mapped by themselves, and how much freed memory it keeps; of that, what
# it keeps at most by itself, and the most that it can be told. [byte]
_MMAP, _TRIM = -3, -1
_BY_ITSELF, _MOST = 64 << 20, 2047 << 20
# Fields from which a march keeps as much as it frees. [byte]
_WIDE = 8 << 20


@cache
def keep_memory() -> bool:
    """Have the C library keep freed memory for the next array, in the whole process; say whether that was possible.

    As it comes it gives large arrays back at once, and the next ones are mapped and cleared anew: a run at 256 to 512
    squared takes 10 to 15 % longer, and on Dask's workers, whose nannies set ``MALLOC_TRIM_THRESHOLD_``, a convolution
    up to 1.8 times as long.
    """
    library = _library()
    return library is not None and _told_to_keep(library)


@contextmanager
def retain_arena(size: int) -> Iterator[None]:
    """Have the C library keep freed memory while arrays of so many bytes are computed with.

    Of narrow grids it is only told what to expect. What an iteration on a wide one needs for the cells in contact, some
    fields near full contact, is freed and had again: given back to the system and cleared anew it takes half of the
    time (measured at 4096 squared, 95 % in contact: 1.7 times as long). In the end it is given back, and freed memory
    is kept as the library does by itself.
    """
    library = _library()
    if size < _WIDE or library is None:
        expect_arrays(size)
        yield
        return
    _told_to_keep(library)
    try:
        yield
    finally:
        if not keep_memory.cache_info().currsize:  # that is for all of the process
            library.mallopt(_TRIM, _BY_ITSELF)
        library.malloc_trim(0)


def _told_to_keep(library: Any) -> bool:
    """Whether it takes the settings."""
    return bool(library.mallopt(_MMAP, 32 << 20) and library.mallopt(_TRIM, _MOST))


@cache
def _library() -> Any:
    """The GNU C library; None where it is another one."""
    if not sys.platform.startswith("linux"):
        return None
    try:
        library = ctypes.CDLL("libc.so.6")
        return library if library.mallopt and library.malloc_trim else None
    except (OSError, AttributeError):
        return None


def expect_arrays(size: int) -> None:
    """Have the C library keep a few freed arrays of so many bytes, without changing how it is set up.

    The GNU library takes the largest array that was ever freed for a measure of what to keep: one that is never
    touched costs nothing. Without this a quarter of a step at 512 squared may go into clearing memory anew.
    """
    np.empty(min(16 * size, _HIGHEST), np.uint8)
