"""Windows and grids that a march comes through where they follow the contact, as far as they are known beforehand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from roughvisc.experiment.profile import GROWTH, MOST_CELLS, Profile
from roughvisc.topography.indenters import grown_shape

Widths = tuple[float, float]


@dataclass(frozen=True)
class Stage:
    """One window of a surface, or one grid.

    Attributes
    ----------
    shape : tuple of int
        Cells of the surface.
    solved : float
        Cells that are solved on.
    outside : float
        Least gap beyond the window; infinite where it is the whole domain. [m]
    width : tuple of float
        Between the centres of the outermost cells, along x and along y: a contact as wide outgrows the grid. [m]
    """

    shape: tuple[int, int]
    solved: float
    outside: float = math.inf
    width: Widths = (math.inf, math.inf)

    def holds(self, level: float, width: Widths) -> bool:
        """Whether a contact of an approach and a width stays inside. [m]"""
        if self.outside < math.inf:
            return self.outside > level
        return all(own < limit for own, limit in zip(width, self.width, strict=True))


def stages_of(profile: Profile, grows: bool) -> tuple[Stage, ...]:
    """The windows of a profile from the present one on, and the grids that it grows to; it has the whole window then.

    Parameters
    ----------
    profile : Profile
        The surface.
    grows : bool
        Whether its grid may grow.
    """
    shape = (profile.height.sizes["x"], profile.height.sizes["y"])
    found = []
    while not profile.window.whole:
        found.append(Stage(shape, math.prod(profile.window.shape), profile.window.outside))
        profile.widen_window()
    part = math.prod(profile.window.shape) / math.prod(shape)
    while True:
        sides = [(n - 1) * side for n, side in zip(shape, profile.spacing, strict=True)]
        found.append(Stage(shape, part * math.prod(shape), width=(sides[0], sides[1])))
        larger = grown_shape(shape, GROWTH)
        if not grows or math.prod(larger) > MOST_CELLS:
            return tuple(found)
        shape = (larger[0], larger[1])


def stage_at(stages: Sequence[Stage], level: float, width: Widths) -> int:
    """Number of the first stage that holds a contact of an approach and a width; the last one, if none does. [m]"""
    return next((i for i, stage in enumerate(stages) if stage.holds(level, width)), len(stages) - 1)
