"""Maps of the fields of a result, a section through its contact, an animation of a map, and a surface."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize, TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch
from numpy.typing import NDArray

from roughvisc.arguments import listed_names, one_of
from roughvisc.errors import InputError
from roughvisc.observables import contact, leakage
from roughvisc.observables.frames import expect_result, need
from roughvisc.paths import path_of
from roughvisc.plot import style
from roughvisc.study.storage.folder import atomic_write
from roughvisc.topography.filters import fill, off_plane
from roughvisc.topography.grid import cell_edges, checked, require_heights, spacing
from roughvisc.topography.spectrum import psd
from roughvisc.units import Quantity, Unit, listed, quantities, unit_for
from roughvisc.variables import AXES, FIELDS, VARIABLES, axis_of

#: Field -> perceptually even colour map without the colour of contact; reduction of a block of cells to one drawn cell;
#: colour and name of the values below the scale, which are zero or, for the flux, small. Pressure and flux darken as
#: they rise.
_LOOK = {
    "pressure": ("viridis_r", "max", style.NO_CONTACT, "no contact"),
    "gap": ("cividis", "min", style.CONTACT, "contact"),
    "displacement": ("viridis", "mean", None, ""),
    "flux": ("cividis_r", "max", style.NO_CONTACT, "below 0.1 % of the scale"),
    "height": ("cividis", "mean", None, ""),
}
#: Colour map of a pressure that is negative in some cells: tension blue, pressure red.
_SIGNED = "RdBu_r"
#: Largest number of drawn cells along the longer side, and of times or speeds in one figure.
MOST_CELLS, _MOST_FRAMES = 1024, 8
#: Part of the positive values within a colour scale [%], unless the largest value is less than this times larger.
_SHOWN, _SPIKE = 99.8, 1.2


def rows_at(places: Any, axis: str, key: str, count: int, most: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return times or speeds, and which of them are negative whole numbers, which count rows from the end.

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
    """Return up to four rows, evenly spread and among them the one with the largest contact or friction."""
    order = dataset[axis_of(dataset.variables)].values.argsort()
    spread, largest = np.linspace(0, order.size - 1, 4).round().astype(int), order.argsort()[largest_row(dataset)]
    spread[np.abs(spread - largest).argmin()] = largest
    return order[np.unique(spread)].tolist()


def frame_of(dataset: xr.Dataset, name: str, frame: int) -> xr.DataArray:
    """Return one frame of a field to draw; the gap in contact is exactly zero."""
    at = dataset.isel({axis_of(dataset.variables): frame})
    field = at[name] if "height" not in at else at[name].where(at["height"].notnull())
    if name == "gap" and "pressure" in at:
        field = field.where(at["pressure"].isnull() | (at["pressure"] <= 0), 0.0)
    return drawn(field.rename(name))


def drawn(field: xr.DataArray) -> xr.DataArray:
    """Return the map to draw: for a large one, blocks of cells with their largest pressure and smallest gap."""
    every = -(-max(field.sizes["x"], field.sizes["y"]) // MOST_CELLS)
    if every > 1:
        blocks = field.coarsen(x=every, y=every, boundary="pad", coord_func="min")
        to_centre = {axis: (every - 1) / 2 * side for axis, side in zip("xy", spacing(field), strict=True)}
        reduced = getattr(blocks, _LOOK[str(field.name)][1])()
        if field.name == "pressure":  # the tension of a block, if it is larger than its pressure
            lowest = blocks.min()
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


def colour_scale(name: str, frames: Iterable[xr.DataArray]) -> tuple[Unit, Normalize]:
    """Return unit and colour scale of a field at some rows; few values far beyond all others are above the scale.

    If a pressure is negative somewhere, zero is in the middle of the scale, and both ends have their full colour.
    """
    begins_at_zero, ends, signed = _LOOK[name][2] is not None, [], []
    for frame in frames:
        if name == "pressure" and (frame.values < 0).any():
            signed.append(np.nanpercentile(frame.values, (100 - _SHOWN, _SHOWN)))
        known = frame.values[frame.values > 0 if begins_at_zero else np.isfinite(frame.values)]
        if known.size:
            ends.append(np.percentile(known, (0, _SHOWN, 100)))
    if signed:
        low = np.min(signed, axis=0)[0]
        high = max([np.max(signed, axis=0)[1], *(end[1] for end in ends)])
        unit = unit_for([low, high], VARIABLES[name].units)
        low = float(unit(low))
        return unit, TwoSlopeNorm(0.0, low, max(float(unit(high)), -1e-3 * low))
    lowest, high, most = np.transpose(ends or [(0.0, 1.0, 1.0)])
    high = most.max() if most.max() < _SPIKE * high.max() else high.max()
    unit = unit_for([lowest.min(), high], VARIABLES[name].units)
    low, high = float(unit(lowest.min())), float(unit(high))
    if name == "flux":
        return unit, LogNorm(1e-3 * high, high)
    return unit, Normalize(1e-12 * high if begins_at_zero else low, high)


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
    plane, (colours, _, below, _) = plane_unit(field), _LOOK[str(field.name)]
    if isinstance(norm, TwoSlopeNorm):
        colours, below = _SIGNED, None
    x, y = map(plane, cell_edges(field))
    bad = style.CONTACT if field.name == "flux" else style.MISSING
    values, extent = np.ma.masked_invalid(unit(field.transpose("y", "x"))), (x[0], x[-1], y[0], y[-1])
    cmap = matplotlib.colormaps[colours].with_extremes(bad=bad, under=below)
    image = ax.imshow(values, cmap=cmap, norm=norm, aspect="auto", origin="lower", extent=extent)
    ax.grid(visible=False)
    style.label_panels([ax], plane.label("x"), plane.label("y"))
    return image


def _draw_field(axes: Sequence[Axes], dataset: xr.Dataset, name: str, frames: Sequence[int]) -> dict[str, Patch]:
    """Draw one field at some rows on one colour scale; return the entries of its legend."""
    shown = [frame_of(dataset, name, frame) for frame in frames]
    unit, norm = colour_scale(name, shown)
    for ax, one in zip(axes, shown, strict=True):
        image = draw_map(ax, one, unit, norm)
    values, named, (_, _, below, word) = unit(np.concatenate(shown)), {}, _LOOK[name]
    is_signed = isinstance(norm, TwoSlopeNorm)
    if below and not is_signed and (values < norm.vmin).any():
        named[word] = Patch(facecolor=below, edgecolor="0.5", lw=0.4)
    if np.isnan(values).any():
        label, colour = ("contact", style.CONTACT) if name == "flux" else ("missing", style.MISSING)
        named[label] = Patch(color=colour)
    extend = "max" if np.nanmax(values) > norm.vmax else "neither"
    if is_signed and np.nanmin(values) < norm.vmin:
        extend = "both" if extend == "max" else "min"
    style.colour_bar(image, axes, unit.label(VARIABLES[name].label), extend=extend)
    return named


def frame_title(dataset: xr.Dataset, frame: int) -> str:
    """Return the time or the speed of a row as text."""
    axis = axis_of(dataset.variables)
    return AXES[axis].place(float(dataset[axis][frame]), 3)


@style.apply
def maps(dataset: xr.Dataset, times: Any = None, fields: Sequence[str] | str = ("pressure", "gap")) -> Figure:
    """Draw maps of fields at some times or speeds, with one colour scale for each field.

    Cells without contact are light blue on a map of the pressure. If there is tension, zero is white, tension blue and
    pressure red, each with its own scale. Cells in contact are orange on maps of the gap and of the flux. Above 1024
    cells a side, one drawn cell
    shows the largest pressure and flux, and the smallest gap, of a block of cells. The colour scale may leave out two
    of a thousand values, marked by an arrow at the colour bar. The flux has a logarithmic scale of three decades.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result; if its fields are on Dask, only the drawn frames are loaded.
    times : list of float or str, str or int, optional
        Times [s] or speeds [m/s], as a list or one text with a unit; the nearest kept ones are drawn. Negative whole
        numbers, also a single one, count from the end. Default: up to four, evenly spread, among them the time of the
        largest contact or the speed of the largest friction.
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
    """
    dataset = expect_result(dataset, "x", "y")
    fields = listed_names(fields)
    if not fields:
        raise InputError(key="fields", found=fields, expected=f"some of {', '.join(FIELDS)}, flux")
    for name in fields:
        one_of("fields", name, (*FIELDS, "flux"))
    if "flux" in fields:
        expect_result(dataset, "gap")
        dataset = dataset.assign(flux=_flux_of(dataset))
    stored = [name for name in fields if name in dataset]
    expect_result(dataset, *(stored or fields))
    frames = representative_frames(dataset) if times is None else frames_at(dataset, times)
    columns = count = len(frames)
    size = map_size(dataset, max(1.3, 2.9 - 0.45 * count), 3.25)
    if size[0] > 3 * size[1]:  # strips are stacked
        columns, size = 1, map_size(dataset, 4.5, 4.0)
    room, named = {"between": max(0.3, 1.5 - size[0]), "right": style.BAR}, {}
    figure, panels = style.new_panels(count * len(stored), columns, size, shared="xy", **room)
    for number, name in enumerate(stored):
        named |= _draw_field(panels[number * count :][:count], dataset, name, frames)
    for ax, frame in zip(panels, frames * len(stored), strict=True):
        ax.set_title(frame_title(dataset, frame))
    style.legend_above(figure, named)
    return figure


def _flux_of(dataset: xr.Dataset) -> xr.DataArray:
    """Return the magnitude of the flux over (time, x, y), missing in contact; each frame is computed when drawn."""
    stated = dataset["leak_rate"].attrs if "leak_rate" in dataset else {}
    options = {name: value for name, value in stated.items() if name in ("along", "viscosity", "pressure_drop")}
    gap = dataset[["gap"]].chunk({axis_of(dataset.variables): 1, "x": -1, "y": -1}).assign_attrs(dataset.attrs)
    found = leakage(gap, flow=True, **options)
    size = np.hypot(found["flux_x"], found["flux_y"]).clip(1e-300)  # zero has no logarithm
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
    """
    dataset = expect_result(dataset, "x", "y", "height", "pressure", "gap")
    one_of("axis", axis, ("x", "y"))
    rows, across = axis_of(dataset.variables), "y" if axis == "x" else "x"
    frame = largest_row(dataset) if time is None else frames_at(dataset, time, "time")[0]
    whole = dataset.isel({rows: frame})
    load, places = whole["pressure"].sum(axis).values, dataset[across].values
    index = int(load.argmax() if at is None else np.abs(places - at).argmin())
    cut = whole.isel({across: index}).load()
    height, surface = cut["height"], cut["height"] + cut["gap"]
    plane, pressure, unit = plane_unit(dataset), unit_for(cut["pressure"], "Pa"), unit_for(surface - height.min(), "m")
    edges, x = plane(cell_edges(dataset)["xy".index(axis)]), plane(dataset[axis])
    figure, (top, bottom) = style.new_panels(2, 1, (4.1, 1.4), shared="x")
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
    figure.align_ylabels()
    style.legend_above(figure, style.named_in(bottom))
    return figure


