r"""The number of all surfaces of a recipe: multilevel Monte Carlo over draws and grids.

Many draws are computed on a coarse grid, and few on finer ones, each of these together with the next coarser grid, on
which the same draw has the same waves: the mean of the logarithm is :math:`\sum_l \overline{Y_l}`, with
:math:`Y_l = \ln Q_l - \ln Q_{l-1}` of draws that no other level has. With the variances :math:`V_l` and the costs
:math:`C_l` of a draw, the cheapest numbers of draws for a half-width :math:`\epsilon` at 95 % are

.. math:: N_l = \frac{t^2}{\epsilon^2} \sqrt{V_l / C_l} \sum_k \sqrt{V_k C_k}.

References
----------
.. [1] M. B. Giles, Oper. Res. 56 (2008) 607.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats

from roughvisc.errors import InputError
from roughvisc.study.budget.budget import assembled
from roughvisc.study.budget.grids import DEARER, FINEST, FLOOR, Around, errors_in_words, largest_error, refusal
from roughvisc.study.budget.solves import Array, nearest_rows
from roughvisc.study.budget.sources import Found
from roughvisc.study.execution.run import compute
from roughvisc.study.quantities import QUANTITIES, Observable
from roughvisc.study.statement.case import Case
from roughvisc.study.storage.store import write_dataset

#: Draws of a level before their variance is believed.
PILOT = 20
#: Draws of all levels, beyond which a target is refused.
MOST = 10_000
#: Seeds of a level, none of which another has.
_SEEDS = 1_000_000
#: Error at which the search for the best in a time begins.
_FIRST_GOAL = 0.3


@dataclass(frozen=True)
class Level:
    """The draws of one grid, and what they give of the mean of a logarithm.

    Attributes
    ----------
    differences : dict
        Name of each quantity -> its logarithm less that on the next coarser grid, over draws and rows; on the coarsest
        grid of all the logarithm itself.
    seconds : float
        Wall time of all draws. [s]
    """

    differences: Mapping[str, Array]
    seconds: float

    @property
    def count(self) -> int:
        """Number of draws."""
        return len(next(iter(self.differences.values())))

    @property
    def cost(self) -> float:
        """Wall time of a draw. [s]"""
        return self.seconds / self.count

    def mean(self, name: str) -> Array:
        """Mean over the draws, at each row."""
        return np.asarray(self.differences[name].mean(axis=0))

    def variance(self, name: str) -> Array:
        """Variance over the draws, at each row."""
        return np.asarray(self.differences[name].var(axis=0, ddof=1))


def mean_of(levels: Mapping[int, Level], name: str) -> Array:
    """Mean of the logarithm of a quantity on the finest grid."""
    return np.asarray(sum(one.mean(name) for one in levels.values()))


def scatter_of(levels: Mapping[int, Level], name: str) -> tuple[Array, Array]:
    """Half-width of that mean at 95 %, by Student's distribution, and the quantile that it takes."""
    parts = np.array([one.variance(name) / one.count for one in levels.values()])
    free = np.array([one.count - 1.0 for one in levels.values()])[:, None]
    total = parts.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        freedom = np.where(total > 0, total**2 / (parts**2 / free).sum(axis=0), 1e6)
    quantile = np.asarray(stats.t.ppf(0.975, freedom))
    return quantile * np.sqrt(total), quantile


def counts_for(levels: Mapping[int, Level], rooms: Mapping[str, Array]) -> dict[int, int]:
    """Level -> number of draws, at least those that it has, so that the half-width of each quantity fits its room."""
    wanted = {level: float(one.count) for level, one in levels.items()}
    for name, room in rooms.items():
        _, quantile = scatter_of(levels, name)
        work = sum(np.sqrt(one.variance(name) * one.cost) for one in levels.values())
        for level, one in levels.items():
            needed = float(((quantile / room) ** 2 * np.sqrt(one.variance(name) / one.cost) * work).max())
            if needed > one.count:  # a little more, since the variances change with the draws
                wanted[level] = max(wanted[level], 1.05 * needed)
    return {level: math.ceil(one) for level, one in wanted.items()}


