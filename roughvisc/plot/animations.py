"""Animation of a map of one case."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from roughvisc.errors import InputError
from roughvisc.plot import fields, style
from roughvisc.plot.coarsened import note, touching
from roughvisc.plot.rows import RowAxis, fullest_frame, require, rows_of, spread_frames
from roughvisc.units import unit_for
from roughvisc.variables import FIELDS, VARIABLES


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
    """Write an animation of a map, whose title states the time.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result; of fields on Dask one frame is in memory at a time.
    path : path-like
        File to write: ``.gif`` or ``.webp``, or ``.mp4`` where ffmpeg is installed. It appears only when complete.
    field : {"pressure", "gap", "displacement"}, optional
        Field that the map shows. Default: pressure, or gap if the result holds no pressure.
    frames : int
        At most so many kept times are shown, even on the time axis that suits them.
    rate : float
        Frames per second. [1/s]
    dpi : float
        Resolution of the pictures, which are 4.6 inch wide. [1/inch]

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
    """Figure, function that draws a frame into it, and the frames."""
    require(dataset, "x", "y")
    dataset = dataset.sortby(str(rows_of(dataset).name))
    field = field or ("pressure" if "pressure" in dataset else "gap")
    if field not in FIELDS:
        raise InputError(key="field", found=field, expected=f"one of {', '.join(FIELDS)}")
    require(dataset, field)
    chosen = [int(frame) for frame in spread_frames(rows_of(dataset), count)]
    dataset = fields.measured_part(dataset)
    figure = style.new_figure(4.6, 1.0 + 3.3 * float(np.clip(fields.plane_ratio(dataset), 0.3, 1.3)))
    ax = figure.add_subplot()
    scale = fields.joint_scale(fields.as_shown(dataset, field, frame) for frame in chosen)
    unit, plane = unit_for([scale.high], VARIABLES[field].units), fields.plane_unit(dataset)
    image = fields.draw_map(ax, fields.as_shown(dataset, field, chosen[0]), unit, plane, **scale.limits(unit))
    fields.colour_bar(figure, [image], scale, unit, location=fields.bar_side(dataset))
    fields.label_plane(ax, dataset, plane)
    style.note_below(figure, note(dataset, field))
    title, outline = ax.set_title("", loc="left"), [None]

    def draw(frame: int) -> list[Artist]:
        title.set_text(_heading(dataset, frame))
        image.set_data(np.ma.masked_invalid(unit(fields.as_shown(dataset, field, frame).transpose("y", "x"))))
        if outline[0] is not None:
            outline[0].remove()
            outline[0] = None
        if field != "gap" and {"pressure", "gap"} & set(dataset):
            outline[0] = fields.draw_outline(ax, touching(dataset, frame), plane)
        return [title]

    draw(fullest_frame(dataset))  # has all that the legend names
    style.legend_above(figure, fields.map_legend([image]))
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # the layout of the first picture holds for all
    return figure, draw, chosen


def _heading(dataset: xr.Dataset, frame: int) -> str:
    """Time of a frame, and the distance slid so far."""
    rows = rows_of(dataset)
    text = RowAxis.of(rows).text(rows[frame])
    if "sliding_distance" not in dataset:
        return text
    distance = dataset["sliding_distance"].values
    return f"{text}, {unit_for(distance, 'm').text(float(distance[frame]), 3)} slid"
