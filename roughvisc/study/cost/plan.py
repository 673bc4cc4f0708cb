"""``roughvisc plan``: the model, the steps, the time and the memory of every case, before anything runs."""

from __future__ import annotations

import json
import shutil
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.mechanics.hereditary.choice import Choice, choose_memory
from roughvisc.mechanics.hereditary.exponentials import Modes
from roughvisc.study.cost.estimate import March, Stopwatch, bytes_needed, disk, march_of, solved_on, wall_time, windows
from roughvisc.study.cost.foresight import full_contact_pressure, full_contact_warning, largest_pressure
from roughvisc.study.execution.run import result_folder
from roughvisc.study.simulation.notes import body_note, left_out
from roughvisc.study.simulation.scene import Ground, follows, memory_wanted
from roughvisc.study.statement.case import Case, read_cases
from roughvisc.study.statement.settings import Settings
from roughvisc.study.storage.parameters import parameters_of
from roughvisc.topography.grid import spacing
from roughvisc.topography.parameters import rms_slope

#: Seconds for coarse marches; the cases that they do not reach take the figures of the one most like them.
_BUDGET = 15.0
#: Part of the free memory and of the free disk that a sweep may take.
_PART = 0.9

#: variable of a plan -> unit and long name
_COLUMNS = {
    "boundary": ("", "boundary"),
    "padded": ("", "whether transforms are padded to twice the grid"),
    "memory_model": ("", "what models the material's memory"),
    "exponentials": ("1", "exponentials of the series"),
    "scheme": ("", "how time is stepped"),
    "cells_x": ("1", "cells along x"),
    "cells_y": ("1", "cells along y"),
    "grows": ("", "whether the grid may grow"),
    "left_out": ("", "what costs nothing, and why: it is not modelled, computed or kept"),
    "steps": ("1", "accepted time steps expected"),
    "rows": ("1", "kept times expected"),
    "contact_fraction": (
        "1",
        "largest contact fraction on a coarse grid, which rounds the summits off: rather too much",
    ),
    "nominal_pressure": ("Pa", "largest nominal pressure, prescribed or of the coarse march: force over nominal area"),
    "full_contact_pressure": ("Pa", "nominal pressure from which on contact takes 95 % of the area (Persson's theory)"),
    "convolutions": ("1", "convolutions expected, one forward and one inverse transform each"),
    "wall_time": ("s", "wall time expected, in one process with one thread"),
    "memory": ("byte", "memory of the process at its peak"),
    "disk": ("byte", "size of the result"),
    "marched": ("", "whether the cost is from a coarse march of this case, not of the one most like it"),
    "body_note": ("", "what the base of a sheet does, by the coarse march; empty of a half-space"),
    "program_note": ("", "how a measured history became segments"),
    "warning": ("", "what is foreseen that may not be meant; empty if nothing"),
    "refusal": ("", "why it cannot run; empty if it can"),
}


@dataclass(frozen=True)
class _Surface:
    """A surface's height, its :func:`windows` and its rms slope, or why it cannot be had."""

    height: xr.DataArray | None
    grows: bool
    problem: str
    windows: tuple[tuple[float, float], ...] = ()
    mirrored: bool = False
    slope: float = 0.0


