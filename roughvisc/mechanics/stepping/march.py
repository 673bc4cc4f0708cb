"""The march through time: predict, solve, accept, yield; jumps, and when surfaces that are apart close.

:func:`march` presses a profile on a half-space through a loading program and yields every accepted step. It reduces
each step to an elastic contact problem by the memory. :mod:`~roughvisc.mechanics.stepping.controller` chooses how long
the steps are.

All settings are a frozen :class:`Scene`, all that changes is a :class:`State`, a plain value: a rejected step costs
no state, and a march goes on from any state that it yielded.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import chain

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.companion import (
    adapt_tolerance_share,
    behind,
    coarse_initial_guess,
    difference,
    followed,
    in_pairs,
    with_error_estimate,
    with_uncertainty,
)
from roughvisc.mechanics.stepping.controller import (
    acceptance_error,
    error_limit,
    growth,
    remaining,
    rule_for,
    shortest_step,
    step_length,
    suggestion,
)
from roughvisc.mechanics.stepping.program import Segment
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.mechanics.stepping.slide_march import through_slide
from roughvisc.mechanics.stepping.state import Guess, State, Step, Trial
from roughvisc.mechanics.stepping.step import (
    accept,
    carried_into_step,
    cost_after,
    displacement_after,
    enlarged,
    initial_state,
    is_outgrown,
    restarted,
    start_segment,
    step_of,
    trial_at_rest,
    trial_step,
    without_past,
)

_MAGNIFIED = 1e-5  # share of the solver's tolerance that a step gets before the short one that shows its end
# Times are found to this part of the way to the next event.
_RESOLVED = 1e-9
# Surfaces that are apart for less than this part of the way touch at once.
_AT_ONCE = 1e-6


def march(scene: Scene, state: State | None = None) -> Iterator[Step]:
    """Press a profile through a loading program, step by step.

    Parameters
    ----------
    scene : Scene
        What is prescribed.
    state : State, optional
        Where to go on from, as yielded by an earlier march through the same scene; None: from rest.

    Yields
    ------
    Step
        Each accepted step, in order; at a jump the right-hand state only, except where the material cannot jump:
        then the left-hand one.

    Raises
    ------
    InputError
        If a jump of approach is prescribed to a material without instantaneous compliance, a load cannot be
        carried, or an approach exceeds full contact.
    EdgeContactError
        If contact reached the border of a free-space grid.
    """
    segments = scene.program.segments
    if state is None:
        state = initial_state(scene)
        if segments and segments[0].duration > 0:
            yield step_of(scene, state, trial_at_rest(scene, state))
    while state.segment < len(segments):
        number, segment = state.segment, segments[state.segment]
        if segment.duration == 0:
            scene, step = jump(scene, state, segment)
            state = step.state
            if (scene.can_jump or state.now.time == 0) and not _jumps_next(scene, state):
                yield step
            del step  # its fields are not needed while the next one is computed
            continue
        steps = (_steps_of_segment if segment.slide is None else through_slide)(scene, state, segment)
        del state  # nor are its
        for step in in_pairs(steps):
            ends = step.state.segment > number
            if ends:
                scene, state = step.scene, step.state
            # of a jump that the material follows at once only the right-hand state is a step
            if not (ends and step.scene.can_jump and _jumps_next(step.scene, step.state)):
                yield step
            del step


def _jumps_next(scene: Scene, state: State) -> bool:
    """Whether the segment that a state has entered is a jump."""
    segments = scene.program.segments
    return state.segment < len(segments) and segments[state.segment].duration == 0


def jump(scene: Scene, state: State, segment: Segment) -> tuple[Scene, Step]:
    """Zero-length segment: solved with the instantaneous compliance; left for the next step if there is none."""
    value = segment.value(0.0, state.start)
    if not scene.can_jump:
        return scene, step_of(scene, _defer_jump(scene, state, segment, value), trial_at_rest(scene, state))
    while True:
        trial = trial_step(scene, state, segment.control, value, 0.0, "linear")
        if not is_outgrown(scene, trial.instant):
            jumped = accept(scene, state, trial, replace(state.pace, ignore_pressure_error=False))
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
    return entered.with_each(lambda one: replace(one, unresolved=True, start=value if held else one.start))


def _steps_of_segment(scene: Scene, state: State, segment: Segment) -> Iterator[Step | None]:
    """Accepted steps through a segment; the last one has entered the next segment. None before the grid may grow.

    Steps go in pairs: the companion takes both as one. The first step after an event extrapolates from nothing; it is
    accepted when the second one is, and both are rolled back together.
    """
    end = scene.program.corners[state.segment + 1]
    first: Step | None = None  # after an event
    base = state  # before it
    while state.now.time < end:
        event = min(scene.next_kept(state.now.time), end)
        closing = state.now.time  # till when surfaces that are apart stay so
        if not (state.now.force > 0 or state.unresolved):
            closing = closing_time(scene, state, segment, event, partial(_touched, scene, state))
        if closing > state.now.time:
            if first is not None:
                yield first
                first = None
            yield None
            step = _step_while_open(scene, state, segment, closing, end)
            scene, state = step.scene, step.state
            if state.now.time in (event, end):
                yield step
            continue
        trial, error = _tried(scene, state, segment, event, end)
        outgrown = is_outgrown(scene, trial.instant)
        shown = first is not None and scene.keeps(first.shown.time)
        if not outgrown and _too_long(scene, state, segment, trial, error, shown):
            start, length = (state, trial.length) if first is None else (base, state.now.time - base.now.time)
            state, first = _shortened(scene, start, state, segment, trial, error, length), None
            del trial
            continue
        unpaired = state.behind == 0 and trial.instant.time < end
        fresh = state.before is None and scene.time_step is None
        judged = None
        if not outgrown:
            waits = scene.is_viscoelastic and unpaired
            accepted, guess = _accept_and_suggest(scene, state, trial, error, waits), None
            if state.companion is not None and not waits:
                guess = coarse_initial_guess(accepted.now, state.companion.now, state.before if state.behind else None)
                if scene.enlarge is None:  # its fields are not needed while the companion's contact is solved
                    numbers = state.now.without_fields()
                    state = base = replace(state, now=numbers, before=None, memory=None)
            judged = _step_with_companion(scene, state, accepted, segment, trial, guess)
            del accepted, guess
        if first is not None:
            yield first
            first = None
        if judged is None:  # the grid is too small for this step, or for the companion's
            yield None
            scene, state = enlarged(scene, replace(state, **cost_after(state, trial)), trial.instant.time)
            continue
        base, state = state, judged.state
        if fresh and unpaired:
            first = judged
        else:
            base = state
            yield judged
        del trial, judged  # their fields are not needed while the next step is computed


def _tried(scene: Scene, state: State, segment: Segment, event: float, end: float) -> tuple[Trial, float]:
    """Try a step of the suggested length: the trial, and its estimated error."""
    length = step_length(scene, state, segment, event, end)
    arrival = event if length == event - state.now.time else state.now.time + length
    value = segment.value(arrival - state.began, state.start)
    # what a short discarded solve shows of a soft step's end is the step's own residual, magnified
    share = _MAGNIFIED if scene.lacks_instantaneous_compliance(length) and scene.keeps(arrival) else 1.0
    rule = rule_for(scene, state, length)
    trial = trial_step(scene, state, segment.control, value, length, rule, share, arrival=arrival)
    return trial, acceptance_error(scene, state, trial, segment, event)


def _too_long(scene: Scene, state: State, segment: Segment, trial: Trial, error: float, shown: bool) -> bool:
    """Whether to try again with a shorter step; ``shown``: the error is also that of the step before, which is kept."""
    if scene.time_step is not None or trial.length <= shortest_step(scene, state, segment):
        return False
    if _seems_to_open(state, segment, trial):
        held = segment.value(trial.instant.time - state.began, state.start) >= state.now.approach
        if held or math.isnan(error):
            return True
    limit = error_limit(scene, state, state.now.time if shown else trial.instant.time)
    return error > limit and not state.pace.shortening_failed(error)


def _seems_to_open(state: State, segment: Segment, trial: Trial) -> bool:
    """Where the approach is given, a step that is too long may undershoot and seem to open the contact."""
    return segment.control == "approach" and trial.is_open and state.now.force > 0


def _shortened(
    scene: Scene, start: State, state: State, segment: Segment, trial: Trial, error: float, length: float
) -> State:
    """State to try again from, with a step shorter than a length. [s]"""
    error = math.nan if _seems_to_open(state, segment, trial) else error
    pace = start.pace.rejected(length, error, error_limit(scene, state, trial.instant.time))
    return replace(start, pace=pace, **cost_after(state, trial))


def _accept_and_suggest(scene: Scene, state: State, trial: Trial, error: float, waits: bool) -> State:
    """Accept a trial and suggest the next length; ``waits``: the companion takes this step together with the next."""
    time = trial.instant.time
    proposed, allowed = suggestion(scene, trial, error, state), error_limit(scene, state, time)
    pace = state.pace.accepted(proposed, error, allowed, fresh=state.before is None)
    accepted = accept(scene, state, trial, pace, **behind(state) if waits else {})
    # the first short step stands for a jump
    return restarted(scene, accepted, trial.length) if state.unresolved else accepted


def _step_with_companion(
    scene: Scene,
    state: State,
    accepted: State,
    segment: Segment,
    trial: Trial,
    guess: Guess | None,
) -> Step | None:
    """Bring the companion to the end of the accepted step and add the error that it finds.

    None if the companion outgrew the grid. With ``guess`` None the companion waits for another step. Otherwise only
    numbers of the state before the step are read, not its fields.
    """
    time, companion_trial = trial.instant.time, None
    if guess is not None:
        found = followed(scene, accepted, segment, guess)
        if found is None:
            return None
        accepted, companion_trial = found
    end = scene.program.corners[state.segment + 1]
    if time == end:
        accepted = start_segment(scene, accepted)
    step = step_of(scene, accepted, trial)
    if companion_trial is None:
        return step
    assert state.companion is not None
    assert accepted.companion is not None
    wants_area = scene.keeps(time) or (state.behind > 0 and scene.keeps(state.now.time))
    displaced = displacement_after(scene, accepted.companion, companion_trial)
    unknown = difference(scene, step, accepted.companion, displaced, state.companion.now.contact, wants_area)
    if companion_trial.length <= trial.length:  # it took the same step
        return with_uncertainty(step, unknown.or_worse(state.uncertainty, 0.0))
    ahead = max(1.0, growth(state, segment, time, min(scene.next_kept(time), end))) if time < end else 1.0
    left = 1.0 if wants_area else remaining(scene, accepted)
    return with_uncertainty(step, unknown, pace=adapt_tolerance_share(scene, state, accepted, ahead, left, unknown))


def _step_while_open(scene: Scene, state: State, segment: Segment, until: float, end: float) -> Step:
    """One exact step without contact; the companion takes the same."""
    while state.behind:
        found = followed(scene, state, segment, coarse_initial_guess(state.now))
        if found is None:
            scene, state = enlarged(scene, state, state.now.time)
        else:
            state = found[0]
    value = segment.value(until - state.began, state.start)
    trial = trial_step(scene, state, segment.control, value, until - state.now.time, "linear", arrival=until)
    carried = accept(scene, state, trial, replace(state.pace, ignore_pressure_error=False))
    in_contact = carried.companion is not None and carried.companion.now.force > 0
    found = followed(scene, carried, segment, coarse_initial_guess(carried.now), "right" if in_contact else "linear")
    if found is None:  # the companion is in contact, beyond the grid
        return _step_while_open(*enlarged(scene, state, until), segment, until, end)
    carried, companion_trial = found
    carried = carried.with_each(partial(without_past, scene))
    carried = replace(carried, pace=replace(carried.pace, suggestion=0.0))
    if until == end:
        carried = start_segment(scene, carried)
    step = step_of(scene, carried, trial)
    return with_error_estimate(scene, step, companion_trial) if scene.keeps(until) else step


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


def _touched(scene: Scene, state: State, time: float) -> float:
    """Approach at which surfaces that are apart would touch at a time to come. [m]"""
    carried = carried_into_step(scene, state.memory, time - state.now.time, "linear")[3]
    return scene.lowest(scene.gap + carried)
