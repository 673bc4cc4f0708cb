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
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.settings import Settings
from roughvisc.study.budget.budget import FOLDER, assembled, known_errors, observed_with, solved, together
from roughvisc.study.budget.population import MOST, PILOT, Level, counts_for, draw, mean_of, scatter_of
from roughvisc.study.budget.sources import SOURCES, Asked, Found
from roughvisc.study.budget.variants import Variants, with_rows
from roughvisc.study.execution.cluster import local_client
from roughvisc.study.execution.monitor import Monitor, watcher
from roughvisc.study.execution.run import is_result_of, result_folder
from roughvisc.study.execution.single import default_client, run_stated
from roughvisc.study.quantities import Observable, known_quantity
from roughvisc.study.statement.case import Case, vary
from roughvisc.study.statement.schema.evaluation import BEST, KNOWN, WANTED
from roughvisc.study.statement.schema.section import nearest
from roughvisc.study.storage.files import atomic_write, require_writable
from roughvisc.study.storage.store import result_path, write_dataset
from roughvisc.study.trade.ladder import format_tolerance, has_steps
from roughvisc.topography.grid import spacing
from roughvisc.units import is_quantity, unit_for
from roughvisc.variables.axes import AXES

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger("roughvisc")
Array = NDArray[np.float64]
#: The tolerance over the target: steps and solver then count for little beside all else.
_TOLERANCE = 0.2
#: Tolerances that are chosen; the larger is ample for a number that is known to some per cent.
_SHARPEST, _AMPLE = 1e-8, 1e-2
#: The sharpest tolerance over that, where steps and solver count for more than they should.
_LEAST = 0.03
#: Level of the finest grid: its cells are ``2**level`` times as long as those of the study.
_FINEST = -2
#: Fewest cells a side of the coarsest grid, where that is coarser than a quarter of the study's.
_FEWEST = 12
#: Cost of a grid over that of one with cells twice as long.
_DEARER = 4.0
#: Time of some solves from which on further processes are worth it, where they are not asked for. [s]
_WORTH_PROCESSES = 20.0
#: Time of some solves from which on a display shows how they go on. [s]
_WORTH_WATCHING = 2.0
#: Error at which the search for the best in a time begins, of a population.
_FIRST_GOAL = 0.3
#: Sources that grid and tolerance rule; all others are the floor.
_RULED = ("time steps and solver", "grid")
FLOOR = tuple(source.name for source in SOURCES if source.name not in _RULED)


@dataclass(frozen=True)
class Choice:
    """What was chosen for a target.

    Attributes
    ----------
    case : Case
        A case like any other, with the grid and the tolerance that were chosen.
    path : Path
        Its result.
    reasons : tuple of str
        What was chosen and why, in sentences.
    budgets : dict
        Name of each quantity -> its budget, around what was chosen.
    """

    case: Case
    path: Path
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
    changed = vary(case, {"want": _known(case) | dict(want)})
    return replace(changed, varied=case.varied, written=case.written)


def _known(case: Case) -> dict[str, Any]:
    """What the study of a case knows of errors."""
    stated = case.settings.want
    return {} if stated is None else stated.model_dump(include=set(KNOWN), exclude_none=True)


