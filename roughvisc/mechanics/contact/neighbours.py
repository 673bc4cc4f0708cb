"""Faces between cells in contact and cells out of contact, and what counting cells makes of a contact area."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.mechanics.grid import Boundary

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Counted contact cells overestimate the area by this part of the staircase perimeter times the cell side; measured
#: on Hertz contacts of 6 to 200 cells' radius (0.080 to 0.092).
PERIMETER_CORRECTION = 0.088


def neighbours(mask: Mask, boundary: Boundary, before: bool = False, beyond: bool = False) -> Iterator[Mask]:
    """The mask as seen from each cell across its lower and upper face along x, then along y.

    Parameters
    ----------
    mask : ndarray of bool, shape (nx, ny)
        Of the cells.
    boundary : {"free", "periodic", "mirror"}
        Periodic: the first cell of a row is the neighbour of the last. Mirror: beyond the border, a cell's neighbour is
        its own image.
    before, beyond : bool
        What lies outside the first and outside the last cell of every row in free space.

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


def faces_between(contact: Mask, free: Mask, periodic: bool, before: bool = False, beyond: bool = False) -> int:
    """Number of faces between cells in contact and free ones, as :func:`neighbours` sees these.

    With mirror images there are none at the border, as in free space with nothing beyond it.
    """
    count = 0
    for own, other in ((contact, free), (contact.T, free.T)):
        below = other[-1] if periodic else before
        above = other[0] if periodic else beyond
        pairs = (own[1:], other[:-1]), (own[:-1], other[1:]), (own[0], below), (own[-1], above)
        count += sum(int(np.count_nonzero(cells & beside)) for cells, beside in pairs)
    return count


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


def area_bounds(counted: ArrayLike, area: ArrayLike, inside: ArrayLike, outside: ArrayLike) -> tuple[Array, Array]:
    """Bounds on a contact area where it is uncertain of some cells whether they are in contact. [m2]

    Parameters
    ----------
    counted, area : array_like
        Contact area, counted and less :func:`staircase`. [m2]
    inside, outside : array_like
        Area of the uncertain cells in contact, and of those out of it. [m2]

    Returns
    -------
    lower, upper : ndarray
        `area` lies between them. [m2]

    Notes
    -----
    A cell that changes sides changes the count by one cell and the staircase by the cell's four faces at most. Each
    cell in contact counts more than its faces take off: the area grows with each cell that comes into contact, and
    is never more than the count.

    Examples
    --------
    >>> lower, upper = area_bounds(10.0, 9.0, 1.0, 0.5)
    >>> round(float(lower), 3), round(float(upper), 3)
    (7.648, 9.676)
    """
    counted, area, inside, outside = (np.asarray(one, dtype=float) for one in (counted, area, inside, outside))
    most = 1 + 4 * PERIMETER_CORRECTION
    return np.maximum(area - most * inside, 0.0), np.minimum(area + most * outside, counted + outside)
