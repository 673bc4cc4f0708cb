"""``roughvisc plan``: the model, the steps, the time and the memory of every case, before anything runs."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.experiment.coarser import coarser
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.notes import body_note, omitted_effects
from roughvisc.experiment.profile import Profile, uses_window
from roughvisc.experiment.refusal import PART, too_large
from roughvisc.experiment.resources import PROCESS, Available, memory_available
from roughvisc.experiment.scene import memory_options
from roughvisc.mechanics.bodies.operator import Boundary
from roughvisc.mechanics.hereditary.choice import Choice, choose_memory
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.mechanics.materials.protocol import complete
from roughvisc.problem import Problem
from roughvisc.settings import Settings
from roughvisc.study.audit.audit import evaluate
from roughvisc.study.audit.evidence import of_case
from roughvisc.study.audit.given import AuditInputs
from roughvisc.study.audit.texture import Texture, texture_of
from roughvisc.study.cost.coarse_grids import foretold
from roughvisc.study.cost.columns import COLUMNS, attributes
from roughvisc.study.cost.estimate import (
    ConvolutionTimer,
    Copies,
    CostEstimate,
    bytes_needed,
    disk,
    over,
    solved_on,
    wall_time,
    work,
)
from roughvisc.study.cost.foresight import (
    NEARLY_FULL,
    border_warning,
    full_contact_pressure,
    full_contact_warning,
    largest_pressure,
)
from roughvisc.study.cost.planned import Plan
from roughvisc.study.cost.stages import Stage, stages_of
from roughvisc.study.cost.totals import totals
from roughvisc.study.execution.run import result_folder
from roughvisc.study.statement.case import Case, read_cases
from roughvisc.study.storage.parameters import labels_of, parameters_of
from roughvisc.study.storage.upkeep import upgrade_note
from roughvisc.topography.grid import nominal_area, spacing
from roughvisc.topography.parameters import rms_slope

#: Seconds for coarse marches; the cases that they do not reach take the figures of the one most like them.
_BUDGET = 15.0
#: Cells of the longer side of a grid still to come that a solve is timed on, at most.
_TIMED_SIDE = 1024
#: Columns that count cells.
_COUNTS = [f"{name}cells_{axis}" for name in ("", "final_", "pressed_", "coarser_") for axis in "xy"]
#: Fewest cells a side of a surface of which half the resolution is thought of.
_HALVED = 8


@dataclass(frozen=True)
class _Surface:
    """A surface's height, its copies and :class:`Stage`s, its rms slope and its textures, or why it cannot be had."""

    height: xr.DataArray | None
    grows: bool
    problem: str
    copies: Copies | None = None
    stages: tuple[Stage, ...] = ()
    mirrored: bool = False
    slope: float = 0.0
    half_slope: float = math.nan
    textures: dict[str, Texture] = field(default_factory=dict)  # boundary -> what it says of the surface


