"""Tables on the command line: results, sweeps, scans."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from rich.console import Group
from rich.table import Table
from rich.text import Text

from roughvisc.errors import printable
from roughvisc.labels import cost_of
from roughvisc.reports.realisations import realisation_rows
from roughvisc.topography.grid import spacing
from roughvisc.units import unit_for
from roughvisc.variables import AXES, GRID_ERROR, VARIABLES, axis_of, variables_in_table

if TYPE_CHECKING:
    import pandas as pd

    from roughvisc.study.execution.run import Outcome
    from roughvisc.topography.inspection import Inspection


def readable(value: float, unit: str) -> str:
    """Return a value in SI with a suitable prefix: ``readable(2e-5, "m")`` is ``"20 µm"``."""
    return unit_for(value, unit).text(value) if np.isfinite(value) else "not known"


def result_table(dataset: xr.Dataset) -> Group:
    """Return a summary of a result: main results with their errors, accuracy, cost."""
    axis = AXES[axis_of(dataset)]
    row = dataset.isel({axis.name: axis.telling_row(dataset)})
    where = f"at {axis.place(float(row[axis.name]), 3)}" if axis.telling else "at the end"
    ends = dict.fromkeys(axis.place(float(end), 3) for end in (dataset[axis.name].min(), dataset[axis.name].max()))
    along = f", along {dataset.attrs['direction']}" if "direction" in dataset.attrs else ""
    rows = [
        ("Grid", f"{dataset.sizes['x']} x {dataset.sizes['y']} cells, {dataset.attrs.get('boundary', '?')} boundary"),
        (axis.rows.capitalize(), f"{dataset.sizes[axis.name]}, from {' to '.join(ends)}{along}"),
    ]
    for name in variables_in_table("last"):
        if name not in row or name == axis.name:
            continue
        value, unit = float(row[name]), VARIABLES[name].units
        text = "infinite: full contact" if math.isinf(value) else readable(value, unit)
        if f"{name}_error" in row and math.isfinite(value):
            text += f"; numerical error {readable(float(row[f'{name}_error']), unit)}"
        text += ", the largest" if name == axis.telling else ""
        rows.append((f"{VARIABLES[name].label} {where}", text))
    rows += accuracy_rows([dataset], dataset.attrs.get("tolerance"))
    for name in dict.fromkeys(GRID_ERROR.values()):
        if name in dataset and (dataset[name] != 0).any():
            rows.append((f"Accuracy: worst {VARIABLES[name].long_name}", largest_text(dataset[name])))
    seconds, convolutions = cost_of(dataset)
    if math.isfinite(seconds):  # a file of another program may lack its cost
        rows.append(("Cost: convolutions", f"{convolutions:.0f}"))
        rows.append(("Cost: wall time", readable(seconds, "s")))
    return two_columns(rows, dataset.attrs.get("title"))


def sweep_table(outcomes: Sequence[Outcome], total: int, title: str) -> Group:
    """Return a summary of a sweep: numbers of cases, accuracy, cost.

    Parameters
    ----------
    outcomes : sequence of Outcome
        One for each distinct case.
    total : int
        Number of cases, including identical ones.
    title : str
        Title of the study.
    """

    finished = [outcome.entry for outcome in outcomes if outcome.entry]
    reused = sum(outcome.reused and outcome.entry is not None for outcome in outcomes)
    spent = [outcome.seconds for outcome in outcomes if not outcome.reused]
    identical = f" ({total - len(outcomes)} identical, computed once)" if total > len(outcomes) else ""
    before = f", {reused} of them before" if reused < len(outcomes) else ", all before: nothing to compute"
    rows = [("Cases", f"{total}{identical}"), ("Finished", f"{len(finished)}{before if reused else ''}")]
    kinds = Counter(outcome.kind for outcome in outcomes if outcome.kind != "done")
    rows += [(kind.capitalize(), str(count)) for kind, count in kinds.items()]
    rows += accuracy_rows([entry.arrays for entry in finished])
    if spent:
        rows.append(("Cost: total wall time", readable(sum(spent), "s")))
    return two_columns(rows, title)


def realisations_tables(table: pd.DataFrame) -> Group:
    """Return the scatter of the realisations of a sweep; empty without realisations.

    Parameters
    ----------
    table : pandas.DataFrame
        Result of :func:`roughvisc.study.storage.results_table.realisations_table`.
    """
    headings, rows, notes = realisation_rows(table)
    shown = Table(box=None, pad_edge=False, collapse_padding=True)
    for heading in headings:
        shown.add_column(Text(heading), justify="left" if heading == "quantity" else "right", overflow="fold")
    for row in rows:
        shown.add_row(*(Text(printable(cell)) for cell in row))
    return Group(*([Text(), shown] if rows else []), *(Text(note, style="italic") for note in notes))


def scan_table(height: xr.DataArray, measures: xr.Dataset, name: str, channels: Sequence[Any] = ()) -> Group:
    """Return channels, size, missing points and areal parameters of a scan.

    Parameters
    ----------
    height : xarray.DataArray
        Heights over (x, y). [m]
    measures : xarray.Dataset
        Result of :func:`roughvisc.parameters`.
    name : str
        Name of the file.
    channels : sequence, optional
        Result of :func:`roughvisc.list_channels`, listed if there are several.
    """
    sides = spacing(height)
    counts = [height.sizes[axis] for axis in ("x", "y")]
    listed = []
    for number, one in enumerate(channels if len(channels) > 1 else ()):
        kind = f"height in {one.unit}" if one.unit else "height without a unit"
        shape = " x ".join(map(str, one.shape))
        listed.append((f"Channel {number}", f"{one.name}: {kind if one.is_height else one.kind}, {shape} points"))
    missing, filled = int(height.isnull().sum()), int(height.attrs.get("filled_points", 0))
    rows = [
        ("Format", str(height.attrs.get("format", "surface card"))),
        ("Instrument", str(height.attrs.get("instrument", ""))),
        ("Channel", str(height.attrs.get("channel", ""))),
        *listed,
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


def findings_table(found: Inspection) -> Group:
    """Return the findings in a scan, each with its recommendation."""
    rows = [(one.name, f"{one.seen}\n-> {one.advice or 'no action needed'}") for one in found.findings.values()]
    return two_columns(rows, "Findings and recommendations")


def accuracy_rows(found: Sequence[Any], tolerance: float | None = None) -> list[tuple[str, str]]:
    """Return the largest stated error of some results; a sweep has no `tolerance`."""
    values = [np.ravel(one["stated_error"]) for one in found if "stated_error" in one]
    limit = f", tolerance {tolerance:g}" if tolerance else ""
    return [("Accuracy: worst stated error", largest_text(np.concatenate(values)) + limit)] if values else []


def largest_text(values: Any) -> str:
    """Return the largest finite number as text."""
    found = np.asarray(values)
    found = found[np.isfinite(found)]
    return f"{found.max():.2g}" if found.size else "not known"


def two_columns(rows: list[tuple[str, Any]], title: str | None) -> Group:
    """Return a title above rows of a label and a value."""
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for label, value in rows:
        table.add_row(Text(label), Text(printable(str(value))))  # names in files may look like markup
    return titled(title, table)


def titled(title: str | None, *parts: Any) -> Group:
    """Return a title above its table."""
    return Group(Text(printable(title or "untitled"), style="bold"), *parts)
