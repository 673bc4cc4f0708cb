"""Tables on the command line that say how far a result can be trusted: of an audit, a budget, a trade."""

from __future__ import annotations

import numpy as np
import xarray as xr
from rich.console import Group
from rich.table import Table
from rich.text import Text

from roughvisc.study.audit.audit import Audit
from roughvisc.study.audit.limits import BROKEN, DOUBTFUL, NOT_KNOWN
from roughvisc.study.trade.recommend import WORDS, cheapest, choice, duration, pareto_front, percent
from roughvisc.units import unit_for
from roughvisc.variables import AXES, axis_of
from roughvisc.views.console.tables import titled

#: The words tell the verdicts apart; weight and colour help to find them.
_STYLES = {BROKEN: "bold red", DOUBTFUL: "bold", NOT_KNOWN: "dim"}


def audit_table(audit: Audit) -> Group:
    """What was found, a row an assumption.

    Parameters
    ----------
    audit : Audit
        Of :func:`roughvisc.audit`.
    """
    table = Table(box=None, pad_edge=False)
    for heading in ("assumption", "verdict"):
        table.add_column(heading, no_wrap=True)
    table.add_column("number", justify="right", no_wrap=True)
    table.add_column("", overflow="fold")
    for one in audit:
        verdict = Text(one.verdict, style=_STYLES.get(one.verdict, ""))
        table.add_row(one.name, verdict, one.shown, Text(one.sentence))
    return titled(audit.title, table)


def budget_table(dataset: xr.Dataset) -> Group:
    """The number with its interval, and its sources: how large, how it was found, what it cost.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.budget`, of one quantity.
    """
    axis = axis_of(dataset.variables)
    unit = unit_for(dataset["value"].values, dataset["value"].attrs["units"])
    name = dataset.attrs["quantity"].replace("_", " ")
    parts: list[Text | Table] = []
    table = Table(box=None, pad_edge=False, collapse_padding=True)
    table.add_column("source", no_wrap=True)
    table.add_column("error, %", justify="right", no_wrap=True)
    table.add_column("found by")
    table.add_column("time", justify="right", no_wrap=True)
    for source in dataset["source"].values:
        one = dataset.sel(source=source)
        cost = float(one["cost"])
        table.add_row(str(source), _error(one, axis), Text(str(one["method"].values)), f"{cost:.2g} s" if cost else "")
    for place in dataset[axis].values:
        at = dataset.sel({axis: place})
        low, value, high = (unit.text(float(at[end]), 3) for end in ("lower", "value", "upper"))
        interval = f"at 95 % from {low} to {high}"
        if not np.isfinite(at["upper"]):
            interval = "without an interval" + (", as zero has no logarithm" if at["value"] == 0 else "")
        parts.append(Text(f"{AXES[axis].place(float(place))}: {value}, {interval}"))
    parts += [Text(), table]
    spent = float(dataset["case_cost"])
    notes = [f"The case itself took {spent:.2g} s. Errors are those of the {AXES[axis].rows}, least and largest."]
    if "surrogate_ratio" in dataset:
        ratio, kurtosis = dataset["surrogate_ratio"].values, dataset.attrs["kurtosis"]
        if np.isfinite(ratio).any():
            ends = dict.fromkeys(f"{one:.2g}" for one in (np.nanmin(ratio), np.nanmax(ratio)))
            told = f"The number is {' to '.join(ends)} of the mean of its Gaussian surrogates, and not replaced by it"
            notes.append(f"{told}. The heights have a kurtosis of {kurtosis:.2g} (3: Gaussian).")
    if "own_note" in dataset.attrs:
        notes.append(f"Warning: {dataset.attrs['own_note']}.")
    if dataset.attrs["open"]:
        notes.append("What is open is not in the interval.")
    title = f"{dataset.attrs['title'] or 'untitled'}: {name}"
    return titled(title, *parts, *(Text(note, style="italic") for note in notes))


def _error(source: xr.Dataset, axis: str) -> str:
    """Half-width over the rows in %, with its direction."""
    half = np.atleast_1d(source["half_width"].values)
    if str(source["state"].values) != "counted":
        return str(source["state"].values)
    if not np.isfinite(half).any():
        return "-"
    towards = set(np.atleast_1d(source["direction"].values).tolist())
    sign = {frozenset({1}): "+", frozenset({-1}): "-"}.get(frozenset(towards), "±")
    ends = list(dict.fromkeys(_short(float(one)) for one in (np.nanmin(half), np.nanmax(half))))
    if ends == ["0"] or ends[0].startswith("factor"):
        return " to ".join([ends[0], *(one.removeprefix("factor ") for one in ends[1:])])
    return sign + " to ".join(ends)


def _short(half: float) -> str:
    """A half-width of a logarithm: in % as long as it is small, then as a factor."""
    if half > 0.5:
        return f"factor {np.exp(half):.2g}"
    percent = 100 * half
    return "0" if percent < 5e-4 else f"{percent:.2g}" if percent >= 0.01 else "<0.01"


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


def trade_table(dataset: xr.Dataset, quantity: str, target: float) -> Group:
    """Return cost and errors of every setting, the cheapest setting that is accurate enough, and what was not run.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`roughvisc.trade`.
    quantity : str
        Quantity whose error is to be small.
    target : float
        Wanted relative error. [-]
    """
    shown = dict([one for one in _ERRORS.items() if one[0] in dataset["quantity"]][:_COLUMNS])
    table = Table(box=None, pad_edge=False, collapse_padding=True)
    table.add_column()
    table.add_column("setting", min_width=18)
    for heading in ("time", "transf.", *shown.values()):
        table.add_column(heading, justify="right", no_wrap=True)
    best, chosen = pareto_front(dataset, quantity), cheapest(dataset, quantity, target)
    for i in range(dataset.sizes["setting"]):
        row = dataset.isel(setting=i)
        if not np.isfinite(row["run_time"]):
            continue
        errors = [_percent(float(row["error"].sel(quantity=name))) for name in shown]
        spent, transforms = duration(float(row["run_time"])), f"{float(row['transforms']):.0f}"
        name = Text(str(row["setting"].values).replace(", ", ",\n"))
        mark = (">" if i == chosen else "") + ("*" if best[i] else "")
        table.add_row(mark, name, spent, transforms, *errors, style="bold" if i == chosen else "")
    rows = dataset.attrs.get("rows", "kept times")
    marks = f"* Pareto-optimal for {WORDS[quantity]}. > Cheapest for {percent(target)}."
    parts = [table, Text(f"Errors in %, worst of all {rows}. {marks}", style="italic"), Text()]
    parts += [
        Text(f"Not run: {name}: {why}")
        for name, why in zip(dataset["setting"].values, dataset["note"].values, strict=True)
        if why
    ]
    parts += [Text(f"Reference: {dataset.attrs['reference']}."), Text(choice(dataset, quantity, target))]
    unsure = float(dataset["reference_grid_uncertainty"].sel(quantity=quantity))
    if dataset.attrs["grid_is_data"] and np.isfinite(unsure):
        parts.append(Text(f"Error by the spacing of the points of the scan: about {percent(unsure)}"))
    return titled(dataset.attrs.get("title"), *parts)


def _percent(part: float) -> str:
    if not np.isfinite(part):
        return "-"
    shown = 100 * part
    return f"{shown:.2g}" if shown >= 1e-3 or shown == 0 else "<0.001"
