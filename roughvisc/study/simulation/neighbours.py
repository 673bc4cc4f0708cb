"""Faces between cells in contact and cells out of contact."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


def neighbours(mask: Mask, periodic: bool, before: bool = False, beyond: bool = False) -> Iterator[Mask]:
    """The mask as seen from each cell across its lower and upper face along x, then along y.

    Parameters
    ----------
    mask : ndarray of bool, shape (nx, ny)
        Of the cells.
    periodic : bool
        Whether the first cell of a row is the neighbour of the last.
    before, beyond : bool
        What lies outside the first and outside the last cell of every row, unless periodic.

    Examples
    --------
    >>> [seen.ravel().tolist() for seen in neighbours(np.array([[True], [False]]), False)][:2]
    [[False, True], [False, False]]
    """
    for axis in (0, 1):
        for shift, border, outside in ((1, 0, before), (-1, -1, beyond)):
            seen = np.roll(mask, shift, axis)
            if not periodic:
                np.moveaxis(seen, axis, 0)[border] = outside
            yield seen
