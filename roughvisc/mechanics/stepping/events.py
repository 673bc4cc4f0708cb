"""Events of a march: corners and jumps of the program, changes of control, and when surfaces that are open close."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import chain
from typing import Any

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.companion import coarse_initial_guess, followed, with_error_estimate
from roughvisc.mechanics.stepping.program import Segment
from roughvisc.mechanics.stepping.scene import Scene, State, Step, Trajectory
from roughvisc.mechanics.stepping.step import (
    accept,
    cost_after,
    enlarged,
    is_outgrown,
    step_of,
    trial_at_rest,
    trial_step,
    without_past,
)

# Times are found to this part of the way to the next event.
_RESOLVED = 1e-9
# Surfaces that are apart for less than this part of the way touch at once.
_AT_ONCE = 1e-6


def closing_time(
    scene: Scene, state: State, segment: Segment, event: float, touched: Callable[[float], float]
) -> float:
    """Time up to which the surfaces, apart now, stay apart; the present time if they touch at once. [s]

    Parameters
    ----------
    scene, state, segment : Scene, State, Segment
        What is prescribed, and how far it has come.
    event : float
        No later than this. [s]
    touched : callable
        Approach at which the surfaces would just touch at a time to come. [m]
    """
    now = state.now.time
    if segment.control == "load":
        return event if segment.is_nothing(state.start) else now
    # the undeformed surface is the lowest that it recovers to
    if segment.highest(state.start) <= min(scene.lowest(scene.gap), scene.outside):
        return event

    def prescribed(time: float) -> float:
        return segment.value(time - state.began, state.start)

    def limit(time: float) -> float:
        return min(touched(time), scene.outside)

    shortest = _RESOLVED * (event - now)
    turns = (state.began + t for t in segment.turns(now - state.began, event - state.began))
    begin = now
    for end in chain(turns, (event,)):
        crossing = _first_crossing(prescribed, limit, begin, end, shortest)
        if crossing is not None:
            return crossing if crossing - now > _AT_ONCE * (event - now) else now
        begin = end
    return event


def _first_crossing(
    prescribed: Callable[[float], float], limit: Callable[[float], float], begin: float, end: float, shortest: float
) -> float | None:
    """A time just before what is prescribed, monotone here, first exceeds a limit that never rises; None if never."""
    pending = [(begin, end)]
    while pending:
        first, last = pending.pop()
        lowest = limit(last)
        if max(prescribed(first), prescribed(last)) <= lowest:
            continue  # nowhere between can it be exceeded
        if last - first <= shortest:
            if prescribed(last) > lowest:
                return first
            continue
        middle = 0.5 * (first + last)
        pending += [(middle, last), (first, middle)]
    return None


def start_segment(scene: Scene, state: State) -> State:
    """State at the start of the next segment."""
    segments = scene.program.segments
    index = state.segment + 1
    joined = segments[max(index - 1, 0) : index + 1]
    neighbours = {segment.control for segment in joined}
    # a corner of the approach is a jump of the load where the material cannot follow at once
    jumps = "approach" in neighbours and not scene.can_jump
    given = segments[index].control if index < len(segments) else None

    def enter(one: Trajectory) -> dict[str, Any]:
        start = 0.0 if given is None else one.now.force if given == "load" else one.now.approach
        return {"start": start, "unresolved": jumps and one.now.force > 0, **without_past(scene, one)}

    entered = state.with_each(enter)
    # a corner in what is prescribed bends the histories and does not break them: the steps may stay as long, unless
    # the first one is of first order
    smooth = len(neighbours) == 1 and all(segment.duration > 0 and segment.slide is None for segment in joined)
    smooth = smooth and scene.is_viscoelastic and not scene.lacks_instantaneous_compliance(state.pace.suggestion)
    pace = state.pace if smooth and state.now.force > 0 and not entered.unresolved else state.pace.after_event()
    return replace(entered, segment=index, began=state.now.time, pace=pace)


def jump(scene: Scene, state: State, segment: Segment) -> tuple[Scene, Step]:
    """Zero-length segment: solved with the instantaneous compliance; left for the next step if there is none."""
    value = segment.value(0.0, state.start)
    if not scene.can_jump:
        return scene, step_of(scene, _defer_jump(scene, state, segment, value), trial_at_rest(scene, state))
    while True:
        trial = trial_step(scene, state, segment.control, value, 0.0, "linear", stated=True)
        if not is_outgrown(scene, trial.instant):
            jumped = accept(scene, state, trial, state.pace.with_pressure_error())
            found = followed(scene, jumped, segment, coarse_initial_guess(trial.instant), "linear")
            if found is not None:
                break
        scene, state = enlarged(scene, replace(state, **cost_after(state, trial)), state.now.time)
    state, companion_trial = found
    return scene, with_error_estimate(scene, step_of(scene, start_segment(scene, state), trial), companion_trial)


def _defer_jump(scene: Scene, state: State, segment: Segment, value: float) -> State:
    """State after a jump that the material cannot follow at once: the next step takes it."""
    if value == (state.now.force if segment.control == "load" else state.now.approach):
        return start_segment(scene, state)
    if segment.control == "approach":
        raise InputError(
            f"at {state.now.time:g} s the approach jumps to {value:g} m, and the material has no instantaneous "
            "compliance: expected a ramp (over > 0), or a material that can jump"
        )
    entered = start_segment(scene, state)
    following = scene.program.segments[entered.segment : entered.segment + 1]
    held = bool(following) and following[0].control == "load"
    return entered.with_each(lambda one: {"unresolved": True, "start": value if held else one.start})


def next_event(scene: Scene, state: State, end: float) -> float:
    """Next kept time or the end of the segment, whichever comes first. [s]"""
    return min(scene.next_kept(state.now.time), end)
