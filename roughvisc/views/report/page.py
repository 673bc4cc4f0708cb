"""Self-contained HTML report of one or many results, without scripts."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jinja2 import Environment, PackageLoader
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.labels import warnings_of
from roughvisc.plot import area_against_load, case_text, figures_of, style, surface
from roughvisc.plot.coarsened import drawn
from roughvisc.plot.fields import draw_map, label_plane, measured_part, plane_unit
from roughvisc.plot.rows import require
from roughvisc.plot.sweep_files import results_of, sweep_figures
from roughvisc.study.audit.audit import audit
from roughvisc.study.audit.limits import Finding
from roughvisc.study.storage.files import atomic_write
from roughvisc.study.storage.index import index_of
from roughvisc.study.storage.store import no_results, open_result, result_files
from roughvisc.study.storage.sweep_cases import number_by_key, read_sweep
from roughvisc.study.storage.table import realisations_table
from roughvisc.topography.parameters import levelled_parameters
from roughvisc.units import unit_for
from roughvisc.variables import axis_of
from roughvisc.views.realisation_rows import realisation_rows
from roughvisc.views.report.case_table import table_row
from roughvisc.views.report.treatment import Treatment, treatment

#: Cases of which figures and the audit are shown; of more, evenly spread ones.
_PICTURED = 6
#: Cases up to which every figure is drawn.
_DRAWN = 3
#: Cases whose studies are shown; of more, evenly spread ones.
_STATED = 60
#: Resolution of pictures. [1/inch]
_DPI = 110
#: Width of a figure that a narrow screen shows without scrolling. [inch]
_WIDE = 5.5
#: Surfaces that are described.
_SURFACES = 4
#: Attributes that state how a result was computed, and whence its surface came.
_SETTINGS = (
    "source",
    "direction",
    "boundary",
    "tolerance",
    "memory",
    "series_error",
    "case_key",
)
_ORIGIN = ("surface_sha256", "source_file", "format", "instrument", "channel", "recipe", "filled_points")
#: Headings, rows and notes of a table.
Rows = tuple[list[str], list[list[str]], list[str]]
#: Parameters shown, with the name of each.
_PARAMETERS = ("Sa", "Sq", "Ssk", "Sku", "Sz", "Sdq", "Sdr", "missing_fraction")


def report(results: str | Path | xr.Dataset | Sequence[xr.Dataset], out: str | Path | None = None) -> Path:
    """Write a page that shows results: cases, accuracy, figures, surface, assumptions, and how to repeat them.

    Parameters
    ----------
    results : path, xarray.Dataset, or sequence of them
        A result file, a folder of them, one case's result, or several.
    out : path, optional
        File to write. Default: ``report.html`` in the folder, or beside the file with its name and ``-report.html``.

    Returns
    -------
    pathlib.Path
        The file, which needs no other file. Its table has all cases. Figures are shown of up to 6 cases, evenly spread.

    Raises
    ------
    InputError
        If there is no result, or no `out` where Datasets are given.
    """
    failures: list[dict[str, str]] = []
    swept: list[dict[str, Any]] = []
    drawn: Rows = ([], [], [])
    numbers: dict[str, int] = {}
    if isinstance(results, str | Path):
        source = Path(results)
        in_folder = source.is_dir()
        sources: list[Any] = _files(source) if in_folder else [source]
        for one in sources:
            open_result(one).close()  # before anything is drawn, and before the folder's index warns of it
        if in_folder:
            swept_cases = read_sweep(source)
            numbers = number_by_key(swept_cases)
            sources.sort(key=lambda path: numbers.get(path.stem, len(numbers)))
            failures = _failures(source)
            drawn = realisation_rows(realisations_table(index_of(source), swept_cases))
            swept = _swept(source) if len(sources) > 1 else []
        out = out or (source / "report.html" if in_folder else source.with_name(f"{source.stem}-report.html"))
    else:
        sources = [results] if isinstance(results, xr.Dataset) else list(results)
    if out is None:
        raise InputError("out is None: expected the name of the page, where Datasets are given")
    if not sources and not failures:
        raise InputError("found no results: expected at least one")
    page = _page(sources, numbers, failures, swept, drawn)
    with atomic_write(Path(out)) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return Path(out)


def _files(folder: Path) -> list[Path]:
    found = result_files(folder)
    if not found and not list(folder.glob("*.failed.json")):
        raise no_results(folder)
    return found


def _failures(folder: Path) -> list[dict[str, str]]:
    """Cases of which only a record says that they failed."""
    found = []
    for path in sorted(folder.glob("*.failed.json")):
        try:
            record = json.loads(path.read_text())
            case = record.get("case", {})
            title = ": ".join(filter(None, (case.get("title", ""), case_text.case_words(case))))
            found.append({"key": path.name.partition(".")[0], "title": title, "message": record["message"]})
        except (OSError, ValueError, KeyError, AttributeError):
            found.append({"key": path.name.partition(".")[0], "title": "", "message": "the record cannot be read"})
    return found


@contextmanager
def _opened(source: Path | xr.Dataset) -> Iterator[xr.Dataset]:
    if isinstance(source, xr.Dataset):
        require(source, axis_of(source), "x", "y")
        yield source
    else:
        with open_result(source) as dataset:
            yield dataset


def _swept(folder: Path) -> list[dict[str, Any]]:
    """Figures of all cases together."""
    results = results_of(folder)
    found = sweep_figures(results) if results is not None else ()
    return [_picture(title, figure) for _, title, figure in found]


def _page(
    sources: list[Any],
    numbers: Mapping[str, int],
    failures: list[dict[str, str]],
    swept: list[dict[str, Any]],
    drawn: Rows,
) -> str:
    pictured, stated = (_evenly(len(sources), most) for most in (_PICTURED, _STATED))
    rows: list[dict[str, Any]] = []
    cases: list[dict[str, Any]] = []
    studies: list[dict[str, Any]] = []
    surfaces: dict[str, dict[str, Any]] = {}
    histories: dict[str, xr.Dataset] = {}
    for number, source in enumerate(sources):
        with _opened(source) as dataset:
            row = table_row(dataset, source, number)
            row["number"] = numbers.get(row["key"], "") if numbers else number
            rows.append(row)
            if row["name"] in histories:
                row["name"] += f" ({row['key'] or number})"
            if "time" in dataset.dims:
                over = [name for name, one in dataset.data_vars.items() if one.dims == ("time",)]
                histories[row["name"]] = dataset[over].load()
            if number in stated:
                studies.append({"number": row["number"], "name": row["name"], **_study(dataset)})
            if number in pictured:
                figures = _figures(dataset, every=len(sources) <= _DRAWN)
                cases.append(
                    {"number": row["number"], "name": row["name"], "figures": figures, "audit": _audit(dataset)}
                )
            what = row["surface"]
            if what not in surfaces and len(surfaces) < _SURFACES and "height" in dataset:
                surfaces[what] = _surface(dataset)
    if len(histories) > 1 and not drawn[1]:  # realisations of one case are drawn as one
        overview = area_against_load(histories)
        swept = [*swept, _picture("Contact area against force, one line per case", overview)]
    environment = Environment(loader=PackageLoader("roughvisc.views.report", "."), autoescape=True, trim_blocks=True)
    environment.lstrip_blocks = True
    return environment.get_template("report.html.jinja").render(
        title=_common_title(rows),
        version=metadata.version("roughvisc"),
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        rows=rows,
        varied=case_text.names_of(list(dict.fromkeys(key for row in rows for key in row["varied"]))),
        failures=failures,
        realisations=dict(zip(("headings", "rows", "notes"), drawn, strict=True)),
        cases=cases,
        studies=studies,
        headings=list(dict.fromkeys(row["rows"] for row in rows)) or ["Kept times"],
        telling=list(dict.fromkeys(row["telling_label"] for row in rows if row["telling"])),
        timed=any(row["time_error"] != "not known" for row in rows),
        figures=swept,
        surfaces=list(surfaces.values()),
        more_surfaces=len({row["surface"] for row in rows if row["surface"]}) - len(surfaces),
    )


def _evenly(count: int, most: int) -> set[int]:
    """Numbers of at most so many cases, evenly spread."""
    return set(np.linspace(0, count - 1, min(count, most)).astype(int).tolist())


def _picture(title: str, figure: Figure) -> dict[str, Any]:
    """A figure as a PNG in an address, with its title; a wide one is scrolled on a narrow screen."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=_DPI)
    src = f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"
    return {"title": title, "src": src, "wide": figure.get_figwidth() > _WIDE}


