"""``roughvisc plan``: the model, the steps, the time and the memory of every case, before anything runs."""

from __future__ import annotations

import json
import math
import shutil
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.profile import Profile, uses_window
from roughvisc.experiment.resources import PART, PROCESS, Available, amount, cores, memory_available, too_large
from roughvisc.experiment.scene import memory_options
from roughvisc.mechanics.hereditary.choice import Choice
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.mechanics.materials.creep import complete
from roughvisc.mechanics.stepping.wave_memory import WaveMemory, choose_body_memory
from roughvisc.notebook import table
from roughvisc.problem import Problem
from roughvisc.settings import Settings
from roughvisc.study.cost.coarse_grids import foretold
from roughvisc.study.cost.estimate import (
    ConvolutionTimer,
    Copies,
    CostEstimate,
    Stage,
    bytes_needed,
    disk,
    over,
    solved_on,
    stages_of,
    wall_time,
    work,
)
from roughvisc.study.cost.full_contact import (
    NEARLY_FULL,
    border_warning,
    full_contact_pressure,
    full_contact_warning,
    largest_pressure,
)
from roughvisc.study.execution.cluster import processes_that_fit, threads_each
from roughvisc.study.execution.run import result_folder
from roughvisc.study.statement.case import Case, read_cases
from roughvisc.study.storage.files import existing_part
from roughvisc.study.storage.parameters import labels_of, parameters_of
from roughvisc.topography.borders import is_mirrored
from roughvisc.topography.grid import nominal_area
from roughvisc.topography.parameters import rms_slope
from roughvisc.units import unit_for

#: variable of a plan -> unit and long name
COLUMNS = {
    "boundary": ("", "boundary"),
    "padded": ("", "whether transforms are padded to twice the grid"),
    "memory_model": ("", "what models the material's memory"),
    "exponentials": ("1", "exponentials of the series"),
    "scheme": ("", "how time is stepped"),
    "cells_x": ("1", "cells along x"),
    "cells_y": ("1", "cells along y"),
    "grows": ("", "whether the grid may grow"),
    "final_cells_x": ("1", "cells along x in the end, where the grid grows; 0: not known"),
    "final_cells_y": ("1", "cells along y in the end, where the grid grows; 0: not known"),
    "speeds": ("1", "speeds of a curve of friction"),
    "steps": ("1", "accepted time steps expected"),
    "rows": ("1", "kept times expected"),
    "contact_fraction": ("1", "largest contact fraction of an elastic press on the pressed cells; if marched"),
    "pressed_cells_x": ("1", "cells along x that were pressed for the contact fraction; 0: none"),
    "pressed_cells_y": ("1", "cells along y that were pressed for the contact fraction; 0: none"),
    "nominal_pressure": ("Pa", "largest nominal pressure, prescribed or of the coarse march: force over nominal area"),
    "full_contact_pressure": ("Pa", "nominal pressure from which on contact takes 95 % of the area (Persson's theory)"),
    "convolutions": ("1", "convolutions expected, one forward and one inverse transform each"),
    "wall_time": ("s", "wall time expected, in one process with one thread"),
    "memory": ("byte", "memory of the process at its peak"),
    "disk": ("byte", "size of the result"),
    "marched": ("", "whether the cost is from a coarse march of this case, not of the one most like it"),
    "program_note": ("", "how a measured history became segments"),
    "late_times": ("", "listed times after the end of the program, which are left out; empty if there are none"),
    "warning": ("", "what is foreseen that may not be meant; empty if nothing"),
    "border_warning": ("", "whether contact is foreseen to reach the border of a free surface, which stops the run"),
    "refusal": ("", "why it cannot run; empty if it can"),
}
#: Cases that a notebook shows.
_SHOWN = 8
#: heading -> variable and its unit
_COLUMNS = {
    "steps": ("steps", ""),
    "convolutions": ("convolutions", ""),
    "wall time": ("wall_time", "s"),
    "memory": ("memory", "byte"),
    "disk": ("disk", "byte"),
}
#: Seconds for coarse marches; the cases that they do not reach take the figures of the one most like them.
_BUDGET = 15.0
#: Cells of the longer side of a grid still to come that a solve is timed on, at most.
_TIMED_SIDE = 1024
#: Columns that count cells.
_COUNTS = [f"{name}cells_{axis}" for name in ("", "final_", "pressed_") for axis in "xy"]


