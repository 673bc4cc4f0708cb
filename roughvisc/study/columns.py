"""Columns of numbers in a CSV file: a loading history, creep data."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path

from roughvisc.errors import InputError
from roughvisc.units import quantity

_HEADING = re.compile(r"\s*(?P<name>[^\[\(]*?)\s*(?:[\[\(]\s*(?P<unit>.*?)\s*[\]\)])?\s*")


def read_columns(path: str | Path, units: Mapping[str, str]) -> tuple[list[float], ...]:
    """Columns of a CSV file, in SI.

    Parameters
    ----------
    path : path
        A CSV file of numbers, with commas, semicolons or tabs between them. Lines that begin with ``#`` are comments.
        The first line may be a heading, ``time [ms], load [N]``: the columns are then found by name, in any order,
        and converted; without one they are taken in the order of `units`, in SI.
    units : mapping of str to str
        Name of each column wanted, and the unit it is wanted in.

    Returns
    -------
    tuple of list of float
        One list for each entry of `units`.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing, a unit does not fit, or a cell is no finite number; the
        line is named.
    """
    lines = _lines(Path(path))
    if not lines:
        raise InputError(f"{path}: holds no rows: expected columns {', '.join(units)}")
    number, heading = lines[0]
    order, factors = list(range(len(units))), [1.0] * len(units)
    if not _is_number(heading[0]):
        order, factors = _from_heading(path, heading, units)
        lines = lines[1:]
    columns: tuple[list[float], ...] = tuple([] for _ in units)
    for number, cells in lines:
        for column, place, factor, name in zip(columns, order, factors, units, strict=True):
            if place >= len(cells) or not _is_number(cells[place]):
                found = repr(cells[place]) if place < len(cells) else f"{len(cells)} columns"
                raise InputError(f"{path}, line {number}: found {found}: expected a number for {name}")
            column.append(float(f"{float(cells[place]) * factor:.15g}"))
    return columns


def _lines(path: Path) -> list[tuple[int, list[str]]]:
    """Rows of cells with their line numbers, without blank lines and comments."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a CSV file: {error}") from error
    kept = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    separator = next((mark for mark in (";", "\t", ",") if kept and mark in kept[0][1]), ",")
    rows = csv.reader((line for _, line in kept), delimiter=separator, skipinitialspace=True)
    return [(i, row) for (i, _), row in zip(kept, rows, strict=False)]


def _is_number(cell: str) -> bool:
    try:
        quantity(float(cell), "1")  # refuses nan and inf
    except ValueError:
        return False
    return True


def _from_heading(path: str | Path, heading: list[str], units: Mapping[str, str]) -> tuple[list[int], list[float]]:
    """Place and factor to SI of each wanted column."""
    found = [_HEADING.fullmatch(cell) for cell in heading]
    names = [match["name"].lower() if match else "" for match in found]
    order, factors = [], []
    for name, unit in units.items():
        if name not in names:
            raise InputError(f"{path}: has columns {', '.join(names)}: expected {', '.join(units)}")
        place = names.index(name)
        match = found[place]
        given = match["unit"] if match else None
        order.append(place)
        factors.append(quantity(f"1 {given}", unit, f"{path}: unit of {name}") if given else 1.0)
    return order, factors
