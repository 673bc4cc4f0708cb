"""Rows of a result that a figure shows."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.topography.borders import MIRRORED, is_mirrored
from roughvisc.units import in_si
from roughvisc.variables import AXES, VARIABLES, axis_of

#: Largest number of times or speeds in one figure.
MOST = 24


def rows_of(dataset: xr.Dataset) -> xr.DataArray:
    """Return the coordinate of the rows of a result: its times or speeds."""
    return dataset[axis_of(dataset.variables)]


def frames_at(dataset: xr.Dataset, places: Any) -> list[int]:
    """Return the numbers of the rows nearest to some times or speeds; a negative whole number counts from the end."""
    rows = rows_of(dataset)
    name = str(rows.name)
    wanted = np.atleast_1d(np.asarray(in_si(places, VARIABLES[name].units, f"{name}s"), dtype=float)).ravel()
    if not 0 < wanted.size <= MOST:
        raise InputError(key=f"{name}s", found=f"{wanted.size} {name}s", expected=f"1 to {MOST}")
    frames = []
    for place in wanted:
        from_end = place < 0 and place == int(place) and -place <= rows.size
        if not np.isfinite(place) or (place < 0 and not from_end):
            expected = f"a {name} [{VARIABLES[name].units}], or -1 to -{rows.size} to count from the end"
            raise InputError(key=name, found=float(place), expected=expected)
        frames.append(rows.size + int(place) if from_end else int(np.abs(rows.values - place).argmin()))
    return frames


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


def measured_part(surface: Any) -> Any:
    """Return the measured part of a result or surface that was extended by its mirror images.

    A cropped surface keeps its history, so the heights must still equal their own mirror images.
    """
    mirrored = MIRRORED in str(surface.attrs.get("history", "")).split("\n")
    height = surface if isinstance(surface, xr.DataArray) else surface.get("height")
    if not mirrored or height is None or not is_mirrored(height.transpose("x", "y").values):
        return surface
    return surface.isel({axis: slice(0, surface.sizes[axis] // 2) for axis in ("x", "y")})
