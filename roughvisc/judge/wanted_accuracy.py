"""``choose``: the grid and the tolerance for a wanted error of a number.

The case is solved on finer and finer grids until the total error of grid, steps and other sources is as small as
wanted. The other sources do not depend on the grid. Their errors are estimated once, on the coarsest grid that resolves
the waves of the surface.
"""

from __future__ import annotations

import logging
import math
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.judge import budget as neighbours
from roughvisc.judge.budget import QUANTITIES, quantity_of
from roughvisc.runs.cluster import default_client
from roughvisc.runs.folder import atomic_write, case_path
from roughvisc.runs.netcdf import open_result, write_dataset
from roughvisc.runs.run import is_result_of, result_folder
from roughvisc.runs.sweep import run_one
from roughvisc.study.case import Case, changed
from roughvisc.topography.grid import spacing
from roughvisc.units import number

log = logging.getLogger("roughvisc")
#: First and smallest tolerance over the target; largest and smallest tolerance of all.
_PART = 0.2
_LEAST = 0.006
_LARGEST = 1e-2
_SMALLEST = 1e-8
#: Level of the finest grid: its cells are ``2**-2`` times as long as in the study. Fewest cells a side of any grid.
_FINEST = -2
_FEWEST = 12
#: Accepted ratio of an error to the target, since messages round both.
_ROUNDING = 1.005
#: Source -> what would reduce its error. The later ones depend neither on the grid nor on the tolerance.
_REMEDIES = {
    neighbours.STEPS: "a smaller tolerance",
    neighbours.GRID: "finer cells",
    neighbours.SAMPLE: "a larger scan, or several of them",
    neighbours.OCTAVE: "a scan with finer cells",
    neighbours.MODULUS: "moduli that are known more accurately",
    neighbours.WORK: "a work of adhesion that is known more accurately",
    neighbours.RANGE: "a range of the attraction that is known more accurately",
    neighbours.TIME_SCALE: "times of the material, or its temperature, that are known more accurately",
}


def targets_of(want: Mapping[str, Any]) -> dict[str, float]:
    """Return the wanted relative error of each number.

    Raises
    ------
    InputError
        If a key or a value is invalid.
    """
    if not isinstance(want, Mapping):
        raise InputError(key="want", found=want, expected="a dictionary such as {'contact_area': '1 %'}")
    for name in want:
        one_of("want", name, (*QUANTITIES, *neighbours.KNOWN))
    targets = {
        name: number(part, "1", f"want.{name}", above=0, below=1) for name, part in want.items() if name in QUANTITIES
    }
    if not targets:
        raise InputError(key="want", found=dict(want), expected="a target such as {'contact_area': '1 %'}")
    return targets


def run(
    case: Case,
    out: str | Path | None = None,
    *,
    want: Mapping[str, Any],
    progress: bool = True,
    threads: int | None = None,
) -> xr.Dataset:
    """Choose grid and tolerance for wanted errors and return the result; see :func:`roughvisc.run`."""
    folder = result_folder(case, out)
    computing = {"progress": progress, "client": default_client(), "threads": threads}
    chosen, reasons, budgets = choose(case, want, folder, log.info, **computing)
    for name, one in budgets.items():
        write_dataset(one, folder / neighbours.FOLDER / f"budget-{name}.nc")
    result = open_result(run_one(chosen, folder, threads=threads))
    return result.assign_attrs(choice="\n".join(reasons))


