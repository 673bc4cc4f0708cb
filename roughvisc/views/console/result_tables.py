"""Tables on the command line of one result, over whichever axis its rows lie."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import xarray as xr
from rich.console import Group

from roughvisc.observables.leakage import closing_times
from roughvisc.variables import AXES, CONDUCTANCES, GRID_ERROR, VARIABLES, Axis, axis_of, variables_in_table
from roughvisc.views.console.tables import accuracy_rows, number, readable, two_columns

#: Part of the friction force from which on a summary shows the force across the motion.
_ACROSS = 0.05
#: Variables of a table of cases that stand beside another one, or bound it.
_BESIDE = {
    "contact_fraction",
    "friction_force_across",
}


def result_table(dataset: xr.Dataset) -> Group:
    """Summary of a result: what came out, how accurate it is, what it cost."""
    axis = AXES[axis_of(dataset)]
    row = dataset.isel({axis.name: axis.telling_row(dataset)})
    where = f"at {axis.place(float(row[axis.name]), 3)}" if axis.telling else "at the end"
    shown = [name for name in variables_in_table("last") if name in row and name != axis.name and name not in _BESIDE]
    rows = [
        ("Grid", f"{dataset.sizes['x']} x {dataset.sizes['y']} cells, {dataset.attrs.get('boundary', '?')} boundary"),
        (axis.rows.capitalize(), _extent(dataset, axis)),
        *((f"{VARIABLES[name].label} {where}", _value(dataset, row, name, axis)) for name in shown),
        *_across(row, where),
        *accuracy_rows([dataset], dataset.attrs.get("tolerance")),
        *(
            (f"Accuracy: worst {VARIABLES[name].long_name}", number(dataset[name]))
            for name in dict.fromkeys(GRID_ERROR.values())
            if name in dataset and (dataset[name] != 0).any()
        ),
        # a file that another program has written may not state its cost
        *([("Cost: convolutions", f"{int(dataset['convolutions'].sum())}")] if "convolutions" in dataset else []),
        *([("Cost: wall time", readable(float(dataset["wall_time"].max()), "s"))] if "wall_time" in dataset else []),
    ]
    return two_columns(rows, dataset.attrs.get("title"))


def _extent(dataset: xr.Dataset, axis: Axis) -> str:
    """How many rows there are, and from where to where."""
    ends = (dataset[axis.name].min(), dataset[axis.name].max())
    places = dict.fromkeys(axis.place(float(end), 3) for end in ends)
    along = f", along {dataset.attrs['direction']}" if "direction" in dataset.attrs else ""
    return f"{dataset.sizes[axis.name]}, from {' to '.join(places)}{along}"


def _value(dataset: xr.Dataset, row: xr.Dataset, name: str, axis: Axis) -> str:
    """Value of a variable in the row that stands for the result, and what belongs to it."""
    value, variable = float(row[name]), VARIABLES[name]
    text = "infinite: full contact" if math.isinf(value) else readable(value, variable.units)
    if name == axis.telling:
        ordered = dataset[name].sortby(axis.name)
        return f"{text}, the largest; {float(ordered[0]):.2g} and {float(ordered[-1]):.2g} at the ends"
    return text + (_MORE[name](dataset, row) if name in _MORE else "")


def _highest(dataset: xr.Dataset, row: xr.Dataset) -> str:
    """The largest nominal pressure, where that is another."""
    end, most = float(row["nominal_pressure"]), float(dataset["nominal_pressure"].max())
    return f", at most {readable(most, 'Pa')}" if most > end * (1 + 1e-6) else ""


def _share(dataset: xr.Dataset, row: xr.Dataset) -> str:
    share = f", {100 * float(row['contact_fraction']):.3g} % of the surface" if "contact_fraction" in row else ""
    counted = row.get("contact_area_counted")
    return share + (f"; {readable(float(counted), 'm^2')} counted" if counted is not None else "")


def _force_error(dataset: xr.Dataset, row: xr.Dataset) -> str:
    known = "friction_force_error" in row
    return f", stated error {readable(float(row['friction_force_error']), 'N')}" if known else ""


def _closing(dataset: xr.Dataset, row: xr.Dataset) -> str:
    """Since when the contact is closed."""
    axis = AXES[axis_of(dataset)]
    if closes := closing_times(dataset):
        return f", closed between {axis.place(closes[0])} and {axis.place(closes[1]).partition(' = ')[2]}"
    return "" if dataset["leak_rate"].values.any() else f", closed at all {axis.rows}"


def _known_to(name: str) -> Callable[[xr.Dataset, xr.Dataset], str]:
    def more(dataset: xr.Dataset, row: xr.Dataset) -> str:
        value, error = float(row[name]), float(row[f"{name}_error"])
        return f", known to {100 * error / value:.2g} %" if 0 < value < math.inf else ""

    return more


#: What a summary says of some variables beside their value.
_MORE: dict[str, Callable[[xr.Dataset, xr.Dataset], str]] = {
    "nominal_pressure": _highest,
    "contact_area": _share,
    "friction_force": _force_error,
    "leak_rate": _closing,
    **{name: _known_to(name) for name in CONDUCTANCES},
}


def _across(row: xr.Dataset, where: str) -> list[tuple[str, Any]]:
    """The force across the motion where it is a sizeable part of the friction force; of old results it is not known."""
    if "friction_force_across" not in row:
        return []
    across, along = (float(row[name]) for name in ("friction_force_across", "friction_force"))
    if not abs(across) > _ACROSS * abs(along):
        return []
    side = "left" if across > 0 else "right"
    return [("Force across the motion", f"{readable(abs(across), 'N')} to the {side} {where}")]
