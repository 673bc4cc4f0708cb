"""Maps of the fields of a result, a section through its contact, an animation of a map, and a surface."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize, TwoSlopeNorm
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from roughvisc.arguments import listed_names, one_of
from roughvisc.errors import InputError
from roughvisc.observables import contact, leakage
from roughvisc.observables.history import expect_result, need
from roughvisc.paths import path_of
from roughvisc.plot import style
from roughvisc.progress import reporting
from roughvisc.runs.folder import atomic_write
from roughvisc.topography.filters import fill, off_plane
from roughvisc.topography.grid import cell_edges, checked, require_heights, spacing
from roughvisc.topography.spectrum import psd
from roughvisc.units import Quantity, Unit, listed, quantities, unit_for
from roughvisc.variables import AXES, FIELDS, VARIABLES, axis_of

#: Field -> perceptually uniform colour map without the colour of contact; reduction of a block of cells to one drawn
#: cell; colour and name of the values below the scale. These values are zero or, for the flux, small. Pressure, gap and
#: flux are darker at larger values.
LOOK = {
    "pressure": ("viridis_r", "max", style.NO_CONTACT, "no contact"),
    "gap": ("cividis_r", "min", style.CONTACT, "contact"),
    "displacement": ("viridis", "mean", None, ""),
    "flux": ("cividis_r", "max", style.NO_CONTACT, "below 0.1 % of the scale"),
    "height": ("cividis", "mean", None, ""),
}
#: Colour map of a pressure that is negative in some cells: tension blue, pressure red.
SIGNED = "RdBu_r"
#: Largest number of drawn cells along the longer side, and of times or speeds in one figure.
MOST_CELLS = 1024
_MOST_FRAMES = 8
#: Flux that replaces zero on a logarithmic scale. [m^2/s]
_NO_FLOW = 1e-300
#: Part of the positive values within a colour scale [%], unless the largest value is less than this times larger.
_SHOWN = 99.8
_SPIKE = 1.2


def rows_at(places: Any, axis: str, key: str, count: int, most: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return times or speeds, and a mask of the negative whole numbers, which count rows from the end.

    Parameters
    ----------
    places : int, str or list
        One row from the end, one text, or a list of both and of numbers.
    axis : {"time", "speed"}
        Axis of the rows.
    key : str
        Name of the argument in messages.
    count, most : int
        Number of rows, and largest number of places.
    """
    unit = VARIABLES[axis].units
    if isinstance(places, int | np.integer) and places < 0:
        places = [places]
    wanted = listed(places, unit, key, "a negative whole number counts rows from the end")
    from_end = (wanted < 0) & (wanted == np.floor(wanted)) & (-wanted <= count)
    if not 0 < wanted.size <= most or not (from_end | ((wanted >= 0) & np.isfinite(wanted))).all():
        expected = f"1 to {most} {axis}s [{unit}], or -1 to -{count} to count from the end"
        raise InputError(key=key, found=wanted.tolist(), expected=expected)
    return wanted, from_end


def frames_at(dataset: xr.Dataset, places: Any, key: str = "times") -> list[int]:
    """Return the numbers of the rows nearest to some times or speeds; see :func:`rows_at`."""
    axis = axis_of(dataset.variables)
    rows = dataset[axis].values
    wanted, from_end = rows_at(places, axis, key, rows.size, _MOST_FRAMES)
    nearest = np.abs(rows - wanted[:, None]).argmin(axis=1)
    return np.where(from_end, rows.size + wanted, nearest).astype(int).tolist()


def largest_row(dataset: xr.Dataset) -> int:
    """Return the number of the last row with the largest contact area, or of the row with the largest friction."""
    axis = axis_of(dataset.variables)
    values = np.nan_to_num(dataset.get(AXES[axis].telling or "contact_area", np.zeros(dataset.sizes[axis])))
    return int(np.flatnonzero(values >= values.max() - 1e-3 * abs(values.max()))[-1])


