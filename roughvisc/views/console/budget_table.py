"""Table of a budget on the command line."""

from __future__ import annotations

import numpy as np
import xarray as xr
from rich.console import Group
from rich.table import Table
from rich.text import Text

from roughvisc.errors import printable
from roughvisc.units import unit_for
from roughvisc.variables.axes import AXES, axis_of


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
    parts: list[Text | Table] = [Text(printable(f"{dataset.attrs['title'] or 'untitled'}: {name}"), style="bold")]
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
    return Group(*parts, *(Text(note, style="italic") for note in notes))


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
