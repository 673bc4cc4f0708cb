"""``roughvisc plan``: model, steps, time, memory and disk of each case, before anything runs.

One coarse run of a case gives its steps, its convolutions and its contact. They grow slowly with the grid. One timed
convolution on the real grid gives the time. Memory and disk are counted.
"""

from __future__ import annotations

import json
import math
import shutil
import time
from bisect import bisect_left
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy import fft
from scipy.special import erf, erfinv

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.experiment.base import Experiment, Problem
from roughvisc.experiment.coarser import coarser_shape, on_fewer_cells
from roughvisc.experiment.kept_times import kept_times, memory_options
from roughvisc.experiment.loading import Loading, check_program
from roughvisc.experiment.profile import Domain, Profile, choose_domain, choose_surface
from roughvisc.experiment.resources import (
    PART,
    PROCESS,
    Available,
    amount,
    cores,
    curve_bytes,
    march_bytes,
    memory_available,
    too_large,
)
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.memory_choice import Choice, choose_memory
from roughvisc.mechanics.program import Program, Segment, Slide
from roughvisc.study.case import Case, read_cases
from roughvisc.study.execution.cluster import processes_that_fit, threads_each
from roughvisc.study.execution.run import result_folder
from roughvisc.study.quantities import creep_time
from roughvisc.study.storage.folder import existing_part
from roughvisc.study.storage.sweep_cases import labels_of, parameters_of
from roughvisc.topography.grid import nominal_area, spacing
from roughvisc.topography.indenters import remade
from roughvisc.topography.parameters import rms_slope
from roughvisc.units import unit_for
from roughvisc.variables import STEPPED

#: Variable of a plan -> unit and long name.
COLUMNS = {
    "boundary": ("", "boundary"),
    "padded": ("", "whether transforms are padded to twice the grid"),
    "memory_model": ("", "model of the material's memory"),
    "exponentials": ("1", "exponentials of the series"),
    "scheme": ("", "choice of the time steps"),
    "cells_x": ("1", "cells along x"),
    "cells_y": ("1", "cells along y"),
    "solved_cells_x": ("1", "cells along x of the part that is solved on; 0: not known"),
    "solved_cells_y": ("1", "cells along y of the part that is solved on; 0: not known"),
    "speeds": ("1", "speeds of a friction curve"),
    "steps": ("1", "accepted time steps expected"),
    "rows": ("1", "kept times expected"),
    "contact_fraction": ("1", "largest contact fraction expected, if the case had a coarse run"),
    "coarse_cells_x": ("1", "cells along x of the coarse run of this case; 0: none"),
    "coarse_cells_y": ("1", "cells along y of the coarse run of this case; 0: none"),
    "nominal_pressure": ("Pa", "largest nominal pressure, prescribed or of the coarse run: force over nominal area"),
    "full_contact_pressure": ("Pa", "nominal pressure at which contact takes 95 % of the area (Persson's theory)"),
    "convolutions": ("1", "convolutions expected, one forward and one inverse transform each"),
    "wall_time": ("s", "wall time expected, in one process with one thread"),
    "memory": ("byte", "memory of the process at its peak"),
    "disk": ("byte", "size of the result"),
    "marched": ("", "whether the cost is from a coarse run of this case, and not of the most similar case"),
    "program_note": ("", "how a measured history became segments"),
    "late_times": ("", "listed times after the end of the program, which are left out; empty if there are none"),
    "warning": ("", "expected full contact; empty if none"),
    "border_warning": ("", "expected contact at the border of a free surface, which stops the run; empty if none"),
    "refusal": ("", "why it cannot run; empty if it can"),
}
#: Columns that count cells.
_COUNTS = [f"{name}cells_{axis}" for name in ("", "solved_", "coarse_") for axis in "xy"]
#: Longest side of the coarse grid of a march, and of a friction curve. [cells]
_COARSE, _COARSE_CURVE = 64, 48
#: Powers of the number of cells a side with which steps and convolutions grow. Measured on 15 cases of rough surfaces,
#: balls, slides and curves of 96 to 512 cells a side: convolutions grow with 0.25 to 0.65, under an approach with 0.9,
#: and those of curves with 0.15.
_STEPS_GROW, _WORK_GROWS, _CURVE_GROWS = 0.1, 0.4, 0.15
#: Largest numbers of convolutions and steps of a coarse run: a limit of time would depend on the load of the machine.
_MOST_CONVOLUTIONS, _MOST_STEPS = 5000, 800
#: Speeds of a coarse friction curve: of more, evenly spread ones. Time of a convolution of a curve, with all that goes
#: with it, over that of one in a contact problem, measured at 256 and 1024 squared.
_FEW_SPEEDS, _CURVE_CONVOLUTION = 7, 2.1
#: First step of a hold, in parts of the hold: later ones become longer in proportion.
_FIRST_STEP = 0.005
#: Cells of a slide on the coarse grid, at most.
_MOST_SLID = 32
#: Largest grid that is timed; the time of larger ones grows as N log N. [cells]
_TIMED = 1024**2
#: Iterations of a timed solve.
_ITERATIONS = 3
#: Coarse runs of a sweep go on for this time, or this part of the expected time of all cases, but not longer than the
#: last time. [s, 1, s]
_BUDGET, _SHARE, _LONGEST = 1.5, 0.05, 15.0
#: Work of the runs on coarser grids that estimate the grid error, over that of the run.
_GRID_ERROR = 0.3
#: Time to begin a case and to write its file, and to write a byte of a field. [s]
_FILE, _WRITE = 0.05, 3e-9
#: Contact fraction below which full contact is not expected: theories of roughness do not hold for single indenters.
_NEARLY_FULL = 0.9
#: Passes over the cells in a step next to its convolutions, more for each exponential, and their time. [s/cell]
_PASSES, _MORE_PASSES, _PASS = 40, 8, 1.2e-9
#: Bytes of the variables of a result without their values, of a friction curve, a loading and one with slides.
_VARIABLES = {"curve": 90e3, "load": 122e3, "slide": 147e3}
#: Bytes of a row without its fields, and bits that compression leaves of a rounded pressure and of another rounded
#: field, more than those of the precision. Measured at precisions of 1e-2 and 1e-4.
_ROW, _PRESSURE_BITS, _FIELD_BITS = 300.0, 9.0, 3.0


