"""The march through time: predict, solve, accept, yield.

:func:`march` presses a profile on a half-space through a loading program and yields every accepted step. It reduces
each step to an elastic contact problem by the memory; how long the steps are is :mod:`~roughvisc.mechanics.control`'s.

All settings are a frozen :class:`Scene`, all that changes is a :class:`State`, a plain value: a rejected step costs
no state, and a march goes on from any state that it yielded.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import EdgeContactError, InputError
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.control import SMALLEST_STEP, error_limit, estimate, rule_for, step_length, suggestion
from roughvisc.mechanics.loading import Segment
from roughvisc.mechanics.memory import Rule, padded
from roughvisc.mechanics.scene import Instant, Scene, State, Step, Trial

Array = NDArray[np.float64]

# The relative duality gap of each step's contact problem, in units of the tolerance. Measured: at 0.1 what the solver
# leaves makes up most of the error, at 0.03 a tenth to a third, for a fifth more iterations. Under given approach the
# force is not fixed, and ten times less is needed.
_ALGEBRAIC = {"load": 0.03, "approach": 0.003}
_DISCARDED = 1e-3  # length of the short solve that shows a soft step's pressure, in steps
_MAGNIFIED = 1e-5  # share of the solver's tolerance that a step before it gets
# The approach stays below the least gap beyond the grid by this factor: what is shown of a step's end is solved anew.
_BEYOND = 1.05


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
        state = _rest(scene)
        if segments and segments[0].duration > 0:
            yield _step(scene, state, _at_rest(scene, state), math.nan)
    while state.segment < len(segments):
        segment = segments[state.segment]
        if segment.duration == 0:
            scene, state, trial = _jump(scene, state, segment)
            following = segments[state.segment : state.segment + 1]
            right_hand = scene.can_jump or state.now.time == 0
            if right_hand and not (following and following[0].duration == 0):
                yield _step(scene, state, trial or _at_rest(scene, state), math.nan)
            del trial  # its fields are not needed while the next step is computed
        else:
            for step in _through(scene, state, segment):
                scene, state = step.scene, step.state
                corner = state.segment < len(segments) and state.now.time == state.began
                if not (corner and segments[state.segment].duration == 0 and scene.can_jump):
                    yield step
                del step


def _rest(scene: Scene) -> State:
    nothing = np.zeros(scene.halfspace.shape)
    given = any(segment.control == "approach" for segment in scene.program.segments[:1])
    now = Instant(0.0, nothing, 0.0, 0.0 if given else scene.lowest(scene.gap), nothing)
    return State(now, nothing, scene.memory.start(scene.halfspace.shape))


def _at_rest(scene: Scene, state: State) -> Trial:
    nothing = np.zeros(scene.halfspace.shape)
    return Trial(state.now, nothing, None if scene.memory.acts_on == "displacement" else nothing, 0.0, "linear")


# ----------------------------------------------------------------------------------------------------------------
# one step


def _attempt(
    scene: Scene, state: State, control: str, value: float, length: float, rule: Rule, share: float = 1.0
) -> Trial:
    """Contact state a step ahead, where the load or the approach has a given value.

    ``share`` scales the contact solver's tolerance.
    """
    alpha, effective, carried = _predicted(scene, state.memory, length, rule)
    gap = scene.gap + carried
    time = state.now.time + length
    apart = value == 0 if control == "load" else value <= scene.lowest(gap)
    if apart:
        approach = scene.lowest(gap) if control == "load" else value
        nothing = np.zeros_like(gap)
        return Trial(Instant(time, nothing, 0.0, approach, nothing), carried, effective, length, rule)
    if alpha <= 0:
        raise InputError(f"at {time:g} s a {control} jumps, and the material has no instantaneous compliance")
    area = scene.halfspace.cell_area
    start, start_displacement = state.first_guess(length, alpha)
    contact = solve_contact(
        scene.halfspace,
        gap,
        load=value * alpha / area if control == "load" else None,
        approach=value if control == "approach" else None,
        tolerance=max(_ALGEBRAIC[control] * scene.tolerance * share, 1e-14),
        start=start,
        start_displacement=start_displacement,
        present=scene.present,
        overwrite=True,
    )
    pressure, displacement = contact.pressure, contact.displacement
    carried += displacement
    if effective is not None:
        effective += pressure
    pressure /= alpha
    displacement /= alpha
    instant = Instant(
        time,
        pressure,
        value if control == "load" else contact.load / alpha * area,
        value if control == "approach" else contact.approach,
        displacement,
    )
    return Trial(
        instant,
        carried,
        effective,
        length,
        rule,
        contact.bound,
        contact.converged,
        contact.iterations,
        contact.convolutions + (scene.memory.acts_on == "pressure"),
    )


def _predicted(scene: Scene, memory: Any, length: float, rule: Rule) -> tuple[float, Array | None, Array]:
    """``alpha`` of a step, and what is carried into it: the effective pressure, if known, and the displacement."""
    alpha, carried = scene.memory.predict(memory, length, rule)
    if scene.memory.acts_on == "displacement":
        return alpha, None, carried
    if scene.memory.acts_on == "both":
        return alpha, carried[0], carried[1]
    return alpha, carried, scene.halfspace.displacement(carried)


def _committed(scene: Scene, state: State, trial: Trial) -> State:
    """State after an accepted trial."""
    now = trial.instant
    assert now.unit_displacement is not None
    fields = {"pressure": now.pressure, "displacement": now.unit_displacement}
    both = scene.memory.acts_on == "both"
    field = np.stack(list(fields.values())) if both else fields[scene.memory.acts_on]
    memory = scene.memory.advance(state.memory, trial.length, trial.rule, field)
    if both:  # held once
        now = replace(now, pressure=field[0], unit_displacement=field[1])
    touching = now.force > 0
    return replace(
        state,
        now=now,
        displacement=trial.displacement,
        before=state.now if trial.length > 0 else None,
        memory=memory,
        largest_force=max(state.largest_force, now.force),
        largest_approach=max(state.largest_approach, abs(now.approach)),
        contact_since=state.contact_since if touching and state.now.force > 0 else state.now.time,
        work=state.work + work_between(scene, state, now.pressure, trial.displacement, jumped=state.unresolved),
        unresolved=False,
        blind=False,
    )


def work_between(scene: Scene, state: State, pressure: Array, displacement: Array, jumped: bool = False) -> float:
    """Work of the pressure on the displacement from a state to the next. [J]

    Where surfaces touch that is the force on the approach; cells that touch in a part of the step count by that part
    only. Without memory it is the stored energy, whatever the steps. ``jumped``: the pressure changed at once, before.
    """
    mean = pressure if jumped else 0.5 * (state.now.pressure + pressure)
    return float(np.sum(mean * (displacement - state.displacement))) * scene.halfspace.cell_area


def _spent(state: State, trial: Trial) -> State:
    return replace(
        state,
        iterations=state.iterations + trial.iterations,
        convolutions=state.convolutions + trial.convolutions,
    )


def _step(scene: Scene, state: State, trial: Trial, time_error: float) -> Step:
    """What is yielded of an accepted trial."""
    shown, converged = trial, trial.converged
    pressure, level = state.now.pressure, state.now.approach
    if not trial.apart and trial.length > 0 and scene.keeps(state.now.time) and scene.is_soft(trial.length):
        # The pressure of an implicit step belongs to the step, not to its end. A short step at constant
        # pressure shows the end's (largest error of a Kelvin-Voigt pressure 39 % -> 5e-8).
        bare = replace(state, before=None)
        shown = _attempt(scene, bare, "load", state.now.force, _DISCARDED * trial.length, "right")
        state = _spent(state, shown)
        converged = converged and shown.converged
        pressure, level = shown.instant.pressure, shown.instant.approach
    now = replace(state.now, pressure=pressure)
    return Step(now, shown.displacement, shown.effective, level, shown.bound, time_error, converged, scene, state)


def _outgrown(scene: Scene, instant: Instant) -> bool:
    """Whether the grid is too small: contact cannot be excluded beyond it, or has reached the domain's border."""
    if scene.outside < math.inf:
        return _BEYOND * instant.approach >= scene.outside
    return at_edge(scene, instant.pressure)


