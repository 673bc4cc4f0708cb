"""Checkpoints: the state of an unfinished run, from which it continues to the same last bit.

A checkpoint is one record of everything in the state of a march, all floats exact. Two files take turns, each written
whole under another name first, so that one whole checkpoint outlives whatever happens to the other.

A record is plain values and arrays with checksums. The file of rows is only ever appended to, and whoever reads it
knows how many records to expect: what was torn off or written beyond that is cut away. So it survives what kills a
process, a machine or a disk's free space.
"""

from __future__ import annotations

import json
import logging
import math
import os
import shutil
import struct
import time
import zlib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core.indexing import IndexingSupport, LazilyIndexedArray, explicit_indexing_adapter

from roughvisc.experiment.loading import STATES
from roughvisc.solve import Checkpoint, Recorder
from roughvisc.study.case import NUMERICS_REVISION
from roughvisc.study.storage.files import (
    atomic_write,
    pack_with_checksum,
    unpack_with_checksum,
)
from roughvisc.variables import RESULT_FORMAT

log = logging.getLogger("roughvisc")
Array = NDArray[Any]

# Not NumPy's .npz, though it has checksums too: measured, a row took 1.3 to 3 times as long to write and 1.5 to 6 times
# to read, in no less code; and np.load trusts the shape that a damaged member states without looking at its checksum.
# mark, length and checksum of the text, checksum of these; the text lists the arrays with their checksums
_HEAD = struct.Struct("<4sIII")
_MARK = b"rvr2"
_KINDS = "fiubc"
_SPARSE_SIZE = 1024  # smaller arrays are not looked at for zeros
#: Rows wait in memory for the disk until they take more than this: a short run never writes them. [bytes]
_WAITING = 8 << 20
#: Raised by whoever changes what a checkpoint holds of a state.
_LAYOUT = 4
#: Writing checkpoints may take this part of the time.
_SHARE = 0.05


class Damaged(Exception):
    """What is on the disk is not what was written."""


def write_record(stream: IO[bytes], plain: Any, arrays: Mapping[str, Array]) -> int:
    """Write plain values, as JSON knows them, and arrays; give the number of bytes.

    The stream must not be buffered: a full disk is then found here and nowhere else.
    """
    payload = {name: _packed(array) for name, array in arrays.items()}
    listed = [[name, a.dtype.str, a.shape, len(payload[name]), zlib.crc32(payload[name])] for name, a in arrays.items()]
    text = json.dumps([plain, listed]).encode()  # the shortest text that gives a float back exactly
    head = pack_with_checksum(_HEAD, _MARK, len(text), zlib.crc32(text))
    written = 0
    for part in (head + text, *payload.values()):
        left = memoryview(part)
        while len(left):
            left = left[stream.write(left) :]
        written += len(part)
    return written


def read_record(stream: IO[bytes], only: Collection[str] | None = None) -> tuple[Any, dict[str, Array]]:
    """Plain values and arrays of the record that begins here; its end is then reached.

    Parameters
    ----------
    stream : file
        Open for reading.
    only : collection of str, optional
        Names of the arrays wanted. Default: all.

    Raises
    ------
    Damaged
        If it is not whole.
    """
    head = stream.read(_HEAD.size)
    if len(head) < _HEAD.size:
        raise Damaged("no record begins here")
    mark, length, checksum = unpack_with_checksum(_HEAD, head) or (b"", 0, 0)
    if mark != _MARK:
        raise Damaged("a record's head is damaged")
    text = stream.read(length)
    if len(text) < length or zlib.crc32(text) != checksum:
        raise Damaged("a record is torn or damaged")
    plain, listed = json.loads(text)
    arrays = {}
    for name, kind, shape, size, checksum in listed:
        dtype = np.dtype(kind)
        if dtype.kind not in _KINDS:
            raise Damaged(f"a record holds {kind}")
        if only is not None and name not in only:
            stream.seek(size, os.SEEK_CUR)
            continue
        packed = np.empty(size, np.uint8)
        left = packed.data
        while len(left) and (count := stream.readinto(left)):  # type: ignore[attr-defined]
            left = left[count:]
        if len(left) or zlib.crc32(packed.data) != checksum:
            raise Damaged("a record is torn or damaged")
        arrays[name] = _unpacked(packed, shape, dtype)
    return plain, arrays


