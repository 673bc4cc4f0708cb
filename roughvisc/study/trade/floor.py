"""The floor of a trade: what the whole error of a number keeps, whatever setting is paid for."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.labels import annotate
from roughvisc.study.statement.case import Case
from roughvisc.study.trade.recommend import recommendation

#: Tables of a study that make the scene, beside that of what is done.
_SCENE = ("surface", "material", "program")


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
        floors.append(np.nan if found is None else _floor(found))
        left.append("" if found is None else _largest_source(found))
        still_open.append("" if found is None else ", ".join(found["source"].values[found["state"].values == "open"]))
    columns = {"floor": floors, "floor_source": left, "floor_open": still_open} if known else {}
    dataset = annotate(dataset.assign({name: ("quantity", values) for name, values in columns.items()}))
    dataset.attrs["recommendation"] = recommendation(dataset)
    return dataset


def _floor(budget: xr.Dataset) -> float:
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
