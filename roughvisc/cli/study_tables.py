"""Tables on the command line: a plan, an audit, a budget and a trade of a study."""

from __future__ import annotations

import re
from typing import Any

import click
import numpy as np
import xarray as xr
from rich.console import Group
from rich.text import Text

from roughvisc.cli.group import counted
from roughvisc.cli.summaries import columns, readable, titled, two_columns
from roughvisc.experiment.memory_limit import amount
from roughvisc.judge.audit import Audit
from roughvisc.judge.trade import cheapest, pareto_front
from roughvisc.study.case_text import names_of, value_text
from roughvisc.units import unit_for
from roughvisc.variables import AXES, VARIABLES, axis_of

#: Columns of a case in the table of a plan.
_COSTS = ("contact_fraction", "steps", "convolutions", "wall_time", "memory", "disk")
#: Largest number of cases that a plan lists one by one.
_LISTED = 20
#: Number of error columns that fit into 80 characters.
_COLUMNS = 4


def audit_table(audit: Audit) -> Group:
    """Return the verdict on each assumption.

    Parameters
    ----------
    audit : Audit
        Result of :func:`roughvisc.audit`.
    """
    headings = ("assumption", "verdict", "number", "reason")
    rows = [(finding.name, finding.verdict, finding.shown, _by_option(finding.sentence)) for finding in audit]
    return titled(audit.title, columns(headings, rows, ("assumption", "verdict", "reason")))


def budget_table(dataset: xr.Dataset) -> Group:
    """Return the result with its interval, and the size and method of each source of error.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.budget`, for one quantity.
    """
    axis = AXES[axis_of(dataset.variables)]
    name = str(dataset["quantity"].values)
    unit = unit_for(dataset["value"].values, VARIABLES[name].units)
    unknown = dataset.attrs["open"].split("; ")
    rows = []
    for source in dataset["source"].values:
        of_source = dataset.sel(source=source)
        rows.append(
            (source, "open" if source in unknown else _error(of_source), _by_option(str(of_source["method"].values)))
        )
    lines = []
    for place in dataset[axis.name].values:
        row = dataset.sel({axis.name: place})
        low, value, high = (unit.text(float(row[end])) for end in ("lower", "value", "upper"))
        interval = f"at 95 % from {low} to {high}" if np.isfinite(row["upper"]) else "without an interval"
        lines.append(f"{axis.place(float(place), 3)}: {value}, {interval}")
    note = f"Errors are the smallest and the largest of all {axis.rows}."
    note += " The interval does not include open sources." if dataset.attrs["open"] else ""
    table = columns(("source", "error, %", "found by"), rows, ("source", "found by"))
    title = f"{dataset.attrs['title'] or 'untitled'}: {name.replace('_', ' ')}"
    return titled(title, *map(Text, lines), Text(), table, Text(note, style="italic"))


def _by_option(sentence: str) -> str:
    """Return a sentence with a missing input named as the option of the command, if it has one."""
    options = {parameter.name: parameter.opts[0] for parameter in click.get_current_context().command.params}
    return re.sub(r"\w+(?= is not given)", lambda found: options.get(found[0], found[0]), sentence)


def _error(source: xr.Dataset) -> str:
    """Return the range of the error of a source over the rows. [%]"""
    half = np.ravel(source["half_width"].values)
    half = half[np.isfinite(half)]
    if not half.size:
        return "-"
    sides = set(np.ravel(source["direction"].values).tolist())
    side = sides.pop() if len(sides) == 1 else 0
    ends = np.abs(np.expm1(half * (side or 1)))  # of an error in both directions, the larger part upwards
    sign = {1: "+", -1: "-"}.get(side, "±")
    return sign + " to ".join(dict.fromkeys(map(_percent, (ends.min(), ends.max()))))


