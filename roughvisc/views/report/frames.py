"""Pictures of a report: small maps, sections and histories, encoded as text."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator
from PIL import Image

from roughvisc.observables import contact, history
from roughvisc.topography.grid import spacing
from roughvisc.units import unit_for
from roughvisc.variables import STATUS_MEANINGS, VARIABLES
from roughvisc.variables.axes import AXES, axis_of
from roughvisc.variables.spots import CONDUCTANCES
from roughvisc.views.figures import style
from roughvisc.views.figures.coarsened import in_blocks, present, stride, touching
from roughvisc.views.figures.fields import Scale, colour_map, joint_scale, measured_part, plane_ratio, plane_unit
from roughvisc.views.figures.rows import RowAxis, at_rows, fullest_frame, rows_of, spread_frames
from roughvisc.views.figures.sections import cut_position, deformed_surface

#: Frames a case and cells along the longer side of a map, the richest first.
_LADDER = ((24, 288), (16, 256), (12, 192), (8, 160), (6, 128), (5, 96), (4, 64), (2, 48))
#: Colours of a map, besides those of absent cells and of cells in or out of contact.
_LEVELS = 62
_ABSENT, _MARKED = 0, 1
#: What is stated of accuracy, then its parts but for the solver's, whose name the axis tells.
_ERRORS = {"stated_error": "stated", "time_error": "time steps"}
#: Errors below this part of the largest are not shown.
_FAINTEST = 1e-5
#: Kept times up to which errors are marked.
_DOTS = 60
_CHART = (280.0, 130.0)  # of the plotting area, in the units of the page
_SECTION = (1000.0, 240.0)


def figure_uri(figure: Figure) -> str:
    """A matplotlib figure as the address of a PNG, without transparency."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=100)
    with Image.open(stream) as picture:
        return _png(picture.convert("RGB"))


