"""Settings of the C library's allocator, so that freed arrays are reused."""

from __future__ import annotations

import ctypes
import sys
from functools import cache
from typing import Any

import numpy as np

# Of the GNU C library: its own threshold does not rise beyond.
_HIGHEST = 31 << 20


@cache
def keep_memory() -> bool:
    """Have the C library keep freed memory for the next array, in the whole process; say whether that was possible.

    As it comes it gives large arrays back at once, and the next ones are mapped and cleared anew: a run at 256 to 512
    squared takes 10 to 15 % longer, and on Dask's workers, whose nannies set ``MALLOC_TRIM_THRESHOLD_``, a convolution
    up to 1.8 times as long.
    """
    if not sys.platform.startswith("linux"):
        return False
    try:
        mallopt: Any = ctypes.CDLL("libc.so.6").mallopt
    except (OSError, AttributeError):  # not the GNU C library
        return False
    m_trim_threshold, m_mmap_threshold = -1, -3
    return bool(mallopt(m_mmap_threshold, 32 << 20) and mallopt(m_trim_threshold, 256 << 20))


def expect_arrays(size: int) -> None:
    """Have the C library keep a few freed arrays of so many bytes, without changing how it is set up.

    The GNU library takes the largest array that was ever freed for a measure of what to keep: one that is never
    touched costs nothing. Without this a quarter of a step at 512 squared may go into clearing memory anew.
    """
    np.empty(min(16 * size, _HIGHEST), np.uint8)
