"""Table of a plan on the command line: what a study will model and what it will cost."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from rich.console import Group
from rich.table import Table
from rich.text import Text

from roughvisc.cli.tables import readable, two_columns
from roughvisc.units import unit_for


def plan_tables(costs: xr.Dataset) -> Group:
    """What a study will model and what it will cost.

    Parameters
    ----------
    costs : xarray.Dataset
        Of :func:`roughvisc.plan`.
    """
    total, attrs = costs.sizes["case"], costs.attrs
    varied = [str(name) for name in costs.coords if name != "case_key"]
    whole = [
        ("Cases", f"{total}, {_side_by_side(attrs['processes'], attrs['threads'], costs)}"),
        *((label, _alike(costs, name)) for name, label in _MODELLED.items()),
        ("Grid", _range_of(costs, _grid)),
        ("Largest nominal pressure", _span(costs["nominal_pressure"], "Pa").removeprefix("about ")),
        ("Contact", _contact(costs)),
        *((f"{name.capitalize()} per case", _span(costs[name], "")) for name in _counts(costs)),
        ("Convolutions per case", _span(costs["convolutions"], "")),
        ("Wall time per case", _span(costs["wall_time"], "s")),
        ("Wall time, all cases", f"about {readable(attrs['wall_time'], 's')}"),
        ("Memory", f"{size(attrs['memory'])} of {size(attrs['free_memory'])} free"),
        ("Disk", f"{size(attrs['disk'])} of {size(attrs['free_disk'])} free"),
        ("Estimated from", f"coarse runs of {int(costs['marched'].sum())} of {total} cases"),
    ]
    parts: list[Any] = [two_columns([row for row in whole if row[1]], attrs.get("title"))]
    parts += [Text(f"Warning: {text}", style="bold red") for text in _warnings(costs)]
    if total > 1:
        parts += [Text(), _case_table(costs, varied)]
        if not costs["marched"].all():
            parts.append(Text("~ Estimated from the coarse run of the most similar case.", style="italic"))
    return Group(*parts)


#: What is modelled, shown once if it is the same in all cases.
_MODELLED = {
    "boundary": "Boundary",
    "memory_model": "Memory of the material",
    "scheme": "Time",
    "program_note": "Program",
    "late_times": "Kept times",
}
#: Cells of a grid on which several threads are used.
_THREADED = 1024**2
#: Cases that a plan lists one by one.
_LISTED = 20


def _grid(row: xr.Dataset) -> str:
    """Cells of a case, and of the part that is solved on."""
    whole, part = ((int(row[f"{name}cells_x"]), int(row[f"{name}cells_y"])) for name in ("", "solved_"))
    solved = f", solved on {part[0]} x {part[1]} of them" if part not in ((0, 0), whole) else ""
    return f"{whole[0]} x {whole[1]} cells{solved}"


def _contact(costs: xr.Dataset) -> str:
    """Return how much comes into contact, and the grids of this estimate."""
    known = costs.isel(case=np.flatnonzero(np.isfinite(costs["contact_fraction"].values)))
    if not known.sizes["case"]:
        return ""
    found = 100 * known["contact_fraction"].values
    parts = " to ".join(dict.fromkeys(f"{float(f'{part:.2g}'):g}" for part in (found.min(), found.max())))
    grids = _range_of(known, lambda row: f"{int(row['coarse_cells_x'])} x {int(row['coarse_cells_y'])}")
    return f"about {parts} % of the area, estimated on {'grids' if ',' in grids else 'a grid'} of {grids} cells"


def _side_by_side(processes: int, threads: int, costs: xr.Dataset) -> str:
    """How many cases at once, and how many threads each may use."""
    large = bool(((costs["cells_x"] * costs["cells_y"]) >= _THREADED).any())
    return f"{processes} in parallel" + (f", {threads} threads each" if large and threads > 1 else "")


def _warnings(costs: xr.Dataset) -> list[str]:
    """What is foreseen in some cases, once, where most is foreseen; and in how many."""
    found, total = [], costs.sizes["case"]
    for name, which in (("warning", "; this is the largest"), ("border_warning", "")):
        warned = np.flatnonzero(costs[name].values != "")
        if warned.size:
            worst = warned[np.argmax(costs["nominal_pressure"].values[warned])]
            several = f" ({warned.size} of {total} cases{which})" if total > 1 else ""
            found.append(f"{costs[name].values[worst]}{several}")
    return found


def _alike(costs: xr.Dataset, name: str) -> str:
    found = list(dict.fromkeys(str(value).rstrip(".") for value in costs[name].values if value))
    text = "; ".join(found[:3]) + (f"; and {len(found) - 3} more" if len(found) > 3 else "")
    if name == "boundary":
        text += ", FFTs padded to twice the grid" if costs["padded"].any() else ", FFTs not padded"
    return text


def _range_of(costs: xr.Dataset, text: Callable[[Any], str]) -> str:
    found = dict.fromkeys(text(costs.isel(case=i)) for i in range(costs.sizes["case"]))
    return ", ".join([*found][:3]) + (f" and {len(found) - 3} more" if len(found) > 3 else "")


def _span(values: xr.DataArray, unit: str) -> str:
    known = values.values[np.isfinite(values.values)]
    if not known.size:
        return "not known"
    ends = [f"{value:.0f}" if not unit else readable(float(value), unit) for value in (known.min(), known.max())]
    return f"about {ends[0]}" if ends[0] == ends[1] else f"about {ends[0]} to {ends[1]}"


def _counts(costs: xr.Dataset) -> list[str]:
    """What is counted: steps of programs, speeds of curves of friction, rows of anything else."""
    return [name for name in ("steps", "speeds") if np.isfinite(costs[name].values).any()] or ["rows"]


def _case_table(costs: xr.Dataset, varied: Sequence[str]) -> Table:
    """Settings and costs of each case: a column has one unit, in its heading."""
    listed = costs.isel(case=slice(_LISTED))
    refused = listed["refusal"].values != ""
    last = [key.rpartition(".")[2] for key in varied]
    names = [
        name if last.count(name) == 1 and not name.isdecimal() else key for name, key in zip(last, varied, strict=True)
    ]
    settings = [
        _column(listed[key].values, name.replace("_", " "), str(listed[key].attrs.get("units", "")))
        for key, name in zip(varied, names, strict=True)
    ]
    counts = [(name, [f"{value:.0f}" for value in listed[name].values]) for name in (*_counts(costs), "convolutions")]
    spent = {"wall_time": "s", "memory": "byte", "disk": "byte"}
    costing = [
        _column(np.where(refused, np.nan, listed[name].values), name.replace("_", " "), unit, 3)
        for name, unit in spent.items()
    ]
    table = Table(box=None, pad_edge=False)
    for heading, _ in (*settings, *counts, *costing):
        table.add_column(Text(heading), justify="right", overflow="fold")
    for i, cut in enumerate(refused):
        mark = "" if bool(listed["marched"][i]) else "~"
        found = [Text("cannot run")] if cut else [Text(mark + cells[i]) for _, cells in (*counts, *costing)]
        table.add_row(*(Text(cells[i]) for _, cells in settings), *found)
    if costs.sizes["case"] > _LISTED:
        table.add_row(Text(f"and {costs.sizes['case'] - _LISTED} more"))
    return table


def _column(values: Any, name: str, si: str, digits: int = 6) -> tuple[str, list[str]]:
    """Heading with the unit that suits all values of a column, and the values in it; texts as they are."""
    if np.asarray(values).dtype.kind not in "iuf":
        return name, [str(value) for value in values]
    known = values[np.isfinite(values)]
    if si == "byte":
        factor, symbol = _bytes(float(known.max(initial=0.0)))
    else:
        unit = unit_for(known, si)
        factor, symbol = unit.factor, unit.symbol
    cells = [
        "half-space" if value == math.inf else "" if np.isnan(value) else f"{value / factor:.{digits}g}"
        for value in values
    ]
    return (f"{name}\n[{symbol}]" if symbol else name), cells


def _bytes(count: float) -> tuple[float, str]:
    """Unit that suits a number of bytes."""
    return next((one for one in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB")) if count >= one[0]), (1e3, "kB"))


def size(count: float) -> str:
    """A number of bytes as one reads it.

    Examples
    --------
    >>> size(2131948), size(24.5e9)
    ('2.13 MB', '24.5 GB')
    """
    factor, unit = _bytes(count)
    return f"{count / factor:.3g} {unit}"
