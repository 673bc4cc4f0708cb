"""Tables of numbers in text files: their encoding, separator, decimal mark, heading and units.

Every reader of text decides these here, so that no two of them take one file for different numbers.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.units import is_quantity, quantity

#: Units that measure the same to a library of units, and differ by 2 pi: never converted.
FREQUENCY_UNITS = ("rad/s", "Hz")
_BLANKS = " '\u00a0\u202f"
_REMOVE_BLANKS = str.maketrans("", "", _BLANKS)
#: Decimal mark -> a number that has it, and in which the other mark, a blank or an apostrophe groups digits by threes.
_NUMBER = {
    mark: re.compile(
        rf"[+-]?((\d+|[1-9]\d{{0,2}}(\{other}\d{{3}})+|[1-9]\d{{0,2}}([{_BLANKS}]\d{{3}})+)(\{mark}\d*)?|\{mark}\d+)"
        r"([eE][+-]?\d+)?"
    )
    for mark, other in (".,", ",.")
}
#: A number between blanks, where these group no digits.
_BETWEEN_BLANKS = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
#: ``time [ms]``: the heading of a table that was written for roughvisc.
_HEADING = re.compile(r"(?P<name>[^\[\(]*?)\s*(?:[\[\(]\s*(?P<unit>.*?)\s*[\]\)])?")
#: ``Force (left) [mN]``: that of any other program; and what stands between a name and its unit without brackets.
_BRACKETED = re.compile(r"(?P<name>.*?)\s*[\[\(]\s*(?P<unit>[^\[\]\(\)]*?)\s*[\]\)]")
_BETWEEN = (" in ", "/", ",", "_", " ")
_INVERSE = re.compile(r"1\s*/\s*(?P<unit>\w+)")
#: Lines that the heading of such a table is sought in.
_FIRST = 200


def regular(path: Path) -> None:
    """Refuse what is there and is neither a file nor a folder: reading a device or a pipe need not end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise InputError(f"{path}: is a device or a pipe: expected a file")


def read_text(path: Path) -> str:
    """Text of a file in UTF-8, with a byte-order mark or without, in UTF-16 with one, or else in Windows-1252.

    Raises
    ------
    OSError
        If the file cannot be read.
    UnicodeError
        If it is no text: it holds zero bytes, as binary files do and UTF-16 without its mark.
    """
    raw = path.read_bytes()
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16")
    if b"\0" in raw:
        raise UnicodeError("it holds zero bytes: expected text in UTF-8, or in UTF-16 with a byte-order mark")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252")


def decimal_mark(cells: Iterable[str], separator: str) -> str:
    """Decimal mark of a file, told by its numbers.

    Parameters
    ----------
    cells : iterable of str
        Cells of the file. Those that are no numbers tell nothing.
    separator : str
        What stands between the cells. Beside commas, ``"1,250"`` in quotation marks may be 1.25 or 1250. Beside any
        other separator it is 1.25, unless another number of the file has a decimal point.

    Returns
    -------
    str
        ``"."`` or ``","``.

    Raises
    ------
    InputError
        If some numbers have a decimal point and others a decimal comma, or if it cannot be told.

    Examples
    --------
    >>> decimal_mark(["0,5", "1.250,5"], ";"), decimal_mark(["1,250.5", "1,250"], ","), decimal_mark(["1,250"], ";")
    (',', '.', ',')
    """
    marked = [cell for cell in cells if "," in cell or "." in cell]
    if not any("," in cell for cell in marked):
        return "."
    first: dict[str, str] = {}  # what a number tells -> the first that tells it
    for cell in marked:
        point, comma = (plain_number(cell, mark) is not None for mark in ".,")
        if point != comma:
            first.setdefault("point" if point else "comma", cell)
        elif point:
            first.setdefault("comma or thousands" if "," in cell else "point or thousands", cell)
    sure = [first[mark] for mark in ("comma", "point") if mark in first]
    told = sure or list(first.values())
    if len(told) == 2:
        raise InputError(f"holds {told[0]!r} and {told[1]!r}: expected one decimal mark")
    if not sure and "comma or thousands" in first and separator == ",":
        raise InputError(f"holds {told[0]!r}, which may have a decimal comma or be thousands: expected a decimal point")
    return "," if "comma" in first or (not sure and "comma or thousands" in first) else "."