def representative_frames(dataset: xr.Dataset) -> list[int]:
    """Return up to four rows with contact, between which the contact area changes by equal parts.

    The row with the largest contact or friction is among them. Rows over speed are evenly spread. Of a leaking fluid
    they are three rows with a leak and the first closed one.
    """
    axis = axis_of(dataset.variables)
    order = dataset[axis].values.argsort()
    if "flux" in dataset and "leak_rate" in dataset:
        leaks = dataset["leak_rate"].values[order] > 0
        leaking = order[leaks]
        closed = order[~leaks]
        spread = np.unique(np.linspace(0, leaking.size - 1, 3).round().astype(int)) if leaking.size else []
        return [*leaking[spread].tolist(), *closed[:1].tolist()]
    area = np.nan_to_num(dataset["contact_area"].values[order]) if "contact_area" in dataset else np.zeros(order.size)
    if (area > 0).any():
        order = order[area > 0]
        area = area[area > 0]
    change = np.append(0.0, np.abs(np.diff(area)).cumsum())
    if axis == "speed" or not change[-1] > 0:
        change = np.arange(order.size)
    spread = np.abs(change - np.linspace(0, change[-1], 4)[:, None]).argmin(axis=1)
    largest = int(np.flatnonzero(order == largest_row(dataset))[0])
    spread[np.abs(spread - largest).argmin()] = largest
    return order[np.unique(spread)].tolist()


def frame_of(dataset: xr.Dataset, name: str, frame: int, cells: int | None = None) -> xr.DataArray:
    """Return one frame of a field to draw, of at most some cells a side; the gap in contact is exactly zero."""
    row = {axis_of(dataset.variables): frame}
    field = dataset[name].isel(row).transpose("x", "y")
    values = field.values
    if "height" in dataset:
        values = np.where(dataset["height"].transpose("x", "y").notnull(), values, np.nan)
    if name == "gap" and "pressure" in dataset:
        values = np.where(dataset["pressure"].isel(row).transpose("x", "y") > 0, 0.0, values)
    return drawn(field.copy(data=values).rename(name), cells)


