"""How long a step is: an error estimate that costs nothing, what of it is left at the next kept time, and the events.

Steps land on the kept times. What a step's error counts fades as the material relaxes until its pressure is shown.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.arrays import l1_distance
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.mechanics.hereditary.memory import STIFF, Rule
from roughvisc.mechanics.materials.prony import Prony, by_size
from roughvisc.mechanics.stepping.program import Segment
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.mechanics.stepping.state import State, Trajectory, Trial

Array = NDArray[np.float64]
# Ages at which the weight of a step is tabulated, over the shortest time of the material, and how many in a decade.
_YOUNGEST, _PER_DECADE = 1e-4, 12
# Part of what is allowed that the last step before a kept time may take by what it gets wrong of its own end.
_LAST = 0.06


class Fading:
    """How the errors of steps fade.

    Parameters
    ----------
    series : Prony
        The material, with an instantaneous compliance.
    duration : float
        No age is longer. [s]
    """

    def __init__(self, series: Prony, duration: float) -> None:
        times, weights = np.array(series.times), np.array(series.compliances)
        rates = gains = 1 / times
        if series.fluidity:
            rates, gains = np.append(rates, 0.0), np.append(gains, 1.0)
            weights = np.append(weights, series.fluidity)
        driven = np.sqrt(gains * weights / series.glassy)
        self._times, self._flows = times, bool(series.fluidity)
        decays, basis = np.linalg.eigh(np.diag(rates) + np.outer(driven, driven))
        self._decays = np.maximum(decays, 0.0)  # it is no less than that, to rounding
        self._driven = driven @ basis
        self._read = basis.T * np.sqrt(weights / (gains * series.glassy))
        fastest = 1 / float(self._decays.max())
        decades = max(np.log10(duration / (_YOUNGEST * fastest)), 1.0)
        self._ages = np.geomspace(_YOUNGEST * min(fastest, duration), duration, int(_PER_DECADE * decades))
        rate = np.maximum(np.exp(-np.outer(self._ages, self._decays)) @ self._driven**2, 0.0)
        self._left, root = rate / float(self._driven @ self._driven), np.cbrt(rate)
        past = np.cumsum(0.5 * (root[1:] + root[:-1]) * np.diff(self._ages))
        weight = root**2 * np.append(0.0, past)
        self._weights = np.maximum.accumulate(weight[::-1])[::-1]  # at this kept time or a later one

    def remaining(self, left: float) -> float:
        """Part of an error of the pressure that is left after a time. [s]"""
        return float(np.interp(left, self._ages, self._left))

    def weight(self, left: float, step: float) -> float:
        """Largest part of the error of a step that is left at a kept time.

        Parameters
        ----------
        left : float
            From the start of the step to the next kept time. [s]
        step : float
            Its length. [s]

        Notes
        -----
        The fewest steps that keep to what is allowed at a kept time err by what is left of that over
        ``rho(theta)^(2/3) int_0^theta rho^(1/3)`` each, with the rate ``rho(t) = b exp(-S t) b`` at which an error
        fades. What is left of it is not counted: it is taken as all. Steps that all use up what they may come to two
        to four times as much, and those of a march stay well below that, since their lengths double at most. What a
        step gets wrong of its own end does not follow from its mean error, and is asked for besides.
        """
        mean = float(np.interp(left, self._ages, self._weights))
        x = step / self._times
        kick = by_size(x, 0.1, lambda x: x / 6 * (1 - x / 2), lambda x: ((x - 2) + (x + 2) * np.exp(-x)) / x**2)
        if self._flows:
            kick = np.append(kick, step / 6)
        end = 6 * float(self._driven * np.exp(-self._decays * max(left - step, 0.0)) @ (self._read @ kick))
        return max(mean, abs(end) / _LAST)


#: Of a material in a program; asked for at every step.
_fading_of = lru_cache(maxsize=8)(Fading)


# Share of the tolerance that a step may use where it lands on a kept time; twice that between kept times.
_SHARE = 0.5
#: Shortest step, in lengths of the segment or of the way to the first kept time.
SMALLEST_STEP = 1e-6
# A cycle takes so many steps at least: what a sine loses in a cycle is then right within 2/3 (pi / n)^2, 2.6 %, and
# ten times better without the leading part of that.
_STEPS_A_CYCLE = 16
# The two-step rule is stable while steps grow by no more than 1 + sqrt(2) (E. Hairer, S. P. Norsett, G. Wanner, Solving
# Ordinary Differential Equations I, section III.5).
_GROWTH = 2.4
# The next step errs by curvature h^2 / 6 by the linear rule, and by curvature h (h + last) / 3 by the damped one. It
# aims at 0.7 of what is allowed: hence 0.7 times 6, and 0.7 times 12 in the quadratic equation for the damped rule.
_LINEAR, _DAMPED = 4.2, 8.4
# Steps double at most, or grow so many times where the estimate is below this part of what is allowed.
_FASTEST, _EASY = 4.0, 0.02
# What can be wrong by less than this part of the tolerance is not looked at.
_NOT_SEEN = 0.01
# Of a step's error, what does not fade counts: what it adds to the work, less its leading part.
_NOT_FADING = 0.35
# Of displacements, relative to what the mean pressure could cause, beside the 1e-16 of each transform.
_ROUNDING = 1e-11


def remaining_creep_fraction(scene: Scene, length: float) -> float:
    """Part of the compliance that a step of some length can get wrong: what creeps within it and after it. [-]

    Notes
    -----
    Pressure taken as linear in a step of length ``h`` is wrong by up to ``p'' h^2 / 8``. Later displacements inherit
    that by the creep that is still to come, ``C(T) - C(h)``; the displacement at the end of the step by
    ``int_0^h C'(s) 6 s (h - s) / h^2 ds``, which is ``C(h) - C(0)`` for slow creep and falls as ``6 tau / h`` for
    creep that ends at once: the least of two bounds stands for it.
    """
    final = scene.final
    if final == 0:
        return 0.0
    return (max(final - scene.compliance(length), 0.0) + _crept_within(scene, length)) / final


def counted(scene: Scene, state: State, length: float) -> float:
    """Part of the error of a step's pressure that counts, at the next kept time or a later one. [-]"""
    share, known = remaining_creep_fraction(scene, length), _fading(scene)
    left = scene.next_kept(state.now.time) - state.now.time
    if known is None or math.isinf(left):
        return share
    return min(share, max(known.weight(max(left, length), length), _NOT_FADING * share))


