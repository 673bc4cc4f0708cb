"""The index of a folder of results: all of them but the fields, in one small file.

It only saves time: it is made again from the results if it is absent, damaged or older than they are.
"""

from __future__ import annotations

import json
import logging
import re
from base64 import b64decode, b64encode
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.study.case import program_version
from roughvisc.study.storage.files import require_file, require_folder, warn_once
from roughvisc.study.storage.json_files import DAMAGED, read_json, write_json
from roughvisc.study.storage.store import is_json_table, open_result, result_files, result_path
from roughvisc.variables import ROW, STEP, VARIABLES, axis_of

log = logging.getLogger("roughvisc")

INDEX = ".index.json.gz"
#: Names of histories over the rows, and of the coordinates of the rows.
_HISTORIES = tuple(name for name, variable in VARIABLES.items() if variable.dims in ((ROW,), (STEP,)))
#: Names of results are their keys.
_KEY = re.compile(r"[0-9a-f]{16}")


@dataclass(frozen=True)
class Entry:
    """What the index keeps of one result.

    Attributes
    ----------
    file : str
        Name of the file in the folder.
    stamp : tuple of int
        Its size [bytes] and its time of change [ns].
    attributes : dict
        Of the file, each under its own name.
    fields : dict
        dtype of each variable over x and y.
    histories : dict
        Everything over the rows, ``time`` or ``speed`` too.
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
        """What its rows lie over."""
        return axis_of(self.histories)

    @property
    def rows(self) -> int:
        """Number of kept times, or of speeds."""
        return len(self.histories[self.along])

    @cached_property
    def case(self) -> dict[str, Any]:
        """The case, as JSON has it."""
        return json.loads(self.attributes.get("case", "{}"))


@dataclass(frozen=True)
class Index:
    """What is known of the results in a folder.

    Attributes
    ----------
    entries : dict
        Key -> entry.
    problems : dict
        Key that a file is named by -> why that is not its result.
    """

    entries: dict[str, Entry]
    problems: dict[str, str] = field(default_factory=dict)


def read_entry(path: Path) -> Entry:
    """Entry of one result.

    Raises
    ------
    InputError
        If the file cannot be read, is no result, or is damaged.
    """
    require_file(path)
    stamp = _stamp(path)
    with open_result(path) as result:
        attributes = {name: one.item() if isinstance(one, np.generic) else one for name, one in result.attrs.items()}
        histories = {name: result[name].values for name in _HISTORIES if name in result.variables}
        fields = {str(name): one.dtype.str for name, one in result.variables.items() if one.dims[-2:] == ("x", "y")}
        grid = [np.asarray(result[name].values, float) for name in ("x", "y") if name in result.variables]
    along = axis_of(histories)
    absent = [name for name in (along, "force", "status") if name not in histories]
    if absent or len(grid) < 2 or not is_json_table(attributes.get("case")):
        raise InputError(f"{path}: holds no {', '.join([*absent, 'grid or case'])}: expected a result of roughvisc run")
    kept = {str(name): one for name, one in attributes.items() if isinstance(one, str | int | float)}
    return Entry(path.name, stamp, kept, fields, histories, grid[0], grid[1])


def _stamp(path: Path) -> tuple[int, int]:
    found = path.stat()
    return found.st_size, found.st_mtime_ns


def index_of(folder: Path, known: Iterable[Entry] = (), *, warn: bool = True) -> Index:
    """Index of the results that are in a folder now, read from its file as far as that is up to date.

    Parameters
    ----------
    folder : Path
        Of the results.
    known : iterable of Entry
        Entries that need not be read again.
    warn : bool
        Have the log say what is left out.

    Raises
    ------
    InputError
        If the folder is absent or is none. What is no result is left out, and the log says so.
    """
    require_folder(folder)
    before = _load(folder / INDEX) | {entry.file: entry for entry in known}
    entries: dict[str, Entry] = {}
    problems: dict[str, str] = {}
    for path in result_files(folder):
        if not _KEY.fullmatch(path.stem):  # made from a result, or by somebody else
            continue
        try:
            entry = before.get(path.name)
            if entry is None or entry.stamp != _stamp(path):
                entry = read_entry(path)
        except InputError as error:
            problems[path.stem] = str(error)
        except FileNotFoundError:  # gone meanwhile
            continue
        else:
            if entry.key == path.stem:
                entries[entry.key] = entry
            else:
                found = f"{path}: holds the result of case {entry.key}"
                problems[path.stem] = f"{found}: expected the one that its name says"
    if warn:
        warn_of(folder, problems)
    return Index(entries, problems)


def warn_of(folder: Path, problems: Mapping[str, str]) -> None:
    """Log what is no result of a folder, once as long as the file is as it is."""
    for key, problem in problems.items():
        warn_once(result_path(folder, key), problem)


def save_index(folder: Path, index: Index) -> None:
    """Write the index of a folder; if that is impossible, results are only slower to open."""
    grids: dict[str, int] = {}
    results = {}
    for entry in index.entries.values():
        grid = json.dumps([_packed(entry.x), _packed(entry.y)])  # most results are on one
        histories = {name: _packed(values) for name, values in entry.histories.items()}
        number = grids.setdefault(grid, len(grids))
        results[entry.file] = [*entry.stamp, entry.attributes, entry.fields, number, histories]
    stated = {"version": program_version(), "grids": [json.loads(grid) for grid in grids], "results": results}
    write_json(folder / INDEX, stated)


def _load(path: Path) -> dict[str, Entry]:
    """File name -> entry of the stored index; none if it is absent, damaged or of another version."""
    try:
        stated = read_json(path)
        if stated["version"] != program_version():
            return {}
        grids = [(_unpacked(x), _unpacked(y)) for x, y in stated["grids"]]
        entries = {}
        for file, (size, changed, attributes, fields, grid, packed) in stated["results"].items():
            histories = {name: _unpacked(one) for name, one in packed.items()}
            entries[file] = Entry(file, (size, changed), attributes, fields, histories, *grids[grid])
        return entries
    except FileNotFoundError:
        return {}
    except DAMAGED as error:
        log.info("%s is made again: %s", path, error)
        return {}


def _packed(values: NDArray[Any]) -> list[str]:
    """An array with one axis as text: its type and its bytes."""
    return [values.dtype.str, b64encode(values.tobytes()).decode()]


def _unpacked(packed: list[str]) -> NDArray[Any]:
    return np.frombuffer(b64decode(packed[1]), packed[0])
