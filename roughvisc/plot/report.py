"""Self-contained HTML page about one or many results, without scripts."""

from __future__ import annotations

import base64
import gc
import io
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any
from urllib.parse import quote

import matplotlib
import numpy as np
import xarray as xr
from jinja2 import Environment, PackageLoader
from matplotlib.figure import Figure

from roughvisc.arguments import count
from roughvisc.errors import InputError
from roughvisc.judge.audit import audit_of
from roughvisc.labels import cost_of, grid_error_of, warnings_of
from roughvisc.observables.history import expect_result
from roughvisc.paths import path_of, shell_word
from roughvisc.plot import style
from roughvisc.plot.fields import surface
from roughvisc.plot.save import DEFAULT, FIGURES, figures_of, in_parallel, results_of_sweep, varies_surface
from roughvisc.plot.sweep import sweep_figures
from roughvisc.runs.folder import no_results, recorded_failure, result_files, write_text
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.sweep_data import numbers_of, read_sweep
from roughvisc.study.case_text import case_words, study_text
from roughvisc.topography.filters import off_plane
from roughvisc.topography.parameters import parameters
from roughvisc.units import unit_for
from roughvisc.variables import AXES, VARIABLES, axis_of, in_table

#: Largest numbers of cases with audit and study, and with figures; both are evenly spread.
_SHOWN = 6
_DRAWN = 2
#: Resolution of pictures, and the width from which a narrow screen scrolls them. [1/inch], [inch]
_DPI = 110
_WIDE = 5.5
#: Size of a result below which it is read as a whole. [byte]
_LOADED = 64 << 20
#: Surface parameters shown.
_PARAMETERS = ("Sa", "Sq", "Ssk", "Sku", "Sz", "Sdq", "Sdr", "missing_fraction")


@contextmanager
def _rare_garbage_collection() -> Iterator[None]:
    """Collect garbage rarely within the block: figures consist of many small objects, and few become garbage."""
    usual = gc.get_threshold()
    gc.set_threshold(100_000, *usual[1:])
    try:
        yield
    finally:
        gc.set_threshold(*usual)


@_rare_garbage_collection()
def report(results: str | Path | xr.Dataset, path: str | Path | None = None, *, workers: int | None = 0) -> Path:
    """Write a page that shows results: cases, accuracy, figures, surface, assumptions, and how to repeat them.

    Parameters
    ----------
    results : path or xarray.Dataset
        A result file, a folder of result files, or one case's result.
    path : path, optional
        File to write. Default: ``report.html`` in the folder of results, or ``STEM-report.html`` next to a result file.
    workers : int
        Number of processes that draw the figures; 0: this process. Processes need a main module that may be imported
        again.

    Returns
    -------
    pathlib.Path
        The self-contained file. Its table has all cases. Audit and study show up to 6 cases, evenly spread, and
        figures the first and the last one. The page of :func:`roughvisc.plot.page` in the same folder is linked.

    Raises
    ------
    InputError
        If there are zero results, or a Dataset comes without `path`.

    See Also
    --------
    roughvisc.plot.page, roughvisc.to_table

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-3, size=2e-4, shape=15)
    >>> press = rv.Program().load(1e-4, over=0)
    >>> ds = rv.simulate(ball, rv.elastic(1e6), press, times=[0.0], fields=(), progress=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = rv.report(ds, f"{folder}/ball.html").read_text(encoding="utf-8")
    >>> "<html" in page
    True
    """
    page: dict[str, Any] = {
        "rows": "times or speeds",
        "failures": {},
        "figures": [],
        "words": case_words,
        "text": _text,
    }
    out = None if path is None else path_of(path, "path")
    count("workers", workers, 0)
    sources = [results]
    numbers = {}
    histories = {}
    if isinstance(results, xr.Dataset):
        if out is None:
            raise InputError(key="path", found=None, expected="the name of the page, if a Dataset is given")
    elif (folder := path_of(results, "results")).is_dir():
        out = out or folder / "report.html"
        sources = result_files(folder)
        failed = (path.name.partition(".")[0] for path in folder.glob("*.failed.json"))
        page["failures"] = {key: recorded_failure(folder, key) for key in sorted(failed)}
        if not sources and not page["failures"]:
            raise no_results(folder)
        numbers = numbers_of(read_sweep(folder))
        sources.sort(key=lambda path: numbers.get(path.stem, len(numbers)))
        if len(sources) > 1 and (swept := results_of_sweep(folder)) is not None:
            page["figures"] = [_picture(caption, figure) for _, caption, figure in sweep_figures(swept)]
            histories = _histories(swept)
    else:
        out = out or folder.with_name(f"{folder.stem}-report.html")
        sources = [folder]
    shown = _spread(range(len(sources)), _SHOWN)
    drawn_cases = _spread(shown, _DRAWN)
    jobs = [
        (one if i in shown else histories.get(one.stem, one), i, i in shown, i in drawn_cases)
        for i, one in enumerate(sources)
    ]
    page["cases"] = in_parallel(_case, jobs, workers or 0, "report")
    drawn = set()
    for number, case in enumerate(page["cases"]):
        case["number"] = numbers.get(case["key"], "") if numbers else number
        if "surface" in case:  # once, if several cases share it
            picture = case["surface"]["picture"]["src"]
            case["surface"] = None if picture in drawn else case["surface"]
            drawn.add(picture)
    page["audits"] = _audits(page["cases"])
    is_file = isinstance(results, str | Path) and not Path(results).is_dir()
    explorer = Path(out).with_name(f"{Path(results).stem}-page.html" if is_file else "page.html")
    page["explorer"] = quote(explorer.name) if explorer.is_file() else ""
    page["explored"] = shell_word(Path(results)) if isinstance(results, str | Path) else ""
    page["written"] = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    page["version"] = metadata.version("roughvisc")
    templates = Environment(loader=PackageLoader("roughvisc.plot", "."), autoescape=True, trim_blocks=True)
    return write_text(Path(out), templates.get_template("report.html.jinja").render(page))


