"""The march through time: predict, solve, accept, yield.

:func:`march` presses a profile on a half-space through a loading program and yields every accepted step. It reduces
each step to an elastic contact problem by the memory, and chooses the steps by an error estimate that costs nothing:
the difference between a solution and the linear extrapolation it was started from.

All settings are a frozen :class:`Scene`, all that changes is a :class:`State`, a plain value: a rejected step costs
no state, and a march goes on from any state that it yielded.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import EdgeContactError, InputError
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.halfspace import HalfSpace
from roughvisc.mechanics.loading import Program, Segment
from roughvisc.mechanics.materials import Material
from roughvisc.mechanics.memory import Memory, Rule, mean_compliance, padded, stiff_ratio

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Share of the tolerance that a step may use where it lands on a kept time; twice that between kept times.
_SHARE = 0.5
# The relative duality gap of each step's contact problem, in units of the tolerance. Measured: at 0.1 what the solver
# leaves makes up most of the error, at 0.03 a tenth to a third, for a fifth more iterations. Under given approach the
# force is not fixed, and ten times less is needed.
_ALGEBRAIC = {"load": 0.03, "approach": 0.003}
# A step where the instantaneous compliance is below this part of the step's creep starts by backward Euler, and
# shows its pressure through one discarded short solve.
_SOFT = 0.1
_DISCARDED = 1e-3  # length of that solve, in steps
_MAGNIFIED = 1e-5  # share of the solver's tolerance that a step before it gets
_SMALLEST_STEP = 1e-6  # of the segment
# The approach stays below the least gap beyond the grid by this factor: what is shown of a step's end is solved anew.
_BEYOND = 1.05
# Of displacements, relative to what the mean pressure could cause, beside the 1e-16 of each transform.
_ROUNDING = 1e-11


@dataclass(frozen=True)
class Scene:
    """What is prescribed: nothing in it changes while the march goes on.

    Attributes
    ----------
    halfspace : HalfSpace
        Grid and boundary.
    gap : ndarray, shape (nx, ny)
        Undeformed gap at first touch, zero at the highest peak; any finite number where absent. [m]
    material, memory : Material, Memory
        The material and the form in which its past is kept.
    program : Program
        What is prescribed, when.
    times : tuple of float or None
        Times to step onto exactly, ascending; None: none but the program's corners. [s]
    tolerance : float
        On the relative error in time of pressure (L1) and approach, relative to the largest values so far.
    time_step : float or None
        Fixed step; None chooses steps by the tolerance. [s]
    present : ndarray of bool or None
        Cells where there is material; None: all.
    accept_edge : bool
        In free space, whether cells at the border of the grid may carry pressure.
    enlarge : callable or None
        Where the grid gets too small for the contact: gives this scene on a larger grid and the cell of it at which
        the present grid begins, or None if the profile is not known farther out. The memory must be one of pressures.
    outside : float
        Least undeformed gap of the domain beyond the grid; infinite where the grid is all of it. [m]
    """

    halfspace: HalfSpace
    gap: Array
    material: Material
    memory: Memory
    program: Program
    times: tuple[float, ...] | None = None
    tolerance: float = 1e-3
    time_step: float | None = None
    present: Mask | None = None
    accept_edge: bool = False
    enlarge: Callable[[Scene], tuple[Scene, tuple[int, int]] | None] | None = None
    outside: float = math.inf

    def lowest(self, field: Array) -> float:
        """Least value over the present cells."""
        return float(np.min(field if self.present is None else field[self.present]))

    def compliance(self, t: float) -> float:
        """Contact compliance. [1/Pa]"""
        return float(self.material.contact_compliance(min(t, self.program.duration)))


@dataclass(frozen=True)
class Instant:
    """A state of the surfaces at one time.

    Attributes
    ----------
    time : float
        [s]
    pressure : ndarray, shape (nx, ny)
        [Pa]
    force, approach : float
        [N], [m]
    """

    time: float
    pressure: Array
    force: float
    approach: float


@dataclass(frozen=True)
class State:
    """All that a march needs to go on: a plain value.

    Attributes
    ----------
    now, before : Instant
        The present instant, and the one before if the next step may extrapolate from it.
    displacement : ndarray, shape (nx, ny)
        Total displacement of the half-space at the present instant. [m]
    memory : object
        State of the memory at the present instant.
    segment : int
        Index of the segment of the program.
    began, start : float
        Time at which the segment began [s], and the value of what it controls then [N or m].
    suggestion : float
        Length of the next step; zero after an event. [s]
    largest_force, largest_approach : float
        So far. [N], [m]
    contact_since : float
        Time at which the surfaces last came into contact. [s]
    work : float
        Work of the pressure on the displacement since the start; jumps count as quasi-static. [J]
    unresolved : bool
        Whether a jump was prescribed that the material cannot follow at once.
    blind : bool
        Whether the next estimate leaves the pressure out, once.
    rejected_error : float
        Estimate of the last attempt at this step, if it was rejected.
    iterations, convolutions : int
        Spent so far, rejected steps included.
    """

    now: Instant
    displacement: Array
    memory: Any
    before: Instant | None = None
    segment: int = 0
    began: float = 0.0
    start: float = 0.0
    suggestion: float = 0.0
    largest_force: float = 0.0
    largest_approach: float = 0.0
    contact_since: float = 0.0
    work: float = 0.0
    unresolved: bool = False
    blind: bool = False
    rejected_error: float = math.inf
    iterations: int = 0
    convolutions: int = 0


@dataclass(frozen=True)
class Step:
    """An accepted step.

    Attributes
    ----------
    shown : Instant
        What to report: the state's present instant, its pressure resolved where the material cannot jump.
    displacement : ndarray, shape (nx, ny)
        Total displacement of the half-space then. [m]
    effective : ndarray or None
        Effective pressure ``q``, the displacement's source, where the memory is one of pressures. [-]
    level : float
        Rigid-body approach that belongs to the displacement: ``gap = undeformed gap + displacement - level``. [m]
    bound : float
        Bound on the relative error of the pressure left by the contact solver, in the energy norm.
    time_error : float
        Estimated relative error in time of this step; NaN where no estimate was made.
    converged : bool
        Whether the contact solver reached its tolerance.
    scene : Scene
        The scene, on the grid that it has by now.
    state : State
        The state after the step.
    """

    shown: Instant
    displacement: Array
    effective: Array | None
    level: float
    bound: float
    time_error: float
    converged: bool
    scene: Scene
    state: State


@dataclass(frozen=True)
class _Trial:
    """A step that was computed and is not yet accepted."""

    instant: Instant
    displacement: Array
    effective: Array | None
    field: Array  # what the memory acts on
    length: float
    rule: Rule
    bound: float = 0.0
    converged: bool = True
    iterations: int = 0
    convolutions: int = 0

    @property
    def apart(self) -> bool:
        """Whether the surfaces are apart."""
        return self.instant.force == 0


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
            right_hand = _can_jump(scene) or state.now.time == 0
            if right_hand and not (following and following[0].duration == 0):
                yield _step(scene, state, trial or _at_rest(scene, state), math.nan)
            del trial  # its fields are not needed while the next step is computed
        else:
            for step in _through(scene, state, segment):
                scene, state = step.scene, step.state
                corner = state.segment < len(segments) and state.now.time == state.began
                if not (corner and segments[state.segment].duration == 0 and _can_jump(scene)):
                    yield step
                del step


def _rest(scene: Scene) -> State:
    now = Instant(0.0, np.zeros(scene.halfspace.shape), 0.0, scene.lowest(scene.gap))
    return State(now, np.zeros(scene.halfspace.shape), scene.memory.start(scene.halfspace.shape))


def _at_rest(scene: Scene, state: State) -> _Trial:
    nothing = np.zeros(scene.halfspace.shape)
    return _Trial(state.now, nothing, nothing if scene.memory.acts_on == "pressure" else None, nothing, 0.0, "linear")


def _can_jump(scene: Scene) -> bool:
    return scene.compliance(0.0) > 0


# ----------------------------------------------------------------------------------------------------------------
# one step


def _attempt(
    scene: Scene, state: State, control: str, value: float, length: float, rule: Rule, share: float = 1.0
) -> _Trial:
    """Contact state a step ahead, where the load or the approach has a given value.

    ``share`` scales the contact solver's tolerance.
    """
    alpha, carried = scene.memory.predict(state.memory, length, rule)
    effective = carried if scene.memory.acts_on == "pressure" else None
    if effective is not None:
        carried = scene.halfspace.displacement(effective)
    gap = scene.gap + carried
    time = state.now.time + length
    apart = value == 0 if control == "load" else value <= scene.lowest(gap)
    if apart:
        approach = scene.lowest(gap) if control == "load" else value
        nothing = np.zeros_like(gap)
        return _Trial(Instant(time, nothing, 0.0, approach), carried, effective, nothing, length, rule)
    if alpha <= 0:
        raise InputError(f"at {time:g} s a {control} jumps, and the material has no instantaneous compliance")
    area = scene.halfspace.cell_area
    contact = solve_contact(
        scene.halfspace,
        gap,
        load=value * alpha / area if control == "load" else None,
        approach=value if control == "approach" else None,
        tolerance=max(_ALGEBRAIC[control] * scene.tolerance * share, 1e-14),
        start=_extrapolated(state, length) * alpha,
        present=scene.present,
    )
    pressure = contact.pressure / alpha
    instant = Instant(
        time,
        pressure,
        value if control == "load" else contact.load / alpha * area,
        value if control == "approach" else contact.approach,
    )
    carried += contact.displacement
    return _Trial(
        instant,
        carried,
        None if effective is None else effective + contact.pressure,
        pressure if scene.memory.acts_on == "pressure" else contact.displacement / alpha,
        length,
        rule,
        contact.bound,
        contact.converged,
        contact.iterations,
        contact.convolutions + (effective is not None),
    )


def _extrapolated(state: State, length: float) -> Array:
    """Pressure a step ahead by the last two; the last one where there is no other."""
    if state.before is None or length == 0:
        return state.now.pressure
    ratio = length / (state.now.time - state.before.time)
    return np.maximum(state.now.pressure + ratio * (state.now.pressure - state.before.pressure), 0)


def _committed(scene: Scene, state: State, trial: _Trial) -> State:
    """State after an accepted trial."""
    memory = scene.memory.advance(state.memory, trial.length, trial.rule, trial.field)
    now = trial.instant
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


def _spent(state: State, trial: _Trial) -> State:
    return replace(
        state,
        iterations=state.iterations + trial.iterations,
        convolutions=state.convolutions + trial.convolutions,
    )


def _step(scene: Scene, state: State, trial: _Trial, time_error: float) -> Step:
    """What is yielded of an accepted trial."""
    shown, converged = trial, trial.converged
    pressure, level = state.now.pressure, state.now.approach
    if not trial.apart and trial.length > 0 and _kept(scene, state.now.time) and _soft(scene, trial.length):
        # The pressure of an implicit step belongs to the step, not to its end. A short step at constant
        # pressure shows the end's (largest error of a Kelvin-Voigt pressure 39 % -> 5e-8).
        bare = replace(state, before=None)
        shown = _attempt(scene, bare, "load", state.now.force, _DISCARDED * trial.length, "right")
        state = _spent(state, shown)
        converged = converged and shown.converged
        pressure, level = shown.instant.pressure, shown.instant.approach
    now = replace(state.now, pressure=pressure)
    return Step(now, shown.displacement, shown.effective, level, shown.bound, time_error, converged, scene, state)


def _soft(scene: Scene, length: float) -> bool:
    """Whether hardly any of a step's compliance is there at once."""
    return scene.compliance(0.0) < _SOFT * scene.compliance(length)


