"""Grids among which one is chosen for a target, and the error of a number on one of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.settings import Settings
from roughvisc.study.budget.budget import assembled
from roughvisc.study.budget.solves import Array, Bench, Reading
from roughvisc.study.budget.sources import SOURCES, Asked, Found, judge, together
from roughvisc.study.budget.variants import Variants, with_rows
from roughvisc.study.case import Case, vary
from roughvisc.study.quantities import Observable
from roughvisc.study.trade.ladder import has_steps
from roughvisc.topography.grid import spacing
from roughvisc.variables import AXES

#: The tolerance over the target: steps and solver then count for little beside all else.
FIFTH = 0.2
#: Tolerances that are chosen; the larger is ample for a number that is known to some per cent.
_SHARPEST, AMPLE = 1e-8, 1e-2
#: The sharpest tolerance over that, where steps and solver count for more than they should.
_LEAST = 0.03
#: Level of the finest grid: its cells are ``2**level`` times as long as those of the study.
FINEST = -2
#: Fewest cells a side of the coarsest grid, where that is coarser than a quarter of the study's.
_FEWEST = 12
#: Cost of a grid over that of one with cells twice as long.
_DEARER = 4.0
#: An error counts as met up to the rounding of what is printed of it.
_ROUNDING = 1.005
#: Sources that grid and tolerance rule; all others are the floor.
RULED = ("time steps and solver", "grid")
FLOOR = tuple(name for name in SOURCES if name not in RULED)


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
        if base.settings.tolerance != own.settings.tolerance:
            changes["solve.tolerance"] = base.settings.tolerance
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
    fields = [*case.settings.fields, *(field for one in quantities for field in one.fields)]
    base = vary(with_rows(case, None, fields), {"solve.tolerance": tolerance})
    return Grids(case, Variants(base, base.height()))


def tolerance_for(case: Case, targets: Mapping[str, float]) -> float:
    """Return a fifth of the smallest target; a study that is sharper than usual keeps its own tolerance."""
    own = case.settings.tolerance
    chosen = min(max(FIFTH * min(targets.values()), _SHARPEST), AMPLE)
    return float(f"{min(chosen, own) if own < Settings.tolerance else chosen:.2g}")


def first_grids(case: Case, known: Mapping[str, Any], bench: Bench, targets: Mapping[str, float]) -> Around:
    """Return the solves around the first level that may be chosen, with the tolerance that they take."""
    tolerance = tolerance_for(case, targets)
    least = _LEAST * tolerance
    while True:
        grids = grids_of(case, bench.quantities, tolerance)
        held = grids.case(grids.held)
        around = Around(bench, grids, Asked(Variants(held, held.height()), **known), grids.held + 3).finer()
        while around.level > grids.held:
            around = around.finer()
        stated = around.solves[around.level].stated
        left = max(_largest(stated[name]) / math.log1p(part) for name, part in targets.items())
        if left <= 0.5 or tolerance <= least:
            return around
        tolerance = float(f"{max(tolerance * FIFTH / left, least):.2g}")  # steps and solver take too much


def _largest(half_widths: Array) -> float:
    finite = half_widths[np.isfinite(half_widths)]
    return float(finite.max()) if finite.size else 0.0


@dataclass(frozen=True)
class Around:
    """The solves around a level, from which its error is put together.

    Attributes
    ----------
    bench : Bench
        Where they are made, and which quantities are read off them.
    grids : Grids
    asked : Asked
        What is known beside the case, which is that on the coarsest grid that holds the waves of the surface.
    level : int
        Of the grid that gives the value.
    solves : dict
        Level -> what is read off the solve, of all grids down to this one.
    parts : dict
        Name -> the same with one thing changed, on that coarsest grid or the next coarser one; none before it is known.
    """

    bench: Bench
    grids: Grids
    asked: Asked
    level: int
    solves: Mapping[int, Reading] = field(default_factory=dict)
    parts: Mapping[str, Reading] = field(default_factory=dict)

    @property
    def quantities(self) -> Sequence[Observable]:
        """Those that are wanted."""
        return self.bench.quantities

    def changed_cases(self) -> dict[str, Case]:
        """Name -> case with one thing changed, which the sources need beside the grids."""
        grids = ("own", "coarse", "coarsest")
        return {name: one for name, one in self.asked.solves().items() if name not in grids}

    def with_changed_cases(self) -> Around:
        """The same with what is read off these."""
        return replace(self, parts=self.bench.solve(self.changed_cases(), self.solves[self.level].seconds))

    def finer(self) -> Around:
        """The same around the next grid."""
        level = self.level - 1
        wait = _DEARER * self.solves[self.level].seconds if self.solves else 0.0
        found = self.bench.solve({level: self.grids.case(level)}, wait)
        return replace(self, level=level, solves={**self.solves, **found})

    def if_next_were_the_same(self) -> Around:
        """What it would be around the next grid if that changed nothing: the least error that it may have."""
        finer = self.level - 1
        return replace(self, level=finer, solves={**self.solves, finer: self.solves[self.level]})

    def places(self) -> Array:
        """Places of the rows that are judged: all where their times are stated, else the corners of the program.

        Of another experiment over time, those that all solves have.
        """
        case, own = self.asked.variants.case, self.solves[self.level].places
        if isinstance(case.settings.times, tuple) or not has_steps(case):
            return own
        others = (*self.solves.values(), *self.parts.values())
        wanted = [np.array(case.program().corners)] if "program" in case.tables else [one.places for one in others]
        apart = [np.abs(one[:, None] - own).min(axis=0) for one in wanted]
        return own[np.max(apart, axis=0) <= 1e-9 * np.ptp(own)]

    @property
    def touches(self) -> NDArray[np.bool_]:
        """Whether there is a force at each of these places."""
        return self.solves[self.level].at(self.places()).touches

    def values(self, quantity: Observable) -> dict[str, Array]:
        """Values as the sources take them around the level; what a changed solve changed is carried over to it."""
        places = self.places()
        grids = {level: one.at(places).values[quantity.name] for level, one in self.solves.items()}
        found = {name: grids[self.level + more] for more, name in enumerate(("own", "coarse", "coarsest"))}
        origin = {"smooth": "own", "stiffer": self.asked.compared, "slower": self.asked.compared}
        for name, one in self.parts.items():
            value = one.at(places).values[quantity.name]
            if name in origin:
                on = grids[self.grids.held + (1 if origin[name] == "coarse" else 0)]
                with np.errstate(divide="ignore", invalid="ignore"):
                    value = found[origin[name]] * (value / on)
            found[name] = value
        return found

    def judged(self, quantity: Observable) -> dict[str, Found]:
        """Name -> what each source makes of a quantity on this level."""
        stated = self.solves[self.level].at(self.places()).stated[quantity.name]
        found = judge(self.asked, quantity, self.values(quantity), stated)
        return found | {"grid": replace(found["grid"], solves=("coarser grids",))}

    def error(self, quantity: Observable, names: Sequence[str] | None = None) -> float:
        """The largest error of the logarithm of a quantity that some sources give together; of all where None."""
        return largest_error(self.judged(quantity), self.touches, names)

    def errors(self) -> dict[str, float]:
        """Name of each quantity -> its whole error."""
        return {one.name: self.error(one) for one in self.quantities}

    def floor(self, quantity: Observable) -> float:
        """Return the part of a quantity's error that neither a finer grid nor a smaller tolerance reduces."""
        return self.error(quantity, FLOOR)

    def missed(self, targets: Mapping[str, float], sources: Sequence[str] | None = None) -> Iterator[str]:
        """Yield a message for each target that is not met, with the sources of its error.

        With `sources`, only these count: an error that no grid reduces.
        """
        where = f"with cells {cells_in_words(self.level)}" if sources is None else "whatever the grid"
        for one in self.quantities:
            error, wanted = self.error(one, sources), math.log1p(targets[one.name])
            if error <= _ROUNDING * wanted:
                continue
            if math.isinf(error):
                values = self.values(one)
                bad = ~np.all([values[name] > 0 for name in ("own", "coarse", "coarsest")], axis=0) & self.touches
                place = AXES[self.grids.own.experiment().axis].place(float(self.places()[bad.argmax()]))
                yield f"{one.name}: found zero, or less, at {place}: a part of it is no error: expected another number"
                continue
            lines = [f"{one.name}: found {percent(wanted)}: its error is {percent(error, 3)} at least, {where}"]
            for name, found in self.judged(one).items():
                part = self.error(one, [name]) if sources is None or name in sources else 0.0
                if found.half_width is None:
                    lines.append(f"  {name}: open, and not counted: {found.method}")
                elif part > 0.1 * wanted:
                    lines.append(f"  {name}: {percent(part)}")
            yield "\n".join(lines)

    def budget(self, quantity: Observable, chosen: Case) -> xr.Dataset:
        """The budget of a quantity on this level."""
        seconds = {name: one.seconds for name, one in self.parts.items()}
        seconds["own"] = self.solves[self.level].seconds
        seconds["coarser grids"] = sum(one.seconds for level, one in self.solves.items() if level != self.level)
        value, population = self.values(quantity)["own"], self.asked.population
        return assembled(chosen, population, quantity, self.judged(quantity), value, self.places(), seconds)


