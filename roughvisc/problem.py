"""A problem: the surface that is pressed, the body that it is pressed on, and how the contact is computed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

from roughvisc.errors import InputError
from roughvisc.mechanics.body import Body
from roughvisc.settings import OPEN_BOUNDARY, Settings, known_boundary
from roughvisc.topography.borders import boundary_of
from roughvisc.topography.grid import spacing

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Problem:
    """What an experiment is done with.

    Attributes
    ----------
    height : xarray.DataArray, dims (x, y)
        Profile, peaks up. [m]
    body : Body
        What it is pressed on.
    settings : Settings
        How it is computed and what is kept.
    """

    height: xr.DataArray
    body: Body
    settings: Settings

    def on(self, height: xr.DataArray, **settings: Any) -> Problem:
        """The same with another surface [m], and with some settings changed."""
        return replace(self, height=height, settings=replace(self.settings, **settings))

    def with_known_boundary(self, only: Literal["free", "periodic"] | None) -> Problem:
        """The same with what ``auto`` stands for, see :func:`known_boundary`.

        Raises
        ------
        InputError
            If that has to be said.
        """
        found = known_boundary(self.settings, only, partial(boundary_of, self.height))
        if found is None:
            name = self.height.attrs.get("source_file", "height")
            raise InputError(f"{name}: boundary {OPEN_BOUNDARY.replace(' = ', '=')}")
        return self.on(self.height, boundary=found)

    def check_cells(self) -> None:
        """Refuse a surface on whose cells the body's kernel is not accurate in free space.

        With periodic and mirror boundaries the transfer function is exact on any cells. Coarser copies of a surface are
        not refused.
        """
        if self.settings.boundary == "free":
            dx, dy = spacing(self.height, "height")
            self.body.kernel.check_cells((dx, dy))
