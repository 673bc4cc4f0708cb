"""Animations: map, section and histories of one case moving together."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from roughvisc.errors import InputError
from roughvisc.observables import contact
from roughvisc.topography.grid import cell_edges
from roughvisc.units import Unit, unit_for
from roughvisc.variables import FIELDS, VARIABLES
from roughvisc.views.figures import fields, style, transport
from roughvisc.views.figures.coarsened import note, touching
from roughvisc.views.figures.histories import steps_of
from roughvisc.views.figures.rows import RowAxis, at_rows, fullest_frame, require, rows_of, spread_frames
from roughvisc.views.figures.sections import cut_position, deformed_surface, draw_contact

#: A map's side along y over that along x from which the map takes the whole height.
_TALL = 1.2
#: The histories that move along, the most of them, and the first of them: the most telling that a result holds.
_FIRST, _HISTORIES = ("leak_rate", "friction_coefficient", "force"), ("approach", "contact_area")


def _writer(path: Path, rate: float):
    suffix = path.suffix.lower()
    if suffix in (".gif", ".webp"):
        return PillowWriter(fps=rate)
    if suffix in (".mp4", ".m4v", ".mov"):
        if not FFMpegWriter.isAvailable():
            raise InputError(f"{path.name}: ffmpeg was not found, which {suffix} needs: install it, or write a .gif")
        # even numbers of pixels and this pixel format play everywhere
        return FFMpegWriter(fps=rate, extra_args=["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
    raise InputError(f"{path.name}: expected a name that ends in .gif, .webp or .mp4")


def animate(
    dataset: xr.Dataset, path, *, field: str | None = None, frames: int = 100, rate: float = 12.0, dpi: float = 100.0
) -> Path:
    """Write an animation: the map, a section and the histories move together.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result; of fields on Dask one frame is in memory at a time.
    path : path-like
        File to write: ``.gif`` or ``.webp``, or ``.mp4`` where ffmpeg is installed. It appears only when complete.
    field : {"pressure", "gap", "displacement", "flux"}, optional
        What the map shows; by default pressure, or gap where that was not kept. ``"flux"``: the fluid that leaks, as
        :func:`roughvisc.plot.leakage` draws it, derived frame by frame, and the leak rate in place of the force.
    frames : int
        At most so many kept times are shown, even on the time axis that suits them.
    rate : float
        Frames per second. [1/s]
    dpi : float
        Resolution of the pictures, which are 7.6 inch wide where histories move along. [1/inch]

    Returns
    -------
    pathlib.Path
        The file written.

    Raises
    ------
    InputError
        If the file name or the missing ffmpeg does not allow it, or the result holds no such field.
    """
    path = Path(path)
    writer = _writer(path, rate)
    unfinished = path.with_name(f".{path.stem}.{secrets.token_hex(4)}.part{path.suffix}")
    film = animation(dataset, field=field, frames=frames, rate=rate)
    try:
        film.save(str(unfinished), writer, dpi=dpi)
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)
    return path


def animation(dataset: xr.Dataset, *, field: str | None = None, frames: int = 100, rate: float = 12.0) -> FuncAnimation:
    """Animation of a result, as :func:`animate` writes it: a notebook shows it with buttons to play it.

    Parameters
    ----------
    dataset, field, frames, rate
        As for :func:`animate`.

    Returns
    -------
    matplotlib.animation.FuncAnimation
        Its methods ``save`` and ``to_jshtml`` make files of it. Keep it in a variable until one of them has.

    Raises
    ------
    InputError
        If the result holds no such field.
    """
    if frames < 1 or rate <= 0:
        raise InputError(f"frames is {frames!r} and rate is {rate!r}: expected positive numbers")
    figure, move, chosen = _moving(dataset, field, frames)
    return _Film(figure, move, chosen, interval=1000 / rate, cache_frame_data=False)


class _Film(FuncAnimation):
    """An animation that a notebook plays without settings of matplotlib's."""

    def _repr_html_(self) -> str:
        return super()._repr_html_() or self.to_jshtml()