def plan(
    cases: Sequence[Case] | str | Path, out: str | Path | None = None, *, workers: int | None = None
) -> xr.Dataset:
    """What will be modelled in each case, and what it will cost on this machine; nothing is computed or written.

    Parameters
    ----------
    cases : sequence of Case, or path
        Cases, or the study file that states them.
    out : path, optional
        Folder of the results, whose disk must hold them. Default: as in :func:`roughvisc.sweep`.
    workers : int, optional
        Processes side by side. Default: one a core.

    Returns
    -------
    xarray.Dataset
        One row a case along ``case``, varied parameters as coordinates. Attributes: ``processes``, ``wall_time``
        of the whole [s], ``memory`` of all processes [byte], ``disk`` [byte], what is free of both, and
        ``refusal``, empty if all can run.

    Raises
    ------
    InputError
        If a study file is wrong.

    Notes
    -----
    The numbers of steps and convolutions are those of marches over grids of 17 and 33 points a side at the same
    tolerance, carried on to the real grid by the growth between the two; seconds come from a solve on the real grid
    that is timed for at most two seconds in all. Expect a quarter either way, and half where a soft material makes
    the pressure jump with each cell that enters.
    """
    from dask.system import CPU_COUNT

    if isinstance(cases, str | Path):
        cases = read_cases(cases)
    if not cases:
        raise InputError("cases is empty: expected at least one case")
    folder = result_folder(cases[0], out)
    stated = [json.loads(case.to_json()) for case in cases]
    parameters = parameters_of(stated)
    marches, surfaces, problems = _marches(cases, stated, parameters)
    stopwatch, choices = Stopwatch(), _Choices()
    rows = []
    for number, case in enumerate(cases):
        like = _most_like(number, list(marches), parameters)
        surface = surfaces.get(_surface_name(cases[number], stated[number]))
        rows.append(
            _row(case, surface, marches.get(like), like == number, problems.get(number, ""), choices, stopwatch)
        )
    columns = {name: ("case", np.array([row[name] for row in rows]), _attributes(name)) for name in _COLUMNS}
    coords: dict[str, Any] = {"case_key": ("case", np.array([case.key for case in cases]))}
    coords |= {key: ("case", values, {"long_name": key}) for key, values in parameters.items()}
    dataset = xr.Dataset(columns, coords=coords)
    dataset.attrs = {"title": cases[0].title} | _whole(dataset, folder, min(workers or CPU_COUNT, len(cases)))
    return dataset


def _attributes(name: str) -> dict[str, str]:
    units, long_name = _COLUMNS[name]
    return {"long_name": long_name} | ({"units": units} if units else {})


def _surface_name(case: Case, stated: Mapping[str, Any]) -> str:
    """Surfaces that differ by their seed alone cost the same; under a kernel that bulges they have no windows."""
    surface = {key: value for key, value in stated["surface"].items() if key != "seed"}
    return f"{json.dumps(surface, sort_keys=True)} {case.kernel()!r}"


def _marches(
    cases: Sequence[Case], stated: Sequence[Mapping[str, Any]], parameters: Mapping[str, Any]
) -> tuple[dict[int, March], dict[str, _Surface], dict[int, str]]:
    """Coarse marches of as many cases as time allows, spread over all; surfaces by name; what is impossible."""
    marches: dict[int, March] = {}
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
                marches[number] = march_of(cases[number], height)
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
        ground = Ground(height, case.settings.surface.missing, follow=True, mirror=True, kernel=case.kernel())
    except InputError as error:
        return _Surface(None, False, str(error))
    return _Surface(height, ground.can_grow(), "", windows(ground), ground.mirrored, rms_slope(height))


def _most_like(number: int, others: Sequence[int], parameters: Mapping[str, Any]) -> int:
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
        wanted = memory_wanted(case.program(), case.solving(), "pressure" if grows else "displacement")
        name = f"{case.settings.material!r} {wanted!r}"
        if name not in self._found:
            self._found[name] = choose_memory(case.material(), **wanted)
        return self._found[name]


