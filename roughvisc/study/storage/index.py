"""The index of a folder of results: all of them but the fields, in one small file.

It only saves time: it is made anew from the results where it is absent, damaged or older than they are. Which sweep
ran last cannot be made anew, and stands in a file of its own.
"""

from __future__ import annotations

import io
import json
import logging
import re
import zlib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.study.storage.files import (
    UNSEALED,
    append_checksum,
    atomic_write,
    require_folder,
    unsealed,
    verify_checksum,
    warn_once,
)
from roughvisc.study.storage.store import NETCDF, is_json_table, result_files, result_path
from roughvisc.variables.axes import AXES, axis_of

log = logging.getLogger("roughvisc")

INDEX, LATEST = ".index.npz", ".latest.json"
#: Raised by whoever changes what an index holds.
_LAYOUT = 7
#: What an index that is absent, cut short, damaged or of another version may raise; the results are all there.
_UNREADABLE: tuple[type[Exception], ...] = (OSError, EOFError, RuntimeError, ValueError, LookupError, TypeError)
_UNREADABLE += (AttributeError, MemoryError, BadZipFile, zlib.error)
#: Names of results are their keys.
_KEY = re.compile(r"[0-9a-f]{16}")


def _names_of_histories() -> tuple[str, ...]:
    """Return the names of histories over the rows, and of the coordinate of the rows."""
    found = (
        name for axis in AXES.values() for name, variable in axis.variables.items() if variable.dims == (axis.name,)
    )
    return tuple(dict.fromkeys(found))


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
    sealed : bool
        Whether the file has a checksum.
    """

    file: str
    stamp: tuple[int, int]
    attributes: dict[str, Any]
    fields: dict[str, str]
    histories: dict[str, NDArray[Any]] = field(repr=False)
    x: NDArray[np.float64] = field(repr=False)
    y: NDArray[np.float64] = field(repr=False)
    sealed: bool = True

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
    sweep : tuple of str or None
        Keys of the sweep that ran last in the folder, in its order; None if not known.
    problems : dict
        Key that a file is named by -> why that is not its result.
    realisations : dict
        Key -> number of the realisation that a case was in that sweep. A result may have been computed before, as a
        case that was none.
    """

    entries: dict[str, Entry]
    sweep: tuple[str, ...] | None = ()
    problems: dict[str, str] = field(default_factory=dict)
    realisations: dict[str, int] = field(default_factory=dict)


def read_entry(path: Path) -> Entry:
    """Entry of one result.

    Raises
    ------
    InputError
        If the file is no result, or is damaged.
    """
    import netCDF4

    try:
        stamp = _stamp(path)
        sealed = verify_checksum(path)
        with NETCDF, netCDF4.Dataset(path) as file:
            file.set_auto_mask(False)
            attributes = dict(file.__dict__)
            histories = {name: file[name][:] for name in _names_of_histories() if name in file.variables}
            fields = {name: v.dtype.str for name, v in file.variables.items() if v.dimensions[-2:] == ("x", "y")}
            x, y = file["x"][:], file["y"][:]
    except (OSError, RuntimeError, IndexError, AttributeError) as error:
        raise InputError(
            f"{path}: is damaged, or no result of roughvisc ({error}): expected a whole one; run it again"
        ) from error
    along = axis_of(histories)
    absent = [name for name in (along, "force", "status") if name not in histories]
    if absent or not is_json_table(attributes.get("case")):
        raise InputError(f"{path}: holds no {', '.join([*absent, 'case'])}: expected a result of roughvisc run")
    plain = {name: v.item() if isinstance(v, np.generic) else v for name, v in attributes.items()}
    kept = {name: v for name, v in plain.items() if isinstance(v, str | int | float)}
    return Entry(path.name, stamp, kept, fields, histories, np.asarray(x, float), np.asarray(y, float), sealed)


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
    stored = _load(folder / INDEX)
    before = {entry.file: entry for entry in (*stored, *known)}
    entries: dict[str, Entry] = {}
    problems: dict[str, str] = {}
    for path in result_files(folder):
        if not _KEY.fullmatch(path.stem):  # made from a result, or by somebody else
            continue
        try:
            entry = before.get(path.name)
            if entry is None or entry.stamp != _stamp(path):
                entry = read_entry(path)
            elif not entry.sealed and warn:
                warn_once(path, f"{path}: {UNSEALED}")
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
    sweep, realisations = _latest(folder)
    index = Index(entries, sweep, problems, realisations)
    if warn:
        warn_of(folder, problems)
    return index


