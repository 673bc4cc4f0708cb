"""``roughvisc plan``: steps, time, memory and disk of each case, estimated before the study is run.

A run on few cells gives the numbers of steps and convolutions and the contact, which grow slowly with the grid. A timed
convolution on the real grid gives the time. Memory and disk follow from the sizes of the arrays.
"""

from __future__ import annotations

import json
import math
import shutil
import time
from bisect import bisect_left
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import fft
from scipy.special import erf, erfinv

from roughvisc.arguments import count
from roughvisc.errors import ConvergenceError, InputError
from roughvisc.experiment.base import Rows
from roughvisc.experiment.loading import Loading, LoadingRows
from roughvisc.experiment.memory_limit import (
    PART,
    PROCESS,
    Available,
    amount,
    curve_bytes,
    march_bytes,
    memory_available,
    too_large,
)
from roughvisc.experiment.problem import Problem
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.grid import Grid, arrays_of, to_host
from roughvisc.mechanics.program import Program
from roughvisc.runs.cluster import processes_that_fit, threads_each
from roughvisc.runs.folder import existing_part
from roughvisc.runs.run import result_folder
from roughvisc.study.case import Case, cases_given, labels_of, parameters_of
from roughvisc.topography.grid import nominal_area, rms_slope, spacing
from roughvisc.variables import STEPPED