@style.apply
def _moving(
    dataset: xr.Dataset, field: str | None, count: int
) -> tuple[Figure, Callable[[int], list[Artist]], list[int]]:
    """Figure, what draws a frame into it, and the frames."""
    require(dataset, "x", "y")
    dataset = dataset.sortby(str(rows_of(dataset).name))
    field = field or ("pressure" if "pressure" in dataset else "gap")
    if field not in (*FIELDS, "flux"):
        raise InputError(f"field is {field!r}: expected 'pressure', 'gap', 'displacement' or 'flux'")
    require(dataset, "gap" if field == "flux" else field)
    chosen = [int(frame) for frame in spread_frames(rows_of(dataset), count)]
    if field == "flux":
        dataset = transport.with_leak_rate(dataset)
        dataset = dataset.assign(flux=transport.flux_of(dataset))
    else:
        dataset = fields.measured_part(dataset)
    first = [name for name in _FIRST[field != "flux" :] if name in dataset][:1]
    histories = first + [name for name in _HISTORIES if name in dataset]
    sectioned = "height" in dataset and ("gap" in dataset or "displacement" in dataset)
    figure, on_map, cuts, right = _panels(fields.plane_ratio(dataset), sectioned, len(histories))
    movers = [
        (_moving_flow if field == "flux" else _moving_map)(figure, on_map, dataset, field, chosen),
        *(_moving_section(ax, dataset, chosen) for ax in cuts),
        *(_moving_history(ax, dataset, name, ax is right[-1]) for ax, name in zip(right, histories, strict=True)),
    ]
    style.letter_panels((on_map, *cuts, *right))
    figure.align_ylabels(right)
    style.note_below(figure, note(dataset, field))
    named = _legend(movers, on_map, cuts, right, chosen)
    letter = on_map.get_title(loc="left")
    title = on_map.set_title(letter, loc="left")

    def draw(frame: int) -> list[Artist]:
        title.set_text(f"{letter}  {_heading(dataset, frame)}".lstrip())
        for move in movers:
            move(frame)
        return [title]

    style.legend_above(figure, named)
    draw(chosen[0])
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # the first picture's layout holds for all
    return figure, draw, chosen


def _legend(
    movers: list[Callable[[int], object]], on_map: Axes, cuts: list[Axes], right: list[Axes], chosen: list[int]
) -> dict[str, Artist]:
    """What the moving pictures show, of all of them: some show a thing that the first one has not."""
    (image,) = on_map.images
    named: dict[str, Artist] = {}
    for frame in chosen:
        movers[0](frame)
        named |= transport.flow_legend(image) if image.get_gid() == "flux" else fields.map_legend([image])
    for ax in cuts:
        named |= {label: one for one, label in zip(*ax.get_legend_handles_labels(), strict=True) if label not in named}
    if right:
        named["shown on the map"] = Line2D([], [], color="k", ls="", marker="o", ms=5)
    return named


def _heading(dataset: xr.Dataset, frame: int) -> str:
    """Time of a frame, and the distance that is behind."""
    rows = rows_of(dataset)
    text = RowAxis.of(rows).text(rows[frame])
    if "sliding_distance" not in dataset:
        return text
    distance = dataset["sliding_distance"].values
    return f"{text}, {unit_for(distance, 'm').text(float(distance[frame]), 3)} slid"


def _panels(ratio: float, sectioned: bool, histories: int) -> tuple[Figure, Axes, list[Axes], list[Axes]]:
    """Figure, panel of the map, of the section if there is one, and of the histories, as the map's proportions suit."""
    if not histories:
        figure = style.new_figure(4.4, 0.8 + 3.3 * float(np.clip(ratio, 0.3, 1.3)) + 1.4 * sectioned)
        grid = figure.add_gridspec(1 + sectioned, 1, height_ratios=[3.3 * ratio, 1.4][: 1 + sectioned])
        return figure, figure.add_subplot(grid[0]), [figure.add_subplot(grid[1])] if sectioned else [], []
    figure = style.new_figure(7.6, 4.6 if ratio <= _TALL else 6.4)
    if ratio > _TALL:  # the map takes a column, and the section stands above the histories
        columns = figure.add_gridspec(1, 2, width_ratios=[1, 1.3])
        on_map, rows = figure.add_subplot(columns[0]), histories + sectioned
        right = list(columns[1].subgridspec(rows, 1).subplots(squeeze=False)[:, 0])
        return figure, on_map, right[: rows - histories], right[rows - histories :]
    columns = figure.add_gridspec(1, 2, width_ratios=[1.15, 1])
    heights = [2 * float(np.clip(ratio / 0.7, 0.5, 1)), 1][: 1 + sectioned]
    left = columns[0].subgridspec(1 + sectioned, 1, height_ratios=heights).subplots(squeeze=False)[:, 0]
    return figure, left[0], list(left[1:]), list(columns[1].subgridspec(histories, 1).subplots(squeeze=False)[:, 0])


def _moving_map(figure: Figure, ax: Axes, dataset: xr.Dataset, field: str, chosen: list[int]):
    scale = fields.joint_scale(fields.as_shown(dataset, field, frame) for frame in chosen)
    unit, plane = unit_for([scale.high], VARIABLES[field].units), fields.plane_unit(dataset)
    image = fields.draw_map(ax, fields.as_shown(dataset, field, chosen[0]), unit, plane, **scale.limits(unit))
    fields.colour_bar(figure, [image], scale, unit, location=fields.bar_side(dataset))
    fields.label_plane(ax, dataset, plane)
    outline = [None]

    def move(frame):
        image.set_data(np.ma.masked_invalid(unit(fields.as_shown(dataset, field, frame).transpose("y", "x"))))
        if outline[0] is not None:
            outline[0].remove()
        outline[0] = None
        if field != "gap" and ("pressure" in dataset or "gap" in dataset):
            outline[0] = fields.draw_outline(ax, touching(dataset, frame), plane)

    return move


