"""``choose``: the grid and the tolerance that give a number as accurately as it is wanted, or as time allows.

Grids are computed from coarse to fine, until the error of the grid fits into what the other sources leave of the
target. Those sources, the floor, are judged first, on the coarsest grid that holds the waves of the surface.
"""

from __future__ import annotations

import logging
import math
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from roughvisc.errors import InputError
from roughvisc.study.budget.grids import (
    AMPLE,
    FIFTH,
    FINEST,
    FLOOR,
    RULED,
    Around,
    draws_others,
    errors_in_words,
    first_grids,
    percent,
    refusal,
)
from roughvisc.study.budget.population import OfPopulation, mean_of_population
from roughvisc.study.budget.solves import FOLDER, Bench
from roughvisc.study.budget.sources import stated_errors
from roughvisc.study.execution.cluster import default_client, local_client
from roughvisc.study.execution.monitor import Monitor, watcher
from roughvisc.study.execution.run import is_result_of, result_folder
from roughvisc.study.execution.single import run_stated
from roughvisc.study.quantities import known_quantity
from roughvisc.study.statement.case import Case, vary
from roughvisc.study.statement.schema.evaluation import BEST, WANTED
from roughvisc.study.statement.schema.section import nearest
from roughvisc.study.storage.files import atomic_write, require_writable
from roughvisc.study.storage.store import result_path, write_dataset
from roughvisc.study.trade.ladder import format_tolerance
from roughvisc.units import is_quantity

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


def wanting(case: Case, want: Mapping[str, Any]) -> Case:
    """A case of which other numbers are wanted; what its study knows of errors is kept unless it is given.

    Parameters
    ----------
    case : Case
    want : mapping
        Keys and values as ``[want]`` of a study has them.

    Raises
    ------
    InputError
        If a key or a value is none of those expected.
    """
    if not isinstance(want, Mapping):
        raise InputError(f"want is {want!r}: expected a dictionary such as {{'contact_area': '1 %'}}")
    changed = vary(case, {"want": stated_errors(case) | dict(want)})
    return replace(changed, varied=case.varied, written=case.written)


def parse_targets(texts: Sequence[str]) -> dict[str, str]:
    """Keys and values of ``[want]`` from targets of ``--for`` such as ``1 % friction_coefficient`` and ``60 s``.

    Raises
    ------
    InputError
        If a text is no target.

    Examples
    --------
    >>> parse_targets(["1 % mean_gap", "60 s"])
    {'mean_gap': '1 %', 'time': '60 s'}
    >>> parse_targets(["2 min contact_area"])
    {'time': '2 min', 'contact_area': 'best'}
    """
    found: dict[str, str] = {}
    for text in texts:
        amount, _, name = (text, "", "") if _is_time(text) else text.strip().rpartition(" ")
        if not _is_time(amount) and not (name.isidentifier() and is_quantity(amount, "1")):
            raise InputError(f"--for: found {text!r}: expected a target such as '1 % {WANTED[0]}', or '60 s'")
        if name and name not in WANTED:
            raise InputError(f"--for: found {text!r}: {name!r} is no number that a budget knows{nearest(name, WANTED)}")
        keys = ["time", name] if _is_time(amount) else [name]
        for key, value in zip(filter(None, keys), (amount, BEST), strict=False):
            if value != BEST and found.get(key, BEST) != BEST:
                raise InputError(f"--for: found {text!r} beside another target for {key}: expected one")
            found[key] = found.get(key, value) if value == BEST else value
    return found


def _is_time(text: str) -> bool:
    return is_quantity(text, "s") and not is_quantity(text, "1")


