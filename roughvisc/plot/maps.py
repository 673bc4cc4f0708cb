"""Maps of pressure, gap, displacement and flux at some times or speeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.observables import contact, leakage, study_observables
from roughvisc.observables.frames import expect_result
from roughvisc.plot import style
from roughvisc.topography.grid import cell_edges, cell_side
from roughvisc.units import Unit, in_si, unit_for
from roughvisc.variables import AXES, FIELDS, VARIABLES, axis_of

#: Perceptually even colour maps without the colour of contact. Pressure and flux darken as they rise.
COLOUR_MAPS = {"pressure": "viridis_r", "gap": "cividis", "displacement": "viridis", "flux": "cividis_r"}
#: Colour and name of the values below the scale.
_BELOW = {
    "pressure": (style.NO_CONTACT, "no contact"),
    "gap": (style.CONTACT, "contact"),
    "flux": (style.NO_CONTACT, "no flow"),
}
#: Reduction of a block of cells to one cell of a coarsened map; other fields use the mean.
_OF_BLOCK = {"pressure": "max", "gap": "min", "flux": "max", "contact": "max"}
#: Largest number of drawn cells along the longer side.
MOST_CELLS = 1024
#: Part of the positive values within a colour scale [%], unless the largest value is less than this times larger.
_SHOWN, _SPIKE = 99.8, 1.2
#: Largest number of times or speeds in one figure.
_MOST_FRAMES = 24
#: Direction of the motion -> arrow on a map.
_ARROWS = {"x": "→", "-x": "←", "y": "↑", "-y": "↓"}


def rows_of(dataset: xr.Dataset) -> xr.DataArray:
    """Return the coordinate of the rows of a result: its times or speeds."""
    return dataset[axis_of(dataset.variables)]


def frames_at(dataset: xr.Dataset, places: Any) -> list[int]:
    """Return the numbers of the rows nearest to some times or speeds; a negative whole number counts from the end."""
    rows = rows_of(dataset)
    name = str(rows.name)
    wanted = np.atleast_1d(np.asarray(in_si(places, VARIABLES[name].units, f"{name}s"), dtype=float)).ravel()
    if not 0 < wanted.size <= _MOST_FRAMES:
        raise InputError(key=f"{name}s", found=f"{wanted.size} {name}s", expected=f"1 to {_MOST_FRAMES}")
    from_end = (wanted < 0) & (wanted == np.floor(wanted)) & (-wanted <= rows.size)
    if not (from_end | (wanted >= 0)).all() or not np.isfinite(wanted).all():
        expected = f"{name}s [{VARIABLES[name].units}], or -1 to -{rows.size} to count from the end"
        raise InputError(key=name, found=wanted.tolist(), expected=expected)
    nearest = np.abs(rows.values - wanted[:, None]).argmin(axis=1)
    return np.where(from_end, rows.size + wanted, nearest).astype(int).tolist()


def largest_contact(dataset: xr.Dataset) -> int:
    """Return the number of the last row with the largest contact area, or of the last row if areas are not known."""
    if "contact_area" not in dataset:
        return rows_of(dataset).size - 1
    area = np.nan_to_num(dataset["contact_area"].values)
    return int(np.flatnonzero(area >= 0.999 * area.max())[-1])


def representative_frames(dataset: xr.Dataset) -> list[int]:
    """Return up to four rows: the largest contact and others in contact; for friction, the ends and the maximum."""
    rows, key = rows_of(dataset), AXES[axis_of(dataset.variables)].telling
    if key in dataset:
        chosen = {int(rows.values.argmin()), int(np.nanargmax(dataset[key].values)), int(rows.values.argmax())}
        return sorted(chosen, key=lambda row: float(rows[row]))
    frames = np.arange(rows.size)
    if "contact_area" in dataset and (area := np.nan_to_num(dataset["contact_area"].values)).max() > 0:
        frames = frames[area > 1e-3 * area.max()]
    spread = frames[np.linspace(0, frames.size - 1, min(frames.size, 4)).round().astype(int)]
    largest = largest_contact(dataset)
    if largest not in spread and spread.size == 4:
        spread[1 if largest < spread[2] else 2] = largest
    return sorted({int(frame) for frame in spread})


def drawn(field: xr.DataArray) -> xr.DataArray:
    """Return the map to draw: for a large one, blocks of cells with their largest pressure and smallest gap."""
    every = -(-max(field.sizes["x"], field.sizes["y"]) // MOST_CELLS)
    if every == 1:
        return field.load()
    blocks = field.coarsen(x=every, y=every, boundary="pad", coord_func="min")
    coarse = getattr(blocks, _OF_BLOCK.get(str(field.name), "mean"))()
    to_centre = {axis: (every - 1) / 2 * cell_side(field[axis]) for axis in ("x", "y")}
    return coarse.assign_coords({axis: coarse[axis] + shift for axis, shift in to_centre.items()}).load()


def plane_unit(field: xr.DataArray | xr.Dataset) -> Unit:
    """Return the unit for both sides of a map."""
    return unit_for([np.ptp(cell_edges(field[axis])) for axis in ("x", "y")], "m")


def map_size(field: xr.DataArray | xr.Dataset, width: float, height: float) -> tuple[float, float]:
    """Return the size of the panel of a map, of the shape of the map unless it is a narrow strip. [inch]"""
    ratio = float(np.clip(np.ptp(cell_edges(field["y"])) / np.ptp(cell_edges(field["x"])), 0.1, 10.0))
    return min(width, height / ratio), min(height, width * ratio)


def draw_map(ax: Axes, field: xr.DataArray, unit: Unit, colours: str, **limits: Any) -> AxesImage:
    """Draw a map with x to the right and y upwards.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Panel to draw in, of the shape of the map.
    field : xarray.DataArray, dims (x, y)
        Field, missing where the profile is missing. [SI]
    unit : Unit
        Unit of the colour bar.
    colours : str
        Name of a colour map.
    **limits
        ``vmin`` and ``vmax`` in this unit, or ``norm``.
    """
    plane = plane_unit(field)
    x, y = plane(cell_edges(field["x"])), plane(cell_edges(field["y"]))
    bad = style.CONTACT if field.name == "flux" else style.MISSING
    under = _BELOW.get(str(field.name), (None, ""))[0]
    image = ax.imshow(
        np.ma.masked_invalid(unit(field.transpose("y", "x"))),
        origin="lower",
        extent=(x[0], x[-1], y[0], y[-1]),
        cmap=matplotlib.colormaps[colours].with_extremes(bad=bad, under=under),
        aspect="auto",
        **limits,
    )
    ax.tick_params(direction="out")
    for axis, side in ((ax.xaxis, ax.bbox.width), (ax.yaxis, ax.bbox.height)):
        most = int(np.clip(2.5 * side / ax.figure.dpi, 1, 4))
        axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
    style.label_panels([ax], plane.label("x"), plane.label("y"))
    return image


def colour_limits(name: str, values: np.ndarray) -> tuple[float, float]:
    """Return the ends of a colour scale [SI]; a few values far beyond all others are above it."""
    known = values[np.isfinite(values)]
    if name not in _BELOW:
        return (float(known.min()), float(known.max())) if np.ptp(known) > 0 else (0.0, 1.0)
    known = known[known > 0]
    if not known.size:
        return 0.0, 1.0
    high, most = float(np.percentile(known, _SHOWN)), float(known.max())
    return 0.0, most if most < _SPIKE * high else high


def frame_of(dataset: xr.Dataset, name: str, frame: int) -> xr.DataArray:
    """Return one frame of a field to draw; the gap in contact is exactly zero."""
    at = dataset.isel({axis_of(dataset.variables): frame})
    field = at[name] if "height" not in at else at[name].where(at["height"].notnull())
    if name == "gap" and "pressure" in at:
        field = field.where(at["pressure"].isnull() | (at["pressure"] <= 0), 0.0)
    return drawn(field.rename(name))


def draw_field(axes: Sequence[Axes], dataset: xr.Dataset, name: str, frames: Sequence[int]) -> dict[str, Artist]:
    """Draw one field at some rows on one colour scale; return the entries of its legend."""
    shown = [frame_of(dataset, name, frame) for frame in frames]
    values = np.concatenate([one.values.ravel() for one in shown])
    low, high = colour_limits(name, values)
    unit = unit_for([high], VARIABLES[name].units)
    limits: dict[str, Any] = {"vmin": float(unit(low)), "vmax": float(unit(high))}
    if name == "flux":
        limits = {"norm": LogNorm(1e-3 * limits["vmax"], limits["vmax"])}
        shown = [one.where(one.isnull() | (one > 0), 1e-9 * high) for one in shown]  # zero has no logarithm
    elif name in _BELOW:
        limits["vmin"] = 1e-12 * limits["vmax"]  # zero lies below the scale
    images = [draw_map(ax, one, unit, COLOUR_MAPS[name], **limits) for ax, one in zip(axes, shown, strict=True)]
    named: dict[str, Artist] = {}
    if name in _BELOW and (values <= 0).any():
        named[_BELOW[name][1]] = Patch(facecolor=_BELOW[name][0], edgecolor="0.5", lw=0.4)
    if np.isnan(values).any():
        bad = {"contact": style.CONTACT} if name == "flux" else {"missing": style.MISSING}
        named |= {label: Patch(color=colour) for label, colour in bad.items()}
    if name == "displacement" and {"pressure", "gap"} & set(dataset):
        for ax, frame in zip(axes, frames, strict=True):
            draw_outline(ax, dataset, frame)
        named["contact"] = Line2D([], [], color=style.CONTACT)
    extend = "max" if np.nanmax(values) > high else "neither"
    style.colour_bar(images[0], axes, unit.label(VARIABLES[name].label), extend=extend)
    return named


def draw_outline(ax: Axes, dataset: xr.Dataset, frame: int) -> list[Artist]:
    """Draw and return the outline of the contact in one row; empty without contact and in full contact."""
    touching = drawn(contact(dataset.isel({axis_of(dataset.variables): frame})).astype(float).rename("contact"))
    if min(touching.shape) < 2 or not 0 < float(touching.mean()) < 1:
        return []
    plane = plane_unit(touching)
    x, y = plane(touching["x"]), plane(touching["y"])
    return [ax.contour(x, y, touching.transpose("y", "x"), levels=[0.5], colors=style.CONTACT, linewidths=0.7)]


def frame_title(dataset: xr.Dataset, frame: int) -> str:
    """Return the time of a row, or its speed with the direction and the friction coefficient."""
    at, text = dataset.isel({axis_of(dataset.variables): frame}), style.row_text(rows_of(dataset), frame)
    if axis_of(dataset.variables) == "speed":
        arrow = _ARROWS[str(dataset.attrs.get("direction", "x"))]
        return f"{arrow} {text}\nµ = {float(at['friction_coefficient']):.2g}"
    return text


@style.apply
def maps(dataset: xr.Dataset, times: Any = None, fields: Sequence[str] | str = ("pressure", "gap")) -> Figure:
    """Draw maps of fields at some times or speeds, with one colour scale for each field.

    Cells without contact are light blue on a map of the pressure. Cells in contact are orange on maps of the gap and of
    the flux. On a map of the displacement the contact has an outline. Above 1024 cells a side, one drawn cell
    shows the largest pressure and flux, and the smallest gap, of a block of cells. The colour scale may leave out two
    of a thousand values, marked by an arrow at the colour bar. The flux has a logarithmic scale of three decades. For
    friction, an arrow shows the direction of motion of the profile.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result; if its fields are on Dask, only the drawn frames are loaded.
    times : float or str, or a list, optional
        The nearest kept times [s], or speeds [m/s], are drawn; negative whole numbers count from the end. Default: up
        to four times in contact; for friction, the lowest speed, the speed of the largest friction, and the highest.
    fields : sequence of str
        Any of ``"pressure"``, ``"gap"``, ``"displacement"``; fields that are not in the result are skipped. Or
        ``"flux"`` of a leaking fluid, computed from the gap with the settings of ``leak_rate`` in the result or in
        ``[observe]``, else with the defaults of :func:`roughvisc.observables.leakage`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the result holds none of the fields, or more than 24 times are requested.
    """
    expect_result(dataset, "x", "y")
    fields = [fields] if isinstance(fields, str) else list(fields)
    for name in fields:
        one_of("fields", name, (*FIELDS, "flux"))
    if "flux" in fields:
        expect_result(dataset, "gap")
        dataset = dataset.assign(flux=_flux_of(dataset))
    stored = [name for name in fields if name in dataset]
    if not stored:
        expect_result(dataset, *fields)
    frames = representative_frames(dataset) if times is None else frames_at(dataset, times)
    columns = min(len(frames), 4)
    width = max(1.3, 2.9 - 0.45 * columns)
    width, height = map_size(dataset, width, 2.5 * width)
    if width > 3 * height:  # strips are stacked
        columns, (width, height) = 1, map_size(dataset, 4.5, 4.0)
    titles = [frame_title(dataset, frame) for frame in frames]
    each = -(-len(frames) // columns) * columns  # every field begins a row
    count, lines = each * (len(stored) - 1) + len(frames), 2 if "\n" in titles[0] else 1
    look: dict[str, Any] = {"shared": "xy", "left": 0.65, "between": max(0.3, 1.5 - width), "lines": lines}
    figure, panels = style.new_panels(count, columns, width, height, **look)
    named: dict[str, Artist] = {}
    for number, name in enumerate(stored):
        named |= draw_field(panels[number * each :][: len(frames)], dataset, name, frames)
    for unused in (ax for ax in panels if not ax.images):
        unused.remove()
    shown = [ax for ax in panels if ax.images]
    style.letter_panels(shown, titles * len(stored))
    style.legend_above(figure, named)
    return figure


def _flux_of(dataset: xr.Dataset) -> xr.DataArray:
    """Return the magnitude of the flux over (time, x, y), missing in contact; each frame is computed when drawn."""
    stated = dataset if "leak_rate" in dataset else study_observables(dataset)
    names = ("along", "viscosity", "pressure_drop")
    options = {name: stated["leak_rate"].attrs[name] for name in names} if "leak_rate" in stated else {}
    gap = dataset[["gap"]].chunk({axis_of(dataset.variables): 1, "x": -1, "y": -1}).assign_attrs(dataset.attrs)
    found = leakage(gap, flow=True, **options)
    return np.hypot(found["flux_x"], found["flux_y"]).where(gap["gap"] > 0).rename("flux")
