"""Cost estimate of a case: marches on coarse grids, one timed convolution, and counted arrays."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from roughvisc.errors import ConvergenceError
from roughvisc.experiment.coarser import coarser_shape
from roughvisc.experiment.profile import GROWTH, MOST_CELLS, Profile
from roughvisc.experiment.resources import PROCESS, march_bytes
from roughvisc.experiment.scene import build_scene, check_slides, kept_times
from roughvisc.experiment.stated import in_slide, staircase_area
from roughvisc.mechanics.body import Kernel
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.grid import Boundary
from roughvisc.mechanics.hereditary.choice import Choice
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.mechanics.hereditary.memory import STIFF
from roughvisc.mechanics.stepping.march import march
from roughvisc.mechanics.stepping.program import Program, Slide
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.mechanics.stepping.step import at_border
from roughvisc.mechanics.stepping.wave_memory import WaveMemory
from roughvisc.settings import Settings
from roughvisc.study.cost.press import MOST_PRESSED, Pressed, Push, copy_to_press, press, width_of
from roughvisc.study.statement.case import Case
from roughvisc.topography.grid import axis_step, nominal_area, spacing
from roughvisc.topography.indenters import grown, grown_shape, remade
from roughvisc.variables import STEPPED

Widths = tuple[float, float]


@dataclass(frozen=True)
class Stage:
    """One window of a surface, or one grid.

    Attributes
    ----------
    shape : tuple of int
        Cells of the surface.
    solved : float
        Cells that are solved on.
    outside : float
        Least gap beyond the window; infinite where it is the whole domain. [m]
    width : tuple of float
        Between the centres of the outermost cells, along x and along y: a contact as wide outgrows the grid. [m]
    """

    shape: tuple[int, int]
    solved: float
    outside: float = math.inf
    width: Widths = (math.inf, math.inf)

    def holds(self, level: float, width: Widths) -> bool:
        """Whether a contact of an approach and a width stays inside. [m]"""
        if self.outside < math.inf:
            return self.outside > level
        return all(own < limit for own, limit in zip(width, self.width, strict=True))


def stages_of(profile: Profile, grows: bool) -> tuple[Stage, ...]:
    """The windows of a profile from the present one on, and the grids that it grows to; it has the whole window then.

    Parameters
    ----------
    profile : Profile
        The surface.
    grows : bool
        Whether its grid may grow.
    """
    shape = (profile.height.sizes["x"], profile.height.sizes["y"])
    found = []
    while not profile.window.whole:
        found.append(Stage(shape, math.prod(profile.window.shape), profile.window.outside))
        profile.widen_window()
    part = math.prod(profile.window.shape) / math.prod(shape)
    while True:
        sides = [(n - 1) * side for n, side in zip(shape, profile.spacing, strict=True)]
        found.append(Stage(shape, part * math.prod(shape), width=(sides[0], sides[1])))
        larger = grown_shape(shape, GROWTH)
        if not grows or math.prod(larger) > MOST_CELLS:
            return tuple(found)
        shape = (larger[0], larger[1])


def stage_at(stages: Sequence[Stage], level: float, width: Widths) -> int:
    """Number of the first stage that holds a contact of an approach and a width; the last one, if none does. [m]"""
    return next((i for i, stage in enumerate(stages) if stage.holds(level, width)), len(stages) - 1)


#: Cells of the coarse grid that a slide goes there at most.
_MOST = 24


def shortened(program: Program, height: xr.DataArray) -> Program:
    """The program with slides of at least one cell of a coarse surface, and not of many, at their speed.

    Parameters
    ----------
    program : Program
        The loading program.
    height : xarray.DataArray, dims (x, y)
        The coarse surface. [m]
    """
    sides, segments = spacing(height, "height"), []
    for segment in program.segments:
        if segment.slide is not None:
            side = sides[segment.slide.axis]
            way = float(np.clip(segment.slide.distance, side, _MOST * side))
            duration = segment.duration * way / segment.slide.distance
            segment = replace(segment, duration=duration, slide=Slide(way, segment.slide.direction))
        segments.append(segment)
    return replace(program, segments=tuple(segments))


#: Least and largest side of the finer of two coarse grids, in cells, from which the growth with the grid is known. In
#: between it is a third of the case's, and the other one is half of it.
_COARSE = (33, 129)
#: Cost may grow from a grid to one twice as fine by factors within these.
_STEPS_GROW, _WORK_GROWS = (1.0, 1.3), (1.0, 1.7)
#: What an octave counts over the one before: grids that hold the shortest waves need hardly more iterations on finer
#: cells. Measured with rough surfaces up to 1024 squared by the benchmark.
_FADING = 0.7
#: A coarse march ends after this number of convolutions or steps, which take three to six seconds: counts, so that the
#: estimate of a case does not depend on the load of the machine.
_MOST_CONVOLUTIONS, _MOST_STEPS = 20_000, 3_000
#: Seconds for timing solves, in all and of one grid, which may be narrow and then takes a few milliseconds. [s, cells]
_CALIBRATION, _ENOUGH, _NARROW = 2.0, (0.1, 0.5), 128**2
#: Part of the cells in contact in a solve that is timed: of more, an iteration takes up to twice as long.
_TOUCHING = 0.1
#: Largest grid that a solve is timed on; larger ones are taken to cost as N log N. [cells]
_TIMED = 1024**2
#: What the grid's error costs: the march again on a quarter of the cells and a sixteenth, which is dearer by the cell.
_AGAIN = 1.5
#: Seconds to begin a case and to write its file, whatever its size.
_FILE = 0.05
#: Seconds to keep a byte of a field, and to write it to the file in the end; bytes on disk for a byte that is rounded.
_WRITE, _ROUNDED = 3e-9, 0.5
#: An approach leaves a window that reaches this much deeper.
_BEYOND = 1.05
#: Frames in a chunk of the file at most; contact fraction of the middle one below which pressures are compressed, and
#: that of a surface which is its own mirror image.
_CHUNK, _COMPRESSED = 8, (0.24, 0.4)


class Passed(NamedTuple):
    """A step of a coarse march: what it took, and the contact at its end.

    Attributes
    ----------
    level, width
        Approach of the contact, and its extent along x and along y. [m]
    convolutions : float
        Of this step.
    time, force
        At its end. [s], [N]
    touching, fraction
        Part of the cells in contact, and contact fraction, which is corrected for the grid.
    slides, damped, by_approach
        Whether it is in a slide, by the two-step rule, and under a given approach.
    """

    level: float
    width: tuple[float, float]
    convolutions: float
    time: float = 0.0
    force: float = 0.0
    touching: float = 0.0
    fraction: float = 0.0
    slides: bool = False
    damped: bool = False
    by_approach: bool = False


class CoarseRun(NamedTuple):
    """A run on a coarse surface: its steps, or rows, the convolutions of all, and the time that it took [s]."""

    height: xr.DataArray
    steps: int
    convolutions: float
    seconds: float


@dataclass(frozen=True)
class CostEstimate:
    """What a march through a case takes.

    Attributes
    ----------
    steps, rows : float
        Accepted steps, and kept ones.
    convolutions : float
        Displacements and applications of the preconditioner.
    damped : float
        Part of the steps that the two-step rule takes.
    contact : float
        Largest part of the cells that are in contact.
    whole : bool
        Whether the coarse marches came to their end in the time that they were given.
    level : float
        Largest approach: what lies deeper cannot be touched. [m]
    force : float
        Largest force. [N]
    fraction : float
        Largest contact fraction: that of the contact area, which is corrected for the grid, on the cells ``pressed``.
    kept : tuple of float
        Part of the cells in contact at each kept time that a coarse march reached.
    slid, slid_convolutions : float
        Steps in slides and what they take, part of all.
    course : tuple of Passed
        Each step of the coarse march.
    push : Push or None
        What an elastic body is pressed with to have the largest contact.
    at_border : bool
        Whether a contact came to the border of a free surface.
    pressed : Pressed or None
        The largest contact on cells as fine as are pressed at once.
    coarse_run : CoarseRun or None
        From which all this is carried on.
    """

    steps: float
    rows: float
    convolutions: float
    damped: float
    contact: float
    whole: bool
    level: float = math.inf
    force: float = math.nan
    fraction: float = math.nan
    kept: tuple[float, ...] = ()
    slid: float = 0.0
    slid_convolutions: float = 0.0
    course: tuple[Passed, ...] = ()
    push: Push | None = None
    at_border: bool = False
    pressed: Pressed | None = None
    coarse_run: CoarseRun | None = None


class Copies:
    """A surface on few cells, to press; each copy is made once.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y)
        The surface. [m]
    boundary : {"free", "periodic"}
        Of the run.
    """

    def __init__(self, height: xr.DataArray, boundary: Boundary) -> None:
        self._height, self._boundary = height, boundary
        self._found: dict[tuple[tuple[int, ...], int], xr.DataArray] = {}

    def of(self, shape: tuple[int, ...], most: int) -> xr.DataArray:
        """The surface, or the grid of so many cells that it grows to, on so many cells a side at most. [m]"""
        if (shape, most) not in self._found:
            if most < MOST_PRESSED:  # a large surface is not transformed again
                finer = self.of(shape, MOST_PRESSED)
            else:
                finer = self._height if shape == self._height.shape else over(self._height, shape, most)
            self._found[shape, most] = copy_to_press(finer, self._boundary, most)
        return self._found[shape, most]


def over(height: xr.DataArray, shape: tuple[int, ...], side: int) -> xr.DataArray:
    """An indenter over a grid of so many cells that it grows to, on about so many cells a side at most. [m]"""
    dx, dy = spacing(height, "height")
    few = coarser_shape((shape[0], shape[1]), max(max(shape) / side, 1.0), same_parity=True)
    made = remade(height, few, (shape[0] * dx, shape[1] * dy))
    assert made is not None, "it is asked of indenters"
    return made


def grids_of(height: xr.DataArray, settings: Settings) -> tuple[tuple[int, ...], ...]:
    """Shape of a surface's grid, and of those that it may grow to."""
    shapes = [height.shape]
    if settings.boundary == "free" and settings.edge == "error":
        while grown(height, 1.0) is not None and math.prod(shape := grown_shape(shapes[-1], GROWTH)) <= MOST_CELLS:
            shapes.append(shape)
    return tuple(shapes)


