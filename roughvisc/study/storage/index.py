"""Contents of a folder of results: their histories, and the removal of leftovers of killed runs.

A cache of the histories is one small file, so that results need not be opened. It is made again from the results if it
is absent, damaged or older than the results.
"""

from __future__ import annotations

import json
import logging
import re
import shutil
import time
from base64 import b64decode, b64encode
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.study.case import program_version
from roughvisc.study.storage.checkpoint import STATE
from roughvisc.study.storage.folder import (
    DAMAGED,
    case_path,
    lock_case,
    no_results,
    read_json,
    write_json,
)
from roughvisc.study.storage.netcdf import open_result
from roughvisc.variables import axis_of

log = logging.getLogger("roughvisc")

INDEX = ".index.json.gz"
#: Pattern of a key.
_KEY = "[0-9a-f]" * 16
#: Hidden files of a case: its lock, its checkpoint, and incomplete files.
_OF_A_CASE = re.compile(rf"\.({_KEY})\.")
#: Age of an incomplete file that belongs to no case, above which the file counts as a leftover. [s]
_ABANDONED = 3600.0


@dataclass(frozen=True)
class Entry:
    """Content of one result without its fields.

    Attributes
    ----------
    file : str
        Name of the file in the folder.
    stamp : list of int
        Size of the file [bytes] and time of its last change [ns].
    attributes : dict
        Attributes of the file that are text or numbers.
    fields : dict
        dtype of each variable over x and y.
    arrays : dict
        Each variable over the rows, with ``time`` or ``speed``; and the positions ``x`` and ``y`` of the cells.
    """

    file: str
    stamp: list[int]
    attributes: dict[str, Any]
    fields: dict[str, str]
    arrays: dict[str, NDArray[Any]] = field(repr=False)

    @property
    def key(self) -> str:
        """Key of the case."""
        return str(self.attributes.get("case_key", ""))

    @property
    def along(self) -> str:
        """Axis of the rows."""
        return axis_of(self.arrays)

    @cached_property
    def case(self) -> dict[str, Any]:
        """The case as a dictionary, from its JSON."""
        return json.loads(self.attributes["case"])


def read_entry(path: Path) -> Entry:
    """Read the entry of one result.

    Raises
    ------
    InputError
        If the file cannot be read, is not a result, or is damaged.
    """
    stamp, arrays, fields = _stamp(path), {}, {}
    with open_result(path) as result:
        lines = (axis_of(result.variables),), ("x",), ("y",)
        for name, variable in result.variables.items():
            if variable.dims in lines:
                arrays[str(name)] = variable.values
            elif variable.dims[-2:] == ("x", "y"):
                fields[str(name)] = variable.dtype.str
    plain = {str(name): one for name, one in result.attrs.items() if isinstance(one, str | int | float)}
    return Entry(path.name, stamp, plain, fields, arrays)


def _stamp(path: Path) -> list[int]:
    found = path.stat()
    return [found.st_size, found.st_mtime_ns]


def index_of(folder: Path, known: Iterable[Entry] = ()) -> dict[str, Entry]:
    """Return the entry of every result in a folder by its key, and update the cache.

    The log names files that are not results.

    Parameters
    ----------
    folder : Path
        Results folder.
    known : iterable of Entry
        Entries of results that need not be opened.

    """
    cached = _read_cache(folder)
    before = cached | {entry.file: entry for entry in known}
    entries = {}
    for path in sorted(folder.glob(f"{_KEY}.nc")):
        try:
            entry = before.get(path.name)
            if entry is None or entry.stamp != _stamp(path):
                entry = read_entry(path)
            if entry.key != path.stem:
                raise InputError(f"{path}: holds the result of case {entry.key}: expected the case of its name")
            entries[entry.key] = entry
        except (InputError, FileNotFoundError) as error:  # damaged, or removed in the meantime
            log.warning("%s", error)
    if {entry.file: entry.stamp for entry in entries.values()} != {name: one.stamp for name, one in cached.items()}:
        results = [[one.file, one.stamp, one.attributes, one.fields, one.arrays] for one in entries.values()]
        write_json(folder / INDEX, {"version": program_version(), "results": results}, _packed)
    return entries


def _packed(array: NDArray[Any]) -> tuple[str, str]:
    return array.dtype.str, b64encode(array).decode()


def _read_cache(folder: Path) -> dict[str, Entry]:
    """Return the entries of the cache by file name; none if it is absent, damaged or of another version."""
    entries = {}
    with suppress(*DAMAGED):
        stated = read_json(folder / INDEX)
        for *plain, arrays in stated["results"] if stated["version"] == program_version() else ():
            unpacked = {name: np.frombuffer(b64decode(text), dtype) for name, (dtype, text) in arrays.items()}
            entries[plain[0]] = Entry(*plain, unpacked)
    return entries


def clean_folder(folder: str | Path, *, everything: bool = False) -> list[Path]:
    """Remove incomplete files, locks of dead runs, and checkpoints of finished cases.

    Parameters
    ----------
    folder : path
        Results folder. Files of running cases are kept.
    everything : bool
        Also remove renamed damaged results, records of failures, and the checkpoints of unfinished cases, which then
        start again.

    Returns
    -------
    list of Path
        Removed files and folders.

    Raises
    ------
    InputError
        If the folder does not exist.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise no_results(folder)
    removed: list[Path] = []

    def remove(path: Path) -> None:
        with suppress(OSError):  # removed in the meantime, or the folder is not writable
            shutil.rmtree(path) if path.is_dir() else path.unlink()
            removed.append(path)

    keys: dict[str, None] = {}
    for path in sorted(folder.iterdir()):
        if found := _OF_A_CASE.match(path.name):
            keys[found[1]] = None
        elif path.match(".*.part*"):
            with suppress(OSError):
                if time.time() - path.stat().st_mtime > _ABANDONED:
                    remove(path)
        elif everything and (path.match("*.nc.damaged") or path.match("*.failed.json")):
            remove(path)
    for key in keys:
        lock, checkpoint = case_path(folder, key, "lock"), case_path(folder, key, "checkpoint")
        with suppress(OSError), lock_case(lock, patience=0.0):  # which also removes the lock
            resumes = (checkpoint / STATE).exists() and not case_path(folder, key, "result").exists()
            for path in sorted(folder.glob(f".{key}.*")):
                if path != lock and (everything or path != checkpoint or not resumes):
                    remove(path)
    return removed
