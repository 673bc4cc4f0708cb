"""Binary formats, and all formats that SurfaceTopography reads.

x3pio and sdfio return rows along y, ascending, so ``height(x, y)`` is the transpose. SurfaceTopography returns
``(x, y)``.
"""

from __future__ import annotations

import struct
import zlib
from functools import partial
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends.netCDF4_ import NETCDF4_PYTHON_LOCK

from roughvisc.errors import InputError
from roughvisc.topography.formats.scan_file import Channel, ScanFile, single_map
from roughvisc.units import is_quantity, number

#: First bytes of a TrueMap file, and of a Digital Surf file without and with compression.
_TRUEMAP = b"Binary TrueMap Data File v2.0"
_DIGITAL_SURF = b"DIGITAL SURF"
_COMPRESSED = b"DSCOMPRESSED"
#: Size of the header, and the offset at which it states the sizes of the comment and the private zone. [byte]
_HEADER = 512
_SIZES = 334


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
    sides = (content.header.x.increment, content.header.y.increment)
    for i, layer in enumerate(content.layers):
        heights = layer.z.T
        kind = "height"
        if content.feature_type == x3pio.FeatureType.POINT_CLOUD and layer.x is not None and layer.y is not None:
            heights = np.stack([layer.x, layer.y, layer.z], axis=-1).reshape(-1, 3)
            kind = "points"
        elif heights.ndim < 2 or not layer.is_regular_grid:
            kind = "a profile, or a map on absolute axes"
        channels.append(Channel(f"layer {i}", partial(np.array, heights, float), "m", "m", sides, kind=kind))
    return ScanFile("x3p", channels, complaints=complaints)


def read_sdf(path: Path) -> ScanFile:
    """Read SDF (ISO 25178-71)."""
    import sdfio

    content = sdfio.read(path)
    return single_map("sdf", content.data.T, "m", "m", (content.header.x_scale, content.header.y_scale))


def read_npy(path: Path) -> ScanFile:
    """Read a NumPy array with rows along x."""
    heights = np.load(path, mmap_mode="r", allow_pickle=False)  # mapped: a forged shape fails before it is allocated
    kind = "height" if heights.ndim == 2 and heights.dtype.kind in "fiu" else "no areal height"
    return ScanFile("npy", [Channel("array", partial(np.array, heights.T, float, order="C"), kind=kind)])


def read_netcdf(path: Path) -> ScanFile:
    """Read the variables of at least two dimensions of a file in netCDF, as heights if they lie over x and y."""
    with path.open("rb") as stream:  # the netCDF library crashes on some damaged files of the classic format
        options: dict[str, Any] = {"engine": "scipy" if stream.read(3) == b"CDF" else "netcdf4", "decode_times": False}
    # netCDF-4 is not thread-safe, and xarray would lock only the reading
    with NETCDF4_PYTHON_LOCK, xr.open_dataset(path, lock=False, **options) as dataset:
        channels = [
            _variable(str(name), variable) for name, variable in dataset.data_vars.items() if variable.ndim >= 2
        ]
    return ScanFile("nc", channels)


def _variable(name: str, variable: xr.DataArray) -> Channel:
    """Return a variable as a channel, with its heights loaded."""
    unit = variable.attrs.get("units")
    is_grid = set(variable.dims) == {"x", "y"} and variable.dtype.kind in "fiu"
    if not is_grid or (unit is not None and not is_quantity(f"1 {unit}", "m")):
        return Channel(name, lambda: None, unit, kind="no areal height")
    heights = variable.transpose("x", "y").astype(float).load()
    if not {"x", "y"} <= set(heights.coords):
        return Channel(name, lambda: heights, unit)
    lateral, other = (heights[axis].attrs.get("units") for axis in ("x", "y"))
    if lateral != other:
        raise InputError(f"its coordinates x and y have the units {lateral!r} and {other!r}: expected one unit")
    return Channel(name, lambda: heights, unit, lateral, positions=(heights["x"].values, heights["y"].values))


