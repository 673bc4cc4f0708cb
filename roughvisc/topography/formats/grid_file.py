"""Grids in NetCDF, through xarray: heights over coordinates x and y with units."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import xarray as xr
from xarray.backends.netCDF4_ import NETCDF4_PYTHON_LOCK

from roughvisc.errors import InputError
from roughvisc.topography.formats.libraries import read_with_surface_topography
from roughvisc.topography.formats.registry import Channel, ScanFile
from roughvisc.topography.grid import metres_in
from roughvisc.units import is_quantity

#: Names of the heights, in order of preference.
_NAMES = ("height", "heights", "z", "h")
#: First bytes of NetCDF-3 files: the classic format, and the one with offsets of 64 bits.
_CLASSIC = (b"CDF\x01", b"CDF\x02")


def read_grid(path: Path) -> ScanFile:
    """Read the variables of at least two dimensions of a grid file."""
    with _open(path) as dataset:
        found = [str(name) for name, variable in dataset.data_vars.items() if variable.ndim >= 2]
        found.sort(key=lambda name: _NAMES.index(name) if name in _NAMES else len(_NAMES))
        return ScanFile("nc", [_channel(path, name, dataset[name]) for name in found])


def read_hdf5(path: Path) -> ScanFile:
    """Read a grid in HDF5, as netCDF stores it, or else the file of an instrument."""
    # of another layout, or damaged: the other reader reports it
    with suppress(OSError, RuntimeError, ValueError, LookupError, TypeError, AttributeError):
        found = read_grid(path)
        if any(channel.is_height for channel in found.channels):
            return found
    return read_with_surface_topography(path, "h5")


def _channel(path: Path, name: str, variable: xr.DataArray) -> Channel:
    unit = variable.attrs.get("units")
    is_grid = set(variable.dims) == {"x", "y"} and variable.dtype.kind in "fiu"
    if not is_grid or (unit is not None and not is_quantity(f"1 {unit}", "m")):
        return Channel(name, variable.shape, lambda: None, unit, kind="no areal height")

    def load() -> xr.DataArray:
        with _open(path) as dataset:
            return dataset[name].astype(float).compute().transpose("x", "y")

    positions, lateral, shape = None, None, (variable.sizes["x"], variable.sizes["y"])
    if {"x", "y"} <= set(variable.coords):
        x, y = (variable[axis].values.astype(float) for axis in "xy")
        lateral, other = (variable[axis].attrs.get("units") for axis in "xy")
        if (lateral is None) != (other is None):
            raise InputError(f"its coordinates x and y have the units {lateral!r} and {other!r}: expected both")
        if lateral is not None:
            x, y, lateral = x * metres_in(str(lateral), "x"), y * metres_in(str(other), "y"), "m"
        positions = (x, y)
    return Channel(name, shape, load, unit, lateral, positions=positions)


@contextmanager
def _open(path: Path) -> Iterator[xr.Dataset]:
    options: dict[str, Any] = {"decode_times": False}
    with path.open("rb") as stream:
        begins = stream.read(4)
    if begins in _CLASSIC:  # the netCDF library crashes on some damaged files; scipy allocates the content only
        with xr.open_dataset(io.BytesIO(path.read_bytes()), engine="scipy", **options) as dataset:
            yield dataset
    else:  # netCDF-4 is not thread-safe, and xarray would lock only the reading
        with NETCDF4_PYTHON_LOCK, xr.open_dataset(path, engine="netcdf4", lock=False, **options) as dataset:
            yield dataset
