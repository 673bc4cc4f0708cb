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
from roughvisc.units import is_quantity, number

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
    matched = _HEADING.fullmatch(heading.strip())
    return (matched["name"], matched["square"] or matched["round"] or "") if matched else (heading.strip(), "")


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
    headings = (place for place, (_, cells) in enumerate(rows[:_FIRST]) if all(_places(cells, name) for name in needed))
    if (above := next(headings, None)) is None:
        raise _no_heading(path, rows, separator, wanted)
    line, heading = rows[above]
    below = rows[above + 1 :]
    if not below:
        raise InputError(f"{path}: holds no rows below the heading in line {line}: expected {', '.join(wanted)}")
    places = {key: places_of_name for key, one in wanted.items() if (places_of_name := _places(heading, one.name))}
    converted = {
        key: _conversion(path, line, [heading[place] for place in places_of_name], key, wanted[key])
        for key, places_of_name in places.items()
    }
    for row, cells in below:
        if any(cells[len(heading) :]) or (separator == " " and len(cells) != len(heading)):
            raise InputError(f"{path}, line {row}: found {len(cells)} cells: expected {len(heading)}, as above")
    texts = {
        key: [cells[place] if place < len(cells) else "" for _, cells in below] for key, (place, *_) in places.items()
    }
    try:
        mark = decimal_mark((cell for column in texts.values() for cell in column), separator)
    except InputError as error:
        raise error.prefixed(str(path)) from None
    columns = {}
    for key, column in texts.items():
        values = [float(plain_number(cell, mark) or "nan") for cell in column]
        for (row, _), cell, value in zip(below, column, values, strict=True):
            if not math.isfinite(value):
                where = f"{path}, line {row}"
                expected = f"a number for {key}"
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

    A name in the same letters, upper or lower case, comes first: a table may have both ``t`` and ``T``. Parentheses at
    the end of a name may belong to it, as in ``Height (measured)``.
    """
    bare = [name_and_unit(cell)[0] for cell in heading]
    for plain in (_single_blanks, _plain):
        for names, wanted in ((heading, name), (bare, name), (bare, name_and_unit(name)[0])):
            if places := [place for place, cell in enumerate(names) if plain(cell) == plain(wanted)]:
                return places
    return []


def _single_blanks(name: str) -> str:
    return " ".join(name.split())


def _plain(name: str) -> str:
    return _single_blanks(name).casefold()


def _no_heading(path: Path, rows: Sequence[_Row], separator: str, wanted: Mapping[str, Wanted]) -> InputError:
    """Return the error of a table without a heading; it states the heading to write."""
    sign = {",": ", ", ";": "; "}.get(separator, separator)
    write = sign.join(_example(column.name, column.unit) for column in wanted.values() if not column.optional)
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
        heading = names[0]
        expected = _example(names[0], one.unit)
        message = f"{where}: found the column {heading!r} without a unit: expected a heading, {expected!r}"
        raise InputError(message, found=heading, expected=expected)
    try:
        factor, zero = (1.0, 0.0) if unit == one.unit else (number(f"{n} {unit}", one.unit) for n in (1, 0))
    except InputError as error:
        raise error.prefixed(f"{path}: unit of {key}") from error
    return _converter(unit, one.unit, factor, zero)


def _converter(unit: str, wanted: str, factor: float, zero: float) -> Callable[[float], float]:
    """Return the conversion of a number from a unit; `factor` and `zero` are 1 and 0 of this unit."""
    if zero:  # degrees Celsius count from 273.15 K
        return lambda value: number(f"{value!r} {unit}", wanted)
    return lambda value: float(f"{value * factor:.15g}")


# ----------------------------------------------------------------------------------------------------------------
# exports of test machines


class Export(NamedTuple):
    """Columns of an export of a test machine.

    Attributes
    ----------
    columns : dict of str to ndarray
        Numbers by key, in the units wanted.
    units : dict of str to str
        Unit in the file by key.
    lines : list of int
        Line of each row.
    note : str
        Number of rows that are left out, and their lines; empty if there are none.
    """

    columns: dict[str, NDArray[np.float64]]
    units: dict[str, str]
    lines: list[int]
    note: str


#: Spellings of units that the registry of units lacks, or that mean another unit there.
_SPELLINGS = {
    "C": "degC",
    "°C": "degC",
    "deg C": "degC",
    "F": "degF",
    "°F": "degF",
    "-": "1",
    "[-]": "1",
    "sec": "s",
    "Sec": "s",
}
_SPELLINGS |= dict.fromkeys(("rad/sec", "rad s-1", "rad s^-1", "rad*s^-1", "rad·s⁻¹", "rad s⁻¹", "1/s·rad"), "rad/s")
#: Kinds of units that test machines write.
_KINDS_OF_UNITS = ("1", "s", "1/s", "Pa", "1/Pa", "Pa s", "K", "m", "N")
#: A cell that looks like a number, but not like a unit such as ``1/MPa``.
_LIKE_A_NUMBER = re.compile(r"[+-]?[.,]?\d[^A-DF-Za-df-zµ°%/]*")
#: Largest number of rows of units below the names, and of lines that a note lists.
_UNIT_ROWS = 2
_LISTED = 6


def read_export(path: str | Path, wanted: Mapping[str, Wanted], part: str | None = None) -> Export:
    """Read columns of numbers from an export of a test machine.

    Parameters
    ----------
    path : path
        A text file as exported, with any preamble.
    wanted : mapping of str to Wanted
        Key of the column in messages and in the result -> column. The unit of a frequency is ``""``: it is Hz or rad/s
        in the file, and is not converted.
    part : str, optional
        Text of the line above the names of one step, in an export with several.

    Returns
    -------
    Export

    Raises
    ------
    InputError
        If the file or the part cannot be read, a column or its unit is missing, the file and the name state two units,
        a cell is neither a number nor a text, or rows of another step follow. The message names the line.

    Notes
    -----
    The heading is the first line with all names; a unit is part of a name, as ``f [Hz]``, or in one of two rows below
    the names. Rows with an empty cell or a text instead of a number are left out, and so are repeated headings.
    """
    path = path_of(path, "path")
    try:
        text = read_text(path)
    except UnicodeError as error:
        raise InputError(f"{path}: cannot be read as a table: {error}") from error
    lines = [(i, line.strip(" \r\n\ufeff")) for i, line in enumerate(text.splitlines(), 1) if line.strip()]
    lines = lines if part is None else _below_part(path, lines, part)
    above, separator, heading, places = _export_heading(path, lines, wanted)
    table = _ExportTable(path, separator, heading, places)
    table.read(lines[above + 1 :], has_part=part is not None)
    if not table.rows:
        where = f"{path}: holds no rows of numbers below the heading in line {lines[above][0]}"
        raise InputError(f"{where}: expected {', '.join(wanted)}")
    try:
        mark = decimal_mark((cell for row in table.rows for cell in row), separator)
    except InputError as error:
        raise error.prefixed(str(path)) from None
    columns: dict[str, NDArray[np.float64]] = {}
    units: dict[str, str] = {}
    for number_of_column, (key, place) in enumerate(places.items()):
        units[key], convert = _export_unit(path, lines[above][0], key, wanted[key], heading[place], table.units[key])
        values = []
        for line, row in zip(table.lines, table.rows, strict=True):
            value = float(plain_number(row[number_of_column], mark) or "nan")
            if not math.isfinite(value):
                where = f"{path}, line {line}"
                expected = f"a number for {key}"
                cell = row[number_of_column]
                raise InputError(f"{where}: found {cell!r}: expected {expected}", found=cell, expected=expected)
            values.append(convert(value))
        columns[key] = np.array(values)
    note = ""
    if table.left_out:
        listed = ", ".join(map(str, table.left_out[:_LISTED])) + ", ..." * (len(table.left_out) > _LISTED)
        note = f"{len(table.left_out)} rows without numbers left out of {path.name} (lines {listed})"
    return Export(columns, units, table.lines, note)


def _below_part(path: Path, lines: list[tuple[int, str]], part: str) -> list[tuple[int, str]]:
    """Return the lines below the line with the text of a part."""
    wanted = _plain(part)
    words = re.compile(rf"(?<!\w){re.escape(wanted)}(?!\w)")
    whole = []
    within = []
    for place, (_, line) in enumerate(lines):
        cells = [_plain(cell) for cell in re.split("[\t;,]", line)]
        if len(cells) > 1 and all(map(_EITHER.fullmatch, cells)):  # a row of numbers
            continue
        if wanted in (_plain(line), *cells):
            whole.append(place)
        elif wanted and words.search(_plain(line)):
            within.append(place)
    matches = whole or within
    if len(matches) != 1:
        numbers = ", ".join(str(lines[place][0]) for place in matches[:_LISTED])
        where = f"{path} has it in lines {numbers}" if matches else f"{path} has no such line"
        expected = "the text of one line above the names of a step"
        raise InputError(
            f"part: found {part!r}: {where}: expected {expected}", key="part", found=part, expected=expected
        )
    return lines[matches[0] + 1 :]


def _cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line between separators; two blanks mean names that may contain one."""
    if separator.isspace() and separator != "\t":
        return re.split(r"\s{2,}", line.strip()) if separator == "  " else _HEADING_BETWEEN_BLANKS.findall(line)
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]