def coarse(height: xr.DataArray, side: int) -> xr.DataArray:
    """Every so-many-eth point of a surface, about ``side`` each way, over the same size. [m]"""
    picks, coords = [], {}
    for axis in ("x", "y"):
        count = height.sizes[axis]
        few = min(side, count)
        picks.append(np.floor((np.arange(few) + 0.5) * count / few).astype(int))
        length = axis_step(height, axis, "height") * count
        coords[axis] = (np.arange(few) + 0.5) * length / few
    kept = {"missing": height.attrs["missing"]} if "missing" in height.attrs else {}
    return xr.DataArray(height.values[np.ix_(*picks)], dims=("x", "y"), coords=coords, attrs=kept)


def march_of(case: Case, height: xr.DataArray, copies: Copies | None = None) -> CostEstimate:
    """Steps and convolutions of a case, from marches over coarse grids; how much comes into contact, from a press.

    Where the grid may grow, the coarse grids cover the one that it grows to.

    Raises
    ------
    InputError
        If the case is impossible.
    """
    program, settings = case.program(), case.solving()
    check_slides(program, settings, spacing(height, "height"))
    program = program.on_area(nominal_area(height))  # larger grids carry the same loads
    copies, shapes = copies or Copies(height, settings.boundary), grids_of(height, settings)

    def marched(grid: int, side: int, outgrowing: bool = False) -> CostEstimate:
        few = coarse(height, side) if grid == 0 else over(height, shapes[grid], side)
        return _march(case, program, few, outgrowing)

    def pressed(grid: int, push: Push | None, most: int = MOST_PRESSED) -> Pressed:
        return press(copies.of(shapes[grid], most), push or Push(load=0.0), settings.boundary, case.body().kernel)

    last, grid = len(shapes) - 1, 0
    coarser, finer = coarse_sides(height.shape)
    first = marched(0, coarser, last > 0)
    while first.at_border and grid < last:
        grid += 1
        first = marched(grid, coarser, grid < last)
    coarsely = grid  # on a coarse grid the outermost cells reach farther inwards
    while grid > 0 and not pressed(grid - 1, first.push).at_border:
        grid -= 1
    while grid < last and pressed(grid, first.push).at_border:
        grid += 1
    first_on = (coarsely, coarser)
    coarser, finer = coarse_sides(shapes[grid])
    if (grid, coarser) != first_on:
        first = marched(grid, coarser)
    second = marched(grid, finer)
    if not second.whole and first.course[-1].time > second.course[-1].time:
        second = _carried_on(second, first)
    octaves = math.log2(max(math.sqrt(math.prod(shapes[grid])) / finer, 1.0))
    octaves = (1 - _FADING**octaves) / (1 - _FADING)
    in_all = [(one.steps - one.slid, one.convolutions - one.slid_convolutions) for one in (first, second)]
    taken = {
        "steps": in_all[1][0] * _growth(in_all[0][0], in_all[1][0], _STEPS_GROW) ** octaves,
        "convolutions": in_all[1][1] * _growth(in_all[0][1], in_all[1][1], _WORK_GROWS) ** octaves,
    }
    if settings.time_step != "auto":
        taken["steps"] = in_all[1][0]
    if program.slides:
        sides = spacing(height)
        cells = sum(one.slide.cells(sides) for one in program.segments if one.slide is not None)  # a step each
        each = second.slid_convolutions / max(second.slid, 1.0)
        taken = {"steps": taken["steps"] + cells, "convolutions": taken["convolutions"] + cells * each, "slid": cells}
    rows = taken["steps"] if settings.times is None else float(len(kept_times(program, settings.times) or ()))
    finest = pressed(grid, second.push)
    known: dict[str, Any] = {
        "whole": first.whole and second.whole,
        "fraction": finest.fraction,
        "at_border": settings.boundary == "free" and finest.at_border,
        "pressed": finest,
    }
    return replace(_rescaled(second, finest), **taken, **known, rows=rows)