def parse_targets(texts: Sequence[str], option: str = "--for") -> dict[str, str]:
    """Keys and values of ``[want]`` from targets such as ``1 % friction_coefficient`` and ``60 s``.

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
            raise InputError(f"{option}: found {text!r}: expected a target such as '1 % {WANTED[0]}', or '60 s'")
        if name and name not in WANTED:
            raise InputError(
                f"{option}: found {text!r}: {name!r} is no number that a budget knows{nearest(name, WANTED)}"
            )
        keys = ["time", name] if _is_time(amount) else [name]
        for key, value in zip(filter(None, keys), (amount, BEST), strict=False):
            if value != BEST and found.get(key, BEST) != BEST:
                raise InputError(f"{option}: found {text!r} beside another target for {key}: expected one")
            found[key] = found.get(key, value) if value == BEST else value
    return found


def _is_time(text: str) -> bool:
    return is_quantity(text, "s") and not is_quantity(text, "1")


@dataclass(frozen=True)
class Solve:
    """What one solve gives of the quantities.

    Attributes
    ----------
    places : ndarray
        Of its rows on the axis.
    values, stated : dict
        Name of each quantity -> its values, and what steps and solver leave of their logarithms.
    touches : ndarray of bool
        Whether there is a force at each place.
    seconds : float
        Its wall time. [s]
    """

    places: Array
    values: Mapping[str, Array]
    stated: Mapping[str, Array]
    touches: NDArray[np.bool_]
    seconds: float

    def at(self, places: Array) -> Solve:
        """Its rows nearest to some places."""
        rows = np.abs(self.places[:, None] - places).argmin(axis=0)
        values, stated = ({name: one[rows] for name, one in of.items()} for of in (self.values, self.stated))
        return Solve(self.places[rows], values, stated, self.touches[rows], self.seconds)


@dataclass(frozen=True)
class Bench:
    """Where solves are made, and which quantities are read off them."""

    quantities: Sequence[Observable]
    folder: Path
    watch: Callable[[], Monitor]
    tell: Callable[[str], None]
    client: Client | None = None
    workers: int | None = 0
    threads: int | None = None
    same_bits: bool = False

    def solve(self, solves: Mapping[Any, Case], each: float = 0.0) -> dict[Any, Solve]:
        """Name -> solve of each of some cases; ``each`` is how long one is expected to take. [s]"""
        workers = self.workers
        if self.client is None and workers is None and len(solves) * each < _WORTH_PROCESSES:
            workers = 0
        made = solved(
            "want",
            solves,
            self.folder,
            watch=self.watch() if len(solves) * each > _WORTH_WATCHING else Monitor(),
            client=self.client,
            workers=workers,
            threads=self.threads,
            same_bits=self.same_bits,
            retry_failed=True,
        )
        found = {}
        for name, dataset in made.items():
            with dataset:
                found[name] = self._read(dataset, solves[name])
        return found

    def _read(self, dataset: xr.Dataset, case: Case) -> Solve:
        observe = observed_with(case)
        values = {one.name: one.of(dataset, observe) for one in self.quantities}
        stated = {one.name: np.nan_to_num(one.stated_error(dataset, values[one.name])) for one in self.quantities}
        places = np.asarray(dataset[case.experiment().axis].values, dtype=float)
        return Solve(places, values, stated, dataset["force"].values > 0, float(dataset["wall_time"].values[-1]))


@dataclass(frozen=True)
class Grids:
    """The grids among which is chosen, by level: cells are ``2**level`` times as long as those of the study."""

    own: Case
    variants: Variants

    @property
    def held(self) -> int:
        """The coarsest level that holds the waves of the surface, or some cells; at least that of the study."""
        held = math.floor(math.log2(max(min(self.variants.shape) / _FEWEST, 1.0))) - 2
        if self.variants.is_rough and (wave := self.variants.shortest_wave):
            cells = wave / (2 * max(spacing(self.variants.height)))
            held = min(held, math.floor(math.log2(cells * (1 + 1e-9))))
        return max(held, 0)

    def case(self, level: int) -> Case:
        """The case on a level, as one would state it."""
        base, own = self.variants.case, self.own
        changed = base if level == 0 else self.variants.on_cells(2.0**level)
        changes = {key: one for key, one in changed.varied.items() if key not in base.varied}
        if base.settings.solve.tolerance != own.settings.solve.tolerance:
            changes["solve.tolerance"] = base.settings.solve.tolerance
        return replace(changed, varied={**own.varied, **changes}, written=own.written)

    def words(self, level: int) -> str:
        """Cells of a level, beside those of the study."""
        height = self.case(level).height()
        return f"{height.sizes['x']} x {height.sizes['y']} cells, {cells_in_words(level)}"


def cells_in_words(level: int) -> str:
    """How long the cells of a level are.

    Examples
    --------
    >>> cells_in_words(2), cells_in_words(0), cells_in_words(-1)
    ('4 times as long as those of the study', 'those of the study', 'half as long as those of the study')
    """
    known = {1: "twice", -1: "half", -2: "a quarter"}
    return (
        f"{known.get(level, f'{2.0**level:g} times')} as long as those of the study" if level else "those of the study"
    )


def grids_of(case: Case, quantities: Sequence[Observable], tolerance: float) -> Grids:
    """Grids of a case whose solves keep what the quantities need, beside what the study keeps."""
    fields = dict.fromkeys((*case.settings.keep.fields, *(field for one in quantities for field in one.fields)))
    base = vary(with_rows(case, None, tuple(fields)), {"solve.tolerance": tolerance, "want": _known(case)})
    return Grids(case, Variants(base, base.height()))


def tolerance_for(case: Case, targets: Mapping[str, float]) -> float:
    """A fifth of the smallest target; a study that is sharper than usual keeps its own, as where time is the target."""
    own = case.settings.solve.tolerance
    if not targets:
        return float(own)
    chosen = min(max(_TOLERANCE * min(targets.values()), _SHARPEST), _AMPLE)
    return float(f"{min(chosen, own) if own < Settings.tolerance else chosen:.2g}")


def run(
    case: Case,
    out: str | Path | None = None,
    *,
    want: Mapping[str, Any] | None = None,
    progress: bool = True,
    same_bits: bool = False,
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
        same_bits=same_bits,
        threads=threads,
    )
    for name, one in choice.budgets.items():
        write_dataset(one, folder / FOLDER / f"budget-{name}.nc")
    found = run_stated(choice.case, out, progress=False, same_bits=same_bits, threads=threads)
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
    same_bits: bool = False,
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
    client, workers, threads, same_bits
        As :func:`roughvisc.sweep` has them; ``workers=None``: further processes where they are worth it.

    Raises
    ------
    InputError
        If the target cannot be met: the message says how accurate the number is at best, by which sources, and what
        would help.
    """
    want, experiment = case.settings.want, case.experiment()
    targets, limit = want.targets(), want.time or math.inf
    slides = experiment.largest_speed > 0
    names = want.numbers() or ["friction_coefficient" if slides else "contact_area"]
    quantities = [known_quantity(name, experiment.axis, slides) for name in names]
    require_writable(folder, "since what is wanted takes several solves")
    bench = Bench(quantities, folder / FOLDER, watch, tell, client, workers, threads, same_bits)

    grids, around = first_grids(case, bench, targets, limit)
    others = around.changed_cases()
    around = replace(around, parts=bench.solve(others, around.solves[around.level].seconds))
    if told := list(around.below_floor(targets)):
        raise _refusal(case, told)
    if draws_others(case):
        workers = workers if client is None else None
        with local_client(workers) if workers else nullcontext(client) as there:
            population = mean_of_population(case, grids, around, replace(bench, client=there), targets, limit)
        chosen = grids.case(population.level)
        bench.solve({"own": chosen})
        _keep(chosen, bench.folder, folder, same_bits)
        budgets = {one.name: population.budget(one, chosen) for one in quantities}
        return Choice(
            chosen, result_path(folder, chosen.key), tuple(_reasons(grids, population, targets, limit)), budgets
        )

    while True:
        tell(f"{grids.words(around.level)}: {_words(around, targets)}")
        told, wait = list(around.missed(targets)), around.seconds_of_next(0)
        if targets and not told:
            break
        if around.level == _FINEST + 1:
            told = list(around.if_next_were_the_same().missed(targets))
        if told and around.level <= _FINEST + 1:
            raise _refusal(case, told)
        if around.level == _FINEST:
            break
        if around.spent + wait > limit:
            if targets:
                raise _refusal(case, [_short_of_time(around, targets, limit, wait)])
            break
        around = around.finer(bench, grids)

    chosen = grids.case(around.level)
    _keep(chosen, bench.folder, folder, same_bits)
    reasons = tuple(_reasons(grids, around, targets, limit))
    budgets = {one.name: around.budget(one, chosen) for one in quantities}
    return Choice(chosen, result_path(folder, chosen.key), reasons, budgets)