def choose(
    case: Case, want: Mapping[str, Any], folder: Path, tell: Callable[[str], None], **computing: Any
) -> tuple[Case, list[str], dict[str, xr.Dataset]]:
    """Choose grid and tolerance for wanted errors, and write the result of the chosen case.

    Parameters
    ----------
    case : Case
        Case whose grid and tolerance are changed.
    want : mapping
        Number -> wanted relative error at 95 % [-]; also known errors, under the names of the arguments of
        :func:`roughvisc.budget`.
    folder : Path
        Folder of the results. The solves are stored in its folder ``budget``, and are not computed again.
    tell : callable
        Called with the error on each grid, as a sentence.
    **computing
        Arguments of :func:`~roughvisc.judge.budget.solve`.

    Returns
    -------
    case : Case
        The case with the chosen grid and tolerance.
    reasons : list of str
        The choice and its reasons, in sentences.
    budgets : dict
        Name of each quantity -> its budget.

    Raises
    ------
    InputError
        If a target is invalid or cannot be met: the message names the smallest error, its sources, and a remedy for the
        largest source.
    """
    targets = targets_of(want)
    wanted = {name: math.log1p(target) for name, target in targets.items()}
    observed = [quantity_of(case, name) for name in targets]
    height = case.height()
    smallest = min(targets.values())
    base = neighbours.with_kept(case, [field for one in observed for field in one.fields])
    tolerance = min(max(_PART * smallest, _SMALLEST), _LARGEST)
    axis = case.experiment.axis
    places: Any = case.settings.times if isinstance(case.settings.times, tuple) else None
    if places is None and axis == "time":
        places = case.program.corners

    # the coarsest grid resolves the waves of the surface, and leaves some cells to the third grid
    level = math.floor(math.log2(max(min(height.shape) / _FEWEST, 1.0))) - 2
    if neighbours.is_sample(case, height) and (wave := neighbours.shortest_wave(height)):
        level = min(level, math.floor(math.log2(wave / (2 * max(spacing(height))) * (1 + 1e-9))))
    if case.settings.adhesion is not None:  # longer cells may not resolve the range of the attraction
        level = 0
    level = coarsest = max(level, 0)
    while True:
        base = changed(base, {"solve.tolerance": float(f"{tolerance:.2g}")})
        chosen = neighbours.on_cells(base, height, 2.0**level)
        sources = neighbours.sources_of(base, height, want, 2.0**level, 2.0**coarsest)
        [own] = neighbours.solve([chosen], folder / neighbours.FOLDER, **computing).values()
        own = own if places is None else neighbours.at_rows(own, axis, places)
        loaded = own["force"] > 0 if case.settings.adhesion is None else own["contact_area"] > 0
        own = own.isel({axis: np.flatnonzero(loaded)})
        budgets = neighbours.compared(chosen, sources, observed, folder / neighbours.FOLDER, own, **computing)
        cells = "{} x {} cells".format(*neighbours.shape_on(case, height, 2.0**level))
        reached = [
            f"{name} {_percent(error_of(one))}, wanted {_percent(wanted[name])}" for name, one in budgets.items()
        ]
        tell(f"{cells}: {'; '.join(reached)}")
        steps = max(error_of(one, [neighbours.STEPS]) / wanted[name] for name, one in budgets.items())
        if level == coarsest and 0.5 < steps < math.inf and tolerance > _LEAST * smallest:
            tolerance = max(tolerance * _PART / steps, _LEAST * smallest)
            continue  # steps and solver would use more than half of the target
        if all(error_of(one) <= _ROUNDING * wanted[name] for name, one in budgets.items()):
            break
        # neither a finer grid nor a smaller tolerance reduces the errors of other sources
        _refuse_missed(case, targets, budgets, list(_REMEDIES)[0 if level == _FINEST else 2 :], cells)
        level -= 1

    path = case_path(folder, chosen.key, "result")
    if not is_result_of(chosen, path):
        with atomic_write(path) as temporary:
            shutil.copyfile(case_path(folder / neighbours.FOLDER, chosen.key, "result"), temporary)
    reasons = [f"grid: {cells}", *reached, f"tolerance: {chosen.settings.tolerance:.2g}"]
    if unknown := budgets[observed[0].name].attrs["open"]:
        reasons.append(f"open, and not counted: {unknown}")
    return chosen, reasons, budgets


def error_of(budget: xr.Dataset, sources: Sequence[str] | None = None) -> float:
    """Return the largest error of the logarithm of a number by some sources of its budget, all by default. [-]

    The error is infinite without rows, or if a value has no logarithm.
    """
    part = budget if sources is None else budget.isel(source=budget["source"].isin(list(sources)))
    both = np.array([neighbours.together(part, side) for side in (-1, 1)])
    return float(both.max()) if both.size and np.isfinite(both).all() else math.inf


def _refuse_missed(
    case: Case, targets: Mapping[str, float], budgets: Mapping[str, xr.Dataset], sources: Sequence[str], cells: str
) -> None:
    """Refuse the first target below the error by some sources; name the largest one, and what would reduce it."""
    for name, budget in budgets.items():
        wanted = math.log1p(targets[name])
        error = error_of(budget, sources)
        if error <= _ROUNDING * wanted:
            continue
        if math.isinf(error):
            raise InputError(key=name, found="zero, or less, which has no relative error", expected="another number")
        parts = {one: error_of(budget, [one]) for one in sources if one in budget["source"]}
        largest = max(parts, key=parts.__getitem__)
        where = f"{case.origin}: " if case.origin else ""
        raise InputError(
            f"{where}{name}: its error on {cells} is {_percent(error, 3)}: more than the target of {_percent(wanted)}; "
            f"the largest part is {largest}, {_percent(parts[largest])}: {_REMEDIES[largest]} would reduce it",
            key=name,
            found=targets[name],
        )


def _percent(half_width: float, digits: int = 2) -> str:
    """Return a half-width of a logarithm in %."""
    return f"±{100 * math.expm1(half_width):.{digits}g} %"
