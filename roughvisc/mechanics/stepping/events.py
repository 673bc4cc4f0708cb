"""Events: corners and jumps of the loading program, after which the march starts without extrapolation."""

from __future__ import annotations

from dataclasses import replace

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.attempt import attempt, committed, step_of, trial_at_rest, with_cost
from roughvisc.mechanics.stepping.companion import bare, beside, compared
from roughvisc.mechanics.stepping.domain import enlarged, is_outgrown
from roughvisc.mechanics.stepping.program import Segment
from roughvisc.mechanics.stepping.scene import Scene, State, Step


def entering(scene: Scene, state: State) -> State:
    """State at the start of the next segment, its companion too."""
    segments = scene.program.segments
    index = state.segment + 1
    start = 0.0
    joined = segments[max(index - 1, 0) : index + 1]
    neighbours = {segment.control for segment in joined}
    if index < len(segments):
        start = state.now.force if segments[index].control == "load" else state.now.approach
    # a corner in what is prescribed bends the histories and does not break them: the steps may stay as long, unless
    # the first one is of first order
    smooth = len(neighbours) == 1 and all(segment.duration > 0 and segment.slide is None for segment in joined)
    smooth = smooth and scene.remembers and not scene.is_soft(state.pace.suggestion)
    unresolved = "approach" in neighbours and state.now.force > 0 and not scene.can_jump
    return replace(
        state,
        segment=index,
        began=state.now.time,
        start=start,
        before=None,
        pace=state.pace if smooth and state.now.force > 0 and not unresolved else state.pace.after_event(),
        memory=scene.memory.restart(state.memory),
        # a corner of the approach is a jump of the load where the material cannot follow at once
        unresolved=unresolved,
        companion=None if state.companion is None else entering(scene, state.companion),
    )


def jump(scene: Scene, state: State, segment: Segment) -> tuple[Scene, Step]:
    """Zero-length segment: solved with the instantaneous compliance; left for the next step if there is none."""
    value = segment.value(0.0, state.start)
    if not scene.can_jump:
        return scene, step_of(scene, _postponed(scene, state, segment, value), trial_at_rest(scene, state))
    while True:
        trial = attempt(scene, state, segment.control, value, 0.0, "linear", stated=True)
        state = with_cost(state, trial)
        companion, companion_trial = state.companion, None
        if companion is not None and not is_outgrown(scene, trial.instant):
            start = segment.value(0.0, companion.start)
            companion_trial = attempt(
                scene, companion, segment.control, start, 0.0, "linear", guess=beside(trial.instant)
            )
            state = with_cost(state, companion_trial)
            companion = bare(committed(scene, companion, companion_trial))
        if not any(is_outgrown(scene, one.instant) for one in (trial, companion_trial) if one is not None):
            break
        scene, state = enlarged(scene, state, state.now.time)
    state = entering(scene, replace(committed(scene, state, trial), companion=companion))
    step = step_of(scene, state, trial)
    return scene, step if companion_trial is None else compared(scene, step, companion_trial)


def _postponed(scene: Scene, state: State, segment: Segment, value: float) -> State:
    """State after a jump that the material cannot follow at once: the next step takes it."""
    if value == (state.now.force if segment.control == "load" else state.now.approach):
        return entering(scene, state)
    if segment.control == "approach":
        raise InputError(
            f"at {state.now.time:g} s the approach jumps to {value:g} m, and the material has no instantaneous "
            "compliance: expected a ramp (over > 0), or a material that can jump"
        )
    entered = entering(scene, state)
    following = scene.program.segments[entered.segment : entered.segment + 1]

    def jumping(one: State) -> State:
        start = value if following and following[0].control == "load" else one.start
        return replace(one, unresolved=True, start=start)

    companion = None if entered.companion is None else jumping(entered.companion)
    return replace(jumping(entered), companion=companion)


def next_event(scene: Scene, state: State, end: float) -> float:
    """Next kept time or the end of the segment, whichever comes first. [s]"""
    return min(scene.next_kept(state.now.time), end)