#: Numbers of a plan -> unit; texts of a plan.
UNITS = dict.fromkeys(("cells_x", "cells_y", "steps", "rows", "contact_fraction", "convolutions"), "1")
UNITS |= {"nominal_pressure": "Pa", "wall_time": "s", "memory": "byte", "disk": "byte"}
TEXTS = ("model", "note", "warning", "refusal")
#: Longest side of the grid of a coarse run, of a loading and of a friction curve. [cells]
_COARSE = 128
_COARSE_CURVE = 48
#: Exponents with which steps, and convolutions of loadings and of friction curves, grow with the number of cells a
#: side. On 15 measured cases of rough surfaces, balls, slides and curves, of 96 to 512 cells a side, the exponent of
#: convolutions is 0.25 to 0.65, under a prescribed approach 0.9, and for curves 0.15.
_STEPS_GROW = 0.1
_WORK_GROWS = 0.4
_CURVE_GROWS = 0.15
#: Largest numbers of convolutions and steps of a coarse run. A time limit would depend on the load of the machine.
_MOST_CONVOLUTIONS = 2500
_MOST_STEPS = 500
#: Part of a program below which a run is repeated with a looser tolerance: the steps of the first contact do not
#: predict later ones. Factor of the tolerance, its largest value, and the exponent of the tolerance in the number of
#: steps (0.45 to 0.53 on a polymer with 18 exponentials, 1e-3 to 1e-1).
_LITTLE = 0.2
_LOOSER = 100.0
_LOOSEST = 0.1
_BY_TOLERANCE = 0.5
#: Largest number of speeds of a coarse friction curve, spread evenly over the speeds of the case.
_FEW_SPEEDS = 7
#: First step of a hold over the length of the hold. Later steps grow in proportion to the time.
_FIRST_STEP = 0.005
#: Iterations of a timed solve.
_ITERATIONS = 3
#: Time for the coarse runs of a sweep: this time, or this part of the expected time of all cases. [s, 1]
_BUDGET = 1.2
_SHARE = 0.05
#: Contact fraction above which a number in a wrong unit is likely. Rough surfaces are rarely pressed so far: it takes
#: a pressure of 0.8 rms slopes times the modulus, and a modulus in MPa taken as Pa gives full contact.
_MOST_CONTACT = 0.9
#: Time of the rest of a step, and of each exponential in a step, over the time of a convolution. Time per convolution
#: of a friction curve over the time of a convolution of a contact problem, at 256 and 1024 cells a side.
_STEP = 2.0
_EXPONENTIAL = 0.4
_CURVE_CONVOLUTION = 2.1
#: Work of the run on a coarser grid for the grid error, over the work of the run. [-]
_GRID_ERROR = 0.3
#: Size of the file of a friction curve, a loading and a loading with slides, without the values of variables. [byte]
_VARIABLES = {"curve": 90e3, "load": 122e3, "slide": 147e3}
#: Size of a row without its fields. [byte]
_ROW = 300.0


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
        Number of parallel processes; 0: this process. Default: one per core, or fewer if the memory is too small.

    Returns
    -------
    xarray.Dataset
        One row per case along ``case``, with varied parameters as coordinates.

        ``model``: boundary, memory of the material, and the part of the surface that is solved on. ``steps``, or
        speeds of a friction curve; ``rows``, the kept ones; ``convolutions``, of one forward and one inverse transform
        each; ``wall_time`` in one process with one thread [s]; ``memory`` of the process at its peak and ``disk``, the
        size of the result [byte]; the largest ``contact_fraction`` and ``nominal_pressure`` [Pa], NaN without a
        coarse run for an approach, an indenter or a friction curve. ``marched``: whether it had a coarse run, or the
        numbers are from the nearest case. ``note``: how a measured history became segments, and times that are left
        out. ``warning``: expected contact at the border, which ends a run. ``refusal``: why it cannot run.
        Attributes: the number of parallel ``processes`` and the ``threads`` of each, the total ``wall_time`` with one
        thread each [s], ``memory`` of all processes [byte], ``disk`` [byte], the free memory and disk, and
        ``refusal``, empty if all cases can run.

    Raises
    ------
    InputError
        If the study file is invalid.

    See Also
    --------
    roughvisc.run, roughvisc.sweep, roughvisc.trade

    Notes
    -----
    A case runs on at most 128 cells a side, with its own tolerance and kept times; a friction curve on 48, at some of
    its speeds. Steps and convolutions are extrapolated to the real grid. The contact fraction comes from the coarse
    run; Persson's theory corrects it for the slopes that the coarse grid does not resolve. The time follows from a few
    iterations on the real grid. The time is accurate to a factor of 2, memory to 1.3, disk and contact fraction to 1.2.
    In a sweep with many cases some have no coarse run, and the coarse run of the nearest case in the list is used.

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> rv.plan(case).sizes["case"]
    1
    """
    cases = cases_given(cases)
    count("workers", workers, 0)
    folder = result_folder(cases[0], out)
    there = memory_available(cases[0].settings.device)
    stated = [json.loads(case.to_json()) for case in cases]
    parameters = parameters_of(stated)
    surfaces: dict[str, tuple[xr.DataArray, float]] = {}
    runs: dict[int, CoarseRun] = {}
    rows: list[dict[str, Any]] = [{}] * len(cases)
    began = time.thread_time()
    expected = 0.0
    for number in sorted(range(len(cases)), key=lambda one: f"{one:b}"[::-1]):  # spread over the sweep: 0, 4, 2, 1, 3
        case = cases[number]
        is_own = not runs or time.thread_time() - began < max(_BUDGET, _SHARE * expected)
        row = dict.fromkeys(UNITS, np.nan) | dict.fromkeys(TEXTS, "") | {"marched": is_own}
        # surfaces that differ only in their seed have equal costs
        surface = json.dumps({**stated[number]["surface"], "seed": None}, sort_keys=True)
        try:
            if surface not in surfaces:
                ready = time.thread_time()
                surfaces[surface] = case.height(), time.thread_time() - ready
            height, seconds = surfaces[surface]
            ready = time.thread_time()
            problem = case.experiment.resolved(Problem(height, case.body, case.settings))
            own = case.experiment.rows(problem, in_memory=False)
            seconds += time.thread_time() - ready
            if is_own:
                runs[number] = coarse_run(own, case)
                expected = len(cases) * float(np.mean([one.seconds for one in runs.values()]))
            nearest = min(runs, key=lambda other: abs(other - number))
            row |= _costs(case, own, runs[nearest], seconds, there)
            if not is_own:
                row |= _scaled_from(runs[nearest], cases[nearest], case, own)
        except (InputError, ConvergenceError) as error:
            row["refusal"] = str(error)
        rows[number] = row
    columns = {name: ("case", [row[name] for row in rows]) for name in (*UNITS, *TEXTS, "marched")}
    dataset = xr.Dataset(columns, {"case_key": ("case", [case.key for case in cases])})
    for name, unit in UNITS.items():
        dataset[name].attrs["units"] = unit
    labels = labels_of(parameters, stated[0], ("case",)).values()
    dataset = dataset.assign_coords(dict(zip(parameters, labels, strict=True)))
    return dataset.assign_attrs({"title": cases[0].title} | totals(dataset, folder, workers, there))


# ------------------------------------------------------------------------------------------------------ the coarse run


class CoarseRun(NamedTuple):
    """Costs and contact of a case, from a coarse run.

    Attributes
    ----------
    steps, convolutions : float
        Time steps or speeds, and convolutions, on the real grid.
    kept : float
        Kept part of the steps. [-]
    contact : ndarray
        Contact fraction in each kept row and each row in a slide; last the largest of all rows. [-]
    force : float
        Largest force. [N]
    seconds : float
        Time of the steps. [s]
    cells : int
        Cells that are solved on.
    """

    steps: float
    convolutions: float
    kept: float
    contact: NDArray[np.float64]
    force: float
    seconds: float
    cells: int


def coarse_run(own: Rows, case: Case, looser: float = 1.0) -> CoarseRun:
    """Run a case on few cells, with its own tolerance and kept times, and time a convolution on its own grid.

    A long run is stopped early, and its steps and its contact are extrapolated to the end of the program. After a very
    small part of the program the run is repeated with a looser tolerance.

    Parameters
    ----------
    own : Rows
        Rows of the case on its own grid, not computed.
    case : Case
        The case.
    looser : float
        Tolerance of the run over the tolerance of the case.
    """
    tolerance = looser * case.settings.tolerance
    settings = replace(case.settings, fields=(), grid_error=False, tolerance=tolerance)
    experiment = case.experiment
    few = coarse_surface(own)
    height = solved(own)
    share = 1.0
    program = own.scene.program if isinstance(own, LoadingRows) else None
    if program is not None:
        settings = replace(settings, edge="accept", missing="absent")
    elif isinstance(experiment, SteadySliding):
        speeds = np.sort(experiment.speeds)
        chosen = speeds[:: math.ceil(speeds.size / _FEW_SPEEDS)]
        experiment = replace(experiment, speeds=chosen)
        share = chosen.size / speeds.size

    spent = np.zeros((2, 2))  # steps and convolutions at rest, and in slides
    kept = 0
    contact = list[float]()
    largest = 0.0
    force = 0.0
    before = 0.0
    reached = list[float]()  # times of the steps
    with fft.set_workers(1):
        rows = experiment.rows(Problem(few, case.body, settings))
        began = time.thread_time()
        for row in rows:
            reached.append(row.at)
            slides = False  # inside a pair of steps: its convolutions are counted at its end
            total = before
            if program is None:
                total += row.values["convolutions"]
            else:
                slides = program.segments[max(bisect_left(program.corners, row.at) - 1, 0)].slide is not None
                if row.state is not None:
                    total = row.state.march.convolutions
            spent[int(slides)] += 1.0, total - before
            before = total
            kept = kept + bool(row.values and row.kept)
            if row.values:
                fraction = float(np.nan_to_num(row.values["contact_fraction"]))
                largest = max(largest, fraction)
                force = float(np.fmax(force, row.values["force"]))
                if row.kept or slides:  # corners alone do not represent the kept times of a slide
                    contact.append(fraction)
            if program is not None and (total > _MOST_CONVOLUTIONS or spent[:, 0].sum() > _MOST_STEPS):
                share = _part_done(program, reached)
                compliance = case.body.material.contact_compliance
                is_chosen = isinstance(own, LoadingRows) and not own.scene.time_step
                if share < _LITTLE and is_chosen and looser == 1 and tolerance < _LOOSEST:
                    return coarse_run(own, case, min(_LOOSEST / tolerance, _LOOSER))
                rest = sum(one.duration for one in program.segments if one.slide is None)
                now = float(compliance(min(row.at, rest)))
                end = float(compliance(rest))
                if force * now > 0:  # further loading, and creep except in slides
                    largest = scaled_contact(largest, max(program.largest_load * end / (force * now), 1.0))
                break
        seconds = (time.thread_time() - began) / max(before, 1.0)
        beyond = 0.0
        if height.size > few.size:
            touching = float(np.mean([*contact, largest]))
            beyond = max(timed_convolution(own, touching) - timed_convolution(rows, touching), 0.0)

    octaves = max(math.log2(height.size / few.size) / 2, 0.0)
    kept_part = kept / max(spent[:, 0].sum(), 1.0)
    still = spent[0] / share * looser**_BY_TOLERANCE
    moving = spent[1]
    if isinstance(own, LoadingRows):
        cells = sum(one.slide.cells(spacing(few)) for one in own.scene.program.segments if one.slide is not None)
        step = moving / moving[0] if moving[0] else still / max(still[0], 1.0)
        moving = step * max(cells, moving[0])
        growth = np.array([0.0 if own.scene.time_step else _STEPS_GROW, _WORK_GROWS])
        steps, work = (still * 2.0 ** (octaves * growth) + moving * 2.0**octaves).tolist()
        dearer = work + steps * (_STEP + _EXPONENTIAL * own.scene.memory.times.size)
    else:
        steps = still[0]
        work = still[1] * 2 ** (_CURVE_GROWS * octaves)
        dearer = work * _CURVE_CONVOLUTION
    slope = rms_slope(height)
    touched = scaled_contact(largest, rms_slope(few) / slope) if slope > 0 else largest
    scaled = np.array([*contact, largest]) * (touched / largest if largest > 0 else 1.0)
    return CoarseRun(steps, work, kept_part, scaled, force, work * seconds + dearer * beyond, height.size)


def _scaled_from(run: CoarseRun, done: Case, case: Case, own: Rows) -> dict[str, float]:
    """Return contact fraction and nominal pressure of a case without a coarse run; NaN if they are not known.

    Parameters
    ----------
    run, done : CoarseRun, Case
        Coarse run of the nearest case, and this case.
    case : Case
        The case.
    own : Rows
        Its rows, not computed.
    """
    unknown = {"contact_fraction": np.nan, "nominal_pressure": np.nan}
    if not isinstance(own, LoadingRows) or own.problem.settings.boundary == "free":
        return unknown  # a friction curve, an indenter
    load = own.scene.program.largest_load
    if not (load > 0 and run.force > 0):
        return unknown  # an approach
    compliances = [
        float(one.body.material.contact_compliance(one.experiment.program.duration))
        for one in (case, done)
        if isinstance(one.experiment, Loading)
    ]
    ratio = load * compliances[0] / (run.force * compliances[-1])
    return {"contact_fraction": scaled_contact(float(run.contact[-1]), ratio), "nominal_pressure": load / own.area}


def scaled_contact(fraction: float, times: float) -> float:
    r"""Return a contact fraction after scaling the ratio of pressure to modulus times slope.

    Parameters
    ----------
    fraction : float
        Contact fraction. [-]
    times : float
        Factor of the ratio. [-]

    Notes
    -----
    In Persson's theory the fraction is :math:`\mathrm{erf}(\sqrt 2\, p / (E^* h'))` under a nominal pressure ``p``,
    where ``h'`` is the root mean square slope [1]_.

    References
    ----------
    .. [1] B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840.
    """
    return float(erf(erfinv(fraction) * times)) if 0 < fraction < 1 and times > 0 else fraction


def solved(rows: Rows) -> xr.DataArray:
    """Return the heights on the solved grid, which in free space may be a part of the surface. [m]"""
    if not isinstance(rows, LoadingRows):
        return rows.problem.height
    along_x, along_y = rows.domain.cells
    return rows.problem.height.isel(x=along_x, y=along_y)


def coarse_surface(rows: Rows) -> xr.DataArray:
    """Return the heights of the solved grid at a part of its points, evenly spread. [m]"""
    height = solved(rows)
    stride = math.ceil(max(height.shape) / (_COARSE if isinstance(rows, LoadingRows) else _COARSE_CURVE))
    return height.isel(x=slice(stride // 2, None, stride), y=slice(stride // 2, None, stride))


def _part_done(program: Program, times: list[float]) -> float:
    """Return the part of the steps up to now over all steps of a program, without slides. [-]

    The steps of a hold are shorter at its start, and a cycle has two ramps per period. The steps of a ramp grow too,
    while the fast parts of the material relax.

    Parameters
    ----------
    program : Program
        The program.
    times : list of float
        Times of the steps up to now. [s]
    """
    now = times[-1]
    done = 0.0
    total = 0.0
    for began, segment in zip(program.corners, program.segments, strict=False):
        if segment.slide is not None or segment.duration == 0:
            continue
        part = min(max(now - began, 0.0) / segment.duration, 1.0)
        weight = 1.0
        if segment.amplitude:
            weight = 2 * segment.duration / segment.period
        elif segment.holds:
            part = math.log1p(part / _FIRST_STEP) / math.log1p(1 / _FIRST_STEP)
        elif 0 < part < 1:
            part = _part_of_ramp(np.array(times) - began, segment.duration)
        done = done + part * weight
        total = total + weight
    return max(done / total, 1e-6) if total else 1.0


def _part_of_ramp(times: NDArray[np.float64], duration: float) -> float:
    """Return the part of the steps of a ramp that are done, from their numbers in the last two octaves of time. [-]

    Parameters
    ----------
    times : ndarray
        Times of the steps since the start of the ramp; before it negative. [s]
    duration : float
        Duration of the ramp. [s]
    """
    now = float(times[-1])
    last, former = (np.count_nonzero((times > now / wide) & (times <= 2 * now / wide)) for wide in (2, 4))
    octaves = math.log2(duration / now)
    if former == 0:
        return now / duration
    growth = min(max(last / former, 1.0), 2.0)  # equal steps double in each octave, steps in proportion to time do not
    rest = last * (octaves if growth == 1 else growth * (growth**octaves - 1) / (growth - 1))
    done = np.count_nonzero(times > 0)
    return float(done / (done + rest))


def timed_convolution(rows: Rows, touching: float) -> float:
    """Return the time of a contact solve of few iterations per convolution. [s]

    Parameters
    ----------
    rows : Rows
        Grid and gap.
    touching : float
        Part of the cells in contact. [-]
    """
    if isinstance(rows, LoadingRows):
        grid = rows.scene.grid
        gap = rows.scene.gap
        present = rows.scene.present
    else:
        height = rows.problem.height
        xp = arrays_of(rows.problem.settings.device)
        gap = xp.asarray(float(height.max()) - height.values)
        present = None
        grid = Grid((gap.shape[0], gap.shape[1]), spacing(height), "periodic", xp=xp)
    gaps = to_host(gap)
    guess = np.maximum(np.quantile(gaps, min(max(touching, 0.01), 0.9)) - gaps, 0.0)
    if present is not None:
        guess *= to_host(present)
    if not guess.any():
        guess = np.ones(gap.shape)
    load = float(guess.sum())
    start = grid.xp.asarray(guess)
    times = []
    for _ in range(2):  # the first solve allocates memory
        began = time.thread_time()
        before = grid.convolutions
        with suppress(ConvergenceError):
            solve_contact(
                grid, gap, load=load, start=start, tolerance=1e-11, present=present, max_iterations=_ITERATIONS
            )
        times.append((time.thread_time() - began) / max(grid.convolutions - before, 1))
    return min(times)


# ---------------------------------------------------------------------------------------------------------------- rows


def _costs(case: Case, own: Rows, run: CoarseRun, seconds: float, there: Available) -> dict[str, Any]:
    """Return the costs of a case from a coarse run.

    Parameters
    ----------
    case : Case
        The case.
    own : Rows
        Rows of the case, not computed.
    run : CoarseRun
        Coarse run of this case or of a similar case.
    seconds : float
        Time before the first step of a run, for surface, kernels, domain and material. [s]
    there : Available
        Available memory.
    """
    whole = own.problem.height
    height = solved(own)
    settings = case.settings
    part = height.size / whole.size
    force = run.force
    rows = run.steps
    kind = "curve"
    model = "steady sliding"
    area = nominal_area(whole)
    note = ""
    arrays: Callable[[float], float] = partial(curve_bytes, settings)
    if isinstance(own, LoadingRows):
        scene = own.scene
        program = own.scene.program
        model = own.scene.memory.note
        area = own.area
        kind = "slide" if program.slides else "load"
        force = max(force, program.largest_load)
        note = case.note
        rows = run.kept * run.steps if scene.kept is None else float(len(scene.kept))
        arrays = partial(march_bytes, settings, scene.memory, contact=float(run.contact[-1]), part=part)

    def needed(cells: float) -> float:
        return PROCESS + arrays(cells)

    model = f"{settings.boundary}, {model}"
    if part < 1:
        model += ", solved on {} x {} cells".format(*height.shape)
    seconds += run.seconds * height.size / run.cells
    if own.problem.settings.grid_error:
        seconds *= 1 + _GRID_ERROR
    fraction = float(run.contact[-1]) * part
    warning = ""
    if isinstance(own, LoadingRows) and own.reaches_border:
        warning = (
            "Contact is expected to reach the border of the free-space domain, which ends a run: use boundary = "
            "'periodic' for a nominally flat scan, a larger surface, a smaller load, or edge = 'accept'."
        )
    if fraction > _MOST_CONTACT:
        warning = warning or "More than 90 % of the surface is expected to touch: check the units of modulus and load."
    return {
        "model": model,
        "cells_x": whole.shape[0],
        "cells_y": whole.shape[1],
        "steps": round(run.steps),
        "rows": rows,
        "contact_fraction": fraction,
        "nominal_pressure": force / area,
        "convolutions": round(run.convolutions),
        "wall_time": seconds,
        "memory": needed(whole.size),
        "disk": _VARIABLES[kind] + disk(case, whole.size, rows, run.steps, part * float(run.contact.mean())),
        "note": note.strip(),
        "warning": warning,
        "refusal": too_large((whole.shape[0], whole.shape[1]), needed, there),
    }


def disk(case: Case, cells: int, rows: float, steps: float, contact: float) -> float:
    """Return the size of the values in the file of a case. [byte]

    Parameters
    ----------
    case : Case
        Case, with its fields.
    cells : int
        Number of cells of the surface.
    rows, steps : float
        Numbers of kept times and of accepted steps.
    contact : float
        Mean part of the cells in contact at kept times.
    """
    fields = sum(rows * (contact + 0.01) if name == "pressure" else rows for name in case.settings.fields)
    return 8.0 * cells * (fields + 1.0) + rows * _ROW + steps * 8 * len(STEPPED)


def totals(dataset: xr.Dataset, folder: Path, workers: int | None, there: Available) -> dict[str, Any]:
    """Return totals, free memory and disk, and the reason if the cases do not fit."""
    place = existing_part(folder.absolute())
    free_disk = shutil.disk_usage(place).free
    total = dataset.sizes["case"]
    seconds = np.nan_to_num(dataset["wall_time"].values)
    largest = np.sort(np.nan_to_num(dataset["memory"].values))[::-1]
    processes = processes_that_fit(largest[0], threads_each(1), there.size) if workers is None else max(workers, 1)
    processes = min(processes, total)
    together = float(np.sum(largest[:processes]))
    size = float(np.nansum(dataset["disk"].values))
    refusals = [str(text) for text in dataset["refusal"].values if text]
    several = f"{len(refusals)} of {total} cases: " if total > 1 else ""
    reasons = [several + "; ".join([*dict.fromkeys(refusals)][:3])] if refusals else []
    if together > PART * there.size >= largest[0]:
        needed = f"{processes} processes need {amount(together)} of memory, and {amount(there.size)} are {there.words}"
        reasons.append(f"{needed}: use --workers {processes_that_fit(largest[0], processes, there.size)}")
    if size > PART * free_disk:
        needed = f"the results need {amount(size)} of disk, and {amount(free_disk)} are free in {place}"
        reasons.append(f"{needed}: keep fewer times or fields, or use another folder")
    return {
        "processes": processes,
        "threads": threads_each(processes),
        "wall_time": max(float(np.sum(seconds)) / processes, float(np.max(seconds))),
        "memory": round(together),
        "free_memory": there.size,
        "disk": round(size),
        "free_disk": free_disk,
        "refusal": "; ".join(reasons),
    }
