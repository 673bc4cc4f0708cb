"""Cost of an experiment of any kind: some of its rows on coarse grids, carried on to all of them on the real one."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import xarray as xr

from roughvisc.experiment.coarser import on_fewer_cells
from roughvisc.experiment.loading import Loading
from roughvisc.problem import Problem
from roughvisc.solve import solve
from roughvisc.study.cost.estimate import CoarseRun, Copies, CostEstimate, coarse, march_of
from roughvisc.study.cost.press import Pressed
from roughvisc.study.statement.case import Case
from roughvisc.topography.grid import nominal_area

#: Sides of the coarse grids, in cells, and by what factors an experiment may grow dearer from one to the next.
_COARSE, _GROWS = (24, 48), (1.0, 1.5)
#: What the grid's error costs: all on a quarter of the cells and a sixteenth, dearer by the cell.
_AGAIN = 1.4


def foretold(case: Case, height: xr.DataArray, copies: Copies | None = None) -> CostEstimate:
    """What a case takes: of one that marches by its steps on coarse grids, of any other by some of its rows there.

    Parameters
    ----------
    case : Case
        Any.
    height : xarray.DataArray
        Its surface. [m]
    copies : Copies, optional
        Of the surface, if there are some already.

    Raises
    ------
    InputError
        If the case is impossible.
    """
    if isinstance(case.experiment(), Loading):
        return march_of(case, height, copies)
    experiment = case.experiment().on_area(nominal_area(height))
    cheaper, count, dearer = experiment.cheaper()
    settings = replace(case.solving(), fields=(), grid_error=False)
    fewer, few = _copies(case, height)
    halved = solve(Problem(fewer, case.body(), settings), cheaper)
    began = time.perf_counter()
    found = solve(Problem(few, case.body(), settings), cheaper)
    took = time.perf_counter() - began
    count = count or found.sizes[experiment.axis]
    finest, before = (float(one["convolutions"].mean()) for one in (found, halved))
    growth = min(max(finest / max(before, 1.0), _GROWS[0]), _GROWS[1])
    octaves = math.log2(max(math.sqrt(height.size) / _COARSE[1], 1.0))
    work = finest * count * dearer * growth**octaves * (_AGAIN if case.solving().grid_error else 1.0)
    cells = np.sort(found["contact_area_counted"].values / nominal_area(found["height"]))
    contact = np.interp(np.linspace(0, 1, count), np.linspace(0, 1, cells.size), cells)
    return CostEstimate(
        steps=float(count),
        rows=float(count),
        convolutions=work,
        damped=0.0,
        contact=float(cells.max()),
        whole=True,
        level=float(found["approach"].max()),
        force=float(found["force"].max()),
        fraction=float(found["contact_fraction"].max()),
        kept=tuple(contact.tolist()),
        pressed=_pressed(found),
        coarse_run=CoarseRun(few, found.sizes[experiment.axis], float(found["convolutions"].sum()), took),
    )


def _copies(case: Case, height: xr.DataArray) -> list[xr.DataArray]:
    """The surface on so many cells a side, with the waves that they hold; missing points stay missing."""
    found = []
    for side in _COARSE:
        shape = tuple(min(count, side) for count in height.shape)
        if shape == height.shape:
            found.append(height)
        elif case.settings.solve.boundary != "free" and np.isfinite(height.values).all():
            found.append(on_fewer_cells(height, (shape[0], shape[1]), case.settings.solve.boundary))
        else:
            found.append(coarse(height, side))
    return found


def _pressed(found: xr.Dataset) -> Pressed:
    """The largest contact on a coarse grid."""
    shape, fraction, level = found["height"].shape, found["contact_fraction"], found["approach"]
    return Pressed(shape, float(fraction.max()), float(level.max()), (0.0, 0.0), at_border=False)
