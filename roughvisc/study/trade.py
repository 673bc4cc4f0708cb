"""``trade``: one case under several tolerances and grids, each timed and compared with the finest run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError, RoughviscError
from roughvisc.experiment.coarser import pressure_distance
from roughvisc.experiment.grid_error import TWO_GRIDS, grid_uncertainty
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.rows import kept_times
from roughvisc.labels import cost_of, unconverged
from roughvisc.study.case import Case, read_study, vary
from roughvisc.study.execution.display import Display
from roughvisc.study.execution.run import result_folder
from roughvisc.study.neighbours import is_data, on_cells, shape_on, solve, with_kept
from roughvisc.study.quantities import QUANTITIES, quantities_of, quantity_of
from roughvisc.topography.grid import spacing
from roughvisc.units import Quantity, number, quantities
from roughvisc.variables import AXES

#: Variable of a trade -> unit and long name.
COLUMNS = {
    "tolerance": ("1", "tolerance"),
    "coarsening": ("1", "length of a cell over its length in the study"),
    "cells_x": ("1", "cells along x"),
    "cells_y": ("1", "cells along y"),
    "run_time": ("s", "wall time of computing the result"),
    "transforms": ("1", "convolutions, each one forward and one inverse transform"),
    "note": ("", "why the setting was not measured; empty if it was"),
    "error": ("1", "largest error against the reference over all rows, over the largest value"),
    "reference_time_uncertainty": ("1", "uncertainty of the reference due to time steps"),
    "reference_grid_uncertainty": ("1", "uncertainty of the reference due to the grid"),
}
#: Folder of the solves and of the table, in the folder of the results.
FOLDER = "trade"
#: Quantities that are compared by default, the most important first.
_USUAL = ("friction_coefficient", "contact_area", "pressure", "approach", "mean_gap")
#: Default tolerances on the grid of the study; default ``(coarsening, tolerance)`` on coarser and finer grids.
_TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3)
_COARSER, _FINER = ((4.0, 1e-2), (2.0, 1e-2), (2.0, 1e-3)), ((0.5, 1e-3), (0.25, 1e-3))
#: Fewest cells a side of a coarser grid, and most of a finer one.
_FEWEST, _MOST = 12, 1024
#: Smallest tolerance of the settings over the tolerance of the reference.
_SHARPER = 5.0
#: Number of kept times if the study keeps all accepted steps, which differ between settings.
_FEW = 9
#: Wall times within this factor are taken as equal.
_EQUAL = 1.1


@quantities(budget="s")
def trade(
    case: Case | str | Path,
    settings: Sequence[tuple[float, float]] | None = None,
    *,
    quantity: str | Sequence[str] = (),
    budget: Quantity = 300.0,
    out: str | Path | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Compute one case with several tolerances and grids, and measure cost and error of each.

    Parameters
    ----------
    case : Case or path
        A case, or its study file.
    settings : sequence of (float, float), optional
        Tolerances to measure, each with the length of the cells over the length in the study. Default: tolerances
        from 1e-1 to 1e-3, and coarser grids; also finer grids if the surface is a recipe without conditioning. [-]
    quantity : str or sequence of str
        Numbers whose errors are listed first. ``force``, ``leak_rate``, ``thermal_conductance`` and
        ``incremental_stiffness`` are compared only if named here. The table ``observe`` of the study states the fluid
        or the conductivities.
    budget : float or str
        Total wall time of all solves. A setting that would exceed the budget is not measured, and the result states
        this. [s]
    out : path, optional
        Folder of the solves. They are kept with their times and not computed again. Default: ``trade`` in the folder of
        the results.
    progress : bool
        Show a progress bar.

    Returns
    -------
    xarray.Dataset
        Along ``setting``: ``run_time``, ``transforms``, ``steps``, and the ``error`` of each ``quantity``. Along
        ``quantity``: the uncertainty of the reference, ``reference_time_uncertainty`` and
        ``reference_grid_uncertainty``. The attribute ``reference`` names the reference. ``rv.plot.trade`` draws the
        result.

    Raises
    ------
    InputError
        If the study is invalid or contains a sweep, has no such quantity, or the time is too short for the reference.

    Notes
    -----
    Settings are solved in this process one after the other, from the cheapest to the most expensive. The reference is
    the finest run. Its grid is the finest grid of the settings that the time allows. Its tolerance is a fifth of their
    smallest tolerance, or the smallest that the time allows. The uncertainty of the reference follows from the run with
    the next larger tolerance, and from grids two and four times coarser, by Richardson extrapolation with Roache's
    safety factors. Pressures on two grids are compared as means over the coarser cells. In a slide the profile moves by
    whole cells. Times in a slide are kept if the profile has moved by whole cells of every grid, which includes the
    beginning and the end.
    """
    if not isinstance(case, Case):
        case = read_study(case)
    if not budget > 0:
        raise InputError(key="budget", found=budget, expected="a positive number of seconds")
    requested = [quantity] if isinstance(quantity, str) else list(quantity)
    observed = [quantity_of(case, name) for name in requested if name != "pressure"]
    known = {"pressure", *quantities_of(case)}
    names = [name for name in dict.fromkeys([*requested, *_USUAL]) if name in known]
    height = case.height()
    data, shape = is_data(case), (height.sizes["x"], height.sizes["y"])
    rungs = _ladder(data, shape) if settings is None else [(float(one), float(grid)) for one, grid in settings]
    if not rungs:
        raise InputError(key="settings", found=rungs, expected="at least one tolerance and grid")
    for tolerance, grid in rungs:
        number(tolerance, "1", "settings", above=0, below=1)
        number(grid, "1", "settings", above=0)
        if data and grid < 1:
            expected = "cells at least as long as those of the scan"
            raise InputError(key="settings", found=(tolerance, grid), expected=expected)
    sharpest, grids = min(one for one, _ in rungs), sorted({grid for _, grid in rungs})
    finest = [1.0] if data else [grid for grid in grids if grid <= 1] or grids[:1]
    wanted = {(sharpest / _SHARPER, part * grid) for grid in finest for part in (1.0, 2.0, 4.0)}
    wanted |= {*rungs, *((sharpest, grid) for grid in finest)}
    times, experiment = case.settings.times or _FEW, case.experiment
    if isinstance(experiment, Loading):
        shapes = [shape_on(case, height, grid) for _, grid in wanted]
        sides = np.array(spacing(height)) * height.shape / np.array(shapes)
        times = kept_times(experiment.program, times, *map(tuple, sides))
    fields = ["pressure", *(field for one in observed for field in one.fields)]
    base = with_kept(case, fields, times)
    folder = Path(out).expanduser() if out is not None else result_folder(case) / FOLDER
    solved = partial(solve, folder=folder, watch=partial(Display, progress, summary=False))

    # relative work: the number of steps grows with the inverse root of the tolerance, iterations hardly change
    power, spent, rate = (0.5 if experiment.axis == "time" else 0.1), 0.0, 0.0
    work = {(tolerance, grid): tolerance**-power / grid**2 for tolerance, grid in wanted}
    results: dict[tuple[float, float], xr.Dataset] = {}
    notes: dict[tuple[float, float], str] = {}
    for setting in sorted(wanted, key=work.__getitem__):
        if (expected := work[setting] * rate) > budget - spent:
            left = max(budget - spent, 0.0)
            notes[setting] = f"would take about {expected:.2g} s, {left:.0f} s are left of the budget"
            continue
        try:
            [result] = solved([on_cells(vary(base, {"solve.tolerance": setting[0]}), height, setting[1])]).values()
        except RoughviscError as error:
            notes[setting] = str(error).removeprefix(f"{case.origin}: ")
            continue
        if complaint := unconverged(result):
            notes[setting] = complaint
            continue
        seconds = cost_of(result)[0]
        spent, rate = spent + seconds, seconds / work[setting]
        derived = {name: (experiment.axis, QUANTITIES[name].of(result, base)) for name in names if name != "pressure"}
        results[setting] = result.assign(derived)
    reference = min((one for one in results if one[1] in finest), default=None)
    if reference is None:
        where = f"{case.origin}: " if case.origin else ""
        why = notes[sharpest / _SHARPER, finest[-1]]
        raise InputError(f"{where}the reference run: {why}: expected a larger budget, or fewer cells")
    return _compared(base, height, rungs, names, results, notes, reference)


