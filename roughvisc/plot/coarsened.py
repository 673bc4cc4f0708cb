"""Maps as they are drawn: of a big one, blocks of cells with their extremes kept.

A map of up to 1024 cells a side is drawn as it is. Of a larger one a cell drawn stands for a block of cells: for their
largest pressure, their smallest gap, contact if any of them touches, and the mean of heights and displacements. So a
spot of one cell is seen, which a picture of fewer points than cells would lose.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from roughvisc.topography.grid import axis_step
from roughvisc.variables import axis_of

#: Cells along the longer side up to which a map is drawn as it is.
MOST_DRAWN = 1024
#: What stands for a block of cells; what is not here, by its mean.
_KEPT = {"pressure": "largest", "gap": "smallest", "contact": "any", "flux": "largest"}


def stride(dataset: xr.Dataset | xr.DataArray) -> int:
    """Side of the block of cells that one cell drawn stands for."""
    return max(1, -(-max(dataset.sizes["x"], dataset.sizes["y"]) // MOST_DRAWN))


def note(dataset: xr.Dataset, *names: str) -> str:
    """What a reader has to know of coarsened maps of some fields; empty where maps are drawn as they are."""
    every = stride(dataset)
    if every == 1:
        return ""
    kept = [f"their {_KEPT.get(name, 'mean')} {name}" for name in names]
    return f"One cell drawn for {every} × {every}: " + ", ".join(kept) + "; in contact if any is"


def present(dataset: xr.Dataset, name: str, frame: int) -> xr.DataArray:
    """One frame of a field as it is drawn, missing where the profile is absent."""
    return drawn(dataset[name].isel({axis_of(dataset): frame}), dataset.get("height"))


def touching(dataset: xr.Dataset, frame: int) -> xr.DataArray:
    """Cells in contact of one frame as they are drawn: with pressure or, where none is stored, without a gap."""
    name = "pressure" if "pressure" in dataset else "gap"
    found = drawn(dataset[name].isel({axis_of(dataset): frame}))
    return (found > 0 if name == "pressure" else found <= 0).rename("contact")


def drawn(field: xr.DataArray, height: xr.DataArray | None = None) -> xr.DataArray:
    """A map in memory as it is drawn.

    Parameters
    ----------
    field : xarray.DataArray, dims (x, y)
        Of a name by which it is known what stands for a block.
    height : xarray.DataArray, optional
        Of the profile: where it is missing, so is the field.

    Returns
    -------
    xarray.DataArray, dims (x, y)
    """
    every = stride(field)
    if every == 1:
        field = field.load()
        return field if height is None else field.where(height.notnull())
    shape = (-(-field.sizes["x"] // every), -(-field.sizes["y"] // every))
    field = field.transpose("x", "y")
    values = in_blocks((field if height is None else field.where(height.notnull())).values, every, str(field.name))
    axes = {}
    for axis, count in zip(("x", "y"), shape, strict=True):
        side = axis_step(field, axis, "figure")
        axes[axis] = (axis, float(field[axis][0]) + side * ((np.arange(count) + 0.5) * every - 0.5), field[axis].attrs)
    return xr.DataArray(values, axes, ("x", "y"), field.name, field.attrs)


def in_blocks(values: np.ndarray, every: int, name: str = "") -> np.ndarray:
    """What stands for square blocks of cells; missing cells take no part, and blocks of nothing else are missing."""
    if every == 1:
        return values
    widths = [(0, -n % every) for n in values.shape]
    padded = np.pad(values, widths, constant_values=np.nan) if any(after for _, after in widths) else values
    cells = padded.reshape(padded.shape[0] // every, every, padded.shape[1] // every, every)
    if name in _KEPT:
        extreme = np.fmin if name == "gap" else np.fmax
        return np.asarray(extreme.reduce(extreme.reduce(cells, axis=3), axis=1))
    known = np.isfinite(cells)
    count = known.sum(axis=(1, 3))
    total = np.where(known, cells, 0.0).sum(axis=(1, 3))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def summed(field: xr.DataArray, along: str) -> np.ndarray:
    """Sums of the known cells of a map along one axis."""
    return np.asarray(field.sum(along).values)


def largest(field: xr.DataArray, along: str | None = None) -> np.ndarray:
    """The largest of the known cells of a map along one axis, or of all; NaN where there is none."""
    return np.asarray(field.max(along).values)
