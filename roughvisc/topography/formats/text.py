"""Formats of text: exports of instrument makers, points x, y, z, and matrices of heights.

A text of a maker is recognised by its content. Rows run along x and the first row is y = 0, unless the format states
otherwise. An index row or column next to the heights, as pandas writes it, is removed from a matrix.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from statistics import mode

import numpy as np

from roughvisc.errors import InputError
from roughvisc.tables import decimal_mark, read_text
from roughvisc.topography.formats.binary import read_with_surface_topography
from roughvisc.topography.formats.scan_file import Channel, ScanFile, single_map
from roughvisc.units import is_quantity

#: Zygo: phase counts per wave for each resolution in the header, and the count from which a point is missing.
_COUNTS = {0: 4096, 1: 32768, 2: 131072}
_MISSING_COUNT = 2147483640
#: A text without a header is a table, not a map, if it has fewer columns than the first number, and more lines than the
#: second number times the columns.
_COLUMNS = 8
_TALL = 20
#: Fewest numbers of an index, and their largest deviation from equal steps, in steps.
_FEWEST = 4
_EQUAL = 1e-3
#: Comments of Gwyddion that state the size of a matrix, in any language, and the units of points.
_MATRIX_SIZE = re.compile(r"^#[^:=：\n]*[:=：]\s*[\d.]+([eE][+-]?\d+)?\s*\w?[mA\u00c5]\s*$", re.MULTILINE)
_UNITS = re.compile(r"^#\s*(Lateral|Value) units:\s*(\S+)", re.MULTILINE)
#: Length with a decimal comma in a header, such as ``# Width: 12,5 um``.
_LENGTH = re.compile(r"(?<=[:=])\s*\d[\d.]*,\d+(?=\s*\w{0,2}m\b)")
#: Heading of points with their units, such as ``x [mm]; y [mm]; z [um]``.
_HEADING = re.compile(r"\W*".join(["^", *[r"(\w+)\s*[\[(]\s*(\w+)\s*[\])]"] * 3, "$"]), re.MULTILINE)
#: Heading of a matrix with the unit of its heights, such as ``height [um]``.
_MATRIX_HEADING = re.compile(r"\W*\w+\s*[\[(]\s*(\w+)\s*[\])]\W*")
#: Marks of a missing height, and a number with either decimal mark or one of these.
_MISSING = dict.fromkeys(("", "nan", "bad", "-", "#n/a", "n/a"), "nan")
_NUMBER = re.compile(r"[+-]?(?:\d++(?:[.,]\d*+)?|[.,]\d++)(?:e[+-]?\d++)?|nan|bad|-|(?:#?n/a)?", re.IGNORECASE)


def lines_and_rows(text: str) -> tuple[list[str], list[int]]:
    """Return the lines of a text, and the places of the rows of numbers.

    Values may be separated by blanks, commas, semicolons or tabs, and empty values are missing heights. The returned
    rows have decimal points, and blanks between the numbers. Lines of other text above them, such as ``# Width: 26
    um``, stay unchanged, except that a decimal comma becomes a point.

    Raises
    ------
    InputError
        If a value of the table is not a number, a row has fewer or more values than others, or the decimal mark is
        ambiguous. A damaged row must not be skipped like other text: the map would lose a row.
    """
    lines = text.splitlines()
    body = [at for at, line in enumerate(lines) if line.strip() and not line.startswith("#")]
    separator = mode(_separator(lines[at]) for at in body) if body else " "
    cells = {at: _cells(lines[at], separator) for at in body}
    if separator != " " and not any(row[-1] for row in cells.values() if _NUMBER.fullmatch(row[0])):
        # a separator ends each line
        cells = {at: row[:-1] for at, row in cells.items()}
    known = {at: sum(map(bool, map(_NUMBER.fullmatch, row))) for at, row in cells.items()}
    widths = [len(row) for at, row in cells.items() if 1 < len(row) == known[at]]
    width = mode(widths) if widths else 0
    rows = [at for at, row in cells.items() if len(row) == known[at] == width]
    others = sorted(set(body) - set(rows)) if rows else []
    for number in others:
        row = cells[number]
        is_wide = known[number] >= max(3, width / 2) or (separator != " " and len(row) == width)
        if rows[0] < number < rows[-1] or (known[number] and (is_wide or number > rows[-1])):
            wrong = next((repr(cell) for cell in row if not _NUMBER.fullmatch(cell)), f"{len(row)} of {width} values")
            found = f"found {wrong} among numbers ({lines[number][:60]!r})"
            raise InputError(f"line {number + 1}: {found}: expected numbers only")
    lengths = [found.strip() for line in lines for found in _LENGTH.findall(line)]
    mark = decimal_mark([*lengths, *(cell for at in rows for cell in cells[at])], separator)
    lines = [_LENGTH.sub(lambda found: found[0].replace(mark, "."), line) for line in lines]
    for at in rows:
        lines[at] = " ".join([_MISSING.get(cell.lower(), cell) for cell in cells[at]]).replace(mark, ".")
    return lines, rows


def numbers(lines: Sequence[str], rows: Sequence[int]) -> np.ndarray:
    """Return the rows of numbers as a matrix."""
    return np.loadtxt([lines[at] for at in rows], ndmin=2)


def _separator(line: str) -> str:
    """Return the separator of the cells of a line."""
    separator = next((sign for sign in ";\t," if sign in line), " ")
    words = line.split() if separator == "," else []
    return " " if len(words) > 1 and all(map(_NUMBER.fullmatch, words)) else separator


def _cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line."""
    cells = line.split() if separator == " " else next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    return list(map(str.strip, cells))


