"""Formats of instrument makers that no library reads, and the choice between formats of text.

A text of a maker is recognised by its content. Rows run along x and the first row is y = 0, unless the format states
otherwise.
"""

from __future__ import annotations

import csv
import re
import struct
import zlib
from io import BytesIO
from pathlib import Path

import numpy as np

from roughvisc.errors import InputError
from roughvisc.tables import read_text
from roughvisc.topography.formats.libraries import read_with_surface_topography
from roughvisc.topography.formats.scan_file import Channel, ScanFile
from roughvisc.topography.formats.text import read_numbers, read_table

#: Zygo: phase counts per wave for each resolution in the header, and the count from which a point is missing.
_COUNTS, _MISSING = {0: 4096, 1: 32768, 2: 131072}, 2147483640
#: First bytes of a TrueMap file, and of a Digital Surf file without and with compression.
_TRUEMAP = b"Binary TrueMap Data File v2.0"
_DIGITAL_SURF, _COMPRESSED = b"DIGITAL SURF", b"DSCOMPRESSED"
#: Size of the header, and the offset at which it states the sizes of the comment and the private zone. [byte]
_HEADER, _SIZES = 512, 334


def read_zygo_xyz(text: str) -> ScanFile:
    """Read Zygo XYZ: column, row and height in micrometres of each point, or "No Data"."""
    (x0, y0, columns, rows), _, _, side, sections = _zygo(text)
    cells = [line.split() for line in sections[0].splitlines() if line.strip()]
    known = np.array([cell for cell in cells if "No" not in cell], dtype=float)
    heights = np.full((columns, rows), np.nan)
    heights[known[:, 0].astype(int) - x0, known[:, 1].astype(int) - y0] = known[:, 2]
    return _one("zygo", heights, "um", "m", side)


def read_zygo_ascii(text: str) -> ScanFile:
    """Read Zygo ASCII: intensities, then the phases of each row, in counts of a wave."""
    (_, _, columns, rows), wave, resolution, side, sections = _zygo(text)
    phases = [np.array(section.split(), dtype=float) for section in sections]
    (counts,) = [phase for phase in phases if phase.size == columns * rows][-1:]
    heights = np.where(counts < _MISSING, counts * (wave / _COUNTS[resolution]), np.nan)
    return _one("zygo", heights.reshape(rows, columns).T, "m", "m", side)


def _zygo(text: str) -> tuple[list[int], float, int, tuple[float, float] | None, list[str]]:
    """Return rectangle, height of one wave [m], resolution of the phase, cell sides [m] and the sections of a file."""
    header, *sections = re.split(r"^#\s*$", text, flags=re.MULTILINE)
    lines = header.splitlines()
    rectangle = [int(word) for word in lines[3].split()[:4]]
    _, scale, wavelength, _, obliquity, _, side, *_ = (float(word) for word in lines[7].split())
    resolution = int(lines[10].split()[0])
    return rectangle, scale * wavelength * obliquity, resolution, (side, side) if side > 0 else None, sections


def read_wyko(text: str) -> ScanFile:
    """Read Wyko ASCII: each line of the file is one column of the map, from the bottom up.

    Heights are in nanometres, or in waves if the second flag of the first line is 0. ``Pixel_size`` is the spacing
    along x in millimetres, and ``Aspect`` the spacing along y over it.
    """
    header, _, data = text.partition("RAW_DATA")
    lines = header.splitlines()
    stated = {line.split()[0]: line.split()[-1] for line in reversed(lines[1:]) if line.strip()}
    columns, rows = int(stated["X"]), int(stated["Y"])  # X Size and Y Size
    words = data.split("\n", 1)[1].split()[: columns * rows]
    heights = np.array(["nan" if word.lower() == "bad" else word for word in words], dtype=float)
    heights = heights.reshape(columns, rows)
    if lines[0].split()[-2] == "0":
        heights = heights * (float(stated["Wavelength"]) / float(stated["Mult"]))
    side = float(stated["Pixel_size"])
    return _one("wyko", heights, "nm", "mm", (side, float(stated.get("Aspect", 1)) * side))


