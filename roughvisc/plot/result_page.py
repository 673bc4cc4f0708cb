"""Page to explore a result or a sweep in a browser: one HTML file without server and network.

Bokeh draws, zooms and reads the cursor. Fields travel as 12-bit levels, as differences from frame to frame, compressed;
``result_page.js`` unpacks them.
"""

from __future__ import annotations

import base64
import json
import logging
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from importlib import metadata
from importlib.resources import files
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from jinja2 import Environment, PackageLoader
from matplotlib.colors import to_hex

from roughvisc.labels import steps_of
from roughvisc.observables.history import expect_result
from roughvisc.paths import path_of
from roughvisc.plot import style
from roughvisc.plot.fields import LOOK, MOST_CELLS, SIGNED, flux_of, frame_of, largest_row, plane_unit, scale_ends
from roughvisc.progress import reporting
from roughvisc.runs.folder import results_at, write_text
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.sweep_data import numbers_of, read_sweep
from roughvisc.study.case_text import case_words, names_of, varied_texts
from roughvisc.study.sweep_table import REALISATION
from roughvisc.topography.grid import cell_edges
from roughvisc.units import Unit, unit_for
from roughvisc.variables import AXES, CONDUCTANCES, axis_of

log = logging.getLogger("roughvisc")

#: Number of levels of a field; 0 is exactly zero if the field begins there, and one more is a missing value.
LEVELS = 4095
#: Largest size of the compressed fields. [byte]
LARGEST = 60_000_000
#: Numbers of rows and of cells a side from which a large page drops rows or cells first, whichever is exceeded more.
_FEW_ROWS = 25
_FEW_CELLS = 256
#: Size up to which a result is read once; a larger one is read frame by frame, some times. [byte]
_IN_MEMORY = 256 << 20
#: Decades of a logarithmic field.
_DECADES = 6
#: Quantities in the history and, of the first ones, in the line below the slider.
_CURVES = (
    *("contact_fraction", "force", "approach", "friction_coefficient", "leak_rate", "contact_area", "mean_gap", "work"),
    *CONDUCTANCES,
)
_FACTS = _CURVES[:5]


@dataclass(frozen=True)
class _Thinning:
    """Largest numbers of rows and of cells a side in the page."""

    rows: int
    cells: int

    def coarser(self, factor: float) -> _Thinning:
        """Return a thinning with at least this factor less to keep."""
        rows = self.rows
        cells = self.cells
        while factor > 1:
            if rows / _FEW_ROWS >= cells / _FEW_CELLS:
                rows = rows // 2
                factor = factor / 2
            else:
                cells = cells // 2
                factor = factor / 4
        return _Thinning(max(rows, 1), max(cells, 8))


