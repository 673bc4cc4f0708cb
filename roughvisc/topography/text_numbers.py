"""Text files of numbers: their encoding, their decimal mark, and which number a cell is.

Every reader of text decides these here, so that no two of them take one file for different numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from roughvisc.errors import InputError

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