def _kept(scene: Scene, time: float) -> bool:
    return scene.times is None or time in scene.times


def _outgrown(scene: Scene, instant: Instant) -> bool:
    """Whether the grid is too small: contact cannot be excluded beyond it, or has reached the domain's border."""
    if scene.outside < math.inf:
        return _BEYOND * instant.approach >= scene.outside
    return at_edge(scene, instant.pressure)


def at_edge(scene: Scene, pressure: Array) -> bool:
    """Whether pressure at the border of a free-space domain acts as the edge of a punch that nobody asked for."""
    if scene.halfspace.boundary != "free" or scene.accept_edge:
        return False
    return any(bool(np.any(side > 0)) for side in (pressure[0], pressure[-1], pressure[:, 0], pressure[:, -1]))


def edge_error(scene: Scene, time: float) -> EdgeContactError:
    """The error to raise where the grid cannot grow."""
    nx, ny = scene.halfspace.shape
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
    memory = scene.memory.enlarged(state.memory, shape, offset)

    def moved(instant: Instant) -> Instant:
        return replace(instant, pressure=padded(instant.pressure, shape, offset))

    now, before = moved(state.now), None if state.before is None else moved(state.before)
    glassy, carried = scene.memory.predict(memory, 0.0, "linear")
    displacement = scene.halfspace.displacement(carried + glassy * now.pressure)
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
        unresolved="approach" in neighbours and state.now.force > 0 and not _can_jump(scene),
    )