def _keep(case: Case, found: Path, folder: Path, same_bits: bool) -> None:
    """Bring the result of a case from the folder of the solves to that of the results."""
    path = result_path(folder, case.key)
    if not is_result_of(case, path, same_bits):
        with atomic_write(path) as temporary:
            shutil.copyfile(result_path(found, case.key), temporary)


def _refusal(case: Case, problems: Sequence[str]) -> InputError:
    where = f"{case.origin}: " if case.origin else ""
    return InputError("\n".join(f"{where}want.{one}" for one in problems))


def first_grids(case: Case, bench: Bench, targets: Mapping[str, float], limit: float) -> tuple[Grids, Around]:
    """The grids of a case with the tolerance that it takes, and the solves of the first level that may be chosen.

    Raises
    ------
    InputError
        If they and what else is judged by them take longer than the limit. [s]
    """
    tolerance, least = (factor * tolerance_for(case, targets) for factor in (1.0, _LEAST))
    while True:
        grids = grids_of(case, bench.quantities, tolerance)
        held = grids.case(grids.held)
        known = known_errors(case, dict.fromkeys(KNOWN))
        if draws_others(case):  # in place of the scatter of a few
            known["population"] = "patch"
        asked = Asked(Variants(held, held.height()), False, **known)
        around = Around(grids.held + 3, grids.held, {}, {}, asked, bench.quantities).finer(bench, grids)
        while around.level > around.held:
            wait = around.seconds_of_next(len(around.changed_cases()))
            if around.spent + wait > limit:
                raise _refusal(case, [_short_of_time(around, targets, limit, wait)])
            around = around.finer(bench, grids)
        stated = around.solves[around.level].stated
        left = max((_largest(stated[name]) / math.log1p(part) for name, part in targets.items()), default=0.0)
        if left <= 0.5 or tolerance <= least:
            return grids, around
        tolerance = float(f"{max(tolerance * _TOLERANCE / left, least):.2g}")  # steps and solver take too much