def _moving_flow(figure: Figure, ax: Axes, dataset: xr.Dataset, field: str, chosen: list[int]):
    """Map of the flux over its largest at each time: over all times the last frames would show nothing."""
    plane = fields.plane_unit(dataset)

    def part(frame: int) -> xr.DataArray:
        flux = at_rows(dataset[field], frame).load()
        highest = float(np.nan_to_num(flux.values).max())
        return transport.visible(flux / (highest or 1.0), 1.0).rename(field)

    image = transport.draw_flux(ax, part(chosen[0]), Unit(1.0, ""), plane, 1.0)
    scale, label = transport.flux_scale(1.0), "Flux over its largest"
    fields.colour_bar(figure, [image], scale, Unit(1.0, ""), label, fields.bar_side(dataset))
    fields.label_plane(ax, dataset, plane)

    def move(frame):
        image.set_data(np.ma.masked_invalid(part(frame).transpose("y", "x")))

    return move


def _moving_section(ax: Axes, dataset: xr.Dataset, chosen: list[int]):
    """Profile and deformed surface along x, on the line that carries most when the contact is largest."""
    index = cut_position(dataset, fullest_frame(dataset), "y")
    height = dataset["height"].isel(y=index).values
    surfaces = [deformed_surface(dataset, frame, y=index).values for frame in chosen]
    known = np.concatenate([height, *surfaces])
    known = known[np.isfinite(known)]
    plane, unit = fields.plane_unit(dataset), unit_for(np.ptp(known), "m")
    x, limits = plane(dataset["x"]), plane(cell_edges(dataset["x"]))
    low, high = float(unit(known.min())), float(unit(known.max()))
    margin = 0.1 * ((high - low) or 1.0)
    top = high + 2 * margin
    ax.set_xlim(limits[0], limits[-1])
    ax.set_ylim(low - margin, top)
    ax.fill_between(x, unit(height), low - margin, color="0.72", lw=0, label="profile")
    ax.plot(x, unit(height), color="0.25", lw=0.9)
    body = ax.fill_between(x, unit(surfaces[0]), top, color=style.BLUE, alpha=0.16, lw=0, label="half-space")
    (line,) = ax.plot(x, unit(surfaces[0]), color=style.BLUE, lw=1)
    marked = draw_contact(ax, x, np.full(len(x), np.nan))
    ax.set_xlabel(plane.label("x"))
    ax.set_ylabel(unit.label("Height"))
    ax.set_title(f"y = {plane.text(float(dataset['y'][index]))}", loc="right")
    by_frame = dict(zip(chosen, surfaces, strict=True))

    def move(frame):
        surface = unit(by_frame[frame])
        line.set_ydata(surface)
        body.set_data(x, surface, top)
        on_line = contact(at_rows(dataset, frame).isel(y=index)).values
        marked.set_ydata(np.where(on_line, unit(height), np.nan))

    return move


def _moving_history(ax: Axes, dataset: xr.Dataset, name: str, lowest: bool):
    steps = steps_of(dataset)
    clock = rows_of(steps)
    steps = steps if name in steps else dataset[[name]]
    axis, (unit, spans) = RowAxis.of(clock), transport.rate_unit(steps[name])
    times, shown = axis.unit(rows_of(steps)), unit(steps[name].values)
    ax.plot(times, shown, color="0.75", lw=1)
    (run,) = ax.plot([], [], color=style.BLUE, lw=1.4)
    (now,) = ax.plot([], [], "o", color="k", ms=5)
    axis.apply(ax, clock)
    ax.minorticks_off()  # each costs time in every picture
    if not lowest:
        ax.set_xlabel("")
        ax.tick_params(labelbottom=False)
    if spans:
        style.spread_axis(ax.yaxis, shown)
        ax.set_ylim(shown[shown > 0].min() / 3, 3 * shown.max())
    else:
        style.leave_room(ax, shown)
    ax.set_ylabel(style.broken(unit.label(VARIABLES[name].label), 1.0))
    ax.grid(color="0.9", lw=0.5)

    reached = np.searchsorted(rows_of(steps).values, rows_of(dataset).values, side="right")

    def move(frame):
        run.set_data(times[: reached[frame]], shown[: reached[frame]])
        now.set_data(times[reached[frame] - 1 : reached[frame]], shown[reached[frame] - 1 : reached[frame]])

    return move
