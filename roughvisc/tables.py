"""Tables of numbers in text files: encoding, separator, decimal mark, heading and units.

All readers of text use these functions, so that they read the same numbers from a file.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.paths import path_of, read_bytes
from roughvisc.units import number

#: Units of equal dimension that differ by 2 pi: never converted.
FREQUENCY_UNITS = ("rad/s", "Hz")
#: Pattern of numbers by decimal mark, of numbers with either mark, and of numbers that may have grouped thousands.
_NUMBER = {mark: re.compile(rf"[+-]?(\d+(\{mark}\d*)?|\{mark}\d+)([eE][+-]?\d+)?") for mark in ".,"}
_EITHER = re.compile(r"[+-]?(\d+(\.\d*|,\d+)?|[.,]\d+)([eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
#: ``name [unit]`` or ``name (unit)``. A unit in square brackets may have parentheses, as in ``1/(Pa s)``.
_HEADING = re.compile(r"(?P<name>.*?)\s*(\[\s*(?P<square>[^\[\]]*?)\s*\]|\(\s*(?P<round>[^()]*?)\s*\))")
#: The same pattern if the separator is a blank.
_HEADING_BETWEEN_BLANKS = re.compile(r"[^ \t\[(]+(?:[ \t]*(?:\[[^\]]*\]|\([^)]*\)))?")
#: Beginning of the comment with the names of the columns in a text export of JPK.
_JPK_NAMES = "# fancyNames:"
#: Number of rows in which the heading is sought.
_FIRST = 200


def read_text(path: Path) -> str:
    """Return the text of a file in UTF-8, in UTF-16 with a byte-order mark, or else in Windows-1252.

    Raises
    ------
    InputError
        If it is not a regular file, or cannot be read.
    UnicodeError
        If the file contains zero bytes, such as a binary file or UTF-16 without a byte-order mark.
    """
    raw = read_bytes(path)
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16")
    if b"\0" in raw:
        raise UnicodeError("it holds zero bytes: expected text in UTF-8, or in UTF-16 with a byte-order mark")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252")


def decimal_mark(cells: Iterable[str], separator: str) -> str:
    """Find the decimal mark of a file from its numbers.

    Parameters
    ----------
    cells : iterable of str
        Cells of the file; those that are not numbers are ignored. A number with grouped digits, such as ``1.250,5``, is
        not a number here.
    separator : str
        Sign between the cells. In a file with commas, ``"1,250"`` in quotation marks may be 1.25 or 1250.

    Returns
    -------
    str
        ``"."`` or ``","``.

    Raises
    ------
    InputError
        If some numbers have a decimal point and others a decimal comma, or if the mark is ambiguous.

    Examples
    --------
    >>> decimal_mark(["0,5", "1"], ";"), decimal_mark(["1.5"], ","), decimal_mark(["1,250"], ";")
    (',', '.', ',')
    """
    cells = list(cells)
    commas, points = ([cell for cell in cells if mark in cell and plain_number(cell, mark)] for mark in ",.")
    if commas and points:
        raise InputError(f"holds {commas[0]!r} and {points[0]!r}: expected one decimal mark")
    if commas and separator == "," and all(map(_THOUSANDS.fullmatch, commas)):
        raise InputError(f"holds {commas[0]!r}, a decimal number or thousands: expected a decimal point")
    return "," if commas else "."


def plain_number(cell: str, mark: str) -> str | None:
    """Return a number in the notation of Python, or None if the text is not a number with this decimal mark.

    Examples
    --------
    >>> plain_number("1250,5", ","), plain_number("12.5", ","), plain_number("1,250.5", ".")
    ('1250.5', None, None)
    """
    return cell.replace(mark, ".") if _NUMBER[mark].fullmatch(cell) else None


def name_and_unit(heading: str) -> tuple[str, str]:
    """Split the heading of a column into its name and its unit; a missing unit is empty.

    Examples
    --------
    >>> name_and_unit("Force (left) [mN]"), name_and_unit("fluidity [1/(Pa s)]"), name_and_unit("time")
    (('Force (left)', 'mN'), ('fluidity', '1/(Pa s)'), ('time', ''))
    """
    found = _HEADING.fullmatch(heading.strip())
    return (found["name"], found["square"] or found["round"] or "") if found else (heading.strip(), "")


class Wanted(NamedTuple):
    """A column to read from a table.

    Attributes
    ----------
    name : str
        Name in the heading, in upper or lower case; it may include the unit, for a heading that has none.
    unit : str
        Unit of the result.
    optional : bool
        Whether the column may be absent.
    """

    name: str
    unit: str
    optional: bool = False


#: Number of a line, and its cells.
_Row = tuple[int, list[str]]


def read_table(path: str | Path, wanted: Mapping[str, Wanted]) -> tuple[dict[str, NDArray[np.float64]], list[int]]:
    """Read columns of numbers from a text file.

    Parameters
    ----------
    path : path
        A text file with semicolons, tabs, commas or blanks between the cells. Lines that begin with ``#`` are comments.
    wanted : mapping of str to Wanted
        Key of the column in messages and in the result -> column.

    Returns
    -------
    dict of str to ndarray, list of int
        Numbers by key, in the units wanted, without absent optional columns; and the line of each row.

    Raises
    ------
    InputError
        If the file cannot be read or contains no rows, a column or its unit is absent or does not fit, a row has more
        cells than the heading, or a cell is not a finite number. The message names the file, the line or the column,
        the invalid value and the valid ones.

    Notes
    -----
    The heading is the first line with all columns, each as ``name [unit]`` or ``name (unit)``, in any order and next to
    others. Lines above it are skipped. A column of pure numbers may omit its unit. In a text export of JPK names and
    units are comments before each segment; all segments are read as one table.
    """
    path = path_of(path, "path")
    separator, rows = _rows(path)
    needed = [one.name for one in wanted.values() if not one.optional]
    headings = (at for at, (_, cells) in enumerate(rows[:_FIRST]) if all(_places(cells, name) for name in needed))
    if (above := next(headings, None)) is None:
        raise _no_heading(path, rows, separator, wanted)
    (line, heading), below = rows[above], rows[above + 1 :]
    if not below:
        raise InputError(f"{path}: holds no rows below the heading in line {line}: expected {', '.join(wanted)}")
    places = {key: found for key, one in wanted.items() if (found := _places(heading, one.name))}
    converted = {
        key: _conversion(path, line, [heading[at] for at in found], key, wanted[key]) for key, found in places.items()
    }
    for row, cells in below:
        if any(cells[len(heading) :]) or (separator == " " and len(cells) != len(heading)):
            raise InputError(f"{path}, line {row}: found {len(cells)} cells: expected {len(heading)}, as above")
    texts = {key: [cells[at] if at < len(cells) else "" for _, cells in below] for key, (at, *_) in places.items()}
    try:
        mark = decimal_mark((cell for column in texts.values() for cell in column), separator)
    except InputError as error:
        raise error.prefixed(str(path)) from None
    columns = {}
    for key, column in texts.items():
        values = [float(plain_number(cell, mark) or "nan") for cell in column]
        for (row, _), cell, value in zip(below, column, values, strict=True):
            if not math.isfinite(value):
                where, expected = f"{path}, line {row}", f"a number for {key}"
                raise InputError(f"{where}: found {cell!r}: expected {expected}", found=cell, expected=expected)
        columns[key] = np.array(list(map(converted[key], values)))
    return columns, [row for row, _ in below]


def _rows(path: Path) -> tuple[str, list[_Row]]:
    """Return the separator of the cells, and the rows without blank lines and comments."""
    try:
        text = read_text(path)
    except UnicodeError as error:
        raise InputError(f"{path}: cannot be read as a table: {error}") from error
    whole = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip()]
    lines = [(i, line) for i, line in whole if not line.startswith("#")]
    if any(line.startswith(_JPK_NAMES) for _, line in whole):
        return " ", _jpk_rows(path, whole)
    if not lines:
        return ",", []
    last = lines[-1][1]  # a row of numbers; the first lines may belong to no table
    if len(_between_blanks(last)) > 1:
        return " ", [(i, _between_blanks(line) or _HEADING_BETWEEN_BLANKS.findall(line)) for i, line in lines]
    separator = next((sign for sign in ";\t," if sign in last), ",")
    rows = []
    for i, line in lines:
        try:
            (cells,) = csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True)
        except csv.Error:  # an open quotation mark: no number
            cells = [line]
        rows.append((i, [cell.strip() for cell in cells]))
    return separator, rows


def _jpk_rows(path: Path, lines: Sequence[tuple[int, str]]) -> list[_Row]:
    """Return one heading and the rows of all segments of a text export of JPK.

    A segment may have other columns than the first one: its cells are put in the order of the first heading.
    """
    rows: list[_Row] = []
    heading: list[str] = []
    places: list[int] = []
    names: list[str] = []
    for i, line in lines:
        if not line.startswith("#"):
            cells = line.split()
            if len(cells) != len(heading):
                raise InputError(f"{path}, line {i}: found {len(cells)} cells: expected {len(heading)}, as above")
            rows.append((i, [cells[place] if place >= 0 else "" for place in places]))
            continue
        if line.startswith(_JPK_NAMES):
            names = re.findall('"([^"]*)"', line)
        elif line.startswith("# units:"):
            heading = [f"{name} [{unit}]" for name, unit in zip(names, line.split()[2:], strict=False)]
            rows = rows or [(i, heading)]
            places = [heading.index(cell) if cell in heading else -1 for cell in rows[0][1]]
    return rows


def _between_blanks(line: str) -> list[str]:
    """Split a row of numbers at blanks and tabs, but not at no-break blanks; return nothing for any other line."""
    cells = re.split(r"[ \t]+", line.strip(" \t"))
    return cells if all(map(_EITHER.fullmatch, cells)) else []


def _places(heading: Sequence[str], name: str) -> list[int]:
    """Return the positions of a column in a heading: by its full name, or else by its name without the unit.

    Parentheses at the end of a name may belong to it, as in ``Height (measured)``.
    """
    cells = [_plain(cell) for cell in heading]
    bare = [name_and_unit(cell)[0] for cell in cells]
    for names, wanted in ((cells, name), (bare, name), (bare, name_and_unit(name)[0])):
        if places := [place for place, cell in enumerate(names) if cell == _plain(wanted)]:
            return places
    return []


def _plain(name: str) -> str:
    return " ".join(name.split()).casefold()


def _no_heading(path: Path, rows: Sequence[_Row], separator: str, wanted: Mapping[str, Wanted]) -> InputError:
    """Return the error of a table without a heading; it states the heading to write."""
    sign = {",": ", ", ";": "; "}.get(separator, separator)
    write = sign.join(_example(one.name, one.unit) for one in wanted.values() if not one.optional)
    line, widest = max(rows[:_FIRST], key=lambda row: len(row[1]), default=(0, ["no rows"]))
    found = f"found {sign.join(widest)[:200]!r} in line {line}"
    return InputError(f"{path}: {found}: expected a heading, {write!r}", found=found, expected=write)


def _example(name: str, unit: str) -> str:
    return name if name_and_unit(name)[1] or unit == "1" else f"{name} [{unit}]"


def _conversion(path: Path, line: int, names: Sequence[str], key: str, one: Wanted) -> Callable[[float], float]:
    """Return the conversion from the unit of a column to the wanted one; refuse a column without one unit."""
    where = f"{path}, line {line}"
    if len(names) > 1:
        raise InputError(f"{where}: {key} = {one.name!r} fits the columns {', '.join(names)}: expected one")
    given = name_and_unit(names[0])[1]
    stated = "" if _plain(name_and_unit(names[0])[0]) == _plain(one.name) else name_and_unit(one.name)[1]
    stated = stated or (one.unit if one.unit in ("1", *FREQUENCY_UNITS) else "")
    if given and stated and given != stated and one.unit != "1":
        problem = f"the heading says {given!r} and the study {stated!r}"
        raise InputError(f"{where}: unit of {key}: {problem}: expected one unit")
    unit = given or stated
    if not unit:
        found, expected = names[0], _example(names[0], one.unit)
        message = f"{where}: found the column {found!r} without a unit: expected a heading, {expected!r}"
        raise InputError(message, found=found, expected=expected)
    try:
        factor, zero = (1.0, 0.0) if unit == one.unit else (number(f"{n} {unit}", one.unit) for n in (1, 0))
    except InputError as error:
        raise error.prefixed(f"{path}: unit of {key}") from error
    if zero:  # degrees Celsius count from 273.15 K
        return lambda value: number(f"{value!r} {unit}", one.unit)
    return lambda value: float(f"{value * factor:.15g}")
