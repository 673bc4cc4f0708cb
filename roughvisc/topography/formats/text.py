"""Text files: formats of instrument makers (by their first line), points x, y, z, and matrices of heights.

A matrix has its rows along x. An index row or column next to the heights, as pandas writes it, is removed.
"""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import mode
from typing import NamedTuple

import numpy as np

from roughvisc.errors import InputError
from roughvisc.tables import decimal_mark, name_and_unit, plain_number, read_text
from roughvisc.topography.formats import makers
from roughvisc.topography.formats.libraries import read_with_surface_topography
from roughvisc.topography.formats.registry import Channel, ScanFile
from roughvisc.units import is_quantity

#: First line of a file -> its reader.
_HEADED: dict[str, Callable[[str], ScanFile]] = {
    "zygo xyz data file": makers.read_zygo_xyz,
    "zygo ascii data file": makers.read_zygo_ascii,
    "wyko ascii data file": makers.read_wyko,
    "ncols": makers.read_esri,
}
#: A text without a header is a table, not a map, if it has fewer columns than the first number, and more lines than the
#: second number times the columns.
_COLUMNS, _TALL = 8, 20
#: Fewest numbers of an index, and their largest deviation from equal steps, in steps.
_FEWEST, _EQUAL = 4, 1e-3
#: Comments of Gwyddion that state the size of a matrix, in any language, and the units of points.
_MATRIX_SIZE = re.compile(r"^#[^:=：\n]*[:=：]\s*[\d.]+([eE][+-]?\d+)?\s*\w?[mA\u00c5]\s*$", re.MULTILINE)
_UNITS = re.compile(r"^#\s*(Lateral|Value) units:\s*(\S+)", re.MULTILINE)
#: Length with a decimal comma in a header, such as ``# Width: 12,5 um``.
_LENGTH = re.compile(r"(?<=[:=])(\s*)(\d[\d.]*,\d+)(?=\s*\w{0,2}m\b)")
#: Cells of a heading, such as ``x [mm]; y [mm]; z [um]``.
_HEADING = re.compile(r"[^\s;,\[(]+\s*(?:\[[^\]]*\]|\([^)]*\))")
#: Pattern of a possible number with a decimal comma, if blanks are the separators.
_WITH_COMMA = re.compile(r"[+-]?\d+(,\d+)?([eE][+-]?\d+)?")
#: Pattern of a row of numbers with decimal points and blanks between them.
_DECIMAL = r"(?:[+-]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d++)?|nan)"
_ROW = re.compile(rf"\s*{_DECIMAL}(?:\s+{_DECIMAL})*\s*")
#: Marks of a missing height.
_MISSING = ("", "nan", "bad", "-", "#n/a", "n/a")


class _Table(NamedTuple):
    """Lines of a text with decimal points and blanks between the numbers, and the places of the rows of numbers."""

    lines: list[str]
    rows: list[int]

    def numbers(self) -> np.ndarray:
        """Return the rows as a matrix."""
        return np.loadtxt([self.lines[at] for at in self.rows], ndmin=2)


def read_text_file(path: Path, format: str) -> ScanFile:
    """Read a text file: in the format of an instrument maker, points, or a matrix.

    Parameters
    ----------
    path : Path
        The file.
    format : str
        ``"xyz"`` for points x, y, z, one on each line, in any order; ``"asc"`` for a matrix; ``"csv"`` or ``"txt"`` for
        either; otherwise the format of a maker.
    """
    text = read_text(path)
    begins = text.lstrip('\ufeff"# ').lower()
    for words, read in _HEADED.items():
        if begins.startswith(words):
            return read(text)
    is_keyence = "XY Calibration" in text[:4000] and "Horizontal" in text[:4000]
    if format not in ("xyz", "asc", "csv", "txt", "keyence") or (format == "keyence" and not is_keyence):
        raise InputError(f"its first line differs: expected a text in the format {format}")
    table = _table(text)
    if is_keyence:
        heading = text.splitlines()[: table.rows[0]] if table.rows else []
        return makers.read_keyence(heading, table.numbers())
    found = None if format == "asc" else _points(table)
    if found is None and format == "xyz":
        raise ValueError("expected three numbers on each line")
    return found or _matrices(path, "csv" if format == "csv" else "asc", "\n".join(table.lines) + "\n")


