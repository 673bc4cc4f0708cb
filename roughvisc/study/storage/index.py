"""Cache of the histories of all results in a folder: one small file, so that results need not be opened.

The cache is made again from the results if it is absent, damaged or older than the results.
"""

from __future__ import annotations

import json
import re
from base64 import b64decode, b64encode
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.study.case import program_version
from roughvisc.study.storage.folder import (
    DAMAGED,
    read_json,
    require_file,
    require_folder,
    result_files,
    warn_once,
    write_json,
)
from roughvisc.study.storage.netcdf import ERRORS, NETCDF, foreign, unreadable
from roughvisc.variables import ROW, STEP, VARIABLES, axis_of

INDEX = ".index.json.gz"
#: Names of histories over the rows, and of the coordinates of the rows.
_HISTORIES = tuple(name for name, variable in VARIABLES.items() if variable.dims in ((ROW,), (STEP,)))
#: Names of results are their keys.
_KEY = re.compile(r"[0-9a-f]{16}")


@dataclass(frozen=True)
class Entry:
    """Content of one result without its fields.

    Attributes
    ----------
    file : str
        Name of the file in the folder.
    stamp : tuple of int
        Size of the file [bytes] and time of its last change [ns].
    attributes : dict
        Attributes of the file that are text or numbers.
    fields : dict
        dtype of each variable over x and y.
    histories : dict
        Each variable over the rows, with ``time`` or ``speed``.
    x, y : ndarray
        Positions of the cells. [m]
    """

    file: str
    stamp: tuple[int, int]
    attributes: dict[str, Any]
    fields: dict[str, str]
    histories: dict[str, NDArray[Any]] = field(repr=False)
    x: NDArray[np.float64] = field(repr=False)
    y: NDArray[np.float64] = field(repr=False)

    @property
    def key(self) -> str:
        """Key of the case."""
        return str(self.attributes.get("case_key", Path(self.file).stem))

    @property
    def along(self) -> str:
        """Axis of the rows."""
        return axis_of(self.histories)

    @property
    def rows(self) -> int:
        """Number of kept times, or of speeds."""
        return len(self.histories[self.along])

    @cached_property
    def case(self) -> dict[str, Any]:
        """The case as a dictionary, from its JSON."""
        return json.loads(self.attributes.get("case", "{}"))


def read_entry(path: Path) -> Entry:
    """Read the entry of one result.

    Raises
    ------
    InputError
        If the file cannot be read, is not a result, or is damaged.
    """
    require_file(path)
    stamp = _stamp(path)
    try:
        with NETCDF, netCDF4.Dataset(path) as file:  # in half the time of open_result
            file.set_auto_maskandscale(False)
            stored = file.variables
            stated = {name: one.item() if isinstance(one, np.generic) else one for name, one in file.__dict__.items()}
            found = foreign(stated, {name: one.dimensions for name, one in stored.items()})
            histories = {name: stored[name][...] for name in _HISTORIES if name in stored}
            fields = {name: one.dtype.str for name, one in stored.items() if one.dimensions[-2:] == ("x", "y")}
            grid = {name: np.asarray(stored[name][...], float) for name in ("x", "y") if name in stored}
    except ERRORS as error:
        raise unreadable(path, error) from error
    absent = [name for name in ("status", "x", "y", "case") if name not in {**histories, **grid, **stated}]
    if found or absent:
        raise InputError(f"{path}: {found or f'holds no {absent[0]}'}: expected a result of roughvisc run")
    attributes = {name: one for name, one in stated.items() if isinstance(one, str | int | float)}
    return Entry(path.name, stamp, attributes, fields, histories, **grid)


def _stamp(path: Path) -> tuple[int, int]:
    found = path.stat()
    return found.st_size, found.st_mtime_ns


def index_of(folder: Path, known: Iterable[Entry] = ()) -> dict[str, Entry]:
    """Return the entry of every result in a folder by its key, and update the cache.

    The log names files that are not results.

    Parameters
    ----------
    folder : Path
        Results folder.
    known : iterable of Entry
        Entries of results that need not be opened.

    Raises
    ------
    InputError
        If the folder is absent, or a file.
    """
    require_folder(folder)
    cached = _read_index(folder)
    before = cached | {entry.file: entry for entry in known}
    entries = {}
    for path in result_files(folder):
        if not _KEY.fullmatch(path.stem):  # not the file of a case
            continue
        try:
            entry = before.get(path.name)
            if entry is None or entry.stamp != _stamp(path):
                entry = read_entry(path)
            if entry.key != path.stem:
                expected = "expected the one that its name says"
                raise InputError(f"{path}: holds the result of case {entry.key}: {expected}")
            entries[entry.key] = entry
        except InputError as error:
            warn_once(str(error))
        except FileNotFoundError:  # removed in the meantime
            continue
    if {entry.file: entry.stamp for entry in entries.values()} != {name: one.stamp for name, one in cached.items()}:
        _write_index(folder, entries)
    return entries


def _write_index(folder: Path, entries: Mapping[str, Entry]) -> None:
    """Write the cache of a folder; if this fails, opening results is only slower."""
    grids: dict[str, int] = {}
    results = {}
    for entry in entries.values():
        grid = json.dumps([_packed(entry.x), _packed(entry.y)])  # most results share one grid
        histories = {name: _packed(values) for name, values in entry.histories.items()}
        number = grids.setdefault(grid, len(grids))
        results[entry.file] = [*entry.stamp, entry.attributes, entry.fields, number, histories]
    stated = {"version": program_version(), "grids": [json.loads(grid) for grid in grids], "results": results}
    write_json(folder / INDEX, stated)


def _read_index(folder: Path) -> dict[str, Entry]:
    """Return the entries of the cache by file name; none if it is absent, damaged or of another version."""
    entries = {}
    try:
        stated = read_json(folder / INDEX)
        if stated["version"] == program_version():
            grids = [(_unpacked(x), _unpacked(y)) for x, y in stated["grids"]]
            for file, (size, changed, attributes, fields, grid, packed) in stated["results"].items():
                histories = {name: _unpacked(one) for name, one in packed.items()}
                entries[file] = Entry(file, (size, changed), attributes, fields, histories, *grids[grid])
    except DAMAGED:
        return {}
    return entries


def _packed(values: NDArray[Any]) -> list[str]:
    """Return a one-dimensional array as text: its type and its bytes."""
    return [values.dtype.str, b64encode(values.tobytes()).decode()]


def _unpacked(packed: list[str]) -> NDArray[Any]:
    return np.frombuffer(b64decode(packed[1]), packed[0])