def read_numbers(text: str) -> ScanFile:
    """Read points x, y, z, one on each line, in any order; or a matrix.

    Three numbers on each line are points if the header does not state the size of a matrix.
    """
    lines, rows = lines_and_rows(text)
    heading = _MATRIX_HEADING.fullmatch(lines[rows[0] - 1]) if rows and rows[0] else None
    if heading and is_quantity(f"1 {heading[1]}", "m"):
        lines[rows[0] - 1] = f"# Value units: {heading[1]}"  # as Gwyddion writes it
    text = "\n".join(lines) + "\n"
    if rows and len(lines[rows[0]].split()) == 3 and not _MATRIX_SIZE.search(text):
        points = numbers(lines, rows)
        stated = dict(_UNITS.findall(text))
        if named := _HEADING.search(text):
            x, stated["Lateral"], y, other, _, stated["Value"] = named.groups()
            if (x.lower(), y.lower(), other) != ("x", "y", stated["Lateral"]):
                expected = "expected 'x [mm], y [mm], z [um]', with one unit of x and y"
                raise InputError(f"found the heading {named[0].strip()!r}: {expected}")
        units = stated.get("Value"), stated.get("Lateral")
        return ScanFile("xyz", [Channel("points", lambda: points, *units, kind="points")])
    file = read_with_surface_topography(io.StringIO(text), "asc")
    complaints: list[str] = []
    channels = [_matrix(channel, complaints) if channel.is_height else channel for channel in file.channels]
    return replace(file, channels=channels, complaints=complaints)


def _matrix(channel: Channel, complaints: list[str]) -> Channel:
    """Return a matrix without index numbers; a channel with few columns is marked as a table."""
    z = channel.load().T  # as in the file
    if channel.spacing is None and z.shape[1] < _COLUMNS and len(z) > _TALL * z.shape[1]:
        return replace(channel, kind=f"a table of {z.shape[1]} columns")
    row = _step(z[0, 1:], z[1:, 1:])
    column = _step(z[1:, 0], z[1:, 1:].T)
    if not (row and column):  # the corner belongs to the index that it continues
        row = _step(z[0], z[1:])
        column = _step(z[:, 0], z[:, 1:].T)
    if not (row or column):
        return replace(channel, load=lambda: z.T)
    labels = np.concatenate([z[0, 1:], z[1:, 0]])
    is_index = row == column == 1.0 and (labels == np.round(labels)).all()  # cell centres may be 0.5, 1.5, ...
    z = z[int(row is not None) :, int(column is not None) :]
    z = z[:: -1 if (column or 0) < 0 else 1, :: -1 if (row or 0) < 0 else 1]
    removed = " and ".join(name for name, step in (("row", row), ("column", column)) if step)
    spacing = channel.spacing
    taken = "an index"
    if row and column and not is_index:
        spacing = spacing or (abs(row), abs(column))
        taken = "coordinates"
    complaints.append(f"the numbers of its first {removed} are in equal steps: taken as {taken}, not as heights")
    return replace(channel, load=lambda: z.T, spacing=spacing)


def _step(line: np.ndarray, others: np.ndarray) -> float | None:
    """Return the step of a line in equal steps if most of its neighbours are not in equal steps; None otherwise."""
    if line.size < _FEWEST or not np.isfinite(line).all():
        return None
    steps = np.diff(np.vstack([line, others]))
    mean = np.nanmean(steps, axis=1)
    is_even = (mean != 0) & (np.nanmax(np.abs(steps - mean[:, None]), axis=1) <= _EQUAL * np.abs(mean))
    is_long = np.isfinite(steps).sum(axis=1) >= _FEWEST - 1
    counted = is_even[1:][is_long[1:]]
    if not (is_even[0] and counted.size) or counted.mean() > 0.5:
        return None
    return float(f"{(line[-1] - line[0]) / (line.size - 1):.12g}")