def page(results: str | Path | xr.Dataset, path: str | Path | None = None) -> Path:
    """Write a page to explore results: fields, profiles and histories of every case, in any browser.

    Parameters
    ----------
    results : path or xarray.Dataset
        A result file, a folder of result files, one case's result, or a sweep.
    path : path, optional
        File to write. Default: ``page.html`` in the folder of results, ``STEM-page.html`` next to a result file, or
        ``page.html`` in this folder for a Dataset.

    Returns
    -------
    pathlib.Path
        The self-contained file. Fields are rounded to 1/4095 of the largest value of each case. Above 60 MB fewer
        rows or coarser cells are kept: the page and a warning state them.

    Raises
    ------
    InputError
        If there are zero results, or something else than a result.

    See Also
    --------
    roughvisc.report, roughvisc.plot.animate

    Notes
    -----
    The page shows every field over (time, x, y) or (speed, x, y) in the results. For the flow of a fluid, merge it:
    ``rv.plot.page(ds.merge(rv.observables.leakage(ds, flow=True), compat="equals", join="exact"))``.

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> wave = rv.wavy("1 um", "0.1 mm", "0.1 mm", 16)
    >>> press = rv.Program().pressure("20 kPa", over="1 s")
    >>> ds = rv.simulate(wave, rv.elastic(1e6), press, times=3, progress=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = rv.plot.page(ds, f"{folder}/wave.html").read_text(encoding="utf-8")
    >>> "<html" in page
    True
    """
    sources, default = _sources(results)
    out = default if path is None else path_of(path, "path")
    thinning = _Thinning(max(source.rows for source in sources), MOST_CELLS)
    while True:
        cases, size = _cases(sources, thinning)
        if size <= LARGEST:
            break
        thinning = thinning.coarser(size / LARGEST * len(sources) / len(cases))
    note = _note(sources, thinning)
    if note:
        log.warning("%s: %s", out, note)
    titles = list(dict.fromkeys(case["title"] for case in cases))
    axis = AXES[sources[0].axis]
    palettes = {field["palette"] for case in cases for field in case["fields"].values()}
    data = {
        "cases": cases,
        "items": _plots(is_log=cases[0]["across"]["isLog"]),
        "palettes": {name: list(map(to_hex, matplotlib.colormaps[name](np.arange(256)))) for name in palettes},
        "levels": LEVELS,
        "steps": {"axis": axis.name, "rows": axis.rows},
    }
    words = {
        "title": titles[0] if len(titles) == 1 else f"{len(cases)} results",
        "axis": axis.name,
        "rows": axis.rows,
        "note": note,
        "levels": LEVELS,
        "version": metadata.version("roughvisc"),
        # no text of a user ends the element
        "data": json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("<", r"\u003c"),
        "bokeh": _library(),
        "script": files("roughvisc.plot").joinpath("result_page.js").read_text(encoding="utf-8"),
    }
    templates = Environment(loader=PackageLoader("roughvisc.plot", "."), autoescape=True, trim_blocks=True)
    return write_text(Path(out), templates.get_template("result_page.html.jinja").render(words))


# ------------------------------------------------------------------------------------------------- results


@dataclass(frozen=True)
class _Source:
    """Result of one case, opened again at each read.

    Attributes
    ----------
    opened : callable
        Returns a context manager of the Dataset.
    number : int
        Number of the case.
    axis : {"time", "speed"}
        Axis of its rows.
    rows : int
        Number of its rows.
    """

    opened: Callable[[], AbstractContextManager[xr.Dataset]]
    number: int
    axis: str
    rows: int


def _sources(results: Any) -> tuple[list[_Source], Path]:
    """Return the cases of some results, and the default path of their page."""
    numbers: dict[str, int] = {}
    if isinstance(results, xr.Dataset):
        dims = [dim for dim in ("case", REALISATION) if dim in results.dims]
        stacked = results.stack(_case=dims, create_index=False) if len(dims) == 2 else results
        dim = "_case" if len(dims) == 2 else dims[0] if dims else ""
        cases = [stacked.isel({dim: i}) for i in range(stacked.sizes[dim])] if dim else [results]
        if len(dims) == 2:  # stack loses the steps
            for case in cases:
                case.encoding.update(results.encoding)
        opened: list[Callable[[], AbstractContextManager[xr.Dataset]]] = [partial(nullcontext, case) for case in cases]
        out = Path("page.html")
    else:
        place = path_of(results, "results")
        paths = results_at(place)
        if place.is_dir():
            numbers = numbers_of(read_sweep(place))
            paths.sort(key=lambda path: numbers.get(path.stem, len(numbers)))
        opened = [partial(open_result, path) for path in paths]
        out = place / "page.html" if place.is_dir() else place.with_name(f"{place.stem}-page.html")
    sources = []
    for number, one in enumerate(opened):
        with one() as dataset:
            result = expect_result(dataset)
            axis = axis_of(result.variables)
            key = str(result.attrs.get("case_key", ""))
            sources.append(_Source(one, numbers.get(key, number), axis, result.sizes[axis]))
    return sources, out