def warn_of(folder: Path, problems: Mapping[str, str]) -> None:
    """Log what is no result of a folder, once as long as the file is as it is."""
    for key, problem in problems.items():
        warn_once(result_path(folder, key), problem)


def save_index(folder: Path, index: Index) -> None:
    """Write the index of a folder; where that cannot be done, results are only slower to open."""
    entries = list(index.entries.values())
    grids = [(entry.x.tobytes(), entry.y.tobytes()) for entry in entries]
    numbers = {grid: number for number, grid in enumerate(dict.fromkeys(grids))}  # most results are on one
    head, arrays = [], {}
    for entry, grid in zip(entries, grids, strict=True):
        stated = {name: getattr(entry, name) for name in ("file", "stamp", "attributes", "fields", "sealed")}
        counts = {name: len(values) for name, values in entry.histories.items()}
        head.append(stated | {"histories": counts, "grid": numbers[grid]})
        arrays |= {f"x{numbers[grid]}": entry.x, f"y{numbers[grid]}": entry.y}
    for name in _names_of_histories():
        columns = [entry.histories[name] for entry in entries if name in entry.histories]
        if columns:
            arrays[name] = np.concatenate(columns)
    text = json.dumps({"layout": _LAYOUT, "entries": head})
    with suppress(OSError, InputError), atomic_write(folder / INDEX) as temporary:
        np.savez(temporary, head=np.frombuffer(text.encode(), np.uint8), **arrays)
        append_checksum(temporary)
    if index.sweep is not None and (index.sweep, index.realisations) != _latest(folder):
        keys, drawn = list(index.sweep), index.realisations
        stated = {"keys": keys} | ({"realisations": drawn} if drawn else {}) | {"checksum": _checksum(keys, drawn)}
        with suppress(OSError, InputError), atomic_write(folder / LATEST) as temporary:
            temporary.write_text(json.dumps(stated))


def _latest(folder: Path) -> tuple[tuple[str, ...] | None, dict[str, int]]:
    """Keys of the sweep that ran last, and which of them were realisations.

    No keys if no sweep ran, None if what says so is damaged.
    """
    try:
        stated = json.loads((folder / LATEST).read_bytes())
        keys, drawn = stated["keys"], stated.get("realisations", {})
        return (tuple(keys), dict(drawn)) if stated["checksum"] == _checksum(keys, drawn) else (None, {})
    except FileNotFoundError:
        return (), {}
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None, {}


def _checksum(keys: Sequence[str], drawn: Mapping[str, int]) -> int:
    return zlib.crc32(" ".join([*keys, *(f"{key}={number}" for key, number in drawn.items())]).encode())


def _load(path: Path) -> list[Entry]:
    """Entries of the stored index; none where there is none that can be used."""
    try:
        content = unsealed(path)
        if content is None:
            return []
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        stored = json.loads(bytes(arrays["head"]))
        return _entries(stored["entries"], arrays) if stored["layout"] == _LAYOUT else []
    except _UNREADABLE as error:
        if not isinstance(error, FileNotFoundError):
            log.info("%s is made anew: %s", path, error)
        return []


def _entries(heads: Sequence[Mapping[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> list[Entry]:
    at = dict.fromkeys(arrays, 0)
    entries = []
    for head in heads:
        histories = {}
        for name, count in head["histories"].items():
            histories[name] = arrays[name][at[name] : at[name] + count]
            at[name] += count
        x, y = arrays[f"x{head['grid']}"], arrays[f"y{head['grid']}"]
        size, changed = head["stamp"]
        stamp, sealed = (size, changed), head["sealed"]
        entries.append(Entry(head["file"], stamp, head["attributes"], head["fields"], histories, x, y, sealed))
    return entries