def remaining(scene: Scene, state: State) -> float:
    """Part of the error of a state's pressure that is left at the next kept time. [-]"""
    left, known = scene.next_kept(state.now.time) - state.now.time, _fading(scene)
    if known is None or math.isinf(left) or scene.keeps(state.now.time):
        return 1.0
    return known.remaining(left)


def _fading(scene: Scene) -> Fading | None:
    """How errors of the pressure fade; None where cells that enter make it jump, or waves fade each in its way."""
    if not (isinstance(scene.memory, Modes) and is_gentle(scene)):
        return None
    return _fading_of(scene.memory.material, scene.program.duration)


def is_gentle(scene: Scene) -> bool:
    """Whether the material follows at once so far that no cell that enters makes the pressure jump."""
    return scene.is_viscoelastic and not scene.is_soft


def _crept_within(scene: Scene, length: float) -> float:
    """What a step can get wrong of its own end. [1/Pa]"""
    at_end = scene.compliance(length)
    late = 6 * (at_end - scene.mean_compliance(length))
    return max(min(at_end - scene.glassy, late), 0.0)


def error_limit(scene: Scene, state: State, arrival: float) -> float:
    """Largest estimate with which a step that lands on a time is accepted."""
    return _allowed(scene, state) * (1 if scene.keeps(arrival) else 2)


def _allowed(scene: Scene, state: State) -> float:
    """Estimated error that a step may make. [-]"""
    return _SHARE * state.pace.sharpness * scene.tolerance


