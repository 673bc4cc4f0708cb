"""Time stepping: contact under a program of load or approach, on a viscoelastic body, with a stated error.

The solution proceeds by pairs of steps. A coarse solution takes each pair as one step. A part of the difference between
both solutions is the stated error at the end of the pair, and the change of this difference over the pair controls the
length of the next pair. The stated error also contains the uncertain pressure of cells that have just entered.

Errors are weighted by the part that relaxation leaves until the next kept time (:meth:`Memory.remaining`). A kept time
is the end or the middle of a pair.

If little of the compliance of a pair is instantaneous, the pair is *soft*. The pressure then jumps in each cell that
enters the contact, and the pressure of an implicit step belongs to the step and not to its end. The displaced surface
controls the length of the pair, and a short additional step gives the pressure of a kept row.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.grid import Grid, namespace, to_host
from roughvisc.mechanics.memory import STIFF, History, Memory, Rule
from roughvisc.mechanics.program import Program, Segment, Slide, instant
from roughvisc.mechanics.tangential import tangential_force

Array = Any  # an array of NumPy or CuPy
#: Arguments of :func:`first_guess`.
Guess = tuple["Point", "Point", "Point"]

#: A surface with at least this number of cells stores the pressure of its contact cells only, if they are less than
#: half of all cells.
PACKED_FROM = 1024**2
#: Length of the first pair after an event, as a part of the segment: contact changes fast after a corner.
FIRST_PAIR = 0.005
#: Part of the difference between the fine and the coarse solution that is stated as the error, of pressure and force,
#: and of the approach. The difference is three times the error at second order and the error at first order. Measured
#: on workflows/benchmarks/accuracy.py. Then the same for bodies with hardly any instantaneous compliance, whose first
#: steps are of first order.
STATED, STATED_SOFT = (0.6, 0.6), (1.0, 1.5)
#: Error of the work if the force is taken as linear over the approach and vanishes at one end, as a part of this work.
#: On a sphere it is a fifth, on a cone a third.
STRAIGHT = 0.25
#: Part of the tolerance that a pair may add to the error: usually; for bodies with hardly any instantaneous compliance;
#: and at least, however large the error is so far. With 0.4, one in eight cases of such bodies has a row beyond the
#: tolerance. With 0.2 a third to a half of these cases are within it, for 1.1 times the convolutions; with 0.1 three in
#: five, for 1.26 times.
SHARE, SHARE_SOFT, LEAST_SHARE = 0.4, 0.2, 0.2
#: Part of the error so far that a pair may add in any case. The error of a slide depends on the cells and may be large.
LEAST_CHANGE = 0.1
#: Part of the tolerance for the error so far and the error of a pair; safety factor of the length of the next pair.
BUDGET, PLANNED = 0.7, 0.9
#: Tolerance of the contact solver over the tolerance of the run.
SOLVER_SHARE = 0.2
#: Least part of an error that counts as remaining after relaxation, because other errors do not fade: usually, and if
#: cells leave the contact.
LEAST_REMAINING, RECEDING = 0.02, 0.5
#: Order of the error of a pair in its length, observed: cells enter and leave the contact within steps.
ORDER = 1.5
#: A pair is rejected if the error that it adds exceeds the allowed error by the first factor. Shorter steps are tried.
#: If they leave more than the second part of its error, the shorter pair is accepted: a cell that enters the contact
#: makes the pressure jump, however short the pair is.
REJECTED, REDUCED = 2.0, 0.93
#: Shortest pair that is repeated in halves because it misses the tolerance at a kept time, as a part of the time since
#: the segment began.
LANDING_PAIR = 0.01
#: Shortest pair, as a part of the segment, or of the time from its start to its first kept time.
SHORTEST_PAIR = 1e-6
#: Ratio of the lengths of successive pairs: smallest, largest, and largest if the added error is negligible.
SHRINK, GROW, GROW_FAST = 0.3, 2.3, 5.0
#: Negligible added error, as a part of the allowed error.
NEARLY_NOTHING = 0.02
#: Pair with an event between its steps: limits of the first step, as a part of the requested length of the pair, and
#: largest ratio of the steps.
SHORTEST_HALF, LONGEST_HALF, MOST_UNEQUAL = 0.15, 0.6, 2.0
#: Least number of pairs in a period of a cycle.
PAIRS_OF_A_CYCLE = 8
#: Force and approach are parabolas over a pair only if each of its steps covers at least this part of it.
LEAST_PART = 0.1
#: A pair of steps is soft if its compliance grows by more than this factor.
SOFT = 10.0
#: Length of the additional step that gives the pressure at the end of a soft step, as a part of the soft step.
END_STEP = 1e-3
#: Part of the usual tolerance of the contact solver in a soft step that ends at a kept time: the additional step
#: magnifies the residual.
MAGNIFIED = 3e-3
#: Part of the usual tolerance of the contact solver in a slide: a step of a slow slide changes the pressure little, and
#: the friction force is a small part of the load.
SLIDING_SHARE = 0.3
#: Uncertain part of the pressure of a cell that has just entered the contact, if the pressure is due to creep.
ENTERED = 0.3
#: Error of this pressure that both solutions of a pair may share, as a part of the pressure times the square of the
#: creep in the pair over the instantaneous compliance, and its largest value. Measured on random contacts of 2 x 40
#: cells with eight per cent instantaneous compliance, and of 21 x 16 cells with four.
SHARED, SHARED_AT_MOST = 0.1, 1.0
#: Largest error due to cells that have just entered, at a kept time inside a pair, as a fraction of the tolerance.
UNCERTAIN = 0.1
#: Pressure of a cell that may have entered the contact of a soft body, over the mean pressure.
ENTERING = 2.5
#: Rounding of displacements, relative to the largest displacement that the mean pressure could cause.
ROUNDING = 1e-11
#: Error of the time at which an open contact closes, as a part of the time to the next event. Surfaces that are apart
#: for less than the second part of this time touch immediately.
CLOSING, AT_ONCE = 1e-9, 1e-6


@dataclass
class Scene:
    """Input of the time stepping: surface, body, program and accuracy.

    Attributes
    ----------
    grid : Grid
        Cells, boundary and body.
    gap : array, shape (nx, ny)
        Gap of the undeformed surfaces at zero approach; any finite number at absent cells. [m]
    memory : Memory
        Material.
    program : Program
        Load or approach against time, and slides.
    kept : tuple of float or None
        Times of the kept rows, ascending; None: times of all steps. [s]
    tolerance : float
        Relative error of pressure (L1 norm), approach and force at kept times.
    time_step : float or None
        Fixed step; None: the tolerance controls the steps. [s]
    present : array of bool or None
        Cells with material; None: all.
    solid : array of bool or ellipsis
        Index of the cells with material.
    can_jump : bool
        Whether the body has an instantaneous compliance.
    stated : tuple of float
        Stated error over the difference between both solutions: of pressure and force, and of the approach.
    share : float
        Part of the tolerance that a pair may add to the error.
    motions : list of Slide or None
        Slide of each segment for the friction: its own, the last one, or the first; None without slides.
    """

    grid: Grid
    gap: Array
    memory: Memory
    program: Program
    kept: tuple[float, ...] | None = None
    tolerance: float = 1e-3
    time_step: float | None = None
    present: Array | None = None
    solid: Any = field(init=False)
    can_jump: bool = field(init=False)
    stated: tuple[float, float] = field(init=False)
    share: float = field(init=False)
    motions: list[Slide | None] = field(init=False)

    def __post_init__(self) -> None:
        self.solid = ... if self.present is None else self.present
        self.can_jump = self.memory.compliance(0.0) > 0
        is_soft = self.memory.grows(self.program.duration, SOFT)
        self.stated, self.share = (STATED_SOFT, SHARE_SOFT) if is_soft else (STATED, SHARE)
        motion, self.motions = None, []
        for segment in reversed(self.program.segments):
            motion = segment.slide or motion
        for segment in self.program.segments:
            motion = segment.slide or motion
            self.motions.append(motion)

    def keeps(self, time: float) -> bool:
        """Return whether a time is kept. [s]"""
        return self.kept is None or self.next_kept(math.nextafter(time, -math.inf)) == time

    def next_kept(self, time: float) -> float:
        """Return the first kept time after a time; infinite if there is none, or if every step is kept. [s]"""
        kept = self.kept or ()
        at = bisect_right(kept, time)
        return kept[at] if at < len(kept) else math.inf


@dataclass(frozen=True)
class Packed:
    """Field that is zero outside the contact. NumPy accepts it as an array.

    Attributes
    ----------
    shape : tuple of int
        Shape of the field.
    cells : array of int, shape (n,)
        Contact cells, as flat indices.
    values : array, shape (n,)
        Values there.
    """

    shape: tuple[int, int]
    cells: Array
    values: Array

    @property
    def nbytes(self) -> int:
        """Memory. [byte]"""
        return int(self.cells.nbytes + self.values.nbytes)

    def field(self) -> Array:
        """Return the whole field, an array of the kind of its values."""
        field = namespace(self.values).zeros(math.prod(self.shape))
        field[self.cells] = self.values
        return field.reshape(self.shape)

    def get(self) -> Packed:
        """Return the field with its arrays on the host."""
        return Packed(self.shape, to_host(self.cells), to_host(self.values))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.asarray(self.get().field(), dtype)


@dataclass(frozen=True)
class Point:
    """Solution at an instant.

    Attributes
    ----------
    time : float
        Time. [s]
    stored_pressure : array, shape (nx, ny), or Packed
        Pressure. [Pa]
    force, approach : float
        Normal force and approach. [N, m]
    history : History
        Memory of the body.
    before : tuple or None
        Time, stored pressure, and displacement per unit compliance of the last point: the next step extrapolates them.
    start : float
        Force [N] or approach [m] at the start of the segment, if the program does not state it.
    is_late : bool
        Whether the prescribed value has jumped and the body has no instantaneous compliance.
    solver_error, solver_error_approach : float
        Errors of the contact solver: relative error of the pressure (L1 norm), and error of the approach. [-, m]
    """

    time: float
    stored_pressure: Array | Packed
    force: float
    approach: float
    history: History
    before: tuple[float, Array | Packed, Array | None] | None = None
    start: float = 0.0
    is_late: bool = False
    solver_error: float = 0.0
    solver_error_approach: float = 0.0

    @property
    def pressure(self) -> Array:
        """Pressure at all cells, shape (nx, ny). [Pa]"""
        return self.stored_pressure.field() if isinstance(self.stored_pressure, Packed) else self.stored_pressure


@dataclass(frozen=True)
class Difference:
    """Stated error of the time steps, from the difference between the fine and the coarse solution.

    Attributes
    ----------
    pressure : float
        Error of the pressure: integral of its absolute value. [N]
    force, approach : float
        Errors of force and approach. [N, m]
    inside, outside : float
        Uncertain area in contact, and uncertain area out of contact. [m2]
    friction : float
        Error of the friction force of a slide. [N]
    shared : float
        Further error of the pressure, in cells that have entered the contact, which both solutions share. [N]
    """

    pressure: float = 0.0
    force: float = 0.0
    approach: float = 0.0
    inside: float = 0.0
    outside: float = 0.0
    friction: float = 0.0
    shared: float = 0.0

    def or_larger(self, other: Difference, part: float = 1.0) -> Difference:
        """Return the larger error of each kind, of this one and a part of the other."""
        larger = np.maximum(list(vars(self).values()), part * np.array(list(vars(other).values())))
        return Difference(*larger.tolist())


@dataclass(frozen=True)
class State:
    """State from which the time stepping can continue.

    Attributes
    ----------
    fine : Point
        Solution with the shorter steps.
    twice : Point or None
        Solution with steps twice as long, at the same instant; None while both solutions are equal.
    segment : int
        Index of the segment of the program.
    length : float
        Length of the next pair; zero after an event. [s]
    difference : Difference
        Stated error of the time steps.
    largest_force, largest_approach : float
        Largest values so far. [N, m]
    work : float
        Work of the normal force since the start. [J]
    work_apart : float
        Work of the coarse solution less the work of the fine one, both along straight paths. [J]
    work_curved : float
        Error of the quadrature of the work: root of the sum of the squares of all pairs. [J]
    distance : float
        Length of the path of the slides so far. [m]
    convolutions : int
        Number of convolutions so far, rejected pairs included.
    """

    fine: Point
    twice: Point | None = None
    segment: int = 0
    length: float = 0.0
    difference: Difference = Difference()
    largest_force: float = 0.0
    largest_approach: float = 0.0
    work: float = 0.0
    work_apart: float = 0.0
    work_curved: float = 0.0
    distance: float = 0.0
    convolutions: int = 0


class Step(NamedTuple):
    """Accepted step.

    Attributes
    ----------
    point : Point
        Fine solution, with the pressure at the end of the step.
    difference : Difference
        Error of the time steps.
    segment : int
        Index of the segment that the step belongs to.
    state : State
        State after the step, from which a march continues. In the middle of a pair it is the state before the pair,
        with the work and the path of the step.
    is_end : bool
        Whether a march may continue from the state; False in the middle of a pair.
    """

    point: Point
    difference: Difference
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
        if segments and segments[0].duration > 0:
            yield Step(state.fine, state.difference, 0, state)
    scene.grid.convolutions = state.convolutions
    while state.segment < len(segments):
        number, segment = state.segment, segments[state.segment]
        is_jump, is_start = segment.duration == 0, state.fine.time == 0
        if not is_jump:
            slide = segment.slide
            steps = pair_of_steps(scene, state, segment) if slide is None else pair_of_cells(scene, state, slide)
        elif scene.can_jump:
            steps = [single_step(scene, state, state.fine.time)]
        else:  # the next step takes the jump
            later = entered(scene, state)
            steps = [Step(later.fine, later.difference, number, later)]
        state = steps[-1].state
        jumps_next = number < state.segment < len(segments) and segments[state.segment].duration == 0
        if (jumps_next and (scene.can_jump or is_jump)) or (is_jump and not (scene.can_jump or is_start)):
            steps.pop()
        yield from steps
        steps = []  # frees their memory while the next steps are computed


# ---------------------------------------------------------------------------------------------------------- segments


def entered(scene: Scene, state: State) -> State:
    """Return the state at the start of the next segment.

    Without instantaneous compliance the first step of that segment takes a jump of the load before it.
    """
    segments, fine, index = scene.program.segments, state.fine, state.segment + 1
    last, following = segments[index - 1], segments[min(index, len(segments) - 1)]
    changes, load = following.control != last.control, fine.force
    if last.duration == 0 and not scene.can_jump:
        value = scene.program.prescribed(state.segment, fine.time, fine.start)
        if last.control == "load":
            load = value
        elif value != fine.approach:
            raise InputError(
                f"at {fine.time:g} s the approach jumps to {value:g} m, and the material has no instantaneous "
                "compliance: expected a ramp (over > 0), or a material that can jump"
            )
    # without instantaneous compliance a corner of the approach is a jump of the load
    jumps, jumped = not scene.can_jump and (changes or last.control == "approach"), load != fine.force
    points = []
    for point in (fine, state.twice or fine):
        start = point.approach if following.control == "approach" else load if jumped else point.force
        points.append(replace(without_past(point), start=start, is_late=jumped or (jumps and point.force > 0)))
    # a corner of the histories without a jump: the pairs may keep their length
    lasting = last.duration > 0 and last.slide is None and following.duration > 0 and following.slide is None
    length = state.length if lasting and not changes and not jumps and fine.force > 0 else 0.0
    return replace(state, fine=points[0], twice=points[1] if state.twice else None, segment=index, length=length)


def without_past(point: Point) -> Point:
    """Return a point without its past: the next step neither extrapolates nor uses the step before."""
    return replace(point, before=None, history=replace(point.history, earlier=None, step=0.0))


def single_step(scene: Scene, state: State, time: float) -> Step:
    """Return one step that both solutions take: a jump, or a step without contact or without memory."""
    fine, coarse, number = state.fine, state.twice or state.fine, state.segment
    new = other = take_step(scene, fine, time, number, rule="linear")
    if coarse is not fine:
        rule: Rule | None = "linear" if coarse.force == 0 else None
        other = take_step(scene, coarse, time, number, guess=(new, coarse, fine), rule=rule)
    apart = error_at(scene, fine, new, other, scene.motions[number])
    apart = replace(apart, shared=state.difference.shared * scene.memory.remaining(time - fine.time))
    reached, twice = new, other
    if new.force == 0 == fine.force and not fine.is_late:
        reached = without_past(new)
        twice = reached if other is new else without_past(other)
    work = state.work + work_of_step(scene, fine, new)
    after = after_steps(scene, state, [reached], twice, difference=apart, work=work)
    return Step(new, apart, number, after)


def step_apart(scene: Scene, state: State, closes: float) -> Step:
    """Return a step between open surfaces, to the time at which they touch. [s]

    Without instantaneous compliance the force jumps when a surface closes on its former imprint. The time of the jump
    is uncertain if the remaining gap is within the tolerance of the approach. The stated error is then the largest
    force.
    """
    step, largest = single_step(scene, state, closes), state.largest_force
    before, left = (touch(scene, point) - point.approach for point in (state.fine, step.point))
    if scene.can_jump or left >= min(before, scene.tolerance * state.largest_approach):
        return step
    return step._replace(difference=replace(step.difference, pressure=largest, force=largest, shared=0.0))


def pair_of_steps(scene: Scene, state: State, segment: Segment) -> list[Step]:
    """Return the next accepted steps of a segment: a pair, or one step. The last step has the state after them."""
    fine, coarse, number = state.fine, state.twice or state.fine, state.segment
    began, end = scene.program.corners[number : number + 2]
    event = min(scene.next_kept(fine.time), end)
    if fine.force == 0 and not fine.is_late:
        closes = closing_time(scene, state, segment, event)
        if closes > fine.time:
            return [step_apart(scene, state, closes)]
    if scene.memory.is_elastic:
        longest = (end - began) / 20 if scene.kept is None else math.inf
        parts = max(math.ceil((event - fine.time) / (scene.time_step or longest) * (1 - 1e-9)), 1)
        return [single_step(scene, state, fine.time + (event - fine.time) / parts if parts > 1 else event)]

    control, memory = segment.control, scene.memory
    length = 2 * (scene.time_step or 0.0) or state.length or FIRST_PAIR * min(segment.duration, segment.period)
    if segment.amplitude and scene.time_step is None:
        length = min(length, segment.period / PAIRS_OF_A_CYCLE)
    next_event = min(scene.next_kept(event), end)
    shortest = SHORTEST_PAIR * min(segment.duration, scene.next_kept(began) - began)
    fixed = (scene.time_step or 0.0) * (1 + 1e-9)  # longest step, up to rounding
    refused = refused_end = math.inf
    while True:
        # The pair, the same in one step, and the pressures at these instants.
        if not fixed:
            middle, last = pair_ends(fine.time, length, event, next_event)
        elif event - fine.time <= fixed and event < next_event <= event + fixed:
            middle, last = event, next_event
        else:
            middle, last = pair_ends(fine.time, length, event, event, slack=1e-9)
        taken = last - fine.time
        is_soft, lands = memory.grows(taken, SOFT), scene.keeps(last) or middle == event
        first, half = step_of_pair(scene, fine, middle, number, is_soft)
        second, whole = step_of_pair(scene, first, last, number, is_soft)
        once, other = step_of_pair(scene, coarse, last, number, is_soft, (second, coarse, fine))

        # Error at the end; errors due to cells that have just entered, in the middle and shared by both solutions.
        slide = scene.motions[number] if scene.keeps(last) or scene.keeps(middle) else None
        apart = error_at(scene, fine, whole, other, slide)
        left = 1.0 if is_soft else memory.remaining(middle - fine.time)
        unsure = entering(scene, fine, half)
        carried = state.difference.shared
        shared = carried * memory.remaining(taken)
        if scene.time_step is not None:
            break
        if lands and not is_soft:
            creep = memory.compliance(taken) / memory.compliance(0.0) - 1
            entered_pressure = float(second.pressure[fine.pressure == 0].sum())
            shared += min(SHARED * creep**2, SHARED_AT_MOST) * (entered_pressure * scene.grid.cell_area)
        # Errors are relative to the largest values, but an approach counts as at least its rounding error: a flat
        # surface with periodic boundaries has no larger approach.
        force = max(state.largest_force, first.force, second.force, 1e-300)
        rounding = ROUNDING * memory.compliance(last) * scene.grid.largest_eigenvalue * force / scene.gap.size
        approach = max(state.largest_approach, abs(first.approach), abs(second.approach), 1e-300)
        approach = max(approach, rounding / scene.grid.cell_area)
        ratio = added(scene, state, second, once, force, approach)
        factor = PLANNED * max(ratio, 1e-300) ** (-1 / ORDER)
        of_pressure = max(apart.pressure / scene.stated[0], apart.pressure + shared) / force
        of_approach = apart.approach / approach / scene.stated[1]
        at_end = max(of_pressure, of_approach) if lands and taken > LANDING_PAIR * (last - began) else 0.0

        # Accept the pair, or choose the length to try next.
        in_middle, allowed = middle == event and scene.keeps(event), scene.tolerance * force
        doubtful = unsure > UNCERTAIN * allowed or unsure + left * state.difference.pressure > 0.8 * allowed
        # too long a step may undershoot, so that contact seems to end under a held or growing approach
        opens = control == "approach" and fine.force > 0 and min(first.force, second.force) == 0
        too_long = ratio > REJECTED and ratio < REDUCED * refused
        misses = not too_long and ratio > NEARLY_NOTHING and scene.tolerance < at_end < 0.9 * refused_end
        if in_middle and doubtful:
            next_event = event  # the pair ends here, so that its error is known
        elif opens and second.approach >= fine.approach and taken > shortest:
            length = 0.2 * taken
        elif too_long and taken > shortest:
            refused, length = ratio, taken * max(factor, 0.2)
        elif misses and taken > shortest:
            refused, refused_end, length = ratio, at_end, taken * 0.5
        else:
            easy = ratio < NEARLY_NOTHING and not memory.grows(GROW_FAST * taken, STIFF)
            was_cut, asked = taken < 0.9 * length, length
            length = taken * min(max(factor, SHRINK), GROW_FAST if easy else GROW)
            if was_cut and factor >= 1 and not memory.grows(asked, STIFF):  # an event has cut the pair
                length = max(length, min(asked, factor * taken))
            break
        del first, second, once, half, whole, other  # frees their memory while the pair is repeated

    between = apart.or_larger(state.difference, left)
    (early, mean), (early_error, error) = work_of_pair(scene, fine, first, second)
    work, curved = state.work + mean, math.hypot(state.work_curved, error)
    apart = replace(apart, shared=shared)
    after = after_steps(scene, state, [first, second], once, length, difference=apart, work=work, work_curved=curved)
    work, curved = state.work + early, math.hypot(state.work_curved, early_error)
    work_apart = max(state.work_apart, after.work_apart, key=abs)
    inside = replace(state, work=work, work_curved=curved, work_apart=work_apart)
    between = replace(between, shared=unsure + carried * memory.remaining(middle - fine.time))
    return [Step(half, between, number, inside, is_end=False), Step(whole, apart, number, after)]


def pair_of_cells(scene: Scene, state: State, slide: Slide) -> list[Step]:
    """Return the next steps of a slide by one cell each, in the frame of the profile.

    The body moves backwards under the profile by whole cells, without interpolation. The step is then an elastic
    contact problem. The coarse solution moves by two cells per step. Only smaller cells reduce the error.
    """
    grid, memory, fine, coarse = scene.grid, scene.memory, state.fine, state.twice or state.fine
    began, end = scene.program.corners[state.segment : state.segment + 2]
    cells, side = slide.cells(grid.spacing), grid.spacing[slide.axis]
    taken = round((fine.time - began) / (end - began) * cells)
    count = 1 if memory.is_elastic else min(2, cells - taken)

    def over(here: Point, number: int, time: float, guess: Guess) -> Point:
        history = memory.roll(here.history, slide.sense * number, slide.axis)
        pressure = grid.xp.roll(here.pressure, -slide.sense * number, slide.axis)
        body = replace(here, history=history, stored_pressure=pressure, before=None)
        return take_step(scene, body, time, state.segment, guess=guess, share=SLIDING_SHARE)

    points, works = [fine], [0.0]
    for number in range(1, count + 1):
        here, time = points[-1], instant(began, end, taken + number, cells)
        points.append(over(here, 1, time, (here, here, here)))
        works.append(works[-1] + work_of_step(scene, here, points[-1], slides=True))
    once = last = points[-1]
    if coarse is not fine or count == 2:
        once = over(coarse, count, last.time, (last, coarse, fine))
    apart = error_at(scene, fine, last, once, slide)
    if count == 1:  # the coarse solution takes the same step
        apart = apart.or_larger(state.difference)
    if cells == 1 and not memory.is_elastic:  # there is no solution with longer steps
        apart = replace(apart, friction=abs(friction(scene, last, slide)))
    apart = replace(apart, shared=state.difference.shared * memory.remaining(last.time - fine.time))
    work, distance = state.work + works[-1], state.distance + count * side
    after = after_steps(scene, state, points[1:], once, difference=apart, work=work, distance=distance)
    inside = replace(state, work=state.work + works[1], distance=state.distance + side)
    ends = Step(last, apart, state.segment, after)
    return [Step(points[1], apart.or_larger(state.difference), state.segment, inside, is_end=False), ends][-count:]


def friction(scene: Scene, point: Point, slide: Slide) -> float:
    """Return the friction force of a point. [N]"""
    return tangential_force(scene.grid, point.pressure, scene.memory.displacement(point.history)[0], slide)


def added(scene: Scene, state: State, second: Point, once: Point, force: float, approach: float) -> float:
    """Return the error that a pair adds at the next kept time, over the allowed error.

    Errors are relative to the largest force [N] and approach [m].
    """
    fine, coarse, memory, taken = state.fine, state.twice or state.fine, scene.memory, second.time - state.fine.time
    control = scene.program.segments[state.segment].control
    following = min(scene.next_kept(math.nextafter(second.time, 0)), scene.program.duration)
    # errors are relative to the largest values, including the next kept time
    end = scene.program.corners[state.segment + 1]
    now = scene.program.prescribed(state.segment, second.time, second.start)
    then = scene.program.prescribed(state.segment, min(following, end), second.start)
    ahead = max(then / now, 1.0) if now > 0 else 1.0
    force, approach = max(force, second.force * ahead), max(approach, abs(second.approach) * ahead**0.5)
    soft = memory.grows(taken, SOFT)
    receding = bool(((fine.pressure > 0) & (second.pressure == 0)).any())

    # Change of the difference between both solutions over the pair, from its full value before the pair or from the
    # part that relaxation leaves of this value.
    after, before = second.pressure - once.pressure, fine.pressure - coarse.pressure
    change = float(abs(after - before).sum())
    if soft:
        remains = memory.compliance(taken) / memory.compliance(following - second.time + taken)
        remains = 1.0 if receding else remains
    else:
        change = min(change, float(abs(after - memory.remaining(taken) * before).sum()))
        remains = max(memory.remaining(following - second.time), RECEDING if receding else LEAST_REMAINING)
    change *= scene.grid.cell_area / force
    # the pressure of a soft body depends on the present change of contact, and hardly on earlier errors
    of_pressure, of_approach = scene.stated
    carried = 0.0 if soft else state.difference.pressure / of_pressure / force * memory.remaining(following - fine.time)
    changes = [(change * remains, carried)]
    if control == "load":
        change = abs((second.approach - once.approach) - (fine.approach - coarse.approach)) / approach
        changes.append((change, state.difference.approach / of_approach / approach))
    if control == "approach" or second.force == 0 or soft:
        surface = memory.displacement(second.history)[0] - memory.displacement(once.history)[0]
        surface -= memory.displacement(fine.history)[0] - memory.displacement(coarse.history)[0]
        changes.append((float(abs(surface).max()) / approach * (1.0 if soft or receding else remains), 0.0))

    ratio = 0.0
    for change, carried in changes:
        budget = max(BUDGET * scene.tolerance - carried, LEAST_SHARE * scene.tolerance)
        ratio = max(ratio, change / max(min(scene.share * scene.tolerance, budget), LEAST_CHANGE * carried))
    return ratio


def step_of_pair(
    scene: Scene, here: Point, time: float, number: int, is_soft: bool, guess: Guess | None = None
) -> tuple[Point, Point]:
    """Return the point a step ahead, and the same point with the pressure at its time if it is kept.

    The pressure of a soft step belongs to the step. A short additional step gives the pressure at its end. The load is
    constant in it, or the approach changes as before. For the other parameters see :func:`take_step`.
    """
    is_soft = is_soft and scene.keeps(time)
    point = take_step(scene, here, time, number, guess=guess, share=MAGNIFIED if is_soft else 1.0)
    if not (is_soft and point.force > 0):
        return point, point
    ahead, value = END_STEP * (time - here.time), point.force
    if scene.program.segments[number].control == "approach":
        value = 2 * point.approach - scene.program.prescribed(number, time - ahead, point.start)
    found = take_step(scene, without_past(point), time + ahead, number, value, rule="constant")
    return point, replace(found, time=time, approach=point.approach, before=point.before)


def error_at(scene: Scene, before: Point, fine: Point, coarse: Point, slide: Slide | None = None) -> Difference:
    """Return the stated errors of a fine solution, from its difference to the coarse solution at the same time.

    Parameters
    ----------
    scene : Scene
        Input of the time stepping.
    before : Point
        Fine solution before the step.
    fine, coarse : Point
        Both solutions, with the pressures at that time.
    slide : Slide or None
        Motion, if the error of the friction force is needed.
    """
    if fine is coarse:
        return Difference()
    grid, (stated, of_approach), held, other = scene.grid, scene.stated, fine.pressure, coarse.pressure
    pressure = stated * (float(abs(held - other).sum()) * grid.cell_area)
    approach = of_approach * abs(fine.approach - coarse.approach)
    force, of_friction = stated * abs(fine.force - coarse.force), 0.0
    if slide is not None:
        of_friction = abs(friction(scene, fine, slide) - friction(scene, coarse, slide))
    apart = Difference(pressure, force, approach, friction=of_friction)
    if not scene.keeps(fine.time) or fine.force == coarse.force == 0:
        return apart
    gap = scene.gap + scene.memory.displacement(fine.history)[0] - fine.approach
    near = scene.gap + scene.memory.displacement(coarse.history)[0] - coarse.approach
    inside = (held > 0) & (held <= abs(held - other))
    outside = (held == 0) & ((other > 0) | (gap <= abs(gap - near)))
    if scene.present is not None:
        outside &= scene.present
    cells, jumps = int((held > 0).sum()), 0.0
    if cells and scene.memory.grows(fine.time - before.time, SOFT):
        jumps = entering(scene, before, fine) + ENTERING * float(outside.sum()) * fine.force / cells
    uncertain = grid.cell_area * float(inside.sum()), grid.cell_area * float(outside.sum())
    return Difference(pressure + jumps, force, approach, *uncertain, of_friction)


def entering(scene: Scene, before: Point, after: Point) -> float:
    """Return the uncertain force of cells that have entered between two points. [N]"""
    compliance = scene.memory.compliance(after.time - before.time)
    creeping = 1 - scene.memory.compliance(0.0) / compliance if compliance > 0 else 0.0
    return ENTERED * creeping * (float(after.pressure[before.pressure == 0].sum()) * scene.grid.cell_area)


def after_steps(
    scene: Scene, state: State, points: list[Point], coarse: Point, length: float = 0.0, **totals: Any
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
    length : float
        Length of the next pair. [s]
    **totals
        Other attributes of the new state: difference, work and its error, distance.
    """
    fine, apart = points[-1], 0.0
    if coarse is not fine:
        apart = work_of_step(scene, state.twice or state.fine, coarse) - work_of_step(scene, state.fine, fine)
    reached = replace(
        state,
        fine=fine,
        twice=None if coarse is fine else replace(coarse, before=None),  # the coarse solution does not extrapolate
        length=length,
        largest_force=max(state.largest_force, points[0].force, fine.force),
        largest_approach=max(state.largest_approach, abs(points[0].approach), abs(fine.approach)),
        work_apart=state.work_apart + apart,
        convolutions=scene.grid.convolutions,
        **totals,
    )
    return entered(scene, reached) if fine.time == scene.program.corners[state.segment + 1] else reached


