"""Tables on the command line: sweeps, plans, scans."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from rich.console import Group
from rich.table import Table
from rich.text import Text

from roughvisc.errors import printable
from roughvisc.topography.grid import spacing
from roughvisc.units import unit_for
from roughvisc.views.realisation_rows import realisation_rows

if TYPE_CHECKING:
    import pandas as pd

    from roughvisc.study.execution.outcome import Outcome

#: What is stated of accuracy, and its parts, each at its worst.
_ERRORS = {
    "stated_error": "worst stated error",
    "time_error": "worst error of time steps",
    "residual": "contact solver (estimate)",
}


def readable(value: float, unit: str) -> str:
    """A value in SI with a prefix that reads well: ``readable(2e-5, "m")`` is ``"20 µm"``."""
    return unit_for(value, unit).text(value) if np.isfinite(value) else "not known"


def sweep_table(outcomes: Sequence[Outcome], asked: int, title: str) -> Group:
    """Summary of a sweep: how its cases ended, how accurate they are, what they cost.

    Parameters
    ----------
    outcomes : sequence of Outcome
        One a distinct case.
    asked : int
        Number of cases, those alike counted each.
    title : str
        Of the study.
    """
    kinds = [outcome.kind for outcome in outcomes]
    entries = [outcome.entry for outcome in outcomes if outcome.entry]
    reused = sum(outcome.reused and outcome.entry is not None for outcome in outcomes)
    spent = [outcome.seconds for outcome in outcomes if not outcome.reused]
    alike = f" ({asked - len(outcomes)} identical, computed once)" if asked > len(outcomes) else ""
    before = f"{reused} of them before" if reused < len(outcomes) else "all before: nothing to compute"
    rows = [("Cases", f"{asked}{alike}"), ("Finished", f"{len(entries)}, {before}")]
    for kind, label in (
        ("unconverged", "Not converged"),
        ("failed", "Failed"),
        ("hindered", "Interrupted"),
        ("held", "Locked by another run"),
    ):
        rows += [(label, f"{kinds.count(kind)}")] if kind in kinds else []
    rows += accuracy_rows([entry.histories for entry in entries])
    if spent:
        rows.append(("Cost: total wall time", readable(sum(spent), "s")))
    return two_columns(rows, title)


def realisations_tables(table: pd.DataFrame) -> Group:
    """What a sweep's realisations scatter; nothing of one without.

    Parameters
    ----------
    table : pandas.DataFrame
        Of :func:`roughvisc.study.storage.table.realisations_table`.
    """
    headings, rows, notes = realisation_rows(table)
    shown = Table(box=None, pad_edge=False, collapse_padding=True)
    for heading in headings:
        shown.add_column(Text(heading), justify="left" if heading == "quantity" else "right", overflow="fold")
    for row in rows:
        shown.add_row(*(Text(printable(cell)) for cell in row))
    return Group(*([Text(), shown] if rows else []), *(Text(note, style="italic") for note in notes))


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


def scan_table(height: xr.DataArray, measures: xr.Dataset, name: str, channels: Sequence[Any] = ()) -> Group:
    """What is in a scan: its channels, its size, what is missing, how rough it is.

    Parameters
    ----------
    height : xarray.DataArray
        Heights over (x, y). [m]
    measures : xarray.Dataset
        Of :func:`roughvisc.parameters`.
    name : str
        Of the file.
    channels : sequence, optional
        Of :func:`roughvisc.list_channels`; told where there are several.
    """
    sides = spacing(height)
    counts = [height.sizes[axis] for axis in ("x", "y")]
    missing, filled = int(height.isnull().sum()), int(height.attrs.get("filled_points", 0))
    rows = [
        ("Format", str(height.attrs.get("format", "surface card"))),
        ("Instrument", str(height.attrs.get("instrument", ""))),
        ("Channel", str(height.attrs.get("channel", "")) + (", one of:" if len(channels) > 1 else "")),
        ("Other channels", "" if len(channels) > 1 else str(height.attrs.get("other_channels", ""))),
        *(_channel_row(i, one) for i, one in enumerate(channels if len(channels) > 1 else ())),
        ("Orientation", str(height.attrs.get("orientation", ""))),
        ("Size", " x ".join(readable(n * d, "m") for n, d in zip(counts, sides, strict=True))),
        ("Shape", f"{counts[0]} x {counts[1]} points"),
        ("Spacing", " x ".join(readable(d, "m") for d in sides)),
        ("Missing points", f"{missing} ({100 * missing / height.size:.2g} %)" if missing else "none"),
        ("Filled points", f"{filled} ({height.attrs.get('fill_method')})" if filled else ""),
        ("Height range", readable(float(height.max() - height.min()), "m")),
    ]
    named = {**{parameter: parameter for parameter in ("Sa", "Sq", "Ssk", "Sku", "Sz", "Sdr")}, "Sdq": "rms slope"}
    for parameter, label in named.items():
        unit = str(measures[parameter].attrs["units"])
        rows.append((f"{label}, levelled", readable(float(measures[parameter]), unit)))
    return two_columns([row for row in rows if row[1]], name)


def _channel_row(index: int, channel: Any) -> tuple[str, str]:
    kind = f"height in {channel.unit}" if channel.unit else "height without a unit"
    shape = " x ".join(map(str, channel.shape))
    described = f"{channel.name}: {kind if channel.is_height else channel.kind}, {shape} points"
    return f"Channel {index}", described


def accuracy_rows(found: Sequence[Any], tolerance: float | None = None) -> list[tuple[str, str]]:
    """The largest stated error of some results, and its parts; of a sweep, whose tolerances may differ, without one."""
    rows = []
    for name, label in _ERRORS.items():
        values = [np.ravel(one[name]) for one in found if name in one]
        if values:
            asked = f", tolerance {tolerance:g}" if tolerance and not rows else ""
            rows.append((f"Accuracy: {label}", number(np.concatenate(values)) + asked))
    return rows


def number(values: Any) -> str:
    """The largest of some numbers that are known."""
    found = np.asarray(values)
    found = found[np.isfinite(found)]
    return f"{found.max():.2g}" if found.size else "not known"


def two_columns(rows: list[tuple[str, Any]], title: str | None) -> Group:
    """A title and rows of a label and a value."""
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for label, value in rows:
        table.add_row(Text(label), Text(printable(str(value))))  # names in files may look like markup
    return titled(title, table)


def titled(title: str | None, *parts: Any) -> Group:
    """A title above what it is of."""
    return Group(Text(printable(title or "untitled"), style="bold"), *parts)
