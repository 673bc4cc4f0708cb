"""Lengths of the pairs of steps: the error that a pair adds, and the length of the next pair.

`python workflows/benchmarks/step_constants.py "NAME=VALUE"` shows the effect of a constant. Numbers below are from it,
unless another command is named. The first three are convolutions of plain scenes with 1, 10 and 50 kept times, divided
by the convolutions with the present value. The next two are rows of cells in contact beyond the tolerance: with one
kept time, of 300, and with twenty, of 1,000.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

from roughvisc.mechanics.memory import LARGEST_GROWTH
from roughvisc.mechanics.program import Segment
from roughvisc.mechanics.scene import Point, Scene
from roughvisc.mechanics.stated_error import StepErrors, stated_over_difference

#: Length of the first pair after a corner that is not smooth, as a part of the segment: contact changes fast there.
#: Also the shortest pair that is repeated in halves because it misses the tolerance at a kept time, as a part of the
#: time since the segment began. :func:`arises_before` calls a pair short if it is shorter than this part of the time to
#: the next kept row. With 0.005: 1.01, 0.99, 0.98; with 0.02: 1.03, 1.01, 0.99.
FIRST_PAIR = 0.01
#: Growth of the compliance in the first pair after a jump. In a longer pair the pressure would relax far within a step,
#: and both solutions would share an error of the slow exponentials: `closed_forms.py cells-one waves`, bad rows.
RESOLVED = 1.5
#: Part of the tolerance that a pair may add to the difference of both solutions: usually, and for bodies with hardly
#: any instantaneous compliance. With ALLOWED_SOFT = 0.4 one in eight cases of such bodies has a row beyond the
#: tolerance. With 0.2 a third to a half of these cases are within it, for 1.1 times the convolutions; with 0.1 three in
#: five, for 1.26 times (`accuracy.py`).
ALLOWED = 0.25
ALLOWED_SOFT = 0.17
#: While the approach is held, the force relaxes as errors do, so that the errors of all pairs add up. All pairs until
#: the next kept time may add this many times the tolerance, each its share in the logarithm of the relaxation; and a
#: pair at least this part of what it may add elsewhere. The difference of both solutions counts, which is three times
#: the error. `closed_forms.py cells-one --scenes 1000 --seed 777003` has 26 of 2,000 rows beyond the tolerance. An
#: earlier version had 24; without ALLOWED_IN_HOLD it had 78, for 0.80 of the convolutions; with 4: 49, for 0.93; with
#: 1: 15, for 1.06; with LEAST_SHARE = 0.1: 14, for 1.31; with 0.5: 36, for 0.90.
ALLOWED_IN_HOLD = 2.0
LEAST_SHARE = 0.3
#: Observed order of the error of a pair in its length; below 2 because cells enter and leave the contact within steps.
#: With 2: 1.00, 1.01, 0.98, and 4 and 10 rows beyond the tolerance instead of 3 and 7.
ORDER = 1.5
#: Smallest ratio of the lengths of successive pairs. With 0.5: 1.03, 1.01, 1.04. The largest ratio is LARGEST_GROWTH
#: over 1 + SLACK, because a pair may end later than planned.
SHRINK = 0.3
#: Least part of an error that counts as remaining after relaxation, because other errors do not fade. With
#: zero `closed_forms.py work-approach --seed 778` has 43 rows of 813 beyond the tolerance instead of 33.
LEAST_REMAINING = 0.02
#: A pair is rejected if the error that it adds exceeds the allowed error by this factor, and shorter steps are tried.
#: If they do not reduce its error, the shorter pair is accepted: a cell that enters the contact makes the pressure
#: jump, however short the pair is. If they had to reduce it by 7 %: 1.00, 1.07, 1.00.
REJECTED = 2.3
#: Shortest pair, as a part of the segment, or of the time from its start to its first kept time. Surfaces that are open
#: for less than this part of the time to the next event touch immediately. It fixes the first ages of a series
#: (`closed_forms.py cells-all`).
SHORTEST_PAIR = 1e-6
#: Least number of pairs in a period of a cycle. Without: rows seven tolerances off (`accuracy.py`).
PAIRS_OF_A_CYCLE = 8
#: A pair ends at a kept time, or at the end of its segment, that lies within this part of its length around its end.
#: With 0.05: 0.97, 0.97, 1.01, and 4 and 5 rows beyond instead of 3 and 7; with 0.4: 0.96, 1.00, 1.01, 4 and 2.
SLACK = 0.2
#: Times that differ by less than this part of a pair, a period, or the time to the next event are equal; approaches, if
#: they differ by less than this part of the largest displacement that the mean pressure could cause.
ROUNDED = 1e-9


@dataclass(frozen=True)
class Pair:
    """Fine and coarse solutions of a pair.

    Attributes
    ----------
    start, coarse_start : Point
        Both solutions before the pair.
    first, second : Point
        Fine solution after each step.
    coarse_step : Point
        Coarse solution at the end, in one step.
    end, coarse_end : Point
        Both solutions at the end; if the pair is soft and has a kept row, with the pressures at that time.
    is_soft : bool
        Whether hardly any of the compliance of the pair is instantaneous.
    has_row : bool
        Whether the pair contains a kept row.
    """

    start: Point
    coarse_start: Point
    first: Point
    second: Point
    coarse_step: Point
    end: Point
    coarse_end: Point
    is_soft: bool
    has_row: bool

    @property
    def length(self) -> float:
        """Length of the pair. [s]"""
        return self.second.time - self.start.time

    @property
    def has_final_pressure(self) -> bool:
        """Whether the pressures at the end differ from those of the second step."""
        return self.end is not self.second

    def unsolved(self) -> float:
        """Return the larger solver error of both solutions at the end, as a sum of pressures over the cells. [Pa]"""
        return max(self.second.solver_error, self.coarse_step.solver_error) * float(self.second.pressure.sum())

    def receding(self) -> bool:
        """Return whether cells have left the contact."""
        return bool((self.start.contact & ~self.second.contact).any())


class Largest(NamedTuple):
    """Largest forces and approaches until a pair, to which its errors are relative.

    Attributes
    ----------
    kept_force : float
        Largest force of the kept rows so far, of all steps if no times are given. [N]
    approach : float
        Under a load: largest approach of the kept rows; under an approach, which mostly is exact: of all steps. [m]
    force : float
        Largest force of all steps. [N]
    peak : tuple of float
        Force, approach and time of the last step whose force exceeded what relaxation had left of the peak before it.
        [N, m, s]
    """

    kept_force: float
    approach: float
    force: float
    peak: tuple[float, float, float]


@dataclass(frozen=True)
class Controller:
    """Choice between acceptance and repetition of a pair, and of the length to try next.

    Attributes
    ----------
    shortest : float
        Pairs that are not longer are accepted, and no shorter one follows. [s]
    refused : float
        Added error of the last refused trial of this pair, over the allowed error.
    refused_at_row : float
        Error at the row of the last trial that was refused for its row, over the tolerance; infinite if there is none.
    tried : float
        Length of the longest refused trial. [s]
    """

    shortest: float
    refused: float = math.inf
    refused_at_row: float = math.inf
    tried: float = 0.0

    def judge(self, taken: float, ratio: float, at_row: float, *, opens: bool) -> tuple[Controller | None, float]:
        """Return the controller and the length of the next trial, or None and the length of the next pair. [s]

        Parameters
        ----------
        taken : float
            Length of the pair. [s]
        ratio : float
            Error that the pair adds, over the allowed error.
        at_row : float
            Error at the end of the pair, over the tolerance, if the pair may be repeated for its row; otherwise zero.
        opens : bool
            Whether contact seems to end although it should not: too long a step may undershoot.
        """
        factor = max(ratio, 1e-300) ** (-1 / ORDER)
        is_too_long = REJECTED < ratio < self.refused
        misses = 1 < at_row < self.refused_at_row
        if taken > self.shortest:
            again = replace(self, refused=ratio, tried=max(self.tried, taken))
            if opens:  # whether or not the last trial had a larger error
                return self, SHRINK * taken
            if is_too_long:
                return again, taken * max(factor, SHRINK)
            if misses:
                return replace(again, refused_at_row=at_row), 0.5 * taken
        largest = LARGEST_GROWTH / (1 + SLACK)
        if self.refused <= ratio:  # the error does not depend on the length, and the next pair need not be as short
            proposed = min(self.tried, largest * taken) if self.refused_at_row == math.inf else taken
            return None, max(proposed, self.shortest)
        if self.refused < math.inf:  # after a refused trial steps do not grow (Hairer, Norsett, Wanner I, section II.4)
            largest = 1.0
        return None, max(taken * min(max(factor, SHRINK), largest), self.shortest)


def first_length(scene: Scene, segment: Segment, jumped: bool) -> float:
    """Return the length of the first pair of a segment; `jumped` is whether a contact has jumped before it. [s]"""
    length = FIRST_PAIR * min(segment.duration, segment.period)
    return scene.memory.grown_after(RESOLVED, length) if jumped and scene.can_jump else length


def shortest_length(scene: Scene, number: int) -> float:
    """Return the shortest length of a pair in a segment. [s]"""
    segment = scene.program.segments[number]
    began = scene.program.corners[number]
    return SHORTEST_PAIR * min(segment.duration, scene.next_kept(began) - began)


def pair_ends(scene: Scene, number: int, now: float, length: float, *, is_first: bool) -> tuple[float, float]:
    """Return the middle and the end of the next pair of about a given length in a segment. [s]

    The last kept time near the end of the pair becomes its end. The first pair after a corner that is not smooth
    (`is_first`) ends at a kept time at the latest, because a fast relaxation in it may be over at its end. If
    `scene.time_step` is fixed, steps are at most that long, and kept times are the middle or the end of pairs.
    """
    segment = scene.program.segments[number]
    began, end = scene.program.corners[number : number + 2]
    if scene.time_step is not None:
        longest = scene.time_step * (1 + ROUNDED)  # up to rounding
        event = min(scene.next_kept(now), end)
        later = min(scene.next_kept(event), end)
        if event - now <= longest and event < later <= event + longest:
            return event, later
        pairs = max(math.ceil((event - now) / (2 * scene.time_step) - ROUNDED), 1)
        return now + (event - now) / (2 * pairs), event if pairs == 1 else now + (event - now) / pairs
    slack = SLACK
    if segment.amplitude:  # equal pairs in each period: the work of a cycle is a sum over evenly spaced points
        slack = ROUNDED
        turn = began + segment.period * math.ceil((now - began) / segment.period * (1 + ROUNDED) + ROUNDED)
        end = min(turn, end) if turn < end * (1 - ROUNDED) else end
    end = min(end, scene.next_kept(now)) if is_first else end
    pairs = max(math.ceil((end - now) / length - SLACK), 1)
    last = end if pairs == 1 else now + (end - now) / pairs
    latest = min(now + (1 + slack) * min(last - now, length), end)  # BDF2 allows no longer one
    near = scene.kept_within(now + (1 - slack) * (last - now), latest)
    last = near[-1] if near else last
    middle = now + (last - now) / 2
    rounded = scene.kept_within(middle - ROUNDED * (last - now), middle + ROUNDED * (last - now))
    return (rounded[0] if rounded else middle), last


def errors_over_allowed(
    scene: Scene, pair: Pair, number: int, error: StepErrors, former: StepErrors, largest: Largest
) -> tuple[float, float]:
    """Return the error that a pair adds at the next kept time, over the allowed error, and the error at its end.

    If the pair has a kept row, its end counts as the next kept time. The error at the end is relative to the tolerance,
    and zero if the end is not kept, or the pair is short or adds little. Errors are relative to the largest force and
    approach of the kept rows, of the pair, and of the next row as far as it is known. While the approach is held, they
    are relative to the largest force of the kept rows and the force that relaxation leaves until the next one. The
    force is at least the tolerance times the largest force of all steps.

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    pair : Pair
        Both solutions.
    number : int
        Index of the segment.
    error, former : StepErrors
        Error at the end of the pair, from the difference of both solutions, and stated error before the pair.
    largest : Largest
        Forces and approaches until the pair.
    """
    second = pair.second
    taken = pair.length
    force = max(largest.kept_force, pair.first.size, second.size, scene.least_force)
    least = least_approach(scene, second.time, force)
    approach = max(largest.approach, abs(pair.first.approach), abs(second.approach), least)

    of_pressure = of_approach = 0.0  # at the end, if it is a row
    factor, factor_of_approach = stated_over_difference(scene)
    # a pair that is short for its place in the segment is not repeated: see FIRST_PAIR
    if scene.keeps(second.time) and taken > FIRST_PAIR * (second.time - scene.program.corners[number]):
        # Most bodies state a part of the difference. The whole difference is compared with the tolerance, because rows
        # also state the errors of solver and series. The stated error of the pressure may be larger, and counts then.
        shared = error.shared + (0.0 if pair.is_soft else former.shared * scene.memory.remaining(taken))
        force_at_end = max(largest.kept_force, second.size, scene.least_force)
        approach_at_end = max(largest.approach, abs(second.approach), least)
        of_pressure = max(error.pressure / factor, error.pressure + shared) / force_at_end
        of_approach = error.approach / factor_of_approach / approach_at_end

    next_row = second.time if pair.has_row else min(scene.next_kept(second.time), scene.program.duration)
    rise = rise_until(scene, number, second, next_row)
    expected = 0.0 if pair.has_row else force_ahead(scene, pair, next_row, largest)
    # under a load the approach grows at least as the root of the load: a cone
    scales = max(force, second.size * rise, expected), max(approach, abs(second.approach) * rise**0.5)
    allowed = ALLOWED_SOFT if scene.becomes_soft else ALLOWED
    left, share = relaxed_in_hold(scene, pair, number, next_row)
    if share < 1:
        scales = max(largest.kept_force, second.size * left, scene.least_force), scales[1]
        allowed = min(allowed, max(ALLOWED_IN_HOLD * share, LEAST_SHARE * allowed))
    # just after surfaces touch again, errors from before may exceed the force, and no step resolves it
    scales = max(scales[0], scene.tolerance * largest.force), scales[1]
    ratio = added_error(scene, pair, number, next_row, scales) / (allowed * scene.tolerance)
    if max(ratio, error.shared / force / (allowed * scene.tolerance)) <= 1:  # the errors are from before the pair
        of_pressure = of_approach = 0.0
    return ratio, max(of_pressure, of_approach) / scene.tolerance


def arises_before(scene: Scene, pair: Pair) -> bool:
    """Return whether an error from before a pair may explain how the difference of both solutions changes in it.

    This is so in four cases:

    - A cell is in contact in one solution only. The difference then grows, however short the pair is.
    - The difference of the approaches falls.
    - The difference of the approaches is constant, and that of the pressures changes by no more than the error of the
      contact solver. The coarse solution may then alternate between two states.
    - The difference of the approaches is constant, the pair is much shorter than the time to the next kept row, and
      relaxation may change the difference of the pressures by as much.
    """
    if bool((pair.start.contact != pair.coarse_start.contact).any()):
        return True
    before = pair.start.approach - pair.coarse_start.approach
    after = pair.second.approach - pair.coarse_step.approach
    if abs(after - before) > ROUNDED * abs(pair.second.approach):
        return after * before > 0 and abs(after) < abs(before)
    former = pair.start.pressure - pair.coarse_start.pressure
    change = float(abs(pair.second.pressure - pair.coarse_step.pressure - former).sum())
    ahead = min(scene.next_kept(pair.second.time), scene.program.duration) - pair.second.time
    faded = 0.0
    if not pair.has_row and pair.length < FIRST_PAIR * ahead:
        faded = (1 - scene.memory.remaining(pair.length)) * float(abs(former).sum())
    return change <= max(faded, pair.unsolved())


def least_approach(scene: Scene, time: float, force: float) -> float:
    """Return the smallest approach that errors are relative to: its rounding error. [m]

    A flat periodic surface has no larger approach.

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    time, force : float
        Time [s], and largest force until then. [N]
    """
    rounding = ROUNDED * scene.memory.compliance(time) * scene.grid.largest_eigenvalue
    return max(rounding * force / (scene.gap.size * scene.grid.cell_area), 1e-300)


def force_ahead(scene: Scene, pair: Pair, next_row: float, largest: Largest) -> float:
    """Return the force that divides the error at the next kept time, as far as the program tells; else zero. [N]

    - Under a load: the prescribed load.
    - Under an approach that grows until then: the force grows at least in proportion to the approach, and from the
      present force to the peak.
    - If the surfaces are surely apart then, any error of the pressure is gone: the largest force of all steps.
    - If the present rates of force and approach lead to open surfaces: the peak, because the contact may last longer.

    With adhesion surfaces are never without force, and zero is returned.

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    pair : Pair
        Both solutions.
    next_row : float
        Next kept time. [s]
    largest : Largest
        Forces and approaches until the pair.
    """
    point = pair.second
    control, value = scene.program.known(next_row)
    if math.isnan(value) or scene.adhesion is not None:
        return 0.0
    if control == "load":
        return value or largest.force
    first_touch = float(scene.gap[scene.solid].min())
    if value <= first_touch:  # the undeformed surface is the highest
        return largest.force
    force, approach, then = largest.peak
    peak = force * scene.memory.remaining(point.time - then)
    if value <= point.approach:
        fallen = pair.start.size - point.size
        receded = pair.start.approach - point.approach
        will_part = fallen > 0 and receded > 0 and point.size * receded <= fallen * (point.approach - value)
        return peak if will_part else 0.0
    grown = point.size * (value - first_touch) / max(point.approach - first_touch, 1e-300)
    if approach <= point.approach:
        return grown
    fraction = min((value - point.approach) / (approach - point.approach), 1.0)
    return max(grown, point.size + fraction * max(peak - point.size, 0.0))


def relaxed_in_hold(scene: Scene, pair: Pair, number: int, next_row: float) -> tuple[float, float]:
    """Return the part of the force that is left at the next kept time, and the share of a pair in the relaxation.

    The share is the ratio of the logarithm of the relaxation in the pair to that from the last kept time to the next
    one. Both results are one if the approach is not held until then, if the surfaces are open, or if no relaxation
    function is known. For the parameters see :func:`added_error`.
    """
    segment = scene.program.segments[number]
    began, end = scene.program.corners[number : number + 2]
    is_held = segment.control == "approach" and segment.holds
    if not is_held or next_row > end or pair.second.is_open or scene.kept is None:
        return 1.0, 1.0
    relaxation = scene.memory.relaxation
    times = max(scene.last_kept(pair.start.time), began), pair.start.time, pair.second.time, next_row
    last, before, after, then = (max(relaxation(time - began), ROUNDED) for time in times)
    if then >= last * (1 - ROUNDED):
        return 1.0, 1.0
    return max(then / after, LEAST_REMAINING), math.log(before / after) / math.log(last / then)


def rise_until(scene: Scene, number: int, point: Point, next_row: float) -> float:
    """Return the growth of the prescribed value until the next kept time, at least one."""
    until = min(next_row, scene.program.corners[number + 1])
    now = scene.program.prescribed(number, point.time, point.segment_start)
    then = scene.program.prescribed(number, until, point.segment_start)
    return max(then / now, 1.0) if now > 0 else 1.0


def added_error(scene: Scene, pair: Pair, number: int, next_row: float, scales: tuple[float, float]) -> float:
    """Return the error that a pair adds at the next kept time: of pressure, approach, and displaced surface.

    The error is the change of the difference between both solutions over the pair, from its value before the pair or
    from the part that relaxation leaves of this value, whichever is smaller. If the pair is soft and has a kept row, it
    is at most the difference at the end, because a soft step has one pressure for the whole step. If both solutions
    start from the same point, a difference of the pressures within the error of the contact solver does not count.

    Errors of the approach under a load do not fade, and the errors of all pairs add up: if the error stated before the
    pair exceeds the tolerance, the error of the pair counts as many times, at most `REJECTED` times.

    Parameters
    ----------
    scene, pair, number : Scene, Pair, int
        Input, both solutions, and index of the segment.
    next_row : float
        Next kept time. [s]
    scales : tuple of float
        Force and approach to which errors are relative. [N, m]
    """
    memory = scene.memory
    factor_of_approach = stated_over_difference(scene)[1]
    second = pair.second
    coarse = pair.coarse_step
    taken = pair.length
    is_soft = pair.is_soft
    by_load = scene.program.segments[number].control == "load"
    receding = pair.receding()
    difference = second.pressure - coarse.pressure
    former = pair.start.pressure - pair.coarse_start.pressure
    change = float(abs(difference - former).sum())
    if is_soft:
        if pair.has_final_pressure:
            change = min(change, float(abs(pair.end.pressure - pair.coarse_end.pressure).sum()))
        remains = memory.compliance(taken) / memory.compliance(next_row - second.time + taken)
        remains = 1.0 if receding else remains
    else:
        change = min(change, float(abs(difference - memory.remaining(taken) * former).sum()))
        ahead = next_row - second.time
        left = 1.0
        if not by_load:  # the error arises about the middle of the pair, and has relaxed since: count from there
            ahead = next_row - pair.first.time
            left = memory.remaining(taken / 2)
        remains = max(memory.remaining(ahead) / left if left > 0 else 0.0, LEAST_REMAINING)
    if pair.coarse_start is pair.start and change <= pair.unsolved():
        change = 0.0  # shorter steps would not reduce the error of the contact solver
    error = change * scene.grid.cell_area / scales[0] * remains
    if by_load:
        before = pair.start.approach - pair.coarse_start.approach
        of_approach = abs(second.approach - coarse.approach - before)
        multiple = factor_of_approach * abs(before) / scales[1] / scene.tolerance
        error = max(error, of_approach / scales[1] * min(max(multiple, 1.0), REJECTED))
    if not by_load or second.is_open or is_soft:
        surface = memory.displacement(second.history)[0] - memory.displacement(coarse.history)[0]
        surface -= memory.displacement(pair.start.history)[0] - memory.displacement(pair.coarse_start.history)[0]
        error = max(error, float(abs(surface).max()) / scales[1] * (1.0 if is_soft or receding else remains))
    return error
