"""``choose``: the grid and the tolerance that give a number as accurately as it is wanted.

Grids are solved from coarse to fine until the errors of the grid, of the steps and of the other sources together are
as small as wanted. The other sources, which no grid reduces, are estimated once, on the coarsest grid that resolves
the waves of the surface.
"""

from __future__ import annotations

import logging
import math
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.arguments import nearest
from roughvisc.errors import InputError
from roughvisc.settings import Settings
from roughvisc.study.budget import FOLDER, assembled, at_rows
from roughvisc.study.case import Case, vary
from roughvisc.study.execution.cluster import default_client
from roughvisc.study.execution.monitor import Monitor, watcher
from roughvisc.study.execution.run import is_result_of, result_folder
from roughvisc.study.execution.single import run_stated
from roughvisc.study.neighbours import (
    GRID,
    MODULUS,
    OCTAVE,
    ORDER,
    SAMPLE,
    STEPS,
    TIME_SCALE,
    Known,
    Share,
    Source,
    is_sample,
    on_cells,
    shape_on,
    share,
    shortest_wave,
    solve,
    sources_of,
    together,
    with_rows,
)
from roughvisc.study.quantities import QUANTITIES, Array, Observable, quantity_of
from roughvisc.study.storage.files import atomic_write, require_writable
from roughvisc.study.storage.store import result_path, write_dataset
from roughvisc.topography.grid import spacing
from roughvisc.units import is_quantity, number

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger("roughvisc")
#: The tolerance over the target, at first and at least; the largest and the smallest that are chosen.
_PART, _LEAST, _LARGEST, _SMALLEST = 0.2, 0.006, 1e-2, 1e-8
#: The finest grid has cells ``2**-2`` times as long as the study's; the coarsest of all has so many cells a side.
_FINEST, _FEWEST = -2, 12
#: An error that exceeds the target by less is accepted, since both are rounded in print.
_ROUNDING = 1.005
#: What reduces the error of a source.
_REMEDIES = {
    STEPS: "a smaller tolerance",
    GRID: "finer cells",
    SAMPLE: "a larger scan, or several of them",
    OCTAVE: "a scan with finer cells",
    MODULUS: "moduli that are known more accurately",
    TIME_SCALE: "times of the material, or its temperature, that are known more accurately",
}


@dataclass(frozen=True)
class Choice:
    """Grid and tolerance that were chosen for a target.

    Attributes
    ----------
    case : Case
        The case with the chosen grid and tolerance.
    reasons : tuple of str
        What was chosen and why, in sentences.
    budgets : dict
        Name of each quantity -> its budget.
    """

    case: Case
    reasons: tuple[str, ...]
    budgets: dict[str, xr.Dataset]


def targets_of(want: Mapping[str, Any]) -> tuple[dict[str, float], Known]:
    """Return the wanted relative error of each number, and the errors that the user states.

    Raises
    ------
    InputError
        If a key or a value is invalid.
    """
    if not isinstance(want, Mapping):
        raise InputError(key="want", found=want, expected="a dictionary such as {'contact_area': '1 %'}")
    known = list(Known.__dataclass_fields__)
    for name in want:
        if name not in (*QUANTITIES, *known):
            raise InputError(key="want", found=name, expected=f"one of {', '.join((*QUANTITIES, *known))}")
    targets = {
        name: number(part, "1", f"want.{name}", above=0, below=1) for name, part in want.items() if name in QUANTITIES
    }
    if not targets:
        raise InputError(key="want", found=dict(want), expected="a target such as {'contact_area': '1 %'}")
    return targets, Known(**{name: value for name, value in want.items() if name in known})