def _ladder(data: bool, shape: tuple[int, int]) -> list[tuple[float, float]]:
    """Return the default settings, as tolerance and coarsening."""
    rungs = [(tolerance, 1.0) for tolerance in _TOLERANCES]
    rungs += [(tolerance, grid) for grid, tolerance in _COARSER if min(shape) / grid >= _FEWEST]
    return rungs if data else rungs + [(one, grid) for grid, one in _FINER if max(shape) / grid <= _MOST]


def _compared(
    case: Case,
    height: xr.DataArray,
    rungs: Sequence[tuple[float, float]],
    names: Sequence[str],
    results: dict[tuple[float, float], xr.Dataset],
    notes: dict[tuple[float, float], str],
    reference: tuple[float, float],
) -> xr.Dataset:
    """Return the cost and the errors of the settings that were solved."""
    sharp, finest = reference

    def apart(one: tuple[float, float], other: tuple[float, float] = reference) -> NDArray[np.float64]:
        both = {one, other} <= results.keys()
        return _differences(results[one], results[other], names) if both else np.full(len(names), math.nan)

    rows = []
    for setting in rungs:
        shape, note, error = shape_on(case, height, setting[1]), notes.get(setting, ""), apart(setting)
        if setting[1] < finest:
            note, error = note or "finer than the reference, for which there is no time", np.full_like(error, math.nan)
        found = None if note else results[setting]
        spent, transforms = (math.nan, math.nan) if found is None else cost_of(found)
        rows.append((_label(*setting, shape), *setting, *shape, spent, transforms, note, error))
    columns = dict(zip(("setting", *COLUMNS), zip(*rows, strict=True), strict=False))
    errors = ("setting", "quantity"), np.array(columns.pop("error"))
    table = xr.Dataset({name: ("setting", list(column)) for name, column in columns.items()} | {"error": errors})
    # the error decreases unevenly with the tolerance, which requires the larger safety factor
    looser = min((one for one in results if one[0] > sharp and one[1] == finest), default=(math.inf, finest))
    table["reference_time_uncertainty"] = ("quantity", TWO_GRIDS * apart(looser) / (looser[0] / sharp - 1))
    second, third = (sharp, 2 * finest), (sharp, 4 * finest)
    shapes = [shape_on(case, height, grid) for grid in (finest, 2 * finest)]
    ratio, moving = math.sqrt(math.prod(shapes[0]) / math.prod(shapes[1])), "friction_coefficient" in names
    by_grid = [
        float(grid_uncertainty(name, near, far, ratio, moving=moving))
        for name, near, far in zip(names, apart(second), apart(third, second), strict=True)
    ]
    table["reference_grid_uncertainty"] = ("quantity", by_grid)
    for name, (units, long_name) in COLUMNS.items():
        table[name].attrs = {"long_name": long_name} | ({"units": units} if units else {})
    table = table.assign_coords(quantity=names).set_coords(["setting", "tolerance", "coarsening", "cells_x", "cells_y"])
    return table.assign_attrs(
        title=case.title,
        case=case.to_json(),
        reference=f"finest run: {_label(*reference, shapes[0])}",
        grid_is_data=int(is_data(case)),
        rows=AXES[case.experiment.axis].rows,
    )


