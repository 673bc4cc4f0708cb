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

#: Columns of the table of the cases of a sweep.
_COLUMNS = ("contact_fraction", "steps", "convolutions", "wall_time", "memory", "disk")
#: Largest number of cases that a plan lists one by one.
_LISTED = 20


def plan_tables(costs: xr.Dataset) -> Group:
    """Return a summary of all cases, and a row for each case of a sweep.

    Parameters
    ----------
    costs : xarray.Dataset
        Result of :func:`roughvisc.plan`.
    """
    for name in (*_COLUMNS, "nominal_pressure"):
        costs[name].values = [float(f"{value:.2g}") for value in costs[name].values]
    total, attrs, first = costs.sizes["case"], costs.attrs, costs.isel(case=0)
    seconds = float(f"{attrs['wall_time']:.2g}")
    threads = f"{counted(attrs['threads'], 'thread')} on large grids"
    grids = [f"{x} x {y} cells" for x, y in zip(costs.cells_x.values, costs.cells_y.values, strict=True)]
    rows = [
        ("Cases", f"{total}, {attrs['processes']} in parallel, each with {threads}" if total > 1 else f"1, {threads}"),
        ("Model", _distinct(costs["model"].values)),
        ("Program", _distinct(costs["note"].values)),
        ("Grid", _distinct(grids)),
    ]
    if total == 1:
        rows += [
            ("Largest nominal pressure", f"about {_text(first['nominal_pressure'])}"),
            ("Contact", f"about {100 * float(first['contact_fraction']):.2g} % of the area"),
            ("Steps or speeds", f"about {_text(first['steps'])}"),
            ("Convolutions", f"about {_text(first['convolutions'])}"),
        ]
    rows += [
        ("Wall time", f"about {readable(seconds, 's')}"),
        ("Memory", f"{amount(attrs['memory'])} of {amount(attrs['free_memory'])} free"),
        ("Disk", f"{amount(attrs['disk'])} of {amount(attrs['free_disk'])} free"),
    ]
    parts: list[Any] = [two_columns([row for row in rows if row[1]], attrs.get("title"))]
    for text in dict.fromkeys(costs["warning"].values):
        if text:
            warned = int((costs["warning"] == text).sum())
            several = f" ({warned} of {total} cases)" if total > 1 else ""
            parts.append(Text(f"Warning: {text}{several}", style="bold red"))
    if total > 1:
        parts += [Text(), _case_table(costs.isel(case=slice(_LISTED)), total)]
    if not costs["marched"].all():
        parts.append(Text("~ Estimated from the coarse run of the most similar case.", style="italic"))
    return Group(*parts)


def _distinct(texts: Any) -> str:
    """Return the first three distinct texts, and the number of further texts."""
    found = [one for one in dict.fromkeys(str(text).rstrip(".") for text in texts) if one]
    return "; ".join(found[:3]) + (f"; and {len(found) - 3} more" if len(found) > 3 else "")


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
    for name, short in zip([*varied, *_COLUMNS], [*last, *_COLUMNS], strict=True):
        heading = short if last.count(short) <= 1 else name
        table.add_column(Text(heading.replace("_", " ")), justify="right", overflow="fold")
    for i in range(costs.sizes["case"]):
        row = costs.isel(case=i)
        mark = "" if row["marched"] else "~"
        known = [mark + text if (text := _text(row[name])) else "" for name in _COLUMNS]
        cells = ["cannot run"] if row["refusal"] != "" else known
        table.add_row(*(Text(_text(row[key])) for key in varied), *cells)
    if total > _LISTED:
        table.add_row(f"and {total - _LISTED} more")
    return table


def _text(value: xr.DataArray) -> str:
    """Return a value with a suitable unit, or a text; empty if it is not known."""
    if value.dtype.kind not in "iuf":
        return str(value.values)
    if value.attrs.get("units") == "byte":
        return amount(float(value))
    if np.isnan(value):
        return ""
    return "half-space" if value == math.inf else readable(float(value), str(value.attrs.get("units", "")))