def _jump(scene: Scene, state: State, segment: Segment) -> tuple[Scene, State, _Trial | None]:
    """Zero-length segment: solved with the instantaneous compliance; left for the next step if there is none."""
    value = segment.value(0.0, state.start)
    if not _can_jump(scene):
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
        length = _length(scene, state, segment, event, end)
        arrival = event if length == event - state.now.time else state.now.time + length
        rule = _rule(scene, state, length)
        value = segment.value(arrival - state.began, state.start)
        # what a short discarded solve shows of a soft step's end is the step's own residual, magnified
        share = _MAGNIFIED if _soft(scene, length) and _kept(scene, arrival) else 1.0
        trial = _attempt(scene, state, segment.control, value, length, rule, share)
        trial = replace(trial, instant=replace(trial.instant, time=arrival))
        state = _spent(state, trial)
        if _outgrown(scene, trial.instant):
            if held is not None:
                yield held
                held = None
            scene, state = _enlarged(scene, state, arrival)
            continue
        error = _estimate(scene, state, trial, segment, event)
        limit = _SHARE * scene.tolerance * (1 if _kept(scene, arrival) else 2)
        fixed = scene.time_step is not None
        retry_is_vain = error > 0.93 * state.rejected_error
        # where the approach is given, a step that is too long may undershoot and seem to open the contact
        opens = segment.control == "approach" and trial.apart and state.now.force > 0
        too_long = (error > limit and not retry_is_vain) or opens
        if not fixed and too_long and length > _SMALLEST_STEP * segment.duration:
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
            suggestion=_suggestion(scene, trial, error, state),
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
        _, carried = scene.memory.predict(state.memory, time - now, "linear")
        if scene.memory.acts_on == "pressure":
            carried = scene.halfspace.displacement(carried)
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