class Plan(xr.Dataset):
    """What :func:`roughvisc.plan` gives."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        known = {"cells_x", "cells_y", "refusal", *(name for name, _ in _COLUMNS.values())}
        if not known <= set(self.data_vars) or self["refusal"].dims != ("case",) or "processes" not in self.attrs:
            return super()._repr_html_()  # a part of a plan, or something made from one
        varied = [str(name) for name in self.coords if name not in ("case", "case_key")]
        whole = [
            f"{self.sizes['case']} cases, {self.attrs['processes']} side by side",
            *(f"{word} {_text(self.attrs[name], unit)}" for word, (name, unit) in list(_COLUMNS.items())[2:]),
        ]
        rows = [("", *varied, "cells", *_COLUMNS, "refused" if self["refusal"].any() else "")]
        for number in range(min(self.sizes["case"], _SHOWN)):
            one = self.isel(case=number)
            mark = "" if bool(one.marched) else "~"  # of the most similar case
            values = (mark + _text(float(one[name]), unit) for name, unit in _COLUMNS.values())
            given = (_varied(one[name]) for name in varied)
            rows.append(
                (str(number), *given, f"{int(one.cells_x)} x {int(one.cells_y)}", *values, str(one.refusal.values))
            )
        if (more := self.sizes["case"] - _SHOWN) > 0:
            rows.append(("...", f"{more} more"))
        return table(f"{self.attrs.get('title') or 'Plan'}: {', '.join(whole)}", rows)


def plan(cases: Sequence[Case] | str | Path, out: str | Path | None = None, *, workers: int | None = None) -> Plan:
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
        One row per case along ``case``, with varied parameters as coordinates; a notebook shows it as a table.
        Attributes: the number of parallel ``processes`` and the ``threads`` of each, the total ``wall_time`` with one
        thread each [s], ``memory`` of all processes [byte], ``disk`` [byte], the free memory and disk, and
        ``refusal``, empty if all cases can run.

    Raises
    ------
    InputError
        If the study file is invalid.

    Notes
    -----
    The numbers of steps and convolutions are extrapolated from runs at the same tolerance on grids of a sixth and a
    third of the points a side, between 17 and 129. Times come from a solve on the real grid that is timed for at
    most two seconds, and from the time of the coarse run. If the grid or its window follows the contact, the coarse
    grids cover the final extent, and each convolution is weighted by its cells. The estimates are accurate to about
    25 %, or 50 % if the pressure of a soft material jumps with each cell that makes contact, or if a grid grows.
    Other experiments run on grids of 24 and 48 cells, a friction curve at some of its speeds; these estimates are
    accurate to a factor of two. The contact fraction is that of an elastic solution on at most 256 cells a side, or
    of the experiment on 48.
    """
    if isinstance(cases, str | Path):
        cases = read_cases(cases)
    if not cases:
        raise InputError("cases is empty: expected at least one case")
    folder = result_folder(cases[0], out)
    stated = [json.loads(case.to_json()) for case in cases]
    parameters = parameters_of(stated)
    marches, surfaces, problems = _marches(cases, stated, parameters)
    stopwatch, choices, there = ConvolutionTimer(), _Choices(), memory_available()
    rows = []
    for number, case in enumerate(cases):
        like = _nearest_case(number, list(marches), parameters)
        surface = surfaces[_surface_name(case, stated[number])]
        ahead = _Ahead(case, surface, marches.get(like), like == number, problems.get(number, ""))
        if isinstance(case.experiment(), Loading):
            rows.append(_row(ahead, choices, stopwatch, there))
        else:
            rows.append(_general_row(ahead, stopwatch, there))
    columns = {name: ("case", np.array([row[name] for row in rows]), attributes(name)) for name in COLUMNS}
    coords: dict[str, Any] = {"case_key": ("case", np.array([case.key for case in cases]))}
    labels = labels_of(parameters, stated[0], ("case",)).values()
    coords |= dict(zip(parameters, labels, strict=True))
    dataset = Plan(columns, coords=coords)
    dataset.attrs = {"title": cases[0].title} | totals(dataset, folder, workers, there)
    return dataset