def run(
    case: Case,
    out: str | Path | None = None,
    *,
    want: Mapping[str, Any] | None = None,
    progress: bool = True,
    threads: int | None = None,
) -> xr.Dataset:
    """Result of the case that is chosen for what is wanted of another; see :func:`roughvisc.run`."""
    if want is not None:
        case = wanting(case, want)
    if not case.is_to_be_chosen:
        raise InputError(f"want is {want!r}: expected a target such as {{'contact_area': '1 %'}} or {{'time': '60 s'}}")
    folder = result_folder(case, out)
    choice = choose(
        case,
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
    folder: Path,
    *,
    watch: Callable[[], Monitor],
    tell: Callable[[str], None],
    client: Client | None = None,
    workers: int | None = 0,
    threads: int | None = None,
) -> Choice:
    """Choose grid and tolerance for what is wanted of a case, and bring the case so chosen to its file.

    Parameters
    ----------
    case : Case
        One that states a target.
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
        If the target cannot be met: the message says how accurate the number is at best, by which sources, and what
        would help.
    """
    want = case.settings.want
    targets, limit = want.targets(), want.time or math.inf
    main = "friction_coefficient" if case.experiment().largest_speed > 0 else "contact_area"
    quantities = [known_quantity(name, case) for name in want.numbers() or [main]]
    require_writable(folder, "since what is wanted takes several solves")
    bench = Bench(quantities, folder / FOLDER, watch, tell, client, workers, threads)

    around = first_grids(case, bench, targets, limit).with_changed_cases()
    if told := list(around.missed(targets, FLOOR)):
        raise refusal(case, told)
    found: Around | OfPopulation
    if draws_others(case):
        workers = workers if client is None else None
        with local_client(workers) if workers else nullcontext(client) as there:
            found = mean_of_population(replace(around, bench=replace(bench, client=there)), targets, limit)
    else:
        found = _refined(around, targets, limit)

    chosen = around.grids.case(found.level)
    bench.solve({"own": chosen})
    path = result_path(folder, chosen.key)
    if not is_result_of(chosen, path):
        with atomic_write(path) as temporary:
            shutil.copyfile(result_path(bench.folder, chosen.key), temporary)
    budgets = {one.name: found.budget(one, chosen) for one in quantities}
    return Choice(chosen, tuple(_reasons(around, found, targets, limit)), budgets)


def _refined(around: Around, targets: Mapping[str, float], limit: float) -> Around:
    """The solves around the first grid that meets the targets, or without one around the finest in the time.

    Raises
    ------
    InputError
        If no grid meets the targets, or none in the time. [s]
    """
    while True:
        around.bench.tell(f"{around.grids.words(around.level)}: {errors_in_words(around.errors(), targets)}")
        missed = list(around.missed(targets))
        if targets and not missed:
            return around
        if around.level == FINEST + 1:  # the next grid is the last one
            missed = list(around.if_next_were_the_same().missed(targets))
        if missed and around.level <= FINEST + 1:
            raise refusal(around.grids.own, missed)
        if around.level == FINEST:
            return around
        wait = around.seconds_of_next()
        if around.spent + wait > limit:
            if targets:
                raise refusal(around.grids.own, [around.short_of_time(targets, limit, wait)])
            return around
        around = around.finer()


def _reasons(around: Around, found: Around | OfPopulation, targets: Mapping[str, float], limit: float) -> Iterator[str]:
    """What was chosen, and why."""
    grids = around.grids
    yield f"grid: {grids.words(found.level)}"
    if isinstance(found, OfPopulation):
        yield found.draws()
    for one in found.quantities:
        parts = f"{percent(found.error(one, RULED))} by grid and solver, {percent(found.floor(one))} by all else"
        if isinstance(found, OfPopulation):
            parts += f", {percent(found.error(one, ['sample']))} by the draws"
        yield f"{errors_in_words({one.name: found.error(one)}, targets)}: {parts}"
    tolerance = grids.variants.case.settings.solve.tolerance
    least = FIFTH * min(targets.values(), default=0.0)
    why = {
        tolerance > least: "that of the study",
        tolerance < least: "since steps and solver take more of some numbers",
        math.isclose(tolerance, least, rel_tol=0.1): "a fifth of what is wanted",
        tolerance == grids.own.settings.solve.tolerance: "that of the study",
        tolerance == AMPLE: "ample for what is wanted",
    }
    yield f"tolerance: {format_tolerance(tolerance)}, {why[True]}"
    if math.isfinite(limit):
        more = found.seconds_of_next()
        yield f"time: {found.spent:.2g} s of {limit:g} s; the next grid would take some {more:.2g} s"
    judged = found.judged(found.quantities[0])
    if unknown := [name for name, one in judged.items() if one.half_width is None]:
        yield f"open, and not counted: {', '.join(unknown)}"