def plain_number(cell: str, mark: str) -> str | None:
    """A number with a decimal mark as :class:`float` takes it, without what groups its digits; None if it is none.

    Examples
    --------
    >>> plain_number("1.250,5", ","), plain_number("12.5", ","), plain_number("1,250,000", ".")
    ('1250.5', None, '1250000')
    """
    if not _NUMBER[mark].fullmatch(cell):
        return None
    return cell.translate(_REMOVE_BLANKS).replace("," if mark == "." else ".", "").replace(mark, ".")


class Wanted(NamedTuple):
    """A column that is wanted of a table.

    Attributes
    ----------
    name : str
        As the heading has it, whatever its case there. It may have its unit, where another program wrote the table.
    unit : str
        Unit that it is wanted in.
    stated : str, optional
        Unit that it is in, where the heading does not say so.
    optional : bool
        Whether a table that was written for roughvisc need not have it; one without a heading has none of these.
    """

    name: str
    unit: str
    stated: str | None = None
    optional: bool = False


class _Row(NamedTuple):
    """Cells of a row, the line that it begins on, and whether it goes over several."""

    line: int
    cells: list[str]
    spread: bool = False

    def cell(self, at: int) -> str:
        return self.cells[at] if at < len(self.cells) else ""


class _Place(NamedTuple):
    """Where in the rows a column stands, the unit that it is in, and what messages call it."""

    at: int
    unit: str | None
    label: str


#: The heading of a table, where the columns wanted stand below it, and the rows there.
_Headed = tuple[_Row, dict[str, _Place], Sequence[_Row]]


def read_table(
    path: str | Path, wanted: Mapping[str, Wanted], *, exported: bool = False, decimal: str | None = None
) -> tuple[dict[str, NDArray[np.float64]], list[int]]:
    """Columns of numbers in a text file, in the units wanted.

    Parameters
    ----------
    path : path
        A text file with semicolons, tabs or commas between the cells. Lines that begin with ``#`` are comments.
    wanted : mapping of str to Wanted
        Key, by which messages name it -> column.
    exported : bool
        Whether another program has written the table, as those of test machines do; see Notes.
    decimal : {".", ","}, optional
        Decimal mark; by default it is told by the numbers.

    Returns
    -------
    dict of str to ndarray, list of int
        Numbers by key, without optional columns that are not there; and the line that each row begins on.

    Raises
    ------
    InputError
        If the file cannot be read or holds no rows, a column or its unit is not found or does not fit, a row has more
        cells than there are columns, or a cell is no finite number. It names the file, the line or the column, what
        was found and what was expected.

    Notes
    -----
    A table that was written for roughvisc may begin with a heading, ``time [ms], load [N]``. The columns are then found
    by name, in any order; those that tell no unit are in the one wanted. Without a heading they stand in the order
    wanted, and there are no others.

    In one that another program has written the heading is the first line that holds all columns wanted, and what stands
    above it is passed over; there may be blanks between the cells. Every unit is told by the name wanted, the heading
    (``Force [mN]``, ``Force (mN)``, ``Force/mN``, ``Force in mN``, ``Force_mN``) or the line below it.
    """
    path = Path(path)
    separator, rows = _rows(path, exported)
    if not rows:
        raise InputError(f"{path}: holds no rows: expected columns {', '.join(one.name for one in wanted.values())}")
    heading, places, below = (_exported_heading if exported else _heading)(path, rows, wanted)
    if not below:
        found = f"holds no rows below the heading in line {heading.line}"
        raise InputError(f"{path}: {found}: expected {', '.join(wanted)}")
    for row in rows:
        if row.spread and row.line > heading.line:  # a heading may; here the rows that follow would be lost in a cell
            found = "a quotation mark that is not closed there"
            raise InputError(f"{path}, line {row.line}: found {found}: expected a row a line")
    width = len(heading.cells)
    for row in below:
        if any(row.cells[width:]) or (separator == " " and len(row.cells) != width):
            found = f"{len(row.cells)} cells"
            raise InputError(f"{path}, line {row.line}: found {found}: expected {width}, one for each column")
    try:
        mark = decimal or decimal_mark((row.cell(place.at) for row in below for place in places.values()), separator)
    except InputError as error:
        instead = ", or decimal = ',' or decimal = '.'" if exported else ""
        raise InputError(f"{path}: {error}{instead}") from None
    columns = {}
    for key, place in places.items():
        factor = _factor(place.unit, wanted[key].unit, f"{path}: unit of {place.label}")
        numbers = [_number(path, row, place, mark) for row in below]
        columns[key] = np.array([float(f"{number * factor:.15g}") for number in numbers])
    return columns, [row.line for row in below]


