"""Grids in NetCDF and Zarr, through xarray: heights over coordinates x and y with units."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends.netCDF4_ import NETCDF4_PYTHON_LOCK

from roughvisc.errors import InputError
from roughvisc.topography.grid import metres_in, unit_of, with_coordinates
from roughvisc.topography.instruments import EXPANSION, Channel, affordable
from roughvisc.units import quantity

#: Names that heights go by, in order of preference.
_NAMES = ("height", "heights", "z", "h")
#: How NetCDF-3 files begin: the classic format, and the one with offsets of 64 bits.
_CLASSIC = (b"CDF\x01", b"CDF\x02")


def grid_channels(path: Path) -> tuple[Channel, ...]:
    """The variables of a grid file that span two dimensions or more."""
    with _open(path) as dataset:
        found = [str(name) for name, variable in dataset.data_vars.items() if variable.ndim >= 2]
        found.sort(key=lambda name: _NAMES.index(name) if name in _NAMES else len(_NAMES))
        return tuple(_channel(i, name, dataset[name]) for i, name in enumerate(found))


def is_labelled(path: Path) -> bool:
    """Whether an HDF5 file holds a variable over x and y, as netCDF does."""
    try:
        return any(channel.is_height for channel in grid_channels(path))
    # of another layout, or damaged: its own reader will say so
    except (OSError, RuntimeError, ValueError, LookupError, TypeError, AttributeError):
        return False


def open_grid(
    path: Path,
    channel: Channel,
    unit: float | None,
    height_unit: float | None,
    spacing: tuple[float, float] | None,
) -> xr.DataArray:
    """One variable as a labelled grid in metres, with the attributes and coordinates that it has.

    ``unit`` is the metres in one unit of what states none, ``height_unit`` that of the heights where it is another.

    Coordinates keep their origin; where they descend, the grid is turned round with them.
    """
    with _open(path) as dataset:
        affordable(path, int(np.prod(channel.shape, dtype=object)), EXPANSION)
        h = dataset[channel.name]
        h = h.astype(float).compute()
    extra = {name: h.coords[name] for name in h.coords if name not in ("x", "y") and set(h[name].dims) == {"x", "y"}}
    h = h.transpose("x", "y")
    metres = _metres(unit_of(h), unit if height_unit is None else height_unit, channel.name)
    if height_unit is not None and not math.isclose(metres, height_unit):
        raise InputError(
            f"its heights are in {unit_of(h)!r}: expected no height_unit; scale them afterwards", key="height_unit"
        )
    axes = []
    for axis, given in zip(("x", "y"), spacing or (None, None), strict=True):
        if given is not None:
            axes.append((np.arange(h.sizes[axis]) + 0.5) * given)
        elif axis not in h.coords:
            raise InputError(f'there is no coordinate {axis!r}: expected spacing, such as "1 um"', key="spacing")
        else:
            axes.append(h[axis].values.astype(float) * _metres(unit_of(h[axis]), unit, axis))
    attrs = {name: value for name, value in h.attrs.items() if name not in ("units", "long_name")}
    grid = with_coordinates(h.values if metres == 1.0 else h.values * metres, *axes, attrs)
    grid = grid.assign_coords({name: (("x", "y"), c.transpose("x", "y").values) for name, c in extra.items()})
    for axis in ("x", "y"):
        if grid.sizes[axis] > 1 and grid[axis][0] > grid[axis][-1]:
            grid = grid.isel({axis: slice(None, None, -1)})
    return grid


@contextmanager
def _open(path: Path) -> Iterator[xr.Dataset]:
    zarr = path.suffix.lower() == ".zarr"
    if zarr and find_spec("zarr") is None:
        raise InputError("it is in Zarr, which needs the package zarr: install it, or convert the file to netCDF")
    if zarr:
        with xr.open_dataset(path, engine="zarr", decode_times=False) as dataset:
            yield dataset
    elif _begins(path) in _CLASSIC:  # netCDF's own library does not survive every damaged one; no more than the file
        content = io.BytesIO(path.read_bytes())  # is ever held, whatever sizes its header claims
        with xr.open_dataset(content, engine="scipy", decode_times=False) as dataset:
            yield dataset
    else:  # xarray would lock no more than the reading, and netCDF-4 does not stand two threads at all
        with NETCDF4_PYTHON_LOCK, xr.open_dataset(path, engine="netcdf4", decode_times=False, lock=False) as dataset:
            yield dataset


def _begins(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(4)


def _channel(index: int, name: str, variable: xr.DataArray) -> Channel:
    units = [variable.attrs.get("units"), *(variable[a].attrs.get("units") for a in "xy" if a in variable.coords)]
    gridded = set(variable.dims) == {"x", "y"} and variable.dtype.kind in "fiu"
    shape = tuple(variable.sizes[d] for d in ("x", "y")) if gridded else variable.shape
    return Channel(index, name, gridded and _is_length(units[0]), shape, None if None in units else str(units[0]))


def _is_length(unit: Any) -> bool:
    try:
        return unit is None or quantity(f"1 {unit}", "m") > 0
    except InputError:
        return False


def _metres(stated: str | None, unit: float | None, name: str) -> float:
    if stated is not None:
        return metres_in(stated, name)
    if unit is None:
        raise InputError(f"{name} has no attribute 'units': expected unit, such as \"um\"", key="unit")
    return unit
