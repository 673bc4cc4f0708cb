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
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from roughvisc.arguments import nearest
from roughvisc.errors import InputError
from roughvisc.settings import Settings
from roughvisc.study.budget import FOLDER
from roughvisc.study.case import Case, vary
from roughvisc.study.execution.cluster import default_client
from roughvisc.study.execution.display import Display
from roughvisc.study.execution.run import is_result_of, result_folder, run_stated
from roughvisc.study.neighbours import (
    GRID,
    GRID_FACTOR,
    KNOWN,
    MODULUS,
    OCTAVE,
    ORDER,
    SAMPLE,
    STEPS,
    TIME_SCALE,
    compared,
    is_sample,
    on_cells,
    shape_on,
    shortest_wave,
    solve,
    together,
    with_rows,
)
from roughvisc.study.quantities import QUANTITIES, quantity_of
from roughvisc.study.storage.folder import atomic_write, require_writable, result_path
from roughvisc.study.storage.netcdf import write_dataset
from roughvisc.topography.grid import spacing
from roughvisc.units import is_quantity, number

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger("roughvisc")
#: First and smallest tolerance over the target; largest and smallest tolerance of all.
_PART, _LEAST, _LARGEST, _SMALLEST = 0.2, 0.006, 1e-2, 1e-8
#: Level of the finest grid: its cells are ``2**-2`` times as long as in the study. Fewest cells a side of any grid.
_FINEST, _FEWEST = -2, 12
#: Accepted ratio of an error to the target, since messages round both.
_ROUNDING = 1.005
#: Length of cells by level, in words.
_LENGTHS = {1: "twice as long as", 0: "as long as", -1: "half as long as", -2: "a quarter as long as"}
#: Remedy for the error of each source.
_REMEDIES = {
    STEPS: "a smaller tolerance",
    GRID: "finer cells",
    SAMPLE: "a larger scan, or several of them",
    OCTAVE: "a scan with finer cells",
    MODULUS: "moduli that are known more accurately",
    TIME_SCALE: "times of the material, or its temperature, that are known more accurately",
}
#: Sources that neither a finer grid nor a smaller tolerance reduces.
_FLOOR = (SAMPLE, OCTAVE, MODULUS, TIME_SCALE)


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
        if name not in (*QUANTITIES, *KNOWN):
            raise InputError(key="want", found=name, expected=f"one of {', '.join((*QUANTITIES, *KNOWN))}")
    targets = {
        name: number(part, "1", f"want.{name}", above=0, below=1) for name, part in want.items() if name in QUANTITIES
    }
    if not targets:
        raise InputError(key="want", found=dict(want), expected="a target such as {'contact_area': '1 %'}")
    return targets


def parse_targets(texts: Sequence[str]) -> dict[str, str]:
    """Return number -> wanted error from targets of ``--for`` such as ``1 % friction_coefficient``.

    Raises
    ------
    InputError
        If a text is not a target.

    Examples
    --------
    >>> parse_targets(["1 % mean_gap"])
    {'mean_gap': '1 %'}
    """
    found: dict[str, str] = {}
    for text in texts:
        amount, _, name = text.strip().rpartition(" ")
        if not (name.isidentifier() and is_quantity(amount, "1")):
            raise InputError(key="for", found=text, expected="a target such as '1 % contact_area'")
        if name not in QUANTITIES:
            raise InputError(key="for", found=text, expected=f"a number of a budget{nearest(name, [*QUANTITIES])}")
        if name in found:
            raise InputError(key="for", found=text, expected=f"one target for {name}")
        found[name] = amount
    return found


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
    watch = partial(Display, progress, summary=False)
    chosen, reasons, budgets = choose(
        case, want, folder, watch=watch, tell=log.info, client=default_client(), threads=threads
    )
    for name, one in budgets.items():
        write_dataset(one, folder / FOLDER / f"budget-{name}.nc")
    return run_stated(chosen, out, progress=False, threads=threads).assign_attrs(choice="\n".join(reasons))