def plan(
    cases: Sequence[Case] | str | Path, out: str | Path | None = None, *, workers: int | None = None
) -> xr.Dataset:
    """Estimate the cost of each case on this machine; no case is computed and nothing is written.

    Parameters
    ----------
    cases : sequence of Case, or path
        Cases, or their study file.
    out : path, optional
        Results folder, to check the disk space. Default: as in :func:`roughvisc.sweep`.
    workers : int, optional
        Number of parallel processes. Default: one per core, or fewer if the memory is too small.

    Returns
    -------
    xarray.Dataset
        One row per case along ``case``, with varied parameters as coordinates.
        Attributes: the number of parallel ``processes`` and the ``threads`` of each, the total ``wall_time`` with one
        thread each [s], ``memory`` of all processes [byte], ``disk`` [byte], the free memory and disk, and
        ``refusal``, empty if all cases can run.

    Raises
    ------
    InputError
        If the study file is invalid.

    Notes
    -----
    A case runs on at most 64 cells a side, with its own tolerance and kept times; a friction curve on 48, at some of
    its speeds. Steps and convolutions are extrapolated to the real grid. The contact fraction is that of the coarse
    run, corrected for the slopes that the coarse grid lacks: contact depends on the pressure over the root mean square
    slope, ``erf(sqrt(2) p / (E* h'))`` in Persson's theory. The time follows from a few iterations on the real grid.
    It is accurate to a factor of 2, memory to 1.3, disk and contact fraction to 1.2. In a sweep with many cases some
    have no coarse run; their numbers are those of the most similar case.
    """
    if isinstance(cases, str | Path):
        cases = read_cases(cases)
    if not cases:
        raise InputError(key="cases", found=cases, expected="at least one case")
    folder, there = result_folder(cases[0], out), memory_available()
    stated = [json.loads(case.to_json()) for case in cases]
    parameters = parameters_of(stated)
    names = [_surface_name(case, one) for case, one in zip(cases, stated, strict=True)]
    setups, coarse, rows = _Setups(), dict[int, CoarseRun](), dict[int, dict[str, Any]]()
    began, expected = time.thread_time(), 0.0
    for number in _spread(len(cases)):
        case, spent = cases[number], time.thread_time() - began
        is_own = not coarse or spent < min(max(_BUDGET, _SHARE * expected), _LONGEST)
        try:
            setup = setups.of(case, names[number])
            if is_own:
                coarse[number] = coarse_run(setup)
        except InputError as error:
            row = _row_of(case, setups.height(names[number]))
            rows[number] = row | {"marched": is_own, "refusal": str(error)}
            continue
        like = number if is_own else _most_similar(number, list(coarse), parameters)
        rows[number] = _planned(case, setup, coarse[like], setups, there, is_own)
        if is_own:
            expected = float(np.mean([rows[one]["wall_time"] for one in coarse])) * len(cases)
    ordered = [rows[number] for number in range(len(cases))]
    columns = {name: ("case", np.array([row[name] for row in ordered]), attributes(name)) for name in COLUMNS}
    coords: dict[str, Any] = {"case_key": ("case", np.array([case.key for case in cases]))}
    labels = labels_of(parameters, stated[0], ("case",)).values()
    coords |= dict(zip(parameters, labels, strict=True))
    dataset = xr.Dataset(columns, coords=coords)
    dataset.attrs = {"title": cases[0].title} | totals(dataset, folder, workers, there)
    return dataset


