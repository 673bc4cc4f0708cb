"""Tables on the command line of one result: a history, a curve of friction, or rows over any other axis."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import xarray as xr
from rich.console import Group

from roughvisc.observables.leakage import closing_times
from roughvisc.variables import VARIABLES
from roughvisc.variables.axes import AXES, axis_of
from roughvisc.variables.spots import CONDUCTANCES
from roughvisc.views.console.tables import NOTES, accuracy_rows, number, readable, two_columns

#: Part of the friction force from which on a summary tells the force across the motion.
_ACROSS = 0.05


def result_table(dataset: xr.Dataset) -> Group:
    """Summary of a result: what came out, how accurate it is, what it cost."""
    rows = {"time": _history_rows, "speed": _curve_rows}.get(axis_of(dataset), _general_rows)(dataset)
    grid = f"{dataset.sizes['x']} x {dataset.sizes['y']} cells, {dataset.attrs.get('boundary', '?')} boundary"
    return two_columns([("Grid", grid), *rows], dataset.attrs.get("title"))


def _general_rows(dataset: xr.Dataset) -> list[tuple[str, Any]]:
    """Of rows over any axis: where they lie, what the telling one holds, errors and costs."""
    name = axis_of(dataset)
    axis = AXES[name]
    ordered = dataset.sortby(name)
    ends = list(dict.fromkeys(axis.place(float(ordered[name][end]), 3) for end in (0, -1)))
    row = dataset.isel({name: axis.telling_row(dataset)})
    there = axis.place(float(row[name]), 3)
    told = [one for one in axis.in_table("last") if one in row and one != name]
    return [
        (axis.rows.capitalize(), f"{dataset.sizes[name]}, from {' to '.join(ends)}"),
        *(
            (f"{axis.variables[one].label} at {there}", readable(float(row[one]), axis.variables[one].units))
            for one in told
        ),
        *accuracy_rows([dataset], dataset.attrs.get("tolerance")),
        *((label, dataset.attrs[note]) for note, label in NOTES.items() if note in dataset.attrs),
        *_cost(dataset, {"convolutions": "convolutions", "iterations": "solver iterations"}),
    ]


def _curve_rows(dataset: xr.Dataset) -> list[tuple[str, Any]]:
    """Of a curve of friction."""
    ordered = dataset.sortby("speed")
    peak = ordered.isel(speed=int(ordered["friction_coefficient"].argmax("speed")))
    ends = [ordered.isel(speed=0), ordered.isel(speed=-1)]
    low, high = (readable(float(one["speed"]), "m/s") for one in ends)
    friction, fraction = (
        [float(one[name]) for one in (ends[0], peak, ends[1])] for name in ("friction_coefficient", "contact_fraction")
    )
    errors = {name: number(dataset[name]) for name in ("pressure_residual", "friction_residual")}
    return [
        ("Speeds", f"{dataset.sizes['speed']}, from {low} to {high}, along {dataset.attrs.get('direction', '?')}"),
        ("Load", f"{readable(float(peak['force']), 'N')}, {readable(float(peak['nominal_pressure']), 'Pa')} nominal"),
        (
            "Friction coefficient",
            f"{friction[1]:.3g} at {readable(float(peak['speed']), 'm/s')}, the largest; "
            f"{friction[0]:.2g} and {friction[2]:.2g} at the ends",
        ),
        *_across(peak, "there"),
        (
            "Contact area",
            f"{100 * fraction[1]:.3g} % of the grid there; {100 * fraction[0]:.3g} % and "
            f"{100 * fraction[2]:.3g} % at the ends",
        ),
        (
            "Accuracy: worst residuals",
            f"pressure {errors['pressure_residual']}, friction "
            f"{errors['friction_residual']}, tolerance {dataset.attrs.get('tolerance', math.nan):g}",
        ),
        *(
            (f"Accuracy: worst {label}", number(dataset[name]))
            for name, label in (("grid_error_friction", "grid error of friction"), ("grid_error_area", "of the area"))
            if name in dataset
        ),
        *([("Shortest octave of waves", _octave(dataset))] if "last_octave_friction" in dataset else []),
        *((label, dataset.attrs[note]) for note, label in NOTES.items() if note in dataset.attrs),
        *_cost(dataset, {"outer_iterations": "contact problems", "iterations": "solver iterations"}),
    ]


def _history_rows(dataset: xr.Dataset) -> list[tuple[str, Any]]:
    """Of a history."""
    last = dataset.isel(time=-1)
    end = float(last["time"])
    steps = dataset.sizes["time"]
    return [
        ("Kept times", f"{steps}, up to t = {readable(end, 's')}"),
        ("Force at the end", readable(float(last["force"]), "N")),
        *_nominal_pressure(dataset),
        ("Approach at the end", readable(float(last["approach"]), "m")),
        (
            "Contact area at the end",
            f"{readable(float(last['contact_area']), 'm^2')}, {100 * float(last['contact_fraction']):.3g} % of the "
            f"surface; {readable(float(last['contact_area_counted']), 'm^2')} counted",
        ),
        *_slid(last),
        *_leak_rate(dataset),
        *_conductances(dataset),
        *accuracy_rows([dataset], dataset.attrs.get("tolerance")),
        *(
            (f"Accuracy: worst {label}", number(dataset[name]))
            for name, label in (("grid_error", "grid error"), ("grid_error_area", "grid error of the area"))
            if name in dataset
        ),
        *((label, dataset.attrs[note]) for note, label in NOTES.items() if note in dataset.attrs),
        *_cost(dataset, {"convolutions": "convolutions", "iterations": "solver iterations"}),
    ]


def _cost(dataset: xr.Dataset, counters: Mapping[str, str]) -> list[tuple[str, str]]:
    """What it took, as far as that is known: a file that another program has written may not say."""
    counts = [(f"Cost: {label}", f"{int(dataset[name].sum())}") for name, label in counters.items() if name in dataset]
    took = [("Cost: wall time", readable(float(dataset["wall_time"].max()), "s"))] if "wall_time" in dataset else []
    return counts + took


def _octave(dataset: xr.Dataset) -> str:
    """What the waves that a scan hardly resolves add, and what that means where it is much."""
    most = f"adds up to {100 * float(dataset['last_octave_friction'].max()):.2g} % of the friction"
    return f"{most}: what the scan does not resolve may add as much again" if "octave_note" in dataset.attrs else most


def _nominal_pressure(dataset: xr.Dataset) -> list[tuple[str, str]]:
    """At the end, and the largest where that is another; none of a result that was kept without it."""
    if "nominal_pressure" not in dataset:
        return []
    end, most = float(dataset["nominal_pressure"][-1]), float(dataset["nominal_pressure"].max())
    largest = f", at most {readable(most, 'Pa')}" if most > end * (1 + 1e-6) else ""
    return [("Nominal pressure at the end", readable(end, "Pa") + largest)]


def _slid(last: xr.Dataset) -> list[tuple[str, str]]:
    """Distance and friction at the end, of a program that slides."""
    if "sliding_distance" not in last:
        return []
    force = readable(float(last["friction_force"]), "N")
    error = readable(float(last["friction_force_error"]), "N") if "friction_force_error" in last else "not known"
    note = last.attrs.get("slide_note", "")
    return [
        ("Slid", readable(float(last["sliding_distance"]), "m") + (f": {note}" if note else "")),
        (
            "Friction at the end",
            f"coefficient {float(last['friction_coefficient']):.4g}, force {force}, stated error {error}",
        ),
        *_across(last, "at the end"),
    ]


def _across(row: xr.Dataset, where: str) -> list[tuple[str, str]]:
    """The force across the motion where it is a sizeable part of the friction force; of old results it is not known."""
    if "friction_force_across" not in row:
        return []
    across, along = (float(row[name]) for name in ("friction_force_across", "friction_force"))
    if not abs(across) > _ACROSS * abs(along):
        return []
    side = "left" if across > 0 else "right"
    return [("Force across the motion", f"{readable(abs(across), 'N')} towards the {side} {where}")]


def _leak_rate(dataset: xr.Dataset) -> list[tuple[str, str]]:
    """At the end, and since when the contact is closed; none of a result of which it was not asked."""
    if "leak_rate" not in dataset:
        return []
    end = readable(float(dataset["leak_rate"][-1]), "m^3/s")
    if closes := closing_times(dataset):
        end += f", closed between t = {readable(closes[0], 's')} and {readable(closes[1], 's')}"
    elif not dataset["leak_rate"].values.any():
        end += ", closed at every kept time"
    return [("Leak rate at the end", end)]


def _conductances(dataset: xr.Dataset) -> list[tuple[str, str]]:
    """At the end; none of a result of which it was not asked."""
    told = []
    for name in CONDUCTANCES:
        if name in dataset:
            end, error = (float(dataset[one][-1]) for one in (name, f"{name}_error"))
            off = f", known to {100 * error / end:.2g} %" if 0 < end < math.inf else ""
            value = "infinite: full contact" if end == math.inf else readable(end, VARIABLES[name].units)
            told.append((f"{VARIABLES[name].label} at the end", f"{value}{off}"))
    return told