@dataclass(frozen=True)
class _Surface:
    """A surface's height, its copies and :class:`Stage`s, its rms slope, or why it cannot be had."""

    height: xr.DataArray | None
    grows: bool
    problem: str
    copies: Copies | None = None
    stages: tuple[Stage, ...] = ()
    symmetric: bool = False
    slope: float = 0.0


def _surface_name(case: Case, stated: Mapping[str, Any]) -> str:
    """Surfaces that differ by their seed alone cost the same; under a kernel that bulges they have no windows."""
    surface = {key: value for key, value in stated["surface"].items() if key != "seed"}
    return f"{json.dumps(surface, sort_keys=True)} {case.body().kernel!r} {case.settings.solve.boundary}"


def _marches(
    cases: Sequence[Case], stated: Sequence[Mapping[str, Any]], parameters: Mapping[str, Any]
) -> tuple[dict[int, CostEstimate], dict[str, _Surface], dict[int, str]]:
    """Coarse marches of as many cases as time allows, spread over all; surfaces by name; what is impossible."""
    marches: dict[int, CostEstimate] = {}
    surfaces: dict[str, _Surface] = {}
    problems: dict[int, str] = {}
    until = time.perf_counter() + _BUDGET
    for number in _spread(len(cases)):
        name = _surface_name(cases[number], stated[number])
        if name not in surfaces:
            surfaces[name] = _surface(cases[number])
        height = surfaces[name].height
        if height is None:
            problems[number] = surfaces[name].problem
        elif time.perf_counter() < until or not marches:
            try:
                marches[number] = foretold(cases[number], height, surfaces[name].copies)
            except InputError as error:
                problems[number] = str(error)
    return marches, surfaces, problems