def _row(
    case: Case,
    surface: _Surface | None,
    found: March | None,
    marched: bool,
    problem: str,
    choices: _Choices,
    stopwatch: Stopwatch,
) -> dict[str, Any]:
    settings = case.solving()
    row: dict[str, Any] = {name: "" if not unit else np.nan for name, (unit, _) in _COLUMNS.items()}
    free = settings.boundary == "free"
    row |= {"boundary": settings.boundary, "padded": free, "grows": False, "marched": marched, "refusal": problem}
    row |= {"exponentials": 0, "cells_x": 0, "cells_y": 0}
    if surface is None or surface.height is None:
        return row
    height, grows = surface.height, surface.grows and free and settings.edge == "error"
    window = len(surface.windows) > 1 and follows(settings)
    mirrored = surface.mirrored and settings.method == "fast"
    row |= {"grows": grows, "cells_x": height.sizes["x"], "cells_y": height.sizes["y"]}
    try:
        choice = choices.of(case, grows or window)
    except InputError as error:
        return row | {"refusal": str(error)}
    exponentials = len(choice.memory.material.times) if isinstance(choice.memory, Modes) else 0
    omitted = left_out(choice, settings, window, mirrored)
    row |= {"memory_model": choice.note, "exponentials": exponentials, "left_out": omitted}
    row |= _pressures(case, surface, choice, found.force if found and marched else np.nan)
    if found is None or problem:
        return row
    cells, convolution = height.size, stopwatch.seconds(height, settings.boundary, settings.kernel)
    reachable = surface.windows if window else surface.windows[-1:]
    part = solved_on(reachable, found.level) if settings.method == "fast" else 1.0
    sides = tuple(n * side for n, side in zip(height.shape, spacing(height), strict=True))
    final = float(choice.material.contact_compliance(case.program().duration))
    return row | {
        "body_note": body_note(settings.kernel, settings, (sides[0], sides[1]), final, found.force, found.level),
        "scheme": _scheme(settings, choice, found),
        "steps": found.steps,
        "rows": found.rows,
        "contact_fraction": found.contact,
        "convolutions": found.convolutions,
        "wall_time": wall_time(settings, cells, found, choice, convolution, part),
        "memory": bytes_needed(settings, cells, found, choice, part),
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


def _scheme(settings: Settings, choice: Choice, found: March) -> str:
    if settings.method == "seed":
        return "the seed paper's: rectangle rule, first order"
    steps = "chosen by the tolerance" if settings.time_step == "auto" else f"of {settings.time_step:g} s"
    if choice.note.startswith("no memory"):
        return f"no memory: each step by itself, steps {steps}"
    damped = f", the two-step rule (BDF2) in {100 * found.damped:.0f} % of the steps" if found.damped else ""
    return f"piecewise-linear pressure{damped}, steps {steps}"


# ----------------------------------------------------------------------------------------------------------------
# the whole


def _whole(dataset: xr.Dataset, folder: Path, processes: int) -> dict[str, Any]:
    """Totals, what is free, and why it cannot fit."""
    import psutil

    there = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.exists())
    free_disk, free_memory = shutil.disk_usage(there).free, psutil.virtual_memory().available
    seconds = np.nan_to_num(dataset["wall_time"].values)
    largest = np.sort(np.nan_to_num(dataset["memory"].values))[::-1]
    together = float(np.sum(largest[:processes]))
    size = float(np.nansum(dataset["disk"].values))
    total = dataset.sizes["case"]
    refusals = Counter(str(text) for text in dataset["refusal"].values if text)
    reasons = [f"{count} of {total} cases: {why}" if total > 1 else why for why, count in refusals.most_common(3)]
    if together > _PART * free_memory:
        fitting = int(np.searchsorted(np.cumsum(largest), _PART * free_memory, side="right"))
        advice = f"use --workers {fitting}" if fitting else "use a coarser grid, or keep fewer times or fields"
        needed = f"{processes} processes need {together:.3g} bytes of memory, {free_memory:.3g} are free"
        reasons.append(f"{needed}: {advice}")
    if size > _PART * free_disk:
        reasons.append(
            f"the results need {size:.3g} bytes of disk, {free_disk:.3g} are free in {there}: keep fewer times or "
            "fields, or use another folder"
        )
    return {
        "processes": processes,
        "wall_time": max(float(np.sum(seconds)) / processes, float(np.max(seconds, initial=0.0))),
        "memory": together,
        "free_memory": free_memory,
        "disk": size,
        "free_disk": free_disk,
        "refusal": "; ".join(reasons),
    }
