"""Cost estimate of a case: marches on coarse grids, one timed convolution, and counted arrays."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.halfspace.kernel import Kernel
from roughvisc.mechanics.halfspace.operator import HalfSpace
from roughvisc.mechanics.hereditary.choice import Choice
from roughvisc.mechanics.hereditary.direct import History
from roughvisc.mechanics.hereditary.exponentials import STIFF, Modes
from roughvisc.mechanics.stepping.march import march
from roughvisc.mechanics.stepping.scene import Scene
from roughvisc.mechanics.stepping.seed import march_seed
from roughvisc.study.cost.short_slides import shortened, slid_cells
from roughvisc.study.simulation.footprint import PROCESS, march_bytes
from roughvisc.study.simulation.kept_times import kept_times
from roughvisc.study.simulation.rows import in_slide, staircase_area
from roughvisc.study.simulation.scene import Ground, prepare
from roughvisc.study.simulation.slides import check_slides
from roughvisc.study.statement.case import Case
from roughvisc.study.statement.settings import Settings
from roughvisc.topography.grid import axis_step, resampled_taper, spacing, with_taper_weights
from roughvisc.variables import STEPPED

#: Sides of the coarse grids, in cells: from two of them the growth with the grid is known. On seven studies at 128
#: to 512 squared the convolutions so found were -1 to +22 % off, the steps -8 to +7 %.
_COARSE = (17, 33)
#: Cost may grow from a grid to one twice as fine by factors within these.
_STEPS_GROW, _WORK_GROWS = (1.0, 1.3), (1.0, 1.7)
#: A coarse march ends after so many convolutions, or steps, which take about three seconds: counts, so that what is
#: foretold does not depend on how busy the machine is.
_MOST_CONVOLUTIONS, _MOST_STEPS = 20_000, 3_000
#: Seconds for timing solves.
_CALIBRATION = 2.0
#: Largest grid that a solve is timed on; larger ones are taken to cost as N log N. [cells]
_TIMED = 1024**2
#: What the grid's error costs: the march again on a quarter of the cells and a sixteenth, which is dearer by the cell.
_AGAIN = 1.5
#: Seconds to keep a byte of a field, and to write it to the file in the end; bytes on disk for a byte that is rounded.
_WRITE, _ROUNDED = 3e-9, 0.5
#: Frames in a chunk of the file at most; contact fraction of the middle one below which pressures are compressed.
_CHUNK, _COMPRESSED = 8, 0.03


@dataclass(frozen=True)
class March:
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
        Largest contact fraction: that of the contact area, which is corrected for the grid.
    kept : tuple of float
        Part of the cells in contact at each kept time that a coarse march reached.
    slid, slid_convolutions : float
        Steps in slides and what they take, part of all.
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
    few = xr.DataArray(height.values[np.ix_(*picks)], dims=("x", "y"), coords=coords, attrs=kept)
    return with_taper_weights(few, resampled_taper(height, few.shape))


def march_of(case: Case, height: xr.DataArray) -> March:
    """Steps and convolutions of a case, from marches over coarse grids.

    Raises
    ------
    InputError
        If the case is impossible.
    """
    program, settings = case.program(), case.solving()
    check_slides(program, settings, spacing(height, "height"))
    found = [_march(case, coarse(height, side)) for side in _COARSE]
    octaves = math.log2(max(math.sqrt(height.size) / _COARSE[1], 1.0))
    first, second = found
    pressed = [(one.steps - one.slid, one.convolutions - one.slid_convolutions) for one in found]
    grown = {
        "steps": pressed[1][0] * _growth(pressed[0][0], pressed[1][0], _STEPS_GROW) ** octaves,
        "convolutions": pressed[1][1] * _growth(pressed[0][1], pressed[1][1], _WORK_GROWS) ** octaves,
    }
    if settings.time_step != "auto":
        grown["steps"] = pressed[1][0]
    if program.slides:
        cells = slid_cells(program, height)
        each = second.slid_convolutions / max(second.slid, 1.0)
        grown = {"steps": grown["steps"] + cells, "convolutions": grown["convolutions"] + cells * each, "slid": cells}
    rows = grown["steps"] if settings.times is None else float(len(kept_times(program, settings.times) or ()))
    return March(**{**vars(second), **grown, "rows": rows, "whole": first.whole and second.whole})


def _growth(first: float, second: float, limits: tuple[float, float]) -> float:
    return min(max(second / max(first, 1.0), limits[0]), limits[1])


def _march(case: Case, height: xr.DataArray) -> March:
    settings, program = replace(case.solving(), missing="absent", edge="accept"), case.program()
    if program.slides:  # its corners will do: the times that are kept lie elsewhere in a shorter program
        program, settings = shortened(program, height), replace(settings, times=() if settings.times else None)
    scene, _ = prepare(Ground(height, settings.missing, kernel=settings.kernel), case.material(), program, settings)
    steps = rows = damped = 0
    reached = contact = fraction = level = force = 0.0
    work, instants = 0, [0.0]
    slid = slid_work = 0
    kept, contacts = set(scene.times or ()), []
    for step in march(scene) if settings.method == "fast" else march_seed(scene):
        now = step.shown.time
        steps += 1
        touching = step.shown.pressure > 0
        share = float(np.mean(touching))
        if settings.times is None or now in kept:
            rows += 1
            contacts.append(share)
        damped += now > reached and _is_damped(scene, now - reached)
        contact = max(contact, share)
        taken_off = staircase_area(touching, scene) / (scene.halfspace.cell_area * touching.size)
        fraction = max(fraction, share - taken_off)
        level, force = max(level, step.level), max(force, step.shown.force)
        if in_slide(step):
            slid, slid_work = slid + 1, slid_work + step.state.convolutions - work
        work, reached = step.state.convolutions, now
        instants.append(now)
        if work > _MOST_CONVOLUTIONS or steps > _MOST_STEPS:
            break
    whole = reached >= program.duration
    stretch = 1.0
    if not whole:  # what is left is taken to go on as the later half of the steps went
        half = len(instants) // 2
        pace = (reached - instants[half]) / max(steps - half, 1)
        stretch += (program.duration - reached) / pace / steps if pace else 0.0
    kept_rows, part = len(kept) or rows * stretch, damped / max(steps, 1)
    known = (part, contact, bool(whole), level, force, fraction, tuple(contacts), slid, slid_work)
    return March(steps * stretch, kept_rows, work * stretch, *known)


def _is_damped(scene: Scene, length: float) -> bool:
    return "bdf2" in scene.memory.rules and scene.stiff_ratio(length) > STIFF


class Stopwatch:
    """Seconds a convolution takes within a solve, by grid, boundary and kernel; once each, in two seconds in all."""

    def __init__(self) -> None:
        self._found: dict[tuple[tuple[int, ...], str, Kernel], float] = {}
        self._left = _CALIBRATION

    def seconds(self, height: xr.DataArray, boundary: str, kernel: Kernel) -> float:
        """Seconds of one convolution and what goes with it, one thread. [s]"""
        grid = (height.shape, boundary, kernel)
        if grid not in self._found:
            self._found[grid] = self._measured(height, boundary, kernel)
        return self._found[grid]

    def _measured(self, height: xr.DataArray, boundary: str, kernel: Kernel) -> float:
        alike = [grid for grid in self._found if grid[1:] == (boundary, kernel)]
        if self._left <= 0 and alike:  # as N log N from the grid nearest in size
            nearest = min(alike, key=lambda grid: abs(math.log(math.prod(grid[0]) / height.size)))
            return self._found[nearest] * work(height.size) / work(math.prod(nearest[0]))
        cells = height.size
        if cells > _TIMED:
            height = coarse(height, math.isqrt(_TIMED))
        began = time.perf_counter()
        ground = Ground(height, "absent", kernel=kernel)
        halfspace: HalfSpace = ground.halfspace("free" if boundary == "free" else "periodic")
        gap = ground.gap
        load = 0.02 * float(np.mean(gap)) / (halfspace.self_influence or halfspace.spacing[0]) * gap.size
        seconds = math.inf
        for iterations in itertools.chain((2,), itertools.repeat(6)):
            start = time.perf_counter()
            state = solve_contact(
                halfspace, gap, load=load or 1.0, tolerance=1e-15, max_iterations=iterations, present=ground.present
            )
            now = time.perf_counter()
            seconds = min(seconds, (now - start) / max(state.convolutions, 1))
            if now - began > min(0.5, self._left) or gap.max() == 0:
                break
        self._left -= time.perf_counter() - began
        return seconds * work(cells) / work(height.size)


def windows(ground: Ground) -> tuple[tuple[float, float], ...]:
    """Windows that follow a contact on a surface, from the present one to the whole domain, which is the ground's then.

    The least gap beyond each [m], and the part of the surface's cells that it takes.
    """

    def present() -> tuple[float, float]:
        return ground.window.outside, math.prod(ground.window.shape) / ground.height.size

    found = [present()]
    while not ground.window.whole:
        ground.widen()
        found.append(present())
    return tuple(found)


def solved_on(windows: Iterable[tuple[float, float]], level: float) -> float:
    """Part of the surface's cells that are solved on where the approach comes to a level. [m]"""
    return next(part for outside, part in windows if outside > level)