def _note(sources: Sequence[_Source], thinning: _Thinning) -> str:
    """Return a sentence that lists the omitted data; empty if the page is complete."""
    parts = []
    most = max(source.rows for source in sources)
    if thinning.rows < most:
        parts.append(f"{thinning.rows} of {most} {AXES[sources[0].axis].rows}")
    if thinning.cells < MOST_CELLS:
        parts.append(f"blocks of cells, at most {thinning.cells} a side")
    return f"To stay below {LARGEST / 1e6:.0f} MB, the page keeps {' and '.join(parts)}." if parts else ""


def _cases(sources: Sequence[_Source], thinning: _Thinning) -> tuple[list[dict[str, Any]], int]:
    """Return the cases of the page, until their fields exceed the largest size; and this size. [byte]"""
    cases: list[dict[str, Any]] = []
    size = 0
    with reporting("page", lambda done, count: f"{done:.0f} of {count:.0f} cases") as report:
        for source in sources:
            with source.opened() as dataset:
                cases.append(_case(expect_result(dataset), source.number, thinning))
            size += sum(len(field["data"]) for field in cases[-1]["fields"].values())
            report(len(cases), len(sources))
            if size > LARGEST:
                break
    return cases, size


def _case(dataset: xr.Dataset, number: int, thinning: _Thinning) -> dict[str, Any]:
    """Return the content of the page for one case: names, kept rows, facts, histories and fields."""
    axis = axis_of(dataset.variables)
    dataset = dataset.sortby(axis)
    if dataset.nbytes <= _IN_MEMORY:
        dataset = dataset.load()
    study = json.loads(dataset.attrs.get("case", "{}"))
    title = style.title_of(dataset, study, number)
    texts = varied_texts(study)
    names = names_of(list(texts))
    rows = np.unique(np.linspace(0, dataset.sizes[axis] - 1, min(thinning.rows, dataset.sizes[axis])).round())
    rows = rows.astype(int).tolist()
    case = {
        "title": title,
        "name": f"{number}: {case_words(study) or title}",
        "varied": {names[key]: text for key, text in texts.items()},
        "start": int(np.abs(np.array(rows) - largest_row(dataset)).argmin()),
        "places": [AXES[axis].place(value, 4).partition("= ")[2] for value in dataset[axis].values[rows].tolist()],
        "facts": {},
        "fields": {},
    }
    for name in _FACTS:
        if name in dataset:
            label, si = style.described(dataset[name])
            values = dataset[name].values[rows].tolist()
            case["facts"][label] = [_text(value, name, si) for value in values]
    case |= _curves(dataset, rows, axis)
    fields = _fields(dataset, axis)
    if fields:
        case |= _plane(dataset, fields, axis, thinning.cells)
        for name, field in fields.items():
            case["fields"][name] = _packed(dataset.assign({name: field}), name, rows, thinning.cells)
    return case


def _text(value: float, name: str, si: str) -> str:
    """Return a value of a row as text, a fraction in percent."""
    if name == "contact_fraction":
        return f"{100 * value:.3g} %"
    return unit_for([value], si).text(value) if np.isfinite(value) else "none"


# ------------------------------------------------------------------------------------------------- histories


def _numbers(values: Any) -> list[float | None]:
    """Return numbers for JSON, to seven digits; a value that is not finite has none."""
    return [float(f"{value:.7g}") if np.isfinite(value) else None for value in np.ravel(values).tolist()]


def _curves(dataset: xr.Dataset, rows: Sequence[int], axis: str) -> dict[str, Any]:
    """Return the histories of all steps, with the values at the kept rows."""
    steps = steps_of(dataset) if axis == "time" else None
    line = dataset if steps is None else steps
    is_log = style.is_uneven(dataset[axis]) or axis == "speed"
    label, si = style.described(dataset[axis])
    unit = Unit(1.0, si) if is_log else unit_for(line[axis], si)
    curves = {}
    for name in sorted(_CURVES, key=lambda name: name != AXES[axis].telling):
        if name not in dataset or dataset[name].dims != (axis,):
            continue
        curve = line if name in line else dataset
        label_of_curve, si_of_curve = style.described(dataset[name])
        shown = Unit(0.01, "%") if name == "contact_fraction" else unit_for(curve[name], si_of_curve)
        curves[name] = {
            "name": label_of_curve,
            "label": shown.label(label_of_curve),
            "x": _numbers(unit(curve[axis])),
            "y": _numbers(shown(curve[name])),
            "kept": _numbers(shown(dataset[name].values[rows])),
        }
    across = {"label": unit.label(label), "isLog": is_log, "rows": _numbers(unit(dataset[axis].values[rows]))}
    return {"curves": curves, "across": across}