def at_edge(scene: Scene, pressure: Array) -> bool:
    """Whether pressure at the border of a free-space domain acts as the edge of a punch that nobody asked for."""
    if scene.halfspace.boundary != "free" or scene.accept_edge:
        return False
    borders = (-1,) if scene.halfspace.mirrored else (0, -1)
    return any(bool(np.any(pressure[i] > 0) or np.any(pressure[:, i] > 0)) for i in borders)


def edge_error(scene: Scene, time: float) -> EdgeContactError:
    """The error to raise where the grid cannot grow."""
    nx, ny = scene.halfspace.surface_shape
    return EdgeContactError(
        f"at {time:.6g} s contact reaches the border of the free-space domain of {nx} x {ny} cells: expected contact "
        "inside it; use boundary='periodic' for a nominally flat scan, a larger scan, a smaller load, or "
        "edge='accept' to press it as a punch of that outline"
    )


def _enlarged(scene: Scene, state: State, time: float) -> tuple[Scene, State]:
    """Scene and state on a larger grid: nothing outside ever carried pressure."""
    larger = scene.enlarge(scene) if scene.enlarge is not None else None
    if larger is None:
        raise edge_error(scene, time)
    scene, offset = larger
    shape = scene.halfspace.shape
    memory = scene.memory.enlarged(state.memory, shape, offset, scene.halfspace.displacement)

    def moved(instant: Instant) -> Instant:
        return replace(instant, pressure=padded(instant.pressure, shape, offset), unit_displacement=None)

    now, before = moved(state.now), None if state.before is None else moved(state.before)
    glassy, _, carried = _predicted(scene, memory, 0.0, "linear")
    unit_displacement = scene.halfspace.displacement(now.pressure)
    now = replace(now, unit_displacement=unit_displacement)
    displacement = carried + glassy * unit_displacement
    return scene, replace(state, now=now, displacement=displacement, before=before, memory=memory)