# --------------------------------------------------------------------------------------------------- surface and domain


class Setup(NamedTuple):
    """Surface and domain of a case.

    Attributes
    ----------
    problem : Problem
        Its surface is that of the run: an indenter may be larger than stated.
    experiment : Experiment
        With loads in place of nominal pressures.
    domain : Domain
        Part of the surface that is solved on.
    area : float
        Nominal area, of the stated surface. [m2]
    slope, domain_slope : float
        Root mean square slopes of the stated surface and of the domain. [-]
    reaches_border : bool
        Whether contact is expected at the border of a free surface.
    """

    problem: Problem
    experiment: Experiment
    domain: Domain
    area: float
    slope: float
    domain_slope: float
    reaches_border: bool = False

    @property
    def height(self) -> xr.DataArray:
        """Heights of the domain. [m]"""
        rows, columns = self.domain.cells
        return self.problem.height.isel(x=rows, y=columns)

    @property
    def part(self) -> float:
        """Part of the cells that is solved on. [-]"""
        return self.height.size / self.problem.height.size


class _Setups:
    """Surfaces, memories and timed convolutions that cases share."""

    def __init__(self) -> None:
        self._surfaces: dict[str, tuple[xr.DataArray, float] | InputError] = {}
        self._choices: dict[str, Choice] = {}
        self._seconds: dict[Any, float] = {}

    def height(self, name: str) -> xr.DataArray | None:
        """Return the heights of a surface [m]; None if it cannot be made."""
        found = self._surfaces.get(name)
        return found[0] if isinstance(found, tuple) else None

    def of(self, case: Case, name: str) -> Setup:
        """Return surface and domain of a case; raise an InputError if it is impossible."""
        if name not in self._surfaces:
            try:
                height = case.height()
                self._surfaces[name] = height, rms_slope(height)
            except InputError as error:
                self._surfaces[name] = error
        found = self._surfaces[name]
        if isinstance(found, InputError):
            raise found
        height, slope = found
        area, body = nominal_area(height), case.body
        experiment = case.experiment
        if isinstance(experiment, Loading):
            experiment = Loading(experiment.program.on_area(area))
        problem = Problem(height, body, case.settings).with_known_boundary(experiment.boundary)
        settings = problem.settings
        profile = Profile(height, settings.missing, body.kernel)
        if not isinstance(experiment, Loading):
            return Setup(problem, experiment, choose_domain(profile, body), area, slope, slope)
        program = experiment.program
        check_program(profile, body, program, settings)
        profile, domain, enlarged, at_border = choose_surface(profile, problem, program)
        problem, (rows, columns) = replace(problem, height=profile.height), domain.cells
        local = slope if domain.is_whole and not enlarged else rms_slope(problem.height.isel(x=rows, y=columns))
        return Setup(problem, experiment, domain, area, slope, local, at_border)

    def choice(self, case: Case, program: Program) -> Choice:
        """Return the memory of a material, which may take a fit."""
        options = memory_options(program, case.settings)
        name = f"{case.tables['material']} {options!r}"
        if name not in self._choices:
            self._choices[name] = choose_memory(case.body, **options)
        return self._choices[name]

    def seconds(self, height: xr.DataArray, problem: Problem, contact: float) -> float:
        """Return the time of a convolution and its share of a contact solve, on one thread. [s]

        Parameters
        ----------
        height : xarray.DataArray
            Surface that is solved on. [m]
        problem : Problem
            Body and boundary.
        contact : float
            Part of the cells in contact. [-]
        """
        grid = height.shape, problem.settings.boundary, problem.body.kernel
        if grid not in self._seconds:
            cells, stride = height.size, math.ceil(math.sqrt(height.size / _TIMED))
            few = height.isel(x=slice(None, None, stride), y=slice(None, None, stride))
            self._seconds[grid] = _timed(few, problem, contact) * _work(cells) / _work(few.size)
        return self._seconds[grid]