def _carry_apart(scene: Scene, state: State, segment: Segment, until: float, end: float) -> tuple[State, _Trial]:
    """One exact step without contact."""
    value = segment.value(until - state.began, state.start)
    length = until - state.now.time
    apart_before = not np.any(state.now.pressure)
    trial = _attempt(scene, state, segment.control, value, length, "linear" if apart_before else "euler")
    trial = replace(trial, instant=replace(trial.instant, time=until))
    carried = replace(_committed(scene, state, trial), before=None, suggestion=0.0)
    carried = replace(carried, memory=scene.memory.restart(carried.memory))
    return (_entered(scene, carried) if until == end else carried), trial


# ----------------------------------------------------------------------------------------------------------------
# the choice of steps


def _memory_share(scene: Scene) -> float:
    """Part of the compliance that comes with time: how much a wrong past can matter."""
    final = scene.compliance(scene.program.duration)
    return 1 - scene.compliance(0.0) / final if final > 0 else 0.0


def _length(scene: Scene, state: State, segment: Segment, event: float, end: float) -> float:
    """Length of the next step, landing exactly on events and never leaving a splinter before one."""
    distance = event - state.now.time
    if scene.time_step is not None:
        return distance / max(1, math.ceil(distance / scene.time_step * (1 - 1e-9)))
    length = state.suggestion or _first_length(scene, state, segment, event)
    length = max(length, _SMALLEST_STEP * segment.duration)
    if "bdf2" not in scene.memory.rules:
        length = min(length, _longest_linear(scene, distance))
    if length >= distance * (1 - 1e-9):
        return distance
    return distance / 2 if length > distance / 2 else length


def _longest_linear(scene: Scene, distance: float) -> float:
    """Longest step in which pressure taken as linear does not ring. [s]"""
    length = distance
    while stiff_ratio(scene.material, length) > 0.5 and length > 1e-9 * distance:
        length /= 2
    return length


def _first_length(scene: Scene, state: State, segment: Segment, event: float) -> float:
    """Length of the first step after an event."""
    share = _memory_share(scene)
    if share == 0:
        return math.inf if scene.times is not None else segment.duration / 20
    allowed = math.sqrt(12 * _SHARE * scene.tolerance)
    span = min(segment.duration, segment.period)
    length = min(0.2 * span * allowed, _time_of_creep(scene, allowed, span))
    if state.now.force == 0:
        length = min(length, 2 * _SHARE * scene.tolerance * (event - state.now.time))
    if state.unresolved:
        length = min(length, _SHARE * scene.tolerance * span)
    return length


def _time_of_creep(scene: Scene, relative: float, span: float) -> float:
    """Time in which the compliance grows by a part of its instantaneous value; ``span`` if longer or if none."""
    glassy = scene.compliance(0.0)
    if glassy == 0 or scene.compliance(span) < (1 + relative) * glassy:
        return span
    low, high = 1e-12 * span, span
    while high > 1.1 * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if scene.compliance(middle) < (1 + relative) * glassy else (low, middle)
    return low