def plan(cases: Sequence[Case] | str | Path, out: str | Path | None = None, *, workers: int | None = None) -> Plan:
    """What will be modelled in each case, and what it will cost on this machine; nothing is computed or written.

    Parameters
    ----------
    cases : sequence of Case, or path
        Cases, or the study file that states them.
    out : path, optional
        Folder of the results, whose disk must hold them. Default: as in :func:`roughvisc.sweep`.
    workers : int, optional
        Processes side by side. Default: one a core, fewer where the memory does not hold so many.

    Returns
    -------
    xarray.Dataset
        One row a case along ``case``, varied parameters as coordinates; a notebook shows it as a table. Attributes:
        ``processes`` side by side and the ``threads`` that each may use, ``wall_time`` of the whole with one thread
        each [s], ``memory`` of all processes [byte], ``disk`` [byte], what is free of both, ``refusal``, empty if
        all can run, and ``upgrade``, what another version has computed of it in the folder, empty if nothing.

    Raises
    ------
    InputError
        If a study file is wrong.

    Notes
    -----
    The numbers of steps and convolutions are those of marches over grids of 17 and 33 points a side at the same
    tolerance, carried on to the real grid by the growth between the two; seconds come from a solve on the real grid
    that is timed for at most two seconds in all. Where the grid or its window follows the contact, the coarse grids
    cover the one that it comes to, and each convolution counts by the cells that it will be on. Expect a quarter either
    way, and half where a soft material makes the pressure jump with each cell that enters, or where a grid grows.
    Other experiments are done on grids of 24 and 48 cells, a curve of friction at some of its speeds; expect a factor
    of two. The contact fraction is that of an elastic press on 256 cells a side at most, or of the experiment on 48.
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
        surface = surfaces.get(_surface_name(cases[number], stated[number]))
        row = _row if isinstance(case.experiment(), Loading) else _general_row
        rows.append(
            row(case, surface, marches.get(like), like == number, problems.get(number, ""), choices, stopwatch, there)
        )
    columns = {name: ("case", np.array([row[name] for row in rows]), attributes(name)) for name in COLUMNS}
    coords: dict[str, Any] = {"case_key": ("case", np.array([case.key for case in cases]))}
    labels = labels_of(parameters, stated[0], ("case",)).values()
    coords |= dict(zip(parameters, labels, strict=True))
    dataset = Plan(columns, coords=coords)
    dataset.attrs = {"title": cases[0].title, "upgrade": upgrade_note(folder, cases)} | totals(
        dataset, folder, workers, there
    )
    return dataset


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
        profile = Profile(height, case.settings.surface.missing, follow=True, mirror=True, kernel=case.body().kernel)
    except InputError as error:
        return _Surface(None, False, str(error))
    return _Surface(
        height,
        profile.can_grow(),
        "",
        Copies(height, boundary),
        stages_of(profile, profile.can_grow()),
        profile.mirrored,
        rms_slope(height),
        _half_slope(height, boundary),
    )


def _half_slope(height: xr.DataArray, boundary: Boundary = Settings.boundary) -> float:
    """Root mean square slope on cells twice as long; missing where there are too few cells."""
    if min(height.shape) < _HALVED:
        return math.nan
    return rms_slope(coarser(height, 2.0, boundary))


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
            self._found[name] = choose_memory(case.material(), **wanted)
        return self._found[name]


def _row(
    case: Case,
    surface: _Surface | None,
    found: CostEstimate | None,
    marched: bool,
    problem: str,
    choices: _Choices,
    stopwatch: ConvolutionTimer,
    there: Available,
) -> dict[str, Any]:
    settings = case.solving()
    row = _blank(settings, marched, problem)
    if surface is None or surface.height is None:
        return row
    height, grows = surface.height, surface.grows and uses_window(settings)
    whole = next(i for i, stage in enumerate(surface.stages) if stage.outside == math.inf)
    window = whole > 0 and uses_window(settings)
    mirrored = surface.mirrored and settings.method == "fast" and not case.program().slides
    row |= {"grows": grows, "cells_x": height.sizes["x"], "cells_y": height.sizes["y"]}
    try:
        Problem(height, case.body(), settings).check_cells()
        choice = choices.of(case, grows or window)
    except InputError as error:
        return row | {"refusal": str(error)}
    exponentials = len(choice.memory.material.times) if isinstance(choice.memory, Modes) else 0
    omitted = omitted_effects(choice, settings, window, mirrored)
    row |= {"memory_model": choice.note, "exponentials": exponentials, "left_out": omitted}
    row |= _pressures(case, surface, choice, found.force if found and marched else np.nan)
    if found is None or problem:
        return row
    stages = surface.stages[0 if window else whole : None if grows else whole + 1]
    if settings.method != "fast":
        stages = (Stage(stages[0].shape, height.size),)
    solved = solved_on(stages, found)
    found = replace(
        found, convolutions=found.convolutions * (1 + solved.growths / max(found.steps, 1.0))
    )  # tried again
    shape, cells = solved.stages[-1].shape, solved.cells
    timed = height if shape == height.shape else over(height, shape, _TIMED_SIDE)
    convolution = stopwatch.seconds(timed, settings.boundary, case.body().kernel) * work(cells) / work(timed.size)
    sides = tuple(n * side for n, side in zip(height.shape, spacing(height), strict=True))
    final = float(choice.material.contact_compliance(case.program().duration))
    quarter = work(cells / 4) / work(cells)
    needed = partial(bytes_needed, settings, found=found, choice=choice, part=solved.part, grows=solved.growths > 0)
    if needed(cells) > PART * there.size:
        row["refusal"] = too_large(shape, needed, there, [])
    if found.fraction < NEARLY_FULL:
        row["warning"] = ""
    return row | {
        "border_warning": border_warning(shape) if found.at_border and settings.edge == "error" else "",
        "final_cells_x": shape[0],
        "final_cells_y": shape[1],
        "audit": _audit(case, surface, found) if marched else "",
        "body_note": body_note(case.body().kernel, settings, (sides[0], sides[1]), final, found.force, found.level),
        "scheme": _scheme(settings, choice, found),
        "steps": found.steps,
        "rows": found.rows,
        **_contact(found, marched),
        "convolutions": found.convolutions,
        "wall_time": wall_time(settings, solved, found, choice, convolution),
        "memory": needed(cells),
        "half_wall_time": wall_time(settings, solved.on_longer_cells(), found, choice, convolution * quarter),
        "half_memory": needed(cells // 4),
        "rms_slope": surface.slope,
        "half_rms_slope": surface.half_slope,
        "disk": disk(case, cells, found),
    }


def _contact(found: CostEstimate, marched: bool) -> dict[str, Any]:
    """How much comes into contact, on which cells, and on cells twice as long; of a case that was marched itself."""
    finest, halved = found.pressed, found.halved
    if finest is None or not marched:
        return {}
    row = {"contact_fraction": finest.fraction, "pressed_cells_x": finest.shape[0], "pressed_cells_y": finest.shape[1]}
    if halved is None:
        return row
    longer = {"coarser_cells_x": halved.shape[0], "coarser_cells_y": halved.shape[1]}
    return row | longer | {"coarser_contact_fraction": halved.fraction}


def _blank(settings: Settings, marched: bool, problem: str) -> dict[str, Any]:
    """A row of a case of which nothing is known yet."""
    row: dict[str, Any] = {name: "" if not unit else np.nan for name, (unit, _) in COLUMNS.items()}
    free = settings.boundary == "free"
    row |= {"boundary": settings.boundary, "padded": free, "grows": False, "marched": marched, "refusal": problem}
    return row | {"exponentials": 0, **dict.fromkeys(_COUNTS, 0)}


def _general_row(
    case: Case,
    surface: _Surface | None,
    found: CostEstimate | None,
    marched: bool,
    problem: str,
    _: _Choices,
    stopwatch: ConvolutionTimer,
    there: Available,
) -> dict[str, Any]:
    """What an experiment of any kind will cost."""
    settings, experiment, body = case.solving(), case.experiment(), case.body()
    row = _blank(settings, marched, problem) | {"memory_model": experiment.called}
    if surface is None or surface.height is None:
        return row
    height = surface.height
    row |= {"cells_x": height.sizes["x"], "cells_y": height.sizes["y"]}
    if found is None or problem:
        return row
    area, cells = nominal_area(height), height.size
    convolution = stopwatch.seconds(height, settings.boundary, body.kernel)
    nominal = found.force / area
    size = max(float(np.ptp(height[axis].values)) for axis in ("x", "y"))
    relaxed = full_contact_pressure(surface.slope, complete(body.material), experiment.creep_time(size))

    def needed(cells: float) -> float:
        return PROCESS + experiment.bytes_needed(settings, body, cells, area)

    if needed(cells) > PART * there.size:
        row["refusal"] = too_large((height.sizes["x"], height.sizes["y"]), needed, there, [])
    return row | {
        "audit": _audit(case, surface, found) if marched else "",
        "rows": found.rows,
        **({"speeds": found.rows} if experiment.axis == "speed" else {}),
        "nominal_pressure": nominal,
        "full_contact_pressure": relaxed,
        "warning": full_contact_warning(nominal, relaxed),
        **_contact(found, marched),
        "convolutions": found.convolutions,
        "wall_time": found.convolutions * convolution,
        "memory": needed(cells),
        "disk": disk(case, cells, found),
    }


def _pressures(case: Case, surface: _Surface, choice: Choice, force: float) -> dict[str, Any]:
    """Nominal pressure, by the force of a coarse march [N] where the program states none, and that of full contact."""
    assert surface.height is not None
    program = case.program()
    largest = largest_pressure(surface.height, program, force)
    full = full_contact_pressure(surface.slope, choice.material, program.duration)
    return {
        "nominal_pressure": largest,
        "full_contact_pressure": full,
        "warning": full_contact_warning(largest, full),
        "program_note": program.note,
    }


def _audit(case: Case, surface: _Surface, found: CostEstimate) -> str:
    """What an audit says before the run, by the load and the approach of a coarse march."""
    assert surface.height is not None
    height, boundary = surface.height, case.settings.solve.boundary
    if boundary not in surface.textures:
        surface.textures[boundary] = texture_of(height, boundary, str(height.attrs.get("recipe", "")))
    foreseen = {"force": found.force, "approach": found.level, "fraction": found.fraction}
    return evaluate(of_case(case, height, surface.textures[boundary], **foreseen), AuditInputs(), case.title).warning


def _scheme(settings: Settings, choice: Choice, found: CostEstimate) -> str:
    if settings.method == "seed":
        return "the seed paper's: rectangle rule, first order"
    steps = "chosen by the tolerance" if settings.time_step == "auto" else f"of {settings.time_step:g} s"
    if choice.note.startswith("no memory"):
        return f"no memory: each step by itself, steps {steps}"
    damped = f", the two-step rule (BDF2) in {100 * found.damped:.0f} % of the steps" if found.damped else ""
    slid = f", {found.slid:.0f} of one cell in slides" if found.slid else ""
    return f"piecewise-linear pressure{damped}, steps {steps}{slid}"
