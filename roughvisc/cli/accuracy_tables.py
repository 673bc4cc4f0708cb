"""Tables of an audit, a budget and a trade on the command line."""

from __future__ import annotations

import re

import click
import numpy as np
import xarray as xr
from rich.console import Group
from rich.table import Table
from rich.text import Text

from roughvisc.cli.tables import titled
from roughvisc.study.audit import BROKEN, DOUBTFUL, NOT_KNOWN, Audit
from roughvisc.study.trade import cheapest, pareto_front
from roughvisc.units import unit_for
from roughvisc.variables import AXES, VARIABLES, axis_of

#: Weight and colour of verdicts that need attention.
_STYLES = {BROKEN: "bold red", DOUBTFUL: "bold", NOT_KNOWN: "dim"}


def audit_table(audit: Audit) -> Group:
    """Return the verdict on each assumption.

    Parameters
    ----------
    audit : Audit
        Result of :func:`roughvisc.audit`.
    """
    table = Table(box=None, pad_edge=False)
    for heading in ("assumption", "verdict"):
        table.add_column(heading, no_wrap=True)
    table.add_column("number", justify="right", no_wrap=True)
    table.add_column("reason", overflow="fold")
    for one in audit:
        verdict = Text(one.verdict, style=_STYLES.get(one.verdict, ""))
        table.add_row(one.name, verdict, one.shown, Text(_by_option(one.sentence)))
    return titled(audit.title, table)


def budget_table(dataset: xr.Dataset) -> Group:
    """Return the result with its interval, and the size, method and cost of each source of error.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.budget`, for one quantity.
    """
    axis, name = axis_of(dataset.variables), str(dataset["quantity"].values)
    unit = unit_for(dataset["value"].values, VARIABLES[name].units)
    table = Table(box=None, pad_edge=False, collapse_padding=True)
    table.add_column("source", no_wrap=True)
    table.add_column("error, %", justify="right", no_wrap=True)
    table.add_column("found by")
    unknown = dataset.attrs["open"].split("; ")
    for source in dataset["source"].values:
        one = dataset.sel(source=source)
        method = str(one["method"].values)
        table.add_row(str(source), "open" if source in unknown else _error(one), Text(_by_option(method)))
    lines = []
    for place in dataset[axis].values:
        at = dataset.sel({axis: place})
        low, value, high = (unit.text(float(at[end]), 3) for end in ("lower", "value", "upper"))
        interval = f"at 95 % from {low} to {high}"
        if not np.isfinite(at["upper"]):
            interval = "without an interval" + (", as zero has no logarithm" if at["value"] == 0 else "")
        lines.append(Text(f"{AXES[axis].place(float(place), 3)}: {value}, {interval}"))
    note = f"Errors are the smallest and the largest of all {AXES[axis].rows}."
    note += " The interval does not include open sources." if dataset.attrs["open"] else ""
    title = f"{dataset.attrs['title'] or 'untitled'}: {name.replace('_', ' ')}"
    return titled(title, *lines, Text(), table, Text(note, style="italic"))


def _by_option(sentence: str) -> str:
    """Return a sentence with a missing input named as the option of the command, if it has one."""
    known = {one.name for one in click.get_current_context().command.params}
    return re.sub(
        r"\w+(?= is not given)",
        lambda found: f"--{found[0].replace('_', '-')}" if found[0] in known else found[0],
        sentence,
    )


def _error(source: xr.Dataset) -> str:
    """Return the range of the half-width of a source over the rows: in %, or as factors if it is large."""
    half = np.atleast_1d(source["half_width"].values)
    half = half[np.isfinite(half)]
    if not half.size:
        return "-"
    towards = set(np.atleast_1d(source["direction"].values).tolist())
    side, ends = towards.pop() if len(towards) == 1 else 0, (half.min(), half.max())
    if ends[1] > 0.5:
        return "factor " + " to ".join(dict.fromkeys(f"{np.exp((side or 1) * one):.2g}" for one in ends))
    shown = " to ".join(dict.fromkeys(f"{100 * one:.2g}" if one >= 1e-4 else "0" for one in ends))
    return shown if shown == "0" else {1: "+", -1: "-"}.get(side, "±") + shown


#: Number of error columns that fit into 80 characters.
_COLUMNS = 4


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
    table = Table(box=None, pad_edge=False, collapse_padding=True)
    table.add_column()
    table.add_column("setting", min_width=18)
    for heading in ("time", "FFTs", *(name.replace("_", "\n") for name in shown)):
        table.add_column(heading, justify="right", no_wrap=True)
    best, chosen = pareto_front(dataset, quantity), cheapest(dataset, quantity, target)
    for i in range(dataset.sizes["setting"]):
        row = dataset.isel(setting=i)
        name = Text(str(row["setting"].values).replace(", ", ",\n"))
        mark = (">" if i == chosen else "") + ("*" if best[i] else "")
        spent, transforms = f"{float(row['run_time']):.2g} s", f"{float(row['transforms']):.0f}"
        errors = [_percent(float(row["error"].sel(quantity=name))) for name in shown]
        table.add_row(mark, name, spent, transforms, *errors, style="bold" if i == chosen else "")
    words, wanted = VARIABLES[quantity].label.lower(), f"{_percent(target)} %"
    by_steps, by_grid = (
        _percent(float(dataset[f"reference_{part}_uncertainty"].sel(quantity=quantity))) for part in ("time", "grid")
    )
    grid = "spacing of the surface points" if dataset.attrs["grid_is_data"] else "grid"
    lines = [
        f"\nErrors in %, worst of all {dataset.attrs['rows']}, against the {dataset.attrs['reference']}.",
        f"Its error of the {words}: {by_steps} % from time steps, {by_grid} % from the {grid}.",
        f"* Pareto-optimal for {words}. > Cheapest for {wanted}.",
    ]
    if chosen is None:
        lines.append(f"No setting is known to have an error of at most {wanted}.")
    else:
        lines.append(f"For an error of {wanted} of the {words} use {dataset['setting'].values[chosen]}.")
    return titled(dataset.attrs["title"], table, *map(Text, lines))


def _percent(part: float) -> str:
    if not np.isfinite(part):
        return "-"
    return f"{100 * part:.2g}" if part >= 1e-5 or part == 0 else "<0.001"
