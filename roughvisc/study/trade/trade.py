"""``trade``: one case under several tolerances and grids, each timed and compared with the finest run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.experiment.kept_times import kept_times
from roughvisc.experiment.loading import Loading
from roughvisc.labels import label
from roughvisc.mechanics.grid import transform_library
from roughvisc.progress import reporting
from roughvisc.study.case import Case, read_study, vary
from roughvisc.study.quantities import QUANTITIES, Observable
from roughvisc.study.trade.bench import NotRun, Report, TimedRuns, further_quantities_of, quantities_of
from roughvisc.study.trade.ladder import Setting, changed_keys, is_data, ladder, shape_of
from roughvisc.study.trade.reference import ReferenceRun, all_grids
from roughvisc.topography.grid import spacing
from roughvisc.units import Quantity, quantities
from roughvisc.variables import AXES, RESULT_FORMAT, Variable

_RUNS = ("setting",)
_OFF = "largest possible error, by Richardson extrapolation"
#: Variables of a trade.
VARIABLES = {
    "setting": Variable(_RUNS, "", "how the case was computed", dtype="str"),
    "quantity": Variable(("quantity",), "", "what is compared", dtype="str"),
    "tolerance": Variable(_RUNS, "1", "tolerance"),
    "coarsening": Variable(_RUNS, "1", "length of a cell over that of the study's"),
    "cells_x": Variable(_RUNS, "1", "cells along x", dtype="int32"),
    "cells_y": Variable(_RUNS, "1", "cells along y", dtype="int32"),
    "run_time": Variable(_RUNS, "s", "run time", "wall time of computing the result"),
    "transforms": Variable(_RUNS, "1", "convolutions, each one forward and one inverse transform"),
    "steps": Variable(_RUNS, "1", "accepted time steps"),
    "note": Variable(_RUNS, "", "why the setting was not measured; empty if it was", dtype="str"),
    "error": Variable(
        ("setting", "quantity"),
        "1",
        "relative error against the reference",
        "the worst over the kept times; pressure: its absolute difference summed (L1) over the largest force; any "
        "other: over its largest value",
    ),
    "coarsening_error": Variable(
        ("setting", "quantity"),
        "1",
        "part of the error that the coarser grid alone makes",
        "of a run as sharp in time as the reference; on a scan it includes what the surface has lost",
    ),
    "reference_time_uncertainty": Variable(("quantity",), "1", "uncertainty of the reference due to time steps", _OFF),
    "reference_grid_uncertainty": Variable(
        ("quantity",), "1", "uncertainty of the reference due to the grid", f"{_OFF}; of a scan: what its spacing hides"
    ),
}

#: Kept times in place of all accepted steps, which differ from setting to setting and from grid to grid.
_FEW = 9


@quantities(budget="s")
def trade(
    case: Case | str | Path,
    settings: Sequence[Setting] | None = None,
    *,
    quantities: Sequence[str] = (),
    budget: Quantity = 300.0,
    progress: bool | Report = True,
) -> xr.Dataset:
    """Compute one case with a series of settings, and measure cost and error of each.

    Parameters
    ----------
    case : Case or path
        A case, or its study file.
    settings : sequence of Setting, optional
        Tolerances and grids to measure; see :class:`roughvisc.study.trade.ladder.Setting`. Default: tolerances from
        1e-1 to 1e-3, and coarser grids; also finer grids if the surface is a recipe without conditioning.
    quantities : sequence of str
        Further numbers whose error is measured: ``force``, ``leak_rate``, ``thermal_conductance`` or
        ``incremental_stiffness``. The table ``observe`` of the study states the fluid, or what is conducted.
    budget : float or str
        Total wall time of all runs. A setting that would exceed the remaining time is not run, which the result states.
        [s]
    progress : bool or callable
        A progress bar, or a function called with the name of a setting, the current time and the length of the program
        [s], or the number of finished speeds and the total number.

    Returns
    -------
    xarray.Dataset
        Along ``setting``: ``run_time``, ``transforms``, ``steps``, and ``error`` and ``coarsening_error`` of each
        ``quantity``. Along ``quantity``: the uncertainty of the reference, ``reference_time_uncertainty`` and
        ``reference_grid_uncertainty``. The attribute ``reference`` names the reference. ``rv.plot.trade`` draws the
        result.

    Raises
    ------
    InputError
        If the study is invalid or contains a sweep, has no such quantity, or the reference would take longer than
        half the budget.

    Notes
    -----
    The reference is the finest run: it uses the finest grid of the settings, and a fifth of their smallest tolerance.
    Its own uncertainty follows from runs with that tolerance, on grids two and four times coarser, by Richardson
    extrapolation with Roache's safety factors. Pressures of two grids are compared as means over the coarser cells. In
    a slide the profile moves by whole cells. Kept times within it are those at which it has moved by whole cells of
    every grid, at least the beginning and the end.
    """
    if not isinstance(case, Case):
        case = read_study(case)
    if not budget > 0:
        raise InputError(key="budget", found=budget, expected="a positive number of seconds")
    height = case.height()
    shape = (height.sizes["x"], height.sizes["y"])
    rungs = list(ladder(case, shape) if settings is None else settings)
    if not rungs:
        raise InputError(key="settings", found=rungs, expected="at least one Setting")
    usual, further = quantities_of(case), further_quantities_of(case)
    for name in quantities:
        if name not in (*usual, *further):
            raise InputError(key="quantities", found=name, expected=f"one of {', '.join((*usual, *further))}")
    derived = [QUANTITIES[name] for name in quantities if name in further]
    case = _comparable(case, height, rungs, derived)
    with reporting(progress, at=case.at) as report:
        bench = TimedRuns(case, height, budget, report, derived)
        order = sorted(range(len(rungs)), key=lambda number: bench.work(rungs[number]))
        bench.calibrate(rungs)
        finest = ReferenceRun(bench, rungs, is_data(case))
        found = {number: _row(bench, rungs[number], finest) for number in order}
    return _labelled(bench, [found[number] for number in range(len(rungs))], finest)


def _comparable(case: Case, height: xr.DataArray, rungs: Sequence[Setting], derived: Sequence[Observable]) -> Case:
    """Return the case with rows that all settings have in common, and with the pressures that are compared."""
    settings, experiment = case.settings, case.experiment()
    changes: dict[str, Any] = {"solve.grid_error": False}
    fields = [*settings.fields, *(field for one in derived for field in one.fields)]
    changes["keep.fields"] = [*dict.fromkeys([*fields, "pressure"])]
    shape, sides = (height.sizes["x"], height.sizes["y"]), spacing(height)
    shapes = [shape_of(case, shape, grid) for grid in all_grids(rungs, is_data(case))]
    cells = [(sides[0] * shape[0] / nx, sides[1] * shape[1] / ny) for nx, ny in shapes]
    if isinstance(experiment, Loading):  # all accepted steps differ from setting to setting
        program, times = experiment.program, settings.times or _FEW
        if program.slides:
            times = kept_times(program, times, *cells) or ()
        changes |= changed_keys(settings, replace(settings, times=times))
    return vary(case, changes)


def _row(bench: TimedRuns, setting: Setting, finest: ReferenceRun) -> dict[str, Any]:
    """Return cost and errors of a setting, or why they are not known."""
    shape = shape_of(bench.case, bench.shape, setting.coarsening)
    missing = dict.fromkeys(bench.quantities, math.nan)
    row: dict[str, Any] = {
        "setting": bench.label(setting),
        "tolerance": setting.tolerance,
        "coarsening": setting.coarsening,
        "cells_x": shape[0],
        "cells_y": shape[1],
        "error": missing,
        "coarsening_error": missing,
        "note": "",
        **dict.fromkeys(("run_time", "transforms", "steps"), math.nan),
    }
    try:
        if not is_data(bench.case):
            finest.check(setting)
        run = bench.run(setting)
        errors = finest.errors(run.dataset)
    except NotRun as error:
        return row | {"note": str(error)}
    return row | {
        "error": errors,
        "coarsening_error": finest.of_coarsening(setting.coarsening),
        "run_time": run.seconds,
        "transforms": float(run.dataset["convolutions"].sum()),
        "steps": float(run.steps),
    }


_TEXTS = ("setting", "note")
_COORDS = ("setting", "tolerance", "coarsening", "cells_x", "cells_y")


def _labelled(bench: TimedRuns, rows: Sequence[dict[str, Any]], finest: ReferenceRun) -> xr.Dataset:
    case, quantities = bench.case, bench.quantities
    columns: dict[str, Any] = {}
    for name in rows[0]:
        values = [row[name] for row in rows]
        if name in ("error", "coarsening_error"):
            columns[name] = (("setting", "quantity"), np.array([[v[q] for q in quantities] for v in values], float))
        else:
            columns[name] = ("setting", np.array(values, dtype=str if name in _TEXTS else float))
    for part in ("time", "grid"):
        unsure = [getattr(finest, part)[name] for name in quantities]
        columns[f"reference_{part}_uncertainty"] = ("quantity", np.array(unsure))
    coords = {name: columns.pop(name) for name in _COORDS}
    dataset = label(xr.Dataset(columns, coords | {"quantity": list(quantities)}), VARIABLES)
    dataset.attrs = {
        "Conventions": "CF-1.11",
        "result_format": RESULT_FORMAT,
        "title": case.title,
        "source": f"roughvisc {metadata.version('roughvisc')}",
        "comment": "One case computed under many settings, each timed and compared with 'reference'; attribute 'case' "
        "states it (JSON, SI units).",
        "case": case.to_json(),
        "reference": finest.name,
        "grid_is_data": int(is_data(case)),
        "rows": AXES[case.experiment().axis].rows,
        "transforms": transform_library(),
    }
    return dataset
