"""Cost of a curve of friction: the same speeds on coarse grids, carried on to the real one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import xarray as xr

from roughvisc.study.cost.estimate import Copies, CostEstimate, coarse
from roughvisc.study.cost.press import Pressed
from roughvisc.study.simulation.coarser import on_fewer_cells
from roughvisc.study.simulation.footprint import PROCESS, curve_bytes
from roughvisc.study.simulation.friction import rub
from roughvisc.study.statement.case import Case
from roughvisc.study.statement.curve import SteadySliding
from roughvisc.study.statement.settings import Settings
from roughvisc.topography.grid import nominal_area

#: Sides of the coarse grids, in cells, and by what factors a curve may grow dearer from a grid to one twice as fine.
_COARSE, _GROWS = (24, 48), (1.0, 1.5)
#: Speeds of a coarse curve: of more, evenly spread ones.
_SPEEDS = 7
#: Convolutions of an iteration of the contact solver, and of what is done once a contact problem.
_OF_ITERATION, _OF_PROBLEM = 2.0, 5.0
#: What the curves of the grid's error cost: on a quarter of the cells and a sixteenth, dearer by the cell.
_AGAIN = 1.4


def curve_march(case: Case, height: xr.DataArray, _: Copies | None = None) -> CostEstimate:
    """Speeds as steps, and convolutions of a curve, from coarse grids.

    Raises
    ------
    InputError
        If the case is impossible.
    """
    found = [_convolutions(case, height, side) for side in _COARSE]
    octaves = math.log2(max(math.sqrt(height.size) / _COARSE[1], 1.0))
    growth = min(max(found[1][0] / max(found[0][0], 1.0), _GROWS[0]), _GROWS[1])
    _, contact, level, force, fraction = found[1]
    curve = _curve(case)
    times = 1.0 + float(curve.last_octave)
    count = float(len(curve.asked))
    again = _AGAIN if case.solving().grid_error else 1.0
    work = found[1][0] * growth**octaves * times * again
    pressed, halved = (
        Pressed(tuple(min(n, side) for n in height.shape), one[4], one[2], (0.0, 0.0), at_border=False)
        for side, one in zip(reversed(_COARSE), reversed(found), strict=True)
    )
    known = {"pressed": pressed, "halved": halved if max(height.shape) > _COARSE[1] else None}
    return CostEstimate(count, count, work, 0.0, max(contact), True, level, force, fraction, contact, **known)


def memory_of_curve(cells: float, settings: Settings) -> float:
    """Memory of the process that computes a curve, at its peak. [bytes]"""
    return PROCESS + curve_bytes(settings, cells)


def _curve(case: Case) -> SteadySliding:
    experiment = case.experiment()
    assert isinstance(experiment, SteadySliding), "a program has a march of its own"
    return experiment


def _convolutions(case: Case, height: xr.DataArray, side: int) -> tuple[float, tuple[float, ...], float, float, float]:
    """Convolutions of all speeds on a coarse grid; parts of the cells in contact, and the largest values of approach
    [m], force [N] and contact fraction."""
    curve = _curve(case)
    asked = np.sort(curve.asked)
    few = asked[np.unique(np.linspace(0, len(asked) - 1, min(_SPEEDS, len(asked))).astype(int))]
    shape = tuple(min(count, side) for count in height.shape)
    small = height if shape == height.shape else _coarser(height, side, shape)
    settings: Settings = replace(case.solving(), fields=(), grid_error=False)
    again = replace(curve, speeds=few.tolist(), last_octave=False)
    found = rub(small, case.material(), again, settings, progress=False)
    work = _OF_ITERATION * found["iterations"].values + _OF_PROBLEM * found["outer_iterations"].values
    cells = found["contact_area_counted"].values / nominal_area(small)
    contact = np.interp(np.log(asked), np.log(few), cells)
    total = float(np.interp(np.log(asked), np.log(few), work).sum())
    largest = (float(found[name].max()) for name in ("approach", "force", "contact_fraction"))
    return total, tuple(contact.tolist()), *largest


def _coarser(height: xr.DataArray, side: int, shape: tuple[int, ...]) -> xr.DataArray:
    """The surface on fewer cells, with the waves that they hold; missing points, which are refused, stay missing."""
    if not np.isfinite(height.values).all():
        return coarse(height, side)
    return on_fewer_cells(height, (shape[0], shape[1]), "periodic")