def _packed(array: Array) -> memoryview:
    """The bytes of an array; of a field of doubles that is mostly zero those that are not, after a bit for each."""
    flat = np.ascontiguousarray(array).reshape(-1)
    if array.dtype == np.float64 and array.size >= _SPARSE_SIZE:
        there = flat.view(np.int64) != 0  # bits: a negative zero is kept
        if 4 * np.count_nonzero(there) < array.size:
            return np.concatenate([np.packbits(there), flat[there].view(np.uint8)]).data
    return flat.view(np.uint8).data


def _unpacked(packed: NDArray[np.uint8], shape: Sequence[int], dtype: np.dtype[Any]) -> Array:
    """The array whose bytes these are: they are fewer than its size where it is mostly zero."""
    size = math.prod(shape)
    if packed.size == size * dtype.itemsize:
        return packed.view(dtype).reshape(shape)
    bits = (size + 7) // 8
    flat = np.zeros(size, dtype)
    flat[np.unpackbits(packed[:bits], count=size).view(bool)] = np.frombuffer(packed[bits:].tobytes(), dtype)
    return flat.reshape(shape)


class RowFile:
    """Rows of a run in a file: in memory are their plain values only, and the arrays of the last few.

    Parameters
    ----------
    path : path
        Opened as it is; say by :meth:`keep_first` how much of it counts.
    """

    def __init__(self, path: Path) -> None:
        self.plain: list[dict[str, Any]] = []
        self._begins = [0]  # of the rows in the file, and where the next is to begin
        self._waiting: list[Mapping[str, Array]] = []
        self._weight = 0  # of those that wait [bytes]
        self._stream = os.fdopen(os.open(path, os.O_RDWR | os.O_CREAT, 0o666), "r+b", buffering=0)

    def append(self, plain: dict[str, Any], arrays: Mapping[str, Array]) -> None:
        """Take up a row, whose arrays are not changed any more."""
        self.plain.append(plain)
        self._waiting.append(arrays)
        self._weight += sum(array.nbytes for array in arrays.values())
        if self._weight > _WAITING:
            self._write()

    def keep_first(self, rows: int) -> bool:
        """Cut away all but the first rows; whether these are there and whole. If not, nothing is cut."""
        plain, begins = [], [0]
        self._stream.seek(0)
        try:
            for _ in range(rows):
                plain.append(read_record(self._stream)[0])
                begins.append(self._stream.tell())
        except Damaged:
            return False
        self._stream.truncate(begins[-1])
        self.plain, self._begins = plain, begins
        self._waiting, self._weight = [], 0
        return True

    def array(self, row: int, name: str) -> Array:
        """Return an array of a row."""
        written = len(self._begins) - 1
        if row >= written:
            return self._waiting[row - written][name]
        self._stream.seek(self._begins[row])
        return read_record(self._stream, [name])[1][name]

    def sync(self) -> None:
        """Have all rows on the disk."""
        self._write()
        os.fsync(self._stream.fileno())

    def close(self) -> None:
        """Close the file; rows that were not written by then are lost."""
        self._stream.close()

    def _write(self) -> None:
        """Write the rows that wait; on a full disk those that do not fit wait on."""
        first = len(self._begins) - 1
        try:
            for row, arrays in enumerate(self._waiting, first):
                self._stream.seek(self._begins[-1])
                size = write_record(self._stream, self.plain[row], arrays)
                self._begins.append(self._begins[-1] + size)
        finally:
            del self._waiting[: len(self._begins) - 1 - first]
            self._weight = sum(array.nbytes for arrays in self._waiting for array in arrays.values())