def _timed(height: xr.DataArray, problem: Problem, contact: float) -> float:
    """Return the time of a convolution in a contact solve of few iterations. [s]"""
    gap = np.nanmax(height.values) - height.values
    present = np.isfinite(gap)
    gap[~present] = 0.0
    boundary = problem.settings.boundary
    assert boundary != "auto", "Setup knows the boundary"
    grid = Grid((gap.shape[0], gap.shape[1]), spacing(height), boundary, kernel=problem.body.kernel)
    guess = np.where(present, np.maximum(np.quantile(gap, min(max(contact, 0.01), 0.9)) - gap, 0.0), 0.0)
    if not guess.any():
        guess = present.astype(float)
    times = []
    for _ in range(2):  # the first one allocates
        began, before = time.thread_time(), grid.convolutions
        with suppress(ConvergenceError):
            solve_contact(
                grid,
                gap,
                load=float(guess.sum()),
                start=guess,
                tolerance=1e-11,
                max_iterations=_ITERATIONS,
                present=present,
            )
        times.append((time.thread_time() - began) / max(grid.convolutions - before, 1))
    return min(times)


def _work(cells: float) -> float:
    """Return the work of a transform, in any unit."""
    return cells * math.log2(cells + 2)


# ------------------------------------------------------------------------------------------------------ the coarse run


class CoarseRun(NamedTuple):
    """Cost and contact of a coarse run.

    Attributes
    ----------
    height : xarray.DataArray
        Surface. [m]
    steps, convolutions : float
        Of all rows but those in slides, carried on to the end of the program; of a curve: of all its speeds.
    slid_steps, slid_convolutions : float
        Steps of one cell in slides, and their convolutions.
    rows : float
        Rows kept, over the steps.
    contact : tuple of float
        Part of the cells in contact, of each kept row and each row in a slide.
    fraction : float
        Largest contact fraction, corrected for the staircase of the cells. [-]
    force : float
        Largest force. [N]
    seconds : float
        Time of a convolution with all that belongs to it. [s]
    """

    height: xr.DataArray
    steps: float
    convolutions: float
    slid_steps: float
    slid_convolutions: float
    rows: float
    contact: tuple[float, ...]
    fraction: float
    force: float
    seconds: float


def coarse_run(setup: Setup) -> CoarseRun:
    """Run a case on few cells, with its own tolerance and kept times.

    A long run ends early. Its steps are then carried on, and an elastic solution gives its contact.
    """
    problem, experiment, count = setup.problem, setup.experiment, 0
    few = coarse_surface(setup)
    settings = replace(problem.settings, fields=(), grid_error=False)
    if isinstance(experiment, Loading):
        settings = replace(settings, edge="accept", missing="absent")
        program = with_coarse_slides(experiment.program, spacing(few))
        if program.slides:  # its kept times may lie beyond its end
            settings = replace(settings, times=settings.times and len(program.corners))
        experiment = Loading(program)
    else:
        assert isinstance(experiment, SteadySliding)
        order = np.argsort(experiment.speeds)
        few_speeds = order[np.unique(np.linspace(0, len(order) - 1, min(_FEW_SPEEDS, len(order))).astype(int))]
        experiment, count = replace(experiment, speeds=[experiment.speeds[one] for one in few_speeds]), len(order)
    problem = Problem(few, problem.body, settings)
    course = _course(problem, experiment)
    fraction, contact, tally = course.fraction, course.contact, course.tally()
    steps = float(tally[:, 0].sum())
    if not course.is_whole:
        done, in_all = (_measure(program, time) for time in (course.times[-1], program.duration))
        tally[0] *= in_all / max(done, 1e-6)
        fraction = max(fraction, elastic_contact(problem, program))
        contact = [*contact, fraction]
    if count:
        tally[0] *= count / max(steps, 1.0)
    (others, slid), rows = tally.tolist(), course.kept / max(steps, 1.0)
    seconds = course.seconds / max(sum(course.convolutions), 1.0)
    return CoarseRun(few, others[0], others[1], slid[0], slid[1], rows, tuple(contact), fraction, course.force, seconds)


