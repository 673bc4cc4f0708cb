"""Record files of unfinished runs: plain values and arrays with checksums.

A file of records is only ever appended to, and whoever reads it knows how many to expect: what was torn off or
written beyond that is cut away. So it survives what kills a process, a machine or a disk's free space.
"""

from __future__ import annotations

import json
import math
import os
import struct
import zlib
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.recorder import Frame
from roughvisc.study.storage.links import open_unlinked

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


class Damaged(Exception):
    """What is on the disk is not what was written."""


def write_record(stream: IO[bytes], plain: Any, arrays: Mapping[str, Array]) -> int:
    """Write plain values, as JSON knows them, and arrays; give the number of bytes.

    The stream must not be buffered: a full disk is then found here and nowhere else.
    """
    payload = {name: _packed(array) for name, array in arrays.items()}
    listed = [[name, a.dtype.str, a.shape, len(payload[name]), zlib.crc32(payload[name])] for name, a in arrays.items()]
    text = json.dumps([plain, listed]).encode()  # the shortest text that gives a float back exactly
    head = _HEAD.pack(_MARK, len(text), zlib.crc32(text), 0)[:-4]
    written = 0
    for part in (head + zlib.crc32(head).to_bytes(4, "little") + text, *payload.values()):
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
    mark, length, checksum, own = _HEAD.unpack(head)
    if mark != _MARK or zlib.crc32(head[:-4]) != own:
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
    check : callable
        Called before anything is written.
    """

    def __init__(self, path: Path, check: Callable[[], None]) -> None:
        self._check = check
        self.plain: list[dict[str, Any]] = []
        self._begins = [0]  # of the rows in the file, and where the next is to begin
        self._waiting: list[Mapping[str, Array]] = []
        self._weight = 0  # of those that wait [bytes]
        self._stream = os.fdopen(open_unlinked(path, os.O_RDWR, "rows of a run"), "r+b", buffering=0)

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
        self._check()
        self._stream.truncate(begins[-1])
        self.plain, self._begins = plain, begins
        self._waiting, self._weight = [], 0
        return True

    def arrays(self, row: int, *names: str) -> Mapping[str, Array]:
        """Arrays of a row, those of these names at least."""
        written = len(self._begins) - 1
        if row >= written:
            return self._waiting[row - written]
        self._stream.seek(self._begins[row])
        return read_record(self._stream, names)[1]

    def stacked(self, frame: Frame, rows: Sequence[int], shape: tuple[int, int]) -> Any:
        """The frames of some rows, read when they are asked for."""
        from xarray.core.indexing import LazilyIndexedArray

        return LazilyIndexedArray(_frames((len(rows), *shape), lambda number, out: frame(rows[number], out)))

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
            if self._waiting:
                self._check()
            for row, arrays in enumerate(self._waiting, first):
                self._stream.seek(self._begins[-1])
                size = write_record(self._stream, self.plain[row], arrays)
                self._begins.append(self._begins[-1] + size)
        finally:
            del self._waiting[: len(self._begins) - 1 - first]
            self._weight = sum(array.nbytes for arrays in self._waiting for array in arrays.values())


def _frames(whole: tuple[int, ...], frame: Frame) -> Any:
    """What xarray takes for an array (time, x, y) that it has not read yet."""
    from xarray.backends import BackendArray
    from xarray.core.indexing import IndexingSupport, explicit_indexing_adapter

    class Frames(BackendArray):
        shape, dtype = whole, np.dtype(float)

        def __getitem__(self, key: Any) -> Any:
            return explicit_indexing_adapter(key, whole, IndexingSupport.BASIC, self.read)

        def read(self, key: tuple[Any, ...]) -> Any:
            rows = np.arange(whole[0])[key[0]]
            if rows.ndim == 0:
                return frame(int(rows), np.zeros(whole[1:]))[key[1:]]
            read = np.zeros((rows.size, *whole[1:]))
            for place, row in zip(read, rows, strict=True):
                frame(int(row), place)
            return read[(slice(None), *key[1:])]

    return Frames()
