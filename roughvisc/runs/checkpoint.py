"""Checkpoints: the state of an unfinished run. A resumed run has the same bits as an uninterrupted run.

``rows-0000.npz`` and so on contain rows and never change. ``state.npz`` states the number of rows in each file. Files
are written under another name and renamed, and zip has a checksum for each array. Therefore a crash does not damage the
last checkpoint.
"""

from __future__ import annotations

import json
import logging
import os
import shutil
import time
import zipfile
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.experiment.base import Row
from roughvisc.experiment.loading import STATES
from roughvisc.mechanics.grid import to_host
from roughvisc.paths import opened
from roughvisc.runs.folder import DAMAGED, STATE, atomic_write
from roughvisc.runs.netcdf import lazy
from roughvisc.solve import Checkpoint, Recorder

log = logging.getLogger("roughvisc")
Array = NDArray[Any]

#: Size of the rows in memory above which they are written to the disk; a short run never writes rows. [byte]
_WAITING = 8 << 20
#: Largest part of the time for writing checkpoints.
_SHARE = 0.05
#: Member with the plain values of a file.
_PLAIN = "plain"
#: Errors that occur when a damaged file is read.
_DAMAGED = (*DAMAGED, RuntimeError, zipfile.BadZipFile)
_KINDS = {kind.__name__: kind for kind in (Checkpoint, *STATES)}


class CheckpointWriter(Recorder):
    """Recorder of a run in a folder.

    Parameters
    ----------
    folder : path
        Folder of this run alone, named by the key of the case; created if necessary.
    seconds : float
        Time between checkpoints, which is extended until writing takes at most a twentieth.
    stop : callable or None
        Called after every accepted step; the run stops if it returns true.
    """

    in_memory = False

    def __init__(self, folder: Path, *, seconds: float = 30.0, stop: Callable[[], bool] | None = None) -> None:
        super().__init__()  # keeps the rows that are not in a file yet
        folder.mkdir(exist_ok=True)
        self._folder = folder
        self._interval = seconds
        self._stop = stop
        self._is_saved = True
        self._last_save = time.monotonic()
        self._ends = [0]  # first row of each file, and first row in memory
        self._waiting = 0  # size of the arrays in memory [byte]
        self._reading: tuple[int, Any] = -1, None  # the last file read stays open: rows are read in their order

    def append(self, row: Row, axis: str, wall_time: float) -> None:
        """Record a row; after an accepted step, its state too, and write a checkpoint if one is due.

        The caller must not change the fields afterwards.

        Raises
        ------
        KeyboardInterrupt
            If `stop` returns true; the caller writes a checkpoint.
        """
        super().append(row, axis, wall_time)
        for array in row.fields.values():
            self._waiting += array.nbytes
        if self._waiting > _WAITING:
            self._write_rows()
        if row.state is None:
            return
        self.latest = Checkpoint(row.state, row.done, len(self.plain), wall_time)
        self._is_saved = False
        if self._stop is not None and self._stop():
            raise KeyboardInterrupt
        if time.monotonic() - self._last_save >= self._interval:
            self.save()

    def field(self, name: str, rows: Sequence[int], shape: tuple[int, int]) -> Any:
        """Return a field of some rows as a lazy array (rows, x, y)."""

        def read(key: tuple[Any, ...]) -> Array:
            chosen = np.array(rows, int)[key[0]]
            frames = np.empty((chosen.size, *shape))
            for frame, row in zip(frames, chosen.ravel().tolist(), strict=True):
                number = bisect_right(self._ends, row) - 1
                if row >= self._ends[-1]:  # in memory
                    frame[...] = self._arrays[row - self._ends[-1]][name]
                    continue
                if self._reading[0] != number:
                    self._reading = number, np.load(self._rows_path(number), allow_pickle=False)
                frame[...] = self._reading[1][f"{row}/{name}"]
            return frames[(slice(None), *key[1:])] if chosen.ndim else frames[(0, *key[1:])]

        return lazy(read, (len(rows), *shape))

    def resume(self) -> None:
        """Continue from the checkpoint if it is undamaged, otherwise from the start.

        Raises
        ------
        InputError
            If the system cannot read the checkpoint, which is then kept.
        """
        path = self._folder / STATE
        if not os.path.lexists(path):
            return  # rows without a state are overwritten
        try:
            plain = _read(path)
            ends = plain["ends"]
            rows = []
            for number, end in enumerate(ends[1:]):
                rows += _read(self._rows_path(number))[: end - len(rows)]
            if len(rows) != ends[-1]:
                raise ValueError(f"found {len(rows)} of {ends[-1]} rows")
            self.latest = plain["reached"]
            self._is_saved = True
            count = self.latest.rows  # rows after the state are computed again
            self.plain = rows[:count]
            self._ends = [min(end, count) for end in ends]
            log.info("%s: goes on from here", path)
        except InputError:
            raise
        except _DAMAGED as error:
            log.warning("%s: is damaged and not used: %s", path, error)
            self.restart()

    def restart(self) -> None:
        """Delete all rows, because the run starts again."""
        super().restart()
        self._reading = -1, None
        self.latest = Checkpoint()
        self._is_saved = True
        self._ends = [0]
        self._waiting = 0
        (self._folder / STATE).unlink(missing_ok=True)  # first, because it refers to the rows
        for path in self._folder.iterdir():
            path.unlink()

    def save(self) -> None:
        """Write a checkpoint, if anything has been computed since the last one."""
        if self._is_saved:
            return
        began = time.monotonic()
        self._write_rows()  # before the state, which refers to the rows
        _write(self._folder / STATE, {"ends": self._ends, "reached": self.latest}, {})
        self._is_saved = True
        self._last_save = time.monotonic()
        self._interval = max(self._interval, (self._last_save - began) / _SHARE)

    def remove(self) -> None:
        """Remove the folder, after the result is written or the case has failed."""
        self._reading = -1, None
        shutil.rmtree(self._folder, ignore_errors=True)

    def close(self) -> None:
        """Close the files, and remove them unless a checkpoint exists."""
        self._reading = -1, None
        if not (self._folder / STATE).exists():
            self.remove()

    def _write_rows(self) -> None:
        """Write the rows in memory to a new file."""
        first = self._ends[-1]
        if first == len(self.plain):
            return
        arrays = {
            f"{row}/{name}": one for row, variables in enumerate(self._arrays, first) for name, one in variables.items()
        }
        _write(self._rows_path(len(self._ends) - 1), self.plain[first:], arrays)
        self._ends = [*self._ends, len(self.plain)]
        self._arrays = []
        self._waiting = 0

    def _rows_path(self, number: int) -> Path:
        return self._folder / f"rows-{number:04d}.npz"