def _rows(path: Path, exported: bool) -> tuple[str, list[_Row]]:
    """What separates the cells, and the rows without blank lines and comments."""
    try:
        regular(path)
        text = read_text(path)
    except (OSError, UnicodeError) as error:
        raise InputError(f"{path}: cannot be read as a table: {error}") from error
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        return ",", []
    telling = lines[-1 if exported else 0][1]  # the first lines of other programs may be no part of the table
    separator = next((sign for sign in ";\t," if sign in telling), ",")
    blanks = telling.split()
    if exported and separator == "," and len(blanks) > 1 and all(map(_BETWEEN_BLANKS.fullmatch, blanks)):
        return " ", [_Row(i, line.split()) for i, line in lines]
    reader = csv.reader((line for _, line in lines), delimiter=separator, skipinitialspace=True)
    rows, before = [], 0
    try:
        for cells in reader:  # of which a row may take several lines
            rows.append(_Row(lines[before][0], [cell.strip() for cell in cells], reader.line_num > before + 1))
            before = reader.line_num
    except csv.Error as error:  # a cell without end
        raise InputError(f"{path}: cannot be read as a table: {error}") from error
    return separator, rows


def _heading(path: Path, rows: Sequence[_Row], wanted: Mapping[str, Wanted]) -> _Headed:
    """Heading, places and rows of a table that was written for roughvisc."""
    needed = [one.name.lower() for one in wanted.values() if not one.optional]
    first, below = rows[0], rows[1:]
    if _is_number(first.cells[0]):  # none: the columns are as if their names stood above them, in order
        first, below = _Row(0, needed), rows
    found = [match.groups("") if (match := _HEADING.fullmatch(cell)) else ("", "") for cell in first.cells]
    names = [name.lower() for name, _ in found]
    if not set(needed) <= set(names):
        raise InputError(f"{path}: has columns {', '.join(names)}: expected {', '.join(needed)}")
    places = {}
    for key, one in wanted.items():
        if one.name.lower() in names:
            at = names.index(one.name.lower())
            places[key] = _Place(at, _agreed(path, key, found[at][1], "the study", one.stated), key)
    return first, places, below


def _exported_heading(path: Path, rows: Sequence[_Row], wanted: Mapping[str, Wanted]) -> _Headed:
    """The same of a table that another program has written."""
    at = next((i for i, row in enumerate(rows[:_FIRST]) if all(_fitting(row, one) for one in wanted.values())), None)
    if at is None:
        raise _no_heading(path, rows, wanted)
    heading, below = rows[at], rows[at + 1 :]
    found = {key: _fitting(heading, one) for key, one in wanted.items()}
    second = below[0] if below else _Row(0, [])
    under = {key: second.cell(fitting[0]) for key, fitting in found.items()}
    if any(map(_is_number, under.values())):
        under = {}
    elif any(under.values()) or not any(second.cells):  # units, or nothing
        below = below[1:]
    places = {}
    for key, one in wanted.items():
        names = [heading.cells[place] for place in found[key]]
        if len(names) > 1:
            fits = f"{key} = {one.name!r} fits the columns {', '.join(map(repr, names))}"
            raise InputError(f"{path}, line {heading.line}: {fits}: expected one")
        cell = under.get(key, "")
        beneath = cell.strip("[]() ")
        if cell and not is_quantity(f"1 {beneath}", one.unit):
            expected = f"expected a number for {key}, or a unit of its kind below the heading"
            raise InputError(f"{path}, line {second.line}: found {cell!r}: {expected}")
        label = f"{key} ({names[0]})"
        told, asked = _name_and_unit(names[0], one.unit)[1] or beneath, _name_and_unit(one.name, one.unit)[1]
        unit = _agreed(path, label, told, key, one.stated or asked)
        if not unit:
            example = f"{key} = '{names[0]} [{one.unit}]'"
            raise InputError(f"{path}: column {names[0]!r} tells no unit: expected one, such as {example}")
        places[key] = _Place(found[key][0], unit, label)
    return heading, places, below