def largest_error(judged: Mapping[str, Found], rows: NDArray[np.bool_], names: Sequence[str] | None) -> float:
    """The largest error that some sources give together in some rows, of a logarithm; of all sources where None.

    It is infinite where there is no row, or where one has no logarithm.
    """
    found = [one for name, one in judged.items() if names is None or name in names]
    if not rows.any():
        return math.inf
    both = np.array([together(found, rows.shape, side)[rows] for side in (-1, 1)])
    return math.inf if np.isnan(both).any() else float(both.max())


def refusal(case: Case, targets: Mapping[str, float], problems: Sequence[str]) -> InputError:
    """Return the error of targets that cannot be met."""
    where, first = f"{case.origin}: " if case.origin else "", problems[0].partition(":")[0]
    return InputError("\n".join(f"{where}{one}" for one in problems), key=first, found=targets[first])


def errors_in_words(errors: Mapping[str, float], targets: Mapping[str, float]) -> str:
    """Errors of quantities as far as they were found, and what is wanted."""
    told = []
    for name, error in errors.items():
        told.append(f"{name} {percent(error)}, wanted {percent(math.log1p(targets[name]))}")
    return "; ".join(told)


def percent(half: float, digits: int = 2) -> str:
    """Return a half-width of a logarithm in %, or as a factor if it is large."""
    return f"a factor of {math.exp(half):.2g}" if half > 0.5 else f"±{100 * math.expm1(half):.{digits}g} %"