def work_of_pair(scene: Scene, start: Point, middle: Point, end: Point) -> tuple[list[float], list[float]]:
    """Return the work of the normal force in the first step of a pair and in both, and the errors of both values. [J]

    Force and approach are parabolas over time. If contact is lost in the second step, the force is a parabola over the
    approach instead, and vanishes at the approach of last contact. After a jump the load is constant. If the steps are
    too unequal, or the force would not fall steadily to zero, the force is linear over the approach in each step.
    """
    forces = [middle.force if start.is_late else start.force, middle.force, end.force]
    straight = np.cumsum([work_of_step(scene, start, middle), work_of_step(scene, middle, end)])
    begin = np.array([forces[0], touch(scene, start)])
    early = np.array([middle.force, touch(scene, middle)]) - begin
    mean = np.array([end.force, touch(scene, end)]) - begin
    t = np.array([middle.time, end.time]) - start.time if end.force > 0 else np.array([early[1], mean[1]])
    first, last = t.tolist()
    is_curved = middle.force > 0 and LEAST_PART * last**2 < first * last < (1 - LEAST_PART) * last**2
    if is_curved:
        bends = (mean / last - early / first) / (last - first)
        (rise, rate), (bend, turn) = (early / first - bends * first).tolist(), bends.tolist()
        is_curved = end.force > 0 or rise * (rise + 2 * bend * last) > 0
    if not is_curved:
        change = 1 - min(forces) / max(*forces, 1e-300)
        return straight.tolist(), (STRAIGHT * change * straight).tolist()
    terms = forces[0] * turn + rise * rate / 2, (2 * rise * turn + bend * rate) / 3, bend * turn / 2
    curved = t * (forces[0] * rate + t * terms[0] + t**2 * terms[1] + t**3 * terms[2])
    return curved.tolist(), (straight - curved).tolist()


