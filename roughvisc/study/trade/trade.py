"""``trade``: one case under a ladder of settings, each timed and compared with the reference."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import annotate
from roughvisc.mechanics.bodies.transforms import transform_library
from roughvisc.progress import reporting
from roughvisc.study.quantities import QUANTITIES, Observable
from roughvisc.study.statement.case import Case, read_study, vary
from roughvisc.study.trade.bench import NotRun, Report, TimedRuns, further_quantities_of, quantities_of
from roughvisc.study.trade.ladder import Setting, changed_keys, is_data, ladder, shape_of
from roughvisc.study.trade.recommend import known_quantity, require_same, with_floors
from roughvisc.study.trade.reference import ClosedForm, ReferenceRun, all_grids, closed_form
from roughvisc.topography.grid import spacing
from roughvisc.units import Quantity, quantities
from roughvisc.variables import RESULT_FORMAT
from roughvisc.variables.axes import AXES


@quantities(budget="s")
def trade(
    case: Case | str | Path,
    settings: Sequence[Setting] | None = None,
    *,
    quantities: Sequence[str] = (),
    floor: xr.Dataset | Sequence[xr.Dataset] = (),
    budget: Quantity = 300.0,
    reference: Literal["auto", "run"] = "auto",
    progress: bool | Report = True,
) -> xr.Dataset:
    """Compute one case with a series of settings, and measure cost and error of each.

    Parameters
    ----------
    case : Case or path
        A case, or its study file.
    settings : sequence of Setting, optional
        Settings to measure; see :class:`roughvisc.study.trade.ladder.Setting`. Default: tolerances, other grids, fields
        rounded to float32 precision; for a program also the direct history, fixed time steps, and the algorithm of the
        seed paper.
    quantities : sequence of str
        Further numbers whose error is measured: ``force``, ``leak_rate``, ``thermal_conductance`` or
        ``incremental_stiffness``. The table ``observe`` of the study states the fluid, or what is conducted.
    floor : xarray.Dataset, or a sequence of them
        Of :func:`roughvisc.budget` of the same study: errors that no setting lessens are then in the result.
    budget : float or str
        Total wall time of all runs. A setting that would exceed the remaining time is not run, which the result states.
        [s]
    reference : {"auto", "run"}
        "auto": compare with a closed form if there is one. "run": always compare with the finest run.
    progress : bool or callable
        A progress bar, or a function called with the name of a setting, the current time and the length of the program
        [s], or the number of finished speeds and the total number.

    Returns
    -------
    xarray.Dataset
        Along ``setting``: ``run_time``, ``transforms``, ``steps``, ``peak_memory``, ``disk_size``, and ``error`` and
        ``coarsening_error`` of each ``quantity``. Along ``quantity``: the ``reference`` and its own uncertainty,
        ``reference_time_uncertainty`` and ``reference_grid_uncertainty``; of budgets the ``floor``, with
        ``floor_source`` and ``floor_open``. The attribute ``recommendation`` says which setting to use for which
        accuracy. ``rv.plot.trade`` draws the result.

    Raises
    ------
    InputError
        If the study is invalid or contains a sweep, has no such quantity, a budget is of another study, or the
        reference would take longer than half the budget.

    Notes
    -----
    The finest run uses the finest grid of the settings, and a fifth of their smallest tolerance. Its own uncertainty
    follows from runs with that tolerance, on grids two and four times coarser, by Richardson extrapolation with
    Roache's safety factors. Pressures of two grids are compared as means over the coarser cells. In a slide the profile
    moves by whole cells. Kept times within it are those at which it has moved by whole cells of every grid, at least
    the beginning and the end.
    """
    if not isinstance(case, Case):
        case = read_study(case)
    if not budget > 0:
        raise InputError(f"budget is {budget!r}: expected a positive number of seconds")
    if reference not in ("auto", "run"):
        raise InputError(f"reference is {reference!r}: expected 'auto' or 'run'")
    height = case.height()
    shape = (height.sizes["x"], height.sizes["y"])
    rungs = list(ladder(case, shape) if settings is None else settings)
    if not rungs:
        raise InputError("settings is empty: expected at least one Setting")
    usual, further = quantities_of(case), further_quantities_of(case)
    names = [known_quantity(name, (*usual, *further), "quantities") for name in quantities]
    derived = [QUANTITIES[name] for name in names if name in further]
    budgets = [floor] if isinstance(floor, xr.Dataset) else list(floor)
    for one in budgets:
        require_same(one, case)
    case = _comparable(case, height, rungs, derived)
    exact = closed_form(case) if reference == "auto" else None
    with tempfile.TemporaryDirectory() as folder, reporting(progress, at=case.at) as report:
        bench = TimedRuns(case, height, Path(folder), budget, report, derived)
        known = exact.quantities if exact else ()
        finest = None if set(bench.quantities) <= set(known) else ReferenceRun(bench, rungs, is_data(case))
        order = np.argsort([bench.expected(setting) for setting in rungs], kind="stable")  # the cheapest run first
        found = {number: _row(bench, rungs[number], exact, finest) for number in order}
    rows = [found[number] for number in range(len(rungs))]
    return with_floors(_labelled(bench, rows, exact, finest), budgets)


def _comparable(case: Case, height: xr.DataArray, rungs: Sequence[Setting], derived: Sequence[Observable]) -> Case:
    """The case with rows that all settings have in common, and with the pressures that are compared."""
    keep, settings, experiment = case.settings.keep, case.solving(), case.experiment()
    changes: dict[str, Any] = {"solve.grid_error": False}
    fields = [*keep.fields, *(field for one in derived for field in one.fields)]
    if "pressure" in AXES[experiment.axis].variables:
        fields.append("pressure")
    changes["keep.fields"] = [*dict.fromkeys(fields)]
    shape, sides = (height.sizes["x"], height.sizes["y"]), spacing(height)
    shapes = [shape_of(case, shape, grid) for grid in all_grids(rungs, is_data(case))]
    cells = [(sides[0] * shape[0] / nx, sides[1] * shape[1] / ny) for nx, ny in shapes]
    return vary(case, changes | changed_keys(settings, experiment.with_common_rows(settings, cells)))


def _row(bench: TimedRuns, setting: Setting, exact: ClosedForm | None, finest: ReferenceRun | None) -> dict[str, Any]:
    """What a setting cost and how wrong it was, or why that is not known."""
    shape = shape_of(bench.case, bench.shape, setting.coarsening)
    missing = dict.fromkeys(bench.quantities, math.nan)
    row: dict[str, Any] = {
        "setting": bench.label(setting),
        "family": setting.family,
        **{name: math.nan if value is None else value for name, value in vars(setting).items()},
        "cells_x": shape[0],
        "cells_y": shape[1],
        "error": missing,
        "coarsening_error": missing,
        "note": "",
        **dict.fromkeys(("run_time", "transforms", "steps", "peak_memory", "disk_size"), math.nan),
    }
    try:
        if finest and not is_data(bench.case):
            finest.check(setting)
        run = bench.run(setting)
        against_finest = finest.errors(run.dataset) if finest else {}
    except NotRun as error:
        return row | {"note": str(error)}
    if finest:
        alone = finest.of_coarsening(setting.coarsening)
        row["coarsening_error"] = missing | {
            name: alone[name] for name in bench.quantities if not (exact and name in exact.quantities)
        }
    return row | {
        "error": missing | against_finest | (exact.errors(run.dataset) if exact else {}),
        "run_time": run.seconds,
        "transforms": float(run.dataset["convolutions"].sum()),
        "steps": float(run.steps),
        "peak_memory": run.peak_memory,
        "disk_size": run.disk_size,
    }


_TEXTS = ("setting", "family", "method", "memory", "note")
_COORDS = ("setting", "family", "method", "memory", "tolerance", "time_step", "coarsening", "precision")


def _labelled(
    bench: TimedRuns, rows: Sequence[dict[str, Any]], exact: ClosedForm | None, finest: ReferenceRun | None
) -> xr.Dataset:
    case, quantities = bench.case, bench.quantities
    columns: dict[str, Any] = {}
    for name in rows[0]:
        values = [row[name] for row in rows]
        if name in ("error", "coarsening_error"):
            columns[name] = (("setting", "quantity"), np.array([[v[q] for q in quantities] for v in values], float))
        else:
            columns[name] = ("setting", np.array(values, dtype=str if name in _TEXTS else float))
    closed = dict.fromkeys(exact.quantities, exact.name) if exact else {}
    run = finest.name if finest else ""
    columns["reference"] = ("quantity", np.array([closed.get(name, run) for name in quantities], dtype=str))
    for part in ("time", "grid"):
        unsure = [0.0 if name in closed or not finest else getattr(finest, part)[name] for name in quantities]
        columns[f"reference_{part}_uncertainty"] = ("quantity", np.array(unsure))
    coords = {name: columns.pop(name) for name in (*_COORDS, "cells_x", "cells_y")}
    dataset = annotate(xr.Dataset(columns, coords | {"quantity": list(quantities)}))
    dataset.attrs = {
        "Conventions": "CF-1.11",
        "result_format": RESULT_FORMAT,
        "title": case.title,
        "source": f"roughvisc {metadata.version('roughvisc')}",
        "comment": "One case computed under many settings, each timed and compared with 'reference'; attribute 'case' "
        "states it (JSON, SI units).",
        "case": case.to_json(),
        "grid_is_data": int(is_data(case)),
        "rows": AXES[case.experiment().axis].rows,
        "transforms": transform_library(),
    }
    return dataset
