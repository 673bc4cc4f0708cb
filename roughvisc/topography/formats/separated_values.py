"""Conversion of scans with commas, semicolons or tabs between the numbers to text with blanks between them."""

from __future__ import annotations

import csv
import re
from statistics import mode

from roughvisc.errors import InputError
from roughvisc.tables import decimal_mark, name_and_unit, plain_number
from roughvisc.units import is_quantity

_NUMBER = r"[+-]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d++)?"
#: Separator -> pattern of a row of numbers with decimal points.
_ROW = {sign: re.compile(rf" *{_NUMBER}(?: *{sign} *{_NUMBER})* *") for sign in ";\t,"}
_ROW[" "] = re.compile(rf"\s*{_NUMBER}(?:\s+{_NUMBER})*\s*")
#: Pattern of a possible number with a decimal comma, if blanks are the separators.
_WITH_COMMA = re.compile(r"[+-]?\d+(,\d+)?([eE][+-]?\d+)?")
#: Length with a decimal comma in a line that is not a row of numbers, such as ``# Width: 12,5 um``.
_LENGTH = re.compile(r"(?<=[:=])(\s*)(\d[\d.]*,\d+)(?=\s*\w{0,2}m\b)")
#: Cells of a heading, such as ``x [mm]; y [mm]; z [um]``.
_HEADING = re.compile(r"[^\s;,\[(]+\s*(?:\[[^\]]*\]|\([^)]*\))")
#: Marks of a missing height.
_MISSING = ("", "nan", "bad", "-", "#n/a", "n/a")


def separated_by_blanks(text: str) -> str:
    """Return separated values as numbers with decimal points and blanks between them.

    Parameters
    ----------
    text : str
        Values separated by blanks, commas, semicolons or tabs, with a decimal point or a decimal comma. Empty values
        are missing heights. A heading ``x [mm], y [mm], z [um]`` of points or ``height [um]`` of a matrix becomes
        comments that state the units. Lines of other text, such as ``# Width: 26 um``, stay unchanged.

    Returns
    -------
    str

    Raises
    ------
    InputError
        If a value of the matrix is not a number, the decimal mark is ambiguous, or the units of x and y differ.
    """
    lines = _units_as_comments(text.splitlines())
    text = "\n".join(lines) + "\n"
    if not all(_ROW[" "].fullmatch(line) or (line[:1] in ("#", "") and "," not in line) for line in lines):
        text = "\n".join(_rewritten(lines)) + "\n"
    return text


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
    comments = [f"# Value units: {units[-1]}"]
    if names[:2] == ["x", "y"] and len(names) == 3:
        if units[0] != units[1]:
            expected = f"expected one unit of both, such as 'x [{units[0]}], y [{units[0]}], z [{units[2]}]'"
            raise InputError(f"line {first + 1}: found x in {units[0]} and y in {units[1]}: {expected}")
        comments.insert(0, f"# Lateral units: {units[0]}")
    elif len(names) != 1:
        expected = "expected 'x [mm], y [mm], z [um]' of points or 'height [um]' of a matrix"
        raise InputError(f"line {first + 1}: found the heading {lines[first][:60]!r}: {expected}")
    return [*lines[:first], "\n".join(comments), *lines[first + 1 :]]  # other lines keep their numbers


def _rewritten(lines: list[str]) -> list[str]:
    """Return the lines with decimal points in their numbers and blanks between them."""
    split = [_values(line) for line in lines]
    matrix = [number for number, found in enumerate(split) if _is_row(lines[number], *found)]
    if not matrix:
        return lines
    if all(lines[number].rstrip().endswith(split[number][0]) for number in matrix):  # a separator ends every row
        split = [(between, values[: max(len(values) - 1, 1)]) for between, values in split]
    first, (separator, last) = matrix[0], split[matrix[-1]]
    width = mode(len(split[number][1]) for number in matrix)
    whole = [number for number in matrix if len(split[number][1]) == width]
    rows = {number for number, (_, values) in enumerate(split) if values == ["nan"] * len(last)}.union(matrix)
    cells = [value for number in matrix for value in split[number][1] if "," in value or "." in value]
    mark = decimal_mark(cells or [found[2] for line in lines for found in _LENGTH.finditer(line)], separator)
    expected = f"expected numbers with a decimal {'point' if mark == '.' else 'comma'}"
    for number, (line, (between, values)) in enumerate(zip(lines, split, strict=True)):
        if mark == "." and _ROW[between].fullmatch(line):
            lines[number] = line.replace(between, " ")
            continue
        plain = [value if value == "nan" else plain_number(value, mark) for value in values]
        odd = [value for value, found in zip(values, plain, strict=True) if found is None]
        # a damaged row must not be skipped like other text: the map would lose a row
        inside = number not in rows and whole[0] < number < whole[-1] and bool(line.strip())
        as_wide = len(odd) < len(values) == len(last) and (between != " " or number > first)
        mostly = len(values) - len(odd) >= max(3, width / 2, len(odd) + 1)
        broken = line[:1] != "#" and (inside or (bool(odd) and (as_wide or mostly)))
        if broken or (odd and number in rows):
            found = repr(odd[0]) if odd else f"{len(values)} of {width} values"
            raise InputError(f"line {number + 1}: found {found} among numbers ({line[:60]!r}): {expected}")
        if number in rows:
            lines[number] = " ".join(map(str, plain))
        else:
            lines[number] = _LENGTH.sub(lambda found: found[1] + (plain_number(found[2], mark) or found[2]), line)
    return lines


def _values(line: str) -> tuple[str, list[str]]:
    """Return the separator of a line and its values, ``nan`` for a missing value."""
    separator = next((sign for sign in ";\t," if sign in line), " ")
    cells = line.split()
    if separator == "," and len(cells) > 1 and all(map(_WITH_COMMA.fullmatch, cells)):
        separator = " "
    if separator != " ":
        quoted = '"' in line
        cells = (
            next(csv.reader([line], delimiter=separator, skipinitialspace=True)) if quoted else line.split(separator)
        )
        cells = [cell.strip() for cell in cells]
    return separator, ["nan" if cell.lower() in _MISSING else cell for cell in cells]


def _is_row(line: str, separator: str, values: list[str]) -> bool:
    """Return whether a line is a row of a matrix: two or more values, each a number or missing, not all missing."""
    if len(values) < 2 or _ROW[separator].fullmatch(line):
        return len(values) > 1
    known = [value for value in values if value != "nan"]
    return bool(known) and all(plain_number(value, ".") or plain_number(value, ",") for value in known)