def _common_title(rows: list[dict[str, Any]]) -> str:
    titles = {row["title"] for row in rows}
    return titles.pop() if len(titles) == 1 else f"{len(rows)} results" if rows else "No result"


def _figures(dataset: xr.Dataset, every: bool) -> list[dict[str, Any]]:
    """Figures of one case, without that of the surface."""
    return [
        _picture(kind.capitalize().replace("_", " "), figure)
        for kind, figure in figures_of(dataset, leave="surface", every=every)
    ]


def _study(dataset: xr.Dataset) -> dict[str, Any]:
    """What was run and whence it came, for one case."""
    case = json.loads(dataset.attrs.get("case", "{}"))

    attributes = {**(dataset["height"].attrs if "height" in dataset else {}), **dataset.attrs}

    def told(names: Sequence[str]) -> list[list[str]]:
        return [[name.replace("_", " "), str(attributes[name])] for name in names if name in attributes]

    return {
        "material": case_text.material_words(case["material"]) if "material" in case else "",
        "program": case_text.program_words(case["program"]) if "program" in case else [],
        "friction": case_text.friction_words(case["friction"]) if "friction" in case else "",
        "settings": told(_SETTINGS),
        "origin": told(_ORIGIN),
        "warnings": list(warnings_of(dataset.attrs).values()),
        "history": str(dataset.attrs.get("history", "")).splitlines(),
        "toml": case_text.study_text(case) if case else "",
    }


