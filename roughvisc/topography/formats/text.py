"""Text files: formats of instrument makers (by their first line), points x, y, z, and matrices of heights.

A matrix has its rows along x. An index row or column next to the heights, as pandas writes it, is removed.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from roughvisc.errors import InputError
from roughvisc.tables import read_text
from roughvisc.topography.formats import makers
from roughvisc.topography.formats.libraries import read_with_surface_topography
from roughvisc.topography.formats.registry import Channel, ScanFile
from roughvisc.topography.formats.separated_values import separated_by_blanks
from roughvisc.units import is_quantity

#: First line of a file -> its reader.
_HEADED: dict[str, Callable[[str], ScanFile]] = {
    "Zygo XYZ Data File": makers.read_zygo_xyz,
    "Zygo ASCII Data File": makers.read_zygo_ascii,
    "Wyko ASCII Data File": makers.read_wyko,
    "ncols": makers.read_esri,
}
#: A text without a header is a table, not a map, if it has fewer columns than the first number, and more lines than the
#: second number times the columns.
_COLUMNS, _TALL = 8, 20
#: Largest deviation of index numbers from equal steps, in steps.
_EQUAL = 1e-3
#: Comments of Gwyddion that state the size of a matrix, in any language, and the units of points.
_MATRIX_SIZE = re.compile(r"#[^:=：]*[:=：]\s*[\d.]+([eE][+-]?\d+)?\s*\w?[mA\u00c5]\s*$")
_UNITS = re.compile(r"#\s*(Lateral|Value) units:\s*(\S+)")
#: Fewest numbers of an index.
_FEWEST = 4


def read_headed(path: Path) -> ScanFile:
    """Read a text file in the format of an instrument maker.

    Raises
    ------
    InputError
        If its first line is not one of the known first lines.
    """
    found = _of_a_maker(read_text(path))
    if found is None:
        raise InputError(f"expected a text that begins with one of {', '.join(map(repr, _HEADED))}, or of Keyence")
    return found


def read_csv(path: Path) -> ScanFile:
    """Read separated values: the format of an instrument maker, points, or a matrix."""
    text = read_text(path)
    return _of_a_maker(text) or _points(separated_by_blanks(text)) or _matrices(path, "csv", text)


def read_points(path: Path) -> ScanFile:
    """Read points x, y, z, one on each line, in any order."""
    text = read_text(path)
    found = _of_a_maker(text) or _points(separated_by_blanks(text))
    if found is None:
        raise ValueError("expected three numbers on each line")
    return found


def read_matrix(path: Path) -> ScanFile:
    """Read a matrix of heights, whose rows run along x."""
    text = read_text(path)
    return _of_a_maker(text) or _matrices(path, "asc", text)


def _matrices(path: Path, format: str, text: str) -> ScanFile:
    source = io.TextIOWrapper(io.BytesIO(separated_by_blanks(text).encode()), encoding="utf-8")
    found = read_with_surface_topography(path, "asc", source)
    complaints: list[str] = []
    channels = [_matrix(channel, complaints) for channel in found.channels]
    return replace(found, format=format, channels=channels, complaints=complaints)


def _of_a_maker(text: str) -> ScanFile | None:
    begins = text.lstrip('\ufeff"# ')
    for words, read in _HEADED.items():
        if begins.lower().startswith(words.lower()):
            return read(text)
    head = text[:4000]
    return makers.read_keyence(text) if "XY Calibration" in head and "Horizontal" in head else None


def _points(text: str) -> ScanFile | None:
    """Return points x, y, z; None if the lines do not hold three numbers, or the header states the size of a matrix."""
    lines = text.splitlines()
    header = [line for line in lines if line.startswith("#")]
    rows = [line for line in lines if line.strip() and not line.startswith("#")]
    first = next((at for at, line in enumerate(rows) if line.split() and _is_numbers(line)), len(rows))
    if not rows[first:] or len(rows[first].split()) != 3 or any(map(_MATRIX_SIZE.match, header)):
        return None
    points = np.loadtxt(rows[first:], ndmin=2)
    stated = dict(found.groups() for found in map(_UNITS.match, header) if found)
    unit, lateral = stated.get("Value"), stated.get("Lateral")
    kind = "points" if unit is None or is_quantity(f"1 {unit}", "m") else "no areal height"
    return ScanFile("xyz", [Channel("points", (len(points),), lambda: points, unit, lateral, kind=kind)])


def _is_numbers(line: str) -> bool:
    try:
        return bool([float(word) for word in line.split()])
    except ValueError:
        return False


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
    complaint = f"the numbers of its first {removed} are in equal steps: taken as an index, not as heights"
    spacing = channel.spacing
    if row is not None and column is not None and not row == column == 1.0:
        spacing = spacing or (abs(row), abs(column))
        complaint = f"the numbers of its first {removed} are in equal steps: taken as coordinates, not as heights"
    complaints.append(complaint)
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
