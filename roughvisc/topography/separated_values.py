"""Matrices with commas, semicolons or tabs between the numbers, as a text that has blanks there."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import TextIO

from roughvisc.errors import InputError

_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*")
#: What stands for a missing height.
_MISSING = ("", "nan", "bad", "-", "#n/a", "n/a")


def separated_by_blanks(path: Path) -> TextIO:
    """A file of separated values as a text of numbers with blanks between them.

    Parameters
    ----------
    path : path
        Values between commas, semicolons or tabs; with semicolons or tabs a comma may be the decimal sign. Empty
        values are missing heights. Lines of other text, such as ``# Width: 26 um``, stay as they are.

    Returns
    -------
    file
        The text, in memory.

    Raises
    ------
    InputError
        If a line of the matrix holds what is no number.
    """
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    split = [_values(line) for line in lines]
    matrix = [values for values in split if _numbers(values)]
    if not matrix:
        return io.StringIO("\n".join(lines) + "\n")
    for number, (line, values) in enumerate(zip(lines, split, strict=True), 1):
        odd = [value for value in values if not _NUMBER.fullmatch(value)]
        if len(values) == len(matrix[0]) and odd and len(odd) < len(values) and not _numbers(values):
            raise InputError(f"line {number}: found {odd[0]!r} among numbers ({line[:60]!r}): expected numbers")
    shown = (" ".join(values) if _numbers(values) else line for line, values in zip(lines, split, strict=True))
    return io.StringIO("\n".join(shown) + "\n")


def _values(line: str) -> list[str]:
    """The values of a line, ``nan`` where one is missing; one value where it has no separators."""
    separator = next((sign for sign in ";\t," if sign in line), None)
    if separator is None:
        return [line]
    values = [value.strip().strip('"') for value in line.strip(" \r\n").split(separator)]
    if values[-1] == "":  # a separator at the end of the line
        values.pop()
    if separator != ",":
        values = [value.replace(",", ".") for value in values]
    return ["nan" if value.lower() in _MISSING else value for value in values]


def _numbers(values: list[str]) -> bool:
    """Whether values are two numbers at least, or missing ones among numbers."""
    known = [value for value in values if value != "nan"]
    return len(values) > 1 and bool(known) and all(_NUMBER.fullmatch(value) for value in known)
