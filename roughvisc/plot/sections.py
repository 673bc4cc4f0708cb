"""Sections through the contact: the pressure, the profile, and the deformed surface that rests on it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.labels import warnings_of
from roughvisc.observables import contact
from roughvisc.plot import style
from roughvisc.plot.coarsened import largest, summed
from roughvisc.plot.fields import measured_part, plane_unit
from roughvisc.plot.rows import RowAxis, at_rows, frame_at, require, rows_of
from roughvisc.topography.borders import MIRRORED
from roughvisc.topography.grid import cell_edges
from roughvisc.units import Quantity, quantities, unit_for
from roughvisc.variables import VARIABLES


def cut_position(dataset: xr.Dataset, frame: int, across: str) -> int:
    """Index of the cut: the line that carries most or, without pressure, the one through the highest peak.

    Lines at the border of a surface that repeats with a step, or by its mirror images, are left out: what they carry
    is of the step or of the fold.
    """
    along = "x" if across == "y" else "y"
    if "pressure" in dataset:
        carried = summed(at_rows(dataset["pressure"], frame), along)
        carried = carried * _inner(dataset, len(carried))
        if carried.max() > 0:
            return int(carried.argmax())
    peaks = largest(dataset["height"], along)
    peaks = np.where(_inner(dataset, len(peaks)), peaks, np.nan)
    return int(np.nanargmax(peaks)) if np.isfinite(peaks).any() else len(peaks) // 2


def _inner(dataset: xr.Dataset, count: int) -> np.ndarray:
    """Which lines of a direction are not at a seam: all of them, where the surface itself repeats."""
    inner = np.ones(count, dtype=bool)
    mirrored = MIRRORED in str(dataset.attrs.get("history", ""))
    if ("border" in warnings_of(dataset.attrs) or mirrored) and count > 8:
        margin = max(2, count // 16)
        inner[:margin] = inner[-margin:] = False
    return inner


def deformed_surface(dataset: xr.Dataset, frame: int, **line: int) -> xr.DataArray:
    """Height of the half-space's surface in the frame of the profile; of one line of cells alone with ``y=12``. [m]

    From the displacement where it is stored, which is known above absent cells too; else the height plus the gap.
    """
    frame_of = at_rows(dataset, frame)
    if "displacement" in dataset:
        return frame_of["displacement"].isel(line).load() + _offset(frame_of)
    require(dataset, "gap")
    return (dataset["height"] + frame_of["gap"]).isel(line).load()


def _offset(frame_of: xr.Dataset) -> float:
    """What the displacement of one frame is less than the height of the surface, everywhere. [m]"""
    beyond = (frame_of["height"] - frame_of["displacement"]).values
    return float(np.nanmax(beyond) if "gap" not in frame_of else np.nanmedian(beyond + frame_of["gap"].values))


@style.apply
@quantities(time="s", at="m")
def section(dataset: xr.Dataset, time: Quantity = -1, axis: str = "x", at: Quantity | None = None) -> Figure:
    """A cut through the contact: pressure above, below it the profile and the deformed surface that rests on it.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``height``, ``pressure`` or ``gap``.
    time : float or str
        The nearest kept time is drawn; a negative whole number counts frames from the end. [s]
    axis : {"x", "y"}
        Direction of the cut.
    at : float or str, optional
        Coordinate of the cut along the other axis; by default the line that carries most. [m]

    Returns
    -------
    matplotlib.figure.Figure
    """
    require(dataset, "x", "y", "height")
    if axis not in ("x", "y"):
        raise InputError(f"axis is {axis!r}: expected 'x' or 'y'")
    dataset = measured_part(dataset)
    across = "y" if axis == "x" else "x"
    frame = frame_at(rows_of(dataset), time)
    index = cut_position(dataset, frame, across) if at is None else int(np.abs(dataset[across].values - at).argmin())
    figure = style.new_figure(5.0, 3.9)
    top, bottom = figure.subplots(2, sharex=True, height_ratios=[1, 1.3])
    plane, cut = plane_unit(dataset), at_rows(dataset, frame).isel({across: index})
    limits = plane(cell_edges(dataset[axis]))
    _draw_pressure(top, cut, limits)
    stated = dataset["height"].attrs.get("highest")
    highest = float(largest(dataset["height"]) if stated is None else stated)
    surface = deformed_surface(dataset, frame, **{across: index}).values
    _draw_surfaces(bottom, cut, surface, highest, limits)
    bottom.set_xlabel(plane.label(axis))
    bottom.set_xlim(limits[0], limits[-1])
    where = f"{across} = {plane.text(float(dataset[across][index]))}"
    top.set_title(f"{RowAxis.of(rows_of(dataset)[[frame]]).text(rows_of(dataset)[frame])},  {where}", loc="right")
    style.letter_panels((top, bottom))
    figure.align_ylabels((top, bottom))
    style.legend_above(figure, style.named_in(bottom))
    return figure


def _draw_pressure(ax: Axes, cut: xr.Dataset, limits: np.ndarray) -> None:
    if "pressure" not in cut:
        ax.set_yticks([])
        style.say_inside(ax, "pressure was not kept")
        return
    pressure = cut["pressure"].values
    unit = unit_for(pressure, "Pa")
    ax.stairs(unit(pressure), limits, fill=True, color=style.GREEN, alpha=0.3)
    ax.stairs(unit(pressure), limits, color=style.GREEN, lw=1)
    top = float(unit(np.nanmax(pressure, initial=0.0))) or 1.0
    ax.set_ylim(0, 1.12 * top)
    ax.set_ylabel(unit.label(VARIABLES["pressure"].label))


def _draw_surfaces(ax: Axes, cut: xr.Dataset, surface: np.ndarray, highest: float, limits: np.ndarray) -> None:
    """Draw profile, deformed surface and contact on a line of cells."""
    height, x = cut["height"].values, (limits[1:] + limits[:-1]) / 2
    level = highest - float(cut["approach"]) if "approach" in cut else np.nan
    known = np.concatenate([height, surface])
    known = known[np.isfinite(known)]
    if np.isfinite(level) and not (known.size and np.ptp(known)):
        known = np.append(known, level)  # a flat face in full contact
    unit = unit_for(np.ptp(known) if known.size else 0.0, "m")
    h, s = unit(height), unit(surface)
    low, high = (float(unit(known.min())), float(unit(known.max()))) if known.size else (0.0, 1.0)
    margin = 0.12 * ((high - low) or 1.0)
    bottom, top = low - margin, high + 2 * margin
    ax.set_ylim(bottom, top)
    wide = np.concatenate([limits[:1], x, limits[-1:]])  # the outer halves of the outermost cells
    ax.fill_between(wide, np.pad(h, 1, "edge"), bottom, color="0.72", lw=0, label="profile")
    ax.fill_between(wide, np.pad(s, 1, "edge"), top, color=style.BLUE, alpha=0.16, lw=0, label="half-space")
    ax.plot(x, h, color="0.25", lw=1)
    ax.plot(x, s, color=style.BLUE, lw=1)
    look = {"lw": 2.4, "marker": "o", "ms": 2.4, "mew": 0}  # a single cell is seen too
    ax.plot(x, np.where(contact(cut), h, np.nan), color=style.CONTACT, label="contact", **look)
    if bottom < unit(level) < top:
        ax.axhline(unit(level), color=style.BLUE, lw=0.8, ls=(0, (4, 2)), label="undeformed")
    ax.set_ylabel(unit.label(VARIABLES["height"].label))
