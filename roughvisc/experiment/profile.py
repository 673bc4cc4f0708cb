"""The surface of a run as plain arrays, and its domain: the part on which the contact is solved.

In free space the surface outside the contact has no influence. An elastic estimate with the final compliance and the
largest load gives the largest contact and approach. A run uses the rectangle around the contact of a sphere or cone. On
other surfaces it uses the rectangle around all cells whose undeformed gap is smaller than the approach: no other cell
can touch. The surface of an indenter is enlarged if the estimated contact reaches its border. A run whose contact
outgrows its domain restarts on a larger domain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.experiment.problem import Problem
from roughvisc.mechanics.body import HALF_SPACE, Kernel
from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.program import Program
from roughvisc.settings import Missing, Settings, attraction
from roughvisc.topography.grid import spacing
from roughvisc.topography.recipes import grown, indenter_of

Array = NDArray[np.float64]
#: Number of cells along the longer side of the grid of the estimate, and tolerance of the estimate.
ESTIMATED_ON = 64
ESTIMATE_TOLERANCE = 1e-2
#: Factors of the estimated approach and of the approach of a run: the undeformed gap outside the domain must be larger,
#: because the estimate and the end of a step have errors.
MARGIN = 1.2
BEYOND = 1.05
#: Cells around the domain.
RIM = 1
#: Least number of cells along the shorter side for which a smaller domain saves time, and its largest part of the
#: cells.
WORTH_CROPPING = 48
LARGEST_PART = 0.8
#: Factor by which the surface of an indenter grows. After contact has outgrown its domain, also the factor on the
#: estimated approach, or on the size of an indenter's contact, for the next domain.
GROWTH = 1.5


class Profile:
    """Labelled surface of a solve, and the arrays that the mechanics needs.

    Parameters
    ----------
    height : xarray.DataArray
        Profile, peaks up, as :func:`roughvisc.topography.grid.checked` returns it. [m]
    missing : {"refuse", "absent"}
        Meaning of missing heights: an error, or absent material.
    kernel : Kernel
        Kernel of the body under it.

    Attributes
    ----------
    present : ndarray of bool, shape (nx, ny)
        Cells with material.
    highest : float
        Height of first contact: the apex of an indenter, also between cells, or the highest cell. The apex counts if
        the recipe reproduces the heights and the apex lies within the outline of the cells. [m]
    gap : ndarray, shape (nx, ny)
        Undeformed gap at first touch, zero at absent cells. [m]
    is_indenter : bool
        Whether the recipe of a sphere, cone or flat punch reproduces the heights.
    least_gap, mean_gap : float
        Least gap, which is positive if the highest point lies between the cells, and mean gap of the present cells. [m]
    spacing : tuple of float
        Cell sides. [m]
    area : float
        Area of all cells, absent ones included. [m2]

    Raises
    ------
    InputError
        If heights are infinite, all missing, or missing without a stated meaning in the settings or the surface.
    """

    def __init__(self, height: xr.DataArray, missing: Missing = Settings.missing, kernel: Kernel = HALF_SPACE) -> None:
        values = height.values
        if np.isinf(values).any():
            raise InputError("height holds infinite values: expected finite heights, or NaN where missing")
        self.present: NDArray[np.bool_] = np.isfinite(values)
        if not self.present.any():
            raise InputError("height is missing everywhere: expected at least one finite height")
        self.all_present = bool(self.present.all())
        if not self.all_present and "absent" not in (missing, height.attrs.get("missing")):
            row, column = np.argwhere(~self.present)[0]
            raise InputError(
                f"height is missing at {np.count_nonzero(~self.present)} of {values.size} points, the first at cell "
                f"({row}, {column}): fill it (fill = true in a study, rv.fill in Python), or say missing='absent' "
                "if there is no material"
            )
        self.height = height
        self.kernel = kernel
        self.highest = float(np.nanmax(values))
        indenter = indenter_of(height)
        self.is_indenter = indenter is not None
        if indenter is not None:
            sides = np.array(indenter[1])
            apex = np.array(indenter[2])
            x = height["x"].values
            y = height["y"].values
            first = np.array([x[0], y[0]]) - sides / 2
            last = np.array([x[-1], y[-1]]) + sides / 2
            if (first <= apex).all() and (apex <= last).all():
                self.highest = 0.0
        self.gap = self.highest - values
        self.least_gap = float(np.nanmin(self.gap))
        self.gap[~self.present] = 0.0
        self.mean_gap = float(np.sum(self.gap)) / np.count_nonzero(self.present)
        self.spacing = spacing(height, "height")
        self.area = math.prod(self.spacing) * values.size


@dataclass(frozen=True)
class Estimate:
    """Estimated largest contact of a program.

    Attributes
    ----------
    approach : float
        Largest approach; infinite if the program holds a load that it does not state. [m]
    cells : ndarray of int, shape (2, 2), or None
        First and last cell of the contact along x and y; None without contact.
    at_border : bool
        Whether contact reaches the border of the surface.
    """

    approach: float = math.inf
    cells: NDArray[np.int_] | None = None
    at_border: bool = False


@dataclass(frozen=True)
class Domain:
    """Rectangle of a surface on which the contact is solved.

    Attributes
    ----------
    cells : tuple of slice
        Cells of the rectangle along x and y.
    shape : tuple of int
        Numbers of cells of the whole surface.
    spacing : tuple of float
        Cell sides. [m]
    outside : float
        Least undeformed gap outside the rectangle; infinite if contact would first reach the border of the rectangle.
        [m]
    kernel : Kernel
        Kernel of the body.
    is_whole : bool
        Whether the rectangle is the whole surface.
    """

    cells: tuple[slice, slice]
    shape: tuple[int, int]
    spacing: tuple[float, float]
    outside: float
    kernel: Kernel
    is_whole: bool = True

    def displacement(self, effective: Array) -> Array:
        """Return the displacement of the whole surface under an effective pressure [-] on the rectangle. [m]"""
        whole = np.zeros(self.shape)
        whole[self.cells] = effective
        return self._whole.displacement(whole)

    @cached_property
    def _whole(self) -> Grid:
        return Grid(self.shape, self.spacing, "free", kernel=self.kernel)

    @cached_property
    def mean_influence(self) -> Array:
        """Mean displacement of the whole surface under unit pressure on each cell: the kernel is symmetric. [m]"""
        return self._whole.displacement(np.full(self.shape, 1 / math.prod(self.shape)))[self.cells]


def choose_surface(
    profile: Profile, problem: Problem, program: Program, enlarged: int | None = None, outgrown: int = 0
) -> tuple[Profile, Domain, int, bool]:
    """Return the surface of a run, enlarged if necessary, and its domain.

    Parameters
    ----------
    profile : Profile
        The given surface.
    problem : Problem
        Surface, body and settings.
    program : Program
        Loads and approaches, no nominal pressures.
    enlarged : int, optional
        Number of times to enlarge the surface. Default: as often as the estimate requires.
    outgrown : int
        Number of times that contact has outgrown the domain.

    Returns
    -------
    profile : Profile
        The surface; an indenter is enlarged until the expected contact does not reach its border.
    domain : Domain
        Part of the surface on which the contact is solved. It is the whole surface unless space and time separate in
        the body and a load never raises the surface next to it.
    enlarged : int
        Number of times that the surface was enlarged.
    reaches_border : bool
        Whether contact is expected at the border of a free surface.
    """
    body = problem.body
    settings = problem.settings
    estimate = Estimate()
    times = enlarged or 0
    can_adapt = not body.kernel.raises_surface or profile.is_indenter
    if settings.boundary == "free" and settings.edge == "error" and can_adapt:
        compliance = float(body.material.contact_compliance(program.duration))
        for _ in range(times):
            larger = grown(profile.height, GROWTH)
            assert larger is not None, "the surface of an indenter was enlarged before"
            profile = Profile(larger, settings.missing, body.kernel)
        estimate = estimated(profile, compliance, program)
        while enlarged is None and estimate.at_border and (larger := grown(profile.height, GROWTH)) is not None:
            profile = Profile(larger, settings.missing, body.kernel)
            times = times + 1
            estimate = estimated(profile, compliance, program)
    shape = profile.gap.shape[0], profile.gap.shape[1]
    domain = Domain((slice(None), slice(None)), shape, profile.spacing, math.inf, profile.kernel)
    can_crop = not body.kernel.raises_surface and profile.all_present and min(shape) >= WORTH_CROPPING
    can_crop = can_crop and attraction(settings) is None  # tension raises the surface, and acts outside the contact
    if can_crop and math.isfinite(estimate.approach):
        domain = cropped(domain, profile, estimate, GROWTH**outgrown)
    return profile, domain, times, estimate.at_border


def cropped(whole: Domain, profile: Profile, estimate: Estimate, growth: float) -> Domain:
    """Return the part of a surface that may touch during a run, or the whole surface if this part is large.

    Parameters
    ----------
    whole : Domain
        The whole surface.
    profile : Profile
        The surface.
    estimate : Estimate
        Estimated contact.
    growth : float
        Factor of the approach, or of the size of the contact of an indenter.
    """
    gap = profile.gap
    shape = whole.shape
    outside = math.inf
    wider = 0
    corners = estimate.cells
    is_connected = corners is not None and profile.is_indenter
    if corners is None or not is_connected:
        corners = np.argwhere(gap <= MARGIN * growth * estimate.approach)
    if not corners.size:
        return whole
    first = corners.min(axis=0)
    last = corners.max(axis=0)
    if is_connected:
        wider = np.ceil((growth - 1) / 2 * (last - first)).astype(int)
    first = np.maximum(first - wider - RIM, 0)
    last = np.minimum(last + wider + RIM + 1, shape)
    cells = slice(int(first[0]), int(last[0])), slice(int(first[1]), int(last[1]))
    inside = np.zeros(shape, bool)
    inside[cells] = True
    if inside.mean() > LARGEST_PART:
        return whole
    if not is_connected:
        outside = float(gap[~inside].min())
    return replace(whole, cells=cells, outside=outside, is_whole=False)


def estimated(profile: Profile, compliance: float, program: Program) -> Estimate:
    """Return the estimated largest contact of a program.

    Parameters
    ----------
    profile : Profile
        The surface.
    compliance : float
        Contact compliance at the end of the program. [1/Pa]
    program : Program
        Loads and approaches.
    """
    stride = math.ceil(max(profile.gap.shape) / ESTIMATED_ON)
    gap = profile.gap[::stride, ::stride]
    present = profile.present[::stride, ::stride]
    if not present.any():
        return Estimate()
    least = float(gap[present].min())
    dx, dy = profile.spacing
    grid = Grid((gap.shape[0], gap.shape[1]), (stride * dx, stride * dy), "free", kernel=profile.kernel)
    approach = 0.0
    touches = np.zeros(gap.shape, bool)
    for number, segment in enumerate(program.segments):
        if segment.control == "approach":
            approach = max(approach, segment.end + abs(segment.amplitude) if segment.end else 0.0)
        elif not program.prescribes[number]:
            return Estimate()
    pushes: list[dict[str, Any]] = [{"approach": approach}] if approach > least else []
    if program.largest_load * compliance > 0:
        pushes.append({"load": program.largest_load * compliance / grid.cell_area})
    for push in pushes:
        try:
            contact = solve_contact(
                grid, np.ascontiguousarray(gap), tolerance=ESTIMATE_TOLERANCE, present=present, **push
            )
        except ConvergenceError:
            return Estimate()
        approach = max(approach, contact.approach)
        touches |= contact.pressure > 0
    if not touches.any():
        return Estimate(approach)
    places = np.argwhere(touches)
    first = places.min(axis=0)
    last = places.max(axis=0)
    at_border = bool((first == 0).any() or (last == np.array(gap.shape) - 1).any())
    return Estimate(approach, stride * np.array([first - 1, last + 1]), at_border)