def read_esri(text: str) -> ScanFile:
    """Read an ESRI ASCII grid: size of the cells and number of missing points in the header, first row on top."""
    found = re.findall(r"^\s*([A-Za-z_]+)\s+(\S+)\s*$", text, re.MULTILINE)
    header = {key.lower(): float(value) for key, value in found}
    data = np.array(text.split()[2 * len(header) :], dtype=float).reshape(int(header["nrows"]), int(header["ncols"]))
    heights = np.where(data == header.get("nodata_value", np.nan), np.nan, data).T
    side = header.get("cellsize", np.nan)
    return _one("esri", heights, None, None, (header.get("dx", side), header.get("dy", side)))


def read_keyence(text: str) -> ScanFile:
    """Read the CSV of a Keyence microscope: unit and spacing from its heading, blank cells are missing points."""
    table = read_table(text)
    heights = table.numbers().T
    heading = text.splitlines()[: table.rows[0]]
    separator = max(";,", key="".join(heading).count)
    stated = {row[0]: row[1:] for row in csv.reader(heading, delimiter=separator) if row}
    shape = int(stated["Horizontal"][0]), int(stated["Vertical"][0])
    if heights.shape != shape:
        raise InputError(f"found {heights.shape[0]} x {heights.shape[1]} numbers: expected {shape[0]} x {shape[1]}")
    shown, (side, lateral, *_) = stated.get("Output image data", ["Height"])[0], stated["XY Calibration"]
    sides = (float(side.replace(",", ".")),) * 2
    kind = "height" if shown == "Height" else "no areal height"
    channel = Channel(shown, shape, lambda: heights, stated["Unit"][0], lateral, sides, kind=kind)
    return ScanFile("keyence", [channel], instrument=stated.get("Model", [""])[0])


def _one(
    format: str, heights: np.ndarray, unit: str | None, lateral: str | None, sides: tuple[float, float] | None
) -> ScanFile:
    return ScanFile(format, [Channel("height", heights.shape, lambda: heights, unit, lateral, sides)])


#: Pattern of the beginning of a text -> its reader.
_TEXTS = {
    r"\W*Zygo XYZ Data File": read_zygo_xyz,
    r"\W*Zygo ASCII Data File": read_zygo_ascii,
    r"\W*Wyko ASCII Data File": read_wyko,
    r"\W*ncols": read_esri,
    r"(?s:.{,4000})XY Calibration": read_keyence,
}


def read_text_file(path: Path, format: str) -> ScanFile:
    """Read a text file: in the format of an instrument maker, points, or a matrix.

    Parameters
    ----------
    path : Path
        The file.
    format : str
        ``"zygo"``, ``"keyence"``, ``"wyko"`` or ``"esri"`` to refuse any other content; otherwise as in
        :func:`~roughvisc.topography.formats.text.read_numbers`.
    """
    text = read_text(path)
    for pattern, read in _TEXTS.items():
        if re.match(pattern, text, re.IGNORECASE):
            return read(text)
    if format in ("zygo", "keyence", "wyko", "esri"):
        raise InputError(f"its beginning differs: expected a text in the format {format}")
    return read_numbers(text, format)


def read_truemap(path: Path) -> ScanFile:
    """Read a TrueMap or GelSight file of version 2: a comment, then the grid in millimetres, top line first."""
    content = path.read_bytes()
    if not content.startswith(_TRUEMAP):
        raise InputError(f"found {content[: len(_TRUEMAP)]!r} at its beginning: expected {_TRUEMAP.decode()!r}")
    comment = content.index(b"\0") + 1
    at = content.index(b"\0", comment) + 1
    columns, rows, width, height = struct.unpack_from("<2I2f", content, at)
    heights = np.frombuffer(content, "<f4", columns * rows, at + 24).reshape(rows, columns).T.astype(float)
    channel = Channel("Default", (columns, rows), lambda: heights, "mm", "mm", (width / columns, height / rows))
    return ScanFile("tmd", [channel], instrument=content[comment : at - 1].decode("latin-1").strip())


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
    expanded, at = _DIGITAL_SURF + content[len(_DIGITAL_SURF) : begin], begin + 4 + 8 * count
    for raw, packed in struct.iter_unpack("<2I", content[begin + 4 : at]):
        expanded += zlib.decompressobj().decompress(content[at : at + packed], raw)
        at += packed
    return read_with_surface_topography(BytesIO(expanded), "sur")