def work_of_step(scene: Scene, before: Point, after: Point, slides: bool = False) -> float:
    """Return the work between two points. [J]

    In a jump, and if an elastic body does not slide, the instantaneous compliance stores all work. Otherwise the force
    is linear over the approach; after a jump it is constant.
    """
    memory = scene.memory
    if after.time == before.time or (memory.is_elastic and not slides):
        first = float((before.pressure * memory.displacement(before.history, 0.0)[0]).sum())
        last = float((after.pressure * memory.displacement(after.history, 0.0)[0]).sum())
        return 0.5 * last * scene.grid.cell_area - 0.5 * first * scene.grid.cell_area
    force = after.force if before.is_late else before.force
    return 0.5 * (force + after.force) * (touch(scene, after) - touch(scene, before))


def touch(scene: Scene, point: Point) -> float:
    """Return the approach of a point; while the surfaces are apart, the approach at which they would just touch. [m]"""
    if point.force > 0:
        return point.approach
    surface = scene.gap + scene.memory.displacement(point.history)[0]
    return max(point.approach, float(surface[scene.solid].min()))


def pair_ends(now: float, length: float, event: float, next_event: float, slack: float = 0.2) -> tuple[float, float]:
    """Return the middle and the end of the next pair of about a given length. [s]

    A near event becomes the end or the middle of the pair. The steps have similar lengths, because the coarse solution
    differs little from the fine one if one of two steps is much longer. The pair is longer by at most the part `slack`
    if this saves a pair.
    """
    first, second = event - now, next_event - event
    if SHORTEST_HALF * length <= first <= LONGEST_HALF * length and second >= first / MOST_UNEQUAL:
        is_near = second <= (MOST_UNEQUAL + SHORTEST_HALF) * first  # leave no very short step
        return event, next_event if is_near else event + MOST_UNEQUAL * first
    pairs = max(math.ceil((event - now) / length - slack), 1)
    return now + (event - now) / (2 * pairs), event if pairs == 1 else now + (event - now) / pairs