def _export_heading(
    path: Path, lines: list[tuple[int, str]], wanted: Mapping[str, Wanted]
) -> tuple[int, str, list[str], dict[str, int]]:
    """Return the place of the line of the names, the separator, the names, and the position of each wanted column."""
    needed = [column.name for column in wanted.values() if not column.optional]
    best: tuple[int, list[str], str] = (0, [], "")
    for is_comment in (False, True):  # names may be in a comment
        for above, (line, text) in enumerate(lines):
            if text.startswith("#") != is_comment:
                continue
            for separator in ("\t", ";", ",", "  ", " "):
                if separator not in text:
                    continue
                heading = _cells(text.lstrip("# "), separator)
                missing = [name for name in needed if not _places(heading, name)]
                if len(missing) < len(needed) and (not best[1] or len(missing) < len(best[1])):
                    best = line, missing, text
                if missing:
                    continue
                positions = {
                    key: places_of_name
                    for key, column in wanted.items()
                    if (places_of_name := _places(heading, column.name))
                }
                for key, places_of_name in positions.items():
                    if len(places_of_name) > 1:
                        names = ", ".join(heading[place] for place in places_of_name)
                        raise InputError(
                            f"{path}, line {line}: {key} = {wanted[key].name!r} fits the columns {names}: expected one"
                        )
                return above, separator, heading, {key: places_of_name[0] for key, places_of_name in positions.items()}
    expected = f"a line with the names {', '.join(map(repr, needed))}"
    absent = f"found no {best[1][0]!r} in line {best[0]}, {best[2][:100]!r}" if best[1] else "found no such line"
    raise InputError(f"{path}: {absent}: expected {expected}", found=absent, expected=expected)