def _table(text: str) -> _Table:
    """Return the table in a text.

    Values are separated by blanks, commas, semicolons or tabs. Empty values are missing heights. Lines of other text,
    such as ``# Width: 26 um``, stay unchanged, but for a decimal comma.

    Raises
    ------
    InputError
        If a value of the table is not a number, a row has fewer or more values than others, or the decimal mark is
        ambiguous. A damaged row must not be skipped like other text: the map would lose a row.
    """
    lines = _units_as_comments(text.splitlines())
    body = [at for at, line in enumerate(lines) if line.strip() and not line.startswith("#")]
    is_plain = all(_ROW.fullmatch(lines[at]) for at in body) and not any(map(_LENGTH.search, lines))
    if is_plain and len({len(lines[at].split()) for at in body}) == 1:
        return _Table(lines, body)
    separator = mode(_separator(lines[at]) for at in body) if body else " "
    cells = {at: _cells(lines[at], separator) for at in body}
    sizes = Counter(map(len, cells.values()))
    width = max(sizes, key=lambda size: size * sizes[size], default=0)  # of the rows that hold most cells
    marked = [cell for row in cells.values() if len(row) == width for cell in row if "," in cell or "." in cell]
    mark = decimal_mark(marked or [length[2] for line in lines for length in _LENGTH.finditer(line)], separator)
    numbers = {at: _numbers(row, mark) for at, row in cells.items()}
    rows = [at for at, row in numbers.items() if len(row) > 1 and None not in row and set(row) != {"nan"}]
    if rows:
        if separator != " " and all(lines[at].rstrip(" ").endswith(separator) for at in rows):
            numbers = {at: row[:-1] for at, row in numbers.items()}
        width = mode(len(numbers[at]) for at in rows)
        rows = [at for at, row in numbers.items() if len(row) == width and None not in row]
    for at, row in numbers.items() if rows else ():
        known = len(row) - row.count(None)
        is_wide = len(row) == width and known > 0 and (separator != " " or at > rows[0])
        if at in rows or not (rows[0] < at < rows[-1] or is_wide or known >= max(3, width / 2)):
            continue
        found = repr(cells[at][row.index(None)]) if None in row else f"{len(row)} of {width} values"
        expected = f"expected numbers with a decimal {'point' if mark == '.' else 'comma'}"
        raise InputError(f"line {at + 1}: found {found} among numbers ({lines[at][:60]!r}): {expected}")
    for at, line in enumerate(lines):
        lines[at] = _LENGTH.sub(lambda found: found[1] + (plain_number(found[2], mark) or found[2]), line)
    for at in rows:
        lines[at] = " ".join(map(str, numbers[at]))
    return _Table(lines, rows)


def _units_as_comments(lines: list[str]) -> list[str]:
    """Replace a heading by comments that state its units, as Gwyddion writes them."""
    first = next((at for at, line in enumerate(lines) if line.strip() and not line.startswith("#")), None)
    if first is None:
        return lines
    line = lines[first].replace('"', "")
    cells = [name_and_unit(cell) for cell in _HEADING.findall(line)]
    if _HEADING.sub("", line).strip(" ;,\t") or not all(is_quantity(f"1 {unit}", "m") for _, unit in cells):
        return lines
    names, units = [name.lower() for name, _ in cells], [unit for _, unit in cells]
    is_points = len(names) == 3 and names[:2] == ["x", "y"] and units[0] == units[1]
    if not is_points and len(names) != 1:
        expected = "expected 'x [mm], y [mm], z [um]' of points, with one unit of x and y, or 'height [um]' of a matrix"
        raise InputError(f"line {first + 1}: found the heading {lines[first][:60]!r}: {expected}")
    comments = f"# Lateral units: {units[0]}\n" * is_points + f"# Value units: {units[-1]}"
    return [*lines[:first], comments, *lines[first + 1 :]]