def _rescaled(found: CostEstimate, pressed: Pressed) -> CostEstimate:
    """A march whose largest approach and contact are those of a finer grid, which has the higher summits."""
    largest = (
        max((passed.level for passed in found.course), default=0.0),
        *(max((passed.width[axis] for passed in found.course), default=0.0) for axis in (0, 1)),
    )
    finest = (pressed.approach, *pressed.width)
    level, *widths = (new / old if new > 0 and old > 0 else 1.0 for new, old in zip(finest, largest, strict=True))
    course = tuple(
        passed._replace(level=level * passed.level, width=(widths[0] * passed.width[0], widths[1] * passed.width[1]))
        for passed in found.course
    )
    return replace(found, course=course, level=level * found.level)


def _carried_on(found: CostEstimate, coarser: CostEstimate) -> CostEstimate:
    """A march that was broken off, as the one on fewer cells went on from there."""
    before = [passed.convolutions for passed in coarser.course if passed.time <= found.course[-1].time]
    steps, work = len(found.course), sum(passed.convolutions for passed in found.course)
    return replace(
        found,
        steps=steps * coarser.steps / max(len(before), 1),
        convolutions=work * coarser.convolutions / max(sum(before), 1.0),
    )


def coarse_sides(shape: Sequence[int]) -> tuple[int, int]:
    """Cells a side of the two coarse grids of a grid."""
    finer = min(max(max(shape) // 3, _COARSE[0]), _COARSE[1]) // 2 * 2 + 1
    return finer // 2 + 1, finer


def _growth(first: float, second: float, limits: tuple[float, float]) -> float:
    return min(max(second / max(first, 1.0), limits[0]), limits[1])


def _march(case: Case, program: Program, height: xr.DataArray, outgrowing: bool = False) -> CostEstimate:
    """March over a coarse grid; no farther than to its border, if that is ``outgrowing`` it."""
    settings = replace(case.solving(), missing="absent", edge="accept")
    if program.slides:  # its corners will do: the times that are kept lie elsewhere in a shorter program
        program, settings = shortened(program, height), replace(settings, times=() if settings.times else None)
    profile = Profile(height, settings.missing, kernel=case.body().kernel)
    scene, _ = build_scene(profile, case.body(), program, settings)
    course: list[Passed] = []
    reached, work, bordering, began = 0.0, 0, False, time.perf_counter()
    for step in march(scene):
        now, touching = step.shown.time, step.shown.pressure > 0
        share = float(np.mean(touching))
        taken_off = staircase_area(touching, scene) / (scene.operator.cell_area * touching.size)
        course.append(
            Passed(
                level=step.level,
                width=width_of(touching, profile),
                convolutions=step.state.convolutions - work,
                time=now,
                force=step.shown.force,
                touching=share,
                fraction=share - taken_off,
                slides=in_slide(step),
                damped=now > reached and _is_damped(scene, now - reached),
                by_approach=step.control == "approach",
            )
        )
        bordering = bordering or at_border(scene, step.shown.contact)
        work, reached = step.state.convolutions, now
        if (outgrowing and bordering) or work > _MOST_CONVOLUTIONS or len(course) > _MOST_STEPS:
            break
    took = time.perf_counter() - began
    steps, whole, stretch = len(course), bool(reached >= program.duration), 1.0
    if not whole:  # what is left is taken to go on as the later half of the steps went
        half = (steps + 1) // 2
        pace = (reached - (course[half - 1].time if half else 0.0)) / max(steps - half, 1)
        stretch += (program.duration - reached) / pace / steps if pace else 0.0
    kept = set(scene.times or ())
    rows = [one.touching for one in course if settings.times is None or one.time in kept]
    slid = [one.convolutions for one in course if one.slides]
    return CostEstimate(
        steps=steps * stretch,
        rows=len(kept) or len(rows) * stretch,
        convolutions=work * stretch,
        damped=sum(one.damped for one in course) / max(steps, 1),
        contact=max([0.0, *(one.touching for one in course)]),
        whole=whole,
        level=max([0.0, *(one.level for one in course)]),
        force=max([0.0, *(one.force for one in course)]),
        fraction=max([0.0, *(one.fraction for one in course)]),
        kept=tuple(rows),
        slid=len(slid),
        slid_convolutions=sum(slid),
        course=tuple(course),
        push=_push(scene, course),
        at_border=bordering,
        coarse_run=CoarseRun(height, steps, work, took),
    )


def _push(scene: Scene, course: Sequence[Passed]) -> Push:
    """What an elastic body is pressed with to have the largest contact of a march."""
    if not course:
        return Push(load=0.0)
    # of few cells as many may touch at several approaches
    largest = max(range(len(course)), key=lambda number: (course[number].fraction, course[number].level))
    if course[largest].by_approach:
        return Push(approach=course[largest].level)
    till = course[: largest + 1]
    instants, forces = ([0.0, *values] for values in zip(*((one.time, one.force) for one in till), strict=True))
    ages = instants[-1] - np.asarray(instants)
    means = [scene.compliance(float(age)) for age in 0.5 * (ages[1:] + ages[:-1])]
    return Push(load=max(float(np.dot(means, np.diff(forces))), 0.0))


def _is_damped(scene: Scene, length: float) -> bool:
    return "bdf2" in scene.memory.rules and scene.stiff_ratio(length) > STIFF


class ConvolutionTimer:
    """Seconds a convolution takes within a solve, by grid, boundary and kernel; once each, in two seconds in all."""

    def __init__(self) -> None:
        self._found: dict[tuple[tuple[int, ...], str, Kernel], float] = {}
        self._left = _CALIBRATION

    def seconds(self, height: xr.DataArray, boundary: Boundary, kernel: Kernel) -> float:
        """Seconds of one convolution and what goes with it, one thread. [s]"""
        grid = (height.shape, boundary, kernel)
        if grid not in self._found:
            self._found[grid] = self._measured(height, boundary, kernel)
        return self._found[grid]

    def _measured(self, height: xr.DataArray, boundary: Boundary, kernel: Kernel) -> float:
        alike = [grid for grid in self._found if grid[1:] == (boundary, kernel)]
        if self._left <= 0 and alike:  # as N log N from the grid nearest in size
            nearest = min(alike, key=lambda grid: abs(math.log(math.prod(grid[0]) / height.size)))
            return self._found[nearest] * work(height.size) / work(math.prod(nearest[0]))
        cells, enough = height.size, _ENOUGH[height.size > _NARROW]
        if cells > _TIMED:
            height = coarse(height, math.isqrt(_TIMED))
        began = time.perf_counter()
        profile = Profile(height, "absent", kernel=kernel)
        operator = profile.operator(boundary)
        gap = profile.gap
        # a tenth of the cells penetrates, and the load is that of which the displacement is as large
        guess = np.maximum(np.quantile(gap, _TOUCHING) - gap, 0)
        work_done = float((guess * operator.displacement(guess)).sum())
        load = float(guess.sum()) * float((guess**2).sum()) / work_done if work_done > 0 else 1.0
        seconds = math.inf
        for iterations in itertools.chain((2,), itertools.repeat(6)):
            start = time.perf_counter()
            before = operator.convolutions
            with suppress(ConvergenceError):
                solve_contact(
                    operator,
                    gap,
                    load=load,
                    tolerance=1e-15,
                    start=guess,  # as most steps have one: none is sought on coarser grids
                    max_iterations=iterations,
                    present=profile.present,
                )
            now = time.perf_counter()
            seconds = min(seconds, (now - start) / max(operator.convolutions - before, 1))
            if now - began > min(enough, self._left) or gap.max() == 0:
                break
        self._left -= time.perf_counter() - began
        return seconds * work(cells) / work(height.size)

    def beside(self, run: CoarseRun | None, boundary: Boundary, kernel: Kernel) -> float:
        """Seconds that a step takes beside its convolutions where fields are small: the interpreter's. [s]"""
        if run is None or run.steps == 0:
            return 0.0
        left = run.seconds - run.convolutions * self.seconds(run.height, boundary, kernel)
        return max(left, 0.0) / run.steps


def work(cells: float) -> float:
    return cells * math.log2(cells + 2)


@dataclass(frozen=True)
class Solved:
    """What a case is solved on: its stages in order, and the part of the convolutions that each takes.

    Attributes
    ----------
    stages : tuple of Stage
        The last one is that of the end.
    shares : tuple of float
        One a stage; they sum to one.
    """

    stages: tuple[Stage, ...]
    shares: tuple[float, ...]

    @property
    def cells(self) -> int:
        """Of the surface in the end."""
        return math.prod(self.stages[-1].shape)

    @property
    def part(self) -> float:
        """Part of these that is solved on in the end."""
        return self.stages[-1].solved / self.cells

    @property
    def growths(self) -> int:
        """How many times the window or the grid grows."""
        return sum(share > 0 for share in self.shares[:-1])

    def mean(self, of: Callable[[float], float]) -> float:
        """Mean of a function of the cells that are solved on over all convolutions."""
        return sum(share * of(stage.solved) for stage, share in zip(self.stages, self.shares, strict=True))


def solved_on(stages: tuple[Stage, ...], found: CostEstimate) -> Solved:
    """What a march is solved on, by its contacts on a coarse grid."""
    course = found.course or (Passed(found.level, (0.0, 0.0), 1.0),)
    reached, taken = 0, [0.0] * len(stages)
    for passed in course:  # it does not shrink again
        reached = max(reached, stage_at(stages, _BEYOND * passed.level, passed.width))
        taken[reached] += passed.convolutions
    shares = np.array(taken[: reached + 1]) / sum(taken) if sum(taken) else np.eye(reached + 1)[-1]
    return Solved(stages[: reached + 1], tuple(shares.tolist()))


def wall_time(
    settings: Settings, solved: Solved, found: CostEstimate, choice: Choice, convolution: float, beside: float = 0.0
) -> float:
    """Seconds for a case in one process with one thread.

    By those of a convolution on the final surface, and by those of a step ``beside`` its convolutions. [s]
    """
    cells = solved.cells
    modes = len(choice.memory.material.times) if isinstance(choice.memory, Modes | WaveMemory) else 0
    stepping = found.steps * (beside + solved.mean(float) * 8 * (10 + 4 * modes) * 0.3e-9)
    writing = found.rows * cells * 8 * len(settings.fields) * _WRITE
    again = _AGAIN if settings.grid_error else 1.0
    return found.convolutions * convolution * solved.mean(work) / work(cells) * again + stepping + writing + _FILE


def bytes_needed(
    settings: Settings, cells: int, found: CostEstimate, choice: Choice, part: float = 1.0, grows: bool = False
) -> float:
    """Memory of the process that computes a case, at its peak, ``part`` of the cells being solved on. [bytes]"""
    counts = {"contact": found.contact, "rows": found.rows, "part": part}
    return PROCESS + march_bytes(settings, cells, choice.memory, **counts, grows=grows)


def disk(case: Case, cells: int, found: CostEstimate, symmetric: bool = False) -> float:
    """Size of a case's file; what it keeps meanwhile comes to as much. [bytes]"""
    dense = 1.0 if case.settings.keep.precision is None else _ROUNDED
    rows = found.rows
    if rows and dense == 1:  # chunks of a few frames, all of one length, are written whole
        rows = math.ceil(rows / math.ceil(rows / _CHUNK)) * math.ceil(rows / _CHUNK)
    kept = np.array(found.kept or (found.contact,))
    few = kept[len(kept) // 2] < _COMPRESSED[symmetric]  # the frame that the writer asks
    names = case.settings.keep.fields
    pressure = found.rows * (float(np.mean(kept)) + 0.01) if few else rows * dense
    fields = sum(pressure if name == "pressure" else rows * dense for name in names)
    return 40e3 + 8.0 * cells * (fields + 1.0) + found.rows * 120 + found.steps * 8 * len(STEPPED)
