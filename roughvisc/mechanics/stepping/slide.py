"""A slide: how a profile is to move along the surface, in whole cells of a grid, and how far it has come."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from roughvisc.errors import InputError
from roughvisc.units import said

#: In which the profile moves.
Direction = Literal["x", "-x", "y", "-y"]
#: in words
DIRECTIONS = "'x', '-x', 'y' or '-y'"


@dataclass(frozen=True)
class Slide:
    """A stroke of the profile along the surface, at constant speed.

    Parameters
    ----------
    distance : float
        As asked for; what is slid is the nearest whole number of cells. [m]
    direction : {"x", "-x", "y", "-y"}
        In which the profile moves.
    """

    distance: float
    direction: Direction = "x"

    def __post_init__(self) -> None:
        if not 0 < self.distance < math.inf:
            raise InputError(f"distance of a slide is {self.distance!r}: expected a positive number [m]")
        if self.direction not in get_args(Direction):
            raise InputError(f"direction of a slide is {self.direction!r}: expected {DIRECTIONS}")

    @property
    def axis(self) -> int:
        """Of the grid."""
        return 0 if self.direction.endswith("x") else 1

    @property
    def sense(self) -> int:
        """1 where the profile moves towards larger coordinates, else -1."""
        return -1 if self.direction.startswith("-") else 1

    def cells(self, spacing: tuple[float, float]) -> int:
        """Whole number of cells that is slid, one a step.

        Parameters
        ----------
        spacing : tuple of float
            Cell sides. [m]

        Raises
        ------
        InputError
            If the distance is less than half a cell.
        """
        side = spacing[self.axis]
        number = math.floor(self.distance / side * (1 + 1e-12) + 0.5)
        if number < 1:
            raise InputError(
                f"a slide of {said(self.distance, 'm')} is less than half a cell of {said(side, 'm')}: the profile "
                "moves by whole cells; expected a longer distance, or a finer grid"
            )
        return number


@dataclass(frozen=True)
class Slid:
    """How far a profile has slid.

    Attributes
    ----------
    distance : float
        Along the path, whatever the direction. [m]
    work : float
        Work of the tangential force: what the body has taken up in slides, stored or dissipated, less the work of the
        normal force. [J]
    """

    distance: float = 0.0
    work: float = 0.0


def instant(began: float, end: float, taken: int, cells: int) -> float:
    """Time at which so many cells of a slide are behind. [s]

    Parameters
    ----------
    began, end : float
        Of the slide. [s]
    taken, cells : int
        Cells that are behind, and those of the whole slide.
    """
    return end if taken >= cells else began + (end - began) * (taken / cells)
