"""Points x, y, z and matrices of heights in text.

A matrix has its rows along x. An index row or column next to the heights, as pandas writes it, is removed.
"""

from __future__ import annotations

import csv
import io
import re
from dataclasses import replace
from statistics import mode
from typing import NamedTuple

import numpy as np

from roughvisc.errors import InputError
from roughvisc.tables import decimal_mark, name_and_unit
from roughvisc.topography.formats.libraries import read_with_surface_topography
from roughvisc.topography.formats.scan_file import Channel, ScanFile
from roughvisc.units import is_quantity

#: A text without a header is a table, not a map, if it has fewer columns than the first number, and more lines than the
#: second number times the columns.
_COLUMNS, _TALL = 8, 20
#: Fewest numbers of an index, and their largest deviation from equal steps, in steps.
_FEWEST, _EQUAL = 4, 1e-3
#: Comments of Gwyddion that state the size of a matrix, in any language, and the units of points.
_MATRIX_SIZE = re.compile(r"^#[^:=：\n]*[:=：]\s*[\d.]+([eE][+-]?\d+)?\s*\w?[mA\u00c5]\s*$", re.MULTILINE)
_UNITS = re.compile(r"^#\s*(Lateral|Value) units:\s*(\S+)", re.MULTILINE)
#: Length with a decimal comma in a header, such as ``# Width: 12,5 um``.
_LENGTH = re.compile(r"(?<=[:=])\s*\d[\d.]*,\d+(?=\s*\w{0,2}m\b)")
#: Cells of a heading, such as ``x [mm]; y [mm]; z [um]``.
_HEADING = re.compile(r"[^\s;,\[(]+\s*(?:\[[^\]]*\]|\([^)]*\))")
#: Marks of a missing height, and a number with either decimal mark or one of these.
_MISSING = dict.fromkeys(("", "nan", "bad", "-", "#n/a", "n/a"), "nan")
_NUMBER = re.compile(r"[+-]?(?:\d++(?:[.,]\d*+)?|[.,]\d++)(?:e[+-]?\d++)?|nan|bad|-|(?:#?n/a)?", re.IGNORECASE)


class Table(NamedTuple):
    """Lines of a text with decimal points and blanks between the numbers, and the places of the rows of numbers."""

    lines: list[str]
    rows: list[int]

    def numbers(self) -> np.ndarray:
        """Return the rows as a matrix."""
        return np.loadtxt([self.lines[at] for at in self.rows], ndmin=2)


def read_table(text: str) -> Table:
    """Return the table in a text.

    Values are separated by blanks, commas, semicolons or tabs. Empty values are missing heights. Lines of other text,
    such as ``# Width: 26 um``, stay unchanged, except that a decimal comma becomes a point.

    Raises
    ------
    InputError
        If a value of the table is not a number, a row has fewer or more values than others, or the decimal mark is
        ambiguous. A damaged row must not be skipped like other text: the map would lose a row.
    """
    lines = text.splitlines()
    body = [at for at, line in enumerate(lines) if line.strip() and not line.startswith("#")]
    separator = mode(_separator(lines[at]) for at in body) if body else " "
    if body and (comments := _units_in_comments(lines[body[0]], body[0])):
        lines[body.pop(0)] = comments
    cells = {at: _cells(lines[at], separator) for at in body}
    known = {at: sum(map(bool, map(_NUMBER.fullmatch, row))) for at, row in cells.items()}
    rows = [at for at, row in cells.items() if 1 < len(row) == known[at]]
    if rows and separator != " " and not any(cells[at][-1] for at in rows):  # a separator ends each line
        cells, known = {at: row[:-1] for at, row in cells.items()}, {at: count - 1 for at, count in known.items()}
    width = mode(len(cells[at]) for at in rows) if rows else 0
    rows = [at for at in rows if len(cells[at]) == width]
    lengths = [found[0].strip() for line in lines for found in _LENGTH.finditer(line)]
    mark = decimal_mark([*lengths, *(cell for at in rows for cell in cells[at])], separator)
    for at in sorted(set(cells) - set(rows)) if rows else ():
        row = cells[at]
        is_wide = len(row) == width and known[at] and (separator != " " or at > rows[0])
        if rows[0] < at < rows[-1] or is_wide or known[at] >= max(3, width / 2):
            wrong = [repr(cell) for cell in row if not _NUMBER.fullmatch(cell)] or [f"{len(row)} of {width} values"]
            expected = f"expected numbers with a decimal {'point' if mark == '.' else 'comma'}"
            raise InputError(f"line {at + 1}: found {wrong[0]} among numbers ({lines[at][:60]!r}): {expected}")
    for at, line in enumerate(lines):
        lines[at] = _LENGTH.sub(lambda found: found[0].replace(mark, "."), line)
    for at in rows:
        lines[at] = " ".join([_MISSING.get(cell.lower(), cell) for cell in cells[at]]).replace(mark, ".")
    return Table(lines, rows)


