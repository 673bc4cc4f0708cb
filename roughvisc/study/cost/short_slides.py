"""What a program with slides costs: its slides march over coarse grids for a part of their way, and are counted out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr

from roughvisc.mechanics.stepping.program import Program, Slide
from roughvisc.topography.grid import spacing

#: Cells of the coarse grid that a slide goes there at most.
_MOST = 24


def slid_cells(program: Program, height: xr.DataArray) -> int:
    """Steps that all slides of a program take: one a cell.

    Parameters
    ----------
    program : Program
        The loading program.
    height : xarray.DataArray, dims (x, y)
        The surface. [m]
    """
    sides = spacing(height, "height")
    return sum(segment.slide.cells(sides) for segment in program.segments if segment.slide is not None)


def shortened(program: Program, height: xr.DataArray) -> Program:
    """The program with slides of at least one cell of a coarse surface, and not of many, at their speed.

    Parameters
    ----------
    program : Program
        The loading program.
    height : xarray.DataArray, dims (x, y)
        The coarse surface. [m]
    """
    sides, segments = spacing(height, "height"), []
    for segment in program.segments:
        if segment.slide is not None:
            side = sides[segment.slide.axis]
            way = float(np.clip(segment.slide.distance, side, _MOST * side))
            duration = segment.duration * way / segment.slide.distance
            segment = replace(segment, duration=duration, slide=Slide(way, segment.slide.direction))
        segments.append(segment)
    return replace(program, segments=tuple(segments))