@style.apply
@quantities(rate="1/s > 0")
def animate(dataset: xr.Dataset, path: Any, *, field: str | None = None, rate: Quantity = 12.0) -> Path:
    """Write an animation of a map, whose title states the time or speed.

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

    def draw(frame: int) -> None:
        ax.set_title(frame_title(dataset, frame))
        image.set_data(np.ma.masked_invalid(unit(frame_of(dataset, name, frame).transpose("y", "x"))))

    with atomic_write(path) as temporary:
        FuncAnimation(figure, draw, count, cache_frame_data=False).save(temporary, writer(fps=rate), dpi=100)
    return path


@style.apply
def surface(height: xr.DataArray | xr.Dataset) -> Figure:
    """Draw a surface: map, profile through its middle, distribution of heights, power spectrum.

    Parameters
    ----------
    height : xarray.DataArray, dims (x, y), or a Dataset with the variable ``height``
        Heights, peaks up; missing points are grey. The colour scale covers 98 % of the heights, so that a spike
        does not flatten the rest. [m]

    Returns
    -------
    matplotlib.figure.Figure

    Notes
    -----
    Map and profile show the given heights. Distribution and spectrum show the heights minus their mean plane.
    :func:`roughvisc.psd` computes the spectrum with a Hann window, after missing points are filled.
    """
    if isinstance(height, xr.Dataset):
        need(height, "height")
        height = height["height"]
    height = checked(height, "surface", least=1).rename("height")
    require_heights(height, "surface")
    low, high = np.nanpercentile(height, (1, 99))
    unit, plane = unit_for([low, high], "m"), plane_unit(height)
    along_x, along_y = map(np.ptp, cell_edges(height))
    figure, axes = style.new_panels(4, 2, (2.4, 2.4 * float(np.clip(along_y / along_x, 0.6, 1.6))), between=1.65)
    on_map, profile, heights, spectrum = axes
    image = draw_map(on_map, drawn(height), unit, Normalize(float(unit(low)), float(unit(high))))
    style.colour_bar(image, [on_map], unit.label("Height"), extend="both")
    line = height.isel(y=height.sizes["y"] // 2)
    profile.plot(plane(line["x"]), unit(line), lw=0.9)
    on_map.axhline(plane(line["y"]), color="w", lw=0.8, ls=(0, (4, 2)))
    profile.set_title(f"y = {plane.text(float(line['y']))}")
    profile.set(xlabel=plane.label("x"), ylabel=unit.label("Height"))
    levelled = off_plane(height)
    known = levelled.values[np.isfinite(levelled.values)]
    low, high = np.percentile(known, (1, 99))
    unit, ends = unit_for([low, high], "m"), np.array([1.5 * low - 0.5 * high, 1.5 * high - 0.5 * low])
    heights.hist(unit(known), int(np.clip(known.size**0.5 / 2, 8, 100)), range=unit(ends), density=True, alpha=0.5)
    heights.set_title(f"Sq = {unit.text(known.std())}")
    heights.set(xlabel=unit.label("Height, levelled"), ylabel=f"Density [1/{unit.symbol}]")
    _draw_spectrum(spectrum, levelled)
    return figure


def _draw_spectrum(ax: Axes, levelled: xr.DataArray) -> None:
    """Draw the radial power spectral density of the levelled heights, up to the lower limit of both axes."""
    if min(levelled.shape) >= 8 and float(levelled.std()) > 0:
        gaps = bool(levelled.isnull().any())
        found = psd(fill(levelled.drop_attrs()) if gaps else levelled, window="hann")
        found = found.sel(wavevector=slice(np.pi / max(spacing(levelled))))  # rings inside the square of wavevectors
        found = found.where(found["psd"] > 1e-14 * found["psd"].max(), drop=True)  # the rest is rounding
        q, density = 1e-6 * found["wavevector"], 1e24 * found["psd"]
        ax.plot(q, density, lw=1)
        style.log_axis(ax.xaxis, q)
        style.log_axis(ax.yaxis, density)
        ax.set_title("missing points filled" if gaps else "")
    ax.set(xlabel="Wavevector [rad/µm]", ylabel="Power spectral density\n[µm⁴]")