def draw(around: Around, level: int, count: int, fine: Case, coarse: Case | None) -> Level:
    """So many draws of a level; those that are kept in the folder of the solves are not computed again.

    Parameters
    ----------
    around : Around
        What is read off each draw, at which places of the axis, and where it is computed: without a client in this
        process.
    level, count : int
        Of the grid, and number of draws.
    fine, coarse : Case
        Of the grid and of the next coarser one, None where there is none; the seed is another in each draw.

    Raises
    ------
    InputError
        If a quantity is zero in a draw, and has no logarithm.
    """
    bench, places = around.bench, around.places()
    names = [one.name for one in bench.quantities]
    path = bench.folder / f"draws-{fine.key}-{'single' if coarse is None else coarse.key}.nc"
    kept = _kept(path, names, places)
    known = 0 if kept is None else kept.sizes["draw"]
    if known < count:
        first = _SEEDS * (1 + abs(fine.settings.surface.seed) * 16 + level + 8)
        stated = [json.loads(one.to_json()) for one in (fine, coarse) if one is not None]
        seeds = range(first + known, first + count)
        texts = [[json.dumps(one | {"surface": one["surface"] | {"seed": seed}}) for one in stated] for seed in seeds]
        if bench.client is None:
            found = [_values(text, names, places, bench.threads) for text in texts]
        else:
            solves = bench.client.map(_values, texts, names=names, places=places, threads=1, pure=False)
            found = bench.client.gather(solves)
        new = xr.Dataset(
            {
                **{name: (("draw", "grid", "row"), np.array([values[name] for values, _ in found])) for name in names},
                "seconds": ("draw", [seconds for _, seconds in found]),
                "places": ("row", places),
            }
        )
        kept = new if kept is None else xr.concat([kept, new], "draw", data_vars="minimal")
        write_dataset(kept, path)
    assert kept is not None
    kept = kept.isel(draw=slice(count))
    differences = {}
    for name in names:
        values = kept[name].values
        if bad := int((~(values > 0)).any(axis=(1, 2)).sum()):
            told = f"{name}: found zero, or less, in {bad} of {count} draws: how often it is zero is to be asked"
            raise InputError(f"{told}, and not how large it is")
        logs = np.log(values)
        differences[name] = logs[:, 0] - logs[:, 1] if coarse is not None else logs[:, 0]
    return Level(differences, float(kept["seconds"].sum()))


def _kept(path: Path, names: Sequence[str], places: Array) -> xr.Dataset | None:
    """The draws in a file, if they are of these quantities and places."""
    if not path.exists():
        return None
    with xr.open_dataset(path, engine="netcdf4", decode_timedelta=False) as file:
        kept = file.load()
    there = set(names) <= set(kept) and kept.sizes["row"] == len(places) and np.allclose(kept["places"], places)
    return kept[[*names, "seconds", "places"]] if there else None