@dataclass(frozen=True)
class Around:
    """The solves around a level, from which its error is put together.

    Attributes
    ----------
    level, held : int
        Of the grid that gives the value, and of the coarsest that holds the waves of the surface.
    solves : dict
        Level -> solve, of all grids down to this one.
    parts : dict
        Name -> solve with one thing changed, on the grid of ``held`` or the next coarser one; none before it is known.
    asked : Asked
        What is known beside the case, which is that on the grid of ``held``.
    quantities : sequence of Observable
        Those that are wanted.
    """

    level: int
    held: int
    solves: dict[int, Solve]
    parts: Mapping[str, Solve]
    asked: Asked
    quantities: Sequence[Observable]

    def changed_cases(self) -> dict[str, Case]:
        """Name -> case with one thing changed, which the sources need beside the grids."""
        grids = ("own", "coarse", "coarsest")
        return {name: one for name, one in self.asked.solves().items() if name not in grids}

    def finer(self, bench: Bench, grids: Grids) -> Around:
        """The same around the next grid."""
        level = self.level - 1
        wait = _DEARER * self.solves[self.level].seconds if self.solves else 0.0
        return replace(self, level=level, solves=self.solves | bench.solve({level: grids.case(level)}, wait))

    @property
    def spent(self) -> float:
        """Wall time of all solves. [s]"""
        return sum(one.seconds for one in (*self.solves.values(), *self.parts.values()))

    def seconds_of_next(self, parts: int) -> float:
        """Expected wall time of the next grid, and of so many changed cases where they are made on it. [s]"""
        last = self.solves[self.level].seconds
        before = self.solves.get(self.level + 1)
        wait = last * (_DEARER if before is None else max(_DEARER, last / before.seconds))
        return wait * (1 + parts) if self.level == self.held + 1 else wait

    def if_next_were_the_same(self) -> Around:
        """What it would be around the next grid if that changed nothing: the least error that it may have."""
        finer = self.level - 1
        return replace(self, level=finer, solves={**self.solves, finer: self.solves[self.level]})

    def places(self) -> Array:
        """Places of the rows that are judged: all where their times are stated, else the corners of the program.

        Of another experiment over time, those that all solves have.
        """
        case, own = self.asked.variants.case, self.solves[self.level].places
        if isinstance(case.settings.keep.times, tuple) or not has_steps(case):
            return own
        program = case.settings.program
        others = (*self.solves.values(), *self.parts.values())
        wanted = [one.places for one in others] if program is None else [np.array(case.program().corners)]
        apart = [np.abs(one[:, None] - own).min(axis=0) for one in wanted]
        return own[np.max(apart, axis=0) <= 1e-9 * np.ptp(own)]

    def values(self, quantity: Observable) -> dict[str, Array]:
        """Values as the sources take them around the level; what a changed solve changed is carried over to it."""
        places = self.places()
        grids = {level: one.at(places).values[quantity.name] for level, one in self.solves.items()}
        found = {"own": grids[self.level + 1], "coarse": grids[self.level + 2], "fine": grids[self.level]}
        compared = self.asked.compared
        origin = {"smooth": "fine", "mirrored": "own", "stiffer": compared, "slower": compared}
        for name, one in self.parts.items():
            value = one.at(places).values[quantity.name]
            if name in origin:
                on = grids[self.held + (1 if origin[name] == "coarse" else 0)]
                with np.errstate(divide="ignore", invalid="ignore"):
                    value = found[origin[name]] * (value / on)
            found[name] = value
        return found

    def judged(self, quantity: Observable) -> dict[str, Found]:
        """Name -> what each source makes of a quantity on this level."""
        stated = self.solves[self.level].at(self.places()).stated[quantity.name]
        values, asked = self.values(quantity), replace(self.asked, sharp=True)
        found = {source.name: source.judge(asked, quantity, values, stated) for source in SOURCES}
        grid = replace(found["grid"], method="cells twice and four times as long", solves=("coarser grids",))
        return found | {"grid": grid}

    def error(self, quantity: Observable, names: Sequence[str] | None = None) -> float:
        """The largest error of a quantity that some sources give together, of its logarithm; of all where None.

        Rows in which nothing touches are not judged; it is infinite where another has no logarithm.
        """
        there = self.solves[self.level].at(self.places()).touches
        judged = [one for name, one in self.judged(quantity).items() if names is None or name in names]
        if not there.any():
            return math.inf
        both = np.array([together(judged, there.shape, side)[there] for side in (-1, 1)])
        return math.inf if np.isnan(both).any() else float(both.max())

    def floor(self, quantity: Observable) -> float:
        """What neither grid nor tolerance lessens of the error of a quantity."""
        return self.error(quantity, FLOOR)

    def below_floor(self, targets: Mapping[str, float]) -> Iterator[str]:
        """What to tell of each target that no grid can meet: the sources to blame, and what would help."""
        return self._told(targets, FLOOR, "whatever the grid")

    def missed(self, targets: Mapping[str, float]) -> Iterator[str]:
        """The same of each target that is not met on this level."""
        return self._told(targets, tuple(source.name for source in SOURCES), f"with cells {cells_in_words(self.level)}")

    def _told(self, targets: Mapping[str, float], sources: Sequence[str], where: str) -> Iterator[str]:
        for one in self.quantities:
            error, wanted = self.error(one, sources), math.log1p(targets.get(one.name, math.inf))
            if error <= wanted:
                continue
            if math.isinf(error):
                values = self.values(one)
                bad = ~np.all([values[name] > 0 for name in ("fine", "own", "coarse")], axis=0)
                bad &= self.solves[self.level].at(self.places()).touches
                place = AXES[self.asked.variants.case.experiment().axis].place(float(self.places()[bad.argmax()]))
                yield f"{one.name}: found zero, or less, at {place}: a part of it is no error: expected another number"
                continue
            lines = [f"{one.name}: found {_percent(wanted)}: its error is {_percent(error)} at least, {where}"]
            for name, found in self.judged(one).items():
                part = self.error(one, [name]) if name in sources else 0.0
                if found.half_width is None:
                    lines.append(f"  {name}: open, and not counted: {found.method}")
                elif part > 0.1 * wanted:
                    others = math.sqrt(max(error**2 - part**2, 0.0))
                    room = math.sqrt(wanted**2 - others**2) if others < 0.9 * wanted else wanted * part / error
                    lines.append(f"  {name}: {_percent(part)}{self._help(name, part, room)}")
            yield "\n".join(lines)

    def _help(self, name: str, part: float, room: float) -> str:
        """What would make an error so small."""
        if part <= room:
            return ""
        asked = self.asked
        if name == "sample":
            return f"; {math.ceil((part / room) ** 2)} scans would help"
        if name == "next octave of waves" and asked.cutoff:
            wave = asked.cutoff * 2 ** (asked.octaves * room / part)
            return f"; a scan that holds waves of {unit_for(wave, 'm').text(wave, 2)} would help"
        known = {"modulus": asked.modulus_error, "time scale": asked.time_scale_error}
        if error := known.get(name):
            better = math.expm1(math.log1p(error) * room / part)
            what = "moduli" if name == "modulus" else "times of the material"
            return f"; {what} known to {_percent(better)} would help (a DMA table)"
        if name == "window":
            return "; mirror = true in place of the taper would help"
        return ""

    def budget(self, quantity: Observable, chosen: Case) -> xr.Dataset:
        """The budget of a quantity on this level."""
        seconds = {name: one.seconds for name, one in self.parts.items()}
        seconds["coarser grids"] = sum(one.seconds for level, one in self.solves.items() if level != self.level)
        asked = replace(self.asked, variants=Variants(chosen, self.asked.variants.height))
        value = self.values(quantity)["fine"]
        return assembled(
            asked, quantity, self.judged(quantity), value, self.places(), seconds, self.solves[self.level].seconds
        )


