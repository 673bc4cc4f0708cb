"""Error of the grid in friction and contact area, from the same speeds on cells two and four times as long.

The coarser copies have the same waves as far as their cells can hold them, so that a surface without waves that are
shorter loses nothing but accuracy. No error of the area is stated below that of counting cells. Of friction, what
pressure on slopes and dissipated power differ by would say little: at low speed it is the rest of two large forces.
"""

from __future__ import annotations

import logging
import math
from itertools import pairwise

import numpy as np

from roughvisc.experiment.faces import SlidingGrid, areas
from roughvisc.experiment.grid_convergence import grid_uncertainty
from roughvisc.experiment.grid_error import counting_error
from roughvisc.mechanics.contact.neighbours import faces_between
from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.sliding.steady import SteadyState

log = logging.getLogger("roughvisc")

#: Stated over what counting leaves open of an area at rest. On 24 rough surfaces, at three pressures and three speeds,
#: the stated error of the area is then 0.8 of the true one or more, and 4.8 times that in the median; with 1 and the
#: powers of an area at rest it was less than 0.8 in 15 of these 216.
_COUNTING_CAUTION = 1.5

_NOTHING = {"grid_error_friction": math.nan, "grid_error_area": math.nan}


class CoarserFaces:
    """A face on coarser grids; none where it cannot be made coarser.

    Parameters
    ----------
    face : Face
        On the grid of the surface.
    """

    def __init__(self, face: SlidingGrid) -> None:
        self._spacing = face.spacing
        self.faces = [coarse for coarse in (face.coarser(2.0), face.coarser(4.0)) if coarse is not None]
        if not self.faces:
            log.warning("no grid error: %d x %d cells are the fewest that there can be", *face.gap.shape)
            return
        self._ratio = max(many / few for many, few in zip(face.gap.shape, self.faces[0].gap.shape, strict=True))
        if self.faces[-1].gap.size == self.faces[0].gap.size:
            del self.faces[1:]

    def errors(
        self, found: SteadyState, speed: float, law: Material, force: float, tolerance: float
    ) -> dict[str, float]:
        """Relative errors of friction and contact area at a speed, missing where no coarser copy has a solution.

        Parameters
        ----------
        found : SteadyState
            On the surface's own grid.
        speed : float
            [m/s]
        law : Material
            With a complex compliance in closed form.
        force : float
            [N]
        tolerance : float
            Of the coarser solutions too.
        """
        runs = [_friction_and_area(found, self._spacing)]
        for face in self.faces:
            runs.append(_friction_and_area(face.slide(face.sliding(speed, law), force, tolerance), face.spacing))
        if len(self.faces) == 0 or not runs[0][0] > 0:
            return dict(_NOTHING)
        runs += [(math.nan, math.nan)] * (3 - len(runs))
        near, far = (
            [abs(b - a) / first for a, b, first in zip(one, other, runs[0], strict=True)]
            for one, other in pairwise(runs)
        )
        friction = float(grid_uncertainty("friction", near[0], far[0], self._ratio))
        area = float(grid_uncertainty("sliding_area", near[1], far[1], self._ratio))
        contact = found.pressure > 0
        counting = _COUNTING_CAUTION * counting_error(contact, faces_between(contact, ~contact, True))
        return {"grid_error_friction": friction, "grid_error_area": float(np.maximum(area, counting))}  # NaN stays


def _friction_and_area(state: SteadyState, spacing: tuple[float, float]) -> tuple[float, float]:
    """Friction force [N] and contact area [m2] of a steady state; missing where it did not converge."""
    if not state.converged:
        return math.nan, math.nan
    return state.power_force, areas(state.pressure > 0, spacing)[1]