# ----------------------------------------------------------------------------------------------------------------
# events: jumps, corners, contact lost and found


def _entered(scene: Scene, state: State) -> State:
    """State at the start of the next segment."""
    segments = scene.program.segments
    index = state.segment + 1
    start = 0.0
    neighbours = {segment.control for segment in segments[index - 1 : index + 1]}
    if index < len(segments):
        start = state.now.force if segments[index].control == "load" else state.now.approach
    return replace(
        state,
        segment=index,
        began=state.now.time,
        start=start,
        before=None,
        suggestion=0.0,
        memory=scene.memory.restart(state.memory),
        # a corner of the approach is a jump of the load where the material cannot follow at once
        unresolved="approach" in neighbours and state.now.force > 0 and not scene.can_jump,
    )


def _jump(scene: Scene, state: State, segment: Segment) -> tuple[Scene, State, Trial | None]:
    """Zero-length segment: solved with the instantaneous compliance; left for the next step if there is none."""
    value = segment.value(0.0, state.start)
    if not scene.can_jump:
        if value == (state.now.force if segment.control == "load" else state.now.approach):
            return scene, _entered(scene, state), None
        if segment.control == "approach":
            raise InputError(
                f"at {state.now.time:g} s the approach jumps to {value:g} m, and the material has no instantaneous "
                "compliance: expected a ramp (over > 0), or a material that can jump"
            )
        entered = _entered(scene, state)
        following = scene.program.segments[entered.segment : entered.segment + 1]
        start = value if following and following[0].control == "load" else entered.start
        return scene, replace(entered, unresolved=True, start=start), None
    trial = _attempt(scene, state, segment.control, value, 0.0, "linear")
    while _outgrown(scene, trial.instant):
        scene, state = _enlarged(scene, _spent(state, trial), state.now.time)
        trial = _attempt(scene, state, segment.control, value, 0.0, "linear")
    return scene, _entered(scene, _committed(scene, _spent(state, trial), trial)), trial


def next_event(scene: Scene, state: State, end: float) -> float:
    """Next kept time or the end of the segment, whichever comes first. [s]"""
    if scene.times is None:
        return end
    return min((t for t in scene.times if state.now.time < t < end), default=end)