def draws_others(case: Case) -> bool:
    """Whether the number of a case is that of all surfaces of its recipe, of which as many are drawn as it takes."""
    surface, want = case.settings.surface, case.settings.want
    of_a_recipe = hasattr(surface, "seed") and surface.second is None and surface.realisation is None
    return of_a_recipe and want is not None and want.population == "ensemble"


@dataclass(frozen=True)
class OfPopulation:
    """The number of all surfaces of a recipe, with its error.

    Attributes
    ----------
    around : Around
        Of the surface of the case itself, on the coarsest grid that holds its waves: for the floor.
    levels : dict
        Level -> draws of all grids down to the finest.
    targets : dict
        Name of each quantity -> error of its logarithm that was aimed at.
    """

    around: Around
    levels: dict[int, Level]
    targets: Mapping[str, float]

    @property
    def level(self) -> int:
        """The finest."""
        return min(self.levels)

    @property
    def quantities(self) -> Sequence[Observable]:
        """Those that are wanted."""
        return self.around.quantities

    @property
    def spent(self) -> float:
        """Wall time of all solves. [s]"""
        return self.around.spent + sum(one.seconds for one in self.levels.values())

    def seconds_of_next(self, parts: int) -> float:
        """Expected wall time of a pilot on the next grid. [s]"""
        return PILOT * _DEARER * self.levels[self.level].cost

    def grid(self, quantity: Observable) -> Array:
        """Error of the grid, by the means over the draws, as of three grids of one surface."""
        last, before = (np.abs(self.levels[self.level + n].mean(quantity.name)) for n in (0, 1))
        return np.asarray(quantity.grid_factor * np.maximum(last, before / 4))

    def judged(self, quantity: Observable) -> dict[str, Found]:
        """Name -> what each source makes of the quantity."""
        found = self.around.judged(quantity)
        half, _ = scatter_of(self.levels, quantity.name)
        nothing = np.zeros_like(half)
        return found | {
            "grid": Found(self.grid(quantity), "means of the draws with cells twice and four times as long"),
            "sample": Found(half, self.draws(), solves=("draws",)),
            "longest waves": Found(nothing, "the number is that of surfaces of this size", counts=False),
        }

    def draws(self) -> str:
        """How many draws on which grids."""
        shape = self.around.asked.variants.shape
        cells = {level: [round(n * 2.0 ** (self.around.held - level)) for n in shape] for level in self.levels}
        counts = (f"{one.count} on {cells[level][0]} x {cells[level][1]} cells" for level, one in self.levels.items())
        return f"draws: {', '.join(counts)}"

    def error(self, quantity: Observable, names: Sequence[str] | None = None) -> float:
        """The largest error that some sources give together, of the logarithm; of all where None."""
        judged = [one for name, one in self.judged(quantity).items() if names is None or name in names]
        shape = self.grid(quantity).shape
        return float(max(together(judged, shape, side).max() for side in (-1, 1)))

    def floor(self, quantity: Observable) -> float:
        """What neither grids nor draws lessen."""
        return self.around.floor(quantity)

    def rooms(self) -> dict[str, Array]:
        """Name of each quantity -> what all else leaves of the square of its target for the draws."""
        found = {}
        for one in self.quantities:
            others = self.around.error(one, (*FLOOR, "time steps and solver"))
            found[one.name] = self.targets[one.name] ** 2 - others**2 - self.grid(one) ** 2
        return found

    def budget(self, quantity: Observable, chosen: Case) -> xr.Dataset:
        """The budget of a quantity, whose value is the mean of the logarithm over all surfaces."""
        seconds = {name: one.seconds for name, one in self.around.parts.items()}
        seconds["draws"] = sum(one.seconds for one in self.levels.values())
        asked = replace(self.around.asked, variants=Variants(chosen, self.around.asked.variants.height))
        asked = replace(asked, population="ensemble")
        value = np.exp(mean_of(self.levels, quantity.name))
        cost = self.levels[self.level].cost
        return assembled(asked, quantity, self.judged(quantity), value, self.around.places(), seconds, cost)


