"""Faces between cells in contact and cells out of contact, and what counting cells makes of a contact area."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]

#: Counted contact cells overestimate the area by this part of the staircase perimeter times the cell side; measured
#: on Hertz contacts of 6 to 200 cells' radius (0.080 to 0.092).
PERIMETER_CORRECTION = 0.088


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


def faces_between(contact: Mask, free: Mask, periodic: bool, **outside: bool) -> int:
    """Number of faces between cells in contact and free ones, as :func:`neighbours` sees these."""
    return sum(int(np.count_nonzero(contact & beside)) for beside in neighbours(free, periodic, **outside))


def staircase(contact: Mask, free: Mask, cell_area: float, periodic: bool, **outside: bool) -> float:
    """Area by which counting cells is too large: a part of the perimeter's strip. [m2]

    Parameters
    ----------
    contact, free : ndarray of bool, shape (nx, ny)
        Cells in contact, and cells out of it where the material goes on.
    cell_area : float
        [m2]
    periodic, outside
        As :func:`neighbours` has them.
    """
    faces = faces_between(contact, free, periodic, **outside)
    # a face across x is dy long and lies in a strip dx wide, and the other way round
    return PERIMETER_CORRECTION * cell_area * faces