def _differences(found: xr.Dataset, wanted: xr.Dataset, names: Sequence[str]) -> NDArray[np.float64]:
    """Return the largest difference of each quantity over all rows, over the largest value of the second result.

    The difference of pressures is the integral of the absolute difference (L1), over the largest force. A quantity that
    is missing in both results, such as the friction before loading, counts as equal.
    """
    errors = []
    for name in names:
        if name == "pressure":
            error, largest = pressure_distance(found, wanted), float(wanted["force"].max())
        else:
            one, other = found[name].values, wanted[name].values
            error = np.abs(np.where(np.isnan(one) & np.isnan(other), 0.0, one - other))
            largest = float(np.fmax.reduce(np.abs(other), initial=0.0))
        errors.append(float(error.max()) / largest if largest else math.nan)
    return np.array(errors)


def format_tolerance(value: float) -> str:
    """Return a tolerance in the notation of study files.

    Examples
    --------
    >>> [format_tolerance(one) for one in (0.03, 1e-3, 0.25)]
    ['3e-2', '1e-3', '2.5e-1']
    """
    digits, power = f"{value:.1e}".split("e")
    return f"{digits.removesuffix('.0')}e{int(power)}"


def _label(tolerance: float, coarsening: float, shape: tuple[int, int]) -> str:
    grid = "" if coarsening == 1 else f", {shape[0]} x {shape[1]} cells"
    return f"tolerance = {format_tolerance(tolerance)}{grid}"