def _write(path: Path, plain: Any, arrays: Mapping[str, Array]) -> None:
    """Write arrays, and plain values and states as JSON, which refers to the arrays in them; floats are exact."""
    arrays = dict(arrays)
    names = dict[int, str]()

    def encoded(value: Any) -> Any:
        if isinstance(value, np.generic):
            return value.item()
        if is_dataclass(value):
            return {
                "type": type(value).__name__,
                "parts": {one.name: getattr(value, one.name) for one in fields(value)},
            }
        if not hasattr(value, "dtype"):  # no array of NumPy or CuPy
            raise TypeError(f"a checkpoint cannot hold a {type(value).__name__}")
        name = names.setdefault(id(value), f"array{len(names)}")  # each array once
        arrays[name] = to_host(value)
        return {"array": name}

    text = np.frombuffer(json.dumps(plain, default=encoded).encode(), np.uint8)
    with atomic_write(path) as temporary:
        np.savez(temporary, allow_pickle=False, **{_PLAIN: text}, **arrays)


def _read(path: Path) -> Any:
    """Return the plain values and states of a file."""

    def decoded(value: dict[str, Any]) -> Any:
        if "array" in value:
            return arrays[value["array"]]
        if "type" in value:
            return _KINDS[value["type"]](**{name: _tuples(part) for name, part in value["parts"].items()})
        return value

    with opened(path, "a checkpoint") as stream:
        with zipfile.ZipFile(stream) as archive:
            if damaged := archive.testzip():  # np.load would allocate the shape of a damaged header
                raise ValueError(f"{path.name}, {damaged}")
        stream.seek(0)
        with np.load(stream, allow_pickle=False) as found:
            arrays = dict(found)
    return json.loads(arrays[_PLAIN].tobytes(), object_hook=decoded)


def _tuples(value: Any) -> Any:
    """Return tuples for lists, because states contain tuples only."""
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
