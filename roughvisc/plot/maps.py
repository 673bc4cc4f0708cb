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

from roughvisc.errors import InputError
from roughvisc.observables import asked, contact, leakage
from roughvisc.plot import style
from roughvisc.plot.rows import expect_result, frames_at, measured_part, representative_frames, rows_of
from roughvisc.topography.grid import cell_edges
from roughvisc.units import Unit, unit_for
from roughvisc.variables import FIELDS, VARIABLES, axis_of

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
#: Part of the values within a colour scale [%], and ratio of their full range to it above which the scale is limited.
_SHOWN, _SPIKE = 99.8, 1.2


def block_side(field: xr.DataArray | xr.Dataset) -> int:
    """Return the side of the block of cells in one drawn cell."""
    return max(1, -(-max(field.sizes["x"], field.sizes["y"]) // MOST_CELLS))


def drawn(field: xr.DataArray) -> xr.DataArray:
    """Return the map to draw: for a large one, blocks of cells with their largest pressure and smallest gap."""
    every = block_side(field)
    if every == 1:
        return field.load()
    steps = {axis: float(field[axis][1] - field[axis][0]) for axis in ("x", "y") if field.sizes[axis] > 1}
    blocks = field.coarsen(x=every, y=every, boundary="pad")
    coarse = getattr(blocks, _OF_BLOCK.get(str(field.name), "mean"))()
    centres = {
        axis: float(field[axis][0]) + step * ((np.arange(coarse.sizes[axis]) + 0.5) * every - 0.5)
        for axis, step in steps.items()
    }
    return coarse.assign_coords({axis: (axis, one, field[axis].attrs) for axis, one in centres.items()}).load()


def plane_unit(field: xr.DataArray | xr.Dataset) -> Unit:
    """Return the unit for both sides of a map."""
    return unit_for([np.ptp(cell_edges(field[axis])) for axis in ("x", "y")], "m")


def plane_ratio(field: xr.DataArray | xr.Dataset) -> float:
    """Return the side of a map along y over its side along x."""
    return float(np.ptp(cell_edges(field["y"])) / np.ptp(cell_edges(field["x"])))


def draw_map(ax: Axes, field: xr.DataArray, unit: Unit, colours: str, **limits: Any) -> AxesImage:
    """Draw a map with x to the right and y upwards.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Panel to draw in.
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
        aspect="equal" if 0.1 < plane_ratio(field) < 10 else "auto",
        **limits,
    )
    ax.tick_params(direction="out")
    ax.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    ax.yaxis.set_major_locator(MaxNLocator(4 if plane_ratio(field) > 0.4 else 2, steps=[1, 2, 5, 10]))
    ax.set_xlabel(plane.label("x"))
    ax.set_ylabel(plane.label("y"))
    return image


def colour_limits(name: str, values: np.ndarray) -> tuple[float, float, str]:
    """Return the ends of a colour scale [SI], and the ends at which its colour bar has an arrow."""
    known = values[np.isfinite(values)]
    above_zero = known[known > 0] if name in _BELOW else known
    if not above_zero.size:
        return (0.0, 1.0, "min") if name in _BELOW else (0.0, 1.0, "neither")
    low, high = np.percentile(above_zero, (100 - _SHOWN, _SHOWN))
    low, most = (0.0 if name in _BELOW else low), above_zero.max()
    high, beyond = (high, True) if known.size > 1000 and most - low > _SPIKE * (high - low) else (most, False)
    low = low if name in _BELOW or beyond else above_zero.min()
    high = high if high > low else low + (abs(low) or 1.0)
    below = known.min() <= 0 if name in _BELOW else known.min() < low
    return float(low), float(high), {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[below, beyond]


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
    low, high, extend = colour_limits(name, np.concatenate([one.values.ravel() for one in shown]))
    unit = unit_for([high], VARIABLES[name].units)
    limits: dict[str, Any] = {"vmin": float(unit(low)) or 1e-12 * float(unit(high)), "vmax": float(unit(high))}
    if name == "flux":
        limits, extend = {"norm": LogNorm(1e-3 * limits["vmax"], limits["vmax"])}, "min"
        shown = [one.where(one.isnull() | (one > 0), 1e-9 * high) for one in shown]  # zero has no logarithm
    elif name not in _BELOW:
        limits["vmin"] = float(unit(low))
    images = [draw_map(ax, one, unit, COLOUR_MAPS[name], **limits) for ax, one in zip(axes, shown, strict=True)]
    named: dict[str, Artist] = {}
    if name in _BELOW and extend in ("min", "both"):
        named[_BELOW[name][1]] = Patch(facecolor=_BELOW[name][0], edgecolor="0.5", lw=0.4)
    if any(one.isnull().any() for one in shown):
        bad = {"contact": style.CONTACT} if name == "flux" else {"missing": style.MISSING}
        named |= {label: Patch(color=colour) for label, colour in bad.items()}
    if name == "displacement" and {"pressure", "gap"} & set(dataset):
        for ax, frame in zip(axes, frames, strict=True):
            draw_outline(ax, dataset, frame)
        named["contact"] = Line2D([], [], color=style.CONTACT)
    figure = axes[0].figure
    bar = figure.colorbar(images[0], ax=list(axes), pad=0.02, aspect=22, extend=extend)
    bar.set_label(unit.label(VARIABLES[name].label))
    bar.outline.set_linewidth(0.6)
    return named


def draw_outline(ax: Axes, dataset: xr.Dataset, frame: int) -> list[Artist]:
    """Draw and return the outline of the contact in one row; empty without contact and in full contact."""
    touching = drawn(contact(dataset.isel({axis_of(dataset.variables): frame})).astype(float).rename("contact"))
    if min(touching.shape) < 2 or not 0 < float(touching.mean()) < 1:
        return []
    plane = plane_unit(touching)
    x, y = plane(touching["x"]), plane(touching["y"])
    return [ax.contour(x, y, touching.transpose("y", "x"), levels=[0.5], colors=style.CONTACT, linewidths=0.7)]


#: Direction of the motion -> arrow on a map.
_ARROWS = {"x": "→", "-x": "←", "y": "↑", "-y": "↓"}


def frame_title(dataset: xr.Dataset, frame: int) -> str:
    """Return the time or speed of a row, with its friction coefficient or nominal pressure."""
    at, text = dataset.isel({axis_of(dataset.variables): frame}), style.row_text(rows_of(dataset), frame)
    if axis_of(dataset.variables) == "speed":
        arrow = _ARROWS[str(dataset.attrs.get("direction", "x"))]
        return f"{arrow} {text}\nµ = {float(at['friction_coefficient']):.2g}"
    if "nominal_pressure" in dataset and dataset.attrs.get("boundary") in ("periodic", "mirror"):
        pressure = float(at["nominal_pressure"])
        return f"{text}\nnominal {unit_for([pressure], 'Pa').text(pressure)}"
    return text


@style.apply
def maps(dataset: xr.Dataset, times: Any = None, fields: Sequence[str] | str = ("pressure", "gap")) -> Figure:
    """Draw maps of fields at some times or speeds, with one colour scale for each field.

    Cells without contact are light blue on a map of the pressure. Cells in contact are orange on maps of the gap and of
    the flux. On a map of the displacement the contact has an outline. Above 1024 cells a side, one drawn cell
    shows the largest pressure and flux, and the smallest gap, of a block of cells. The colour scale may leave out two
    of a thousand values, marked by an arrow at the colour bar. The flux has a logarithmic scale of three decades. Only
    the measured part of a mirrored surface is drawn. For friction, an arrow shows the direction of motion of the
    profile.

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
        if name not in (*FIELDS, "flux"):
            raise InputError(key="fields", found=name, expected=f"some of {', '.join(FIELDS)}, flux")
    if "flux" in fields:
        expect_result(dataset, "gap")
        dataset = dataset.assign(flux=_flux_of(dataset))
    stored = [name for name in fields if name in dataset]
    if not stored:
        expect_result(dataset, *fields)
    whole, dataset = dataset, measured_part(dataset)
    frames = representative_frames(dataset) if times is None else frames_at(dataset, times)
    ratio = float(np.clip(plane_ratio(dataset), 0.1, 2.5))
    columns = 1 if ratio < 0.4 else min(len(frames), 4)
    rows = -(-len(frames) // columns)
    width = 4.0 if columns == 1 and ratio < 0.4 else max(1.5, 2.9 - 0.45 * columns)
    size = (width * columns + 1.4, (width * ratio + 0.35) * rows * len(stored) + 0.9)
    figure = style.new_figure(*size)
    axes = figure.subplots(rows * len(stored), columns, sharex=True, sharey=True, squeeze=False)
    panels = axes.reshape(len(stored), -1)
    named: dict[str, Artist] = {}
    for name, row in zip(stored, panels, strict=True):
        for unused in row[len(frames) :]:
            unused.remove()
        named |= draw_field(row[: len(frames)], dataset, name, frames)
    shown = list(panels[:, : len(frames)].ravel())
    for ax in shown:
        ax.label_outer()
    titles = [frame_title(dataset, frame) for frame in frames]
    style.letter_panels(shown, titles if rows == 1 else titles * len(stored))
    style.legend_above(figure, named)
    notes = ["Measured area only; mirror images are not shown."] if dataset is not whole else []
    if (every := block_side(dataset)) > 1:
        notes.append(f"One cell drawn for {every} × {every}, with its largest pressure and smallest gap.")
    style.note_below(figure, " ".join(notes))
    return figure


def _flux_of(dataset: xr.Dataset) -> xr.DataArray:
    """Return the magnitude of the flux over (time, x, y), missing in contact; each frame is computed when drawn."""
    stated = dataset if "leak_rate" in dataset else asked(dataset)
    names = ("along", "sides", "viscosity", "pressure_drop")
    options = {name: stated["leak_rate"].attrs[name] for name in names} if "leak_rate" in stated else {}
    gap = dataset[["gap"]].chunk({axis_of(dataset.variables): 1, "x": -1, "y": -1}).assign_attrs(dataset.attrs)
    found = leakage(gap, flow=True, **options)
    return np.hypot(found["flux_x"], found["flux_y"]).where(gap["gap"] > 0).rename("flux")
