"""Domain of a free contact, chosen before the run: the part of a surface that can touch.

In free space nothing outside the contact matters. An elastic estimate with the final compliance and the largest load
says how far the surfaces approach. Only cells whose undeformed gap is smaller can touch. A run uses the rectangle
around them; the surface of an indenter is made larger if the estimated contact reaches its border. A run whose contact
outgrows its domain is started anew on a larger one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError
from roughvisc.mechanics.body import Kernel
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.program import Program
from roughvisc.topography.grid import spacing
from roughvisc.topography.indenters import grown, highest

Array = NDArray[np.float64]
#: Cells of the longer side of the estimate, and its tolerance.
ESTIMATED_ON, ESTIMATE_TOLERANCE = 64, 1e-2
#: Estimated approach, and approach of a run, over which cells must be apart: estimate and end of a step have errors.
MARGIN, BEYOND = 1.2, 1.05
#: Cells around the domain.
RIM = 2
#: Cells of the shorter side from which a part of a surface pays, and largest part of the cells.
WORTH_CROPPING, LARGEST_PART = 96, 0.8
#: Factor by which an outgrown domain becomes larger.
GROWTH = 1.5
#: An indenter's surface gets no more cells than these.
MOST_CELLS = 4096**2


@dataclass(frozen=True)
class Domain:
    """Rectangle of a surface that is solved on.

    Attributes
    ----------
    rows, columns : slice
        Cells of the rectangle along x and y.
    shape : tuple of int
        Cells of the whole surface.
    spacing : tuple of float
        Cell sides. [m]
    outside : float
        Least undeformed gap of the surface beyond the rectangle; infinite if there is none. [m]
    kernel : Kernel
        Of the body.
    """

    rows: slice
    columns: slice
    shape: tuple[int, int]
    spacing: tuple[float, float]
    outside: float
    kernel: Kernel

    @property
    def cells(self) -> tuple[slice, slice]:
        """Index of the rectangle in the surface."""
        return self.rows, self.columns

    @property
    def is_whole(self) -> bool:
        """Whether it is all of the surface."""
        return math.isinf(self.outside)

    def is_outgrown(self, approach: float) -> bool:
        """Return whether cells beyond the rectangle may touch. [m]"""
        return BEYOND * approach >= self.outside

    def padded(self, field: Array) -> Array:
        """Return a field of the rectangle on the whole surface, zero beyond it."""
        if self.is_whole:
            return field
        whole = np.zeros(self.shape)
        whole[self.cells] = field
        return whole

    def displacement(self, effective: Array) -> Array:
        """Return the displacement of the whole surface under an effective pressure [-] on the rectangle. [m]"""
        return self._whole.displacement(self.padded(effective))

    def mean_displacement(self, effective: Array) -> float:
        """Return the mean displacement of the whole surface. [m]"""
        return float((effective * self._mean_influence).sum())

    @cached_property
    def _whole(self) -> Grid:
        return Grid(self.shape, self.spacing, "free", kernel=self.kernel)

    @cached_property
    def _mean_influence(self) -> Array:
        """Mean displacement of the surface under unit pressure on each cell: the kernel is symmetric. [m]"""
        return self._whole.displacement(np.full(self.shape, 1 / math.prod(self.shape)))[self.cells]


def whole_domain(gap: Array, sides: tuple[float, float], kernel: Kernel) -> Domain:
    """Return the domain that is all of a surface."""
    return Domain(slice(None), slice(None), (gap.shape[0], gap.shape[1]), sides, math.inf, kernel)


def choose_domain(gap: Array, sides: tuple[float, float], kernel: Kernel, approach: float) -> Domain:
    """Return the part of a surface that may touch before a given approach is reached.

    Parameters
    ----------
    gap : ndarray, shape (nx, ny)
        Undeformed gap at first touch. [m]
    sides : tuple of float
        Cell sides. [m]
    kernel : Kernel
        Of the body.
    approach : float
        Estimated largest approach. [m]
    """
    whole = whole_domain(gap, sides, kernel)
    if min(gap.shape) < WORTH_CROPPING or math.isinf(approach):
        return whole
    near = gap <= MARGIN * approach
    ends = []
    for axis, count in enumerate(gap.shape):
        found = np.flatnonzero(near.any(axis=1 - axis))
        if not found.size:
            return whole
        ends.append(slice(max(int(found[0]) - RIM, 0), min(int(found[-1]) + 1 + RIM, count)))
    inside = np.zeros(gap.shape, bool)
    inside[ends[0], ends[1]] = True
    if inside.mean() > LARGEST_PART:
        return whole
    return Domain(ends[0], ends[1], whole.shape, sides, float(gap[~inside].min()), kernel)


def enlarged_indenter(height: xr.DataArray, times: int) -> xr.DataArray | None:
    """Return an indenter on a grid that is 1.5 times as large, so many times; None if no recipe gives it."""
    for _ in range(times):
        larger = grown(height, GROWTH)
        if larger is None or larger.size > MOST_CELLS:
            return None
        height = larger
    return height


def estimated(height: xr.DataArray, kernel: Kernel, compliance: float, program: Program) -> tuple[float, bool]:
    """Return the largest approach of a program [m], and whether contact reaches the border then.

    Parameters
    ----------
    height : DataArray, dims (x, y)
        The surface. [m]
    kernel : Kernel
        Of the body.
    compliance : float
        Contact compliance after all of the program. [1/Pa]
    program : Program
        Loads and approaches.

    Notes
    -----
    Infinite for a load that is found in the run and held.
    """
    stride = math.ceil(max(height.shape) / ESTIMATED_ON)
    gap = highest(height) - height.values[::stride, ::stride]
    present = np.isfinite(gap)
    if not present.any():
        return math.inf, False
    least, gap = float(gap[present].min()), np.where(present, gap, 0.0)
    sides = tuple(stride * side for side in spacing(height, "height"))
    grid = Grid((gap.shape[0], gap.shape[1]), (sides[0], sides[1]), "free", kernel=kernel)
    given = [program.gives(number) for number in range(len(program.segments))]
    if not all(ok or one.control == "approach" for ok, one in zip(given, program.segments, strict=True)):
        return math.inf, False
    approaches = [
        (one.end or 0.0) + abs(one.amplitude) for one in program.segments if one.control == "approach" and one.end
    ]
    approach, at_border = max(approaches, default=0.0), False
    pushes = [{"approach": approach}] if approach > least else []
    if program.largest_load * compliance > 0:
        pushes.append({"load": program.largest_load * compliance / grid.cell_area})
    for push in pushes:
        try:
            found = solve_contact(grid, gap, tolerance=ESTIMATE_TOLERANCE, present=present, **push)
        except ConvergenceError:
            return math.inf, False
        approach = max(approach, found.approach)
        touches = found.pressure > 0
        at_border = at_border or any(bool(touches[i].any() or touches[:, i].any()) for i in (0, -1))
    return approach, at_border
