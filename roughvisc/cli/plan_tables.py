"""Table of a plan on the command line: model and cost of a study."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from rich.console import Group
from rich.text import Text

from roughvisc.cli.group import counted
from roughvisc.cli.tables import columns, readable, two_columns
from roughvisc.experiment.resources import amount
from roughvisc.study.case_text import names_of, value_text

#: Columns of the table of the cases.
_COLUMNS = ("contact_fraction", "steps", "convolutions", "wall_time", "memory", "disk")
#: Largest number of cases that a plan lists one by one.
_LISTED = 20


def plan_tables(costs: xr.Dataset) -> Group:
    """Return a summary of all cases, and a row for each case.

    Parameters
    ----------
    costs : xarray.Dataset
        Result of :func:`roughvisc.plan`.
    """
    total, attrs = costs.sizes["case"], costs.attrs
    threads = f"{counted(attrs['threads'], 'thread')} on large grids"
    grids = [f"{x} x {y} cells" for x, y in zip(costs.cells_x.values, costs.cells_y.values, strict=True)]
    rows = [
        ("Cases", f"{total}, {attrs['processes']} in parallel, each with {threads}" if total > 1 else f"1, {threads}"),
        ("Model", _distinct(costs["model"].values)),
        ("Program", _distinct(costs["note"].values)),
        ("Grid", _distinct(grids)),
        ("Wall time", f"about {_number(attrs['wall_time'], 's')}"),
        ("Memory", f"{amount(attrs['memory'])} of {amount(attrs['free_memory'])} free"),
        ("Disk", f"{amount(attrs['disk'])} of {amount(attrs['free_disk'])} free"),
    ]
    parts: list[Any] = [two_columns(rows, attrs.get("title"))]
    for text in filter(None, dict.fromkeys(costs["warning"].values)):
        warned = int((costs["warning"] == text).sum())
        parts.append(Text(f"Warning: {text} ({warned} of {counted(total, 'case')})", style="bold red"))
    parts += [Text(), _case_table(costs.isel(case=slice(_LISTED)))]
    if total > _LISTED:
        parts.append(Text(f"and {total - _LISTED} more"))
    if not costs["marched"].all():
        parts.append(Text("~ Estimated from the coarse run of the most similar case.", style="italic"))
    return Group(*parts)


def _distinct(texts: Any) -> str:
    """Return the first three distinct texts, and the number of further texts."""
    found = list(filter(None, dict.fromkeys(str(text).rstrip(".") for text in texts)))
    return "; ".join(found[:3]) + (f"; and {len(found) - 3} more" if len(found) > 3 else "")


def _case_table(costs: xr.Dataset) -> Any:
    """Return the settings and costs of each case."""
    varied = [str(name) for name in costs.coords if name != "case_key"]
    rows = []
    for i in range(costs.sizes["case"]):
        row = costs.isel(case=i)
        mark = "" if row["marched"] else "~"
        known = [_number(float(row[name]), str(row[name].attrs.get("units", ""))) for name in _COLUMNS]
        numbers = ["cannot run"] if row["refusal"] != "" else [text and mark + text for text in known]
        rows.append([*(value_text(key, row[key].item()) for key in varied), *numbers])
    return columns([*names_of(varied).values(), *(name.replace("_", " ") for name in _COLUMNS)], rows)


def _number(value: float, unit: str) -> str:
    """Return an estimate with two digits in a suitable unit; empty if it is not known."""
    if unit == "byte":
        return amount(value)
    return "" if np.isnan(value) else readable(float(f"{value:.2g}"), unit)
