"""Rows of the page's table of cases: what came out of each, how accurate it is, what it cost."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.variables import NOT_CONVERGED
from roughvisc.variables.axes import AXES, axis_of
from roughvisc.views.figures.axes import unit_for
from roughvisc.views.sweep_figures.case_text import case_words, varied_texts


def table_row(dataset: xr.Dataset, source: Any, number: int) -> dict[str, Any]:
    """One case in the table, and what reproduces it."""
    case = json.loads(dataset.attrs.get("case", "{}"))
    title = str(case.get("title") or dataset.attrs.get("title") or f"case {number + 1}")
    words = case_words(case)
    over = axis_of(dataset)
    last = dataset.isel({over: AXES[over].telling_row(dataset)})
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
        "times": dataset.sizes[over],
        "rows": "Times" if over == "time" else AXES[over].rows.capitalize(),
        "friction": _friction(last) if over == "speed" else "",
        "force": _largest(dataset, "force", "N"),
        "nominal_pressure": _largest(dataset, "nominal_pressure", "Pa"),
        "approach": _last(last, "approach", "m"),
        "area": _last(last, "contact_area", "m^2"),
        "fraction": f"{100 * float(last['contact_fraction']):.3g} %" if "contact_fraction" in last else "",
        "stated_error": _worst(dataset, *_stated(dataset)),
        "time_error": _worst(dataset, "time_error"),
        "residual": _worst(dataset, AXES[over].residual),
        "missed": _missed(dataset),
        "status": f"{bad} of {len(status)} {over}s not converged" if bad else "converged" if len(status) else "",
        "bad": bool(bad),
        "convolutions": f"{int(dataset['convolutions'].sum())}" if "convolutions" in dataset else "",
        "wall_time": _largest(dataset, "wall_time", "s"),
        "surface": json.dumps(case.get("surface", {})) + str(dataset.attrs.get("surface_sha256", number)),
        "view": None,
    }


def _stated(dataset: xr.Dataset) -> tuple[str, ...]:
    """What is held against the tolerance; of sliding, earlier versions stated its parts alone."""
    return ("stated_error",) if "stated_error" in dataset else ("pressure_residual", "friction_residual")


def _friction(row: xr.Dataset) -> str:
    speed = float(row["speed"])
    return f"{float(row['friction_coefficient']):.3g} at {unit_for([speed], 'm/s').text(speed, 3)}"


def _largest(dataset: xr.Dataset, name: str, si: str) -> str:
    if name not in dataset:
        return ""
    value = float(dataset[name].max())
    return unit_for([value], si).text(value)


def _last(last: xr.Dataset, name: str, si: str) -> str:
    return unit_for([float(last[name])], si).text(float(last[name])) if name in last else ""


def _worst(dataset: xr.Dataset, *names: str) -> str:
    known = [float(dataset[name].max()) for name in names if name in dataset and np.isfinite(dataset[name]).any()]
    return f"{max(known):.2g}" if known else "not known"


def _missed(dataset: xr.Dataset) -> bool:
    """Whether the stated error is above the tolerance asked for."""
    tolerance = dataset.attrs.get("tolerance")
    stated = [name for name in _stated(dataset) if name in dataset]
    return tolerance is not None and any(bool((dataset[name] > float(tolerance)).any()) for name in stated)
