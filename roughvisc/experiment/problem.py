"""The problem of an experiment: a surface, the body under it, and the settings of the solve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import xarray as xr

from roughvisc.mechanics.body import Body
from roughvisc.settings import Settings
from roughvisc.topography.borders import is_mirrored, is_periodic
from roughvisc.topography.recipes import BOUNDARIES, indenter_of, recipe_name

#: Expected boundary if ``auto`` cannot be resolved.
OPEN_BOUNDARY = """\
one of these, because the surface does not show what lies beyond its border
  a nominally flat scan that stands for a larger surface: boundary = "mirror"; "periodic" if it repeats as it is
  an indenter or a single bump whose contact stays inside: boundary = "free"
  a scan that is itself the whole body: boundary = "free" with edge = "accept\""""


def boundary_of(h: xr.DataArray) -> Literal["free", "periodic"] | None:
    """Return the boundary that a surface was made for; None for scans, plain arrays and all other surfaces.

    The user must state the boundary if this function returns None. The recipe of an indenter counts only if it
    reproduces the heights, because the grid may have to grow. The recipe of waves or roughness, and the record of
    mirroring, count only if the attribute ``period`` gives the sides of the grid and the borders meet
    (:func:`is_periodic`).

    Parameters
    ----------
    h : xarray.DataArray, dims (x, y)
        Heights. [m]

    Returns
    -------
    {"free", "periodic"} or None
        ``free`` for an indenter; ``periodic`` for waves, self-affine roughness and mirrored surfaces.

    Examples
    --------
    >>> from roughvisc.topography.recipes import sphere, wavy
    >>> ball, waves = sphere(1e-2, 1e-3, 8), wavy(1e-6, 1e-3, 1e-3, 8)
    >>> boundary_of(ball), boundary_of(waves), boundary_of(ball + waves)
    ('free', 'periodic', None)
    """
    if indenter_of(h) is not None:
        return "free"
    made = BOUNDARIES.get(recipe_name(h)) == "periodic" and is_periodic(h)
    return "periodic" if made or is_mirrored(h) else None


@dataclass(frozen=True)
class Problem:
    """Surface, body and settings of an experiment.

    Attributes
    ----------
    height : xarray.DataArray, dims (x, y)
        Profile, peaks up. [m]
    body : Body
        The body under it.
    settings : Settings
        Numerical settings and the fields to keep.
    """

    height: xr.DataArray
    body: Body
    settings: Settings
