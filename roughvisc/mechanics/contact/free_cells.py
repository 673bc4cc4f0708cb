"""The cells of the contact solver that are free to change."""

from __future__ import annotations

from typing import Any, NamedTuple

Array = Any  # an array of NumPy or CuPy


class Free(NamedTuple):
    """The cells that carry pressure or penetrate.

    Attributes
    ----------
    cells : array of int, shape (n,)
        The free cells, in ascending order.
    held, residual : array, shape (n,)
        Pressure, and separation without the approach; under a load the residual has no mean.
    level : float
        Approach.
    touching : int
        Number of cells in contact.
    largest_residual : float
        Largest absolute residual.
    total, highest_pressure : float
        Sum of the pressure, and its largest value.
    least, most : float
        Smallest and largest separation; the approach and zero without free cells.
    weighted, energy : float
        Sum of pressure times separation, and of pressure times displacement.
    ends : array of int, optional
        On a GPU, number of free cells up to the end of each segment, a part of a row that lies in a block.
    """

    cells: Array
    held: Array
    residual: Array
    level: float
    touching: int
    largest_residual: float
    total: float
    highest_pressure: float
    least: float
    most: float
    weighted: float
    energy: float
    ends: Array | None = None