# ------------------------------------------------------------------------------------------------- fields


def _fields(dataset: xr.Dataset, axis: str) -> dict[str, xr.DataArray]:
    """Return the fields of a result, with the flux of the fluid if the result has a leak rate."""
    names = [str(name) for name, field in dataset.data_vars.items() if {*field.dims} == {axis, "x", "y"}]
    names.sort(key=lambda name: [*LOOK, name].index(name))
    fields = {name: dataset[name] for name in names}
    if "leak_rate" in dataset and "gap" in dataset and not {"flux", "flux_x"} & fields.keys():
        fields["flux"] = flux_of(dataset).astype("float32").load().rename("flux")
    return fields


def _frames(dataset: xr.Dataset, name: str, rows: Sequence[int], cells: int) -> Iterator[xr.DataArray]:
    """Yield the frames of a field at some rows, over (y, x)."""
    for row in rows:
        yield frame_of(dataset, name, row, cells).transpose("y", "x")


def _plane(dataset: xr.Dataset, fields: dict[str, xr.DataArray], axis: str, cells: int) -> dict[str, Any]:
    """Return the plane of the maps in one unit, and the place of the largest value of the first field."""
    name = next(iter(fields))
    first = frame_of(dataset.assign({name: fields[name]}), name, largest_row(dataset), cells).transpose("y", "x")
    unit = plane_unit(first)
    x, y = (unit(edges) for edges in cell_edges(first))
    plane = {"nx": x.size - 1, "ny": y.size - 1, "left": float(x[0]), "bottom": float(y[0]), "unit": unit.symbol}
    plane |= {"width": float(np.ptp(x)), "height": float(np.ptp(y))}
    crest = None
    if np.isfinite(first).any():
        j, i = np.unravel_index(int(np.nanargmax(first)), first.shape)
        crest = [float(unit(first["x"][i])), float(unit(first["y"][j]))]
    return {"plane": plane, "crest": crest}


def _packed(dataset: xr.Dataset, name: str, rows: Sequence[int], cells: int) -> dict[str, Any]:
    """Return a field as levels of its frames, as differences from frame to frame, compressed, with its look."""
    palette, _, below, word = LOOK.get(name, LOOK["displacement"])
    label, si = style.described(dataset[name])
    lowest, low, high, most, is_signed = scale_ends(name, _frames(dataset, name, rows, cells))
    unit = unit_for([low, high], si)
    if is_signed:
        palette = SIGNED
        below = None
        most = max(most, 0.0)
    decades = _DECADES if name == "flux" else 0
    least = 0.0 if below else lowest
    spread = most - least or 1.0
    compressor = zlib.compressobj(6, wbits=31)
    data = b""
    size = 0
    before: Any = np.uint16(0)
    for frame in _frames(dataset, name, rows, cells):
        values = frame.values
        size = values.size
        if decades:
            with np.errstate(divide="ignore", invalid="ignore"):
                part = np.clip(1 + np.log10(values / (most or 1.0)) / decades, 0, 1)
        else:
            part = (values - least) / spread
        levels = np.ceil(part * LEVELS) if below else np.round(part * LEVELS)  # positive values stay positive
        codes = np.where(np.isnan(levels), LEVELS + 1, levels).astype("<u2")
        data += compressor.compress((codes - before).tobytes())
        before = codes
    data += compressor.flush()
    is_flow = name == "flux"
    absent = {"word": "contact", "colour": style.CONTACT} if is_flow else {"word": "missing", "colour": to_hex("0.72")}
    return {
        "label": label,
        "unit": unit.symbol,
        "palette": palette,
        "under": {"word": word, "colour": below} if below else None,
        "absent": absent,
        "decades": decades,
        "isSigned": is_signed,
        "size": size,
        "least": float(unit(least)),
        "most": float(unit(most)),
        "low": float(unit(1e-3 * high if decades else 0.0 if below else low)),
        "high": float(unit(high)),
        "data": base64.b64encode(data).decode(),
    }


