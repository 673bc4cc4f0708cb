"""TrueMap and GelSight (``.tmd``): a comment of any length, then the grid in millimetres."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from roughvisc.errors import InputError
from roughvisc.topography.formats.registry import Channel, ScanFile

_MAGIC = b"Binary TrueMap Data File v2.0"


def read_truemap(path: Path) -> ScanFile:
    """Read a TrueMap file of version 2; the first line of its map is the top line."""
    content = path.read_bytes()
    if not content.startswith(_MAGIC):
        raise InputError(f"found {content[: len(_MAGIC)]!r} at its beginning: expected {_MAGIC.decode()!r}")
    comment = content.index(b"\0") + 1
    at = content.index(b"\0", comment) + 1
    columns, rows, width, height = struct.unpack_from("<2I2f", content, at)
    if not (min(columns, rows) > 1 and width > 0 and height > 0):
        raise InputError(f"found {columns} x {rows} points over {width:g} x {height:g} mm: the file is damaged")
    heights = np.frombuffer(content, "<f4", columns * rows, at + 24).reshape(rows, columns).T.astype(float)
    sides = (width / columns, height / rows)
    instrument = content[comment : at - 1].decode("latin-1").strip()
    return ScanFile("tmd", [Channel("Default", (columns, rows), lambda: heights, "mm", "mm", sides)], 0, instrument)
