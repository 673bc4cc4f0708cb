"""Tables as test machines export them: columns found by name, units in the heading or below it, either decimal mark."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.study.statement.columns import separated, several_lines
from roughvisc.topography.readers import regular
from roughvisc.topography.text_numbers import decimal_mark, plain_number, read_text
from roughvisc.units import is_quantity, quantity

_BRACKETED = re.compile(r"(?P<name>.*?)\s*[\[\(]\s*(?P<unit>[^\[\]\(\)]*?)\s*[\]\)]")
#: what may stand between a name and its unit without brackets
_BETWEEN = (" in ", "/", ",", "_", " ")
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
#: lines that a heading is sought in
_FIRST = 200

Row = tuple[int, list[str]]


@dataclass(frozen=True)
class Wanted:
    """A column that is wanted: as the user names it, with a unit or without, and the SI unit of its quantity."""

    column: str
    unit: str


def read_sheet(
    path: str | Path, wanted: Mapping[str, Wanted], decimal: str | None = None
) -> tuple[dict[str, NDArray[np.float64]], list[int]]:
    """Columns of a table, in SI, and the line that each row stands on.

    Parameters
    ----------
    path : path
        A text file with semicolons, tabs, commas or blanks between the columns. Lines before the heading are passed
        over: the heading is the first line that holds all columns wanted.
    wanted : mapping of str to Wanted
        Key -> column. Names match whatever their case, with the unit or without it. The unit stands in the name
        that is wanted, in the heading (``Force [mN]``, ``Force (mN)``, ``Force/mN``, ``Force in mN``, ``Force_mN``) or
        in the line below it.
    decimal : {".", ","}, optional
        Decimal mark; by default it is told by the numbers.

    Returns
    -------
    dict of str to ndarray, list of int

    Raises
    ------
    InputError
        If the file cannot be read, a column or its unit is not found, or a cell is no number; the line is named.
    """
    path = Path(path)
    separator, rows, spread = _rows(path)
    at, places = _heading(path, rows, wanted)
    below = at + 1 < len(rows) and _tells_units(path, rows[at + 1], places, wanted)
    data = rows[at + 1 + below :]
    if not data:
        raise InputError(f"{path}: holds no rows below the heading in line {rows[at][0]}: expected numbers")
    for line, _ in rows[at + 1 :]:
        if line in spread:
            raise several_lines(path, line)
    width = len(rows[at][1])
    for line, row in data:
        if any(row[width:]) or (separator == " " and len(row) != width):
            raise InputError(
                f"{path}, line {line}: found {len(row)} cells under a heading of {width}: expected as many"
            )
    mark = decimal or _decimal_mark(
        path, [_cell(row, place) for _, row in data for place in places.values()], separator
    )
    columns = {}
    for key, place in places.items():
        heading = rows[at][1][place].strip()
        stated = _cell(rows[at + 1][1], place) if below else ""
        factor = _factor(path, key, wanted[key], heading, stated)
        cells = [_cell(row, place) for _, row in data]
        numbers = _numbers(path, key, heading, cells, [line for line, _ in data], mark)
        columns[key] = np.array([float(f"{number * factor:.15g}") for number in numbers])
    return columns, [line for line, _ in data]


def _rows(path: Path) -> tuple[str, list[Row], set[int]]:
    """What separates the cells; rows of cells with their line numbers, without blank lines and comments; and the
    numbers of those that go over several lines, as headings may."""
    try:
        regular(path)
        text = read_text(path)
    except (OSError, UnicodeError) as error:
        raise InputError(f"{path}: cannot be read as a table: {error}") from error
    kept = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not kept:
        raise InputError(f"{path}: holds no rows: expected a heading and numbers")
    last = kept[-1][1]
    separator = next((mark for mark in (";", "\t") if mark in last), ",")
    blanks = last.split()
    if separator == "," and len(blanks) > 1 and all(_NUMBER.fullmatch(cell) for cell in blanks):
        return " ", [(i, line.split()) for i, line in kept], set()
    return separator, *separated(path, kept, separator)


def _cell(row: Sequence[str], place: int) -> str:
    return row[place].strip() if place < len(row) else ""


def _tells_units(path: Path, row: Row, places: Mapping[str, int], wanted: Mapping[str, Wanted]) -> bool:
    """Whether the row below the heading holds units, or nothing; what holds neither them nor numbers is refused."""
    line, cells = row
    found = {key: _cell(cells, place) for key, place in places.items()}
    if any(map(_is_number, found.values())):
        return False
    for key, cell in found.items():
        if cell and not is_quantity(f"1 {cell.strip('[]() ')}", wanted[key].unit):
            expected = f"expected a number for {key}, or a unit of its kind below the heading"
            raise InputError(f"{path}, line {line}: found {cell!r}: {expected}")
    return any(found.values()) or not any(map(str.strip, cells))


def _is_number(cell: str) -> bool:
    return any(plain_number(cell.strip(), mark) is not None for mark in ".,")


def _named(text: str) -> str:
    return " ".join(text.split()).casefold()


def _split(heading: str, unit: str) -> tuple[str, str]:
    """Name and unit of a heading; the unit is empty where none is told."""
    bracketed = _BRACKETED.fullmatch(heading.strip())
    if bracketed:
        return bracketed["name"], bracketed["unit"]
    for mark in _BETWEEN:
        name, _, told = heading.rpartition(mark)
        if name and is_quantity(f"1 {told.strip()}", unit):
            return name, told.strip()
    return heading, ""


def _heading(path: Path, rows: Sequence[Row], wanted: Mapping[str, Wanted]) -> tuple[int, dict[str, int]]:
    """Index of the first row that holds all wanted columns, and where in it they stand."""
    for at, (line, row) in enumerate(rows[:_FIRST]):
        found = {key: _places(row, one) for key, one in wanted.items()}
        if not all(found.values()):
            continue
        for key, places in found.items():
            if len(places) > 1:
                names = ", ".join(repr(row[place]) for place in places)
                raise InputError(
                    f"{path}, line {line}: {key} = {wanted[key].column!r} fits the columns {names}: expected one"
                )
        return at, {key: places[0] for key, places in found.items()}
    first = next((i for i, (_, row) in enumerate(rows) if sum(map(_is_number, row)) > 1), len(rows))
    widest = max((row for _, row in rows[: max(first, 1)]), key=len)
    missing = [f"{key} = {one.column!r}" for key, one in wanted.items() if not _places(widest, one)]
    columns = ", ".join(cell.strip() for cell in widest)
    keys = " and ".join(wanted)
    raise InputError(f"{path}: has columns {columns}: expected {', '.join(missing)}; the keys {keys} choose by name")


def _places(row: Sequence[str], one: Wanted) -> list[int]:
    """Where a column stands: under the very heading, else under its name without a unit."""
    exact = [i for i, cell in enumerate(row) if _named(cell) == _named(one.column)]
    name = _named(_split(one.column, one.unit)[0])
    return exact or [i for i, cell in enumerate(row) if _named(_split(cell, one.unit)[0]) == name]


def _factor(path: Path, key: str, one: Wanted, heading: str, below: str) -> float:
    """Factor to SI by the unit in the name wanted, in the heading, or below it."""
    asked, headed = (_split(text, one.unit)[1] for text in (one.column, heading))
    told = headed or below.strip("[]() ")
    if asked and told and asked != told:
        raise InputError(f"{path}: column {heading!r} is in {told!r}, and {key} says {asked!r}: expected one of them")
    unit = asked or told
    if not unit:
        example = f"{key} = '{heading} [{one.unit}]'"
        raise InputError(f"{path}: column {heading!r} tells no unit: expected one, such as {example}")
    return quantity(f"1 {unit}", one.unit, f"{path}: unit of column {heading!r}")


def _numbers(path: Path, key: str, heading: str, cells: Sequence[str], lines: Sequence[int], mark: str) -> list[float]:
    """Numbers of a column."""
    numbers = [float(plain_number(cell, mark) or "nan") for cell in cells]
    for line, cell, number in zip(lines, cells, numbers, strict=True):
        if not math.isfinite(number):
            raise InputError(f"{path}, line {line}: found {cell!r}: expected a number for {key} ({heading})")
    return numbers


def _decimal_mark(path: Path, cells: Sequence[str], separator: str) -> str:
    try:
        return decimal_mark(cells, separator)
    except InputError as error:
        raise InputError(f"{path}: {error}, or decimal = ',' or decimal = '.'") from None


def as_wanted(column: Any, unit: str) -> Wanted:
    """A column by the name that a user gives."""
    if not isinstance(column, str) or not column.strip():
        raise InputError(f"found {column!r}: expected the name of a column")
    return Wanted(column, unit)