def step_length(scene: Scene, state: State, segment: Segment, event: float, end: float) -> float:
    """Length of the next step, landing exactly on events and never leaving a splinter before one."""
    distance = event - state.now.time
    if scene.time_step is not None:
        return distance / max(1, math.ceil(distance / scene.time_step * (1 - 1e-9)))
    length = state.pace.suggestion or _first_length(scene, state, segment, event)
    length = max(length, shortest_step(scene, state, segment))
    if segment.amplitude and remaining_creep_fraction(scene, length) > _NOT_SEEN * scene.tolerance:
        length = min(length, segment.period / _STEPS_A_CYCLE)
    if length >= distance * (1 - 1e-9):
        # steps go in pairs up to what is shown: a single one would not tell what it got wrong
        single = state.behind == 0 and event == end and (state.before is None or scene.keeps(end))
        seen = remaining_creep_fraction(scene, distance) > _NOT_SEEN * scene.tolerance
        return distance / 2 if single and seen else distance
    return distance / 2 if length > distance / 2 else length


def shortest_step(scene: Scene, state: State, segment: Segment) -> float:
    """No step is shorter: by the segment, or by the first time kept in it. [s]"""
    length = min(segment.duration, scene.next_kept(state.now.time) - state.began)
    return SMALLEST_STEP * length


def _first_length(scene: Scene, state: State, segment: Segment, event: float) -> float:
    """Length of the first step after an event: the longest that neither program nor creep make too inaccurate."""
    if not scene.is_viscoelastic:
        return math.inf if scene.times is not None else min(segment.duration, segment.period) / 20
    span, allowed = min(segment.duration, segment.period), 12 * _allowed(scene, state)
    glassy, length = scene.glassy, span
    while length > SMALLEST_STEP * span:
        now = scene.compliance(length)
        crept = _crept_within(scene, length) / now * min(1.0, now / glassy - 1) if glassy else 0.0
        if remaining_creep_fraction(scene, length) * (length / (0.2 * span)) ** 2 <= allowed and crept <= allowed:
            break
        length /= 1.5
    wrong = remaining_creep_fraction(scene, length)
    if state.now.force == 0:
        length = min(length, 2 * _allowed(scene, state) / wrong * (event - state.now.time)) if wrong else length
    if state.unresolved:
        length = min(length, _allowed(scene, state) * span)
    return length


def rule_for(scene: Scene, state: Trajectory, length: float, growth: float = _GROWTH) -> Rule:
    """Piecewise-linear pressure where it does not ring, else the damped two-step rule or its start.

    ``growth`` is the largest ratio of a step to the one before with which the two-step rule is taken.
    """
    if "bdf2" not in scene.memory.rules:
        return "linear"
    if state.before is None:
        return "euler" if scene.lacks_instantaneous_compliance(length) else "linear"
    if scene.stiff_ratio(length) <= STIFF:
        return "linear"
    # as the ratio of steps grows the two-step rule turns into the trapezoidal one and rings
    return "bdf2" if length <= growth * (state.now.time - state.before.time) else "euler"


