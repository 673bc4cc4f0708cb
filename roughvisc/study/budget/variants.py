"""The case of a budget with one thing changed: other cells, fewer waves, another patch, another material."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.study.case import Case, vary
from roughvisc.study.study_file import TEMPERATURE
from roughvisc.study.trade.ladder import changed_keys, grid_change, is_data
from roughvisc.topography.grid import spacing
from roughvisc.topography.spectrum import last_octave, modes

#: By how much a modulus or a time scale is changed to see what a number makes of it.
STEP = 1.1
#: Gaussian surrogates that show the scatter of a patch.
PATCHES = 6


@dataclass(frozen=True)
class Variants:
    """One case and its relatives.

    Parameters
    ----------
    case : Case
        What the budget is of, with the rows and fields that it needs.
    height : xarray.DataArray
        Its surface. [m]
    """

    case: Case
    height: xr.DataArray

    @property
    def shape(self) -> tuple[int, int]:
        """Cells of the surface."""
        return self.height.sizes["x"], self.height.sizes["y"]

    @property
    def is_rough(self) -> bool:
        """Whether the whole surface stands for a larger one: then another patch and shorter waves have a meaning."""
        stands_for_more = self.case.settings.boundary != "free" and is_data(self.case)
        return stands_for_more and bool(np.isfinite(self.height.values).all())

    @cached_property
    def shortest_wave(self) -> float:
        """Wavelength above which 99 % of the mean square slope lie, at least two cells; zero without slopes. [m]

        Two cells: the grid holds shorter waves along its diagonals alone.
        """
        level = self.height.values - float(self.height.mean())
        q_x, q_y, power, count = modes(level, spacing(self.height), "forward")
        q = np.hypot(q_x, q_y)
        begins = last_octave(q, count * power * q**2)
        return max(math.pi / begins, 2 * max(spacing(self.height))) if begins else 0.0

    def on_cells(self, coarsening: float) -> Case:
        """The same waves on cells so many times longer; a half: on cells half as long."""
        surface = self.case.surface
        key, cells = grid_change(self.case, self.shape, coarsening)
        if not is_data(self.case) or coarsening > 1 or not surface.get("resample"):
            return vary(self.case, {key: cells})
        # a finer grid would hold more waves
        held = max(surface.get("shortest_wave") or 0.0, 2 * max(spacing(self.height)))
        return vary(self.case, {"surface.shortest_wave": held, "surface.resample": cells})

    def without_last_octave(self, case: Case) -> Case:
        """The case, or one of it on other cells, without the shortest octave of the waves."""
        return vary(case, {"surface.shortest_wave": 2 * self.shortest_wave})

    def other_patch(self, number: int) -> Case:
        """Another patch of the same roughness, as large as what was measured, on cells twice as long."""
        cells = [max(2, round(n / 2)) for n in self.shape]
        return vary(self.case, {"surface.resample": cells, "surface.realisation": number})


def stiffer(case: Case) -> Case:
    """With all moduli larger by :data:`STEP`."""
    return vary(case, {"material.modulus_factor": STEP * case.tables["material"].get("modulus_factor", 1.0)})


def slower(case: Case) -> Case:
    """With all times of the material longer by :data:`STEP`."""
    changes: dict[str, Any] = {f"material.{key}": None for key in TEMPERATURE if key in case.tables["material"]}
    return vary(case, changes | {"material.shift_factor": STEP * case.shift_factor})


def with_rows(case: Case, places: Any, fields: Iterable[str]) -> Case:
    """A case that keeps these fields at these places of its axis, and no error of the grid; all places where None."""
    settings, experiment = case.settings, case.experiment()
    changes: dict[str, Any] = {"keep.fields": list(dict.fromkeys(fields)), "solve.grid_error": False}
    if places is not None and experiment.axis == "time":
        changes |= changed_keys(settings, replace(settings, times=[float(one) for one in places]))
    return vary(case, changes)