def elastic_contact(problem: Problem, program: Program) -> float:
    """Return the largest contact fraction of a program, by one elastic solution.

    While a contact grows beyond its former extent, an elastic body has the same pressure and approach under the load
    ``integral C(t - s) dF(s)`` over its compliance [1]_.

    References
    ----------
    .. [1] T. C. T. Ting, J. Appl. Mech. 35 (1968) 248.
    """
    times, loads, approach = [0.0], [0.0], 0.0
    for began, segment in zip(program.corners, program.segments, strict=False):
        if segment.control == "approach":
            approach = max(approach, (segment.end or 0.0) + abs(segment.amplitude))
            continue
        start, waves = loads[-1], min(max(segment.duration / segment.period, 1.0), 20.0)
        for elapsed in np.linspace(0, min(segment.duration, waves * segment.period), int(16 * waves)):
            times.append(began + elapsed)
            loads.append(segment.value(elapsed, start))
    middles, changes, material = 0.5 * (np.array(times)[1:] + times[:-1]), np.diff(loads), problem.body.material
    effective = 0.0
    for last in np.unique(np.linspace(1, changes.size, 60).astype(int)) if changes.size else ():
        ages = np.maximum(times[last] - middles[:last], 0.0)
        effective = max(effective, float(material.contact_compliance(ages) @ changes[:last]))
    profile = Profile(problem.height, "absent", problem.body.kernel)
    boundary, found = problem.settings.boundary, 0.0
    grid = Grid(profile.gap.shape, profile.spacing, boundary, kernel=profile.kernel)
    pushes: list[dict[str, Any]] = [{"load": effective / grid.cell_area}] if effective > 0 else []
    pushes += [{"approach": approach}] if approach > profile.least_gap else []
    for push in pushes:
        with suppress(ConvergenceError):
            pressed = solve_contact(grid, profile.gap, tolerance=1e-2, present=profile.present, **push).pressure > 0
            found = max(found, float(pressed.sum()) / pressed.size)
    return found


class _Course(NamedTuple):
    """Rows of a coarse run.

    Attributes
    ----------
    times : list of float
        Place of each row. [s], or [m/s] of a friction curve
    slides : list of bool
        Whether each row is in a slide.
    convolutions : list of float
        Of each row.
    kept : int
        Number of kept rows.
    contact : list of float
        Part of the cells in contact, of each kept row and each row in a slide.
    fraction, force : float
        Largest contact fraction and force. [-, N]
    seconds : float
        Time of the run. [s]
    is_whole : bool
        Whether it came to its end.
    """

    times: list[float]
    slides: list[bool]
    convolutions: list[float]
    kept: int
    contact: list[float]
    fraction: float
    force: float
    seconds: float
    is_whole: bool

    def tally(self) -> Any:
        """Return steps and convolutions, outside of slides and in them."""
        found = np.zeros((2, 2))
        for slides, convolutions in zip(self.slides, self.convolutions, strict=True):
            found[int(slides)] += 1.0, convolutions
        return found


def _course(problem: Problem, experiment: Experiment) -> _Course:
    """Run an experiment, but not for long."""
    program = experiment.program if isinstance(experiment, Loading) else None
    times, slides, convolutions, contact = list[float](), list[bool](), list[float](), list[float]()
    fraction, force, kept, before, is_whole = 0.0, 0.0, 0, 0.0, True
    area, began = nominal_area(problem.height), time.thread_time()
    with fft.set_workers(1):
        for row in experiment.rows(problem):
            number = 0 if program is None else max(bisect_left(program.corners, row.at) - 1, 0)
            slides.append(program is not None and program.segments[number].slide is not None)
            total = before  # in the middle of a pair it is counted with the end
            if program is None:
                total += row.values["convolutions"]
            elif row.state is not None:
                total = row.state.march.convolutions
            times.append(row.at)
            convolutions.append(total - before)
            before = total
            if row.values:
                fraction = float(np.fmax(fraction, row.values["contact_fraction"]))
                force = float(np.fmax(force, row.values["force"]))
            if row.values and row.kept:
                kept += 1
            if row.values and (row.kept or slides[-1]):  # the corners of a slide are no sample of its kept times
                contact.append(float(np.nan_to_num(row.values["contact_area_counted"])) / area)
            if program is not None and (total > _MOST_CONVOLUTIONS or len(times) > _MOST_STEPS):
                is_whole = row.at >= program.duration
                break
    seconds = time.thread_time() - began
    return _Course(times, slides, convolutions, kept, contact, fraction, force, seconds, is_whole)