def _no_heading(path: Path, rows: Sequence[_Row], wanted: Mapping[str, Wanted]) -> InputError:
    """What to tell of a table none of whose first rows holds all columns wanted: what the widest of them lacks."""
    numbers = next((i for i, row in enumerate(rows) if sum(map(_is_number, row.cells)) > 1), len(rows))
    widest = max(rows[: max(numbers, 1)], key=lambda row: len(row.cells))
    missing = ", ".join(f"{key} = {one.name!r}" for key, one in wanted.items() if not _fitting(widest, one))
    choose = f"the keys {' and '.join(wanted)} choose by name"
    return InputError(f"{path}: has columns {', '.join(widest.cells)}: expected {missing}; {choose}")


def _fitting(heading: _Row, one: Wanted) -> list[int]:
    """Where a column stands: under the very name, else under it without its unit."""
    exact = [at for at, cell in enumerate(heading.cells) if _plain(cell) == _plain(one.name)]
    name = _plain(_name_and_unit(one.name, one.unit)[0])
    return exact or [at for at, cell in enumerate(heading.cells) if _plain(_name_and_unit(cell, one.unit)[0]) == name]


def _plain(name: str) -> str:
    return " ".join(name.split()).casefold()


def _name_and_unit(heading: str, unit: str) -> tuple[str, str]:
    """Name and unit in the heading of another program's column; the unit is empty where none is told."""
    if bracketed := _BRACKETED.fullmatch(heading.strip()):
        return bracketed["name"], bracketed["unit"]
    for mark in _BETWEEN:
        name, _, told = heading.rpartition(mark)
        if name and is_quantity(f"1 {told.strip()}", unit):
            return name, told.strip()
    return heading, ""


def _agreed(path: Path, label: str, told: str, by: str, stated: str | None) -> str | None:
    """Unit of a column by the table and by who asks for it, who may not contradict each other."""
    if told and stated and told != stated:
        where = f"{path}: unit of {label}"
        raise InputError(f"{where}: the heading says {told!r} and {by} {stated!r}: expected one of them")
    return told or stated


def _factor(unit: str | None, wanted: str, where: str) -> float:
    """Factor from a unit to the one wanted, which it is if nobody says another."""
    if unit in (None, wanted):
        return 1.0
    if wanted in FREQUENCY_UNITS:
        raise InputError(f"{where}: found {unit!r}: expected {wanted!r}, as the study says")
    inverse = _INVERSE.fullmatch(unit)
    return quantity(f"1 {inverse['unit']}^-1" if inverse else f"1 {unit}", wanted, where)


def _number(path: Path, row: _Row, place: _Place, mark: str) -> float:
    """Number of a row in a column."""
    number = float(plain_number(row.cell(place.at), mark) or "nan")
    if not math.isfinite(number):
        found = repr(row.cells[place.at]) if place.at < len(row.cells) else f"{len(row.cells)} columns"
        raise InputError(f"{path}, line {row.line}: found {found}: expected a number for {place.label}")
    return number


def _is_number(cell: str) -> bool:
    return any(plain_number(cell, mark) is not None for mark in ".,")