def parse_targets(texts: Sequence[str]) -> dict[str, str]:
    """Return number -> wanted error from targets of ``--for`` such as ``1 % friction_coefficient``.

    Raises
    ------
    InputError
        If a text is no target.

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
    """Return the result of the case that is chosen for wanted errors; see :func:`roughvisc.run`."""
    folder = result_folder(case, out)
    watch = partial(watcher, progress, summary=False)
    choice = choose(case, want, folder, watch=watch, tell=log.info, client=default_client(), threads=threads)
    for name, one in choice.budgets.items():
        write_dataset(one, folder / FOLDER / f"budget-{name}.nc")
    found = run_stated(choice.case, out, progress=False, threads=threads)
    return found.assign_attrs(choice="\n".join(choice.reasons))


def choose(
    case: Case,
    want: Mapping[str, Any],
    folder: Path,
    *,
    watch: Callable[[], Monitor],
    tell: Callable[[str], None],
    client: Client | None = None,
    workers: int | None = 0,
    threads: int | None = None,
) -> Choice:
    """Choose grid and tolerance for wanted errors, and write the result of the chosen case.

    Parameters
    ----------
    case : Case
        Case whose grid and tolerance are changed.
    want : mapping
        Number -> wanted relative error at 95 % [-]; also the errors that are known, as :func:`roughvisc.budget` takes
        them.
    folder : Path
        Folder of the results. The solves go to its folder ``budget``, and are used again.
    watch : callable
        Makes the display of a sweep.
    tell : callable
        Called with the error on each grid, as a sentence.
    client, workers, threads
        As in :func:`roughvisc.sweep`.

    Raises
    ------
    InputError
        If a target is invalid or cannot be met: the message names the smallest error, its sources, and what would
        reduce the largest of them.
    """
    targets, known = targets_of(want)
    observed = [quantity_of(case, name) for name in targets]
    require_writable(folder, "since what is wanted takes several solves")
    solved = partial(solve, folder=folder / FOLDER, watch=watch, client=client, workers=workers, threads=threads)
    height, smallest = case.height(), min(targets.values())
    base = with_rows(case, [*case.settings.fields, *(field for one in observed for field in one.fields)])
    tolerance = min(max(_PART * smallest, _SMALLEST), _LARGEST)
    if case.settings.tolerance < Settings.tolerance:  # sharper than usual, on purpose
        tolerance = min(tolerance, case.settings.tolerance)
    level, grid = _coarsest(case, height), None
    while True:
        if (rounded := float(f"{tolerance:.2g}")) != base.settings.tolerance:
            base = vary(base, {"solve.tolerance": rounded})
        found = _Grid.solved(base, height, known, level, observed, grid, solved)
        tell(f"{found.cells}: {found.in_words(targets)}")
        steps = max(found.error(name, [STEPS]) / math.log1p(part) for name, part in targets.items())
        if grid is None and 0.5 < steps < math.inf and tolerance > _LEAST * smallest:
            tolerance = max(tolerance * _PART / steps, _LEAST * smallest)
            continue  # steps and solver take too much of what is wanted
        grid = found
        if grid.misses(targets, grid.floor):
            raise grid.refusal(case, targets, grid.floor, "whatever the grid")
        if not grid.misses(targets):
            break
        if level == _FINEST or (level == _FINEST + 1 and grid.next_misses(targets)):
            raise grid.refusal(case, targets, list(grid.sources), f"with {grid.cells}")
        level -= 1
    chosen = grid.own
    path = result_path(folder, chosen.key)
    if not is_result_of(chosen, path):
        with atomic_write(path) as temporary:
            shutil.copyfile(result_path(folder / FOLDER, chosen.key), temporary)
    reasons = [f"grid: {grid.cells}"]
    for name in targets:
        by_grid, others = (_percent(grid.error(name, of)) for of in ((STEPS, GRID), grid.floor))
        reasons.append(f"{grid.in_words({name: targets[name]})}: {by_grid} by grid and solver, {others} by all else")
    reasons.append(f"tolerance: {chosen.settings.tolerance:.2g}")
    if unknown := [name for name, one in grid.sources.items() if one.state == "open"]:
        reasons.append(f"open, and not counted: {', '.join(unknown)}")
    return Choice(chosen, tuple(reasons), {name: grid.budget(name, chosen) for name in targets})


def _coarsest(case: Case, height: xr.DataArray) -> int:
    """Return the level of the first grid, whose cells are ``2**level`` times as long as those of the study.

    It resolves the waves of the surface, and the third grid has some cells.
    """
    level = math.floor(math.log2(max(min(height.shape) / _FEWEST, 1.0))) - 2
    if is_sample(case, height) and (wave := shortest_wave(height)):
        level = min(level, math.floor(math.log2(wave / (2 * max(spacing(height))) * (1 + 1e-9))))
    return max(level, 0)


@dataclass(frozen=True)
class _Grid:
    """Errors of the wanted quantities on one grid.

    Attributes
    ----------
    own : Case
        The case on this grid.
    cells : str
        The grid, in words.
    sources : dict
        Name -> source of error.
    observed : dict
        Name -> quantity.
    values : dict
        Name of each quantity -> its values at the rows that are judged.
    shares : dict
        Name of each quantity -> name of each source -> its error.
    last_change : dict
        Name of each quantity -> error of the grid from the last change of the grid alone, without the one before.
    touches : ndarray of bool
        Whether there is a force at each of these rows.
    places : ndarray
        Times [s] or speeds [m/s] of these rows.
    seconds : dict
        Key of each case -> wall time of its solve. [s]
    """

    own: Case
    cells: str
    sources: dict[str, Source]
    observed: dict[str, Observable]
    values: dict[str, Array]
    shares: dict[str, dict[str, Share]]
    last_change: dict[str, Array]
    touches: NDArray[np.bool_]
    places: Array
    seconds: dict[str, float]

    @classmethod
    def solved(
        cls,
        base: Case,
        height: xr.DataArray,
        known: Known,
        level: int,
        observed: Sequence[Observable],
        coarser: _Grid | None,
        solved: Callable[[list[Case]], dict[str, xr.Dataset]],
    ) -> _Grid:
        """Return the errors on a grid; those of the sources that no grid reduces are taken from a coarser grid."""
        sources = sources_of(base, height, known, 2.0**level, three_grids=True)
        new = sources if coarser is None else {name: sources[name] for name in (STEPS, GRID)}
        near = [one for source in new.values() for one in source.neighbours]
        own, axis = on_cells(base, height, 2.0**level), base.experiment().axis
        results = solved([own, *(one.case for one in near)])
        seconds = {key: float(result["wall_time"].values[-1]) for key, result in results.items()}
        judged = at_rows(results[own.key], axis, _judged(base))
        places = judged[axis].values
        rows = {key: at_rows(result, axis, places) for key, result in results.items()}
        values, shares, last_change = {}, {}, {}
        for one in observed:
            of_all = {key: one.of(result, base) for key, result in rows.items()}
            values[one.name] = of_all[own.key]
            given = of_all, np.nan_to_num(one.stated_error(judged, of_all[own.key]))
            shares[one.name] = {} if coarser is None else dict(coarser.shares[one.name])
            shares[one.name] |= {name: share(name, source, one, *given) for name, source in new.items()}
            last = replace(sources[GRID], neighbours=sources[GRID].neighbours[:1])
            last_change[one.name] = share(GRID, last, one, *given).half_width
        shape = " x ".join(map(str, shape_on(base, height, 2.0**level)))
        long = {0: "those", 1: "twice as long as those", -1: "half as long as those", -2: "a quarter as long as those"}
        return cls(
            own=own,
            cells=f"{shape} cells, {long.get(level, f'{2.0**level:g} times as long as those')} of the study",
            sources=sources if coarser is None else coarser.sources | {GRID: sources[GRID]},
            observed={one.name: one for one in observed},
            values=values,
            shares=shares,
            last_change=last_change,
            touches=judged["force"].values > 0,
            places=places,
            seconds=seconds if coarser is None else coarser.seconds | seconds,
        )

    @property
    def floor(self) -> list[str]:
        """Sources that neither a finer grid nor a smaller tolerance reduces."""
        return [name for name in self.sources if name not in (STEPS, GRID)]

    def error(self, quantity: str, sources: Sequence[str] | None = None) -> float:
        """Return the largest error of the logarithm of a quantity by some sources, all by default. [-]

        It is infinite without a row, or if a value has no logarithm.
        """
        shares = [one for name, one in self.shares[quantity].items() if sources is None or name in sources]
        both = np.array([together(shares, side)[self.touches] for side in (-1, 1)])
        return float(both.max()) if both.size and np.isfinite(both).all() else math.inf

    def misses(self, targets: Mapping[str, float], sources: Sequence[str] | None = None) -> bool:
        """Return whether the error by some sources, all by default, exceeds a target."""
        return any(self.error(name, sources) > _ROUNDING * math.log1p(part) for name, part in targets.items())

    def next_misses(self, targets: Mapping[str, float]) -> bool:
        """Return whether a grid of cells half as long exceeds a target even if nothing changes on it."""
        return any(
            float(self.last_change[name][self.touches].max()) / 2**ORDER > _ROUNDING * math.log1p(part)
            for name, part in targets.items()
        )

    def in_words(self, targets: Mapping[str, float]) -> str:
        """Return the errors of some quantities, and the targets."""
        return "; ".join(
            f"{name} {_percent(self.error(name))}, wanted {_percent(math.log1p(part))}"
            for name, part in targets.items()
        )

    def refusal(self, case: Case, targets: Mapping[str, float], sources: Sequence[str], where: str) -> InputError:
        """Return the error of targets that cannot be met: the sources, and what would reduce the largest."""
        lines, first = [], ""
        for name, part in targets.items():
            if not self.misses({name: part}, sources):
                continue
            first = first or name
            parts = {one: self.error(name, [one]) for one in sources if self.sources[one].state != "open"}
            largest = max(parts, key=lambda one: parts[one])
            if math.isinf(parts[largest]):
                lines.append(f"{name}: found zero, or less: a part of it is no error: expected another number")
                continue
            told = f"{name}: found {_percent(math.log1p(part))}: its error is {_percent(self.error(name, sources), 3)}"
            lines.append(f"{told} at least, {where}; {_REMEDIES[largest]} would reduce it")
            lines += [f"  {one}: {_percent(error)}" for one, error in parts.items() if error > 0.1 * math.log1p(part)]
            lines += [f"  {one}: open: {now.method}" for one, now in self.sources.items() if now.state == "open"]
        named = f"{case.origin}: " if case.origin else ""
        return InputError("\n".join([f"{named}{lines[0]}", *lines[1:]]), key=first, found=targets[first])

    def budget(self, quantity: str, chosen: Case) -> xr.Dataset:
        """Return the budget of a quantity."""
        return assembled(
            chosen,
            self.observed[quantity],
            self.sources,
            self.shares[quantity],
            self.values[quantity],
            self.places,
            self.seconds,
        )


def _judged(case: Case) -> list[float] | None:
    """Return the times of the rows that are judged: the listed ones, else the corners of the program; None: all."""
    times = case.settings.times
    if case.experiment().axis != "time":
        return None
    return list(times) if isinstance(times, tuple) else list(case.program().corners)


def _percent(half_width: float, digits: int = 2) -> str:
    """Return a half-width of a logarithm in %, or as a factor if it is large."""
    if half_width > 0.5:
        return f"a factor of {math.exp(half_width):.2g}"
    return f"±{100 * math.expm1(half_width):.{digits}g} %"
