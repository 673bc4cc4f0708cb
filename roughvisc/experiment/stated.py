"""Stated errors of a step: of pressure, force, approach and contact area."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.contact.neighbours import area_bounds
from roughvisc.mechanics.stepping import Scene, Step

Array = NDArray[np.float64]

#: Errors that former steps of the contact solver leave: of a pressure, over the tolerance, and of an approach. Measured
#: on rows whose other errors are small.
INHERITED, INHERITED_APPROACH = 0.02, 0.005
#: Least stated error of a pressure without a past, over the tolerance. Measured there too.
LEAST = 0.015
#: Error of a pressure at the edge of contact, over the mean one.
SOLVER_AT_EDGE = 3.0


def length_of(step: Step, scene: Scene) -> float:
    """Return the length of a step, zero of a jump. [s]"""
    point = step.point
    return max(point.time - (point.before[0] if point.before else scene.program.corners[step.segment]), 0.0)


def error_columns(step: Step, scene: Scene, series_error: float, largest: tuple[float, float]) -> dict[str, float]:
    """Return the stated errors of a step.

    Parameters
    ----------
    step, scene : Step, Scene
        An accepted step.
    series_error : float
        Relative error of the series that represents the material.
    largest : tuple of float
        Largest force [N] and approach [m] of the kept rows so far, to which errors are relative.

    Returns
    -------
    dict
        ``time_error``, of the time steps alone, ``stated_error`` and ``residual``, relative; ``approach_error`` [m].

    Notes
    -----
    The errors of time steps, contact solver, now and before, and series add up. The solver's error of the approach
    under a given load is of second order in that of the pressure: the duality gap over the load. The series' error is
    one of the largest values of all steps: what is left after unloading is a difference of such values.
    """
    point, apart, control = step.point, step.difference, scene.program.segments[step.segment].control
    given, remembers = scene.program.gives(step.segment), not scene.memory.is_elastic
    largest_force, largest_approach = largest
    of_force = series_error * max(step.state.largest_force, point.force)
    reached = max(step.state.largest_approach, abs(point.approach))
    of_approach = series_error * reached
    unit = scene.tolerance if largest_force > 0 else 0.0
    solved = point.solver_error + INHERITED * unit if remembers else max(point.solver_error, LEAST * unit)
    time_error, pressure, force, approach = 0.0, solved, 0.0, 0.0
    if control == "approach" or not given:
        force = apart.force + solved * point.force + of_force
    if control == "load" or not given:
        approach = apart.approach + point.solver_error_approach + of_approach
        approach += INHERITED_APPROACH * unit * reached if remembers else 0.0
    relative = 0.0
    if largest_force > 0:
        time_error = max(apart.pressure, apart.force) / largest_force
        pressure = (apart.pressure + solved * point.force + of_force) / largest_force
        relative = force / largest_force
    if largest_approach > 0:
        time_error = max(time_error, apart.approach / largest_approach)
        relative = max(relative, approach / largest_approach)
    return {
        "time_error": time_error,
        "stated_error": max(pressure, relative),
        "residual": point.solver_error,
        "approach_error": approach,
    }


def area_error(step: Step, scene: Scene, gap: Array, counted: float, area: float) -> float:
    """Return the error of the contact area, by the cells that time steps and contact solver leave uncertain. [m2]

    The solver's error may put a cell on the other side if its pressure is below the error of the mean one, or if such a
    pressure in it would close its gap.

    Parameters
    ----------
    step, scene : Step, Scene
        An accepted step.
    gap : ndarray, shape (nx, ny)
        Gap between the surfaces. [m]
    counted, area : float
        Contact area, counted and corrected for the grid. [m2]
    """
    point, apart, contact = step.point, step.difference, step.point.pressure > 0
    inside, outside = apart.inside, apart.outside
    if contact.any() and point.solver_error > 0:
        pressure = SOLVER_AT_EDGE * point.solver_error * float(point.pressure[contact].mean())
        closed = pressure * scene.grid.self_influence * scene.memory.compliance(length_of(step, scene))
        closing = ~contact & (gap <= closed)
        if scene.present is not None:
            closing &= scene.present
        opening = contact & (point.pressure <= pressure)
        inside += scene.grid.cell_area * float(np.count_nonzero(opening))
        outside += scene.grid.cell_area * float(np.count_nonzero(closing))
    lower, upper = area_bounds(counted, area, inside, outside)
    return float(max(area - lower, upper - area))


def meets_tolerance(step: Step, scene: Scene, stated: float) -> bool:
    """Return whether a step is a row if every step is kept: one that states at most the tolerance.

    Steps of a given length, and those of a slide, are all rows: no others can be had.
    """
    is_given = scene.time_step is not None or scene.program.segments[step.segment].slide is not None
    return is_given or stated <= scene.tolerance