def acceptance_error(scene: Scene, state: State, trial: Trial, segment: Segment, event: float) -> float:
    """Relative error in time of a step, from its difference to the extrapolation; NaN without one."""
    if state.before is None:
        return math.nan
    if not scene.is_viscoelastic:
        return 0.0
    # what contact leaves behind as it recedes does not fade as what stays in contact does, and the second step after an
    # event also judges the first one
    receding, second = _receding(state, trial), state.before.time <= state.began
    share = remaining_creep_fraction(scene, trial.length) if receding or second else counted(scene, state, trial.length)
    last = state.now.time - state.before.time
    ahead = max(1.0, growth(state, segment, trial.instant.time, event))
    soft = 1.0
    if segment.control == "load" and scene.glassy < 0.01 * scene.compliance(trial.length):
        since = state.contact_since
        elapsed = scene.compliance(trial.instant.time - since)
        soft = scene.compliance(max(event, trial.instant.time) - since) / elapsed if elapsed > 0 else 1.0
    force = max(state.largest_force, trial.instant.force * ahead)
    # rounding cannot tell a smaller approach from none: all that a flat surface has with periodic boundaries
    mean_pressure = trial.instant.force / (trial.instant.contact.size * scene.operator.cell_area)
    none = _ROUNDING * scene.compliance(trial.instant.time) * mean_pressure * scene.operator.stiffest
    approach = max(state.largest_approach, abs(trial.instant.approach) * ahead * soft, none)
    difference = l1_distance(trial.instant.pressure, state.extrapolated(trial.length)[0], scene.operator.threads)
    counts = force > 0 and not state.pace.ignore_pressure_error
    pressure_error = difference * scene.operator.cell_area / force if counts else 0.0
    ratio = trial.length / last
    if segment.control == "load":
        found, now, before, scale = trial.instant.approach, state.now.approach, state.before.approach, approach
    else:
        found, now, before, scale = trial.instant.force, state.now.force, state.before.force, force
    ahead_of_it = now + ratio * (now - before)
    if segment.control == "approach":  # no force is negative
        ahead_of_it = max(ahead_of_it, 0.0)
    scalar_error = abs(found - ahead_of_it) / scale if scale > 0 else 0.0
    faded = _faded(scene, state, trial, event)
    if segment.control == "approach":
        scalar_error *= faded
    if segment.control == "load" and scene.times is not None and is_gentle(scene) and not receding:
        scalar_error = 0.0  # while contact grows under a load the approach has none, whatever the steps
    return share * _error_constant(trial, last) * max(faded * pressure_error, scalar_error)


def _error_constant(trial: Trial, last: float) -> float:
    """Error of a step's rule over the step's difference to the extrapolation; ``last`` is the step before. [s]"""
    return trial.length / (6 * (trial.length + last)) if trial.rule == "linear" else 1 / 3


def _faded(scene: Scene, state: State, trial: Trial, event: float) -> float:
    """What an error in the pressure of a step counts for at the next kept time.

    Where hardly any compliance is there at once, each cell that enters makes the pressure jump. What a step gets
    wrong then counts by its share of the creep till the next kept time; not so while contact recedes, when the
    pressure is smooth and what it was stays in the dent that it leaves.
    """
    if scene.times is None or not scene.lacks_instantaneous_compliance(trial.length) or _receding(state, trial):
        return 1.0
    remaining = event - trial.instant.time
    own = scene.mean_compliance(trial.length)
    return own / scene.mean_compliance(trial.length + remaining)


def _receding(state: State, trial: Trial) -> bool:
    """Whether fewer cells are in contact after a step than before it."""
    return trial.instant.contact.count < state.now.contact.count


def growth(state: State, segment: Segment, time: float, event: float) -> float:
    """What is prescribed at the next event over what is now: errors are relative to the larger."""
    now = segment.value(time - state.began, state.start)
    then = segment.value(event - state.began, state.start)
    return then / now if now > 0 else 1.0


def suggestion(scene: Scene, trial: Trial, error: float, state: State) -> float:
    """Length of the next step."""
    if math.isnan(error) or state.before is None:
        return trial.length
    most = 2.0
    if error < _EASY * _allowed(scene, state) and scene.stiff_ratio(_FASTEST * trial.length) <= STIFF:
        most = _FASTEST
    if error == 0:
        return most * trial.length
    last = state.now.time - state.before.time
    constant = _error_constant(trial, last)
    curvature = error / (constant * trial.length * (trial.length + last))
    target = _allowed(scene, state) / curvature
    length = min(math.sqrt(_LINEAR * target), most * trial.length, scene.program.duration)
    if scene.stiff_ratio(length) > STIFF:
        length = 0.5 * (-trial.length + math.sqrt(trial.length**2 + _DAMPED * target))
    return max(min(length, most * trial.length), 0.2 * trial.length)
