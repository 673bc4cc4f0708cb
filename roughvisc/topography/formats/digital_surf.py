"""Digital Surf (``.sur``): this module expands compressed heights, SurfaceTopography reads the result."""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from pathlib import Path

from roughvisc.topography.formats.libraries import read_with_surface_topography
from roughvisc.topography.formats.registry import ScanFile

_MAGIC, _COMPRESSED = b"DIGITAL SURF", b"DSCOMPRESSED"
#: Size of the header, and the offset at which it states the sizes of the comment and the private zone. [byte]
_HEADER, _SIZES = 512, 334


def read_digital_surf(path: Path) -> ScanFile:
    """Read a Digital Surf file, compressed or not.

    A compressed file holds, after the comment and the private zone: the number of streams, the raw and the compressed
    size of each stream, and the zlib streams.
    """
    with path.open("rb") as stream:
        if stream.read(len(_COMPRESSED)) != _COMPRESSED:
            return read_with_surface_topography(path, "sur")
    content = path.read_bytes()
    begin = _HEADER + sum(struct.unpack_from("<2H", content, _SIZES))
    (count,) = struct.unpack_from("<I", content, begin)
    sizes = [struct.unpack_from("<2I", content, begin + 4 + 8 * i) for i in range(count)]
    heights, at = b"", begin + 4 + 8 * count
    for raw, packed in sizes:
        heights += zlib.decompressobj().decompress(content[at : at + packed], raw)
        at += packed
    return read_with_surface_topography(path, "sur", BytesIO(_MAGIC + content[len(_MAGIC) : begin] + heights))
