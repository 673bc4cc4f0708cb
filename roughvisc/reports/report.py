"""Self-contained HTML page about one or many results, without scripts."""

from __future__ import annotations

import base64
import io
import json
from contextlib import suppress
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from jinja2 import Environment, PackageLoader
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.labels import cost_of, warnings_of
from roughvisc.observables.frames import expect_result
from roughvisc.plot import style
from roughvisc.plot.fields import surface
from roughvisc.plot.save import DEFAULT, FIGURES, figures_of, in_parallel, results_of_sweep, varies_surface
from roughvisc.plot.sweep import sweep_figures
from roughvisc.study.audit import audit
from roughvisc.study.case_text import case_words, study_text
from roughvisc.study.storage.folder import atomic_write, no_results, recorded_failure, result_files
from roughvisc.study.storage.netcdf import open_result
from roughvisc.study.storage.sweep_data import numbers_of, read_sweep
from roughvisc.topography.filters import off_plane
from roughvisc.topography.parameters import parameters
from roughvisc.units import unit_for
from roughvisc.variables import AXES, IN_TABLE, VARIABLES, axis_of

#: Largest number of cases with figures, audit and study, which are evenly spread.
_SHOWN = 6
#: Resolution of pictures, and the width from which a narrow screen scrolls them. [1/inch], [inch]
_DPI, _WIDE = 110, 5.5
#: Attributes that state how a result was computed and where its surface came from.
_SETTINGS = (
    *("source", "direction", "boundary", "tolerance", "memory", "series_error", "case_key"),
    *("surface_sha256", "source_file", "format", "instrument", "channel", "recipe", "filled_points"),
)
#: Surface parameters shown.
_PARAMETERS = ("Sa", "Sq", "Ssk", "Sku", "Sz", "Sdq", "Sdr", "missing_fraction")


def report(results: str | Path | xr.Dataset, out: str | Path | None = None, *, processes: int = 1) -> Path:
    """Write a page that shows results: cases, accuracy, figures, surface, assumptions, and how to repeat them.

    Parameters
    ----------
    results : path or xarray.Dataset
        A result file, a folder of result files, or one case's result.
    out : path, optional
        File to write. Default: ``report.html`` in the folder of results, or ``STEM-report.html`` next to a result file.
    processes : int
        Number of processes that draw the figures. Several processes need a main module that may be imported again.

    Returns
    -------
    pathlib.Path
        The self-contained file. Its table has all cases. Figures, audit and study show up to 6 cases, evenly spread.

    Raises
    ------
    InputError
        If there are zero results, or a Dataset comes without `out`.
    """
    page: dict[str, Any] = {"failures": [], "figures": []}
    sources, numbers = [results], {}
    if isinstance(results, xr.Dataset):
        if out is None:
            raise InputError("out is None: expected the name of the page, if a Dataset is given")
    elif (folder := Path(results)).is_dir():
        out = out or folder / "report.html"
        sources, page["failures"] = result_files(folder), _failures(folder)
        if not sources and not page["failures"]:
            raise no_results(folder)
        numbers = numbers_of(read_sweep(folder))
        sources.sort(key=lambda path: numbers.get(path.stem, len(numbers)))
        if len(sources) > 1 and (swept := results_of_sweep(folder)) is not None:
            page["figures"] = [_picture(caption, figure) for _, caption, figure in sweep_figures(swept)]
    else:
        out, sources = out or folder.with_name(f"{folder.stem}-report.html"), [folder]
    shown = set(np.linspace(0, len(sources) - 1, min(len(sources), _SHOWN)).astype(int).tolist())
    page["cases"] = in_parallel(_case, [(one, i, i in shown) for i, one in enumerate(sources)], processes, "report")
    for number, case in enumerate(page["cases"]):
        case["number"] = numbers.get(case["key"], "") if numbers else number
    titles = list(dict.fromkeys(case["title"] for case in page["cases"]))
    page["title"] = f"{len(page['cases'])} results" if len(titles) > 1 else titles[0] if titles else "No result"
    page["headings"] = list(dict.fromkeys(heading for case in page["cases"] for heading in case["cells"]))
    page["written"] = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    page["version"] = metadata.version("roughvisc")
    options = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True}
    template = Environment(loader=PackageLoader("roughvisc.reports", "."), **options).get_template("report.html.jinja")
    with atomic_write(out) as temporary:
        temporary.write_text(template.render(page), encoding="utf-8")
    return Path(out)


