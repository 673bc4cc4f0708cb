"""Rows of a loading: the times of the kept rows, and their stated errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.contact.solver import PERIMETER_CORRECTION
from roughvisc.mechanics.memory import SERIES_SHARE, Choice, choose_memory
from roughvisc.mechanics.program import Program, instant
from roughvisc.mechanics.stepping import SHORTEST_PAIR, Scene, Step
from roughvisc.settings import Settings

Array = NDArray[np.float64]
#: Times that differ by at most this many units in the last place are equal: rounding of sums and logarithms of times.
_ROUNDING = 64
#: Latest first kept time of a hold, as a part of the hold. [-]
_FIRST = 1e-3
#: Relative numbers of kept times of a ramp or a slide, a hold, and a period of a cycle.
_RAMP, _HOLD, _PERIOD = 2.0, 3.0, 16.0
#: Errors inherited from the contact solver in earlier steps: of the pressure, over the tolerance, and of the approach.
#: Measured on rows whose other errors are small.
INHERITED, INHERITED_APPROACH = 0.02, 0.005
#: Least stated error of the pressure of an elastic body, over the tolerance. Measured on the same rows.
LEAST = 0.015
#: Error of the work due to the contact solver, over its error of the pressure times the largest force and approach.
OF_WORK = 0.2
#: Error of the pressure at the edge of contact, over the mean error of the pressure.
SOLVER_AT_EDGE = 3.0


def kept_times(
    program: Program, times: int | Sequence[float] | None, *spacings: tuple[float, float]
) -> tuple[float, ...] | None:
    """Return the times to keep, ascending. [s]

    Times within rounding of a corner of the program are moved to the corner. Times in a slide are moved to the nearest
    time at which a whole number of cells has been slid.

    Parameters
    ----------
    program : Program
        The loading program.
    times : int, sequence of float or None
        Number of times, see :func:`spread_times`; or the times [s]; or None for every accepted step.
    *spacings : tuple of float
        Cell sides of each grid that slides. [m]

    Raises
    ------
    InputError
        If a time lies outside the program.
    """
    if times is None:
        return None
    corners, duration = np.array(program.corners), program.duration
    kept: list[float] = []
    for value in spread_times(program, times) if isinstance(times, int) else np.unique(np.asarray(times, dtype=float)):
        nearest = float(corners[np.argmin(np.abs(corners - value))])
        snapped = nearest if abs(nearest - value) <= _ROUNDING * math.ulp(nearest) else float(value)
        if not 0 <= snapped <= duration:
            raise InputError(f"times holds {value:g} s: expected times from 0 to the program's end at {duration:g} s")
        if not kept or snapped - kept[-1] > _ROUNDING * math.ulp(snapped):
            kept.append(snapped)
    if not (spacings and program.slides):
        return tuple(kept)
    found = np.array(kept)
    for segment, began, end in zip(program.segments, program.corners, program.corners[1:], strict=False):
        if segment.slide is not None:
            cells = math.gcd(*map(segment.slide.cells, spacings))
            for place in np.flatnonzero((found > began) & (found < end)):
                taken = round((found[place] - began) / (end - began) * cells)
                found[place] = instant(began, end, taken, cells)
    return tuple(np.unique(found).tolist())


def spread_times(program: Program, count: int) -> Array:
    """Return a number of times, spread over the program; they are denser where the result changes faster.

    Parameters
    ----------
    program : Program
        The loading program.
    count : int
        Number of times. If the program has more corners, an even selection of corners is kept, with the last one.

    Returns
    -------
    ndarray, shape (n,)
        Ascending; fewer than `count` if the program has no duration. [s]

    Notes
    -----
    All corners of the program are kept. The other times are distributed in the proportion of two per ramp or slide,
    three per hold and sixteen per period of a cycle. In a hold they are spaced evenly in the logarithm of the time
    since its start. This spacing begins at a third of the segment before or a thousandth of the hold, whichever is
    less. In other segments the times are spaced evenly.
    """
    corners = np.unique(program.corners)
    further = count - len(corners)
    if further <= 0:
        return corners[np.linspace(len(corners) - 1, 0, count).round().astype(int)[::-1]]
    weights = np.zeros(len(program.segments))
    for number, segment in enumerate(program.segments):
        if segment.duration > 0:
            periods = segment.duration / segment.period if segment.amplitude else 0.0
            weights[number] = _PERIOD * periods if periods else _HOLD if segment.holds else _RAMP
    if not weights.any():
        return corners
    exact = weights * further / weights.sum()
    numbers = np.floor(exact).astype(int)
    largest_remainders = np.argsort(numbers - exact, kind="stable")[: further - int(numbers.sum())]
    numbers[largest_remainders] += 1

    found, before = [corners], math.inf
    for began, segment, number in zip(program.corners, program.segments, numbers, strict=False):
        if segment.duration > 0:
            parts = np.arange(1, number + 1) / (number + 1)
            if segment.holds and number:
                parts = min(_FIRST, before / (3 * segment.duration)) ** (1 - parts)
            found.append(began + parts * segment.duration)
            before = segment.duration
    return np.unique(np.concatenate(found))


def memory_of(body: Body, program: Program, settings: Settings, **options: Any) -> Choice:
    """Return the memory of a body for the kept rows of a program.

    Parameters
    ----------
    body, program, settings
        Body, program and settings of the case.
    **options
        Further arguments of :func:`~roughvisc.mechanics.memory.choose_memory`.

    Notes
    -----
    ``shortest`` is the shortest age above zero at which the compliance affects the kept rows; zero for a program of
    jumps alone. Let ``h`` be the shortest interval between a corner of the program and the next kept time. Only
    pressure applied in the last part ``f`` of the interval has an age below ``f h``. If the compliance is exact at age
    zero, its error at these ages is at most the creep, which is less than ``f C(h)`` over the interval. With ``f`` a
    tenth of the tolerance this equals the error allowed at longer ages. No step is shorter than a millionth of a
    segment, so a smaller ``f`` is not needed.
    """
    shortest, kept = math.inf, kept_times(program, settings.times)
    for segment in program.segments:
        if segment.duration > 0:
            shortest = min(shortest, segment.duration, segment.period)
    if math.isinf(shortest):
        shortest = 0.0
    elif kept is None:
        shortest *= SHORTEST_PAIR
    else:
        corners, times = np.array(program.corners), np.array(kept)
        after = np.searchsorted(times, corners, side="right")
        corners, after = corners[after < times.size], after[after < times.size]
        shortest = min(shortest, float(np.min(times[after] - corners, initial=math.inf)))
        shortest *= max(SERIES_SHARE * settings.tolerance, SHORTEST_PAIR)
    return choose_memory(body, program.duration, settings.tolerance, shortest, **options)


def length_of(step: Step, scene: Scene) -> float:
    """Return the length of a step; zero for a jump. [s]"""
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
        ``time_error`` of the time steps alone [-], ``stated_error`` [-], ``residual`` [-], ``approach_error`` [m],
        ``work_error`` [J].

    Notes
    -----
    The stated error is the sum of the errors of the time steps, of the contact solver in this and earlier steps, and
    of the series. Under a given load the solver's error of the approach is the duality gap over the load, which is of
    second order in the error of the pressure. The errors of the series and of the work are relative to the largest
    values of all steps: values left after unloading are differences of large values. Errors of the work add up.
    """
    point, state, apart = step.point, step.state, step.difference
    control = scene.program.segments[step.segment].control
    given, remembers = scene.program.gives(step.segment), not scene.memory.is_elastic
    largest_force, largest_approach = largest
    loaded, reached = max(state.largest_force, point.force), max(state.largest_approach, abs(point.approach))
    of_force = series_error * loaded
    unit = scene.tolerance if largest_force > 0 else 0.0
    solved = point.solver_error + INHERITED * unit if remembers else max(point.solver_error, LEAST * unit)
    work = scene.stated[0] * abs(state.work_apart) + state.work_curved
    work += (OF_WORK * solved + series_error) * loaded * reached
    force = approach = 0.0
    if control == "approach" or not given:
        force = apart.force + solved * point.force + of_force
    if control == "load" or not given:
        approach = apart.approach + point.solver_error_approach + series_error * reached
        approach += INHERITED_APPROACH * unit * reached if remembers else 0.0
    pressure = (apart.pressure + solved * point.force + of_force) / largest_force if largest_force > 0 else solved
    per_force, per_approach = largest_force or math.inf, largest_approach or math.inf
    return {
        "time_error": max(apart.pressure / per_force, apart.force / per_force, apart.approach / per_approach),
        "stated_error": max(pressure, force / per_force, approach / per_approach),
        "residual": point.solver_error,
        "approach_error": approach,
        "work_error": work,
    }