def drawn(field: xr.DataArray, cells: int | None = None) -> xr.DataArray:
    """Return the map to draw: for a large one, blocks of cells with their largest pressure and smallest gap."""
    every = -(-max(field.sizes["x"], field.sizes["y"]) // (cells or MOST_CELLS))
    if every > 1:
        blocks = field.coarsen(x=every, y=every, boundary="pad", coord_func="min")
        to_centre = {axis: (every - 1) / 2 * side for axis, side in zip("xy", spacing(field), strict=True)}
        reduced = getattr(blocks, LOOK.get(str(field.name), LOOK["displacement"])[1])()
        if field.name == "pressure" and bool((field < 0).any()):
            lowest = blocks.min()  # the tension of a block, if it is larger than its pressure
            reduced = reduced.where(~(reduced < -lowest), lowest)
        field = reduced
        field = field.assign_coords({axis: field[axis] + shift for axis, shift in to_centre.items()})
    return field.load()


def plane_unit(field: xr.DataArray | xr.Dataset) -> Unit:
    """Return the unit for both sides of a map."""
    return unit_for(list(map(np.ptp, cell_edges(field))), "m")


def map_size(field: xr.DataArray | xr.Dataset, width: float, height: float) -> tuple[float, float]:
    """Return the size of the panel of a map, of the shape of the map unless it is a narrow strip. [inch]"""
    along_x, along_y = map(np.ptp, cell_edges(field))
    ratio = float(np.clip(along_y / along_x, 0.1, 10.0))
    return min(width, height / ratio), min(height, width * ratio)


class Ends(NamedTuple):
    """Smallest value of a field, lower and upper end of its scale, and largest value; and whether the scale has signs.

    A scale with signs is the scale of a pressure that is negative somewhere. Zero is in its middle.
    """

    lowest: float
    low: float
    high: float
    most: float
    is_signed: bool = False


def scale_ends(name: str, frames: Iterable[xr.DataArray]) -> Ends:
    """Return the ends of the scale of a field at some rows. [SI]

    Few values far beyond all others are outside the scale. Only the positive values of a field from zero count.
    """
    begins_at_zero = LOOK.get(name, LOOK["displacement"])[2] is not None
    ends = list[Any]()
    signed = list[Any]()
    for frame in frames:
        if name == "pressure" and (frame.values < 0).any():
            signed.append(np.nanpercentile(frame.values, (0, 100 - _SHOWN, _SHOWN, 100)))
        known = frame.values[frame.values > 0 if begins_at_zero else np.isfinite(frame.values)]
        if known.size:
            ends.append(np.percentile(known, (0, _SHOWN, 100)))
    if signed:
        lowest, low = np.min(signed, axis=0)[:2]
        _, most = np.max(signed, axis=0)[2:]
        high = max([np.max(signed, axis=0)[2], *(end[1] for end in ends), -1e-3 * low])
        most = max([most, *(end[2] for end in ends)])
        return Ends(float(lowest), float(low), float(high), float(most), is_signed=True)
    lowest, high, most = np.transpose(ends or [(0.0, 1.0, 1.0)])
    high = most.max() if most.max() < _SPIKE * high.max() else high.max()
    return Ends(float(lowest.min()), float(lowest.min()), float(high), float(most.max()))


def colour_scale(name: str, frames: Iterable[xr.DataArray]) -> tuple[Unit, Normalize]:
    """Return unit and colour scale of a field at some rows.

    If a pressure is negative somewhere, zero is in the middle of the scale, and both ends have their full colour.
    """
    begins_at_zero = LOOK[name][2] is not None
    ends = scale_ends(name, frames)
    unit = unit_for([ends.low, ends.high], VARIABLES[name].units)
    low = float(unit(ends.low))
    high = float(unit(ends.high))
    if ends.is_signed:
        return unit, TwoSlopeNorm(0.0, low, high)
    if name == "flux":
        high = high if ends.most > _NO_FLOW else 1.0  # nothing flows: all is below the scale
        return unit, LogNorm(1e-3 * high, high)
    return unit, Normalize(1e-12 * high if begins_at_zero else low, high)


def contact_of(dataset: xr.Dataset, frame: int) -> xr.DataArray | None:
    """Return the drawn cells in contact, 1 or 0, at one row; None if the result has neither pressure nor gap.

    With adhesion contact may carry tension, so that only the gap shows it.
    """
    for name in ("pressure", "gap") if "adhesive_force" not in dataset else ("gap",):
        if name in dataset:
            field = frame_of(dataset, name, frame)
            is_touching = field > 0 if name == "pressure" else field <= 0
            return is_touching.astype(float).transpose("y", "x")
    return None


def draw_outline(ax: Axes, contact: xr.DataArray | None) -> ContourSet | None:
    """Draw a thin dark line around the contact, in proportion to the cells, so that small spots keep their colour.

    Return the line; None if no cell or every cell touches.
    """
    if contact is None or not 0 < contact.mean() < 1:
        return None
    plane = plane_unit(contact)
    width = ax.get_position().width * ax.figure.get_figwidth() * 72 / contact.sizes["x"]  # of a cell [pt]
    x = plane(contact["x"])
    y = plane(contact["y"])
    thin = float(np.clip(0.4 * width, 0.04, 0.5))
    return ax.contour(x, y, contact, [0.5], colors=style.OUTLINE, linewidths=thin)


def draw_map(ax: Axes, field: xr.DataArray, unit: Unit, norm: Normalize) -> AxesImage:
    """Draw a map with x to the right and y upwards.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Panel to draw in, of the shape of the map.
    field : xarray.DataArray, dims (x, y)
        Field, missing where the profile is missing. [SI]
    unit : Unit
        Unit of the colour bar.
    norm : matplotlib.colors.Normalize
        Colour scale, in this unit.
    """
    plane = plane_unit(field)
    colours, _, below, _ = LOOK[str(field.name)]
    if isinstance(norm, TwoSlopeNorm):
        colours = SIGNED
        below = None
    x, y = map(plane, cell_edges(field))
    bad = style.CONTACT if field.name == "flux" else style.MISSING
    values = np.ma.masked_invalid(unit(field.transpose("y", "x")))
    extent = (x[0], x[-1], y[0], y[-1])
    cmap = matplotlib.colormaps[colours].with_extremes(bad=bad, under=below)
    image = ax.imshow(values, cmap=cmap, norm=norm, aspect="auto", origin="lower", extent=extent)
    ax.grid(visible=False)
    style.label_panels([ax], plane.label("x"), plane.label("y"))
    return image


def _draw_field(
    axes: Sequence[Axes], dataset: xr.Dataset, name: str, frames: Sequence[int], *, each: bool = False
) -> dict[str, Patch]:
    """Draw one field at some rows on one colour scale, or on one each; return the entries of its legend."""
    shown = [frame_of(dataset, name, frame) for frame in frames]
    named = {}
    _, _, below, word = LOOK[name]
    for group in [[i] for i in range(len(shown))] if each else [range(len(shown))]:
        fields = [shown[i] for i in group]
        unit, norm = colour_scale(name, fields)
        for i, field in zip(group, fields, strict=True):
            image = draw_map(axes[i], field, unit, norm)
            draw_outline(axes[i], contact_of(dataset, frames[i]))
        values = unit(np.concatenate(fields))
        is_signed = isinstance(norm, TwoSlopeNorm)
        if below and not is_signed and (values < norm.vmin).any():
            named[word] = Patch(facecolor=below, edgecolor="0.5", lw=0.4)
        if np.isnan(values).any():
            label, colour = ("contact", style.CONTACT) if name == "flux" else ("missing", style.MISSING)
            named[label] = Patch(color=colour)
        known = values[np.isfinite(values)]
        extend = "max" if known.size and known.max() > norm.vmax else "neither"
        if is_signed and known.min() < norm.vmin:
            extend = "both" if extend == "max" else "min"
        if not (name == "flux" and known.size and known.max() < norm.vmin):  # nothing flows
            style.colour_bar(image, [axes[i] for i in group], unit.label(VARIABLES[name].label), extend=extend)
    return named


def frame_title(dataset: xr.Dataset, frame: int, *, with_leak: bool = False) -> str:
    """Return the time or the speed of a row as text, with the leak rate if requested and known."""
    axis = axis_of(dataset.variables)
    title = AXES[axis].place(float(dataset[axis][frame]), 3)
    if with_leak and "leak_rate" in dataset:
        leak = float(dataset["leak_rate"][frame])
        title += f": {unit_for([leak], 'm^3/s').text(leak)}" if leak else ": closed, no leak"
    return title


@style.apply
def maps(dataset: xr.Dataset, times: Any = None, fields: Sequence[str] | str = ("pressure", "gap")) -> Figure:
    """Draw maps of fields at some times or speeds, with one colour scale for each field.

    All fields darken as they rise, and a thin dark line encloses the contact. Cells without contact are light blue on a
    map of the pressure. If there is tension, zero is white, tension blue and pressure red, each with its own scale.
    Cells in contact are orange on maps of the gap and of the flux. Maps over speed and of the flux
    have a scale each, because they span decades. Above 1024 cells a side, one drawn cell
    shows the largest pressure and flux, and the smallest gap, of a block of cells. The colour scale may leave out two
    of a thousand values, marked by an arrow at the colour bar. The flux has a logarithmic scale of three decades.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result; if its fields are on Dask, only the drawn frames are loaded.
    times : list of float or str, str or int, optional
        Times [s] or speeds [m/s], as a list or one text with a unit; the nearest kept ones are drawn. Negative whole
        numbers, also a single one, count from the end. Default: up to four with contact, between which the
        contact area changes by equal parts, or evenly spread speeds; among them the time of the largest contact or the
        speed of the largest friction.
    fields : sequence of str, or str
        Any of ``"pressure"``, ``"gap"``, ``"displacement"``; fields that are not in the result are skipped. Or
        ``"flux"`` of a leaking fluid, computed from the gap with the settings of ``leak_rate`` in the result, else
        with the defaults of :func:`roughvisc.observables.leakage`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the result holds none of the fields, or more than 8 times are requested.

    See Also
    --------
    roughvisc.plot.section, roughvisc.plot.animate

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy("1 um", "0.1 mm", "0.1 mm", 16)
    >>> press = rv.Program().pressure("20 kPa", over="1 s")
    >>> ds = rv.simulate(wave, rv.elastic(1e6), press, times=3, progress=False)
    >>> figure = rv.plot.maps(ds, times="1 s", fields="pressure")
    """
    dataset = expect_result(dataset, "x", "y")
    fields = listed_names(fields)
    if not fields:
        raise InputError(key="fields", found=fields, expected=f"some of {', '.join(FIELDS)}, flux")
    for name in fields:
        one_of("fields", name, (*FIELDS, "flux"))
    if "flux" in fields:
        expect_result(dataset, "gap")
        dataset = dataset.assign(flux=flux_of(dataset))
    stored = [name for name in fields if name in dataset]
    expect_result(dataset, *(stored or fields))
    frames = representative_frames(dataset) if times is None else frames_at(dataset, times)
    count = len(frames)
    has_own_scales = axis_of(dataset.variables) == "speed" or "flux" in stored  # over decades of pressure or flux
    columns = min(count, 2) if has_own_scales else count
    size = map_size(dataset, 2.0 if has_own_scales else max(1.3, 2.9 - 0.45 * count), 3.25)
    room = {"between": max(0.3, 1.5 - size[0]), "right": style.BAR}
    named = {}
    if has_own_scales:
        room["between"] = style.BAR + 0.15
    if size[0] > 3 * size[1]:  # strips are stacked
        columns = 1
        size = map_size(dataset, 4.5, 4.0)
    rows = -(-count // columns)
    figure, panels = style.new_panels(rows * columns * len(stored), columns, size, shared="xy", **room)
    used = [panels[number * rows * columns :][:count] for number in range(len(stored))]
    for axes in used:
        for ax in axes[-columns:]:  # also above an empty place
            ax.tick_params(labelbottom=axes is used[-1])
    for name, axes in zip(stored, used, strict=True):
        named |= _draw_field(axes, dataset, name, frames, each=has_own_scales)
        for ax, frame in zip(axes, frames, strict=True):
            ax.set_title(frame_title(dataset, frame, with_leak=name == "flux"))
    filled = [ax for axes in used for ax in axes]
    for ax in panels:
        if ax not in filled:
            ax.remove()
    style.letter(filled)
    style.legend_above(figure, named)
    return figure


def flux_of(dataset: xr.Dataset) -> xr.DataArray:
    """Return the magnitude of the flux over (time, x, y), missing in contact; each frame is computed when drawn."""
    stated = dataset["leak_rate"].attrs if "leak_rate" in dataset else {}
    options = {name: value for name, value in stated.items() if name in ("along", "viscosity", "pressure_drop")}
    gap = dataset[["gap"]].chunk({axis_of(dataset.variables): 1, "x": -1, "y": -1}).assign_attrs(dataset.attrs)
    flow = leakage(gap, flow=True, **options)
    size = np.hypot(flow["flux_x"], flow["flux_y"]).clip(_NO_FLOW)  # zero has no logarithm
    return size.where(gap["gap"] > 0)


@style.apply
@quantities(at="m")
def section(dataset: xr.Dataset, time: Any = None, axis: str = "x", at: Quantity | None = None) -> Figure:
    """Draw a cut through the contact: the pressure above, below it the profile and the deformed surface.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``height``, ``pressure`` and ``gap``.
    time : str, list or int, optional
        A time or a speed, as text with a unit or a list of one number; the nearest kept one is drawn. A negative whole
        number counts from the end. Default: the last time with the largest contact area, or the speed of the largest
        friction. [s] or [m/s]
    axis : {"x", "y"}
        Direction of the cut.
    at : float or str, optional
        Coordinate of the cut along the other axis. Default: the line that carries most of the load. [m]

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the result lacks a field, or `time`, `axis` or `at` is invalid.

    See Also
    --------
    roughvisc.plot.maps

    Examples
    --------
    >>> import roughvisc as rv
    >>> wave = rv.wavy("1 um", "0.1 mm", "0.1 mm", 16)
    >>> press = rv.Program().pressure("20 kPa", over="1 s")
    >>> ds = rv.simulate(wave, rv.elastic(1e6), press, times=3, progress=False)
    >>> figure = rv.plot.section(ds, time="1 s")
    """
    dataset = expect_result(dataset, "x", "y", "height", "pressure", "gap")
    one_of("axis", axis, ("x", "y"))
    rows = axis_of(dataset.variables)
    across = "y" if axis == "x" else "x"
    frame = largest_row(dataset) if time is None else frames_at(dataset, time, "time")[0]
    whole = dataset.isel({rows: frame})
    load = whole["pressure"].sum(axis).values
    places = dataset[across].values
    index = int(load.argmax() if at is None else np.abs(places - at).argmin())
    cut = whole.isel({across: index}).load()
    height = cut["height"]
    surface = cut["height"] + cut["gap"]
    plane = plane_unit(dataset)
    pressure = unit_for(cut["pressure"], "Pa")
    unit = unit_for(surface - height.min(), "m")
    edges = plane(cell_edges(dataset)["xy".index(axis)])
    x = plane(dataset[axis])
    figure, (top, bottom) = style.new_panels(2, 1, (4.1, 1.4), shared="x")
    style.letter([top, bottom])
    top.stairs(pressure(cut["pressure"]), edges, fill=True, fc=(0, 0.62, 0.45, 0.3), ec=style.GREEN, lw=1)
    top.set(ylim=(0 if float(cut["pressure"].min()) >= 0 else None, None), ylabel=pressure.label("Pressure"))
    bottom.plot(x, unit(height), color="0.25", lw=1)
    bottom.plot(x, unit(surface), color=style.BLUE, lw=1)
    look = {"color": style.CONTACT, "lw": 2.4, "ms": 2.4, "mew": 0, "label": "contact"}
    bottom.plot(x, np.where(contact(cut), unit(height), np.nan), "o-", **look)
    low, high = bottom.get_ylim()
    bottom.fill_between(x, unit(height), low, color="0.72", lw=0, label="profile")
    bottom.fill_between(x, unit(surface), high, color=style.BLUE, alpha=0.16, lw=0, label="body")
    bottom.set(xlim=(edges[0], edges[-1]), ylim=(low, high), xlabel=plane.label(axis), ylabel=unit.label("Height"))
    place = f"{across} = {plane.text(float(dataset[across][index]))}"
    top.set_title(f"{AXES[rows].place(float(whole[rows]), 3)},  {place}")
    box = bottom.get_position()
    inches = figure.get_size_inches()
    up = box.height * inches[1] / (unit.factor * (high - low))
    along = box.width * inches[0] / (plane.factor * (edges[-1] - edges[0]))
    bottom.set_title(f"heights enlarged {up / along:.3g} times", fontsize=8)
    figure.align_ylabels()
    style.legend_above(figure, style.named_in(bottom))
    return figure


@style.apply
@quantities(rate="1/s > 0")
def animate(dataset: xr.Dataset, path: Any, *, field: str | None = None, rate: Quantity = 12.0) -> Path:
    """Write an animation of a map with the outline of the contact; its title states the time or speed.

    A progress bar counts the frames.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result; if its fields are on Dask, one frame is in memory at a time.
    path : path-like
        File to write: ``.gif`` or ``.webp``, or ``.mp4`` if ffmpeg is installed. It appears only when complete.
    field : {"pressure", "gap", "displacement"}, optional
        Field that the map shows. Default: pressure, or gap if the result holds no pressure.
    rate : float
        Kept times per second of the animation. [1/s]

    Returns
    -------
    pathlib.Path
        The file written.

    Raises
    ------
    InputError
        If the suffix is not supported, ffmpeg is missing, or the result does not hold the field.

    See Also
    --------
    roughvisc.plot.maps, roughvisc.plot.page

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> wave = rv.wavy("1 um", "0.1 mm", "0.1 mm", 16)
    >>> press = rv.Program().pressure("20 kPa", over="1 s")
    >>> ds = rv.simulate(wave, rv.elastic(1e6), press, times=3, progress=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     size = rv.plot.animate(ds, f"{folder}/wave.gif", rate=4).stat().st_size
    >>> size > 0
    True
    """
    path = path_of(path, "path")
    name = field or ("pressure" if "pressure" in dataset else "gap")
    one_of("field", name, FIELDS)
    dataset = expect_result(dataset, "x", "y", name)
    writer = {".gif": PillowWriter, ".webp": PillowWriter, ".mp4": FFMpegWriter}.get(path.suffix.lower())
    if writer is None or not writer.isAvailable():
        raise InputError(f"{path.name}: expected a name that ends in .gif, .webp or, if ffmpeg is installed, .mp4")
    dataset = dataset.sortby(axis_of(dataset.variables))
    count = dataset.sizes[axis_of(dataset.variables)]
    unit, norm = colour_scale(name, (frame_of(dataset, name, frame) for frame in range(count)))
    figure, (ax,) = style.new_panels(1, 1, map_size(dataset, 3.2, 4.2), right=style.BAR)
    image = draw_map(ax, frame_of(dataset, name, 0), unit, norm)
    style.colour_bar(image, [ax], unit.label(VARIABLES[name].label))
    outline: ContourSet | None = None

    def draw(frame: int) -> None:
        nonlocal outline
        ax.set_title(frame_title(dataset, frame))
        image.set_data(np.ma.masked_invalid(unit(frame_of(dataset, name, frame).transpose("y", "x"))))
        if outline is not None:
            outline.remove()
        outline = draw_outline(ax, contact_of(dataset, frame))

    with (
        atomic_write(path) as temporary,
        reporting("animation", lambda done, count: f"{done:.0f} of {count:.0f} frames") as report,
    ):
        animation = FuncAnimation(figure, draw, count, cache_frame_data=False)
        animation.save(temporary, writer(fps=rate), dpi=100, progress_callback=lambda frame, _: report(frame, count))
    return path


@style.apply
@quantities(cutoff="m > 0")
def surface(height: xr.DataArray | xr.Dataset, cutoff: Quantity | None = None) -> Figure:
    """Draw a surface: map, profile through its middle, distribution of heights, power spectrum.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y), or a Dataset with the variable ``height``
        Heights, peaks up; missing points are grey. Map and profile cover 98 % of the heights and their range on both
        sides, so that a spike does not flatten the rest; a title states heights beyond. [m]
    cutoff : float or str, optional
        Wavelength below which the heights are noise, such as the nesting index of a filter; marked in the spectrum. [m]

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If `height` is not a height grid, or the cut-off is not a length.

    See Also
    --------
    roughvisc.inspect, roughvisc.psd, roughvisc.parameters

    Notes
    -----
    Map and profile show the given heights. Distribution and spectrum show the heights minus their mean plane.
    :func:`roughvisc.psd` computes the spectrum with a Hann window, after missing points are filled.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rough = rv.self_affine("1 mm", 32, hurst=0.8, rms_height="1 um", seed=1)
    >>> len(rv.plot.surface(rough).axes) >= 4
    True
    """
    if isinstance(height, xr.Dataset):
        need(height, "height")
        height = height["height"]
    height = checked(height, "surface", least=1).rename("height")
    require_heights(height, "surface")
    low, high = np.nanpercentile(height, (1, 99))
    unit = unit_for([low, high], "m")
    plane = plane_unit(height)
    along_x, along_y = map(np.ptp, cell_edges(height))
    size = 2.6, 2.6 * float(np.clip(along_y / along_x, 0.6, 1.6))
    figure, axes = style.new_panels(4, 2, size, between=1.75)
    on_map, profile, heights, spectrum = axes
    style.letter(axes)
    image = draw_map(on_map, drawn(height), unit, Normalize(float(unit(low)), float(unit(high))))
    style.colour_bar(image, [on_map], unit.label("Height"), extend="both")
    line = height.isel(y=height.sizes["y"] // 2)
    profile.plot(plane(line["x"]), unit(line), lw=0.9)
    on_map.axhline(plane(line["y"]), color="w", lw=0.8, ls=(0, (4, 2)))
    ends = unit([2 * low - high, 2 * high - low]) if high > low else unit([low - 1e-9, high + 1e-9])
    shown = unit(line)
    beyond = np.nanmin(shown) < ends[0] or np.nanmax(shown) > ends[1] if np.isfinite(shown).any() else False
    if beyond:
        profile.set_ylim(*ends)
    profile.set_title(f"y = {plane.text(float(line['y']))}{', spikes cut off' if beyond else ''}")
    profile.set(xlabel=plane.label("x"), ylabel=unit.label("Height"))
    levelled = off_plane(height)
    known = levelled.values[np.isfinite(levelled.values)]
    low, high = np.percentile(known, (1, 99))
    unit = unit_for([low, high], "m")
    ends = np.array([1.5 * low - 0.5 * high, 1.5 * high - 0.5 * low])
    heights.hist(unit(known), int(np.clip(known.size**0.5 / 2, 8, 100)), range=unit(ends), density=True, alpha=0.5)
    outside = np.mean((known < ends[0]) | (known > ends[1])) if high > low else 0.0
    heights.set_title(f"Sq = {unit.text(known.std())}{f', {100 * outside:.2g} % beyond' if outside else ''}")
    heights.set(xlabel=unit.label("Height, levelled"), ylabel=f"Density [1/{unit.symbol}]")
    for axis in (profile.xaxis, profile.yaxis, heights.xaxis, on_map.xaxis):
        axis.set_major_locator(MaxNLocator(5))
    _draw_spectrum(spectrum, levelled, cutoff)
    return figure


def _draw_spectrum(ax: Axes, levelled: xr.DataArray, cutoff: float | None) -> None:
    """Draw the radial power spectral density of the levelled heights, up to the lower limit of both axes."""
    if min(levelled.shape) >= 8 and float(levelled.std()) > 0:
        gaps = bool(levelled.isnull().any())
        spectrum = psd(fill(levelled.drop_attrs()) if gaps else levelled, window="hann")
        spectrum = spectrum.sel(
            wavevector=slice(np.pi / max(spacing(levelled)))
        )  # rings inside the square of wavevectors
        spectrum = spectrum.where(spectrum["psd"] > 1e-14 * spectrum["psd"].max(), drop=True)  # the rest is rounding
        q = 1e-6 * spectrum["wavevector"]
        density = 1e24 * spectrum["psd"]
        ax.plot(q, density, lw=1)
        style.log_axis(ax.xaxis, q)
        style.log_axis(ax.yaxis, density)
        ax.set_title("missing points filled" if gaps else "")
        if cutoff is not None:
            noise = 2e-6 * np.pi / cutoff
            ax.axvspan(noise, max(float(q.max()), noise), color="0.9", lw=0, zorder=0)
            ax.axvline(noise, color=style.CONTACT, lw=1, ls=(0, (4, 2)))
            ax.set_title(f"grey: noise, below {unit_for([cutoff], 'm').text(cutoff)}")
    ax.set(xlabel="Wavevector [rad/µm]", ylabel="Power spectral density\n[µm⁴]")