def read_truemap(path: Path) -> ScanFile:
    """Read a TrueMap or GelSight file of version 2: a comment, then the grid in millimetres, top line first."""
    content = path.read_bytes()
    if not content.startswith(_TRUEMAP):
        raise ValueError(f"found {content[: len(_TRUEMAP)]!r} at its beginning: expected {_TRUEMAP.decode()!r}")
    offset = content.index(b"\0", content.index(b"\0") + 1) + 1
    columns, rows, width, height = struct.unpack_from("<2I2f", content, offset)
    heights = np.frombuffer(content, "<f4", columns * rows, offset + 24).reshape(rows, columns).T.astype(float)
    return single_map("tmd", heights, "mm", "mm", (width / columns, height / rows))


def read_digital_surf(path: Path) -> ScanFile:
    """Read a Digital Surf file, compressed or not; SurfaceTopography reads the expanded heights.

    A compressed file holds, after the comment and the private zone: the number of streams, the raw and the compressed
    size of each stream, and the zlib streams.
    """
    content = path.read_bytes()
    if not content.startswith(_COMPRESSED):
        return read_with_surface_topography(path, "sur")
    begin = _HEADER + sum(struct.unpack_from("<2H", content, _SIZES))
    (count,) = struct.unpack_from("<I", content, begin)
    expanded = _DIGITAL_SURF + content[len(_DIGITAL_SURF) : begin]
    offset = begin + 4 + 8 * count
    for raw, packed in struct.iter_unpack("<2I", content[begin + 4 : offset]):
        expanded += zlib.decompressobj().decompress(content[offset : offset + packed], raw)
        offset += packed
    return read_with_surface_topography(BytesIO(expanded), "sur")


def read_with_surface_topography(source: Path | BytesIO | StringIO, format: str) -> ScanFile:
    """Read any format of SurfaceTopography, from a file or from its content."""
    from SurfaceTopography.IO import lookup_reader_by_format  # slow to import

    if format not in lookup_reader_by_format:
        raise InputError(key="format", found=format, expected="a key of supported_formats")
    reader = lookup_reader_by_format[format](str(source) if isinstance(source, Path) else source)
    default = getattr(reader, "_default_channel_index", None)
    return ScanFile(format, [_channel(channel) for channel in reader.channels], default, close=reader.close)


def _channel(found: Any) -> Channel:
    from SurfaceTopography.Support.UnitConversion import is_length_unit

    shape = tuple(int(n) for n in found.nb_grid_pts or ())
    sizes = found.physical_sizes

    def load() -> np.ndarray:
        topography = found.topography(**({} if sizes is not None else {"physical_sizes": shape}))
        return np.ma.filled(np.ma.asarray(topography.heights(), dtype=float), np.nan)

    # a reader may mistake another unit for a length: phases in Bruker files come as heights in ('µm', None)
    units = [unit for unit in (found.unit, found.data_unit) if unit is not None]
    is_length = all(isinstance(unit, str) and is_length_unit(unit) for unit in units)
    if not (found.is_height_channel and found.dim == 2 and is_length and found.is_uniform is not False):
        return Channel(str(found.channel_id), load, kind="no areal height on a uniform grid")
    lateral = found.unit
    sides = None
    if sizes is not None:
        sides = (float(sizes[0]) / shape[0], float(sizes[1]) / shape[1])
        header = found.info.get("raw_metadata")
        if found.unit is None and isinstance(header, dict):  # the header may state the units of x and y alone
            lateral, other = (
                header.get(f"{axis}unit") or header.get(f"{other_axis}unit") for axis, other_axis in ("xy", "yx")
            )
            if lateral is not None and other != lateral:
                sides = (sides[0], sides[1] * number(f"1 {other}", lateral))
    return Channel(str(found.channel_id), load, found.unit, lateral, sides)