def area_error(step: Step, scene: Scene, pressure: Any, gap: Any, counted: float, area: float) -> float:
    """Return the error of the contact area due to time steps and contact solver. [m2]

    The solver may misjudge a contact cell if its pressure is below the error of the pressure at the edge. It may
    misjudge an open cell if this pressure would close the gap of the cell.

    Parameters
    ----------
    step, scene : Step, Scene
        An accepted step.
    pressure, gap : array, shape (nx, ny)
        Pressure [Pa] and gap between the surfaces. [m]
    counted, area : float
        Contact area, counted and corrected for the grid. [m2]
    """
    point, apart, xp = step.point, step.difference, scene.grid.xp
    inside, outside = apart.inside, apart.outside
    if counted > 0 and point.solver_error > 0:
        off = SOLVER_AT_EDGE * point.solver_error * point.force / counted
        closed = off * scene.grid.self_influence * scene.memory.compliance(length_of(step, scene))
        closing = (pressure == 0) & (gap <= closed)
        if scene.present is not None:
            closing &= scene.present
        opening = (pressure > 0) & (pressure <= off)
        inside += scene.grid.cell_area * int(xp.count_nonzero(opening))
        outside += scene.grid.cell_area * int(xp.count_nonzero(closing))
    # A cell that enters or leaves the contact changes the count by one cell and the staircase by at most its four
    # faces. Its area exceeds the correction for its faces: the area grows with each cell, and never exceeds the count.
    most = 1 + 4 * PERIMETER_CORRECTION
    lower, upper = max(area - most * inside, 0.0), min(area + most * outside, counted + outside)
    return float(max(area - lower, upper - area))