class _Frames(BackendArray):
    """Field of some rows of a file, an array (rows, x, y) that xarray has not read yet."""

    dtype = np.dtype(float)

    def __init__(self, file: RowFile, name: str, rows: Sequence[int], shape: tuple[int, int]) -> None:
        self._file, self._name, self._rows = file, name, np.array(rows, int)
        self.shape = (len(rows), *shape)

    def __getitem__(self, key: Any) -> Any:
        return explicit_indexing_adapter(key, self.shape, IndexingSupport.BASIC, self._read)

    def _read(self, key: tuple[Any, ...]) -> Any:
        rows = self._rows[key[0]]
        if rows.ndim == 0:
            return self._file.array(int(rows), self._name)[key[1:]]
        read = np.empty((rows.size, *self.shape[1:]))
        for place, row in zip(read, rows, strict=True):
            place[...] = self._file.array(int(row), self._name)
        return read[(slice(None), *key[1:])]


def save_checkpoint(path: Path, reached: Checkpoint, key: str) -> None:
    """Write how far the case of that key has come, whole or not at all."""
    arrays: dict[str, Any] = {}
    plain = {"key": key, "revision": NUMERICS_REVISION, "result_format": RESULT_FORMAT, "layout": _LAYOUT}
    plain["reached"] = _flatten(reached, arrays, {})["parts"]
    with atomic_write(path) as temporary, open(temporary, "wb", buffering=0) as stream:
        write_record(stream, plain, arrays)


def load_checkpoint(path: Path, key: str) -> Checkpoint | None:
    """How far the case of that key has come; None if the file is absent, damaged, or of something else.

    Parameters
    ----------
    path : path
        Of the file.
    key : str
        Of the case.
    """
    try:
        with open(path, "rb", buffering=0) as stream:
            plain, arrays = read_record(stream)
        found = plain["key"], plain["revision"], plain["result_format"], plain["layout"]
        if found == (key, NUMERICS_REVISION, RESULT_FORMAT, _LAYOUT):
            kinds = {kind.__name__: kind for kind in (Checkpoint, *STATES)}
            reached = _unflatten({"type": "Checkpoint", "parts": plain["reached"]}, arrays, kinds)
    except FileNotFoundError:
        return None
    except (Damaged, OSError, KeyError, TypeError, ValueError) as error:
        log.warning("%s: is damaged and not used: %s", path, error)
        return None
    if found != (key, NUMERICS_REVISION, RESULT_FORMAT, _LAYOUT):
        log.warning("%s: belongs to another case or revision and is not used", path)
        return None
    return reached


def _flatten(value: Any, arrays: dict[str, Any], seen: dict[int, str]) -> Any:
    """A value as JSON knows it, its arrays put aside under names, the same array once."""
    if isinstance(value, np.ndarray):
        name = seen.setdefault(id(value), f"a{len(seen)}")
        arrays[name] = value
        return {"array": name}
    if is_dataclass(value):
        parts = {field.name: _flatten(getattr(value, field.name), arrays, seen) for field in fields(value)}
        return {"type": type(value).__name__, "parts": parts}
    if isinstance(value, tuple):
        return {"tuple": [_flatten(part, arrays, seen) for part in value]}
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"a checkpoint cannot hold a {type(value).__name__}")


def _unflatten(value: Any, arrays: dict[str, Any], kinds: Mapping[str, type]) -> Any:
    if not isinstance(value, dict):
        return value
    if "array" in value:
        return arrays[value["array"]]
    if "tuple" in value:
        return tuple(_unflatten(part, arrays, kinds) for part in value["tuple"])
    parts = value["parts"].items()
    return kinds[value["type"]](**{name: _unflatten(part, arrays, kinds) for name, part in parts})


