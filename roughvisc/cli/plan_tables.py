"""Table of a plan on the command line: model and cost of a study."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from rich.console import Group
from rich.table import Table
from rich.text import Text

from roughvisc.cli.group import counted
from roughvisc.cli.tables import readable, two_columns
from roughvisc.experiment.resources import amount

#: Costs of each case of a sweep.
_COSTS = ("steps", "convolutions", "wall_time", "memory", "disk")
#: Largest number of cases that a plan lists one by one.
_LISTED = 20


def plan_tables(costs: xr.Dataset) -> Group:
    """Return a summary of all cases, and a row for each case of a sweep.

    Parameters
    ----------
    costs : xarray.Dataset
        Result of :func:`roughvisc.plan`.
    """
    total, attrs, own = costs.sizes["case"], costs.attrs, int(costs["marched"].sum())
    threads = f"{counted(attrs['threads'], 'thread')} on large grids"
    each = " per case" if total > 1 else ""
    steps = "Speeds" if all(str(model).endswith("steady sliding") for model in costs["model"].values) else "Steps"
    whole = [
        ("Cases", f"{total}, {attrs['processes']} in parallel, each with {threads}" if total > 1 else f"1, {threads}"),
        ("Model", _distinct(costs["model"].values)),
        ("Program", _distinct(costs["note"].values)),
        (
            "Grid",
            _distinct(f"{x} x {y} cells" for x, y in zip(costs.cells_x.values, costs.cells_y.values, strict=True)),
        ),
        ("Largest nominal pressure", _span(costs["nominal_pressure"], "Pa")),
        ("Contact", _span(100 * costs["contact_fraction"], "", " % of the area")),
        (f"{steps}{each}", _span(costs["steps"], "")),
        (f"Convolutions{each}", _span(costs["convolutions"], "")),
        (f"Wall time{each}", _span(costs["wall_time"], "s")),
        ("Wall time, all cases", f"about {readable(attrs['wall_time'], 's')}" if total > 1 else ""),
        ("Memory", f"{amount(attrs['memory'])} of {amount(attrs['free_memory'])} free"),
        ("Disk", f"{amount(attrs['disk'])} of {amount(attrs['free_disk'])} free"),
        ("Estimated from", f"coarse runs of {own} of {total} cases" if total > 1 else "a coarse run"),
    ]
    parts: list[Any] = [two_columns([row for row in whole if row[1]], attrs.get("title"))]
    for text in dict.fromkeys(costs["warning"].values):
        if text:
            warned = int((costs["warning"] == text).sum())
            several = f" ({warned} of {total} cases)" if total > 1 else ""
            parts.append(Text(f"Warning: {text}{several}", style="bold red"))
    if total > 1:
        parts += [Text(), _case_table(costs.isel(case=slice(_LISTED)), total)]
    if own < total:
        parts.append(Text("~ Estimated from the coarse run of the most similar case.", style="italic"))
    return Group(*parts)


def _distinct(texts: Any) -> str:
    """Return the first three distinct texts, and the number of further texts."""
    found = [one for one in dict.fromkeys(str(text).rstrip(".") for text in texts) if one]
    return "; ".join(found[:3]) + (f"; and {len(found) - 3} more" if len(found) > 3 else "")


def _span(values: xr.DataArray, unit: str, after: str = "") -> str:
    """Return the range of the known values and, if some are unknown, their number; empty if none is known."""
    known = values.values[np.isfinite(values.values)]
    ends = [f"{float(f'{one:.2g}'):g}" if not unit else readable(float(one), unit) for one in known]
    ends = list(dict.fromkeys(ends[i] for i in (known.argmin(), known.argmax()))) if known.size else []
    if known.size < values.size:
        after += f" in {known.size} of {values.size} cases"
    return f"about {' to '.join(ends)}{after}" if ends else ""


def _case_table(costs: xr.Dataset, total: int) -> Table:
    """Return the settings and costs of each case.

    Parameters
    ----------
    costs : xarray.Dataset
        Listed cases.
    total : int
        Number of all cases.
    """
    varied = [str(name) for name in costs.coords if name != "case_key"]
    last = [key.rpartition(".")[2] for key in varied]
    table = Table(box=None, pad_edge=False)
    for name, short in zip([*varied, *_COSTS], [*last, *_COSTS], strict=True):
        heading = short if last.count(short) <= 1 else name
        table.add_column(Text(heading.replace("_", " ")), justify="right", overflow="fold")
    for i in range(costs.sizes["case"]):
        row = costs.isel(case=i)
        mark = "" if row["marched"] else "~"
        cells = ["cannot run"] if row["refusal"] != "" else [mark + _text(row[name]) for name in _COSTS]
        table.add_row(*(Text(_text(row[key])) for key in varied), *cells)
    if total > _LISTED:
        table.add_row(f"and {total - _LISTED} more")
    return table


def _text(value: xr.DataArray) -> str:
    """Return a value with a suitable unit."""
    if value.dtype.kind not in "iuf":
        return str(value.values)
    if value.attrs.get("units") == "byte":
        return amount(float(value))
    return "half-space" if value == math.inf else readable(float(value), str(value.attrs.get("units", "")))