def _failures(folder: Path) -> list[dict[str, str]]:
    """Return the failed cases, from their records."""
    found = []
    for path in sorted(folder.glob("*.failed.json")):
        key = path.name.partition(".")[0]
        record = recorded_failure(folder, key)
        words = record.get("case", {}).get("title", ""), case_words(record.get("case", {}))
        message = record.get("message", "the record cannot be read")
        found.append({"key": key, "title": ": ".join(filter(None, words)), "message": message})
    return found


@matplotlib.rc_context(style.STYLE)
def _picture(caption: str, figure: Figure) -> dict[str, Any]:
    """Return a figure as a PNG in a data URL, with its caption."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=_DPI)
    src = f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"
    return {"caption": caption, "src": src, "wide": figure.get_figwidth() > _WIDE}


def _case(job: tuple[Path | xr.Dataset, int, bool]) -> dict[str, Any]:
    """Return one case of the page: its row in the table and, if shown, figures, assumptions, surface and study."""
    source, number, is_shown = job
    if isinstance(source, Path):
        with open_result(source) as dataset:
            return _case((dataset, number, is_shown))
    expect_result(source, "x", "y")
    case, history = json.loads(source.attrs.get("case", "{}")), str(source.attrs.get("history", "")).splitlines()
    title = str(case.get("title") or source.attrs.get("title") or f"case {number}")
    found: dict[str, Any] = {"title": title, "name": case_words(case) or title, "cells": _cells(source)}
    found["key"] = str(source.attrs.get("case_key", ""))
    if not is_shown:
        return found
    attributes = {**(source["height"].attrs if "height" in source else {}), **source.attrs}
    found["stated"] = {
        "settings": [[name.replace("_", " "), str(attributes[name])] for name in _SETTINGS if name in attributes],
        "warnings": list(warnings_of(source.attrs).values()),
        "history": history,
        "text": study_text(case) if case else "",
    }
    found["figures"] = [_picture(caption, figure) for _, caption, figure in figures_of(source, DEFAULT)]
    if "height" in source and (number == 0 or varies_surface(case)):
        measured = parameters(off_plane(source["height"].load()))
        rows = [(name.replace("_", " "), measured[name].attrs["long_name"], measured[name]) for name in _PARAMETERS]
        found["surface"] = {
            "name": str(source["height"].attrs.get("source_file") or title),
            "picture": _picture(FIGURES["surface"][2], surface(source)),
            "steps": [line for line in history if line and ": run of " not in line],
            "parameters": [(name, words, _text(value)) for name, words, value in rows],
        }
    with suppress(InputError):  # a Dataset that lacks the variables of an audit
        found["audit"] = list(audit(source))
    return found


def _text(value: xr.DataArray) -> str:
    """Return a number with a suitable unit."""
    return unit_for([float(value)], str(value.attrs.get("units", ""))).text(float(value))


def _cells(dataset: xr.Dataset) -> dict[str, str]:
    """Return heading -> cell of one case in the table of cases."""
    axis = AXES[axis_of(dataset)]
    telling = dataset.isel({axis.name: axis.telling_row(dataset)})
    cells = {"Grid": f"{dataset.sizes['x']} × {dataset.sizes['y']}"}
    cells |= {VARIABLES[name].label: _text(telling[name]) for name in IN_TABLE if name in telling}
    if "stated_error" in dataset and dataset["stated_error"].notnull().any():
        worst, tolerance = float(dataset["stated_error"].max()), dataset.attrs.get("tolerance", np.inf)
        above = f", above the tolerance of {tolerance:g}" if worst > tolerance else ""
        cells[VARIABLES["stated_error"].label] = f"{worst:.2g}{above}"
    seconds = cost_of(dataset)[0]
    if np.isfinite(seconds):
        cells["Wall time"] = unit_for([seconds], "s").text(seconds)
    if warnings := warnings_of(dataset.attrs):
        cells["Warnings"] = ", ".join(warnings)
    return cells
