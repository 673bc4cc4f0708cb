"""Threads for work on large fields."""

from __future__ import annotations

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