# ----------------------------------------------------------------------------------------------------------------
# choice


def pareto_front(dataset: xr.Dataset, quantity: str) -> NDArray[np.bool_]:
    """Return the mask of Pareto-optimal settings: every faster setting is less accurate.

    Errors count to two digits.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`trade`.
    quantity : str
        Quantity whose error counts.
    """
    spent, wrong = dataset["run_time"].values, dataset["error"].sel(quantity=quantity).values
    known = np.isfinite(spent) & np.isfinite(wrong)
    wrong = np.array([float(f"{value:.1e}") for value in wrong])
    best = np.zeros(len(spent), dtype=bool)
    for i in np.flatnonzero(known):
        no_worse = known & (spent <= spent[i]) & (wrong <= wrong[i])
        better = no_worse & ((spent < spent[i]) | (wrong < wrong[i]))
        best[i] = not better.any()
    return best


def uncertainty(dataset: xr.Dataset, quantity: str) -> float:
    """Return the uncertainty of the reference; for a scan without the uncertainty of the grid. [-]"""
    parts = ("time",) if dataset.attrs.get("grid_is_data") else ("time", "grid")
    return float(sum(dataset[f"reference_{part}_uncertainty"].sel(quantity=quantity) for part in parts))


def cheapest(dataset: xr.Dataset, quantity: str, target: float) -> int | None:
    """Return the index of the fastest setting whose error is at most ``target``; None if there is none.

    The error of a setting is its largest error at this and all smaller tolerances on its grid, so that a chance
    agreement does not count, plus the uncertainty of the reference. For a scan only settings on its own grid are
    chosen, because another grid means another surface. Among settings of nearly equal times the first is chosen.
    """
    error, spent = dataset["error"].sel(quantity=quantity).values, dataset["run_time"].values
    tolerance, coarsening = dataset["tolerance"].values, dataset["coarsening"].values
    accurate = np.isfinite(error)
    for i in np.flatnonzero(accurate):
        sharper = (coarsening == coarsening[i]) & (tolerance <= tolerance[i])
        accurate[i] = np.nanmax(error[sharper]) + uncertainty(dataset, quantity) <= target
    if dataset.attrs.get("grid_is_data"):
        accurate &= coarsening == 1
    if not accurate.any():
        return None
    return int(np.flatnonzero(accurate & (spent <= _EQUAL * spent[accurate].min()))[0])
