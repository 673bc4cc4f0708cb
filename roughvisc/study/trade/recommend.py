"""Advice of a trade: the cheapest setting that is accurate enough, and the floor that no setting lessens."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.labels import annotate
from roughvisc.study.statement.case import Case
from roughvisc.study.trade.ladder import step_text
from roughvisc.units import quantity as quantity_in
from roughvisc.variables import VARIABLES

#: The accuracies that are advised on unasked.
TARGETS = (1e-2, 1e-3)
#: Wall times within this factor are taken to be the same.
_ALIKE = 1.1
#: Part of what no setting lessens below which an error is not worth paying for.
_OF_FLOOR = 0.2
#: Tables of a study that make the scene, beside that of what is done.
_SCENE = ("surface", "material", "program")
#: What quantities are called in words.
WORDS = {
    name: VARIABLES[name].label.lower()
    for name in (
        "friction_coefficient",
        "contact_area",
        "pressure",
        "approach",
        "contact_area_counted",
        "mean_gap",
        "force",
        "leak_rate",
        "thermal_conductance",
        "incremental_stiffness",
    )
}


def pareto_front(dataset: xr.Dataset, quantity: str) -> NDArray[np.bool_]:
    """The Pareto front: settings that no other one beats in wall time without being beaten in accuracy.

    Errors count to two digits: what differs by less is no gain.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.trade`.
    quantity : str
        Whose error counts.
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
    """How far the reference may be off; where the grid is data, on that grid."""
    parts = ("time",) if dataset.attrs.get("grid_is_data") else ("time", "grid")
    return float(sum(dataset[f"reference_{part}_uncertainty"].sel(quantity=quantity) for part in parts))


def admissible(dataset: xr.Dataset, quantity: str, target: float) -> NDArray[np.bool_]:
    """Settings that keep a relative error, the reference's own uncertainty counted with it.

    A setting counts only if those that differ by nothing but a sharper tolerance or a shorter step keep it too:
    what a loose one gets right by chance is no reason to take it. Where the grid is data, none on another grid counts.
    """
    errors = dataset["error"].sel(quantity=quantity).values
    kept = errors + uncertainty(dataset, quantity) <= target
    missed = np.isfinite(errors) & ~kept
    step = np.nan_to_num(dataset["time_step"].values, nan=0.0)
    same = ("family", "coarsening")
    good = kept.copy()
    for i in np.flatnonzero(kept):
        alike = np.all([dataset[name].values == dataset[name].values[i] for name in same], axis=0)
        sharper = (dataset["tolerance"].values <= dataset["tolerance"].values[i]) & (step <= step[i])
        good[i] = not (alike & sharper & missed).any()
    if dataset.attrs.get("grid_is_data"):
        good &= dataset["coarsening"].values == 1
    return good


def cheapest(dataset: xr.Dataset, quantity: str, target: float) -> int | None:
    """Index of the fastest admissible setting; None if there is none.

    Of those that take hardly longer, which another timing might turn round, it is the first.
    """
    spent = np.where(admissible(dataset, quantity, target), dataset["run_time"].values, np.inf)
    if not np.isfinite(spent).any():
        return None
    return int(np.flatnonzero(spent <= _ALIKE * np.min(spent))[0])


def known_quantity(quantity: str, known: Sequence[str], name: str) -> str:
    """The quantity, if it is one of those that are known by that name, or were before."""
    if quantity not in known:
        raise InputError(f"{name}: found {quantity!r}: expected one of {', '.join(known)}")
    return quantity


def main_quantities(dataset: xr.Dataset) -> list[str]:
    """The quantities of a trade, what matters most first."""
    return [name for name in WORDS if name in dataset["quantity"]]


def recommendation(dataset: xr.Dataset) -> str:
    """Advice in words, a line for each quantity that something is known of."""
    advised = [name for name in main_quantities(dataset) if name != "contact_area_counted"]
    known = [name for name in advised if np.isfinite(dataset["error"].sel(quantity=name)).any()]
    lines = [_advice(dataset, name) for name in known] + list(filter(None, (_floor(dataset, name) for name in known)))
    return "\n".join(lines + ([_of_the_scan(dataset)] if dataset.attrs.get("grid_is_data") else []))


def _floor(dataset: xr.Dataset, quantity: str) -> str:
    """What no setting lessens of a quantity, and the cheapest setting that adds little to it; empty if not known."""
    if "floor" not in dataset or not np.isfinite(floor := float(dataset["floor"].sel(quantity=quantity))):
        return ""
    source, still_open = (str(dataset[name].sel(quantity=quantity).values) for name in ("floor_source", "floor_open"))
    text = f"no setting makes the {WORDS[quantity]} better than {percent(floor)}"
    text += f", most of it by {source}" if source else ""
    text += f" (still open, and not in it: {still_open})" if still_open else ""
    index = cheapest(dataset, quantity, _OF_FLOOR * floor) if floor > 0 else None
    if index is None:
        return text
    spent = duration(float(dataset["run_time"][index]))
    return f"{text}: {dataset['setting'].values[index]} is sharp enough, {spent}"


def _of_the_scan(dataset: xr.Dataset) -> str:
    """What the spacing of the points makes of the quantity that matters most, which no setting mends."""
    name = main_quantities(dataset)[0]
    found = dict(zip(dataset["coarsening"].values, dataset["coarsening_error"].sel(quantity=name).values, strict=True))
    parts = [f"{percent(found[k])} on cells {k:g} times as long" for k in sorted(found) if k > 1 and found[k] > 0]
    unsure = float(dataset["reference_grid_uncertainty"].sel(quantity=name))
    text = "the grid is part of the data"
    if parts:
        text += f": the {WORDS[name]} changes by {' and '.join(parts)}"
    if np.isfinite(unsure):
        text += f"; the spacing of the points leaves about {percent(unsure)} of it unknown"
    return text


def _advice(dataset: xr.Dataset, quantity: str) -> str:
    """``for 1 % on contact area use tolerance = 3e-2: 14 s; for 0.1 %: tolerance = 1e-3: 3 min``."""
    said, last = [], None
    for target in TARGETS:
        index = cheapest(dataset, quantity, target)
        if index is None:
            said.append(f"for {percent(target)}: {shortfall(dataset, quantity, target)}")
            continue
        name, spent = str(dataset["setting"].values[index]), duration(float(dataset["run_time"][index]))
        lead = f"for {percent(target)} on {WORDS[quantity]} use" if not said else f"for {percent(target)}"
        said.append(f"{lead} the same" if index == last else f"{lead} {name}: {spent}")
        last = index
    if last is None or " on " not in said[0]:  # nothing keeps the first target
        said[0] = said[0].replace(":", f" on {WORDS[quantity]}:", 1)
    if last is None and len({text.partition(": ")[2] for text in said}) == 1:
        targets = " or ".join(percent(target) for target in TARGETS)
        return f"for {targets} on {WORDS[quantity]}: {said[0].partition(': ')[2]}"
    return "; ".join(said)


def shortfall(dataset: xr.Dataset, quantity: str, target: float) -> str:
    """Why no setting is accurate enough, in words."""
    unsure = uncertainty(dataset, quantity)
    if not np.isfinite(unsure):
        return "cannot be told, the finest run's own accuracy is not known"
    if unsure >= target:
        return f"not possible, the uncertainty of the finest run is {percent(unsure)}"
    errors = dataset["error"].sel(quantity=quantity).values
    if dataset.attrs.get("grid_is_data"):
        errors = np.where(dataset["coarsening"].values == 1, errors, np.nan)
    if not np.isfinite(errors).any():
        return "cannot be told, no setting was measured"
    best = int(np.nanargmin(errors))
    name = dataset["setting"].values[best]
    return f"no setting measured keeps it, {name} comes nearest with {percent(errors[best] + unsure, 3)}"


def percent(part: float, digits: int = 2) -> str:
    """A part as a percentage.

    Examples
    --------
    >>> percent(0.01), percent(1.234e-3), percent(2e-6)
    ('1 %', '0.12 %', '0.0002 %')
    """
    return f"{100 * float(f'{part:.{digits}g}'):.6f}".rstrip("0").rstrip(".") + " %"


def duration(seconds: float) -> str:
    """A wall time as one says it.

    Examples
    --------
    >>> duration(0.0123), duration(14.2), duration(190), duration(9000)
    ('0.012 s', '14 s', '3 min', '2.5 h')
    """
    if seconds < 90:
        return f"{seconds:.2g} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _step(step: float) -> str | float:
    """A time step with its unit, where that is no other number."""
    text = step_text(step)
    return text if quantity_in(text, "s") == step else step


def keys_of(dataset: xr.Dataset, index: int) -> dict[str, dict[str, Any]]:
    """Tables and keys of a study file that make a setting; None: to be as if it were not there.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.trade`.
    index : int
        Of the setting.
    """
    row = dataset.isel(setting=index)
    step, precision = float(row["time_step"]), float(row["precision"])
    solve: dict[str, Any] = {
        "tolerance": float(row["tolerance"]),
        "time_step": _step(step) if np.isfinite(step) else None,
        "method": None if row["method"] == "fast" else row["method"].item(),
        "memory": None if row["memory"] == "auto" else row["memory"].item(),
    }
    tables: dict[str, dict[str, Any]] = {"solve": solve}
    if float(row["coarsening"]) != 1:
        shape = [int(row["cells_x"]), int(row["cells_y"])]
        tables["surface"] = {"shape": shape if shape[0] != shape[1] else shape[0]}
    if np.isfinite(precision):
        tables["keep"] = {"precision": precision}
    return tables


def require_same(budget: xr.Dataset, case: Case) -> None:
    """Refuse what is no budget, or that of another scene.

    Raises
    ------
    InputError
        If it is.
    """
    if "half_width" not in budget or "source" not in budget.dims or "case" not in budget.attrs:
        raise InputError("floor holds a Dataset that is no budget: expected that of rv.budget, of one quantity")
    made = (*_SCENE, case.experiment().table)
    one, other = (_scene(text, made) for text in (budget.attrs["case"], case.to_json()))
    if tables := [name for name in dict.fromkeys(made) if one[name] != other[name]]:
        name = budget.attrs.get("quantity", "?")
        raise InputError(f"floor: the budget of {name} is of another study: {', '.join(tables)} differ")


def _scene(text: str, made: Sequence[str]) -> dict[str, Any]:
    """Some tables of a case, without what is computed beside the rest."""
    tables = json.loads(text)
    tables.get("friction", {}).pop("last_octave", None)
    return {name: tables.get(name) for name in made}


def with_floors(dataset: xr.Dataset, budgets: Sequence[xr.Dataset]) -> xr.Dataset:
    """A trade with what no setting lessens of its quantities, and the recommendation.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.trade`.
    budgets : sequence of xarray.Dataset
        Of :func:`roughvisc.budget`, of the same study.

    Notes
    -----
    Of a trade the error is the worst of the rows over the largest value; so is the floor, half of the interval at 95 %
    that all sources make but time steps and solver and, where a finer grid has the same surface, the grid.
    """
    paid = {"time steps and solver"} if dataset.attrs["grid_is_data"] else {"time steps and solver", "grid"}
    known = {str(one.attrs["quantity"]): one for one in budgets}
    names = [str(name) for name in dataset["quantity"].values]
    floors, left, still_open = [], [], []
    for name in names:
        found = None if name not in known else known[name].sel(source=~known[name]["source"].isin([*paid]))
        floors.append(np.nan if found is None else _floor_of(found))
        left.append("" if found is None else _largest_source(found))
        still_open.append("" if found is None else ", ".join(found["source"].values[found["state"].values == "open"]))
    columns = {"floor": floors, "floor_source": left, "floor_open": still_open} if known else {}
    dataset = annotate(dataset.assign({name: ("quantity", values) for name, values in columns.items()}))
    dataset.attrs["recommendation"] = recommendation(dataset)
    return dataset


def _floor_of(budget: xr.Dataset) -> float:
    """Half of the interval of some sources, the worst of the rows over the largest value."""
    value, half, direction = (budget[name].values for name in ("value", "half_width", "direction"))
    ends = []
    for side in (-1, 1):
        counted = np.where((direction == 0) | (direction == side), np.nan_to_num(half), 0.0)
        ends.append(np.exp(side * np.sqrt(np.sum(counted**2, axis=0))))
    off = np.abs(value) * (ends[1] - ends[0]) / 2
    largest = float(np.fmax.reduce(np.abs(value), initial=0.0))
    return float(np.fmax.reduce(off)) / largest if largest else np.nan


def _largest_source(budget: xr.Dataset) -> str:
    """The source that leaves most."""
    half = np.nan_to_num(budget["half_width"].values).max(axis=1)
    return str(budget["source"].values[int(np.argmax(half))]) if half.size and half.max() > 0 else ""
