"""Tables on the command line: results, sweeps, scans."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from rich.console import Group
from rich.table import Table
from rich.text import Text

from roughvisc.errors import printable
from roughvisc.labels import cost_of, grid_error_of
from roughvisc.topography.grid import spacing
from roughvisc.units import unit_for
from roughvisc.variables import AXES, VARIABLES, axis_of, in_table

if TYPE_CHECKING:
    from roughvisc.runs.run import Outcome
    from roughvisc.topography.inspection import Inspection


def columns(headings: Sequence[str], rows: Iterable[Sequence[Any]], left: Sequence[str] = ()) -> Table:
    """Return rows of numbers and texts under their headings; some columns are aligned to the left."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for heading in headings:
        table.add_column(Text(heading), justify="left" if heading in left else "right", overflow="fold")
    for row in rows:
        table.add_row(*(Text(printable(str(cell))) for cell in row))  # texts of users may look like markup
    return table


def two_columns(rows: Iterable[tuple[str, Any]], title: str | None) -> Group:
    """Return a title above rows of a label and a value; rows without a value are left out."""
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for label, value in rows:
        if value != "":
            table.add_row(Text(label), Text(printable(str(value))))
    return titled(title, table)


def titled(title: str | None, *parts: Any) -> Group:
    """Return a title above its table."""
    return Group(Text(printable(title or "untitled"), style="bold"), *parts)


def readable(value: float, unit: str) -> str:
    """Return a value in SI with a suitable prefix: ``readable(2e-5, "m")`` is ``"20 µm"``."""
    if math.isinf(value):
        return "infinite"
    return "not known" if math.isnan(value) else unit_for(value, unit).text(value)


def errors_in_words(row: xr.Dataset, name: str) -> str:
    """Return the errors of a quantity relative to its value, as ``" (numerical 0.013 %, grid 2.5 %)"``.

    Errors that are not known are left out. The error of a value of zero stands with its unit.

    Parameters
    ----------
    row : xarray.Dataset
        One row of a result.
    name : str
        Name of the quantity.
    """
    name = "contact_area" if name == "contact_fraction" else name  # which have equal relative errors
    variable = VARIABLES[name]
    value = abs(float(row[name]))
    parts = []
    if variable.error in row and float(row[variable.error]) != 0:  # zero if prescribed
        size = float(row[variable.error])
        parts.append(("numerical", percent(size / value) if value > 0 else readable(size, variable.units), size))
    if variable.grid_error in row and value > 0:
        size = float(row[variable.grid_error])
        parts.append(("grid", percent(size), size))
    known = ", ".join(f"{kind} {text}" for kind, text, size in parts if math.isfinite(size))
    return f" ({known})" if known else ""


def percent(part: float) -> str:
    """Return a part with two digits: ``percent(1.3e-4)`` is ``"0.013 %"``."""
    return f"{100 * part:.2g} %" if part == 0 or part >= 1e-7 else "< 0.00001 %"


def worst_error(found: Iterable[Any]) -> str:
    """Return the largest known stated error of some results as text."""
    errors = np.concatenate(
        [[-np.inf], *(np.ravel(result["stated_error"]) for result in found if "stated_error" in result)]
    )
    largest = np.max(errors, where=np.isfinite(errors), initial=-np.inf)
    return percent(largest) if largest >= 0 else "not known"


def result_table(dataset: xr.Dataset) -> Group:
    """Return a summary of a result: main results with their errors, accuracy, cost."""
    axis = AXES[axis_of(dataset)]
    row = dataset.isel({axis.name: axis.telling_row(dataset)})
    where = f"at {axis.place(float(row[axis.name]), 3)}" if axis.telling else "at the end"
    rows = [
        ("Grid", f"{dataset.sizes['x']} x {dataset.sizes['y']} cells, {dataset.attrs.get('boundary', '?')} boundary"),
        (axis.rows.capitalize(), f"{dataset.sizes[axis.name]}, to {axis.place(float(dataset[axis.name].max()), 3)}"),
    ]
    for name, variable in in_table("value").items():
        if name in row and name != axis.name:
            text = readable(float(row[name]), variable.units) + errors_in_words(row, name)
            rows.append((f"{variable.label} {where}", text))
        if name == "contact_area" and name in row and not axis.telling:
            most = dataset.isel({axis.name: int(np.argmax(dataset[name].values))})
            text = readable(float(most[name]), "m^2")
            place = axis.place(float(most[axis.name]), 3)
            if text != readable(float(row[name]), "m^2"):
                rows.append((f"Largest {VARIABLES[name].label.lower()}", f"{text} at {place}"))
    seconds, convolutions = cost_of(dataset)
    tolerance = dataset.attrs.get("tolerance", math.nan)
    rows.append(("Accuracy: worst stated error", f"{worst_error([dataset])}, tolerance {percent(tolerance)}"))
    rows.append(("Accuracy: worst grid error", grid_error_of([dataset])))
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
    kinds = Counter(outcome.kind for outcome in outcomes if outcome.kind != "done")
    rows = [
        ("Cases", f"{total} ({total - len(outcomes)} identical, computed once)" if total > len(outcomes) else total),
        ("Finished", f"{len(finished)}, {reused} of them before" if reused else len(finished)),
        *((kind.capitalize(), count) for kind, count in kinds.items()),
        ("Accuracy: worst stated error", worst_error(entry.arrays for entry in finished)),
        ("Accuracy: worst grid error", grid_error_of(entry.arrays for entry in finished)),
        ("Cost: total wall time", readable(sum(ended.seconds for ended in outcomes if not ended.reused), "s")),
    ]
    return two_columns(rows, title)


def scan_table(height: xr.DataArray, measures: xr.Dataset, name: str) -> Group:
    """Return format, channels, size, missing points and areal parameters of a scan.

    Parameters
    ----------
    height : xarray.DataArray
        Heights over (x, y). [m]
    measures : xarray.Dataset
        Result of :func:`roughvisc.parameters`.
    name : str
        Name of the file.
    """
    counts = height.shape
    sides = spacing(height)
    missing = int(height.isnull().sum())
    stated = ("format", "instrument", "channel", "other_channels", "orientation")
    rows = [(key.capitalize().replace("_", " "), height.attrs.get(key, "")) for key in stated]
    rows += [
        ("Size", " x ".join(readable(n * d, "m") for n, d in zip(counts, sides, strict=True))),
        ("Shape", f"{counts[0]} x {counts[1]} points"),
        ("Spacing", " x ".join(readable(d, "m") for d in sides)),
        ("Missing points", f"{missing} ({100 * missing / height.size:.2g} %)" if missing else "none"),
        ("Filled points", height.attrs.get("filled_points", "")),
        ("Height range", readable(float(height.max() - height.min()), "m")),
    ]
    for parameter in ("Sa", "Sq", "Ssk", "Sku", "Sz", "Sdr", "Sdq"):
        text = readable(float(measures[parameter]), measures[parameter].attrs["units"])
        rows.append((f"{parameter}, levelled", text))
    return two_columns(rows, name)


def findings_table(found: Inspection) -> Group:
    """Return the findings in a scan, each with its recommendation."""
    rows = [
        (name, f"{finding.seen}\n-> {finding.advice or 'no action needed'}") for name, finding in found.findings.items()
    ]
    return two_columns(rows, "Findings and recommendations")
