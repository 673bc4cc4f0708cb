"""Faces between contact cells and free cells, and the correction of a counted contact area."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from roughvisc.mechanics.grid import Boundary

Array = Any  # an array of NumPy or CuPy, or a float

#: Counted contact cells overestimate the area by this part of the staircase perimeter times the cell side; measured
#: on Hertz contacts of 6 to 200 cells' radius (0.080 to 0.092).
PERIMETER_CORRECTION = 0.088


def neighbours(mask: Array, boundary: Boundary, outside: bool = False) -> Iterator[Array]:
    """Yield the mask of the neighbour across the lower and the upper face of each cell, along x, then along y.

    Parameters
    ----------
    mask : array of bool, shape (nx, ny)
        Mask of the cells.
    boundary : {"free", "periodic", "mirror"}
        Periodic: the first cell of a row is the neighbour of the last. Mirror: beyond the border, a cell's neighbour is
        its own image.
    outside : bool
        Value beyond the border in free space.

    Examples
    --------
    >>> [seen.ravel().tolist() for seen in neighbours(np.array([[True], [False]]), "free")][:2]
    [[False, True], [False, False]]
    >>> [seen.ravel().tolist() for seen in neighbours(np.array([[True], [False]]), "mirror")][:2]
    [[True, True], [False, False]]
    """
    for own in (mask, mask.T):
        lower, upper = np.empty_like(own), np.empty_like(own)
        lower[1:], lower[0] = own[:-1], {"free": outside, "periodic": own[-1], "mirror": own[0]}[boundary]
        upper[:-1], upper[-1] = own[1:], {"free": outside, "periodic": own[0], "mirror": own[-1]}[boundary]
        yield from (lower, upper) if own is mask else (lower.T, upper.T)


def faces_between(contact: Array, free: Array, boundary: Boundary, outside: bool = False) -> int:
    """Return the number of faces between contact cells and free cells, see :func:`neighbours`."""
    return sum(int(np.count_nonzero(contact & beside)) for beside in neighbours(free, boundary, outside))


def contact_area(
    contact: Array, free: Array, cell_area: float, boundary: Boundary, outside: bool = False
) -> tuple[float, float]:
    """Return the area of the cells in contact, counted and corrected for the grid. [m2]

    Counting cells overestimates the area by a part of the strip along the perimeter.

    Parameters
    ----------
    contact, free : array of bool, shape (nx, ny)
        Contact cells, and cells with material out of contact.
    cell_area : float
        Area of a cell. [m2]
    boundary, outside
        See :func:`neighbours`.
    """
    counted = int(np.count_nonzero(contact)) * cell_area
    # a face across x is dy long and lies in a strip dx wide, and the other way round
    strip = PERIMETER_CORRECTION * cell_area * faces_between(contact, free, boundary, outside)
    return counted, max(counted - strip, 0.0)


def area_bounds(counted: Array, area: Array, inside: Array, outside: Array) -> tuple[Array, Array]:
    """Return bounds on a contact area, if some cells are uncertain. [m2]

    Parameters
    ----------
    counted, area : float or ndarray
        Contact area, counted and corrected, see :func:`contact_area`. [m2]
    inside, outside : float or ndarray
        Area of the uncertain cells in contact, and of the uncertain cells out of contact. [m2]

    Returns
    -------
    lower, upper : float or ndarray
        `area` lies between them. [m2]

    Notes
    -----
    A cell that enters or leaves the contact changes the count by one cell and the staircase by at most its four faces.
    The area of a cell exceeds the correction for its faces. The area therefore grows with each cell that enters the
    contact, and never exceeds the count.

    Examples
    --------
    >>> lower, upper = area_bounds(10.0, 9.0, 1.0, 0.5)
    >>> round(float(lower), 3), round(float(upper), 3)
    (7.648, 9.676)
    """
    most = 1 + 4 * PERIMETER_CORRECTION
    return np.maximum(area - most * inside, 0.0), np.minimum(area + most * outside, counted + outside)