class CheckpointWriter(Recorder):
    """Recorder of a run in a folder: rows in one file, checkpoints in two others.

    Parameters
    ----------
    folder : path
        Of this run alone; made if need be.
    key : str
        Of the case.
    seconds, steps : float, int or None
        A checkpoint is written after so long, but not so often that it would take a twentieth of the time; and after
        so many accepted steps.
    stop : callable or None
        Asked after every accepted step.
    """

    in_memory = False

    def __init__(
        self,
        folder: Path,
        key: str,
        *,
        seconds: float = 30.0,
        steps: int | None = None,
        stop: Callable[[], bool] | None = None,
    ) -> None:
        self._paths = [folder / "checkpoint.0", folder / "checkpoint.1"]
        folder.mkdir(exist_ok=True)
        self._rows = RowFile(folder / "rows")
        self.latest = Checkpoint()
        self._folder = folder
        self._key = key
        self._interval, self._steps, self._stop = seconds, steps, stop
        self._pending, self._last_save = 0, time.monotonic()

    @property
    def plain(self) -> list[dict[str, Any]]:  # type: ignore[override]
        """Values of the rows."""
        return self._rows.plain

    def append(self, plain: dict[str, Any], arrays: Mapping[str, Array]) -> None:
        """Record the values and the fields of a row; the arrays are not changed any more."""
        self._rows.append(plain, arrays)

    def field(self, name: str, rows: Sequence[int], shape: tuple[int, int]) -> Any:
        """Return a field of some rows, an array (rows, x, y) that is read when it is needed."""
        return LazilyIndexedArray(_Frames(self._rows, name, rows, shape))

    def resume(self) -> None:
        """Find out where to go on from: the last whole checkpoint whose rows are there; the start if there is none."""
        for leftover in self._folder.glob(".*"):
            leftover.unlink()
        read = [(load_checkpoint(path, self._key), path) for path in self._paths]
        found = [(reached, path) for reached, path in read if reached is not None]
        for reached, path in sorted(found, key=lambda pair: -pair[0].wall_time):
            here = reached.with_current_transforms()
            if self._rows.keep_first(reached.rows):
                log.info("%s: goes on from here", path)
                self.latest = here
                if path == self._paths[0]:
                    self._paths.reverse()
                return
            log.warning("%s: its rows are damaged; not used", path)
        for path in self._paths:
            path.unlink(missing_ok=True)
        self._rows.keep_first(0)

    def update(self, reached: Checkpoint) -> None:
        """Take note of an accepted step; write a checkpoint if it is time to.

        Raises
        ------
        KeyboardInterrupt
            If the run is to stop; a checkpoint has then been written.
        """
        self.latest = reached
        self._pending += 1
        if self._stop is not None and self._stop():
            self.save()
            raise KeyboardInterrupt
        due = time.monotonic() - self._last_save >= self._interval
        if due or (self._steps is not None and self._pending >= self._steps):
            self.save()

    def restart(self) -> None:
        """Forget all rows: the run begins anew."""
        for path in self._paths:
            path.unlink(missing_ok=True)
        self._rows.keep_first(0)
        self.latest, self._pending = Checkpoint(), 0

    def save(self) -> None:
        """Write a checkpoint, if anything has been computed since the last one."""
        if not self._pending:
            return
        began = time.monotonic()
        self._rows.sync()  # first: a checkpoint counts on its rows
        save_checkpoint(self._paths[0], self.latest, self._key)
        self._paths.reverse()
        self._pending, self._last_save = 0, time.monotonic()
        self._interval = max(self._interval, (self._last_save - began) / _SHARE)

    def remove(self) -> None:
        """Remove all that was kept: the result is written, or cannot be had."""
        self._rows.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def close(self) -> None:
        """Close the files; without a checkpoint nothing in them is of use."""
        self._rows.close()
        if not any(path.exists() for path in self._paths):
            self.remove()
