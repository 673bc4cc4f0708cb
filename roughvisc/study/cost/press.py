"""How much of a surface comes into contact: one elastic press of a copy of it on few enough cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.experiment.coarser import coarser
from roughvisc.experiment.profile import Profile
from roughvisc.mechanics.body import Kernel
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.contact.neighbours import staircase
from roughvisc.mechanics.grid import Boundary

#: Cells of the longer side of the copy that is pressed, at most: a press takes 30 to 60 ms then.
MOST_PRESSED = 256
#: Error of the pressure of a press: the contact area changes by less than 1 % from there on.
_TOLERANCE = 1e-2


@dataclass(frozen=True)
class Push:
    """What an elastic body has to be pressed with to have the contact that a viscoelastic one has at an instant.

    While a contact grows beyond all that it was before, its pressures are those of an elastic body under the load
    ``integral C(t - s) dF(s)`` over its compliance, at the same approach (T. C. T. Ting, J. Appl. Mech. 35 (1968) 248).

    Attributes
    ----------
    load : float or None
        That integral. [m2]
    approach : float or None
        Given in place of it. [m]
    """

    load: float | None = None
    approach: float | None = None


@dataclass(frozen=True)
class Pressed:
    """What a press finds.

    Attributes
    ----------
    shape : tuple of int
        Cells of the copy that was pressed.
    fraction : float
        Contact fraction, that of the contact area, which is corrected for the grid. [-]
    approach : float
        [m]
    width : tuple of float
        Extent of the contact along x and along y. [m]
    at_border : bool
        Whether it comes to the outermost cells.
    """

    shape: tuple[int, int]
    fraction: float
    approach: float
    width: tuple[float, float]
    at_border: bool


def copy_to_press(height: xr.DataArray, boundary: Boundary, most: int) -> xr.DataArray:
    """The surface itself, or the waves of it that a grid of so many cells along the longer side holds. [m]"""
    longest = max(height.shape)
    return height if longest <= most else coarser(height, longest / most, boundary)


def press(height: xr.DataArray, push: Push, boundary: Boundary, kernel: Kernel) -> Pressed:
    """Press a surface, where missing points are absent, on an elastic body.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        The surface. [m]
    push : Push
        What it is pressed with.
    boundary : {"free", "periodic"}
    kernel : Kernel
        Of the body.
    """
    profile = Profile(height, "absent", kernel=kernel)
    operator, shape = profile.operator(boundary), (height.sizes["x"], height.sizes["y"])
    present = None if profile.present.all() else profile.present
    nothing = push.load == 0 if push.approach is None else push.approach <= profile.least_gap
    if nothing:
        return Pressed(shape, 0.0, push.approach or profile.least_gap, (0.0, 0.0), at_border=False)
    if push.approach is not None and present is None and not operator.definite and push.approach >= profile.mean_gap:
        touching, approach = np.ones(profile.gap.shape, bool), push.approach  # full contact, under any load
    else:
        found = solve_contact(
            operator,
            profile.gap,
            load=None if push.load is None else push.load / operator.cell_area,
            approach=push.approach,
            tolerance=_TOLERANCE,
            present=present,
        )
        touching, approach = found.pressure > 0, found.approach
    free = ~touching if present is None else present & ~touching
    counted = np.count_nonzero(touching) * operator.cell_area
    area = max(counted - staircase(touching, free, operator.cell_area, boundary == "periodic"), 0.0)
    fraction = profile.contact_fraction(area)
    return Pressed(shape, fraction, approach, width_of(touching, profile), _at_border(touching))


def width_of(touching: NDArray[np.bool_], profile: Profile) -> tuple[float, float]:
    """Extent of a contact along x and along y, from the first cell to the last one. [m]"""
    widths = []
    for other, side in zip((1, 0), profile.spacing, strict=True):
        cells = np.flatnonzero(touching.any(axis=other))
        widths.append(float((cells[-1] + 1 - cells[0]) * side) if cells.size else 0.0)
    return widths[0], widths[1]


def _at_border(touching: NDArray[np.bool_]) -> bool:
    return any(bool(touching[i].any() or touching[:, i].any()) for i in (0, -1))
