"""``choose``: the grid and the tolerance that give a number as accurately as it is wanted.

Grids are computed from coarse to fine, until the error of the grid fits into what the other sources leave of the
target. Those sources, the floor, are judged first, on the coarsest grid that holds the waves of the surface.
"""

from __future__ import annotations

import logging
import math
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from roughvisc.arguments import nearest
from roughvisc.errors import InputError
from roughvisc.study.budget.grids import (
    AMPLE,
    FIFTH,
    FINEST,
    FLOOR,
    RULED,
    Around,
    errors_in_words,
    first_grids,
    percent,
    refusal,
)
from roughvisc.study.budget.solves import FOLDER, Bench
from roughvisc.study.budget.sources import KNOWN, known_errors
from roughvisc.study.case import Case
from roughvisc.study.execution.cluster import default_client
from roughvisc.study.execution.monitor import Monitor, watcher
from roughvisc.study.execution.run import is_result_of, result_folder
from roughvisc.study.execution.single import run_stated
from roughvisc.study.quantities import QUANTITIES, known_quantity
from roughvisc.study.storage.files import atomic_write, require_writable
from roughvisc.study.storage.store import result_path, write_dataset
from roughvisc.study.trade.ladder import format_tolerance
from roughvisc.units import is_quantity, number

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger("roughvisc")


@dataclass(frozen=True)
class Choice:
    """What was chosen for a target.

    Attributes
    ----------
    case : Case
        A case like any other, with the grid and the tolerance that were chosen.
    reasons : tuple of str
        What was chosen and why, in sentences.
    budgets : dict
        Name of each quantity -> its budget, around what was chosen.
    """

    case: Case
    reasons: tuple[str, ...]
    budgets: dict[str, xr.Dataset]


def targets_of(want: Mapping[str, Any]) -> tuple[dict[str, float], dict[str, Any]]:
    """Return the wanted error of each number, and the errors that are known.

    Raises
    ------
    InputError
        If a key or a value is none of those expected.
    """
    if not isinstance(want, Mapping):
        raise InputError(key="want", found=want, expected="a dictionary such as {'contact_area': '1 %'}")
    targets = {}
    for name, value in want.items():
        if name not in (*QUANTITIES, *KNOWN):
            raise InputError(key="want", found=name, expected=f"some of {', '.join((*QUANTITIES, *KNOWN))}")
        if name in QUANTITIES:
            targets[name] = number(value, "1", f"want.{name}", above=0, below=1)
    if not targets:
        raise InputError(key="want", found=dict(want), expected="a target such as {'contact_area': '1 %'}")
    return targets, known_errors({name: value for name, value in want.items() if name in KNOWN})


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
    choice = choose(
        case,
        want,
        folder,
        watch=partial(watcher, progress, summary=False),
        tell=log.info,
        client=default_client(),
        threads=threads,
    )
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
        Of its results. The solves go to its folder ``budget``, and are used again.
    watch : callable
        Makes what shows how solves that take long go on.
    tell : callable
        Told in a sentence what a grid has given.
    client, workers, threads
        As :func:`roughvisc.sweep` has them; ``workers=None``: further processes where they are worth it.

    Raises
    ------
    InputError
        If a target is none, or cannot be met: the message says how accurate the number is at best, and by which
        sources.
    """
    targets, known = targets_of(want)
    quantities = [known_quantity(name, case) for name in targets]
    require_writable(folder, "since what is wanted takes several solves")
    bench = Bench(quantities, folder / FOLDER, watch, tell, client, workers, threads)

    around = first_grids(case, known, bench, targets).with_changed_cases()
    if told := list(around.missed(targets, FLOOR)):
        raise refusal(case, targets, told)
    around = _refined(around, targets)

    chosen = around.grids.case(around.level)
    bench.solve({"own": chosen})
    path = result_path(folder, chosen.key)
    if not is_result_of(chosen, path):
        with atomic_write(path) as temporary:
            shutil.copyfile(result_path(bench.folder, chosen.key), temporary)
    budgets = {one.name: around.budget(one, chosen) for one in quantities}
    return Choice(chosen, tuple(_reasons(around, targets)), budgets)


def _refined(around: Around, targets: Mapping[str, float]) -> Around:
    """Return the solves around the first grid that meets the targets.

    Raises
    ------
    InputError
        If no grid meets the targets.
    """
    while True:
        around.bench.tell(f"{around.grids.words(around.level)}: {errors_in_words(around.errors(), targets)}")
        missed = list(around.missed(targets))
        if not missed:
            return around
        if around.level == FINEST + 1:  # the next grid is the last one
            missed = list(around.if_next_were_the_same().missed(targets))
        if missed and around.level <= FINEST + 1:
            raise refusal(around.grids.own, targets, missed)
        around = around.finer()


def _reasons(around: Around, targets: Mapping[str, float]) -> Iterator[str]:
    """Yield what was chosen, and why."""
    grids = around.grids
    yield f"grid: {grids.words(around.level)}"
    for one in around.quantities:
        parts = f"{percent(around.error(one, RULED))} by grid and solver, {percent(around.floor(one))} by all else"
        yield f"{errors_in_words({one.name: around.error(one)}, targets)}: {parts}"
    tolerance = grids.variants.case.settings.tolerance
    least = FIFTH * min(targets.values())
    why = {
        tolerance > least: "that of the study",
        tolerance < least: "since steps and solver take more of some numbers",
        math.isclose(tolerance, least, rel_tol=0.1): "a fifth of what is wanted",
        tolerance == grids.own.settings.tolerance: "that of the study",
        tolerance == AMPLE: "ample for what is wanted",
    }
    yield f"tolerance: {format_tolerance(tolerance)}, {why[True]}"
    judged = around.judged(around.quantities[0])
    if unknown := [name for name, one in judged.items() if one.half_width is None]:
        yield f"open, and not counted: {', '.join(unknown)}"