def coarse_surface(setup: Setup) -> xr.DataArray:
    """Return the surface of a domain on few cells, with the waves that these hold. [m]"""
    height, most = setup.height, _COARSE if isinstance(setup.experiment, Loading) else _COARSE_CURVE
    shape = (height.sizes["x"], height.sizes["y"])
    factor = max(shape) / most
    if factor <= 1:
        return height
    size = tuple(count * side for count, side in zip(shape, spacing(height), strict=True))
    few = remade(setup.problem.height, coarser_shape(shape, factor, same_parity=True), (size[0], size[1]))
    if few is None and np.isfinite(height.values).all():
        boundary = setup.problem.settings.boundary
        assert boundary != "auto", "Setup knows the boundary"
        return on_fewer_cells(height, coarser_shape(shape, factor, False), boundary)
    stride = math.ceil(factor)
    return height.isel(x=slice(stride // 2, None, stride), y=slice(stride // 2, None, stride)) if few is None else few


def with_coarse_slides(program: Program, sides: tuple[float, float]) -> Program:
    """Return the program with slides of at least one coarse cell, and not of many, at their speed."""
    segments = []
    for segment in program.segments:
        if segment.slide is not None:
            side = sides[segment.slide.axis]
            way = float(np.clip(segment.slide.distance, side, _MOST_SLID * side))
            duration = segment.duration * way / segment.slide.distance
            segment = replace(segment, duration=duration, slide=Slide(way, segment.slide.direction))
        segments.append(segment)
    return replace(program, segments=tuple(segments))


def _measure(program: Program, time: float) -> float:
    """Return how far a march has come at a time [s], slides left out: it takes more steps early in a hold."""
    total = 0.0
    for began, segment in zip(program.corners, program.segments, strict=False):
        if segment.slide is not None or segment.duration == 0 or time <= began:
            continue
        part = min((time - began) / segment.duration, 1.0)
        if segment.holds:
            part = math.log1p(part / _FIRST_STEP) / math.log1p(1 / _FIRST_STEP)
        total += part * _weight(segment)
    return total


def _weight(segment: Segment) -> float:
    """Return the steps of a segment, relative to others."""
    return 8 * segment.duration / segment.period if segment.amplitude else 1.0


# ---------------------------------------------------------------------------------------------------------------- rows


def _row_of(case: Case, height: xr.DataArray | None) -> dict[str, Any]:
    """Return a row in which only the case and its grid are known."""
    boundary = case.settings.boundary
    row: dict[str, Any] = {name: "" if not unit else np.nan for name, (unit, _) in COLUMNS.items()}
    row |= {"boundary": boundary, "padded": boundary == "free", "marched": False, "late_times": _late_times(case)}
    row |= {"exponentials": 0, **dict.fromkeys(_COUNTS, 0)}
    return row if height is None else row | {"cells_x": height.sizes["x"], "cells_y": height.sizes["y"]}


def _planned(
    case: Case, setup: Setup, run: CoarseRun, setups: _Setups, there: Available, is_own: bool
) -> dict[str, Any]:
    """Return the row of a case, by its own coarse run or by that of a similar case."""
    problem, experiment, settings = setup.problem, setup.experiment, setup.problem.settings
    whole, height, body = problem.height, setup.height, problem.body
    octaves = max(math.log2(math.sqrt(height.size / run.height.size)), 0.0)
    steps = run.steps * (2 ** (_STEPS_GROW * octaves) if settings.time_step == "auto" else 1.0)
    power = _WORK_GROWS if isinstance(experiment, Loading) else _CURVE_GROWS
    work, rows, force = run.convolutions * 2 ** (power * octaves), run.steps, run.force if is_own else math.nan
    fraction = corrected(run.fraction, setup.domain_slope, rms_slope(run.height))
    dearer = 1.0 if isinstance(experiment, Loading) else _CURVE_CONVOLUTION
    contact = np.array(run.contact or (0.0,)) * (fraction / run.fraction if run.fraction > 0 else 1.0)
    row, kind, passes = _row_of(case, whole) | {"marched": is_own}, "curve", 0.0
    if isinstance(experiment, Loading):
        program, choice = experiment.program, setups.choice(case, experiment.program)
        history = choice.memory
        cells = sum(one.slide.cells(spacing(whole)) for one in program.segments if one.slide is not None)
        steps, work = steps + cells, work + cells * run.slid_convolutions / max(run.slid_steps, 1.0)
        kept = kept_times(program, settings.times, spacing(whole))
        rows = run.rows * steps if kept is None else float(len(kept))
        kind, passes = "slide" if cells else "load", steps * (_PASSES + _MORE_PASSES * history.times.size)
        if any(one.control == "load" and one.end is not None for one in program.segments):
            force = float(np.fmax(force, program.largest_load))
        row |= {
            "memory_model": choice.note,
            "exponentials": history.times.size,
            "scheme": _scheme(settings.time_step, history.times.size, cells),
            "steps": steps,
            "program_note": case.program.note,
        }
    else:
        row |= {"memory_model": "steady sliding", "speeds": rows}

    def needed(cells: float) -> float:
        if isinstance(experiment, Loading):
            size = march_bytes(settings, history, cells, contact=float(contact.max()), rows=rows, part=setup.part)
        else:
            size = curve_bytes(settings, cells)
        return PROCESS + size

    touching = float(contact.mean())
    beyond = setups.seconds(height, problem, touching) - setups.seconds(run.height, problem, touching)
    seconds = work * (run.seconds + dearer * max(beyond, 0.0)) + passes * _PASS * (height.size - run.height.size)
    again = 1 + (_GRID_ERROR if settings.has_grid_error(whole.size, experiment.axis) else 0.0)
    length = max(float(np.ptp(whole[axis].values)) for axis in ("x", "y"))
    full = full_contact_pressure(setup.slope, body.material, creep_time(experiment, length))
    memory, pressure = needed(whole.size), force / setup.area
    row |= {
        "solved_cells_x": height.sizes["x"],
        "solved_cells_y": height.sizes["y"],
        "rows": rows,
        "nominal_pressure": pressure,
        "full_contact_pressure": full,
        "convolutions": work,
        "wall_time": seconds * again + rows * whole.size * 8 * len(settings.fields) * _WRITE + _FILE,
        "memory": memory,
        "disk": _VARIABLES[kind] + disk(case, whole.size, rows, steps, setup.part * contact),
        "warning": full_contact_warning(pressure, full),
        "border_warning": border_warning(whole.shape) if setup.reaches_border else "",
        "refusal": "" if there.fits(memory) else too_large((whole.sizes["x"], whole.sizes["y"]), needed, there),
    }
    if not is_own:
        return row
    fraction *= setup.part
    coarse = {"coarse_cells_x": run.height.sizes["x"], "coarse_cells_y": run.height.sizes["y"]}
    row |= coarse | {"contact_fraction": fraction}
    return row if fraction >= _NEARLY_FULL else row | {"warning": ""}


def corrected(fraction: float, slope: float, coarse_slope: float) -> float:
    """Return the contact fraction of a rough surface from that on a coarse grid, whose slopes are smaller.

    Parameters
    ----------
    fraction : float
        On the coarse grid. [-]
    slope, coarse_slope : float
        Root mean square slopes of both. [-]
    """
    if not (slope > 0 and coarse_slope > 0) or fraction >= 1:
        return fraction
    return float(erf(erfinv(fraction) * coarse_slope / slope))


def disk(case: Case, cells: int, rows: float, steps: float, contact: Any) -> float:
    """Return the size of the values in the file of a case. [byte]

    Parameters
    ----------
    case : Case
        Fields and their precision.
    cells : int
        Of the surface.
    rows, steps : float
        Kept times, and accepted steps.
    contact : ndarray
        Part of the cells in contact at kept times.
    """
    touching = rows * (float(contact.mean()) + 0.01)
    pressure, other = touching, rows
    if case.precision is not None:
        bits = -math.log2(case.precision)
        pressure, other = touching * (bits + _PRESSURE_BITS) / 64, rows * (bits + _FIELD_BITS) / 64
    fields = sum(pressure if name == "pressure" else other for name in case.settings.fields)
    return 8.0 * cells * (fields + 1.0) + rows * _ROW + steps * 8 * len(STEPPED)


def _scheme(time_step: Any, exponentials: int, slid: int) -> str:
    """Return how the time steps are chosen, in words."""
    steps = "steps chosen by the tolerance" if time_step == "auto" else f"steps of {time_step:g} s"
    pairs = f"pairs of {steps}, compared with one step twice as long" if exponentials else f"no memory: {steps}"
    return f"{pairs}, {slid} of one cell in slides" if slid else pairs


def _late_times(case: Case) -> str:
    """Return the listed times after the end of the program, in words."""
    late = case.late_times
    if not late:
        return ""
    unit, end = unit_for(late, "s"), case.program.duration
    texts = ", ".join(unit.text(time) for time in late)
    return f"{texts} left out: the program ends at {unit_for([end], 's').text(end)}"


def full_contact_pressure(slope: float, material: Any, duration: float) -> float:
    r"""Return the nominal pressure at which contact takes 95 % of the area. [Pa]

    Parameters
    ----------
    slope : float
        Root mean square slope between neighbouring cells. [-]
    material : Material
        Of the half-space.
    duration : float
        Time by which the material has crept. [s]

    Notes
    -----
    Persson's theory of contact has the contact fraction :math:`\mathrm{erf}(\sqrt 2\, p / (E^* h'))` under a nominal
    pressure ``p``, with the root mean square slope ``h'``: 95 % at ``p = E* h'``. Here ``E* = 1 / C(t)`` is that of
    the end of the program, where the material is softest.

    References
    ----------
    B. N. J. Persson, J. Chem. Phys. 115, 3840 (2001).
    """
    compliance = float(material.contact_compliance(duration))
    return slope / compliance if compliance > 0 else math.inf  # nothing has crept yet


def full_contact_warning(pressure: float, full: float) -> str:
    """Return the warning of a nominal pressure beyond that of nearly full contact, zero for a flat surface. [Pa]"""
    if not pressure >= full > 0:
        return ""
    return (
        f"Full contact is expected: the nominal pressure comes to {pressure / 1e6:.3g} MPa. At {full / 1e6:.3g} MPa "
        "more than 95 % of the area is in contact (Persson: modulus at the end of the program times rms slope)."
    )


def border_warning(shape: tuple[int, ...]) -> str:
    """Return the warning of contact at the border of a free surface of so many cells."""
    return (
        f"Contact is expected to reach the border of the free-space domain of {shape[0]} x {shape[1]} cells, which "
        "ends a run: use boundary = 'periodic' for a nominally flat scan, a larger surface, a smaller load, or edge = "
        "'accept' to treat the scan outline as a punch."
    )


# -------------------------------------------------------------------------------------------------------------- sweeps


def _surface_name(case: Case, stated: Mapping[str, Any]) -> str:
    """Return a name of the surface; surfaces that differ by their seed alone cost the same."""
    surface = {key: value for key, value in stated["surface"].items() if key != "seed"}
    return json.dumps(surface, sort_keys=True)


def _spread(count: int) -> list[int]:
    """Return the integers below a count: first and last, then halves, quarters and so on between them."""
    order = dict.fromkeys([0, count - 1])
    pieces = 2
    while len(order) < count:
        order |= dict.fromkeys(i * (count - 1) // pieces for i in range(1, pieces))
        pieces *= 2
    return list(order)


def _most_similar(number: int, others: Sequence[int], parameters: Mapping[str, Any]) -> int:
    """Return the case with most parameters in common, the nearest of those."""

    def distance(other: int) -> tuple[int, int]:
        return sum(values[other] != values[number] for values in parameters.values()), abs(other - number)

    return min(others, key=distance)


def totals(dataset: xr.Dataset, folder: Path, workers: int | None, there: Available) -> dict[str, Any]:
    """Return totals, free memory and disk, and why the cases do not fit."""
    place = existing_part(folder.absolute())
    free_disk, total = shutil.disk_usage(place).free, dataset.sizes["case"]
    seconds = np.nan_to_num(dataset["wall_time"].values)
    largest = np.sort(np.nan_to_num(dataset["memory"].values))[::-1]
    processes = min(workers or cores(), total)
    if workers is None:
        processes = processes_that_fit(largest, processes, there.size)
    together = float(np.sum(largest[:processes]))
    size = float(np.nansum(dataset["disk"].values))
    refusals = Counter(str(text) for text in dataset["refusal"].values if text)
    reasons = [f"{count} of {total} cases: {why}" if total > 1 else why for why, count in refusals.most_common(3)]
    if together > PART * there.size >= largest[0]:
        needed = f"{processes} processes need {amount(together)} of memory, and {amount(there.size)} are {there.words}"
        reasons.append(f"{needed}: use --workers {processes_that_fit(largest, processes, there.size)}")
    if size > PART * free_disk:
        reasons.append(
            f"the results need {size:.3g} bytes of disk, {free_disk:.3g} are free in {place}: keep fewer times or "
            "fields, or use another folder"
        )
    return {
        "processes": processes,
        "threads": threads_each(processes),
        "wall_time": max(float(np.sum(seconds)) / processes, float(np.max(seconds, initial=0.0))),
        "memory": together,
        "free_memory": there.size,
        "disk": size,
        "free_disk": free_disk,
        "refusal": "; ".join(reasons),
    }


def attributes(name: str) -> dict[str, str]:
    """Return the attributes of a variable of a plan."""
    units, long_name = COLUMNS[name]
    return {"long_name": long_name} | ({"units": units} if units else {})
