"""Animation of a map of one case."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.artist import Artist

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.observables.frames import expect_result
from roughvisc.plot import style
from roughvisc.plot.maps import COLOUR_MAPS, colour_limits, draw_map, frame_of, frame_title, map_size, rows_of
from roughvisc.study.storage.folder import atomic_write
from roughvisc.units import unit_for
from roughvisc.variables import FIELDS, VARIABLES


@style.apply
def animate(dataset: xr.Dataset, path: Any, *, field: str | None = None, frames: int = 100, rate: float = 12.0) -> Path:
    """Write an animation of a map, whose title states the time or speed.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result; if its fields are on Dask, one frame is in memory at a time.
    path : path-like
        File to write: ``.gif`` or ``.webp``, or ``.mp4`` if ffmpeg is installed. It appears only when complete.
    field : {"pressure", "gap", "displacement"}, optional
        Field that the map shows. Default: pressure, or gap if the result holds no pressure.
    frames : int
        Largest number of kept times to show, evenly spread.
    rate : float
        Frames per second. [1/s]

    Returns
    -------
    pathlib.Path
        The file written.

    Raises
    ------
    InputError
        If the suffix is not supported, ffmpeg is missing, or the result does not hold the field.
    """
    path = Path(path)
    name = field or ("pressure" if "pressure" in dataset else "gap")
    one_of("field", name, FIELDS)
    expect_result(dataset, "x", "y", name)
    if frames < 1 or rate <= 0:
        raise InputError(f"frames is {frames!r} and rate is {rate!r}: expected positive numbers")
    writer = {".gif": PillowWriter, ".webp": PillowWriter, ".mp4": FFMpegWriter}.get(path.suffix.lower())
    if writer is None or not writer.isAvailable():
        raise InputError(f"{path.name}: expected a name that ends in .gif, .webp or, if ffmpeg is installed, .mp4")
    dataset = dataset.sortby(str(rows_of(dataset).name))
    rows = rows_of(dataset).size
    chosen = np.unique(np.linspace(0, rows - 1, min(rows, frames)).round().astype(int)).tolist()
    # one colour scale for all frames
    ends = [colour_limits(name, frame_of(dataset, name, frame).values) for frame in chosen]
    low, high = min(one[0] for one in ends), max(one[1] for one in ends)
    unit = unit_for([high], VARIABLES[name].units)
    limits = {"vmin": float(unit(low)) if name == "displacement" else 1e-12 * float(unit(high))}
    figure, (ax,) = style.new_panels(1, 1, *map_size(dataset, 3.2, 4.2), lines=2)
    first = frame_of(dataset, name, chosen[0])
    image = draw_map(ax, first, unit, COLOUR_MAPS[name], vmax=float(unit(high)), **limits)
    style.colour_bar(image, [ax], unit.label(VARIABLES[name].label))
    title = ax.set_title("", loc="left")

    def draw(frame: int) -> list[Artist]:
        title.set_text(frame_title(dataset, frame))
        image.set_data(np.ma.masked_invalid(unit(frame_of(dataset, name, frame).transpose("y", "x"))))
        return [title]

    with atomic_write(path) as temporary:
        FuncAnimation(figure, draw, chosen, cache_frame_data=False).save(temporary, writer(fps=rate), dpi=100)
    return path
