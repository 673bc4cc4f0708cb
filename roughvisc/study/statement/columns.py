"""Columns of numbers in a CSV file: a loading history, creep data."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from roughvisc.errors import InputError
from roughvisc.topography.readers import regular
from roughvisc.topography.text_numbers import decimal_mark, plain_number, read_text
from roughvisc.units import quantity

_HEADING = re.compile(r"\s*(?P<name>[^\[\(]*?)\s*(?:[\[\(]\s*(?P<unit>.*?)\s*[\]\)])?\s*")
_INVERSE = re.compile(r"1\s*/\s*(?P<unit>\w+)")


#: units that measure the same to a library of units, and differ by 2 pi: never converted
FREQUENCY_UNITS = ("rad/s", "Hz")


def read_columns(
    path: str | Path,
    units: Mapping[str, str],
    given: Mapping[str, str] | None = None,
    optional: Collection[str] = (),
) -> tuple[list[float], ...]:
    """Columns of a CSV file, in SI.

    Parameters
    ----------
    path : path
        A CSV file of numbers, with commas, semicolons or tabs between them, and a decimal point or a decimal comma.
        Lines that begin with ``#`` are comments. The first line may be a heading, ``time [ms], load [N]``: the columns
        are then found by name, in any order, and converted; without one they are taken in the order of `units`, in SI,
        and there are no others.
    units : mapping of str to str
        Name of each column wanted, and the unit it is wanted in.
    given : mapping of str to str, optional
        Unit that a column is in, for a file whose heading does not say so.
    optional : collection of str
        Columns that a file need not have; without a heading it has none of them.

    Returns
    -------
    tuple of list of float
        One list for each entry of `units`; empty for an optional column that is not there.

    Raises
    ------
    InputError
        If the file cannot be read, holds no rows, a column is missing, a unit does not fit, a row has more cells than
        there are columns, or a cell is no finite number; the line is named.
    """
    separator, lines = _lines(Path(path))
    if not lines:
        raise InputError(f"{path}: holds no rows: expected columns {', '.join(units)}")
    top, heading = lines[0]
    headed = all(plain_number(heading[0], mark) is None for mark in ".,")
    names = [name for name in units if headed or name not in optional]
    places: list[int | None] = list(range(len(names)))
    stated: list[str | None] = [None] * len(names)
    if headed:
        places, stated = _from_heading(path, heading, names, optional)
        lines = lines[1:]
        if not lines:
            raise InputError(f"{path}: holds no rows below the heading in line {top}: expected {', '.join(names)}")
    wanted = [place for place in places if place is not None]
    try:
        mark = decimal_mark((cells[place] for _, cells in lines for place in wanted if place < len(cells)), separator)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    width = len(heading) if headed else len(names)
    given = given or {}
    factors = [_factor(path, n, own, given.get(n), units[n]) for n, own in zip(names, stated, strict=True)]
    columns: dict[str, list[float]] = {name: [] for name in units}
    for number, cells in lines:
        if any(cells[width:]):
            raise InputError(f"{path}, line {number}: found {len(cells)} cells: expected {width}, one for each column")
        for name, place, factor in zip(names, places, factors, strict=True):
            if place is None:
                continue
            value = float(plain_number(cells[place], mark) or "nan") if place < len(cells) else math.nan
            if not math.isfinite(value):
                found = repr(cells[place]) if place < len(cells) else f"{len(cells)} columns"
                raise InputError(f"{path}, line {number}: found {found}: expected a number for {name}")
            columns[name].append(float(f"{value * factor:.15g}"))
    return tuple(columns.values())


def _lines(path: Path) -> tuple[str, list[tuple[int, list[str]]]]:
    """What separates the cells, and rows of cells with their line numbers, without blank lines and comments."""
    try:
        regular(path)
        text = read_text(path)
    except (OSError, UnicodeError) as error:
        raise InputError(f"{path}: cannot be read as a CSV file: {error}") from error
    kept = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    separator = next((mark for mark in (";", "\t", ",") if kept and mark in kept[0][1]), ",")
    rows, spread = separated(path, kept, separator)
    below = spread - {line for line, _ in rows[:1]}  # a heading may go over lines
    if below:
        raise several_lines(path, min(below))
    return separator, [(i, [cell.strip() for cell in row]) for i, row in rows]


def separated(
    path: Path, lines: Sequence[tuple[int, str]], separator: str
) -> tuple[list[tuple[int, list[str]]], set[int]]:
    """Rows of cells with the number of the line that each begins on, and of those that go over several lines.

    A quotation mark that is not closed makes one row of all that follows, which is for the caller to allow or refuse.
    """
    reader = csv.reader((line for _, line in lines), delimiter=separator, skipinitialspace=True)
    rows, spread, before = [], set(), 0
    try:
        for cells in reader:
            first, before, taken = lines[before][0], reader.line_num, reader.line_num - before
            rows.append((first, cells))
            if taken > 1:
                spread.add(first)
    except csv.Error as error:  # a cell without end
        raise InputError(f"{path}: cannot be read as a table: {error}") from error
    return rows, spread


def several_lines(path: Path, line: int) -> InputError:
    """What to tell of a row of numbers that goes over several lines."""
    return InputError(f"{path}, line {line}: found a quotation mark that is not closed there: expected a row a line")


def _from_heading(
    path: str | Path, heading: list[str], names: Sequence[str], optional: Collection[str]
) -> tuple[list[int | None], list[str | None]]:
    """Place and unit of each wanted column, None where there is none."""
    found = [_HEADING.fullmatch(cell) for cell in heading]
    present = [match["name"].lower() if match else "" for match in found]
    places: list[int | None] = []
    units: list[str | None] = []
    for name in names:
        if name not in present and name not in optional:
            needed = [one for one in names if one not in optional]
            raise InputError(f"{path}: has columns {', '.join(present)}: expected {', '.join(needed)}")
        place = present.index(name) if name in present else None
        match = None if place is None else found[place]
        places.append(place)
        units.append(match["unit"] if match else None)
    return places, units


def _factor(path: str | Path, name: str, headed: str | None, given: str | None, wanted: str) -> float:
    """Factor to the wanted unit, from the unit in the heading or the one given otherwise."""
    where = f"{path}: unit of {name}"
    if headed and given and headed != given:
        raise InputError(f"{where}: the heading says {headed!r} and the study {given!r}: expected one of them")
    unit = headed or given
    if unit is None or unit == wanted:
        return 1.0
    if wanted in FREQUENCY_UNITS:
        raise InputError(f"{where}: found {unit!r}: expected {wanted!r}, as the study says")
    inverse = _INVERSE.fullmatch(unit)
    return quantity(f"1 {inverse['unit']}^-1" if inverse else f"1 {unit}", wanted, where)
