"""Columns of a row that follow from a step: area and friction, and how far off these and all others may be."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.arrays import over_rows
from roughvisc.mechanics.contact.neighbours import area_bounds, staircase
from roughvisc.mechanics.stepping.program import Slid
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.mechanics.stepping.state import Step
from roughvisc.mechanics.stepping.step import segment_number
from roughvisc.mechanics.stepping.tangential import force_across, tangential_force

#: What the contact solver's errors of the past leave of a pressure, in units of the tolerance, and of an approach:
#: measured on rows whose other errors are small (workflows/benchmarks/accuracy.py).
_INHERITED, _INHERITED_APPROACH = 0.02, 0.005
#: The least that is stated of a pressure without a past, in units of the tolerance: measured there too.
_LEAST = 0.015
#: Part of the contact solver's error that is left in an energy, a sum over steps in which it has either sign: measured
#: there too.
_SUMMED = 0.5
#: A row that states more than so many tolerances is none where every step is kept and the row is not asked for.
_AT_MOST = 3.0
#: Error of a pressure at the edge of contact, over the mean one.
_SOLVER_AT_EDGE = 3.0


def staircase_area(contact: NDArray[np.bool_], scene: Scene) -> float:
    """Area by which counting cells is too large: a part of the perimeter's strip. [m2]

    The perimeter is where contact ends although the material goes on. Where the material itself ends, at an absent
    cell or at the border of a scan in free space, the edge of the contact is known, and the count exact. Under the
    mirror boundary a cell's neighbour beyond the border is its own image, so there is no edge either.
    """
    free = ~contact if scene.present is None else scene.present & ~contact
    goes_on = scene.outside < math.inf  # beyond the window, where nothing touches
    periodic = scene.operator.boundary == "periodic"
    return staircase(contact, free, scene.operator.cell_area, periodic, before=goes_on, beyond=goes_on)


def uncertain_cells(step: Step, contact: NDArray[np.bool_]) -> tuple[float, float]:
    """Area in contact and area out of it that the contact solver's error may put on the other side. [m2]

    Cells whose pressure is below the error of the mean one, and cells whose gap such a pressure in them would close.
    """
    shown, scene = step.shown, step.scene
    if not contact.any() or not step.solver_error > 0:
        return 0.0, 0.0
    since = step.state.began if step.state.before is None else step.state.before.time
    threads, area = scene.operator.threads, scene.operator.cell_area
    mean = shown.contact.total() / np.count_nonzero(contact)
    pressure = _SOLVER_AT_EDGE * step.solver_error * mean
    closed = pressure * scene.operator.self_influence * scene.compliance(step.state.now.time - since)

    def counted(rows: slice) -> tuple[int, int]:
        here = contact[rows]
        inside = here & (step.on_rows(shown.contact, rows) <= pressure)
        outside = ~here & (scene.gap[rows] + step.on_rows(step.displaced, rows) - step.level <= closed)
        if scene.present is not None:
            outside &= scene.present[rows]
        return int(np.count_nonzero(inside)), int(np.count_nonzero(outside))

    found = over_rows(counted, contact.shape, threads)
    return area * sum(inside for inside, _ in found), area * sum(outside for _, outside in found)


def area_columns(step: Step, contact: NDArray[np.bool_], counted: float, area: float) -> dict[str, float]:
    """Error of the contact area of a step, by the cells that time steps and contact solver leave in doubt. [m2]

    Parameters
    ----------
    step : Step
        An accepted step.
    contact : ndarray of bool
        Cells in contact.
    counted, area : float
        Contact area, counted and corrected for the grid. [m2]
    """
    in_doubt, unknown = uncertain_cells(step, contact), step.uncertainty
    lower, upper = area_bounds(counted, area, unknown.inside + in_doubt[0], unknown.outside + in_doubt[1])
    return {"contact_area_error": float(max(area - lower, upper - area))}


def friction_columns(step: Step) -> dict[str, float]:
    """Distance and forces of an accepted step; empty for a program without slides."""
    scene, state = step.scene, step.state
    if not scene.motions:
        return {}
    slide, slid = scene.motions[segment_number(state)], state.slid or Slid()
    pressure, force = step.shown.pressure, step.shown.force
    friction = tangential_force(scene.operator, pressure, step.displacement, slide)
    return {
        "sliding_distance": slid.distance,
        "friction_force": friction,
        "friction_coefficient": friction / force if force > 0 else math.nan,
        "friction_force_across": force_across(scene.operator, pressure, step.displacement, slide),
        "friction_force_error": step.uncertainty.friction,
    }


def error_columns(step: Step, series_error: float, largest: tuple[float, float] | None = None) -> dict[str, float]:
    """What is stated of the accuracy of a step.

    Parameters
    ----------
    step : Step
        An accepted step.
    series_error : float
        Relative error of the series that stands for the material.
    largest : tuple of float, optional
        Largest force [N] and approach [m] of the kept rows so far, to which the errors are relative. Default: of all
        steps so far.

    Notes
    -----
    The errors of time steps, contact solver, now and before, and series add up. The solver's error of the approach
    under a given load is of second order in that of the pressure: the duality gap over the load. The series' error is
    one of the largest values of all steps: what is left after unloading is a difference of such values.
    """
    state, unknown, shown = step.state, step.uncertainty, step.shown
    largest_force, largest_approach = largest or (state.largest_force, state.largest_approach)
    of_force, of_approach = series_error * state.largest_force, series_error * state.largest_approach
    is_viscoelastic, unit = step.scene.is_viscoelastic, step.scene.tolerance if largest_force > 0 else 0.0
    solved = _solver_error(step, largest_force)
    force = approach = 0.0
    if step.control == "approach" or not step.given:
        force = unknown.force + solved * shown.force + of_force
    if step.control == "load" or not step.given:
        approach = unknown.approach + step.solver_error_approach + of_approach
        approach += _INHERITED_APPROACH * unit * state.largest_approach if is_viscoelastic else 0.0
    pressure = solved
    if largest_force > 0:
        pressure = (unknown.pressure + solved * shown.force + of_force) / largest_force
    relative = max(
        pressure,
        force / largest_force if largest_force > 0 else 0.0,
        approach / largest_approach if largest_approach > 0 else 0.0,
    )
    return {
        "stated_error": relative,
        "residual": step.solver_error,
        "force_error": force,
        "approach_error": approach,
    }


def _solver_error(step: Step, largest_force: float) -> float:
    """Relative error of the pressure by the contact solver, in this step and in those before."""
    unit = step.scene.tolerance if largest_force > 0 else 0.0
    if step.scene.is_viscoelastic:
        return step.solver_error + _INHERITED * unit
    return max(step.solver_error, _LEAST * unit)


def meets_tolerance(step: Step, series_error: float, largest: tuple[float, float] | None = None) -> bool:
    """Whether an accepted step is worth a row where every step is kept: what is promised of it is within the tolerance.

    Where hardly any compliance is there at once, pressure jumps in each cell that enters. Only the approach is
    promised there to the tolerance, and the rest to :data:`_AT_MOST` of it. The short steps that lead over such a jump
    are no rows; nor, under given approach, are those in which a cell has entered, since the force jumps with it.
    """
    scene, state = step.scene, step.state
    if scene.time_step is not None or in_slide(step):  # the steps are as long as they are
        return True
    found = error_columns(step, series_error, largest)
    most = _AT_MOST * scene.tolerance
    solved = _solver_error(step, largest[0] if largest else state.largest_force)
    work_error = step.uncertainty.work + (_SUMMED * solved + series_error) * abs(step.work)
    if found["stated_error"] > most or work_error > most * state.largest_work:
        return False
    if not scene.is_soft:
        return not found["stated_error"] > scene.tolerance
    now, before = state.now, state.before
    if before is not None and now.time - before.time < scene.tolerance * (now.time - state.began):
        return False
    if before is not None and step.control == "approach" and np.any(now.pressure[before.pressure == 0] > 0):
        return False
    return not found["approach_error"] > scene.tolerance * (largest or (0.0, state.largest_approach))[1]


def in_slide(step: Step) -> bool:
    """Whether an accepted step is one of a slide."""
    scene = step.scene
    return bool(scene.motions) and scene.program.segments[segment_number(step.state)].slide is not None


def is_end_value(step: Step) -> bool:
    """Whether pressure and force of an accepted step are those at its end.

    Where hardly any compliance is there at once they belong to the whole step, unless it is kept: what is given, the
    load or the approach, is right all the same.
    """
    state = step.state
    since = state.began if state.before is None else state.before.time
    return step.control == "load" or not step.scene.lacks_instantaneous_compliance(state.now.time - since)