class _ExportTable:
    """Rows of numbers below the names of an export, and rows of units."""

    def __init__(self, path: Path, separator: str, heading: list[str], places: dict[str, int]) -> None:
        self.path = path
        self.separator = separator
        self.heading = heading
        self.places = places
        self.rows: list[list[str]] = []
        self.lines: list[int] = []
        self.left_out: list[int] = []
        self.units: dict[str, list[str]] = {key: [] for key in places}

    def read(self, lines: list[tuple[int, str]], *, has_part: bool) -> None:
        """Read the rows; with a part up to the end of this step, without one refuse the rows of another step."""
        since_names = 0
        interrupted = 0
        for line, text in lines:
            if text.startswith("#"):
                continue
            row, wanted = self._row(line, text)
            is_number = [_EITHER.fullmatch(cell) is not None for cell in wanted]
            is_like = [_LIKE_A_NUMBER.fullmatch(cell) is not None for cell in wanted]
            since_names += 1
            if all(is_number):
                if interrupted:
                    found = f"{self.path}, line {line}: rows of another step follow line {interrupted}"
                    raise InputError(f"{found}: expected one step, named by part, the text of a line above its names")
                if len(row) > len(self.heading) and any(row[len(self.heading) :]):
                    found = f"found {len(row)} cells"
                    raise InputError(
                        f"{self.path}, line {line}: {found}: expected {len(self.heading)}, as in the names"
                    )
                self.rows.append(wanted)
                self.lines.append(line)
            elif any(is_like):
                for cell, number_like, plain in zip(wanted, is_like, is_number, strict=True):
                    if number_like and not plain and not interrupted:
                        expected = "a number, without grouped digits and signs"
                        where = f"{self.path}, line {line}"
                        raise InputError(f"{where}: found {cell!r}: expected {expected}", found=cell, expected=expected)
                self.left_out.append(line)
            elif row == self.heading:
                since_names = 0
                interrupted = 0
                self.left_out.append(line)
            elif since_names <= _UNIT_ROWS and len(row) > max(self.places.values()):
                for key, cell in zip(self.places, wanted, strict=True):
                    self.units[key].append(cell.strip("[]() "))
            elif self._is_text(row, wanted):
                self.left_out.append(line)
            elif self.rows:
                interrupted = interrupted or line
                if has_part:
                    return

    def _row(self, line: int, text: str) -> tuple[list[str], list[str]]:
        """Return the cells of a line, and the cells of the wanted columns; missing ones are empty."""
        row = text.split() if self.separator in (" ", "  ") else _cells(text, self.separator)
        between_blanks = text.split()
        if len(row) == 1 < len(between_blanks) == len(self.heading):  # names between tabs above numbers between blanks
            row = between_blanks
        if self.separator in (" ", "  ") and _cells(text, self.separator) == self.heading:
            row = self.heading
        return row, [row[place] if place < len(row) else "" for place in self.places.values()]

    def _is_text(self, row: list[str], wanted: list[str]) -> bool:
        """Return whether a line without numbers is a row of texts or of empty cells, and no names of another step."""
        return len(row) > max(self.places.values()) and (
            len(set(wanted)) == 1 or not any(letter.isalpha() for cell in wanted for letter in cell)
        )