def mean_of_population(
    case: Case, grids: Grids, around: Around, bench: Bench, targets: Mapping[str, float], limit: float
) -> OfPopulation:
    """Draws on grids, from a pilot on three of them to as many and as fine as it takes for the targets, or in a time.

    Raises
    ------
    InputError
        If a target takes a finer grid than there is, too many draws, or more than the time.
    """
    top = around.held + 2
    counts = dict.fromkeys(range(top, around.held - 1, -1), PILOT)
    goals = {one.name: math.log1p(targets.get(one.name, _FIRST_GOAL)) for one in around.quantities}
    best: OfPopulation | None = None
    on_level = cache(grids.case)

    def drawn(counts: Mapping[int, int]) -> OfPopulation:
        levels = {
            level: draw(
                level,
                count,
                on_level(level),
                on_level(level + 1) if level < top else None,
                around.quantities,
                around.places(),
                bench.folder,
                bench.client,
                bench.threads,
            )
            for level, count in counts.items()
        }
        return OfPopulation(around, levels, goals)

    pilot = around.spent * PILOT
    if around.spent + pilot > limit:
        raise _refusal(case, [f"time: found {limit:g} s: expected some {pilot:.2g} s at least, for a pilot of draws"])
    while True:
        found = drawn(counts)
        rooms = found.rooms()
        refine = any((rooms[name] < 0.5 * goals[name] ** 2).any() for name in goals) and found.level > _FINEST
        short = any((rooms[name] <= 0.05 * goals[name] ** 2).any() for name in goals)
        more = dict(counts)
        if refine:
            more[found.level - 1] = PILOT
            wait = found.seconds_of_next(0)
        elif not short:
            more = counts_for(found.levels, {name: np.sqrt(room) for name, room in rooms.items()})
            wait = sum((more[level] - counts[level]) * one.cost for level, one in found.levels.items())
        bench.tell(f"{found.draws()}: {_words(found, targets)}")
        if short and not refine:
            if not targets and best is not None:
                return best
            raise _refusal(
                case, [f"{_words(found, targets)}: the grids alone leave too much, with the finest there is"]
            )
        if more == counts:
            if targets:
                return found
            best, goals = found, {name: 0.7 * goal for name, goal in goals.items()}
            continue
        if found.spent + wait > limit or sum(more.values()) > MOST:
            if not targets and best is not None:
                return best
            limits = f"{limit:g} s" if math.isfinite(limit) else f"{MOST} draws"
            needed = f"{sum(more.values())} draws and some {found.spent + wait:.2g} s at least"
            raise _refusal(
                case, [f"population: found a limit of {limits}: expected {needed}; so far {_words(found, targets)}"]
            )
        counts = more