def trade_table(dataset: xr.Dataset, quantity: str, target: float) -> Group:
    """Return cost and errors of every setting, with a mark for the cheapest one that is accurate enough.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.trade`.
    quantity : str
        Quantity whose error has to reach the target.
    target : float
        Target relative error. [-]
    """
    shown = dataset["quantity"].values[:_COLUMNS].tolist()
    best = pareto_front(dataset, quantity)
    chosen = cheapest(dataset, quantity, target)
    rows = []
    for i in range(dataset.sizes["setting"]):
        row = dataset.isel(setting=i)
        mark = (">" if i == chosen else "") + ("*" if best[i] else "")
        name = str(row["setting"].values)
        errors = [_percent(float(row["error"].sel(quantity=quantity_shown))) for quantity_shown in shown]
        cost = f"{float(row['run_time']):.2g} s", f"{float(row['transforms']):.0f}"
        rows.append((mark, name.replace(", ", ",\n"), *cost, *errors))
    headings = ("", "setting", "time", "FFTs", *(name.replace("_", "\n") for name in shown))
    words = VARIABLES[quantity].label.lower()
    wanted = f"{_percent(target)} %"
    by_steps, by_grid = (
        _percent(float(dataset[f"reference_{source}_uncertainty"].sel(quantity=quantity)))
        for source in ("time", "grid")
    )
    grid = "spacing of the surface points" if dataset.attrs["grid_is_data"] else "grid"
    lines = [
        f"\nErrors in %, worst of all {dataset.attrs['rows']}, against the {dataset.attrs['reference']}.",
        f"Its error of the {words}: {by_steps} % from time steps, {by_grid} % from the {grid}.",
        f"* Pareto-optimal for {words}. > Cheapest for {wanted}.",
        f"No setting is known to have an error of at most {wanted}."
        if chosen is None
        else f"For an error of {wanted} of the {words} use {dataset['setting'].values[chosen]}.",
    ]
    if dataset.attrs["grid_is_data"]:
        lines.append(
            f"This does not include the error from the spacing, {by_grid} %, which a scan with closer points reduces."
        )
    return titled(dataset.attrs["title"], columns(headings, rows, ("setting",)), *map(Text, lines))


def _percent(part: float) -> str:
    if not np.isfinite(part):
        return "-"
    return f"{100 * part:.2g}" if part >= 1e-5 or part == 0 else "<0.001"


def plan_tables(costs: xr.Dataset) -> Group:
    """Return a summary of all cases, and a row for each case.

    Parameters
    ----------
    costs : xarray.Dataset
        Result of :func:`roughvisc.plan`.
    """
    total = costs.sizes["case"]
    attrs = costs.attrs
    threads = f"{counted(attrs['threads'], 'thread')} on large grids"
    grids = [f"{x} x {y} cells" for x, y in zip(costs.cells_x.values, costs.cells_y.values, strict=True)]
    rows = [
        ("Cases", f"{total}, {attrs['processes']} in parallel, each with {threads}" if total > 1 else f"1, {threads}"),
        ("Model", _distinct(costs["model"].values)),
        ("Program", _distinct(costs["note"].values)),
        ("Grid", _distinct(grids)),
        ("Wall time", f"about {_estimate(attrs['wall_time'], 's')}"),
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
    distinct = list(filter(None, dict.fromkeys(str(text).rstrip(".") for text in texts)))
    return "; ".join(distinct[:3]) + (f"; and {len(distinct) - 3} more" if len(distinct) > 3 else "")


def _case_table(costs: xr.Dataset) -> Any:
    """Return the settings and costs of each case."""
    varied = [str(name) for name in costs.coords if name != "case_key"]
    rows = []
    for i in range(costs.sizes["case"]):
        row = costs.isel(case=i)
        mark = "" if row["marched"] else "~"
        known = [_estimate(float(row[name]), str(row[name].attrs.get("units", ""))) for name in _COSTS]
        numbers = ["cannot run"] if row["refusal"] != "" else [text and mark + text for text in known]
        rows.append([*(value_text(key, row[key].item()) for key in varied), *numbers])
    names = [f"{name[:1].lower()}{name[1:]}" for name in names_of(varied).values()]
    headings = [name.replace(" ", "\n").replace("_", "\n") for name in [*names, *_COSTS]]  # fits into 80 columns
    return columns(headings, rows)


def _estimate(value: float, unit: str) -> str:
    """Return an estimate with two digits in a suitable unit; empty if it is not known."""
    if unit == "byte":
        return amount(value)
    return "" if np.isnan(value) else readable(float(f"{value:.2g}"), unit)
