"""Table of a trade on the command line, with its recommendation."""

from __future__ import annotations

import numpy as np
import xarray as xr
from rich.console import Group
from rich.table import Table
from rich.text import Text

from roughvisc.errors import printable
from roughvisc.study.trade.recommend import WORDS, duration, main_quantities, pareto_front
from roughvisc.views.console.tables import size

#: Errors that are shown, and their headings; so many of them, the first, have room in 80 characters.
_ERRORS = {
    "force": "force",
    "leak_rate": "leak",
    "thermal_conductance": "conductance",
    "incremental_stiffness": "stiffness",
    "friction_coefficient": "friction",
    "pressure": "pressure",
    "approach": "approach",
    "contact_area": "area",
    "mean_gap": "gap",
}
_COLUMNS = 4


def trade_table(dataset: xr.Dataset) -> Group:
    """Cost and errors of every setting; what was not run, and why; the advice.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.trade`.
    """
    shown = dict([one for one in _ERRORS.items() if one[0] in dataset["quantity"]][:_COLUMNS])
    counts = main_quantities(dataset)[0]
    table = Table(box=None, pad_edge=False, collapse_padding=True)
    table.add_column()
    table.add_column("setting", min_width=18)
    for heading in ("time", "transf.", "memory", *shown.values()):
        table.add_column(heading, justify="right", no_wrap=True)
    best = pareto_front(dataset, counts)
    for i in range(dataset.sizes["setting"]):
        row = dataset.isel(setting=i)
        if not np.isfinite(row["run_time"]):
            continue
        errors = [_percent(float(row["error"].sel(quantity=name))) for name in shown]
        spent, transforms = duration(float(row["run_time"])), f"{float(row['transforms']):.0f}"
        name = Text(str(row["setting"].values).replace(", ", ",\n"))
        table.add_row("*" if best[i] else "", name, spent, transforms, size(float(row["peak_memory"])), *errors)
    if "floor" in dataset:
        floors = [_percent(float(dataset["floor"].sel(quantity=name))) for name in shown]
        table.add_row("", Text("no setting better than", style="italic"), "", "", "", *floors)
    parts = [Text(printable(dataset.attrs.get("title") or "untitled"), style="bold"), table]
    rows = dataset.attrs.get("rows", "kept times")
    text = (
        f"Errors in %, worst of all {rows}. * Pareto-optimal for {WORDS[counts]}: no setting is both faster and better."
    )
    parts += [Text(text, style="italic"), Text()]
    parts += [
        Text(f"Not run: {name}: {why}")
        for name, why in zip(dataset["setting"].values, dataset["note"].values, strict=True)
        if why
    ]
    parts += [Text(f"Reference: {text}.") for text in _references(dataset)]
    parts += [Text(), *(Text(line[:1].upper() + line[1:]) for line in dataset.attrs["recommendation"].splitlines())]
    return Group(*parts)


def _percent(part: float) -> str:
    if not np.isfinite(part):
        return "-"
    shown = 100 * part
    return f"{shown:.2g}" if shown >= 1e-3 or shown == 0 else "<0.001"


def _references(dataset: xr.Dataset) -> list[str]:
    """What errors are measured against, each once, with the quantities that it holds for."""
    found: dict[str, list[str]] = {}
    for quantity, name in zip(dataset["quantity"].values, dataset["reference"].values, strict=True):
        if quantity in _ERRORS:
            found.setdefault(str(name), []).append(_ERRORS[str(quantity)])
    one = len(found) == 1
    return [name if one else f"{name}: {', '.join(quantities)}" for name, quantities in found.items()]