def _separator(line: str) -> str:
    """Return the separator of the cells of a line."""
    separator = next((sign for sign in ";\t," if sign in line), " ")
    words = line.split() if separator == "," else []
    return " " if len(words) > 1 and all(map(_WITH_COMMA.fullmatch, words)) else separator


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    quoted = '"' in line
    cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True)) if quoted else line.split(separator)
    return [cell.strip() for cell in cells]


def _numbers(cells: list[str], mark: str) -> list[str | None]:
    """Return numbers in the notation of Python, ``nan`` for a missing one, and None for other text."""
    shown = ["nan" if cell.lower() in _MISSING else cell for cell in cells]
    if mark == "." and _ROW.fullmatch(" ".join(shown)):
        return list(shown)
    return [cell if cell == "nan" else plain_number(cell, mark) for cell in shown]


def _points(table: _Table) -> ScanFile | None:
    """Return points x, y, z; None if the rows do not hold three numbers, or the header states the size of a matrix."""
    header = "\n".join(line for line in table.lines if line.startswith("#"))
    if not table.rows or len(table.lines[table.rows[0]].split()) != 3 or _MATRIX_SIZE.search(header):
        return None
    points, stated = table.numbers(), dict(_UNITS.findall(header))
    unit, lateral = stated.get("Value"), stated.get("Lateral")
    kind = "points" if unit is None or is_quantity(f"1 {unit}", "m") else "no areal height"
    return ScanFile("xyz", [Channel("points", (len(points),), lambda: points, unit, lateral, kind=kind)])


def _matrices(path: Path, format: str, text: str) -> ScanFile:
    found = read_with_surface_topography(path, "asc", io.StringIO(text))
    complaints: list[str] = []
    channels = [_matrix(channel, complaints) for channel in found.channels]
    return replace(found, format=format, channels=channels, complaints=complaints)


def _matrix(channel: Channel, complaints: list[str]) -> Channel:
    """Return a matrix without index numbers; a channel with few columns is marked as a table."""
    if not channel.is_height:
        return channel
    columns, rows = channel.shape
    if channel.spacing is None and columns < _COLUMNS and rows > _TALL * columns:
        return replace(channel, kind=f"a table of {columns} columns")
    z = channel.load().T  # as in the file
    row, column = _step(z[0, 1:], z[1:, 1:]), _step(z[1:, 0], z[1:, 1:].T)
    corner_fits = not z[0, 0] or np.isnan(z[0, 0]) or (row is not None and column is not None)
    if not corner_fits:  # the corner belongs to the index that it continues
        row = None if row is None or _step(z[0], z[1:]) is None else row
        column = None if column is None or _step(z[:, 0], z[:, 1:].T) is None else column
    if row is None and column is None:
        return replace(channel, load=lambda: z.T)
    z = z[int(row is not None) :, int(column is not None) :]
    z = z[:: -1 if column is not None and column < 0 else 1, :: -1 if row is not None and row < 0 else 1]
    removed = " and ".join(name for name, step in (("row", row), ("column", column)) if step is not None)
    spacing, taken = channel.spacing, "an index"
    if row is not None and column is not None and not row == column == 1.0:
        spacing, taken = spacing or (abs(row), abs(column)), "coordinates"
    complaints.append(f"the numbers of its first {removed} are in equal steps: taken as {taken}, not as heights")
    return replace(channel, shape=z.T.shape, load=lambda: z.T, spacing=spacing)


def _step(line: np.ndarray, others: np.ndarray) -> float | None:
    """Return the step of a line in equal steps if most of its neighbours are not in equal steps; None otherwise."""

    def uneven(lines: np.ndarray) -> np.ndarray:
        steps = np.diff(lines, axis=1)
        mean = np.nanmean(steps, axis=1, keepdims=True)
        return (mean[:, 0] == 0) | (np.nanmax(np.abs(steps - mean), axis=1) > _EQUAL * np.abs(mean[:, 0]))

    counted = others[np.isfinite(np.diff(others, axis=1)).sum(axis=1) >= _FEWEST - 1]
    if line.size < _FEWEST or not np.isfinite(line).all() or not len(counted):
        return None
    if uneven(line[None])[0] or uneven(counted).mean() < 0.5:
        return None
    return float(f"{(line[-1] - line[0]) / (line.size - 1):.12g}")