def _png(picture: Image.Image) -> str:
    """A picture as an address that holds it."""
    stream = io.BytesIO()
    picture.save(stream, format="PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"


def colour_bar(name: str) -> str:
    """Colours of a field from its lowest to its highest value, as a strip of one line."""
    colours = _palette(name)[2 * 3 :]
    strip = Image.frombytes("P", (_LEVELS, 1), bytes(range(_LEVELS)))
    strip.putpalette(colours)
    return _png(strip)


def frames_of(dataset: xr.Dataset, budget: int) -> dict[str, Any]:
    """Everything that a page shows of the rows of one case, in the order of their axis.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result.
    budget : int
        Size that the maps may have in all; frames and resolution are as high as it allows. [bytes]

    Returns
    -------
    dict
        Of texts and numbers, ready for JSON.
    """
    over = axis_of(dataset.dims)
    whole = dataset if over == "time" else dataset.sortby(over)
    dataset = measured_part(whole)
    axis = RowAxis.of(rows_of(dataset))
    fields = [name for name in ("pressure", "gap", "displacement") if name in dataset][:2]
    scales, maps, chosen, block = [], [], [], 1
    fullest, every = fullest_frame(dataset), stride(dataset)
    telling = AXES[over].telling_row(dataset) if AXES[over].telling in dataset else fullest
    trial = [_scale(dataset, name, [fullest]) for name in fields]
    for count, side in _LADDER:
        chosen = [int(frame) for frame in spread_frames(rows_of(dataset), count)]
        block = max(1, -(-max(dataset.sizes["x"], dataset.sizes["y"]) // (side * every)))
        one = sum(len(_map(dataset, scale, fullest, block)) for scale in trial)
        if one * len(chosen) > 1.1 * budget and (count, side) != _LADDER[-1]:
            continue
        scales = [_scale(dataset, name, chosen) for name in fields]
        maps = [[_map(dataset, scale, frame, block) for scale in scales] for frame in chosen]
        if sum(len(uri) for row in maps for uri in row) <= budget:
            break
    return {
        "over": over,
        "label": axis.label,
        "rows": AXES[over].rows,
        "kept": dataset.sizes[over],
        "block": block * every,
        "extremes": every > 1,
        "ratio": plane_ratio(dataset),
        "plane": _extent(dataset) + ("" if dataset is whole else " as measured, without the mirror images"),
        "fields": [_scale_text(scale) for scale in scales],
        "section": _sections(dataset, chosen),
        "charts": _charts(dataset, chosen),
        "frames": [{"maps": row, **_numbers(dataset, frame)} for row, frame in zip(maps, chosen, strict=True)],
        "start": int(np.abs(np.array(chosen) - telling).argmin()),
    }


# -------------------------------------------------------------------------------------------------------- maps


def _scale(dataset: xr.Dataset, name: str, chosen: list[int]) -> Scale:
    """Colours of one field, the same for all frames of a case."""
    return joint_scale(present(dataset, name, frame) for frame in chosen)


def _span(scale: Scale) -> float:
    return scale.high - scale.low if scale.high > scale.low else 1.0


def _scale_text(scale: Scale) -> dict[str, str]:
    unit = unit_for([scale.low, scale.high], VARIABLES[scale.name].units)
    return {
        "name": scale.name,
        "label": unit.label(VARIABLES[scale.name].label),
        "low": f"{float(unit(scale.low)):.3g}",
        "high": f"{float(unit(scale.low + _span(scale))):.3g}" + (" and more" if scale.highest > scale.high else ""),
    }


def _extent(dataset: xr.Dataset) -> str:
    unit = plane_unit(dataset)
    sides = [dataset.sizes[axis] * side for axis, side in zip(("x", "y"), spacing(dataset), strict=True)]
    return " × ".join(f"{float(unit(side)):.4g}" for side in sides) + f" {unit.symbol}"


def _map(dataset: xr.Dataset, scale: Scale, frame: int, block: int) -> str:
    """One map, x to the right and y upwards: contact has its colour, and on a map of pressure no contact."""
    field = present(dataset, scale.name, frame)
    spots = touching(dataset, frame) if {"pressure", "gap"} & set(dataset) else field < -np.inf
    extremes = stride(dataset) > 1  # what was coarsened for its extremes keeps them
    values = in_blocks(field.transpose("y", "x").values, block, scale.name if extremes else "")
    share = in_blocks(spots.transpose("y", "x").values.astype(float), block, "contact" if extremes else "")
    level = np.nan_to_num((values - scale.low) / _span(scale))
    index = 2 + np.clip((level * _LEVELS).astype(int), 0, _LEVELS - 1)
    index[share == 0 if scale.name == "pressure" else share > 0.5] = _MARKED
    index[np.isnan(values)] = _ABSENT
    picture = Image.fromarray(np.ascontiguousarray(index[::-1].astype(np.uint8)))
    picture.putpalette(_palette(scale.name))
    return _png(picture)


def _palette(name: str) -> bytes:
    colours = colour_map(name)(np.linspace(0, 1, _LEVELS))[:, :3]
    marked = to_rgb(style.NO_CONTACT if name == "pressure" else style.CONTACT)
    return bytes(np.rint(255 * np.array([to_rgb(style.ABSENT), marked, *colours])).astype(np.uint8).ravel())


# ---------------------------------------------------------------------------------------------------- sections


def _path(x: np.ndarray, y: np.ndarray) -> str:
    """A line through points as SVG has it, broken where a point is missing."""
    parts, pen = [], "M"
    for across, up in zip(x, y, strict=True):
        if np.isfinite(across) and np.isfinite(up):
            parts.append(f"{pen}{across:.4g} {up:.4g}")
            pen = "L"
        else:
            pen = "M"
    return "".join(parts)


def _dots(x: np.ndarray, y: np.ndarray) -> str:
    """The points alone, as lines of no length."""
    known = np.isfinite(x) & np.isfinite(y)
    return "".join(f"M{across:.4g} {up:.4g}h0" for across, up in zip(x[known], y[known], strict=True))


def _sections(dataset: xr.Dataset, chosen: list[int]) -> dict[str, Any] | None:
    """Profile, and at each frame the deformed surface and the contact, on the line that carries most."""
    if "height" not in dataset or not ("gap" in dataset or "displacement" in dataset):
        return None
    index = cut_position(dataset, fullest_frame(dataset), "y")
    height = dataset["height"].isel(y=index).values
    surfaces = [deformed_surface(dataset, frame, y=index).values for frame in chosen]
    on_line = [contact(at_rows(dataset, frame).isel(y=index)).values for frame in chosen]
    known = np.concatenate([height, *surfaces])
    known = known[np.isfinite(known)]
    if not known.size:
        return None
    unit, plane = unit_for(np.ptp(known), "m"), plane_unit(dataset)
    low, high = float(known.min()), float(known.max())
    margin = 0.1 * ((high - low) or 1e-9)
    low, high = low - margin, high + margin
    every = max(1, len(height) // 400)
    x = _SECTION[0] * (np.arange(len(height)) + 0.5) / len(height)

    def up(values):
        return _SECTION[1] * (high - np.asarray(values)) / (high - low)

    return {
        "profile": _path(x[::every], up(height)[::every]),
        "surfaces": [_path(x[::every], up(one)[::every]) for one in surfaces],
        "contacts": [_runs(x, up(height), one) for one in on_line],
        "where": f"y = {plane.text(float(dataset['y'][index]))}",
        "label": f"Full height of the plot: {unit.text(high - low)}",
    }


def _runs(x: np.ndarray, y: np.ndarray, touching: np.ndarray) -> str:
    """Each run of cells in contact as one line; a lone cell as one of its width."""
    half = _SECTION[0] / len(x) / 2
    borders = np.flatnonzero(np.diff(np.pad(touching.astype(int), 1)))
    parts = []
    for first, past in borders.reshape(-1, 2):
        if past - first == 1:
            parts.append(_path(x[first] + half * np.array([-1, 1]), y[[first, first]]))
        else:
            inner = np.unique([*range(first, past, max(1, (past - first) // 60)), past - 1])
            parts.append(_path(x[inner], y[inner]))
    return "".join(parts)


# --------------------------------------------------------------------------------------------------- histories


def _charts(dataset: xr.Dataset, chosen: list[int]) -> list[dict[str, Any]]:
    """Histories as lines in a unit of their own, and where each frame lies on them; errors are those of kept times.

    The tolerance is asked of the error that is stated at kept times, and is drawn beside that alone: a step between
    them may be less accurate.
    """
    over = axis_of(dataset.dims)
    charts, steps = [], history(dataset) if over == "time" else dataset
    places_of_steps, kept = rows_of(steps).values, rows_of(dataset).values
    axis = RowAxis.of(rows_of(steps))
    across, ticks = _across(axis, places_of_steps)
    along = {"time": axis.unit.label(axis.label), "xticks": ticks}
    places = np.searchsorted(places_of_steps, kept[chosen], side="right") - 1
    for name in ("friction_coefficient", "force", "approach", "contact_area"):
        if name in steps:
            label = VARIABLES[name].label
            values = steps[name].values.astype(float)
            unit = unit_for(values, VARIABLES[name].units)
            x = across(places_of_steps)
            charts.append(along | _chart(x, unit.label(label), {label: unit(values)}, places.tolist(), False))
    errors = {
        label: dataset[name].values.astype(float)
        for name, label in _errors(over).items()
        if name in dataset and np.nanmax(dataset[name].values, initial=0.0) > 0
    }
    if errors:
        faintest = _FAINTEST * np.nanmax(list(errors.values()))
        shown = {label: np.where(values >= faintest, values, np.nan) for label, values in errors.items()}
        chart = _chart(across(kept), "Relative error", shown, chosen, True, dataset.attrs.get("tolerance"))
        charts.append(chart | along | ({"time": axis.unit.label("Kept time")} if over == "time" else {}))
    return charts


def _errors(over: str) -> dict[str, str]:
    """What is stated of accuracy over an axis."""
    return {**_ERRORS, AXES[over].residual: _ERRORS.get(AXES[over].residual, "solver (estimate)")}


def _chart(
    x: np.ndarray,
    label: str,
    lines: dict[str, np.ndarray],
    chosen: list[int],
    logarithmic: bool,
    tolerance: float | None = None,
) -> dict[str, Any]:
    """A chart of lines, and where each frame lies on the first; a logarithmic one of few rows is dotted too."""
    dotted = logarithmic and len(x) <= _DOTS
    stacked = np.concatenate(list(lines.values()))
    stacked = stacked[np.isfinite(stacked) & ((stacked > 0) | (not logarithmic))]
    if tolerance is not None:
        stacked = np.append(stacked, float(tolerance))
    up, ticks = _up(stacked, logarithmic)
    with np.errstate(invalid="ignore", divide="ignore"):
        heights = {name: up(values) for name, values in lines.items()}
    first = next(iter(heights.values()))
    return {
        "label": label,
        "lines": [
            {"label": name, "d": _path(x, y), "dots": _dots(x, y) if dotted else ""} for name, y in heights.items()
        ],
        "tolerance": float(up(np.array([float(tolerance)]))[0]) if tolerance is not None else None,
        "yticks": ticks,
        "marks": [[_pixel(x[frame]), _pixel(first[frame])] for frame in chosen],
    }


def _pixel(value: float) -> float | None:
    return round(float(value), 1) if np.isfinite(value) else None


def _across(axis: RowAxis, times: np.ndarray) -> tuple[Callable[[np.ndarray], np.ndarray], list[list[Any]]]:
    """Function from times to places along the chart, which these times fill, and its ticks."""
    shown = axis.unit(times)
    floor = axis.first / 3 if times[0] <= 0 else axis.first  # zero has its place at the left end

    def scaled(some: np.ndarray) -> np.ndarray:
        return np.log10(np.maximum(some, floor)) if axis.logarithmic else some

    place = scaled(shown)
    if axis.logarithmic:
        decades = np.arange(np.ceil(np.log10(axis.first) - 1e-9), np.floor(place[-1] + 1e-9) + 1)
        decades = decades[:: max(1, len(decades) // 4)]
        ticks = [(d, f"{10**d:g}") for d in decades]
        if times[0] <= 0:
            ticks.insert(0, (place[0], "0"))
    else:
        inside = MaxNLocator(4, steps=[1, 2, 5, 10]).tick_values(shown[0], shown[-1])
        ticks = [(t, f"{t:g}") for t in inside if shown[0] - 1e-9 <= t <= shown[-1] + 1e-9]
    span = (place[-1] - place[0]) or 1.0

    def along(some: Any) -> Any:
        return _CHART[0] * (some - place[0]) / span

    return lambda some: along(scaled(axis.unit(some))), [[_pixel(along(t)), s] for t, s in ticks]


def _up(values: np.ndarray, logarithmic: bool):
    """Function from values to places up the chart, and the chart's ticks."""
    if not values.size:
        values = np.array([1.0])
    if logarithmic:
        low, high = np.log10(values.min()) - 0.3, np.log10(values.max()) + 0.3
        found = LogLocator(numticks=5).tick_values(10**low, 10**high)
        ticks = [(np.log10(t), f"{t:.0e}".replace("e-0", "e-").replace("e+0", "e+")) for t in found]
        scale = np.log10
    else:
        low, high = min(values.min(), 0.0), max(values.max(), 0.0)
        high += 0.1 * ((high - low) or 1.0)
        ticks = [(t, f"{t:g}") for t in MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)]
        scale = np.asarray

    def up(shown):
        return _CHART[1] * (high - scale(shown)) / (high - low)

    kept = [(t, s) for t, s in ticks if low - 1e-12 <= t <= high + 1e-12]
    return up, [[_pixel(_CHART[1] * (high - t) / (high - low)), s] for t, s in kept]


def _numbers(dataset: xr.Dataset, frame: int) -> dict[str, Any]:
    """Place of a frame, and its numbers in words."""
    over = axis_of(dataset.dims)
    known, one = AXES[over].variables, at_rows(dataset, frame)
    place = float(one[over])
    rows = [
        (known[name].label, unit_for(dataset[name], known[name].units).text(float(one[name]), 4))
        for name in (
            "force",
            "nominal_pressure",
            "approach",
            "contact_area",
            "contact_area_counted",
            "mean_gap",
            "work",
            "sliding_distance",
            "friction_coefficient",
            "leak_rate",
            *CONDUCTANCES,
        )
        if name in dataset and name in known
    ]
    if "contact_fraction" in dataset:
        rows.append(("Contact fraction", f"{100 * float(one['contact_fraction']):.3g} %"))
    for name, label in _errors(over).items():
        if name in dataset:
            rows.append((f"Error, {label}", f"{float(one[name]):.2g}" if np.isfinite(one[name]) else "not known"))
    if "status" in dataset:
        rows.append(("Status", STATUS_MEANINGS[int(one["status"])].replace("_", " ")))
    return {"time": unit_for([place], known[over].units).text(place, 4), "numbers": rows}