def _audit(dataset: xr.Dataset) -> list[Finding]:
    """Rows of the table of assumptions; none of a Dataset that lacks what an audit starts from."""
    try:
        return list(audit(dataset))
    except InputError:
        return []


# ----------------------------------------------------------------------------------------------------- surface


def _surface(dataset: xr.Dataset) -> dict[str, Any]:
    """One surface: its figures, what conditioning did, and its parameters before and after."""
    found = treatment(dataset)
    unchanged = found.before is not None and _alike(found.before, found.after)
    after = levelled_parameters(found.after)
    before = levelled_parameters(found.before) if found.before is not None and not unchanged else None
    rows = []
    for name in _PARAMETERS:
        attrs = after[name].attrs
        text = [_parameter(one[name]) if one is not None else "" for one in (before, after)]
        rows.append([name.replace("_", " "), attrs["long_name"], *text])
    part = measured_part(dataset)
    filled = int(part["filled"].sum()) if "filled" in part else 0
    pictures = [_picture("Heights", _before_and_after(found, part, filled))] if before is not None else []
    steps = found.steps
    del found  # of a big surface no more is held than the next figure needs
    return {
        "name": str(dataset["height"].attrs.get("source_file") or dataset.attrs.get("title", "surface")),
        "steps": steps,
        "filled": filled,
        "method": str(dataset["height"].attrs.get("fill_method", "")),
        "measured": before is not None,
        "unchanged": unchanged,
        "parameters": rows,
        "pictures": [*pictures, _picture("Surface", surface(dataset))],
    }


def _alike(before: xr.DataArray, after: xr.DataArray) -> bool:
    one, other = before.values, after.values
    return one.shape == other.shape and np.allclose(one, other, rtol=1e-12, atol=0, equal_nan=True)


def _parameter(value: xr.DataArray) -> str:
    if value.name == "missing_fraction":
        return f"{100 * float(value):.3g} %"
    return unit_for([float(value)], value.attrs["units"]).text(float(value))


@style.apply
def _before_and_after(found: Treatment, dataset: xr.Dataset, filled: int) -> Figure:
    """Draw maps of the heights before and after conditioning, without mirror images, filled points marked.

    Colours end at the quantiles of 0.5 and 99.5 %, so that spikes do not hide the rest.
    """
    figure = style.new_figure(7.0, 3.0)
    axes = figure.subplots(1, 2)
    heights = (found.before, measured_part(found.after))
    for ax, height, title in zip(axes, heights, ("before", "after conditioning"), strict=True):
        missing = int(height.isnull().sum())
        ends = np.nanpercentile(height.values, (0.5, 99.5)) - (mean := float(height.mean()))
        height = (drawn(height.rename("height")) - mean).rename("height")
        unit, plane = unit_for(ends, "m"), plane_unit(height)
        low, high = unit(ends)
        image = draw_map(ax, height, unit, plane, vmin=low, vmax=high if high > low else low + 1)
        figure.colorbar(image, ax=ax, aspect=18, pad=0.02, shrink=0.8, extend="both").set_label(unit.label("Height"))
        label_plane(ax, height, plane)
        ax.tick_params(direction="out")
        ax.set_title(title + (f": {missing} points missing (grey)" if missing else ""))
    if filled:
        marks = drawn(dataset["filled"].rename("contact"))  # a block of cells is marked where any of them is
        places = np.argwhere(marks.values)
        plane = plane_unit(dataset)
        x, y = plane(marks["x"].values[places[:, 0]]), plane(marks["y"].values[places[:, 1]])
        axes[1].plot(x, y, ".", color=style.CONTACT, ms=1.5, mew=0)
        axes[1].set_title(f"after conditioning: {filled} points filled (orange)")
    return figure