def read_zygo(text: str) -> ScanFile:
    """Read Zygo XYZ or Zygo ASCII.

    Zygo XYZ states column, row and height in micrometres of each point, or "No Data". Zygo ASCII states intensities,
    then the phases of each row, in counts of a wave.
    """
    header, *sections = re.split(r"^#\s*$", text, flags=re.MULTILINE)
    lines = header.splitlines()
    x0, y0, columns, rows = (int(word) for word in lines[3].split()[:4])
    _, scale, wavelength, _, obliquity, _, side, *_ = (float(word) for word in lines[7].split())
    if "XYZ" in lines[0].upper():
        cells = [line.split() for line in sections[0].splitlines() if line.strip()]
        known = np.array([cell for cell in cells if "No" not in cell], dtype=float)
        unit = "um"
        heights = np.full((columns, rows), np.nan)
        heights[known[:, 0].astype(int) - x0, known[:, 1].astype(int) - y0] = known[:, 2]
    else:
        wave = scale * wavelength * obliquity
        phases = [np.array(section.split(), dtype=float) for section in sections]
        (counts,) = [phase for phase in phases if phase.size == columns * rows][-1:]
        heights = np.where(counts < _MISSING_COUNT, counts * (wave / _COUNTS[int(lines[10].split()[0])]), np.nan)
        unit = "m"
        heights = heights.reshape(rows, columns).T
    return single_map("zygo", heights, unit, "m", (side, side) if side > 0 else None)


def read_wyko(text: str) -> ScanFile:
    """Read Wyko ASCII: each line of the file is one column of the map, from the bottom up.

    Heights are in nanometres, or in waves if the second flag of the first line is 0. ``Pixel_size`` is the spacing
    along x in millimetres, and ``Aspect`` the spacing along y over it.
    """
    header, _, data = text.partition("RAW_DATA")
    lines = header.splitlines()
    stated = {line.split()[0]: line.split()[-1] for line in reversed(lines[1:]) if line.strip()}
    # X Size and Y Size
    columns = int(stated["X"])
    rows = int(stated["Y"])
    words = data.split("\n", 1)[1].lower().replace("bad", "nan").split()
    heights = np.array(words[: columns * rows], dtype=float).reshape(columns, rows)
    if lines[0].split()[-2] == "0":
        heights = heights * (float(stated["Wavelength"]) / float(stated["Mult"]))
    side = float(stated["Pixel_size"])
    return single_map("wyko", heights, "nm", "mm", (side, float(stated.get("Aspect", 1)) * side))


def read_esri(text: str) -> ScanFile:
    """Read an ESRI ASCII grid: size of the cells and number of missing points in the header, first row on top."""
    entries = re.findall(r"^\s*([A-Za-z_]+)\s+(\S+)\s*$", text, re.MULTILINE)
    header = {key.lower(): float(value) for key, value in entries}
    data = np.array(text.split()[2 * len(header) :], dtype=float).reshape(int(header["nrows"]), int(header["ncols"]))
    heights = np.where(data == header.get("nodata_value", np.nan), np.nan, data).T
    side = header.get("cellsize", np.nan)
    return single_map("esri", heights, None, None, (header.get("dx", side), header.get("dy", side)))


def read_keyence(text: str) -> ScanFile:
    """Read the CSV of a Keyence microscope: unit and spacing from its heading, blank cells are missing points."""
    lines, rows = lines_and_rows(text)
    heights = numbers(lines, rows).T
    heading = text.splitlines()[: rows[0]]
    stated = {row[0]: row[1:] for row in csv.reader(heading, delimiter=max(";,", key="".join(heading).count)) if row}
    shape = int(stated["Horizontal"][0]), int(stated["Vertical"][0])
    if heights.shape != shape:
        raise InputError(f"found {heights.shape} numbers along x and y: expected {shape}, as its heading states")
    side, lateral, *_ = stated["XY Calibration"]
    return single_map("keyence", heights, stated["Unit"][0], lateral, (float(side.replace(",", ".")),) * 2)


#: Pattern of the beginning of a text -> its reader.
_TEXTS = {
    r"\W*Zygo (XYZ|ASCII) Data File": read_zygo,
    r"\W*Wyko ASCII Data File": read_wyko,
    r"\W*ncols": read_esri,
    r"(?s:.{,4000})XY Calibration": read_keyence,
}


def read_text_file(path: Path) -> ScanFile:
    """Read a text file: in the format of an instrument maker, points, or a matrix."""
    text = read_text(path)
    for pattern, read in _TEXTS.items():
        if re.match(pattern, text, re.IGNORECASE):
            return read(text)
    return read_numbers(text)
