"""The surface that is pressed, as plain arrays."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.body import HALF_SPACE, Kernel
from roughvisc.mechanics.grid import Boundary, Grid
from roughvisc.settings import Missing, Settings
from roughvisc.topography.grid import checked, nominal_area, spacing
from roughvisc.topography.indenters import highest

Array = NDArray[np.float64]


class Profile:
    """The labelled surface of a solve, and the arrays that the mechanics needs.

    Parameters
    ----------
    height : xarray.DataArray
        Profile, peaks up. [m]
    missing : {"refuse", "absent"}
        What missing heights mean.
    kernel : Kernel
        Of the body that it is pressed on.

    Attributes
    ----------
    present : ndarray of bool, shape (nx, ny)
        Cells with material.
    highest : float
        Height of the highest point, which on an indenter may lie between the cells. [m]
    gap : ndarray, shape (nx, ny)
        Undeformed gap at first touch, zero at absent cells. [m]
    least_gap, mean_gap : float
        Least gap, which is positive if the highest point lies between the cells, and mean gap of the present cells. [m]
    nominal_area : float
        Area that nominal pressures refer to. [m2]
    """

    def __init__(self, height: xr.DataArray, missing: Missing = Settings.missing, kernel: Kernel = HALF_SPACE) -> None:
        self.height, self.kernel = _checked(height, missing), kernel
        values = self.height.values
        self.present: NDArray[np.bool_] = np.isfinite(values)
        self.all_present = bool(self.present.all())
        self.highest = highest(self.height)
        self.gap = self.highest - values
        self.least_gap = float(np.nanmin(self.gap))
        self.gap[~self.present] = 0.0
        self.mean_gap = float(np.sum(self.gap)) / np.count_nonzero(self.present)
        self.spacing = spacing(self.height, "height")
        self.nominal_area = nominal_area(self.height)

    def operator(self, boundary: Boundary, workers: int | None = None) -> Grid:
        """Return the body under all cells of the surface."""
        return Grid((self.gap.shape[0], self.gap.shape[1]), self.spacing, boundary, workers, kernel=self.kernel)

    def contact_fraction(self, area: float) -> float:
        """Return the ratio of a contact area to the area of the surface. [-]"""
        dx, dy = self.spacing
        return area / (dx * dy * self.height.size)


def _checked(height: xr.DataArray, missing: Missing) -> xr.DataArray:
    """Return the surface, if it can be pressed: missing heights are absent if the settings or the surface say so."""
    height = checked(height, "height", least=1)
    if np.isinf(height.values).any():
        raise InputError("height holds infinite values: expected finite heights, or NaN where missing")
    present = np.isfinite(height.values)
    if not present.any():
        raise InputError("height is missing everywhere: expected at least one finite height")
    if not present.all() and "absent" not in (missing, height.attrs.get("missing")):
        row, column = np.argwhere(~present)[0]
        raise InputError(
            f"height is missing at {np.count_nonzero(~present)} of {present.size} points, the first at cell "
            f"({row}, {column}): fill it (fill = true in a study, rv.fill in Python), or say missing='absent' "
            "if there is no material"
        )
    return height