def _rule(scene: Scene, state: State, length: float) -> Rule:
    """Piecewise-linear pressure where it does not ring, else the damped two-step rule or its start."""
    if "bdf2" not in scene.memory.rules:
        return "linear"
    if state.before is None:
        return "euler" if _soft(scene, length) else "linear"
    if stiff_ratio(scene.material, length) <= 0.5:
        return "linear"
    # as the ratio of steps grows the two-step rule turns into the trapezoidal one and rings
    return "bdf2" if length <= 2.4 * (state.now.time - state.before.time) else "euler"


def _estimate(scene: Scene, state: State, trial: _Trial, segment: Segment, event: float) -> float:
    """Relative error in time of a step, from its difference to the extrapolation; NaN without one."""
    if state.before is None:
        return math.nan
    share = _memory_share(scene)
    if share == 0:
        return 0.0
    last = state.now.time - state.before.time
    ahead = max(1.0, _growth(state, segment, trial.instant.time, event))
    soft = 1.0
    if segment.control == "load" and scene.compliance(0.0) < 0.01 * scene.compliance(trial.length):
        since = state.contact_since
        elapsed = scene.compliance(trial.instant.time - since)
        soft = scene.compliance(max(event, trial.instant.time) - since) / elapsed if elapsed > 0 else 1.0
    force = max(state.largest_force, trial.instant.force * ahead)
    approach = max(
        state.largest_approach, abs(trial.instant.approach) * ahead * soft, _unresolved_approach(scene, trial.instant)
    )
    difference = float(np.sum(np.abs(trial.instant.pressure - _extrapolated(state, trial.length))))
    pressure_error = difference * scene.halfspace.cell_area / force if force > 0 and not state.blind else 0.0
    ratio = trial.length / last
    if segment.control == "load":
        found, now, before, scale = trial.instant.approach, state.now.approach, state.before.approach, approach
    else:
        found, now, before, scale = trial.instant.force, state.now.force, state.before.force, force
    scalar_error = abs(found - (now + ratio * (now - before))) / scale if scale > 0 else 0.0
    fading = _fading(scene, state, trial, event)
    if segment.control == "approach":
        scalar_error *= fading
    return share * _error_constant(trial, last) * max(fading * pressure_error, scalar_error)


def _unresolved_approach(scene: Scene, now: Instant) -> float:
    """Approach that rounding cannot tell from none: all that a flat surface has with periodic boundaries. [m]"""
    pressure = now.force / (now.pressure.size * scene.halfspace.cell_area)
    return _ROUNDING * scene.compliance(now.time) * pressure * scene.halfspace.largest_influence


def _error_constant(trial: _Trial, last: float) -> float:
    """Error of a step's rule over the step's difference to the extrapolation; ``last`` is the step before. [s]"""
    return trial.length / (6 * (trial.length + last)) if trial.rule == "linear" else 1 / 3


def _fading(scene: Scene, state: State, trial: _Trial, event: float) -> float:
    """What an error in the pressure of a step counts for at the next kept time.

    Where hardly any compliance is there at once, each cell that enters makes the pressure jump. What a step gets
    wrong then counts by its share of the creep till the next kept time; not so while contact recedes, when the
    pressure is smooth and what it was stays in the dent that it leaves.
    """
    if scene.times is None or not _soft(scene, trial.length) or _receding(state, trial):
        return 1.0
    remaining = event - trial.instant.time
    own = mean_compliance(scene.material, trial.length)
    return own / mean_compliance(scene.material, trial.length + remaining)


def _receding(state: State, trial: _Trial) -> bool:
    """Whether fewer cells are in contact after a step than before it."""
    return bool(np.count_nonzero(trial.instant.pressure) < np.count_nonzero(state.now.pressure))


def _growth(state: State, segment: Segment, time: float, event: float) -> float:
    """What is prescribed at the next event over what is now: errors are relative to the larger."""
    now = segment.value(time - state.began, state.start)
    then = segment.value(event - state.began, state.start)
    return then / now if now > 0 else 1.0


def _suggestion(scene: Scene, trial: _Trial, error: float, state: State) -> float:
    """Length of the next step."""
    if math.isnan(error) or state.before is None:
        return trial.length
    if error == 0:
        return 2 * trial.length
    last = state.now.time - state.before.time
    constant = _error_constant(trial, last)
    curvature = error / (constant * trial.length * (trial.length + last))
    target = _SHARE * scene.tolerance / curvature
    length = min(math.sqrt(4.2 * target), 2 * trial.length, scene.program.duration)
    if stiff_ratio(scene.material, length) > 0.5:
        length = 0.5 * (-trial.length + math.sqrt(trial.length**2 + 8.4 * target))
    return max(min(length, 2 * trial.length), 0.2 * trial.length)
