"""Faces between contact cells and free cells, and the correction of a counted contact area."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.grid import Boundary, namespace

Array = Any  # an array of NumPy or CuPy, or a float
Mask = NDArray[np.bool_]

#: Counted contact cells overestimate the area by this part of the staircase perimeter times the cell side; measured
#: on Hertz contacts of 6 to 200 cells' radius (0.080 to 0.092).
PERIMETER_CORRECTION = 0.088


def neighbours(mask: Mask, boundary: Boundary, before: bool = False, beyond: bool = False) -> Iterator[Mask]:
    """Yield the mask of the neighbour across the lower and the upper face of each cell, along x, then along y.

    Parameters
    ----------
    mask : ndarray of bool, shape (nx, ny)
        Mask of the cells.
    boundary : {"free", "periodic", "mirror"}
        Periodic: the first cell of a row is the neighbour of the last. Mirror: beyond the border, a cell's neighbour is
        its own image.
    before, beyond : bool
        Values outside the first and the last cell of every row in free space.

    Examples
    --------
    >>> [seen.ravel().tolist() for seen in neighbours(np.array([[True], [False]]), "free")][:2]
    [[False, True], [False, False]]
    >>> [seen.ravel().tolist() for seen in neighbours(np.array([[True], [False]]), "mirror")][:2]
    [[True, True], [False, False]]
    """
    for turned in (False, True):
        own = mask.T if turned else mask
        lower, upper = np.empty_like(own), np.empty_like(own)
        lower[1:], lower[0] = own[:-1], {"free": before, "periodic": own[-1], "mirror": own[0]}[boundary]
        upper[:-1], upper[-1] = own[1:], {"free": beyond, "periodic": own[0], "mirror": own[-1]}[boundary]
        yield from (lower.T, upper.T) if turned else (lower, upper)


def faces_between(contact: Array, free: Array, periodic: bool, before: bool = False, beyond: bool = False) -> int:
    """Return the number of faces between contact cells and free cells, see :func:`neighbours`.

    With mirror boundaries the border has no such faces: use ``periodic=False`` and the default values beyond it.
    """
    count, xp = 0, namespace(contact)
    for own, other in ((contact, free), (contact.T, free.T)):
        below = other[-1] if periodic else before
        above = other[0] if periodic else beyond
        for cells, beside in (own[1:], other[:-1]), (own[:-1], other[1:]), (own[0], below), (own[-1], above):
            count += int(xp.count_nonzero(cells & beside))
    return count


def contact_area(
    contact: Array, free: Array, cell_area: float, periodic: bool, before: bool = False, beyond: bool = False
) -> tuple[float, float]:
    """Return the area of the cells in contact, counted and corrected for the grid. [m2]

    Counting cells overestimates the area by a part of the strip along the perimeter.

    Parameters
    ----------
    contact, free : array of bool, shape (nx, ny)
        Contact cells, and cells with material out of contact.
    cell_area : float
        Area of a cell. [m2]
    periodic, before, beyond
        See :func:`neighbours`.
    """
    counted = int(namespace(contact).count_nonzero(contact)) * cell_area
    # a face across x is dy long and lies in a strip dx wide, and the other way round
    strip = PERIMETER_CORRECTION * cell_area * faces_between(contact, free, periodic, before, beyond)
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
