"""Heap of the C library: freed memory of fields is kept for the next fields."""

from __future__ import annotations

import ctypes
from contextlib import suppress

#: Size up to which glibc takes memory from its heap; larger arrays are mapped, and returned when they are freed. [byte]
FROM_HEAP = 32 << 20
#: Free memory at the end of the heap above which glibc returns some to the system: the largest value. [byte]
_RETURNED_ABOVE = 2**31 - 1
#: Numbers of both settings in malloc.h.
_M_TRIM_THRESHOLD = -1
_M_MMAP_THRESHOLD = -3


def keep_freed_memory() -> None:
    """Let glibc reuse the memory of freed fields instead of mapping new memory for each.

    By default, each field gets newly mapped memory, more often with Dask's settings for its workers. A worker then
    spends half as much time in the system as in the computation. Other C libraries keep their settings.
    """
    with suppress(OSError, AttributeError, TypeError):
        library = ctypes.CDLL(None)
        library.mallopt(_M_MMAP_THRESHOLD, FROM_HEAP)
        library.mallopt(_M_TRIM_THRESHOLD, _RETURNED_ABOVE)


def return_freed_memory() -> None:
    """Return the freed memory of the heap to the system, after the last field of a case."""
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