def _spread(numbers: Sequence[int], most: int) -> list[int]:
    """Return up to some evenly spread numbers, with the first and the last one."""
    places = np.linspace(0, len(numbers) - 1, min(len(numbers), most)).round().astype(int)
    return [numbers[place] for place in places]


def _histories(results: xr.Dataset) -> dict[str, xr.Dataset]:
    """Return key -> histories of each case of a sweep, which need not be read from its file again."""
    if results["case_key"].dims != ("case",) or not {"x", "y"} <= results.variables.keys():
        return {}
    return {str(key): results.isel(case=i) for i, key in enumerate(results["case_key"].values)}


def _audits(cases: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return one audit for all cases with the same verdicts, with the range of each number and its worst case."""
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for case in cases:
        if "audit" in case:
            groups.setdefault(tuple((one.name, one.verdict) for one in case["audit"]), []).append(case)
    audits = []
    for alike in groups.values():
        rows = []
        for findings in zip(*(case["audit"] for case in alike), strict=True):
            ordered = sorted(findings, key=lambda one: one.number)
            texts = list(dict.fromkeys((ordered[0].shown, ordered[-1].shown)))
            rows.append({"worst": ordered[-1], "shown": " to ".join(texts)})
        audits.append({"cases": alike, "rows": rows})
    return audits


@matplotlib.rc_context(style.STYLE)
def _picture(caption: str, figure: Figure) -> dict[str, Any]:
    """Return a figure as a PNG in a data URL, with its caption."""
    stream = io.BytesIO()
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis) if not axis.label.get_text()):
        axis.set_label_coords(0, 0)  # matplotlib need not measure the numbers to place an empty label
    figure.savefig(stream, format="png", dpi=_DPI)
    src = f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"
    width = figure.get_figwidth()
    return {"caption": caption, "src": src, "wide": width > _WIDE, "width": round(96 * width)}


def _case(job: tuple[Path | xr.Dataset, int, bool, bool]) -> dict[str, Any]:
    """Return one case of the page: its row in the table and, if shown, assumptions, surface and study, and figures."""
    source, number, is_shown, is_drawn = job
    with open_result(source) if isinstance(source, Path) else nullcontext(source) as dataset:
        dataset = expect_result(dataset, "x", "y")
        if is_shown and dataset.nbytes < _LOADED:
            dataset = dataset.load()  # otherwise each frame opens the file
        case = json.loads(dataset.attrs.get("case", "{}"))
        title = style.title_of(dataset, case, number)
        facts = {"title": title, "name": case_words(case) or title, "key": str(dataset.attrs.get("case_key", ""))}
        facts["cells"] = _cells(dataset)
        return facts | (_details(dataset, case, number, is_drawn) if is_shown else {})


def _details(dataset: xr.Dataset, case: dict[str, Any], number: int, is_drawn: bool) -> dict[str, Any]:
    """Return figures, assumptions and study of one case, and its surface if it is the first case or differs."""
    height = dataset.get("height", xr.DataArray())
    details: dict[str, Any] = {
        "attributes": {**height.attrs, **dataset.attrs},
        "text": study_text(case) if case else "",
    }
    details["warnings"] = warnings_of(dataset.attrs)
    details["figures"] = [
        _picture(caption, figure) for _, caption, figure in figures_of(dataset, DEFAULT if is_drawn else ())
    ]
    if height.ndim and (number == 0 or varies_surface(case)):
        picture = _picture(FIGURES["surface"][2], surface(height))
        details["surface"] = {"picture": picture, "parameters": parameters(off_plane(height.load()))[[*_PARAMETERS]]}
    with suppress(InputError):  # a Dataset that lacks the variables of an audit
        details["audit"] = list(audit_of(dataset))
    return details


def _text(value: xr.DataArray) -> str:
    """Return a number with a suitable unit."""
    return unit_for([float(value)], str(value.attrs.get("units", ""))).text(float(value))


def _cells(dataset: xr.Dataset) -> dict[str, str]:
    """Return heading -> cell of one case in the table of cases."""
    axis = AXES[axis_of(dataset)]
    telling = dataset.isel({axis.name: axis.telling_row(dataset)})
    cells = {"Grid": f"{dataset.sizes['x']} × {dataset.sizes['y']}"}
    cells |= {variable.label: _text(telling[name]) for name, variable in in_table("value").items() if name in telling}
    if "stated_error" in dataset and dataset["stated_error"].notnull().any():
        worst = float(dataset["stated_error"].max())
        tolerance = dataset.attrs.get("tolerance", np.inf)
        above = f", above the tolerance of {tolerance:g}" if worst > tolerance else ""
        cells[VARIABLES["stated_error"].label] = f"{worst:.2g}{above}"
    cells[VARIABLES["grid_error"].label] = grid_error_of([dataset])
    if np.isfinite(seconds := cost_of(dataset)[0]):
        cells["Wall time"] = unit_for([seconds], "s").text(seconds)
    if warnings := warnings_of(dataset.attrs):
        cells["Warnings"] = ", ".join(warnings)
    return cells
