"""Passes over big maps by blocks of rows, so that little is held beside the map itself.

A map of up to 1024 x 1024 points is one block: what is computed of it has the bits that it has in one go. Beyond, sums
are those of sums of blocks: they differ by rounding. Order statistics are exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: What a block of rows takes at most, unless a row takes more. [bytes]
BLOCK = 8 << 20
#: Bins in which a value of a given rank is looked for.
_BINS = 1 << 16


def row_blocks(shape: tuple[int, ...], itemsize: int = 8, multiple: int = 1) -> Iterator[slice]:
    """Slices of rows, one after the other, each of some MB.

    Parameters
    ----------
    shape : tuple of int
        Of the map; blocks are along its first dimension.
    itemsize : int
        Of what is held of a point. [bytes]
    multiple : int
        Blocks are of whole multiples of so many rows, the last one apart.

    Examples
    --------
    >>> list(row_blocks((5, 1 << 20), multiple=2))
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    rows = max(1, BLOCK // max(1, itemsize * int(np.prod(shape[1:]))))
    rows = max(1, rows // multiple) * multiple
    for first in range(0, shape[0], rows):
        yield slice(first, min(first + rows, shape[0]))


def column_blocks(shape: tuple[int, int], itemsize: int = 8) -> Iterator[tuple[slice, slice]]:
    """The same along the second dimension: indices of all rows and some columns."""
    for columns in row_blocks((shape[1], shape[0]), itemsize):
        yield slice(None), columns


def known_values(values: Array) -> Iterator[Array]:
    """The finite values of a map, one-dimensional, a block of rows after the other."""
    for rows in row_blocks(values.shape):
        block = values[rows]
        yield block[np.isfinite(block)]


def count_of(values: Array) -> int:
    """Number of finite values."""
    return sum(int(np.isfinite(values[rows]).sum()) for rows in row_blocks(values.shape))


def mean_of(values: Array) -> float:
    """Mean of the finite values, NaN if there are none."""
    total, count = 0.0, 0
    for known in known_values(values):
        total, count = total + known.sum(), count + known.size
    return float(total / count) if count else float("nan")


def deviation_of(values: Array) -> float:
    """Root mean square of the finite values about their mean, NaN if there are none."""
    mean, total, count = mean_of(values), 0.0, 0
    for known in known_values(values):
        off = known - mean
        total, count = total + np.multiply(off, off, out=off).sum(), count + known.size
    return float(np.sqrt(total / count)) if count else float("nan")


def extremes_of(values: Array) -> tuple[float, float]:
    """The lowest and the highest finite value, NaN if there are none."""
    ends = [(known.min(), known.max()) for known in known_values(values) if known.size]
    return (float(min(low for low, _ in ends)), float(max(high for _, high in ends))) if ends else (np.nan, np.nan)


def order_statistics(values: Array, ranks: Sequence[int]) -> list[float]:
    """Finite values of given ranks, the least of rank 0: exactly those that sorting would put there.

    Parameters
    ----------
    values : ndarray, shape (nx, ny)
    ranks : sequence of int
        Each below the number of finite values.

    Notes
    -----
    A histogram tells in which narrow bin a value lies, and the values in that one are sorted. No bin holds much of a
    map, unless one value is much of it.
    """
    low, high = extremes_of(values)
    if not low < high:
        return [low] * len(ranks)

    def bins_of(known: Array) -> NDArray[np.intp]:  # grows with the value, rounding included
        return np.minimum((known - low) / (high - low) * _BINS, _BINS - 1).astype(np.intp)

    counts = np.zeros(_BINS, int)
    for known in known_values(values):
        counts += np.bincount(bins_of(known), minlength=_BINS)
    ends = np.cumsum(counts)
    bins = np.searchsorted(ends, ranks, side="right")
    found = {
        one: np.sort(np.concatenate([known[bins_of(known) == one] for known in known_values(values)]))
        for one in np.unique(bins)
    }
    return [float(found[one][rank - (ends[one] - counts[one])]) for one, rank in zip(bins, ranks, strict=True)]


def percentiles_of(values: Array, shares: Sequence[float]) -> list[float]:
    """Percentiles of the finite values, linear between the two nearest, as :func:`numpy.percentile` has them.

    Parameters
    ----------
    values : ndarray, shape (nx, ny)
        One finite value at least.
    shares : sequence of float
        From 0 to 100.
    """
    if values.size * 8 <= BLOCK:
        return [float(one) for one in np.percentile(values[np.isfinite(values)], shares)]
    place = np.asarray(shares) / 100 * (count_of(values) - 1)
    below = np.floor(place).astype(int)
    above = np.ceil(place).astype(int)
    found = order_statistics(values, [*below, *above])
    low, high = np.array(found[: len(below)]), np.array(found[len(below) :])
    return [float(one) for one in low + (high - low) * (place - below)]


def median_of(values: Array) -> float:
    """Median of the finite values; one at least."""
    if values.size * 8 <= BLOCK:
        return float(np.median(values[np.isfinite(values)]))
    count = count_of(values)
    low, high = order_statistics(values, [(count - 1) // 2, count // 2])
    return (low + high) / 2