def _through(scene: Scene, state: State, segment: Segment) -> Iterator[Step]:
    """Accepted steps through a segment; the last one has entered the next segment."""
    end = scene.program.corners[state.segment + 1]
    held: Step | None = None  # first step after an event: provisional until the second one confirms it
    base = state
    while state.now.time < end:
        event = next_event(scene, state, end)
        fresh = state.before is None
        if fresh and state.now.force == 0 and not state.unresolved:
            closing = _closing_time(scene, state, segment, event)
            if closing > state.now.time:
                state, trial = _carry_apart(scene, state, segment, closing, end)
                if state.now.time in (event, end):
                    yield _step(scene, state, trial, math.nan)
                continue
        length = step_length(scene, state, segment, event, end)
        arrival = event if length == event - state.now.time else state.now.time + length
        rule = rule_for(scene, state, length)
        value = segment.value(arrival - state.began, state.start)
        # what a short discarded solve shows of a soft step's end is the step's own residual, magnified
        share = _MAGNIFIED if scene.is_soft(length) and scene.keeps(arrival) else 1.0
        trial = _attempt(scene, state, segment.control, value, length, rule, share)
        trial = replace(trial, instant=replace(trial.instant, time=arrival))
        state = _spent(state, trial)
        if _outgrown(scene, trial.instant):
            if held is not None:
                yield held
                held = None
            scene, state = _enlarged(scene, state, arrival)
            continue
        error = estimate(scene, state, trial, segment, event)
        limit = error_limit(scene, arrival)
        fixed = scene.time_step is not None
        retry_is_vain = error > 0.93 * state.rejected_error
        # where the approach is given, a step that is too long may undershoot and seem to open the contact
        opens = segment.control == "approach" and trial.apart and state.now.force > 0
        too_long = (error > limit and not retry_is_vain) or opens
        if not fixed and too_long and length > SMALLEST_STEP * segment.duration:
            shrink = 0.2 if opens else min(max(0.7 * math.sqrt(limit / error), 0.2), 0.5)
            start = state
            if held is not None:  # roll back both
                length, held, start = held.state.now.time - base.now.time, None, base
            state = replace(
                start,
                suggestion=shrink * length,
                rejected_error=math.inf if opens else error,
                iterations=state.iterations,
                convolutions=state.convolutions,
            )
            continue
        unresolved = state.unresolved
        accepted = _committed(scene, state, trial)
        accepted = replace(
            accepted,
            suggestion=suggestion(scene, trial, error, state),
            blind=retry_is_vain and error > limit,
            rejected_error=state.rejected_error if fresh else math.inf,
        )
        if unresolved:  # the first short step stands for the jump
            accepted = replace(accepted, before=None, suggestion=length, memory=scene.memory.restart(accepted.memory))
        if arrival == end:
            accepted = _entered(scene, accepted)
        step = _step(scene, accepted, trial, error)
        if held is not None:
            yield held
            held = None
        if fresh and not fixed and not unresolved and arrival < end:
            base, held = replace(state, suggestion=length), step
            state = step.state
        else:
            base = state = step.state
            yield step
        del trial, accepted, step  # their fields are not needed while the next step is computed


def _closing_time(scene: Scene, state: State, segment: Segment, event: float) -> float:
    """Time up to which the surfaces, apart now, stay apart; the present time if they touch at once."""
    now = state.now.time

    def apart(time: float) -> bool:
        value = segment.value(time - state.began, state.start)
        if segment.control == "load":
            return value == 0
        _, _, carried = _predicted(scene, state.memory, time - now, "linear")
        return value <= min(scene.lowest(scene.gap + carried), scene.outside)

    if segment.control == "load":
        return event if apart(event) and apart(now + (event - now) / 2) else now
    inside = now
    for probe in np.linspace(now, event, 17)[1:]:
        if not apart(float(probe)):
            outside = float(probe)
            break
        inside = float(probe)
    else:
        return event
    while outside - inside > 1e-9 * (event - now):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if apart(middle) else (inside, middle)
    return inside if inside - now > 1e-6 * (event - now) else now


def _carry_apart(scene: Scene, state: State, segment: Segment, until: float, end: float) -> tuple[State, Trial]:
    """One exact step without contact."""
    value = segment.value(until - state.began, state.start)
    length = until - state.now.time
    apart_before = not np.any(state.now.pressure)
    trial = _attempt(scene, state, segment.control, value, length, "linear" if apart_before else "euler")
    trial = replace(trial, instant=replace(trial.instant, time=until))
    carried = replace(_committed(scene, state, trial), before=None, suggestion=0.0)
    carried = replace(carried, memory=scene.memory.restart(carried.memory))
    return (_entered(scene, carried) if until == end else carried), trial
