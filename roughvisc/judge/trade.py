"""``trade``: one case under several tolerances and grids, each timed and compared with the finest run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.arguments import listed_names
from roughvisc.errors import InputError
from roughvisc.experiment.grid_error import TWO_GRIDS, grid_uncertainty, pressure_distance, pressure_size
from roughvisc.experiment.kept_times import kept_times
from roughvisc.experiment.loading import Loading
from roughvisc.judge.budget import (
    QUANTITIES,
    is_data,
    on_cells,
    quantities_of,
    quantity_of,
    shape_on,
    solve,
    with_kept,
)
from roughvisc.labels import cost_of
from roughvisc.paths import path_of
from roughvisc.runs.run import result_folder
from roughvisc.study.case import Case, case_given, changed
from roughvisc.topography.grid import spacing
from roughvisc.units import number
from roughvisc.variables import AXES

#: Folder of the solves and of the table, in the folder of the results.
FOLDER = "trade"
#: Quantities that are compared by default, the most important first.
_USUAL = ("friction_coefficient", "contact_area", "pressure", "approach", "mean_gap")
#: Default tolerances on the grid of the study; default ``(coarsening, tolerance)`` on coarser and finer grids.
_TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3)
_COARSER = ((4.0, 1e-2), (2.0, 1e-2), (2.0, 1e-3))
_FINER = ((0.5, 1e-3),)
#: Fewest cells a side of a coarser grid, and most of a finer one.
_FEWEST = 12
_MOST = 1024
#: Smallest tolerance of the settings over the tolerance of the reference.
_SHARPER = 5.0
#: Number of kept times if the study keeps all accepted steps, which differ between settings.
_FEW = 9


def trade(
    case: Case | str | Path,
    settings: Sequence[tuple[float, float]] | None = None,
    *,
    quantity: str | Sequence[str] = (),
    out: str | Path | None = None,
    progress: bool = True,
    threads: int | None = None,
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
        Numbers whose errors are listed first. ``force``, ``leak_rate`` and ``thermal_conductance`` are compared only if
        named here. The table ``observe`` of the study states the fluid or the conductivities.
    out : path, optional
        Folder of the solves. They are kept with their times and not computed again. Default: ``trade`` in the folder of
        the results.
    progress : bool
        Show a progress bar.
    threads : int, optional
        Number of threads for a large grid; see :func:`roughvisc.simulate`.

    Returns
    -------
    xarray.Dataset
        Along ``setting``: ``tolerance``; ``coarsening``, the length of a cell over its length in the study;
        ``cells_x`` and ``cells_y``; ``run_time`` [s]; ``transforms``, the number of convolutions; and the ``error`` of
        each ``quantity``, the largest over all rows, over the largest value. Along ``quantity``: the uncertainty of the
        reference, ``reference_time_uncertainty`` and ``reference_grid_uncertainty``. The attribute ``reference`` names
        the reference. ``rv.plot.trade`` draws the result.

    Raises
    ------
    InputError
        If the study is invalid or contains a sweep, or has no such quantity.
    RoughviscError
        If a solve fails.

    See Also
    --------
    roughvisc.plan, roughvisc.budget, roughvisc.plot.trade

    Notes
    -----
    Settings are solved in this process one after the other. Together they take about five times as long as the case of
    a scan at the tolerance 1e-3, and twenty times as long as the case of a recipe, with its finer cells. The reference
    is the finest run: on the finest grid of the settings, with a fifth of their smallest tolerance. The uncertainty of
    the reference follows from the run with the smallest tolerance of the settings, and from grids two and four times
    coarser, by Richardson extrapolation with Roache's safety factors. Pressures on two grids are compared as means over
    the coarser cells. In a slide the profile moves by whole cells. Times in a slide are kept if the profile has moved
    by whole cells of every grid, which includes the beginning and the end.

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     measured = rv.trade(case, [(1e-1, 1.0)], out=folder, progress=False).load()
    >>> measured.tolerance.values.tolist()
    [0.1]
    """
    case = case_given(case)
    requested = listed_names(quantity)
    observed = [quantity_of(case, name) for name in requested if name != "pressure"]
    known = {"pressure", *quantities_of(case)}
    names = [name for name in dict.fromkeys([*requested, *_USUAL]) if name in known]
    height = case.height()
    data = is_data(case)
    shape = (height.sizes["x"], height.sizes["y"])
    try:
        rungs = _ladder(data, shape) if settings is None else [(float(one), float(grid)) for one, grid in settings]
    except (TypeError, ValueError) as error:
        raise InputError(key="settings", found=settings, expected="pairs of a tolerance and a grid") from error
    if not rungs:
        raise InputError(key="settings", found=rungs, expected="at least one tolerance and grid")
    for tolerance, grid in rungs:
        number(tolerance, "1", "settings", above=0, below=1)
        number(grid, "1", "settings", above=0)
        if data and grid < 1:
            expected = "cells at least as long as those of the scan"
            raise InputError(key="settings", found=(tolerance, grid), expected=expected)
    sharpest = min(one for one, _ in rungs)
    finest = 1.0 if data else min(grid for _, grid in rungs)
    reference = (sharpest / _SHARPER, finest)
    looser = (sharpest, finest)
    second, third = ((reference[0], part * finest) for part in (2.0, 4.0))
    wanted = dict.fromkeys([*rungs, looser, third, second, reference])
    times: Any = case.settings.times or _FEW
    experiment = case.experiment
    shapes = {one: shape_on(case, height, one[1]) for one in wanted}
    if isinstance(experiment, Loading):
        sides = np.array(spacing(height)) * height.shape / np.array(list(shapes.values()))
        times = kept_times(experiment.program, times, *map(tuple, sides))
    base = with_kept(case, ["pressure", *(field for one in observed for field in one.fields)], times)
    folder = path_of(out, "out").expanduser() if out is not None else result_folder(case) / FOLDER
    cases = {one: on_cells(changed(base, {"solve.tolerance": one[0]}), height, one[1]) for one in wanted}
    solved = solve(cases.values(), folder, progress=progress, threads=threads)
    results = {}
    for setting, one in cases.items():
        derived = {
            name: (experiment.axis, QUANTITIES[name].of(solved[one.key], base)) for name in names if name != "pressure"
        }
        results[setting] = solved[one.key].assign(derived)

    def apart(one: tuple[float, float], other: tuple[float, float] = reference) -> NDArray[np.float64]:
        return _differences(results[one], results[other], names)

    ratio = math.sqrt(math.prod(shapes[reference]) / math.prod(shapes[second]))
    by_grid = [
        float(grid_uncertainty(name, near, far, ratio, moving="friction_coefficient" in names))
        for name, near, far in zip(names, apart(second), apart(third, second), strict=True)
    ]
    run_time, transforms = zip(*(cost_of(results[one]) for one in rungs), strict=True)
    table = xr.Dataset(
        {
            "run_time": ("setting", list(run_time), {"units": "s"}),
            "transforms": ("setting", list(transforms)),
            "error": (("setting", "quantity"), [apart(one) for one in rungs]),
            # the error decreases unevenly with the tolerance, which requires the larger safety factor
            "reference_time_uncertainty": ("quantity", TWO_GRIDS * apart(looser) / (_SHARPER - 1)),
            "reference_grid_uncertainty": ("quantity", by_grid),
        },
        {
            "setting": [_label(*one, shapes[one]) for one in rungs],
            "quantity": names,
            "tolerance": ("setting", [tolerance for tolerance, _ in rungs]),
            "coarsening": ("setting", [grid for _, grid in rungs]),
            "cells_x": ("setting", [shapes[one][0] for one in rungs]),
            "cells_y": ("setting", [shapes[one][1] for one in rungs]),
        },
    )
    return table.assign_attrs(
        title=case.title,
        case=base.to_json(),
        reference=f"finest run: {_label(*reference, shapes[reference])}",
        grid_is_data=int(data),
        rows=AXES[experiment.axis].rows,
    )