def _export_unit(
    path: Path, line: int, key: str, one: Wanted, name: str, below: Sequence[str]
) -> tuple[str, Callable[[float], float]]:
    """Return the unit of a column, and the conversion from it: stated with the name, below it, or by the user."""
    title, given = name_and_unit(name)
    if _plain(name) == _plain(one.name) or _plain(title) == _plain(one.name):
        stated = ""
    else:
        stated = name_and_unit(one.name)[1]
    where = f"{path}, line {line}: unit of {key}"
    units: dict[str, str] = {}
    for source, unit in [("name", given), *(("row below", cell) for cell in below), ("study", stated)]:
        spelt = _SPELLINGS.get(unit, unit)
        if spelt and _is_unit(spelt, one.unit):
            units.setdefault(spelt, source)
        elif spelt and source == "study":
            expected = " or ".join(FREQUENCY_UNITS[::-1]) if not one.unit else f"a unit such as {one.unit}"
            raise InputError(f"{where}: found {unit!r}: expected {expected}", found=unit, expected=expected)
        elif spelt and source == "name" and (len(spelt) > 1 or "[" in name) and _is_known(spelt):
            expected = f"a unit such as {one.unit or 'Hz'}"
            raise InputError(f"{where}: found {name!r}: expected {expected}", found=name, expected=expected)
    if len(units) > 1:
        said = " and ".join(f"the {source} says {unit!r}" for unit, source in units.items())
        raise InputError(f"{where}: {said}: expected one unit")
    unit = next(iter(units), "1" if one.unit == "1" else "")
    if not unit:
        example = f"{title} [{one.unit or 'Hz'}]" + (" or [rad/s]" if not one.unit else "")
        expected = f"the unit in the name of the column, {example!r}"
        other = f", only {' and '.join(map(repr, filter(None, below)))} below" if any(below) else ""
        message = f"{path}, line {line}: found the column {name!r} without a unit{other}: expected {expected}"
        raise InputError(message, found=name, expected=expected)
    if unit == one.unit or not one.unit:
        return unit, float
    return unit, _converter(unit, one.unit, *(number(f"{n} {unit}", one.unit) for n in (1, 0)))


def _is_unit(unit: str, wanted: str) -> bool:
    """Return whether a unit converts to the wanted one; a frequency is in Hz or in rad/s."""
    if not wanted or wanted in FREQUENCY_UNITS:
        return unit in FREQUENCY_UNITS
    return is_quantity(f"1 {unit}", wanted) or unit == wanted == "1"


def _is_known(unit: str) -> bool:
    """Return whether a text is a unit that a test machine writes, of any kind."""
    return any(is_quantity(f"1 {unit}", kind) for kind in _KINDS_OF_UNITS)