def _values(
    texts: Sequence[str], names: Sequence[str], places: Array, threads: int | None = None
) -> tuple[dict[str, list[Any]], float]:
    """Values of the quantities on each grid of a draw, at these places, and the wall time of their solves. [s]"""
    values: dict[str, list[Any]] = {name: [] for name in names}
    seconds = 0.0
    for text in texts:
        case = Case.from_json(text)
        found = compute(case, progress=False, threads=threads)
        rows = nearest_rows(found[case.experiment().axis], places)
        for name in names:
            values[name].append(QUANTITIES[name].of(found, case)[rows])
        seconds += float(found["wall_time"].values[-1])
    return values, seconds


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

    def seconds_of_next(self) -> float:
        """Expected wall time of a pilot on the next grid. [s]"""
        return PILOT * DEARER * self.levels[self.level].cost

    def grid(self, quantity: Observable) -> Array:
        """Error of the grid, by the means over the draws, as of three grids of one surface."""
        last, before = (np.abs(self.levels[self.level + n].mean(quantity.name)) for n in (0, 1))
        return np.asarray(quantity.grid_factor * np.maximum(last, before / 4))

    def judged(self, quantity: Observable) -> dict[str, Found]:
        """Name -> what each source makes of the quantity."""
        half, _ = scatter_of(self.levels, quantity.name)
        return self.around.judged(quantity) | {
            "grid": Found(self.grid(quantity), "means of the draws with cells twice and four times as long"),
            "sample": Found(half, self.draws(), solves=("draws",)),
            "longest waves": Found(0.0, "the number is that of surfaces of this size", counts=False),
        }

    def draws(self) -> str:
        """How many draws on which grids."""
        shape, held = self.around.asked.variants.shape, self.around.grids.held
        cells = {level: [round(n * 2.0 ** (held - level)) for n in shape] for level in self.levels}
        counts = (f"{one.count} on {cells[level][0]} x {cells[level][1]} cells" for level, one in self.levels.items())
        return f"draws: {', '.join(counts)}"

    def error(self, quantity: Observable, names: Sequence[str] | None = None) -> float:
        """The largest error of the logarithm that some sources give together; of all where None."""
        return largest_error(self.judged(quantity), self.around.touches, names)

    def errors(self) -> dict[str, float]:
        """Name of each quantity -> its whole error."""
        return {one.name: self.error(one) for one in self.quantities}

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
        seconds["own"] = self.levels[self.level].cost
        seconds["draws"] = sum(one.seconds for one in self.levels.values())
        value, places = np.exp(mean_of(self.levels, quantity.name)), self.around.places()
        return assembled(chosen, "ensemble", quantity, self.judged(quantity), value, places, seconds)


def mean_of_population(around: Around, targets: Mapping[str, float], limit: float) -> OfPopulation:
    """Draws on grids, from a pilot on three of them to as many and as fine as it takes for the targets, or in a time.

    Raises
    ------
    InputError
        If a target takes a finer grid than there is, too many draws, or more than the time.
    """
    grids = around.grids
    top = grids.held + 2
    counts = dict.fromkeys(range(top, grids.held - 1, -1), PILOT)
    goals = {one.name: math.log1p(targets.get(one.name, _FIRST_GOAL)) for one in around.quantities}
    best: OfPopulation | None = None
    on_level = cache(grids.case)

    def drawn(level: int, count: int) -> Level:
        return draw(around, level, count, on_level(level), on_level(level + 1) if level < top else None)

    pilot = around.spent * PILOT
    if around.spent + pilot > limit:
        needed = f"expected some {pilot:.2g} s at least, for a pilot of draws"
        raise refusal(grids.own, [f"time: found {limit:g} s: {needed}"])
    while True:
        found = OfPopulation(around, {level: drawn(level, count) for level, count in counts.items()}, goals)
        rooms = found.rooms()
        told = errors_in_words(found.errors(), targets)
        around.bench.tell(f"{found.draws()}: {told}")
        more = dict(counts)
        if any((rooms[name] < 0.5 * goals[name] ** 2).any() for name in goals) and found.level > FINEST:
            more[found.level - 1] = PILOT
            wait = found.seconds_of_next()
        elif any((rooms[name] <= 0.05 * goals[name] ** 2).any() for name in goals):
            if not targets and best is not None:
                return best
            raise refusal(grids.own, [f"{told}: the grids alone leave too much, with the finest there is"])
        else:
            more = counts_for(found.levels, {name: np.sqrt(room) for name, room in rooms.items()})
            wait = sum((more[level] - counts[level]) * one.cost for level, one in found.levels.items())
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
            raise refusal(grids.own, [f"population: found a limit of {limits}: expected {needed}; so far {told}"])
        counts = more