def _reasons(grids: Grids, around: Around | OfPopulation, targets: Mapping[str, float], limit: float) -> Iterator[str]:
    """What was chosen, and why."""
    yield f"grid: {grids.words(around.level)}"
    if isinstance(around, OfPopulation):
        yield around.draws()
    for one in around.quantities:
        parts = f"{_percent(around.error(one, _RULED))} by grid and solver, {_percent(around.floor(one))} by all else"
        if isinstance(around, OfPopulation):
            parts += f", {_percent(around.error(one, ['sample']))} by the draws"
        yield f"{_words(around, targets, [one])}: {parts}"
    tolerance = grids.variants.case.settings.solve.tolerance
    least = _TOLERANCE * min(targets.values(), default=0.0)
    why = {
        tolerance > least: "that of the study",
        tolerance < least: "since steps and solver take more of some numbers",
        math.isclose(tolerance, least, rel_tol=0.1): "a fifth of what is wanted",
        tolerance == grids.own.settings.solve.tolerance: "that of the study",
        tolerance == _AMPLE: "ample for what is wanted",
    }
    yield f"tolerance: {format_tolerance(tolerance)}, {why[True]}"
    if math.isfinite(limit):
        more = around.seconds_of_next(0)
        yield f"time: {around.spent:.2g} s of {limit:g} s; the next grid would take some {more:.2g} s"
    judged = around.judged(around.quantities[0])
    if unknown := [name for name, one in judged.items() if one.half_width is None]:
        yield f"open, and not counted: {', '.join(unknown)}"


def _words(
    found: Around | OfPopulation, targets: Mapping[str, float], quantities: Sequence[Observable] | None = None
) -> str:
    """The error of quantities as far as it was found, all of them where None, and what is wanted."""
    told = []
    for one in found.quantities if quantities is None else quantities:
        wanted = f", wanted {_percent(math.log1p(targets[one.name]))}" if one.name in targets else ""
        told.append(f"{one.name} {_percent(found.error(one))}{wanted}")
    return "; ".join(told)


def _short_of_time(around: Around, targets: Mapping[str, float], limit: float, wait: float) -> str:
    needed = f"time: found {limit:g} s: expected some {around.spent + wait:.2g} s at least"
    if around.level > around.held:
        return f"{needed}, for the coarsest grid that holds the waves of the surface and what its error is judged by"
    return f"{needed}, for the next grid; so far {_words(around, targets)}"


def _percent(half: float) -> str:
    """A half-width of a logarithm in %, or as a factor where it is large."""
    return f"a factor of {math.exp(half):.2g}" if half > 0.5 else f"±{100 * math.expm1(half):.2g} %"


def _largest(half_widths: Array) -> float:
    finite = half_widths[np.isfinite(half_widths)]
    return float(finite.max()) if finite.size else 0.0
