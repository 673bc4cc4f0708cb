"""Columns of a row that follow from a step: area and friction, and the errors of these and all others."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roughvisc.experiment.domain import Domain
from roughvisc.mechanics.contact.neighbours import area_bounds, staircase
from roughvisc.mechanics.stepping import Scene, Step
from roughvisc.mechanics.tangential import tangential_force

Array = NDArray[np.float64]

#: Errors that former steps of the contact solver leave: of a pressure, over the tolerance, and of an approach. Measured
#: on rows whose other errors are small.
INHERITED, INHERITED_APPROACH = 0.02, 0.005
#: Least stated error of a pressure without a past, over the tolerance. Measured there too.
LEAST = 0.015
#: If every step is a row, those that state more than so many tolerances are left out.
AT_MOST = 3.0
#: Error of a pressure at the edge of contact, over the mean one.
SOLVER_AT_EDGE = 3.0


class Fields(NamedTuple):
    """Fields of a step on the domain.

    Attributes
    ----------
    contact : ndarray of bool, shape (nx, ny)
        Cells in contact.
    displacement : ndarray, shape (nx, ny)
        Displacement of the body. [m]
    gap : ndarray, shape (nx, ny)
        Gap between the surfaces; zero in contact, any number at absent cells. [m]
    """

    contact: NDArray[np.bool_]
    displacement: Array
    gap: Array


def fields_of(step: Step, scene: Scene) -> Fields:
    """Return the fields of a step."""
    contact = step.point.pressure > 0
    displacement = scene.memory.present(step.point.history)[0]
    gap = np.maximum(scene.gap + displacement - step.point.approach, 0.0)
    gap[contact] = 0.0
    return Fields(contact, displacement, gap)


def staircase_area(contact: NDArray[np.bool_], scene: Scene, domain: Domain) -> float:
    """Return the area by which counting cells is too large: a part of the perimeter's strip. [m2]

    The perimeter is where contact ends although the material goes on. Where the material itself ends, at an absent
    cell or at the border of a scan in free space, the edge of the contact is known, and the count exact. Under the
    mirror boundary a cell's neighbour beyond the border is its own image, so there is no edge either.
    """
    free = ~contact if scene.present is None else scene.present & ~contact
    goes_on = not domain.is_whole
    periodic = scene.grid.boundary == "periodic"
    return staircase(contact, free, scene.grid.cell_area, periodic, before=goes_on, beyond=goes_on)


def uncertain_cells(step: Step, scene: Scene, fields: Fields) -> tuple[float, float]:
    """Return the area in contact and the area out of it that the contact solver's error may put on the other side. [m2]

    Cells whose pressure is below the error of the mean one, and cells whose gap such a pressure in them would close.
    """
    point, contact = step.point, fields.contact
    if not contact.any() or not point.solver_error > 0:
        return 0.0, 0.0
    pressure = SOLVER_AT_EDGE * point.solver_error * float(point.pressure[contact].mean())
    began = point.before[0] if point.before else scene.corners[step.segment]
    closed = pressure * scene.grid.self_influence * scene.compliance(max(point.time - began, 0.0))
    outside = ~contact & (fields.gap <= closed)
    if scene.present is not None:
        outside &= scene.present
    inside = contact & (point.pressure <= pressure)
    area = scene.grid.cell_area
    return area * float(np.count_nonzero(inside)), area * float(np.count_nonzero(outside))


def area_columns(step: Step, scene: Scene, fields: Fields, counted: float, area: float) -> dict[str, float]:
    """Return the error of the contact area, by the cells that time steps and contact solver leave uncertain. [m2]

    Parameters
    ----------
    step, scene, fields : Step, Scene, Fields
        An accepted step.
    counted, area : float
        Contact area, counted and corrected for the grid. [m2]
    """
    (inside, outside), apart = uncertain_cells(step, scene, fields), step.difference
    lower, upper = area_bounds(counted, area, apart.inside + inside, apart.outside + outside)
    return {"contact_area_error": float(max(area - lower, upper - area))}


def friction_columns(step: Step, scene: Scene, displacement: Array) -> dict[str, float]:
    """Return distance and forces of a step; empty for a program without slides."""
    if not scene.motions:
        return {}
    slide, point = scene.motions[step.segment], step.point
    friction = tangential_force(scene.grid, point.pressure, displacement, slide)
    return {
        "sliding_distance": step.distance,
        "friction_force": friction,
        "friction_coefficient": friction / point.force if point.force > 0 else math.nan,
        "friction_force_across": tangential_force(scene.grid, point.pressure, displacement, slide, across=True),
        "friction_force_error": step.difference.friction,
    }


def time_error(step: Step, largest: tuple[float, float]) -> float:
    """Return the relative error of the time steps.

    Parameters
    ----------
    step : Step
        An accepted step.
    largest : tuple of float
        Largest force [N] and approach [m] of the kept rows so far.
    """
    force, approach = largest
    apart = step.difference
    by_force = max(apart.pressure, apart.force) / force if force > 0 else 0.0
    return max(by_force, apart.approach / approach if approach > 0 else 0.0)


def error_columns(
    step: Step, scene: Scene, series_error: float, largest: tuple[float, float], of_all: tuple[float, float]
) -> dict[str, float]:
    """Return what is stated of the accuracy of a step.

    Parameters
    ----------
    step, scene : Step, Scene
        An accepted step.
    series_error : float
        Relative error of the series that represents the material.
    largest, of_all : tuple of float
        Largest force [N] and approach [m] so far: of the kept rows, to which errors are relative, and of all steps.

    Notes
    -----
    The errors of time steps, contact solver, now and before, and series add up. The solver's error of the approach
    under a given load is of second order in that of the pressure: the duality gap over the load. The series' error is
    one of the largest values of all steps: what is left after unloading is a difference of such values.
    """
    point, control = step.point, scene.program.segments[step.segment].control
    given = scene.program.gives(step.segment)
    largest_force, largest_approach = largest
    apart = step.difference
    of_force, of_approach = series_error * of_all[0], series_error * of_all[1]
    remembers = not scene.memory.is_elastic
    unit = scene.tolerance if largest_force > 0 else 0.0
    solved = _solver_error(step, scene, largest_force)
    force = approach = 0.0
    if control == "approach" or not given:
        force = apart.force + solved * point.force + of_force
    if control == "load" or not given:
        approach = apart.approach + point.solver_error_approach + of_approach
        approach += INHERITED_APPROACH * unit * of_all[1] if remembers else 0.0
    pressure = solved
    if largest_force > 0:
        pressure = (apart.pressure + solved * point.force + of_force) / largest_force
    relative = max(
        pressure,
        force / largest_force if largest_force > 0 else 0.0,
        approach / largest_approach if largest_approach > 0 else 0.0,
    )
    return {
        "stated_error": relative,
        "residual": point.solver_error,
        "approach_error": approach,
    }


def _solver_error(step: Step, scene: Scene, largest_force: float) -> float:
    """Return the relative error of the pressure by the contact solver, in this step and in those before."""
    unit = scene.tolerance if largest_force > 0 else 0.0
    if not scene.memory.is_elastic:
        return step.point.solver_error + INHERITED * unit
    return max(step.point.solver_error, LEAST * unit)


def meets_tolerance(step: Step, scene: Scene, stated: float) -> bool:
    """Return whether a step is a row if every step is kept: one that states about the tolerance, or less.

    With hardly any instantaneous compliance the pressure jumps in each cell that enters: only the approach meets the
    tolerance there, and :data:`AT_MOST` tolerances are allowed for the rest.
    """
    if scene.time_step is not None or scene.program.segments[step.segment].slide is not None:
        return True
    return stated <= (AT_MOST if scene.hardly_jumps else 1.0) * scene.tolerance
