"""The choice of time steps: by an error estimate that costs nothing, onto kept times exactly.

The estimate is the difference between a solution and the linear extrapolation it was started from.
"""

from __future__ import annotations

import math

import numpy as np

from roughvisc.mechanics.loading import Segment
from roughvisc.mechanics.memory import Rule, mean_compliance, stiff_ratio
from roughvisc.mechanics.scene import Instant, Scene, State, Trial

# Share of the tolerance that a step may use where it lands on a kept time; twice that between kept times.
_SHARE = 0.5
#: Shortest step, in lengths of the segment.
SMALLEST_STEP = 1e-6
# Of displacements, relative to what the mean pressure could cause, beside the 1e-16 of each transform.
_ROUNDING = 1e-11


def _memory_share(scene: Scene) -> float:
    """Part of the compliance that comes with time: how much a wrong past can matter."""
    final = scene.compliance(scene.program.duration)
    return 1 - scene.compliance(0.0) / final if final > 0 else 0.0


def error_limit(scene: Scene, arrival: float) -> float:
    """Largest estimate with which a step that lands on a time is accepted."""
    return _SHARE * scene.tolerance * (1 if scene.keeps(arrival) else 2)


def step_length(scene: Scene, state: State, segment: Segment, event: float, end: float) -> float:
    """Length of the next step, landing exactly on events and never leaving a splinter before one."""
    distance = event - state.now.time
    if scene.time_step is not None:
        return distance / max(1, math.ceil(distance / scene.time_step * (1 - 1e-9)))
    length = state.suggestion or _first_length(scene, state, segment, event)
    length = max(length, SMALLEST_STEP * segment.duration)
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


def rule_for(scene: Scene, state: State, length: float) -> Rule:
    """Piecewise-linear pressure where it does not ring, else the damped two-step rule or its start."""
    if "bdf2" not in scene.memory.rules:
        return "linear"
    if state.before is None:
        return "euler" if scene.is_soft(length) else "linear"
    if stiff_ratio(scene.material, length) <= 0.5:
        return "linear"
    # as the ratio of steps grows the two-step rule turns into the trapezoidal one and rings
    return "bdf2" if length <= 2.4 * (state.now.time - state.before.time) else "euler"


def estimate(scene: Scene, state: State, trial: Trial, segment: Segment, event: float) -> float:
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
    difference = float(np.sum(np.abs(trial.instant.pressure - state.extrapolated(trial.length))))
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


def _error_constant(trial: Trial, last: float) -> float:
    """Error of a step's rule over the step's difference to the extrapolation; ``last`` is the step before. [s]"""
    return trial.length / (6 * (trial.length + last)) if trial.rule == "linear" else 1 / 3


def _fading(scene: Scene, state: State, trial: Trial, event: float) -> float:
    """What an error in the pressure of a step counts for at the next kept time.

    Where hardly any compliance is there at once, each cell that enters makes the pressure jump. What a step gets
    wrong then counts by its share of the creep till the next kept time; not so while contact recedes, when the
    pressure is smooth and what it was stays in the dent that it leaves.
    """
    if scene.times is None or not scene.is_soft(trial.length) or _receding(state, trial):
        return 1.0
    remaining = event - trial.instant.time
    own = mean_compliance(scene.material, trial.length)
    return own / mean_compliance(scene.material, trial.length + remaining)


def _receding(state: State, trial: Trial) -> bool:
    """Whether fewer cells are in contact after a step than before it."""
    return bool(np.count_nonzero(trial.instant.pressure) < np.count_nonzero(state.now.pressure))


def _growth(state: State, segment: Segment, time: float, event: float) -> float:
    """What is prescribed at the next event over what is now: errors are relative to the larger."""
    now = segment.value(time - state.began, state.start)
    then = segment.value(event - state.began, state.start)
    return then / now if now > 0 else 1.0


def suggestion(scene: Scene, trial: Trial, error: float, state: State) -> float:
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