# ------------------------------------------------------------------------------------------------------------- steps


def take_step(
    scene: Scene,
    here: Point,
    time: float,
    number: int,
    value: float | None = None,
    guess: Guess | None = None,
    rule: Rule | None = None,
    share: float = 1.0,
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
    guess : tuple of Point, optional
        Points of the first guess, see :func:`first_guess`. Default: extrapolation.
    rule : {"linear", "bdf2", "constant"}, optional
        Rule of the memory.
    share : float
        Part of the usual tolerance of the contact solver.

    Raises
    ------
    ConvergenceError
        If the contact solver does not converge.
    """
    memory, step, area, segment = scene.memory, time - here.time, scene.grid.cell_area, scene.program.segments[number]
    by_load = segment.control == "load"
    value = scene.program.prescribed(number, time, here.start) if value is None else value
    prediction = memory.predict(here.history, step, "constant" if here.is_late else rule)
    alpha, gap, grid = prediction.compliance, prediction.carried, prediction.grid or scene.grid
    gap += scene.gap
    lowest = float(gap[scene.solid].min())
    common = here.history.fields[0] if prediction.grid is None else None  # displacement per unit compliance
    before = (here.time, here.stored_pressure, common) if step > 0 and not here.is_late else None
    if (value == 0) if by_load else (value <= lowest):
        nothing = grid.xp.zeros(gap.shape)
        history = memory.advance(here.history, prediction, nothing, nothing)
        return Point(time, nothing, 0.0, lowest if by_load else value, history, before, here.start)
    pressure, unit = first_guess(*guess) if guess else (here.pressure, common)
    if guess is None and here.before is not None and step > 0:
        # Extrapolate from the last two points.
        then, stored, former_unit = here.before
        ratio = step / (here.time - then)
        pressure = pressure + ratio * (pressure - replace(here, stored_pressure=stored).pressure)
        unit = None if unit is None or pressure.min() < 0 else unit + ratio * (unit - former_unit)
    start = dict[str, Any]()
    if guess or here.force > 0:  # otherwise the first guess would be zero
        pressure = alpha * pressure
        unit = alpha * unit if prediction.grid is None and unit is not None else None
        start = {"start": pressure, "start_displacement": unit}
    del pressure, unit
    given: dict[str, Any] = {"load": value * alpha / area} if by_load else {"approach": value}
    tolerance = max(SOLVER_SHARE * scene.tolerance * share, 1e-10)
    try:
        found = solve_contact(grid, gap, tolerance=tolerance, **start, **given, overwrite=True, present=scene.present)
    except ConvergenceError as error:
        raise ConvergenceError(
            f"at {time:.6g} s {error}; try a looser tolerance, a coarser grid, or layers whose moduli differ less"
        ) from error
    if grid is not scene.grid:
        scene.grid.convolutions += grid.convolutions
    pressure, unit = found.pressure, found.displacement
    pressure /= alpha
    unit /= alpha
    force, approach = (value, found.approach) if by_load else (found.load / alpha * area, value)
    history = memory.advance(here.history, prediction, unit, pressure)
    errors, stored = (found.error, found.approach_error), pressure
    if pressure.size >= PACKED_FROM and 2 * int((pressure > 0).sum()) < pressure.size:
        cells = grid.xp.flatnonzero(pressure).astype(np.int32)
        stored = Packed(pressure.shape, cells, pressure.reshape(-1)[cells])
    return Point(time, stored, force, approach, history, before, here.start, False, *errors)


def first_guess(second: Point, coarse: Point, fine: Point) -> tuple[Array, Array]:
    """Return a first guess of the coarse solution: pressure, and its displacement per unit compliance. [Pa, m Pa]

    It is the fine solution at the end of the step, plus the difference between both solutions before the step. Three
    equal points give the solution of this point. The displacement is not used if the kernel depends on the step.
    """
    unit = second.history.fields[0]
    if coarse is fine:
        return second.pressure, unit
    apart = coarse.history.fields[0] - fine.history.fields[0]
    return second.pressure + (coarse.pressure - fine.pressure), unit + apart


def closing_time(scene: Scene, state: State, segment: Segment, event: float) -> float:
    """Return the time until which open surfaces stay apart; the present time if they touch immediately. [s]"""
    here, now, began = state.fine, state.fine.time, scene.program.corners[state.segment]
    if segment.control == "load":
        return event if segment.highest(here.start) == 0 else now
    # the profile would not even touch the undeformed surface, which is the highest
    if segment.highest(here.start) <= float(scene.gap[scene.solid].min()):
        return event

    def touching(left: float, right: float) -> float | None:
        """Return the last time between two times at which the surfaces are still apart; None if they stay apart."""
        surface = scene.gap + scene.memory.after_rest(here.history, right - now)
        level = float(surface[scene.solid].min())
        ends = [scene.program.prescribed(state.segment, time, here.start) for time in (left, right)]
        if max(ends) <= level or (right - left <= shortest and ends[1] <= level):
            return None
        if right - left <= shortest:
            return left
        middle = 0.5 * (left + right)
        first = touching(left, middle)
        return touching(middle, right) if first is None else first

    shortest = max(CLOSING * (event - now), math.ulp(event))
    turns = [began + time for time in segment.turns(now - began, event - began)]
    for left, right in pairwise((now, *turns, event)):  # the approach is monotone, and the surface only rises
        closes = touching(left, right)
        if closes is not None:
            return closes if closes - now > AT_ONCE * (event - now) else now
    return event
