"""Steps with adhesion: the state that the present gap relaxes into, its energy, and the path of an elastic body.

The contact has several states at one approach. The state depends on the path, so that an elastic body takes steps of
half a range and follows its branch until the branch ends. A jump to another branch is dissipation. The step of the jump
is short, so that the energies before and after it are known.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.mechanics.contact.adhesive import PulledOff, solve_adhesive
from roughvisc.mechanics.memory import Prediction
from roughvisc.mechanics.program import Segment
from roughvisc.mechanics.scene import Array, Point, Scene
from roughvisc.units import format_quantity

#: Largest change of the approach of an elastic body in a step, in ranges, and part of a segment of loads in a step.
PATH = 0.5
PART_OF_LOAD = 0.02
#: Length of the step of a jump, as a part of a usual step.
JUMP = 1 / 512
#: Growth of the steps of an elastic body after a step without a refusal, and after a jump.
GROWTH = 4.0
#: Tolerance of the contact solver over the one of other contacts. At 1, the noise of the solver doubles the number of
#: time steps of a viscoelastic body.
SHARPER = 0.5
#: Work of a step that no energy stores, over its size, from which the step contains a jump.
MISSED = 0.25
#: Number of loads that are tried for the largest tension of a contact.
TRIED = 12


def step_with_adhesion(
    scene: Scene,
    here: Point,
    time: float,
    value: float,
    prediction: Prediction,
    gap: Array,
    guess: Array,
    previous: Any,
    tolerance: float,
    *,
    by_load: bool,
    may_refuse: bool = False,
) -> Point:
    """Return the point a step ahead: the state into which the present gap relaxes.

    Parameters
    ----------
    scene, here : Scene, Point
        Input of the time stepping, and start of the step.
    time : float
        End of the step. [s]
    value : float
        Load or approach at the end. [N or m]
    prediction : Prediction
        Compliance of the step, and displacement that earlier pressure leaves.
    gap : array, shape (nx, ny)
        Gap without pressure in the step, at zero approach. [m]
    guess : array, shape (nx, ny)
        First guess of the pressure. [Pa]
    previous : tuple or None
        Attribute of the new point.
    tolerance : float
        Tolerance of the contact solver.
    by_load : bool
        Whether the load is given.
    may_refuse : bool
        Whether to refuse a step in which the contact may jump.

    Raises
    ------
    InputError
        If the contact does not carry a negative load.
    Unstable
        If `may_refuse`, and the contact may jump.
    ConvergenceError
        If the contact solver does not converge.
    """
    grid = scene.grid
    adhesion = scene.adhesion
    alpha = prediction.compliance
    assert adhesion is not None
    unit = grid.cell_area / alpha

    def solved(given: float) -> Any:
        return solve_adhesive(
            grid,
            gap,
            adhesion.work * alpha,
            adhesion.range,
            approach=here.approach if by_load else given,
            load=given / unit if by_load else None,
            tolerance=SHARPER * tolerance,
            start=alpha * guess,
            start_gap=here.gap,
            least_size=scene.least_force / unit,
            present=scene.present,
            stops_if_unstable=may_refuse,
        )

    try:
        state = solved(value)
    except PulledOff:
        carried = float(f"{largest_tension(solved, here.force, value):.3g}")
        least = f"at least {format_quantity(-carried, 'N')} at {time:.6g} s"
        expected = f"{least}, the largest tension that the contact carries, or a prescribed approach"
        raise InputError(key="load", found=value, expected=expected) from None
    except ConvergenceError as error:
        raise ConvergenceError(f"at {time:.6g} s {error}; try a looser tolerance or finer cells") from error
    pressure = state.pressure / alpha
    history = scene.memory.advance(here.history, prediction, state.displacement / alpha, pressure)
    force = value if by_load else state.load * unit
    approach = state.approach if by_load else value
    errors = state.error, state.error * abs(approach) if by_load else 0.0
    point = Point(time, pressure, force, approach, history, previous, here.segment_start, False, *errors)
    size = float(abs(pressure).sum()) * grid.cell_area
    return replace(point, gap=state.gap, integral=size, is_unstable=state.is_unstable)


def largest_tension(solved: Any, carried: float, refused: float) -> float:
    """Return the largest tension that a contact carries, to a few thousandths. [N]

    Parameters
    ----------
    solved : callable
        Solves the contact under a load. [N]
    carried, refused : float
        Loads that the contact carries, and does not carry. [N]
    """
    carried = min(carried, 0.0)
    for _ in range(TRIED):
        middle = (carried + refused) / 2
        try:
            solved(middle)
            carried = middle
        except PulledOff:
            refused = middle
    return -carried


def longest_step(scene: Scene, segment: Segment, start: float) -> float:
    """Return the longest step in which approach or load of an elastic body change little. [s]

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    segment : Segment
        Segment of the program.
    start : float
        Load or approach at the start of the segment. [N or m]
    """
    if segment.control == "load":
        return PART_OF_LOAD * min(segment.duration, segment.period)
    end = start if segment.end is None else segment.end
    change = abs(end - start) + 4 * abs(segment.amplitude) * segment.duration / segment.period
    assert scene.adhesion is not None
    return segment.duration * PATH * scene.adhesion.range / change if change > 0 else math.inf


def stored_energy(scene: Scene, point: Point) -> float:
    """Return the energy that the instantaneous compliance and the attraction store. [J]"""
    elastic = 0.5 * float((point.pressure * scene.memory.displacement(point.history, 0.0)[0]).sum())
    if scene.adhesion is None or point.gap is None:
        return elastic * scene.grid.cell_area
    bonds = float(scene.grid.xp.exp(-point.gap / scene.adhesion.range)[scene.solid].sum())
    return (elastic - scene.adhesion.work * bonds) * scene.grid.cell_area


def dissipated(scene: Scene, before: Point, after: Point) -> float:
    """Return the energy that a jump of an elastic body between two points dissipates; zero without a jump. [J]"""
    if after.time == before.time:
        return 0.0
    work = 0.5 * (before.force + after.force) * (after.approach - before.approach)
    size = 0.5 * (abs(before.force) + abs(after.force)) * abs(after.approach - before.approach)
    lost = work - (stored_energy(scene, after) - stored_energy(scene, before))
    return max(lost, 0.0) if after.is_unstable or lost > MISSED * size else 0.0
