"""Formats that libraries parse: x3pio, sdfio, NumPy and SurfaceTopography.

x3pio and sdfio return rows along y, ascending, so ``height(x, y)`` is the transpose. SurfaceTopography returns
``(x, y)``.
"""

from __future__ import annotations

from functools import partial
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np

from roughvisc.errors import InputError
from roughvisc.topography.formats.registry import Channel, ScanFile, brief, suffixes
from roughvisc.units import number


def read_x3p(path: Path) -> ScanFile:
    """Read X3P (ISO 5436-2): surfaces with one channel for each layer, or a point cloud."""
    import x3pio

    complaints = []
    try:
        content = x3pio.read(path)
    except x3pio.X3pChecksumError as error:
        complaints.append(f"its checksum is wrong ({brief(error)}): it was changed or damaged after it was written")
        content = x3pio.read(path, verify=False)
    is_cloud = content.feature_type == x3pio.FeatureType.POINT_CLOUD
    channels = []
    for i, layer in enumerate(content.layers):
        heights, sides, kind = layer.z.T, None, "points" if is_cloud else "profile"
        if is_cloud:
            heights = np.stack([np.ravel(one) for one in (layer.x, layer.y, layer.z)], axis=1)
        elif heights.ndim == 2:
            kind = "height" if layer.is_regular_grid else "points on no regular grid (absolute axes)"
            sides = (content.header.x.increment, content.header.y.increment)
        load = partial(np.array, heights, float)
        channels.append(Channel(f"layer {i}", layer.z.shape[::-1], load, "m", "m", sides, kind=kind))
    maker = content.metadata.instrument if content.metadata else None
    instrument = " ".join(filter(None, (maker.manufacturer, maker.model))) if maker else ""
    return ScanFile("x3p", channels, 0, instrument, complaints)


def read_sdf(path: Path) -> ScanFile:
    """Read SDF (ISO 25178-71)."""
    import sdfio

    content = sdfio.read(path)
    rows, columns = content.data.shape
    sides = (content.header.x_scale, content.header.y_scale)
    kind = "height" if rows > 1 else "profile"
    channel = Channel("height", (columns, rows), lambda: content.data.T, "m", "m", sides, kind=kind)
    return ScanFile("sdf", [channel], 0, content.header.manufacturer_id.strip())


def read_npy(path: Path) -> ScanFile:
    """Read a NumPy array with rows along x."""
    heights = np.load(path, mmap_mode="r", allow_pickle=False)  # mapped: a forged shape fails before it is allocated
    kind = "height" if heights.ndim == 2 and heights.dtype.kind in "fiu" else "no areal height"
    return ScanFile(
        "npy", [Channel("array", heights.shape[::-1], lambda: np.array(heights.T, float, order="C"), kind=kind)]
    )


def read_with_surface_topography(path: Path, format: str, source: BytesIO | StringIO | None = None) -> ScanFile:
    """Read any format of SurfaceTopography.

    Parameters
    ----------
    path : Path
        The file.
    format : str
        Name of the format.
    source : stream, optional
        Content to read instead of the file.
    """
    from SurfaceTopography.IO import lookup_reader_by_format

    if format not in lookup_reader_by_format:
        raise InputError(key="format", found=format, expected=f"one of {', '.join(sorted(suffixes()))}, or 'auto'")
    reader = lookup_reader_by_format[format](str(path) if source is None else source)

    channels = [_channel(found) for found in reader.channels]
    described = reader.channels[0].info.get("instrument", {}) if channels else {}
    instrument = described.get("name", "") if isinstance(described, dict) else ""
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
    if len(shape) == 1 or 1 in shape:
        return Channel(str(found.channel_id), shape, load, kind="profile")
    if not (found.is_height_channel and found.dim == 2 and is_length and found.is_uniform is not False):
        return Channel(str(found.channel_id), shape, load, kind="no areal height on a uniform grid")
    lateral, sides = found.unit, None
    if sizes is not None:
        sides = tuple(float(size) / n for size, n in zip(sizes, shape, strict=True))
        header = found.info.get("raw_metadata", {})
        if found.unit is None and isinstance(header, dict):  # the header may state the units of x and y alone
            lateral, other = (header.get(f"{one}unit") or header.get(f"{two}unit") for one, two in ("xy", "yx"))
            if lateral is not None and other != lateral:
                sides = (sides[0], sides[1] * number(f"1 {other}", lateral))
    return Channel(str(found.channel_id), shape, load, found.unit, lateral, sides)
