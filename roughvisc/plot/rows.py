"""Rows of a result that a figure shows."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
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
