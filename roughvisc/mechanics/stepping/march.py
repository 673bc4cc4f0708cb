"""The march through time: predict, solve, accept, yield.

:func:`march` presses a profile on a half-space through a loading program and yields every accepted step. It reduces
each step to an elastic contact problem by the memory. :mod:`~roughvisc.mechanics.stepping.control` chooses how long the
steps are.

All settings are a frozen :class:`Scene`, all that changes is a :class:`State`, a plain value: a rejected step costs
no state, and a march goes on from any state that it yielded.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import EdgeContactError, InputError
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.hereditary.memory import Modes, Rule, padded
from roughvisc.mechanics.stepping import energy
from roughvisc.mechanics.stepping.apart import closing_time
from roughvisc.mechanics.stepping.companion import bare, beside, difference, sharpened
from roughvisc.mechanics.stepping.control import (
    error_limit,
    estimate,
    growth,
    rule_for,
    shortest_step,
    step_length,
    suggestion,
)
from roughvisc.mechanics.stepping.program import Control, Segment
from roughvisc.mechanics.stepping.scene import Instant, Scene, State, Step, Trial, Uncertainty

Array = NDArray[np.float64]

# The relative duality gap of each step's contact problem, in units of the tolerance. The error of the pressure (L1) is
# as large in the median and 7 times as large in one of fifty (workflows/benchmarks/solver_error.py).
_ALGEBRAIC = 0.03
_DISCARDED = 1e-3  # length of the short solve that shows a soft step's pressure, in steps
_MAGNIFIED = 1e-5  # share of the solver's tolerance that a step before it gets
# The companion's contact is solved to so many times the tolerance of the march's.
_COMPANION_SHARE = 2.5
# Where steps double from one to the next, those of the companion grow fourfold.
_COMPANION_GROWTH = 4.1
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
            yield _step(scene, state, _at_rest(scene, state))
    while state.segment < len(segments):
        segment = segments[state.segment]
        if segment.duration == 0:
            scene, step = _jump(scene, state, segment)
            state = step.state
            following = segments[state.segment : state.segment + 1]
            right_hand = scene.can_jump or state.now.time == 0
            if right_hand and not (following and following[0].duration == 0):
                yield step
            del step  # its fields are not needed while the next one is computed
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
    at_rest = energy.at_rest(scene.memory) if isinstance(scene.memory, Modes) else None
    return State(now, nothing, scene.memory.start(scene.halfspace.shape), energy=at_rest)


def _at_rest(scene: Scene, state: State) -> Trial:
    nothing = np.zeros(scene.halfspace.shape)
    return Trial(state.now, nothing, None if scene.memory.acts_on == "displacement" else nothing, 0.0, "linear")


# ----------------------------------------------------------------------------------------------------------------
# one step


def _attempt(
    scene: Scene,
    state: State,
    control: Control,
    value: float,
    length: float,
    rule: Rule,
    share: float = 1.0,
    guess: tuple[Array, Array] | None = None,
    stated: bool = False,
) -> Trial:
    """Contact state a step ahead, where the load or the approach has a given value.

    ``share`` scales the contact solver's tolerance; ``guess`` is a pressure near the one sought, and its displacement
    at unit compliance, where such are known; ``stated`` asks for an estimate of the error that the solver leaves.
    """
    alpha, effective, carried = _predicted(scene, state.memory, length, rule)
    gap = scene.gap + carried
    time = state.now.time + length
    apart = value == 0 if control == "load" else value <= scene.lowest(gap)
    if apart:
        approach = scene.lowest(gap) if control == "load" else value
        nothing = np.zeros_like(gap)
        return Trial(Instant(time, nothing, 0.0, approach, nothing), carried, effective, length, rule, control)
    if alpha <= 0:
        raise InputError(f"at {time:g} s a {control} jumps, and the material has no instantaneous compliance")
    area = scene.halfspace.cell_area
    start, start_displacement = (
        state.first_guess(length, alpha) if guess is None else (guess[0] * alpha, guess[1] * alpha)
    )
    contact = solve_contact(
        scene.halfspace,
        gap,
        load=value * alpha / area if control == "load" else None,
        approach=value if control == "approach" else None,
        tolerance=max(_ALGEBRAIC * scene.tolerance * share, 1e-14),
        start=start,
        start_displacement=start_displacement,
        present=scene.present,
        overwrite=True,
        estimate_error=stated,
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
        control,
        contact.bound,
        contact.error,
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
    assert state.now.unit_displacement is not None
    spent = energy_after(scene, state, trial)
    if spent is None:
        work = state.work + work_between(scene, state, now.pressure, trial.displacement, jumped=state.unresolved)
    else:
        work = spent.stored + spent.dissipated
    return replace(
        state,
        now=now,
        displacement=trial.displacement,
        before=state.now if trial.length > 0 else None,
        memory=memory,
        largest_force=max(state.largest_force, now.force),
        largest_approach=max(state.largest_approach, abs(now.approach)),
        contact_since=state.contact_since if touching and state.now.force > 0 else state.now.time,
        work=work,
        energy=spent,
        unresolved=False,
        blind=False,
    )


def energy_after(scene: Scene, state: State, trial: Trial) -> energy.Energy | None:
    """Energies at the end of a step; None where the memory is no series."""
    if state.energy is None:
        return None
    before, now = state.now, trial.instant
    assert isinstance(scene.memory, Modes)
    assert before.unit_displacement is not None
    assert now.unit_displacement is not None
    return energy.after_step(
        state.energy,
        scene.memory,
        state.memory,
        trial.length,
        trial.rule,
        (before.pressure, before.unit_displacement),
        (now.pressure, now.unit_displacement),
        scene.halfspace.cell_area,
        fresh=state.before is None,
        jumped=state.unresolved,
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


def _step(scene: Scene, state: State, trial: Trial) -> Step:
    """What is yielded of an accepted trial; as uncertain as the state is."""
    shown, converged = trial, trial.converged
    pressure, level = state.now.pressure, state.now.approach
    if not trial.apart and trial.length > 0 and scene.keeps(state.now.time) and scene.is_soft(trial.length):
        # The pressure of an implicit step belongs to the step, not to its end. A short step at constant
        # pressure shows the end's (largest error of a Kelvin-Voigt pressure 39 % -> 5e-8).
        alone = replace(state, before=None)
        shown = _attempt(scene, alone, "load", state.now.force, _DISCARDED * trial.length, "right", stated=True)
        state = _spent(state, shown)
        converged = converged and shown.converged
        pressure, level = shown.instant.pressure, shown.instant.approach
    now = replace(state.now, pressure=pressure)
    return Step(
        shown=now,
        displacement=shown.displacement,
        effective=shown.effective,
        level=level,
        control=trial.control,
        given=scene.program.gives(_number(scene, state)),
        bound=shown.bound,
        residual=shown.residual,
        uncertainty=state.uncertainty,
        converged=converged,
        scene=scene,
        state=state,
    )


def _number(scene: Scene, state: State) -> int:
    """Index of the segment that ended or goes on at the present instant."""
    return max(state.segment - (state.now.time <= state.began), 0)


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
    return scene, _on_larger(scene, state, offset)


def _on_larger(scene: Scene, state: State, offset: tuple[int, int]) -> State:
    """State on a larger grid, in which the present one begins at a cell; its companion too."""
    shape = scene.halfspace.shape
    memory = scene.memory.enlarged(state.memory, shape, offset, scene.halfspace.displacement)

    def moved(instant: Instant) -> Instant:
        if not instant.pressure.size:  # of a companion
            return instant
        return replace(instant, pressure=padded(instant.pressure, shape, offset), unit_displacement=None)

    now, before = moved(state.now), None if state.before is None else moved(state.before)
    glassy, _, carried = _predicted(scene, memory, 0.0, "linear")
    unit_displacement = scene.halfspace.displacement(now.pressure)
    now = replace(now, unit_displacement=unit_displacement)
    displacement = carried + glassy * unit_displacement
    companion = None if state.companion is None else _on_larger(scene, state.companion, offset)
    return replace(state, now=now, displacement=displacement, before=before, memory=memory, companion=companion)


# ----------------------------------------------------------------------------------------------------------------
# events: jumps, corners, contact lost and found


def _entered(scene: Scene, state: State) -> State:
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
    smooth = len(neighbours) == 1 and all(segment.duration > 0 for segment in joined)
    smooth = smooth and scene.remembers and not scene.is_soft(state.suggestion)
    unresolved = "approach" in neighbours and state.now.force > 0 and not scene.can_jump
    return replace(
        state,
        segment=index,
        began=state.now.time,
        start=start,
        before=None,
        suggestion=state.suggestion if smooth and state.now.force > 0 and not unresolved else 0.0,
        memory=scene.memory.restart(state.memory),
        # a corner of the approach is a jump of the load where the material cannot follow at once
        unresolved=unresolved,
        companion=None if state.companion is None else _entered(scene, state.companion),
    )


def _jump(scene: Scene, state: State, segment: Segment) -> tuple[Scene, Step]:
    """Zero-length segment: solved with the instantaneous compliance; left for the next step if there is none."""
    value = segment.value(0.0, state.start)
    if not scene.can_jump:
        return scene, _step(scene, _postponed(scene, state, segment, value), _at_rest(scene, state))
    while True:
        trial = _attempt(scene, state, segment.control, value, 0.0, "linear", stated=True)
        state = _spent(state, trial)
        companion, companion_trial = state.companion, None
        if companion is not None and not _outgrown(scene, trial.instant):
            start = segment.value(0.0, companion.start)
            companion_trial = _attempt(
                scene, companion, segment.control, start, 0.0, "linear", guess=beside(trial.instant)
            )
            state = _spent(state, companion_trial)
            companion = bare(_committed(scene, companion, companion_trial))
        if not any(_outgrown(scene, one.instant) for one in (trial, companion_trial) if one is not None):
            break
        scene, state = _enlarged(scene, state, state.now.time)
    state = _entered(scene, replace(_committed(scene, state, trial), companion=companion))
    step = _step(scene, state, trial)
    return scene, step if companion_trial is None else _compared(scene, step, companion_trial)


def _postponed(scene: Scene, state: State, segment: Segment, value: float) -> State:
    """State after a jump that the material cannot follow at once: the next step takes it."""
    if value == (state.now.force if segment.control == "load" else state.now.approach):
        return _entered(scene, state)
    if segment.control == "approach":
        raise InputError(
            f"at {state.now.time:g} s the approach jumps to {value:g} m, and the material has no instantaneous "
            "compliance: expected a ramp (over > 0), or a material that can jump"
        )
    entered = _entered(scene, state)
    following = scene.program.segments[entered.segment : entered.segment + 1]

    def jumping(one: State) -> State:
        start = value if following and following[0].control == "load" else one.start
        return replace(one, unresolved=True, start=start)

    companion = None if entered.companion is None else jumping(entered.companion)
    return replace(jumping(entered), companion=companion)


def next_event(scene: Scene, state: State, end: float) -> float:
    """Next kept time or the end of the segment, whichever comes first. [s]"""
    return min(scene.next_kept(state.now.time), end)


def _through(scene: Scene, state: State, segment: Segment) -> Iterator[Step]:
    """Accepted steps through a segment; the last one has entered the next segment.

    Steps go in pairs: the companion takes both as one, and the first is yielded when that has said how far it is off.
    """
    end = scene.program.corners[state.segment + 1]
    waiting: Step | None = None  # first step of a pair
    base = state  # where the pair began
    while state.now.time < end:
        event = next_event(scene, state, end)
        step: Step | None = None
        closing = state.now.time
        if state.now.force == 0 and not state.unresolved:
            closing = closing_time(scene, state, segment, event, partial(_touched, scene, state))
        if closing > state.now.time:
            if waiting is not None:
                yield waiting
                waiting = None
            step = _carried_apart(scene, state, segment, closing, end)
            scene, base = step.scene, step.state
            state = step.state
            if state.now.time in (event, end):
                yield step
            continue
        trial, error = _tried(scene, state, segment, event, end)
        state = _spent(state, trial)
        outgrown = _outgrown(scene, trial.instant)
        unjudged = waiting is not None and base.before is None  # nothing to extrapolate from: judged and rolled back
        shown = unjudged and waiting is not None and scene.keeps(waiting.shown.time)
        if not outgrown and _too_long(scene, state, segment, trial, error, shown):
            start, length = (base, state.now.time - base.now.time) if unjudged else (state, trial.length)
            state = _shortened(scene, start, state, segment, trial, error, length)
            waiting = None if unjudged else waiting
            continue
        alone = state.behind == 0 and trial.instant.time < end and not state.unresolved
        if not outgrown:
            step = _judged(scene, state, segment, trial, error, alone)
        if step is None:  # the grid is too small for this step, or for the companion's
            if waiting is not None:
                yield waiting
                waiting = None
            scene, state = _enlarged(scene, state, trial.instant.time)
            base = state
            continue
        if waiting is not None:
            yield _of_a_pair(waiting, step)
            waiting = None
        fresh = state.before is None and scene.time_step is None
        if alone and (fresh or (scene.remembers and scene.keeps(step.shown.time))):
            base, waiting = state if fresh else step.state, step
        else:
            base = step.state
            yield step
        state = step.state
        del trial, step  # their fields are not needed while the next step is computed


def _tried(scene: Scene, state: State, segment: Segment, event: float, end: float) -> tuple[Trial, float]:
    """A step as long as it seems good, and its estimated error."""
    length = step_length(scene, state, segment, event, end)
    arrival = event if length == event - state.now.time else state.now.time + length
    value = segment.value(arrival - state.began, state.start)
    # what a short discarded solve shows of a soft step's end is the step's own residual, magnified
    share = _MAGNIFIED if scene.is_soft(length) and scene.keeps(arrival) else 1.0
    rule, stated = rule_for(scene, state, length), scene.keeps(arrival)
    trial = _attempt(scene, state, segment.control, value, length, rule, share, stated=stated)
    trial = replace(trial, instant=replace(trial.instant, time=arrival))
    return trial, estimate(scene, state, trial, segment, event)


def _too_long(scene: Scene, state: State, segment: Segment, trial: Trial, error: float, shown: bool) -> bool:
    """Whether a step is to be tried again, shorter; ``shown``: it also judges one before it, which is kept."""
    if scene.time_step is not None or trial.length <= shortest_step(scene, state, segment):
        return False
    if _seems_to_open(state, segment, trial):
        held = segment.value(trial.instant.time - state.began, state.start) >= state.now.approach
        if held or math.isnan(error):
            return True
    limit = error_limit(scene, state, state.now.time if shown else trial.instant.time)
    return error > limit and not _in_vain(state, error)


def _seems_to_open(state: State, segment: Segment, trial: Trial) -> bool:
    """Where the approach is given, a step that is too long may undershoot and seem to open the contact."""
    return segment.control == "approach" and trial.apart and state.now.force > 0


def _in_vain(state: State, error: float) -> bool:
    """Whether a shorter step was hardly better: a cell that enters makes the pressure jump, however short the step."""
    return error > 0.93 * state.rejected_error


def _shortened(
    scene: Scene, start: State, state: State, segment: Segment, trial: Trial, error: float, length: float
) -> State:
    """State to try again from, with a step shorter than a length. [s]"""
    limit = error_limit(scene, state, trial.instant.time)
    blind = math.isnan(error) or _seems_to_open(state, segment, trial)
    shrink = 0.2 if blind else min(max(0.7 * math.sqrt(limit / error), 0.2), 0.5)
    return replace(
        start,
        suggestion=shrink * length,
        rejected_error=math.inf if blind else error,
        iterations=state.iterations,
        convolutions=state.convolutions,
    )


def _judged(scene: Scene, state: State, segment: Segment, trial: Trial, error: float, alone: bool) -> Step | None:
    """The accepted step, with what the companion says of it unless it waits for another; None if that outgrew."""
    time = trial.instant.time
    accepted = _committed(scene, state, trial)
    accepted = replace(
        accepted,
        suggestion=suggestion(scene, trial, error, state),
        blind=_in_vain(state, error) and error > error_limit(scene, state, time),
        rejected_error=state.rejected_error if state.before is None else math.inf,
    )
    if state.unresolved:  # the first short step stands for the jump
        accepted = _restarted(scene, accepted, trial.length)
    companion_trial = None
    if scene.remembers and alone:
        companion = bare(state) if state.companion is None else state.companion
        accepted = replace(accepted, companion=companion, behind=1)
    elif state.companion is not None:
        found = _caught_up(scene, accepted, segment, state.before if state.behind else None)
        if found is None:
            return None
        accepted, companion_trial = found
    if time == scene.program.corners[state.segment + 1]:
        accepted = _entered(scene, accepted)
    step = _step(scene, accepted, trial)
    asked = scene.keeps(time) or (state.behind > 0 and scene.keeps(state.now.time))
    if companion_trial is None:
        return step
    assert state.companion is not None
    compared = _compared(scene, step, companion_trial, state.companion.now.pressure, asked)
    if companion_trial.length > trial.length:
        end = scene.program.corners[state.segment + 1]
        ahead = max(1.0, growth(state, segment, time, next_event(scene, accepted, end))) if time < end else 1.0
        sharpness = sharpened(scene, state, compared.state, ahead)
        return replace(compared, state=replace(compared.state, sharpness=sharpness))
    return _stating(compared, compared.uncertainty.or_worse(state.uncertainty, 0.0))  # it took the same step


def _of_a_pair(waiting: Step, step: Step) -> Step:
    """The first step of a pair, with what is stated of it by the second."""
    companion = waiting.state.companion  # it waits where the pair began
    if companion is None:
        return waiting
    first, second = waiting.shown.time - companion.now.time, step.shown.time - waiting.shown.time
    part = first**3 / (first**3 + second**3)  # of what both add to the energies, which steps do by their cube
    return replace(waiting, uncertainty=waiting.uncertainty.or_worse(step.uncertainty, part))


def _restarted(scene: Scene, state: State, suggestion: float) -> State:
    """State from which nothing is extrapolated."""
    return replace(state, before=None, suggestion=suggestion, memory=scene.memory.restart(state.memory))


def _caught_up(
    scene: Scene, state: State, segment: Segment, together: Instant | None, rule: Rule | None = None
) -> tuple[State, Trial] | None:
    """State whose companion has come to the same instant by one step, and that step; None if it outgrew the grid.

    ``together`` is the state's instant where the companion is, if it is known.
    """
    companion = state.companion
    assert companion is not None
    time = state.now.time
    length = time - companion.now.time
    value = segment.value(time - companion.began, companion.start)
    rule = rule or rule_for(scene, companion, length, _COMPANION_GROWTH)
    guess = beside(state.now, companion.now, together)
    trial = _attempt(scene, companion, segment.control, value, length, rule, _COMPANION_SHARE, guess)
    trial = replace(trial, instant=replace(trial.instant, time=time))
    if _outgrown(scene, trial.instant):
        return None
    followed = _committed(scene, companion, trial)
    if companion.unresolved:
        followed = _restarted(scene, followed, 0.0)
    return replace(_spent(state, trial), companion=bare(followed), behind=0), trial


def _compared(
    scene: Scene, step: Step, companion_trial: Trial, earlier: Array | None = None, asked: bool = True
) -> Step:
    """A step with what its companion says of it."""
    companion = step.state.companion
    assert companion is not None
    return _stating(step, difference(scene, step, companion, companion_trial.displacement, earlier, asked))


def _stating(step: Step, uncertainty: Uncertainty) -> Step:
    """The step, with what is stated of it."""
    return replace(step, uncertainty=uncertainty, state=replace(step.state, uncertainty=uncertainty))


def _touched(scene: Scene, state: State, time: float) -> float:
    """Approach at which surfaces that are apart would touch at a time to come. [m]"""
    carried = _predicted(scene, state.memory, time - state.now.time, "linear")[2]
    return scene.lowest(scene.gap + carried)


def _carried_apart(scene: Scene, state: State, segment: Segment, until: float, end: float) -> Step:
    """One exact step without contact; the companion takes the same."""
    while state.behind:
        found = _caught_up(scene, state, segment, None)
        if found is None:
            scene, state = _enlarged(scene, state, state.now.time)
        else:
            state = found[0]
    value = segment.value(until - state.began, state.start)
    trial = _attempt(scene, state, segment.control, value, until - state.now.time, "linear")
    trial = replace(trial, instant=replace(trial.instant, time=until))
    carried = _restarted(scene, _committed(scene, _spent(state, trial), trial), 0.0)
    companion_trial = None
    if carried.companion is not None:
        apart = carried.companion.now.force == 0
        found = _caught_up(scene, carried, segment, None, "linear" if apart else "right")
        if found is None:  # the companion is in contact, beyond the grid
            return _carried_apart(*_enlarged(scene, state, until), segment, until, end)
        carried, companion_trial = found
        assert carried.companion is not None
        carried = replace(carried, companion=_restarted(scene, carried.companion, 0.0))
    if until == end:
        carried = _entered(scene, carried)
    step = _step(scene, carried, trial)
    return step if companion_trial is None or not scene.keeps(until) else _compared(scene, step, companion_trial)