def work(cells: float) -> float:
    return cells * math.log2(cells + 2)


def wall_time(
    settings: Settings, cells: int, found: March, choice: Choice, convolution: float, window: float = 1.0
) -> float:
    """Seconds for a case in one process with one thread, ``window`` being the part of the cells solved on. [s]"""
    convolution *= work(window * cells) / work(cells)
    modes = len(choice.memory.material.times) if isinstance(choice.memory, Modes) else 0
    past = found.contact * found.steps / 2 if isinstance(choice.memory, History) else 0.0
    stepping = found.steps * window * cells * 8 * (10 + 4 * modes + past) * 0.3e-9
    writing = found.rows * cells * 8 * len(settings.fields) * _WRITE
    again = _AGAIN if settings.grid_error else 1.0
    return found.convolutions * convolution * again + stepping + writing


def bytes_needed(settings: Settings, cells: int, found: March, choice: Choice, part: float = 1.0) -> float:
    """Memory of the process that computes a case, at its peak, ``part`` of the cells being solved on. [bytes]"""
    counts = {"contact": found.contact, "steps": found.steps, "rows": found.rows, "part": part}
    return PROCESS + march_bytes(settings, cells, choice.memory, **counts)


def disk(case: Case, cells: int, found: March) -> float:
    """Size of a case's file; what it keeps meanwhile comes to as much. [bytes]"""
    dense = 1.0 if case.settings.keep.precision is None else _ROUNDED
    rows = found.rows
    if rows and dense == 1:  # chunks of a few frames, all of one length, are written whole
        rows = math.ceil(rows / math.ceil(rows / _CHUNK)) * math.ceil(rows / _CHUNK)
    kept = np.array(found.kept or (found.contact,))
    few = kept[len(kept) // 2] < _COMPRESSED  # the frame that the writer asks
    pressure = found.rows * (float(np.mean(kept)) + 0.01) if few else rows * dense
    fields = sum(pressure if name == "pressure" else rows * dense for name in case.settings.keep.fields)
    return 40e3 + 8.0 * cells * (fields + 1.0) + found.rows * 120 + found.steps * 8 * len(STEPPED)