def choose(
    case: Case,
    want: Mapping[str, Any],
    folder: Path,
    *,
    watch: Callable[[], Display],
    tell: Callable[[str], None],
    client: Client | None = None,
    workers: int | None = 0,
    threads: int | None = None,
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
    watch : callable
        Makes the display of a sweep.
    tell : callable
        Called with the error on each grid, as a sentence.
    client, workers, threads
        As in :func:`roughvisc.sweep`. Default without a client: this process, because most solves depend on a coarser
        solve.

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
    observed = [quantity_of(case, name) for name in targets]
    require_writable(folder, "since what is wanted takes several solves")
    solved = partial(solve, folder=folder / FOLDER, watch=watch, client=client, workers=workers or 0, threads=threads)
    height, smallest = case.height(), min(targets.values())
    base = with_rows(case, [*case.settings.fields, *(field for one in observed for field in one.fields)])
    tolerance = min(max(_PART * smallest, _SMALLEST), _LARGEST)
    if case.settings.tolerance < Settings.tolerance:  # the user has chosen a small tolerance
        tolerance = min(tolerance, case.settings.tolerance)
    times, places = case.settings.times, None
    if case.experiment.axis == "time":
        places = times if isinstance(times, tuple) else case.program.corners

    # the coarsest grid resolves the waves of the surface, and leaves some cells to the third grid
    level = math.floor(math.log2(max(min(height.shape) / _FEWEST, 1.0))) - 2
    if is_sample(case, height) and (wave := shortest_wave(height)):
        level = min(level, math.floor(math.log2(wave / (2 * max(spacing(height))) * (1 + 1e-9))))
    level, before = max(level, 0), None
    while True:
        if (rounded := float(f"{tolerance:.2g}")) != base.settings.tolerance:
            base = vary(base, {"solve.tolerance": rounded})
        scale = 2.0**level
        found = compared(base, height, want, observed, solved, places=places, coarsening=scale, before=before)
        shape, length = shape_on(case, height, scale), _LENGTHS.get(level, f"{scale:g} times as long as")
        cells = f"{shape[0]} x {shape[1]} cells, {length} those of the study"
        reached = {
            name: f"{name} {_percent(error_of(one))}, wanted {_percent(math.log1p(targets[name]))}"
            for name, one in found.items()
        }
        tell(f"{cells}: {'; '.join(reached.values())}")
        steps = max(error_of(one, [STEPS]) / math.log1p(targets[name]) for name, one in found.items())
        if before is None and 0.5 < steps < math.inf and tolerance > _LEAST * smallest:
            tolerance = max(tolerance * _PART / steps, _LEAST * smallest)
            continue  # steps and solver would use more than half of the target
        _refuse_missed(case, targets, found, "whatever the grid", _FLOOR)
        if all(error_of(one) <= _ROUNDING * math.log1p(targets[name]) for name, one in found.items()):
            break
        level -= 1
        if level <= _FINEST:
            _refuse_missed(case, targets, found, f"with {cells}", before=before if level == _FINEST else None)
        before = found

    chosen = on_cells(base, height, scale)
    path = result_path(folder, chosen.key)
    if not is_result_of(chosen, path):
        with atomic_write(path) as temporary:
            shutil.copyfile(result_path(folder / FOLDER, chosen.key), temporary)
    reasons = [f"grid: {cells}"]
    for name, one in found.items():
        by_grid, others = (_percent(error_of(one, names)) for names in ((STEPS, GRID), _FLOOR))
        reasons.append(f"{reached[name]}: {by_grid} by grid and solver, {others} by all else")
    reasons.append(f"tolerance: {chosen.settings.tolerance:.2g}")
    if unknown := found[observed[0].name].attrs["open"]:
        reasons.append(f"open, and not counted: {unknown}")
    return chosen, reasons, found


def error_of(budget: xr.Dataset, sources: Sequence[str] | None = None) -> float:
    """Return the largest error of the logarithm of a number by some sources of its budget, all by default. [-]

    The error is infinite without rows, or if a value has no logarithm.
    """
    part = budget if sources is None else budget.sel(source=list(sources))
    both = np.array([together(part, side) for side in (-1, 1)])
    return float(both.max()) if both.size and np.isfinite(both).all() else math.inf


def _refuse_missed(
    case: Case,
    targets: Mapping[str, float],
    budgets: Mapping[str, xr.Dataset],
    where: str,
    sources: Sequence[str] = tuple(_REMEDIES),
    before: Mapping[str, xr.Dataset] | None = None,
) -> None:
    """Refuse targets that cannot be met; the message names the sources, and a remedy for the largest.

    The error of the next grid is at least a part of the last change. With the budgets on the coarser grid, `before`, a
    target is missed if even this smallest error exceeds it.
    """
    lines, first = [], ""
    for name, budget in budgets.items():
        wanted, least = math.log1p(targets[name]), budget
        if before is not None:
            with np.errstate(divide="ignore", invalid="ignore"):
                change = np.abs(np.log(budget["value"].values / before[name]["value"].values))
            part = GRID_FACTOR * change / 2**ORDER
            least = budget.assign(half_width=budget["half_width"].where(budget["source"] != GRID, part))
        if error_of(least, sources) <= _ROUNDING * wanted:
            continue
        first = first or name
        parts = {one: error_of(budget, [one]) for one in sources}
        largest = max(parts, key=parts.__getitem__)
        if math.isinf(parts[largest]):
            lines.append(f"{name}: found zero, or less, which has no relative error: expected another number")
            continue
        error = _percent(error_of(budget, sources), 3)
        lines.append(f"{name}: found {_percent(wanted)}: its error is {error} at least, {where}")
        lines += [f"  {one}: {_percent(part)}" for one, part in parts.items() if part > 0.1 * wanted]
        lines += [f"  {_REMEDIES[largest]} would reduce it"]
        lines += [f"  open, and not counted: {budget.attrs['open']}"] if budget.attrs["open"] else []
    if lines:
        named = f"{case.origin}: " if case.origin else ""
        raise InputError("\n".join([named + lines[0], *lines[1:]]), key=first, found=targets[first])


def _percent(half_width: float, digits: int = 2) -> str:
    """Return a half-width of a logarithm in %, or as a factor if it is large."""
    if half_width > 0.5:
        return f"a factor of {math.exp(half_width):.2g}"
    return f"±{100 * math.expm1(half_width):.{digits}g} %"
