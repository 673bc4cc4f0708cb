"""The profile that is pressed: the labelled surface, and the part of it that is solved on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.bodies.window import Window, whole_domain, window_around
from roughvisc.mechanics.body import HALF_SPACE, Kernel
from roughvisc.mechanics.grid import Boundary, Grid
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.settings import Missing, Settings
from roughvisc.topography.grid import checked, nominal_area, spacing
from roughvisc.topography.indenters import grown, highest

Array = NDArray[np.float64]


#: A window, and the grid of an analytic profile, grow by this factor a time; the latter no farther than so many cells.
GROWTH, MOST_CELLS = 1.5, 4096**2
#: The window begins so many cells wide, on surfaces whose shorter side has so many.
_FIRST_EXTENT, _WORTH_FOLLOWING = 32, 96


class Profile:
    """The labelled surface of a solve, and the window of it that is solved on.

    Both may grow while it is solved: ``growths`` times so far. The window follows the contact in free
    space, where only what is pressed matters; elsewhere it is the whole surface.

    Parameters
    ----------
    height : xarray.DataArray
        Profile, peaks up. [m]
    missing : {"refuse", "absent"}
        What missing heights mean.
    follow : bool
        Whether to begin with a small window, where all of the surface is present.
    kernel : Kernel
        Of the body that it is pressed on; under one that raises the surface there is no window.
    """

    def __init__(
        self,
        height: xr.DataArray,
        missing: Missing = Settings.missing,
        *,
        follow: bool = False,
        kernel: Kernel = HALF_SPACE,
    ) -> None:
        self._missing = missing
        self.kernel = kernel
        self.growths = 0
        height = _checked(height, missing)
        self._lay_out(height)
        #: Area that nominal pressures refer to: that of the surface as it was given. [m2]
        self.nominal_area = nominal_area(height)
        self._extent = float(_FIRST_EXTENT)
        if follow and not kernel.raises_surface and self.all_present and min(height.shape) >= _WORTH_FOLLOWING:
            self.window = window_around(self.gap, _FIRST_EXTENT)

    def _lay_out(self, height: xr.DataArray) -> None:
        self.height = height
        self._can_grow: bool | None = None  # not known yet
        values = height.values
        self._centres = height["x"].values, height["y"].values
        self.present: NDArray[np.bool_] = np.isfinite(values)
        self.all_present = bool(self.present.all())
        #: Height of the highest point, which on an indenter may lie between the cells. [m]
        self.highest = highest(height)
        #: Undeformed gap of the domain at first touch, zero at absent cells. [m]
        self.gap = self.highest - values
        #: The least of it, which is not zero where the highest point lies between the cells. [m]
        self.least_gap = float(np.nanmin(self.gap))
        self.gap[~self.present] = 0.0
        #: Its mean over the present cells. [m]
        self.mean_gap = float(np.sum(self.gap)) / np.count_nonzero(self.present)
        self.spacing = spacing(self.height, "height")
        self.window = whole_domain((values.shape[0], values.shape[1]))

    @property
    def corner(self) -> tuple[float, float]:
        """Centre of the window's first cell. [m]"""
        (i, j), (x, y) = self.window.first, self._centres
        return float(x[i]), float(y[j])

    def operator(self, boundary: Boundary, workers: int | None = None) -> Grid:
        """The body under the window's grid."""
        return Grid(self.window.shape, self.spacing, boundary, workers, kernel=self.kernel)

    def contact_fraction(self, area: float) -> float:
        """Contact area over the area of the surface. [-]"""
        dx, dy = self.spacing
        return area / (dx * dy * self.height.size)

    def can_grow(self) -> bool:
        """Whether the profile is known beyond its grid: its recipe still gives the heights."""
        if self._can_grow is None:
            self._can_grow = "recipe" in self.height.attrs and grown(self.height, 1.0) is not None
        return self._can_grow

    def enlarge(self, scene: Scene) -> tuple[Scene, tuple[int, int]] | None:
        """The scene on a larger grid, and the cell of it where the present one begins; None if it cannot grow."""
        x, y = self.corner
        if self.window.whole:
            larger = grown(self.height, GROWTH)
            if larger is None or larger.size > MOST_CELLS:
                return None
            self._lay_out(_checked(larger, self._missing))
        else:
            self.widen_window()
        self.growths += 1
        first = (self._cell(0, x) - self.window.first[0], self._cell(1, y) - self.window.first[1])
        operator = self.operator(scene.operator.boundary, scene.operator.workers)
        return replace(scene, operator=operator, **self.of_scene()), first

    def widen_window(self) -> None:
        """Take the next larger window, which contains the present one and is the whole surface in the end."""
        before = self.window
        while self.window == before:
            self._extent *= GROWTH
            self.window = window_around(self.gap, int(self._extent), former=before)

    def of_scene(self) -> dict[str, Any]:
        """What a scene takes from the surface."""
        return {
            "gap": np.ascontiguousarray(self.gap[self.window.cells]),
            "present": None if self.all_present else self.present,
            "outside": self.window.outside,
        }

    def _cell(self, axis: int, position: float) -> int:
        """Index in the domain of the cell at a position. [m]"""
        return int(np.searchsorted(self._centres[axis], position))

    def window_at(self, corner: Sequence[float], shape: Sequence[int]) -> Window:
        """A window of the present domain that was solved on before: its first cell's centre and its shape."""
        first = (self._cell(0, corner[0]), self._cell(1, corner[1]))
        return Window(self.window.domain, first, (shape[0], shape[1]))


def _checked(height: xr.DataArray, missing: Missing) -> xr.DataArray:
    """The surface, if it can be pressed; absent where heights are missing if the settings or the surface say so."""
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


def uses_window(settings: Settings) -> bool:
    """Whether a march follows the contact with a window: where it may reach neither the border nor the other side."""
    return settings.boundary == "free" and settings.edge == "error"
