"""Rows of the page's table of cases: what came out of each, how accurate it is, what it cost."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.plot.case_text import case_words, varied_texts
from roughvisc.units import unit_for
from roughvisc.variables import AXES, NOT_CONVERGED, VARIABLES, Axis, axis_of


def table_row(dataset: xr.Dataset, source: Any, number: int) -> dict[str, Any]:
    """One case in the table, and what reproduces it."""
    case = json.loads(dataset.attrs.get("case", "{}"))
    title = str(case.get("title") or dataset.attrs.get("title") or f"case {number}")
    words = case_words(case)
    axis = AXES[axis_of(dataset)]
    last = dataset.isel({axis.name: axis.telling_row(dataset)})
    status = dataset["status"].values if "status" in dataset else np.zeros(0, int)
    bad = int((status == NOT_CONVERGED).sum())
    return {
        "title": title,
        "name": words or title,
        "words": words,
        "file": Path(source).name if isinstance(source, Path) else "",
        "key": str(dataset.attrs.get("case_key", "")),
        "varied": varied_texts(case),
        "grid": f"{dataset.sizes['x']} × {dataset.sizes['y']}",
        "count": dataset.sizes[axis.name],
        "rows": axis.rows.capitalize(),
        "telling": _telling(last, axis) if axis.telling else "",
        "telling_label": VARIABLES[axis.telling].label.lower() if axis.telling else "",
        "force": _largest(dataset, "force"),
        "nominal_pressure": _largest(dataset, "nominal_pressure"),
        "approach": _largest(last, "approach"),
        "area": _largest(last, "contact_area"),
        "fraction": f"{100 * float(last['contact_fraction']):.3g} %" if "contact_fraction" in last else "",
        "stated_error": _worst(dataset, "stated_error"),
        "time_error": _worst(dataset, "time_error"),
        "residual": _worst(dataset, "residual"),
        "missed": _missed(dataset),
        "status": f"{bad} of {len(status)} {axis.rows} not converged" if bad else "converged" if len(status) else "",
        "bad": bool(bad),
        "convolutions": f"{int(dataset['convolutions'].sum())}" if "convolutions" in dataset else "",
        "wall_time": _largest(dataset, "wall_time"),
        "surface": json.dumps(case.get("surface", {})) + str(dataset.attrs.get("surface_sha256", number)),
    }


def _telling(row: xr.Dataset, axis: Axis) -> str:
    """Value by which a row stands for the result, and where that is."""
    value = float(row[axis.telling])
    text = unit_for([value], VARIABLES[axis.telling].units).text(value)
    return f"{text} at {axis.place(float(row[axis.name]), 3).partition(' = ')[2]}"


def _largest(dataset: xr.Dataset, name: str) -> str:
    """The largest value of a variable, or that of the one row given."""
    if name not in dataset:
        return ""
    value = float(dataset[name].max())
    return unit_for([value], VARIABLES[name].units).text(value)


def _worst(dataset: xr.Dataset, name: str) -> str:
    known = name in dataset and np.isfinite(dataset[name]).any()
    return f"{float(dataset[name].max()):.2g}" if known else "not known"


def _missed(dataset: xr.Dataset) -> bool:
    """Whether the stated error is above the requested tolerance."""
    tolerance = dataset.attrs.get("tolerance")
    return tolerance is not None and "stated_error" in dataset and bool((dataset["stated_error"] > tolerance).any())