# ------------------------------------------------------------------------------------------------- Bokeh


def _library() -> str:
    """Return the JavaScript of Bokeh."""
    from bokeh.resources import Resources  # slow to import

    return "\n".join(Resources(mode="inline", components=["bokeh"], log_level="warn").js_raw)


def _plots(*, is_log: bool) -> dict[str, Any]:
    """Return the empty map, profile and history as JSON; ``result_page.js`` fills them by their names."""
    from bokeh.embed import json_item  # slow to import
    from bokeh.events import MouseMove, Tap
    from bokeh.models import ColumnDataSource, CustomJS, LinearColorMapper, Range1d, Span
    from bokeh.plotting import figure

    look: dict[str, Any] = {"toolbar_location": "above", "min_border": 0, "frame_width": 400, "frame_height": 200}
    look["min_border_right"] = 14  # half of the last number

    def empty(name: str) -> ColumnDataSource:
        return ColumnDataSource({"x": [1.0, 2.0], "y": [1.0, 2.0]}, name=name)  # a range of no values is a warning

    def tell(plot: str, kind: str) -> CustomJS:
        detail = f"plot: '{plot}', kind: '{kind}', x: cb_obj.x, y: cb_obj.y"
        return CustomJS(code=f"window.dispatchEvent(new CustomEvent('place', {{ detail: {{ {detail} }} }}))")

    area = figure(
        name="map",
        x_range=Range1d(0, 1),
        y_range=Range1d(0, 1),
        tools="pan,wheel_zoom,box_zoom,reset,save",
        active_drag="box_zoom",
        active_scroll="wheel_zoom",
        **look,
    )
    nothing = {"image": [np.zeros((1, 1), "f4")], "x": [0.0], "y": [0.0], "dw": [1.0], "dh": [1.0]}
    image = ColumnDataSource(nothing, name="image")
    mapper = LinearColorMapper(palette=["#ffffff", "#000000"], low=0, high=1, name="colours")
    area.image("image", "x", "y", "dw", "dh", source=image, color_mapper=mapper)
    area.line("x", "y", source=empty("outline"), line_color="#1d2328", line_width=1)
    area.line("x", "y", source=empty("along_cut"), line_color="#1d2328", line_dash=[5, 4], line_alpha=0.7)
    area.js_on_event(MouseMove, tell("map", "move"))
    area.js_on_event(Tap, tell("map", "tap"))

    ranges: dict[str, Any] = {"x_range": Range1d(0, 1), "y_range": Range1d(0, 1)}
    profile = figure(name="profile", **ranges, tools="xpan,xwheel_zoom,reset,save", **look)
    line = profile.line("x", "y", source=empty("cut"), line_width=1.5)
    line.glyph.name = "cut_look"
    profile.line("x", "y", source=empty("cut_contact"), line_color=style.CONTACT, line_width=3)

    kind = "log" if is_log else "linear"
    history = figure(name="history", x_axis_type=kind, tools="xpan,xwheel_zoom,reset,save", **look)
    history.line("x", "y", source=empty("line"), line_width=1.5).glyph.name = "line_look"
    history.scatter("x", "y", source=empty("dots"), size=5).glyph.name = "dots_look"
    history.add_layout(Span(dimension="height", line_color=style.CONTACT, line_width=2, name="now"))
    history.js_on_event(Tap, tell("history", "tap"))
    for plot in (area, profile, history):
        plot.toolbar.logo = None
        plot.axis.axis_label_text_font_style = "normal"
        plot.axis.axis_label_text_font_size = "13px"
    return {plot.name: json_item(plot) for plot in (area, profile, history)}
