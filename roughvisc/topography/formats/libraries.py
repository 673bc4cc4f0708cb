"""Formats that libraries parse: x3pio, sdfio, NumPy, netCDF and SurfaceTopography.

x3pio and sdfio return rows along y, ascending, so ``height(x, y)`` is the transpose. SurfaceTopography returns
``(x, y)``.
"""

from __future__ import annotations

from functools import partial
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends.netCDF4_ import NETCDF4_PYTHON_LOCK

from roughvisc.errors import InputError
from roughvisc.topography.formats.scan_file import Channel, ScanFile
from roughvisc.topography.grid import in_metres
from roughvisc.units import is_quantity, number

#: Names of heights in netCDF, in order of preference.
_NAMES = ("height", "heights", "z", "h")


def read_x3p(path: Path) -> ScanFile:
    """Read X3P (ISO 5436-2): surfaces with one channel for each layer, or a point cloud."""
    import x3pio

    complaints = []
    try:
        content = x3pio.read(path)
    except x3pio.X3pChecksumError as error:
        complaints.append(f"its checksum is wrong ({error}): it was changed or damaged after it was written")
        content = x3pio.read(path, verify=False)
    channels = []
    for i, layer in enumerate(content.layers):
        heights, kind, sides = layer.z.T, "height", (content.header.x.increment, content.header.y.increment)
        if content.feature_type == x3pio.FeatureType.POINT_CLOUD:
            heights, kind, sides = np.stack([layer.x, layer.y, layer.z], axis=-1).reshape(-1, 3), "points", None
        elif heights.ndim < 2 or not layer.is_regular_grid:
            kind = "a profile, or a map on absolute axes"
        load = partial(np.array, heights, float)
        channels.append(Channel(f"layer {i}", layer.z.shape[::-1], load, "m", "m", sides, kind=kind))
    maker = content.metadata.instrument if content.metadata else None
    instrument = " ".join(filter(None, (maker.manufacturer, maker.model))) if maker else ""
    return ScanFile("x3p", channels, 0, instrument, complaints)


def read_sdf(path: Path) -> ScanFile:
    """Read SDF (ISO 25178-71)."""
    import sdfio

    content = sdfio.read(path)
    heights, sides = content.data.T, (content.header.x_scale, content.header.y_scale)
    channel = Channel("height", heights.shape, lambda: heights, "m", "m", sides)
    return ScanFile("sdf", [channel], instrument=content.header.manufacturer_id.strip())


def read_npy(path: Path) -> ScanFile:
    """Read a NumPy array with rows along x."""
    heights = np.load(path, mmap_mode="r", allow_pickle=False)  # mapped: a forged shape fails before it is allocated
    kind = "height" if heights.ndim == 2 and heights.dtype.kind in "fiu" else "no areal height"
    load = partial(np.array, heights.T, float, order="C")
    return ScanFile("npy", [Channel("array", heights.shape[::-1], load, kind=kind)])


def read_netcdf(path: Path) -> ScanFile:
    """Read the variables of at least two dimensions of a file in netCDF, as heights if they lie over x and y."""
    with path.open("rb") as stream:  # the netCDF library crashes on some damaged files of the classic format
        options: dict[str, Any] = {"engine": "scipy" if stream.read(3) == b"CDF" else "netcdf4", "decode_times": False}
    # netCDF-4 is not thread-safe, and xarray would lock only the reading
    with NETCDF4_PYTHON_LOCK, xr.open_dataset(path, lock=False, **options) as dataset:
        found = [_variable(name, one) for name, one in dataset.data_vars.items() if one.ndim >= 2]
    return ScanFile("nc", sorted(found, key=lambda one: _NAMES.index(one.name) if one.name in _NAMES else len(_NAMES)))


def _variable(name: Any, variable: xr.DataArray) -> Channel:
    """Return a variable as a channel, with its heights loaded."""
    unit = variable.attrs.get("units")
    is_grid = set(variable.dims) == {"x", "y"} and variable.dtype.kind in "fiu"
    if not is_grid or (unit is not None and not is_quantity(f"1 {unit}", "m")):
        return Channel(str(name), variable.shape, lambda: None, unit, kind="no areal height")
    heights, positions, lateral = variable.transpose("x", "y").astype(float).load(), None, None
    if {"x", "y"} <= set(heights.coords):
        units = [heights[axis].attrs.get("units") for axis in "xy"]
        if (units[0] is None) != (units[1] is None):
            raise InputError(f"its coordinates x and y have the units {units[0]!r} and {units[1]!r}: expected both")
        lateral = None if units[0] is None else "m"
        positions = (in_metres(heights["x"], "x"), in_metres(heights["y"], "y"))
    return Channel(str(name), heights.shape, lambda: heights, unit, lateral, positions=positions)


def read_with_surface_topography(source: Path | BytesIO | StringIO, format: str) -> ScanFile:
    """Read any format of SurfaceTopography, from a file or from its content."""
    from SurfaceTopography.IO import lookup_reader_by_format  # slow to import

    if format not in lookup_reader_by_format:
        raise InputError(key="format", found=format, expected="a key of supported_formats")
    reader = lookup_reader_by_format[format](str(source) if isinstance(source, Path) else source)
    channels = [_channel(found) for found in reader.channels]
    described = reader.channels[0].info.get("instrument") if channels else None
    instrument = described.get("name") if isinstance(described, dict) else None
    default = getattr(reader, "_default_channel_index", None)
    return ScanFile(format, channels, default, str(instrument or ""), close=reader.close)


def _channel(found: Any) -> Channel:
    from SurfaceTopography.Support.UnitConversion import is_length_unit

    shape, sizes = tuple(int(n) for n in found.nb_grid_pts or ()), found.physical_sizes

    def load() -> np.ndarray:
        topography = found.topography(**({} if sizes is not None else {"physical_sizes": shape}))
        return np.ma.filled(np.ma.asarray(topography.heights(), dtype=float), np.nan)

    # a reader may mistake another unit for a length: phases in Bruker files come as heights in ('µm', None)
    units = [unit for unit in (found.unit, found.data_unit) if unit is not None]
    is_length = all(isinstance(unit, str) and is_length_unit(unit) for unit in units)
    if not (found.is_height_channel and found.dim == 2 and is_length and found.is_uniform is not False):
        return Channel(str(found.channel_id), shape, load, kind="no areal height on a uniform grid")
    lateral, sides = found.unit, None
    if sizes is not None:
        sides = (float(sizes[0]) / shape[0], float(sizes[1]) / shape[1])
        header = found.info.get("raw_metadata")
        if found.unit is None and isinstance(header, dict):  # the header may state the units of x and y alone
            lateral, other = (header.get(f"{one}unit") or header.get(f"{two}unit") for one, two in ("xy", "yx"))
            if lateral is not None and other != lateral:
                sides = (sides[0], sides[1] * number(f"1 {other}", lateral))
    return Channel(str(found.channel_id), shape, load, found.unit, lateral, sides)