def _spread(count: int) -> list[int]:
    """All numbers below a count: the ends first, then ever finer between them."""
    order = dict.fromkeys([0, count - 1])
    pieces = 2
    while len(order) < count:
        order |= dict.fromkeys(i * (count - 1) // pieces for i in range(1, pieces))
        pieces *= 2
    return list(order)


def _surface(case: Case) -> _Surface:
    try:
        height = case.height()
        boundary = case.settings.solve.boundary
        profile = Profile(height, case.settings.surface.missing, follow=True, kernel=case.body().kernel)
    except InputError as error:
        return _Surface(None, False, str(error))
    return _Surface(
        height,
        profile.can_grow(),
        "",
        Copies(height, boundary),
        stages_of(profile, profile.can_grow()),
        is_mirrored(height.values),
        rms_slope(height),
    )


def _nearest_case(number: int, others: Sequence[int], parameters: Mapping[str, Any]) -> int:
    """The one of some cases with most parameters in common, the nearest of those."""
    if number in others or not others:
        return number

    def distance(other: int) -> tuple[int, int]:
        return sum(values[other] != values[number] for values in parameters.values()), abs(other - number)

    return min(others, key=distance)


class _Choices:
    """Memories of distinct materials: fitting a series takes a while."""

    def __init__(self) -> None:
        self._found: dict[str, Choice] = {}

    def of(self, case: Case, grows: bool) -> Choice:
        wanted = memory_options(case.program(), case.solving(), "pressure" if grows else "displacement")
        name = f"{case.settings.material!r} {wanted!r}"
        if name not in self._found:
            self._found[name] = choose_body_memory(case.body(), **wanted)
        return self._found[name]


@dataclass(frozen=True)
class _Ahead:
    """A case, its surface, and what it is expected to take.

    Attributes
    ----------
    case : Case
    surface : _Surface
    found : CostEstimate or None
        Of the case, or of the one most like it.
    marched : bool
        Whether it is of the case itself.
    problem : str
        Why the case is impossible; empty if it is not.
    """

    case: Case
    surface: _Surface
    found: CostEstimate | None
    marched: bool
    problem: str

    def row(self) -> dict[str, Any]:
        """A row of the plan of which nothing is known yet but the case and its grid."""
        boundary, height = self.case.solving().boundary, self.surface.height
        row: dict[str, Any] = {name: "" if not unit else np.nan for name, (unit, _) in COLUMNS.items()}
        row |= {"boundary": boundary, "padded": boundary == "free", "grows": False, "marched": self.marched}
        row |= {
            "late_times": _late_times(self.case),
            "refusal": self.problem,
            "exponentials": 0,
            **dict.fromkeys(_COUNTS, 0),
        }
        if height is not None:
            row |= {"cells_x": height.sizes["x"], "cells_y": height.sizes["y"]}
        return row

    def expected(self, shape: tuple[int, ...], needed: Callable[[float], float], there: Available) -> dict[str, Any]:
        """What the estimate says of any experiment, on the cells that it has in the end."""
        assert self.found is not None
        memory = needed(math.prod(shape))
        return {
            "refusal": "" if there.fits(memory) else too_large((shape[0], shape[1]), needed, there),
            "rows": self.found.rows,
            "convolutions": self.found.convolutions,
            "memory": memory,
        } | (self._of_march(self.found) if self.marched else {})

    def _of_march(self, found: CostEstimate) -> dict[str, Any]:
        """Of a case that was marched itself: how much comes into contact."""
        if found.pressed is None:
            return {}
        x, y = found.pressed.shape
        return {"contact_fraction": found.pressed.fraction, "pressed_cells_x": x, "pressed_cells_y": y}


def _late_times(case: Case) -> str:
    """Listed times after the end of the program, in words."""
    late = case.settings.late_times()
    if not late:
        return ""
    unit, end = unit_for(late, "s"), case.program().duration
    texts = ", ".join(unit.text(time) for time in late)
    return f"{texts} left out: the program ends at {unit_for([end], 's').text(end)}"


def _row(ahead: _Ahead, choices: _Choices, stopwatch: ConvolutionTimer, there: Available) -> dict[str, Any]:
    """What a program costs, by its memory, and the windows and grids that it comes through."""
    case, surface, found = ahead.case, ahead.surface, ahead.found
    settings, program, body, row = case.solving(), case.program(), case.body(), ahead.row()
    if surface.height is None:
        return row
    height, grows = surface.height, surface.grows and uses_window(settings) and body.separates
    whole = next(i for i, stage in enumerate(surface.stages) if stage.outside == math.inf)
    window = whole > 0 and uses_window(settings)
    row["grows"] = grows
    try:
        Problem(height, body, settings).check_cells()
        choice = choices.of(case, grows or window)
    except InputError as error:
        return row | {"refusal": str(error)}
    largest = largest_pressure(height, program, found.force if found and ahead.marched else np.nan)
    full = full_contact_pressure(surface.slope, choice.material, program.duration)
    row |= {
        "memory_model": choice.note,
        "exponentials": len(choice.memory.material.times) if isinstance(choice.memory, Modes | WaveMemory) else 0,
        "nominal_pressure": largest,
        "full_contact_pressure": full,
        "warning": full_contact_warning(largest, full),
        "program_note": program.note,
    }
    if found is None or ahead.problem:
        return row
    stages = surface.stages[0 if window else whole : None if grows else whole + 1]
    solved = solved_on(stages, found)
    again = 1 + solved.growths / max(found.steps, 1.0)  # a step in which it grows is tried again
    found = replace(found, convolutions=found.convolutions * again)
    shape, cells = solved.stages[-1].shape, solved.cells
    timed = height if shape == height.shape else over(height, shape, _TIMED_SIDE)
    convolution = stopwatch.seconds(timed, settings.boundary, body.kernel) * work(cells) / work(timed.size)
    needed = partial(bytes_needed, settings, found=found, choice=choice, part=solved.part, grows=solved.growths > 0)
    beside = stopwatch.beside(found.coarse_run, settings.boundary, body.kernel)
    row |= replace(ahead, found=found).expected(shape, needed, there)
    if found.fraction < NEARLY_FULL:
        row["warning"] = ""
    return row | {
        "border_warning": border_warning(shape) if found.at_border and settings.edge == "error" else "",
        "final_cells_x": shape[0],
        "final_cells_y": shape[1],
        "scheme": _scheme(settings, choice, found),
        "steps": found.steps,
        "wall_time": wall_time(settings, solved, found, choice, convolution, beside),
        "disk": disk(case, cells, found, surface.symmetric or surface.grows),  # an indenter is symmetric
    }


def _general_row(ahead: _Ahead, stopwatch: ConvolutionTimer, there: Available) -> dict[str, Any]:
    """What an experiment of any other kind costs."""
    case, surface, found = ahead.case, ahead.surface, ahead.found
    settings, experiment, body, height = case.solving(), case.experiment(), case.body(), surface.height
    row = ahead.row() | {"memory_model": experiment.called}
    if height is None or found is None or ahead.problem:
        return row
    area = nominal_area(height)
    convolution = stopwatch.seconds(height, settings.boundary, body.kernel)
    nominal = found.force / area
    size = max(float(np.ptp(height[axis].values)) for axis in ("x", "y"))
    relaxed = full_contact_pressure(surface.slope, complete(body.material), experiment.creep_time(size))

    def needed(cells: float) -> float:
        return PROCESS + experiment.bytes_needed(settings, body, cells, area)

    row |= ahead.expected(height.shape, needed, there)
    return row | {
        **({"speeds": found.rows} if experiment.axis == "speed" else {}),
        "nominal_pressure": nominal,
        "full_contact_pressure": relaxed,
        "warning": full_contact_warning(nominal, relaxed),
        "wall_time": found.convolutions * convolution * experiment.convolution_cost
        + found.rows * stopwatch.beside(found.coarse_run, settings.boundary, body.kernel),
        "disk": disk(case, height.size, found),
    }


def _scheme(settings: Settings, choice: Choice, found: CostEstimate) -> str:
    steps = "chosen by the tolerance" if settings.time_step == "auto" else f"of {settings.time_step:g} s"
    if choice.note.startswith("no memory"):
        return f"no memory: each step by itself, steps {steps}"
    damped = f", the two-step rule (BDF2) in {100 * found.damped:.0f} % of the steps" if found.damped else ""
    slid = f", {found.slid:.0f} of one cell in slides" if found.slid else ""
    return f"piecewise-linear pressure{damped}, steps {steps}{slid}"


def totals(dataset: xr.Dataset, folder: Path, workers: int | None, there: Available) -> dict[str, Any]:
    """Totals, what is free, and why it cannot fit."""
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
    """Attributes of a variable of a plan."""
    units, long_name = COLUMNS[name]
    return {"long_name": long_name} | ({"units": units} if units else {})


def _varied(value: xr.DataArray) -> str:
    number = value.values[()]
    if not isinstance(number, np.number):
        return str(number)
    unit = str(value.attrs.get("units", ""))
    return unit_for([number], unit).text(float(number), 6) if unit else f"{number:.6g}"


def _text(value: float, unit: str) -> str:
    if not np.isfinite(value):
        return "not known"
    if unit == "byte":
        return unit_for([value], "B").text(value)
    return unit_for([value], unit).text(value) if unit else f"{value:.0f}"