def _units_in_comments(line: str, at: int) -> str | None:
    """Return comments that state the units of a heading, as Gwyddion writes them; None for any other line."""
    bare = line.replace('"', "")
    cells = [name_and_unit(cell) for cell in _HEADING.findall(bare)]
    if _HEADING.sub("", bare).strip(" ;,\t") or not all(is_quantity(f"1 {unit}", "m") for _, unit in cells):
        return None
    names, units = [name.lower() for name, _ in cells], [unit for _, unit in cells]
    if len(names) == 1:
        return f"# Value units: {units[0]}"
    if len(names) == 3 and names[:2] == ["x", "y"] and units[0] == units[1]:
        return f"# Lateral units: {units[0]}\n# Value units: {units[2]}"
    expected = "expected 'x [mm], y [mm], z [um]' of points, with one unit of x and y, or 'height [um]' of a matrix"
    raise InputError(f"line {at + 1}: found the heading {line[:60]!r}: {expected}")


def _separator(line: str) -> str:
    """Return the separator of the cells of a line."""
    separator = next((sign for sign in ";\t," if sign in line), " ")
    words = line.split() if separator == "," else []
    return " " if len(words) > 1 and all(map(_NUMBER.fullmatch, words)) else separator


def _cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line."""
    cells = line.split() if separator == " " else next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    return list(map(str.strip, cells))


def read_numbers(text: str, format: str) -> ScanFile:
    """Read points x, y, z, one on each line, in any order; or a matrix.

    Parameters
    ----------
    text : str
        Content of the file.
    format : str
        ``"xyz"`` for points; ``"asc"`` for a matrix; any other for either. Three numbers on each line are points if the
        header does not state the size of a matrix.
    """
    table = read_table(text)
    text, stated = "\n".join(table.lines) + "\n", dict(_UNITS.findall("\n".join(table.lines)))
    columns = len(table.lines[table.rows[0]].split()) if table.rows else 0
    if format != "asc" and columns == 3 and not _MATRIX_SIZE.search(text):
        points = table.numbers()
        channel = Channel("points", (len(points),), lambda: points, stated.get("Value"), stated.get("Lateral"))
        return ScanFile("xyz", [replace(channel, kind="points")])
    if format == "xyz":
        raise ValueError("expected three numbers on each line")
    found = read_with_surface_topography(io.StringIO(text), "asc")
    complaints: list[str] = []
    channels = [_matrix(channel, complaints) for channel in found.channels]
    return replace(found, format="csv" if format == "csv" else "asc", channels=channels, complaints=complaints)


def _matrix(channel: Channel, complaints: list[str]) -> Channel:
    """Return a matrix without index numbers; a channel with few columns is marked as a table."""
    if not channel.is_height:
        return channel
    columns, rows = channel.shape
    if channel.spacing is None and columns < _COLUMNS and rows > _TALL * columns:
        return replace(channel, kind=f"a table of {columns} columns")
    z = channel.load().T  # as in the file
    row, column = _step(z[0, 1:], z[1:, 1:]), _step(z[1:, 0], z[1:, 1:].T)
    if abs(z[0, 0]) > 0 and not (row and column):  # the corner belongs to the index that it continues
        row, column = row and _step(z[0], z[1:]), column and _step(z[:, 0], z[:, 1:].T)
    if row is None and column is None:
        return replace(channel, load=lambda: z.T)
    z = z[int(row is not None) :, int(column is not None) :]
    z = z[:: -1 if (column or 0) < 0 else 1, :: -1 if (row or 0) < 0 else 1]
    removed = " and ".join(name for name, step in (("row", row), ("column", column)) if step is not None)
    spacing, taken = channel.spacing, "an index"
    if row and column and not row == column == 1.0:
        spacing, taken = spacing or (abs(row), abs(column)), "coordinates"
    complaints.append(f"the numbers of its first {removed} are in equal steps: taken as {taken}, not as heights")
    return replace(channel, shape=z.T.shape, load=lambda: z.T, spacing=spacing)


def _step(line: np.ndarray, others: np.ndarray) -> float | None:
    """Return the step of a line in equal steps if most of its neighbours are not in equal steps; None otherwise."""

    def uneven(lines: np.ndarray) -> np.ndarray:
        steps = np.diff(lines)
        mean = np.nanmean(steps, axis=1)
        return (mean == 0) | (np.nanmax(np.abs(steps - mean[:, None]), axis=1) > _EQUAL * np.abs(mean))

    counted = others[np.isfinite(np.diff(others)).sum(axis=1) >= _FEWEST - 1]
    if line.size < _FEWEST or not np.isfinite(line).all() or not len(counted):
        return None
    if uneven(line[None])[0] or uneven(counted).mean() < 0.5:
        return None
    return float(f"{(line[-1] - line[0]) / (line.size - 1):.12g}")
