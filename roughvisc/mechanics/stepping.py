"""Time stepping: contact under a program of load or approach, on a viscoelastic body, with a stated error.

:func:`march` proceeds by pairs of steps. The fine solution takes both steps. The coarse solution takes the pair as one
step, and continues from its own end: the difference of both solutions comes from the whole run so far. It gives the
stated error (:mod:`roughvisc.mechanics.stated_error`), and its change over the pair controls the length of the next
pair (:mod:`roughvisc.mechanics.step_control`). If an error from before the pair may cause this change, the coarse step
is repeated from the fine solution, and the difference then controls the length. A kept time inside a pair does not cut
it: the row there is one more step, from the point before it (:func:`row_inside`).

Errors are weighted by the part that relaxation leaves until the next kept time (:meth:`Memory.remaining`).

If little of the compliance of a pair is instantaneous, the pair is *soft*. The pressure then jumps in each cell that
enters the contact, and the pressure of an implicit step belongs to the step and not to its end. The displaced surface
controls the length of the pair too, and a short additional step gives the pressure of a listed kept time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.mechanics.adhesive_step import GROWTH, JUMP, dissipated, longest_step, step_with_adhesion
from roughvisc.mechanics.contact.adhesive import Unstable
from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.first_guess import Candidate, around_coarse, both_ends, combination, first_guess, last_two
from roughvisc.mechanics.memory import Rule
from roughvisc.mechanics.program import Segment, Slide, instant
from roughvisc.mechanics.scene import SOFT, Array, Packed, Point, Scene
from roughvisc.mechanics.stated_error import (
    LASTING,
    UNBOUNDED,
    StepErrors,
    error_of_late_entry,
    force_of_entered,
    friction,
    phase_error,
    shared_part,
    skipped_friction,
    skipped_pressure,
    stated_difference,
    stated_inside,
    touch,
    transient_error,
    with_former,
    work_of_pair,
    work_of_step,
)
from roughvisc.mechanics.step_control import (
    PAIRS_OF_A_CYCLE,
    ROUNDED,
    SHORTEST_PAIR,
    Controller,
    Largest,
    Pair,
    arises_before,
    errors_over_allowed,
    first_length,
    pair_ends,
    shortest_length,
)

#: A surface with at least this number of cells stores the pressure of its contact cells only, if they are less than
#: half of all cells.
PACKED_FROM = 1024**2
#: Tolerance of the contact solver over the tolerance of the run: usually, and in a slide. A step of a slow slide
#: changes the pressure little, and the friction force is a small part of the load.
SOLVER_PART = 0.2
SLIDING_PART = 0.06
#: Length of the additional step that gives the pressure at the end of a soft step, as a part of the soft step. Also
#: the tolerance of the contact solver in the soft step over the tolerance of the run: the additional step magnifies the
#: residual. Without: one row of five beyond the tolerance (`accuracy.py`); with 6e-4 no fewer (`step_constants.py`).
END_STEP = 1e-3


@dataclass(frozen=True)
class State:
    """State from which the time stepping can continue.

    The state of a step inside a pair is mostly that before the pair, see :class:`Step`.

    Attributes
    ----------
    fine : Point
        Solution with the shorter steps.
    coarse : Point or None
        Solution with steps twice as long, at the same instant; None while both solutions are equal.
    segment : int
        Index of the segment of the program.
    next_length : float
        Length of the next pair. [s] Zero if no pair leads to it: at the start, after a jump, a slide or a change of
        control (:attr:`Corner.is_smooth`), and while the surfaces are open. :func:`first_length` then chooses it.
    errors : StepErrors
        Stated error of the time steps.
    largest_force, largest_approach : float
        Largest values so far. [N, m]
    kept_force, kept_approach : float
        Largest values of the yielded steps at kept times so far, this one included (:func:`with_largest_kept`); of all
        yielded steps if no times are given. [N, m]
    solver_error : float
        Largest relative error of the pressure due to the contact solver so far.
    work : float
        Work of the normal force since the start. [J]
    work_difference : float
        Work of the coarse solution less the work of the fine one, both along straight paths. [J]
    work_curved : float
        Error of the quadrature of the work: root of the sum of the squares of all pairs. [J]
    work_relaxed : float
        Error of the work due to forces that relax within the first step after a corner: sum over all corners. [J]
    dissipated : float
        Energy that jumps of an elastic body with adhesion have dissipated so far. [J]
    peak : tuple of float
        Force, approach and time of the last step whose force exceeded what relaxation had left of the peak before it.
        [N, m, s]
    entered : tuple of float
        Force on the cells of a soft body that entered last, within the error of the gap, and the approach then. [N, m]
    distance : float
        Length of the path of the slides so far. [m]
    convolutions : int
        Number of convolutions so far, rejected pairs included.
    """

    fine: Point
    coarse: Point | None = None
    segment: int = 0
    next_length: float = 0.0
    errors: StepErrors = StepErrors()
    largest_force: float = 0.0
    largest_approach: float = 0.0
    kept_force: float = 0.0
    kept_approach: float = 0.0
    solver_error: float = 0.0
    work: float = 0.0
    work_difference: float = 0.0
    work_curved: float = 0.0
    work_relaxed: float = 0.0
    dissipated: float = 0.0
    peak: tuple[float, float, float] = (0.0, 0.0, 0.0)
    entered: tuple[float, float] = (0.0, 0.0)
    distance: float = 0.0
    convolutions: int = 0


class Step(NamedTuple):
    """Accepted step.

    Attributes
    ----------
    point : Point
        Fine solution, with the pressure at its time; a soft pair without a kept row has the pressures of whole steps.
    errors : StepErrors
        Error of the time steps.
    segment : int
        Index of the segment that the step belongs to.
    state : State
        State after the step, from which a march continues. In the middle of a pair it is the state before the pair,
        with the work and its errors, the path, the error of the solver, and the largest kept values of the step.
    is_end : bool
        Whether a march may continue from the state; False in the middle of a pair.
    """

    point: Point
    errors: StepErrors
    segment: int
    state: State
    is_end: bool = True


def march(scene: Scene, state: State | None = None) -> Iterator[Step]:
    """Press a surface through a program, step by step.

    Parameters
    ----------
    scene : Scene
        Input.
    state : State, optional
        State of an earlier step of the same scene, from which to continue. Default: rest.

    Yields
    ------
    Step
        Each accepted step, in order. A jump yields only the state after it. If the body has no instantaneous
        compliance, it yields only the state before it.

    Raises
    ------
    InputError
        If an approach jumps and the body has no instantaneous compliance.
    ConvergenceError
        If the contact solver does not converge.
    """
    segments = scene.program.segments
    if state is None:
        nothing = scene.grid.xp.zeros(scene.gap.shape)
        given = bool(segments) and segments[0].control == "approach"
        approach = 0.0 if given else float(scene.gap[scene.solid].min())
        state = State(Point(0.0, nothing, 0.0, approach, scene.memory.start(nothing)))
        if scene.adhesion is not None:
            state = attracted(scene, state)
        if segments and segments[0].duration > 0:
            if scene.keeps(0.0):
                state = replace(state, kept_force=state.fine.size, kept_approach=abs(state.fine.approach))
            yield Step(state.fine, state.errors, 0, state)
    scene.grid.convolutions = state.convolutions
    while state.segment < len(segments):
        number = state.segment
        segment = segments[state.segment]
        is_jump = segment.duration == 0
        is_start = state.fine.time == 0
        if not is_jump:
            slide = segment.slide
            steps = next_steps(scene, state, segment) if slide is None else pair_of_cells(scene, state, slide)
        elif scene.can_jump:
            steps = [single_step(scene, state, state.fine.time)]
        else:  # the next step takes the jump
            later = next_segment(scene, state)
            steps = [Step(later.fine, later.errors, number, later)]
        state = steps[-1].state
        jumps_next = number < state.segment < len(segments) and segments[state.segment].duration == 0
        # A jump yields only the state after it, or without instantaneous compliance only the state before it.
        follows_from_jump = jumps_next and (scene.can_jump or is_jump)
        if follows_from_jump or (is_jump and not (scene.can_jump or is_start)):
            steps.pop()
        # steps do not change kept_force and kept_approach: the new state still has the values before them
        steps = with_largest_kept(scene, state, steps)
        if steps:
            last = steps[-1].state
            state = replace(state, kept_force=last.kept_force, kept_approach=last.kept_approach)
            del last
        yield from steps
        steps = []  # frees their memory while the next steps are computed


def with_largest_kept(scene: Scene, state: State, steps: list[Step]) -> list[Step]:
    """Return steps whose states have the largest force and approach of the kept rows so far, each step included.

    Parameters
    ----------
    scene, state : Scene, State
        Input, and a state with the largest values before the steps.
    steps : list of Step
        Accepted steps, in order.
    """
    force = state.kept_force
    approach = state.kept_approach
    counted = list[Step]()
    for step in steps:
        if scene.keeps(step.point.time):
            force = max(force, step.point.size)
            approach = max(approach, abs(step.point.approach))
        counted.append(step._replace(state=replace(step.state, kept_force=force, kept_approach=approach)))
    return counted


# ---------------------------------------------------------------------------------------------------------- segments


def next_segment(scene: Scene, state: State) -> State:
    """Return the state at the start of the next segment.

    Without instantaneous compliance the first step of that segment takes a jump of the load before it.
    """
    segments = scene.program.segments
    fine = state.fine
    index = state.segment + 1
    last = segments[index - 1]
    entered = segments[min(index, len(segments) - 1)]
    corner = scene.transitions[index - 1]
    load = fine.force
    if last.duration == 0 and not scene.can_jump:
        value = scene.program.prescribed(state.segment, fine.time, fine.segment_start)
        if last.control == "load":
            load = value
        elif value != fine.approach:
            raise InputError(
                f"at {fine.time:g} s the approach jumps to {value:g} m, and the material has no instantaneous "
                "compliance: expected a ramp (over > 0), or a material that can jump"
            )
    jumped = load != fine.force
    points = []
    for point in (fine, state.coarse or fine):
        start = point.approach if entered.control == "approach" else load if jumped else point.force
        is_late = jumped or (corner.is_abrupt and not point.is_open)
        points.append(replace(without_past(point), segment_start=start, is_late=is_late))
    keeps_length = corner.is_smooth and not fine.is_open and scene.adhesion is None
    length = state.next_length if keeps_length else 0.0
    return replace(state, fine=points[0], coarse=points[1] if state.coarse else None, segment=index, next_length=length)


def without_past(point: Point) -> Point:
    """Return a point without its past: the next step does not use the step before."""
    return replace(point, previous=None, history=replace(point.history, earlier=None, step=0.0))


def single_step(scene: Scene, state: State, time: float, *, may_refuse: bool = False) -> Step:
    """Return one step that both solutions take: a jump, or a step without contact or without memory."""
    fine = state.fine
    coarse = state.coarse or state.fine
    number = state.segment
    new = other = take_step(scene, fine, time, number, rule="linear", may_refuse=may_refuse)
    if coarse is not fine:
        rule: Rule | None = "linear" if coarse.is_open else None
        other = take_step(scene, coarse, time, number, candidates=around_coarse(new, coarse, fine), rule=rule)
    error = stated_difference(scene, fine, new, other, scene.motions[number], is_kept=scene.keeps(time))
    left = scene.memory.remaining(time - fine.time)
    lasting = error.at_least(state.errors, left)
    error = replace(error, shared=lasting.shared) if new.is_open else lasting
    reached = new
    coarse_end = other
    if new.is_open and fine.is_open and not fine.is_late:
        reached = without_past(new)
        coarse_end = reached if other is new else without_past(other)
    work = state.work + work_of_step(scene, fine, new)
    after = after_steps(scene, state, [reached], coarse_end, errors=error, work=work)
    return Step(new, error, number, after)


def attracted(scene: Scene, state: State) -> State:
    """Return the state at the start with adhesion: the surfaces attract each other as soon as the body can deform."""
    segments = scene.program.segments
    point = state.fine
    xp = scene.grid.xp
    approach = point.approach
    if segments and segments[0].control == "approach":
        approach = scene.program.prescribed(0, 0.0, 0.0)
    gap = xp.maximum(scene.gap - approach, 0.0)
    if scene.present is not None:
        gap[~scene.present] = math.inf
    state = replace(state, fine=replace(point, gap=gap, integral=0.0))
    if not scene.can_jump or not segments or segments[0].duration == 0:
        return state
    scene.grid.convolutions = 0
    after = single_step(scene, state, 0.0).state
    lost = max(-after.work, 0.0) if scene.memory.is_elastic else 0.0  # the approach does not change
    return replace(after, segment=0, work=0.0, dissipated=lost)


def step_on_path(scene: Scene, state: State, segment: Segment, event: float) -> Step:
    """Return a step of an elastic body with adhesion to an event at most [s]; the step of a jump is short."""
    fine = state.fine
    is_refused = False
    longest = longest_step(scene, segment, fine.segment_start)
    length = min(state.next_length or longest, longest)
    shortest = JUMP * longest * (1 + ROUNDED)
    while True:
        parts = max(math.ceil((event - fine.time) / length * (1 - ROUNDED)), 1)
        time = fine.time + (event - fine.time) / parts if parts > 1 else event
        try:
            step = single_step(scene, state, time, may_refuse=time - fine.time > shortest)
        except Unstable:
            length = (time - fine.time) / 2
            is_refused = True
            continue
        taken = time - fine.time
        lost = dissipated(scene, fine, step.point)
        if lost == 0 or taken <= shortest:
            break
        length = taken / 2
        is_refused = True
    length = taken / 2 if is_refused and lost == 0 else GROWTH * taken
    total = state.dissipated + lost
    after = replace(step.state, dissipated=total, next_length=0.0 if step.state.segment > state.segment else length)
    return step._replace(state=after)


def step_while_open(scene: Scene, state: State, closes: float) -> Step:
    """Return a step between open surfaces, to the time at which they touch. [s]

    Without instantaneous compliance the force jumps when a surface closes on its former imprint. The time of the jump
    is uncertain if the remaining gap is within the tolerance of the approach. The stated error is then the largest
    force.
    """
    step = single_step(scene, state, closes)
    largest = state.largest_force
    before, left = (touch(scene, point) - point.approach for point in (state.fine, step.point))
    if scene.can_jump or left >= min(before, scene.tolerance * state.largest_approach):
        return step
    return step._replace(errors=replace(step.errors, pressure=largest, force=largest, shared=0.0))


def next_steps(scene: Scene, state: State, segment: Segment) -> list[Step]:
    """Return the next accepted steps of a ramp or a hold: a step of open surfaces or of an elastic body, or a pair.

    The last step has the state after them.
    """
    start = state.fine
    number = state.segment
    began, end = scene.program.corners[number : number + 2]
    event = min(scene.next_kept(start.time), end)
    if start.is_open and not start.is_late:
        closes = closing_time(scene, state, segment, event)
        if closes > start.time:
            return [step_while_open(scene, state, closes)]
    if scene.memory.is_elastic:
        if scene.adhesion is not None and scene.time_step is None:
            return [step_on_path(scene, state, segment, event)]
        longest = (end - began) / 20 if scene.kept is None else math.inf
        parts = max(math.ceil((event - start.time) / (scene.time_step or longest) * (1 - ROUNDED)), 1)
        return [single_step(scene, state, start.time + (event - start.time) / parts if parts > 1 else event)]
    return pair_of_steps(scene, state, segment)


def pair_of_steps(scene: Scene, state: State, segment: Segment) -> list[Step]:
    """Return the steps of the next pair of a ramp or a hold: the first pair that the controller accepts."""
    start = state.fine
    number = state.segment
    former = scene.program.segments[number - 1] if number > 0 else segment
    jumped = (former.duration == 0 or former.slide is not None) and not start.is_open
    is_first = state.next_length == 0
    length = first_length(scene, segment, jumped) if is_first else state.next_length
    if segment.amplitude:
        length = min(length, segment.period / PAIRS_OF_A_CYCLE)
    controller = Controller(shortest_length(scene, number))
    by_load = segment.control == "load"
    approach = state.kept_approach if by_load else state.largest_approach
    largest = Largest(state.kept_force, approach, state.largest_force, state.peak)
    while True:
        middle, last = pair_ends(scene, number, start.time, length, is_first=is_first)
        # if no times are given, the end of each pair is a row
        times = (last,) if scene.kept is None else scene.kept_within(start.time, last)
        pair = solve_pair(scene, state, middle, last, has_row=bool(times))
        error = error_at_end(scene, pair, scene.motions[number])
        if scene.time_step is not None:
            next_length = length
            break
        ratios = errors_over_allowed(scene, pair, number, error, state.errors, largest)
        if ratios[0] > 1 and arises_before(scene, pair):  # judge what arises in the pair; rows state the whole error
            ratios = min(ratios, errors_of_pair_alone(scene, pair, number, state.errors, largest))  # by the added error
        loses_contact = not start.is_open and (pair.first.is_open or pair.second.is_open)
        opens = not by_load and loses_contact and pair.second.approach >= start.approach
        again, proposed = controller.judge(pair.length, *ratios, opens=opens)
        if again is None:
            next_length = proposed
            break
        controller = again
        length = proposed
        del pair  # frees its memory while it is repeated

    return accepted(scene, state, pair, times, error, next_length)


def solve_pair(scene: Scene, state: State, middle: float, last: float, *, has_row: bool) -> Pair:
    """Return a pair of steps, with the pressures at the time of its end if it has a kept row."""
    start = state.fine
    coarse = state.coarse or state.fine
    number = state.segment
    is_soft = scene.memory.grows(last - start.time, SOFT)
    needs_pressure = has_row and is_soft
    solver_part = END_STEP if needs_pressure else SOLVER_PART
    first = take_step(scene, start, middle, number, solver_part=solver_part)
    second = take_step(scene, first, last, number, solver_part=solver_part)
    coarse_step, coarse_end = coarse_solution(scene, coarse, start, second, number, needs_pressure=needs_pressure)
    end = with_final_pressure(scene, first, second, number) if needs_pressure else second
    return Pair(start, coarse, first, second, coarse_step, end, coarse_end, is_soft, has_row)


def coarse_solution(
    scene: Scene, coarse: Point, start: Point, second: Point, number: int, *, needs_pressure: bool
) -> tuple[Point, Point]:
    """Return the coarse solution after a pair: as its step gives it, and with the pressure at that time if needed.

    Parameters
    ----------
    scene, number : Scene, int
        Input, and index of the segment.
    coarse, start, second : Point
        Coarse solution before the pair, fine solution before and after it.
    needs_pressure : bool
        Whether the pair is soft and has a kept row.
    """
    candidates = around_coarse(second, coarse, start)
    solver_part = END_STEP if needs_pressure else SOLVER_PART
    point = take_step(scene, coarse, second.time, number, candidates=candidates, solver_part=solver_part)
    return point, with_final_pressure(scene, coarse, point, number) if needs_pressure else point


def error_at_end(scene: Scene, pair: Pair, slide: Slide | None = None) -> StepErrors:
    """Return the stated errors at the end of a pair, from the difference that both solutions have reached so far.

    Errors that are left from before the pair may be larger (:func:`with_former`). The error of the friction force is
    stated if a motion `slide` is given.
    """
    error = stated_difference(
        scene, pair.start, pair.end, pair.coarse_end, slide if pair.has_row else None, is_kept=pair.has_row
    )
    # Only pairs with a kept row add to the shared error. If all pairs did, rows of contacts with entering cells would
    # state errors 9 % larger, and as many rows would be beyond the tolerance.
    if pair.has_row and not pair.is_soft:
        entered = force_of_entered(scene, pair.start, pair.second)
        error = replace(error, shared=shared_part(scene.memory, pair.length) * entered)
    return error


def errors_of_pair_alone(
    scene: Scene, pair: Pair, number: int, former: StepErrors, largest: Largest
) -> tuple[float, float]:
    """Return the ratios of :func:`errors_over_allowed`, with a coarse step from the fine solution before the pair."""
    start = pair.start
    needs_pressure = pair.is_soft and pair.has_row
    point, end = coarse_solution(scene, start, start, pair.second, number, needs_pressure=needs_pressure)
    alone = replace(pair, coarse_start=start, coarse_step=point, coarse_end=end)
    return errors_over_allowed(scene, alone, number, error_at_end(scene, alone), former, largest)


def accepted(
    scene: Scene,
    state: State,
    pair: Pair,
    times: tuple[float, ...],
    error: StepErrors,
    next_length: float,
) -> list[Step]:
    """Return the steps of an accepted pair, with the kept rows inside it and the state after it.

    Parameters
    ----------
    scene, state : Scene, State
        Input, and state before the pair.
    pair : Pair
        Both solutions.
    times : tuple of float
        Kept times of the pair. [s]
    error : StepErrors
        Error at the end, from the difference of both solutions; and the shared error of the pair.
    next_length : float
        Length of the next pair. [s]
    """
    start = pair.start
    number = state.segment
    slide = scene.motions[number]
    inside = points_inside(scene, pair, times, number)

    works, first_error, last_error = work_of_pair(scene, start, pair.first, pair.second, inside)
    relaxing = 0.0
    if start.time == scene.program.corners[number] and not start.is_late:
        by_load = scene.program.segments[number].control == "load"
        relaxing = transient_error(scene, start, pair.first, pair.second, by_load=by_load)

    stated = with_former(scene, start, pair.second, error, state.errors, slide, is_soft=pair.is_soft)
    after = after_steps(
        scene,
        state,
        [pair.first, pair.second],
        pair.coarse_step,
        next_length,
        errors=stated,
        work=state.work + works[-1],
        work_curved=math.hypot(state.work_curved, last_error),
        work_relaxed=state.work_relaxed + relaxing,
        entered=last_entered(scene, pair, state.entered, stated.gap),
    )

    def with_late_entry(errors: StepErrors, point: Point) -> StepErrors:
        if not pair.is_soft:
            return errors
        uncertain = error_of_late_entry(scene, start, point, stated.gap, state.entered)
        return replace(errors, shared=max(errors.shared, uncertain))

    steps = []
    of_work = max(state.work_difference, after.work_difference, key=abs)
    for point, work in zip(inside, works[:-1], strict=True):
        between = stated_inside(scene, start, point, stated, state.errors, slide, is_soft=pair.is_soft)
        in_second = point.time > pair.first.time
        within = replace(
            state,
            solver_error=max(state.solver_error, pair.first.solver_error if in_second else 0.0),
            work=state.work + work,
            work_curved=math.hypot(state.work_curved, last_error if in_second else first_error),
            work_difference=of_work,
            work_relaxed=after.work_relaxed,
        )
        steps.append(Step(point, with_late_entry(between, point), number, within, is_end=False))
    return [*steps, Step(pair.end, with_late_entry(stated, pair.end), number, after)]


def last_entered(scene: Scene, pair: Pair, former: tuple[float, float], error: float) -> tuple[float, float]:
    """Return :attr:`State.entered` after a pair, from the value before it and the error of the gap at its end [m]."""
    force = force_of_entered(scene, pair.start, pair.second) if pair.is_soft else 0.0
    if not force > 0:
        return former
    earlier = former[0] if abs(pair.start.approach - former[1]) <= error else 0.0
    return earlier + force, pair.second.approach


def points_inside(scene: Scene, pair: Pair, times: tuple[float, ...], number: int) -> list[Point]:
    """Return the fine solution inside a pair, in order: after its first step, and at the kept times [s] of the pair."""
    middle = pair.first
    if pair.is_soft and (scene.kept is None or middle.time in times):
        middle = with_final_pressure(scene, pair.start, middle, number)
    others = [time for time in times if time not in (middle.time, pair.second.time)]
    points = [middle, *(row_inside(scene, pair, time, number) for time in others)]
    return sorted(points, key=lambda point: point.time)


def row_inside(scene: Scene, pair: Pair, time: float, number: int) -> Point:
    """Return the solution at a kept time inside a pair [s], one step from the point of the fine solution before it."""
    start, end = (pair.start, pair.first) if time < pair.first.time else (pair.first, pair.second)
    solver_part = END_STEP if pair.is_soft else SOLVER_PART
    row = take_step(scene, start, time, number, candidates=both_ends(start, end, time), solver_part=solver_part)
    return with_final_pressure(scene, start, row, number) if pair.is_soft else row


def with_final_pressure(scene: Scene, before: Point, point: Point, number: int) -> Point:
    """Return the end of a soft step with the pressure at its time, which a short additional step gives.

    The load is constant in this step, or the approach changes as before.
    """
    if point.is_open:
        return point
    ahead = END_STEP * (point.time - before.time)
    value = point.force
    if scene.program.segments[number].control == "approach":
        value = 2 * point.approach - scene.program.prescribed(number, point.time - ahead, point.segment_start)
    later = take_step(scene, without_past(point), point.time + ahead, number, value, rule="constant")
    return replace(point, stored_pressure=later.stored_pressure, force=later.force, solver_error=later.solver_error)


def after_steps(
    scene: Scene,
    state: State,
    points: list[Point],
    coarse: Point,
    next_length: float = 0.0,
    **totals: Any,
) -> State:
    """Return the state after accepted steps; at the end of a segment, the state at the start of the next one.

    Parameters
    ----------
    scene, state : Scene, State
        Input, and state before the steps.
    points : list of Point
        Fine solution at the end of each step.
    coarse : Point
        Coarse solution at the end of the last step.
    next_length : float
        Length of the next pair. [s]
    **totals
        Other attributes of the new state: errors, work and its error, distance.
    """
    fine = points[-1]
    of_work = 0.0
    if coarse is not fine:
        of_work = work_of_step(scene, state.coarse or state.fine, coarse) - work_of_step(scene, state.fine, fine)
    peak = state.peak
    for point in (points[0], fine):
        if point.size > peak[0] * scene.memory.remaining(point.time - peak[2]):
            peak = (point.size, point.approach, point.time)
    reached = replace(
        state,
        fine=fine,
        coarse=None if coarse is fine else replace(coarse, previous=None),  # see `around_coarse`
        next_length=next_length,
        largest_force=max(state.largest_force, points[0].size, fine.size),
        largest_approach=max(state.largest_approach, abs(points[0].approach), abs(fine.approach)),
        solver_error=max(state.solver_error, *(point.solver_error for point in points), coarse.solver_error),
        work_difference=state.work_difference + of_work,
        peak=peak,
        convolutions=scene.grid.convolutions,
        **totals,
    )
    return next_segment(scene, reached) if fine.time == scene.program.corners[state.segment + 1] else reached


# ------------------------------------------------------------------------------------------------------------ slides


def pair_of_cells(scene: Scene, state: State, slide: Slide) -> list[Step]:
    """Return the next steps of a slide by one cell each, in the frame of the profile.

    The body moves backwards under the profile by whole cells, without interpolation. The step is then an elastic
    contact problem. The coarse solution moves by two cells per step. Only smaller cells reduce the error.
    """
    grid = scene.grid
    memory = scene.memory
    fine = state.fine
    coarse = state.coarse or state.fine
    began, end = scene.program.corners[state.segment : state.segment + 2]
    cells = slide.cells(grid.spacing)
    side = grid.spacing[slide.axis]
    taken = round((fine.time - began) / (end - began) * cells)
    count = 1 if memory.is_elastic else min(2, cells - taken)

    def moved(pressure: Array, number: int) -> Array:
        return grid.xp.roll(pressure, -slide.sense * number, slide.axis)

    def body_under(here: Point, number: int) -> Point:
        history = memory.roll(here.history, slide.sense * number, slide.axis)
        return replace(here, history=history, stored_pressure=moved(here.pressure, number), previous=None)

    def over(here: Point, number: int, time: float, candidates: Sequence[Candidate]) -> Point:
        body = body_under(here, number)
        return take_step(scene, body, time, state.segment, candidates=candidates, solver_part=SLIDING_PART)

    points = [fine]
    works = [0.0]
    for number in range(1, count + 1):
        here = points[-1]
        time = instant(began, end, taken + number, cells)
        points.append(over(here, 1, time, [Candidate(here.stored_pressure, here.history.fields[0], 1.0)]))
        works.append(works[-1] + work_of_step(scene, here, points[-1], slides=True))
    coarse_end = last = points[-1]
    if coarse is not fine or count == 2:
        coarse_end = over(coarse, count, last.time, around_coarse(last, coarse, fine))

    is_kept = any(scene.keeps(point.time) for point in points[1:])
    error = stated_difference(scene, fine, last, coarse_end, slide, is_kept=is_kept)
    relaxed = memory.remaining(last.time - fine.time)
    shared = 0.0
    if count == 1 and not memory.is_elastic:  # the coarse solution takes the same step: both share its error
        former = state.errors.pressure
        if cells == 1:
            former = UNBOUNDED * float(abs(last.pressure - moved(fine.pressure, 1)).sum()) * grid.cell_area
        shared = max(former - error.pressure, 0.0)
        error = replace(error.or_larger(state.errors), pressure=error.pressure)
    if cells == 1 and not memory.is_elastic:  # a solution with longer steps does not exist
        error = replace(error, friction=abs(friction(scene, last, slide)))
    error = replace(error, shared=shared).at_least(state.errors, relaxed)
    step = points[1].time - fine.time
    skipped = 0.0
    if taken == 0 and not memory.is_elastic:  # a long first step is of first order, and the next one corrects it
        change = abs(friction(scene, points[1], slide) - friction(scene, last, slide))
        skipped = skipped_friction(scene, body_under(fine, 1), points[1], slide, step)
        skipped = max(skipped, change * (1 - memory.remaining(step)))
    carried = max(LASTING * state.errors.friction, skipped if count == 1 else skipped * memory.remaining(step))
    of_friction = max(error.friction, carried, phase_error(scene, last, slide, step))  # each step makes a new error
    error = replace(error, friction=of_friction)
    work = state.work + works[-1]
    distance = state.distance + count * side
    after = after_steps(scene, state, points[1:], coarse_end, errors=error, work=work, distance=distance)
    of_work = max(state.work_difference, after.work_difference, key=abs)
    inside = replace(state, work=state.work + works[1], work_difference=of_work, distance=state.distance + side)
    ends = Step(last, error, state.segment, after)
    between = error.or_larger(state.errors)
    between = replace(between, friction=max(between.friction, skipped))
    if taken == 0 and not memory.is_elastic:
        missed = skipped_pressure(scene, body_under(fine, 1), points[1], step)
        between = replace(between, pressure=max(between.pressure, missed))
    return [Step(points[1], between, state.segment, inside, is_end=False), ends][-count:]


# ------------------------------------------------------------------------------------------------------------- steps


def take_step(
    scene: Scene,
    here: Point,
    time: float,
    number: int,
    value: float | None = None,
    candidates: Sequence[Candidate] | None = None,
    rule: Rule | None = None,
    solver_part: float = SOLVER_PART,
    *,
    may_refuse: bool = False,
) -> Point:
    """Return the point a step ahead.

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    here : Point
        Start of the step.
    time : float
        End of the step. [s]
    number : int
        Index of the segment.
    value : float, optional
        Load or approach at the end. Default: the prescribed value of the segment. [N or m]
    candidates : sequence of Candidate, optional
        Pressures that the first guess combines. Default: those of this point and of the one before it.
    rule : {"linear", "bdf2", "constant"}, optional
        Rule of the memory.
    solver_part : float
        Tolerance of the contact solver over the tolerance of the run.
    may_refuse : bool
        With adhesion, whether to refuse a step in which an elastic contact may jump.

    Raises
    ------
    Unstable
        If `may_refuse`, and the contact may jump.
    ConvergenceError
        If the contact solver does not converge.
    """
    memory = scene.memory
    step = time - here.time
    area = scene.grid.cell_area
    segment = scene.program.segments[number]
    by_load = segment.control == "load"
    value = scene.program.prescribed(number, time, here.segment_start) if value is None else value
    prediction = memory.predict(here.history, step, "constant" if here.is_late else rule)
    alpha = prediction.compliance
    grid = prediction.grid or scene.grid
    gap = prediction.carried  # overwritten: no later part of the step needs it
    gap += scene.gap
    lowest = float(gap[scene.solid].min())
    unit_before = here.history.fields[0] if prediction.grid is None else None  # displacement per unit compliance
    previous = (here.time, here.stored_pressure, unit_before) if step > 0 and not here.is_late else None
    if scene.adhesion is None and ((value == 0) if by_load else (value <= lowest)):
        nothing = grid.xp.zeros(gap.shape)
        history = memory.advance(here.history, prediction, nothing, nothing)
        return Point(time, nothing, 0.0, lowest if by_load else value, history, previous, here.segment_start)
    candidates = last_two(here, step) if candidates is None else candidates
    tolerance = max(solver_part * scene.tolerance, 1e-10)
    if scene.adhesion is not None:
        return step_with_adhesion(
            scene,
            here,
            time,
            value,
            prediction,
            gap,
            combination(candidates, [candidate.weight for candidate in candidates]),
            previous,
            tolerance,
            by_load=by_load,
            may_refuse=may_refuse,
        )
    given = {"load": value / area} if by_load else {"approach": value}
    guess: dict[str, Any] = first_guess(candidates, prediction, gap, **given)
    # the solver divides pressures by the contact modulus, here 1 / alpha
    target: dict[str, Any] = {"load": value / area * alpha} if by_load else given
    try:
        contact = solve_contact(
            grid, gap, tolerance=tolerance, **guess, **target, overwrite=True, present=scene.present
        )
    except ConvergenceError as error:
        raise ConvergenceError(
            f"at {time:.6g} s {error}; try a looser tolerance, a coarser grid, or layers whose moduli differ less"
        ) from error
    if grid is not scene.grid:
        scene.grid.convolutions += grid.convolutions
    pressure = contact.pressure
    unit = contact.displacement
    pressure /= alpha
    unit /= alpha
    force, approach = (value, contact.approach) if by_load else (contact.load / alpha * area, value)
    history = memory.advance(here.history, prediction, unit, pressure)
    stored = pressure
    if pressure.size >= PACKED_FROM and 2 * int((pressure > 0).sum()) < pressure.size:
        cells = grid.xp.flatnonzero(pressure).astype(np.int32)
        stored = Packed(pressure.shape, cells, pressure.reshape(-1)[cells])
    return Point(
        time,
        stored,
        force,
        approach,
        history,
        previous,
        here.segment_start,
        solver_error=contact.error,
        solver_error_approach=contact.approach_error,
    )


def closing_time(scene: Scene, state: State, segment: Segment, event: float) -> float:
    """Return the time until which open surfaces stay apart; the present time if they touch immediately. [s]"""
    here = state.fine
    now = state.fine.time
    began = scene.program.corners[state.segment]
    if segment.control == "load":
        return event if segment.highest(here.segment_start) == 0 else now
    # the profile would not even touch the undeformed surface, which is the highest
    if segment.highest(here.segment_start) <= float(scene.gap[scene.solid].min()):
        return event

    def last_open(left: float, right: float) -> float | None:
        """Return the last time between two times at which the surfaces are still apart; None if they stay apart."""
        surface = scene.gap + scene.memory.after_rest(here.history, right - now)
        level = float(surface[scene.solid].min())
        ends = [scene.program.prescribed(state.segment, time, here.segment_start) for time in (left, right)]
        if max(ends) <= level or (right - left <= shortest and ends[1] <= level):
            return None
        if right - left <= shortest:
            return left
        middle = 0.5 * (left + right)
        first = last_open(left, middle)
        return last_open(middle, right) if first is None else first

    shortest = max(ROUNDED * (event - now), math.ulp(event))
    turns = [began + time for time in segment.turns(now - began, event - began)]
    for left, right in pairwise((now, *turns, event)):  # the approach is monotone, and the surface only rises
        closes = last_open(left, right)
        if closes is not None:
            return closes if closes - now > SHORTEST_PAIR * (event - now) else now
    return event