def _ladder(data: bool, shape: tuple[int, int]) -> list[tuple[float, float]]:
    """Return the default settings, as tolerance and coarsening."""
    rungs = [(tolerance, 1.0) for tolerance in _TOLERANCES]
    rungs += [(tolerance, grid) for grid, tolerance in _COARSER if min(shape) / grid >= _FEWEST]
    return rungs if data else rungs + [(one, grid) for grid, one in _FINER if max(shape) / grid <= _MOST]


def _differences(result: xr.Dataset, wanted: xr.Dataset, names: Sequence[str]) -> NDArray[np.float64]:
    """Return the largest difference of each quantity over all rows, over the largest value of the second result.

    The difference of pressures is the integral of the absolute difference (L1), over the largest force. A quantity that
    is missing in both results, such as the friction before loading, counts as equal.
    """
    errors = []
    for name in names:
        if name == "pressure":
            error = pressure_distance(result, wanted)
            largest = float(wanted["force"].max())
            if "adhesive_force" in wanted:  # pressure and tension may cancel
                largest = float(pressure_size(wanted).max())
        else:
            one = result[name].values
            other = wanted[name].values
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
    spent = dataset["run_time"].values
    wrong = dataset["error"].sel(quantity=quantity).values
    wrong = np.array([float(f"{value:.1e}") for value in wrong])
    order = np.lexsort((wrong, spent))
    best = np.zeros(wrong.size, dtype=bool)
    faster = np.fmin.accumulate(np.append(np.inf, wrong[order]))[:-1]
    best[order] = wrong[order] < faster
    return best


def uncertainty(dataset: xr.Dataset, quantity: str) -> float:
    """Return the uncertainty of the reference; for a scan without the uncertainty of the grid. [-]"""
    parts = ("time",) if dataset.attrs.get("grid_is_data") else ("time", "grid")
    return float(sum(dataset[f"reference_{part}_uncertainty"].sel(quantity=quantity) for part in parts))


def cheapest(dataset: xr.Dataset, quantity: str, target: float) -> int | None:
    """Return the index of the fastest setting whose error is at most ``target``; None if there is none.

    The error of a setting is its largest error at this and all smaller tolerances on its grid, so that a chance
    agreement does not count, plus the uncertainty of the reference. For a scan only settings on its own grid are
    chosen, because another grid means another surface.
    """
    error = dataset["error"].sel(quantity=quantity).values
    spent = dataset["run_time"].values
    tolerance = dataset["tolerance"].values
    coarsening = dataset["coarsening"].values
    sharper = [(coarsening == grid) & (tolerance <= one) for one, grid in zip(tolerance, coarsening, strict=True)]
    accurate = np.array([error[one].max() for one in sharper]) + uncertainty(dataset, quantity) <= target
    if dataset.attrs.get("grid_is_data"):
        accurate &= coarsening == 1
    return int(np.where(accurate, spent, np.inf).argmin()) if accurate.any() else None
