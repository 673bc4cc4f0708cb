"""Files of a results folder: written whole or not at all, never through a link, and with a checksum behind the content.

The folder itself may be a link. Results may be links, too: they are read, and a link whose name is written to gives way
to the file, by a rename (:func:`atomic_write`), which touches nothing else.
"""

from __future__ import annotations

import logging
import os
import secrets
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

from roughvisc.errors import FolderError, InputError

log = logging.getLogger("roughvisc")

#: What is wrong with a result that has no checksum.
UNSEALED = (
    "has no checksum: another program has changed it, or an early version of roughvisc has written it; "
    "whether its values are those that were computed cannot be said"
)
#: Files, as they were, and messages that were logged of them.
_warned: set[tuple[Path, tuple[int, ...], str]] = set()

# At 256 x 256 x 50 frames, two fields, 59 MB: written in 75 ms, sealed in 15 ms, looked at in 15 ms. SHA-256 would take
# 37 ms each. A checksum a chunk (fletcher32) would take 30 ms each, and leave out attributes, small variables and the
# index of the chunks, where a wrong bit turns values into zeros that no checksum knows of.
_SEAL = struct.Struct("<8sQII")  # mark, length and checksum of the content, checksum of these
_MARK = b"rvseal1\n"
_AT_ONCE = 1 << 20
_HDF5 = b"\x89HDF\r\n\x1a\n"
#: Version of an HDF5 superblock -> where it states the end of the content.
_END_STATED = {0: 40, 1: 44, 2: 28, 3: 28}


def refuse_link(path: Path, expected: str) -> None:
    """Refuse a link in place of a file or folder that a run writes to, or deletes from.

    Parameters
    ----------
    path : Path
        The file or folder, which need not exist.
    expected : str
        What it should be.

    Raises
    ------
    FolderError
        If it is a link.
    """
    if path.is_symlink():
        raise FolderError(f"{path}: is a link: expected {expected}, or nothing; remove it, and what it leads to stays")


def open_unlinked(path: str | Path, flags: int, expected: str) -> int:
    """Descriptor of a file that is made if need be, and that is no link.

    Parameters
    ----------
    path : path
        The file.
    flags : int
        As :func:`os.open` takes them.
    expected : str
        What the file should be.

    Raises
    ------
    FolderError
        If it is a link.
    OSError
        If it cannot be opened, or became a link just now.
    """
    refuse_link(Path(path), expected)
    return os.open(path, flags | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)


def is_writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which need not exist yet."""
    return os.access(existing_part(folder), os.W_OK)


def require_writable(folder: Path, why: str = "") -> None:
    """Refuse a folder of results in which no file can be made.

    Raises
    ------
    FolderError
        If there is none and none can be made, or it is not writable; with the reason that is given.
    """
    if not is_writable(folder):
        needed = f", {why}" if why else ""
        raise FolderError(f"{existing_part(folder)}: is not writable: expected a folder with write permission{needed}")


def require_folder(folder: Path) -> None:
    """Refuse what is no folder of results.

    Raises
    ------
    InputError
        If it is absent, or a file.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: {'is a file' if folder.exists() else 'does not exist'}: expected a results folder")


def existing_part(folder: Path) -> Path:
    """A folder, or what is there of the folders above it."""
    return next(place for place in (folder, *folder.absolute().parents) if place.exists())


def partial_files(path: Path) -> list[Path]:
    """What writes of a result that did not end have left beside it."""
    return list(path.parent.glob(f".{path.stem}.*.part{path.suffix}"))


@contextmanager
def atomic_write(path: str | Path) -> Iterator[Path]:
    """A name to write to, that becomes `path` when all has gone well and vanishes when it has not.

    Parameters
    ----------
    path : path
        The file to be. Its folder is made if need be.

    Yields
    ------
    Path
        A temporary name in the same folder, with the same suffix.

    Raises
    ------
    FolderError
        If the folder cannot be made or written to.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FolderError(f"{path.parent}: cannot be made: {error.strerror or error}: expected a folder") from error
    if not os.access(path.parent, os.W_OK):
        raise FolderError(f"{path.parent}: is not writable: expected a folder with write permission")
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(4)}.part{path.suffix}")
    try:
        yield temporary
        _sync(temporary)
        os.replace(temporary, path)
        _sync(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Have the operating system put a file, or the names in a folder, on the disk."""
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:  # a folder, on Windows
        if path.is_dir():
            return
        raise
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def pack_with_checksum(layout: struct.Struct, *values: Any) -> bytes:
    """Some values and, in the last four bytes of their layout, a checksum of these."""
    head = layout.pack(*values, 0)[:-4]
    return head + zlib.crc32(head).to_bytes(4, "little")


def unpack_with_checksum(layout: struct.Struct, found: bytes) -> tuple[Any, ...] | None:
    """The values; None if these bytes are not what was packed."""
    if len(found) < layout.size or zlib.crc32(found[:-4]) != int.from_bytes(found[-4:], "little"):
        return None
    return layout.unpack(found)[:-1]


def append_checksum(path: Path) -> None:
    """Put a seal behind the content of a file that is written."""
    with open(path, "rb+") as stream:
        length = os.fstat(stream.fileno()).st_size
        seal = pack_with_checksum(_SEAL, _MARK, length, _checksum(stream, length))
        stream.seek(length)
        stream.write(seal)


def unsealed(path: Path) -> bytes | None:
    """Content of a small sealed file; None if it is not as it was written."""
    content = path.read_bytes()
    sealed = _read_seal(content[-_SEAL.size :])
    content = content[: -_SEAL.size]
    return content if sealed == (len(content), zlib.crc32(content)) else None


def checksum_error(path: Path, *, again: bool = False) -> str:
    """What is wrong with the bytes of a file of HDF5; empty if nothing, or if the file has no seal.

    Files of earlier versions have none, and one that another program has changed has lost it.

    Parameters
    ----------
    path : path
        A file that exists.
    again : bool
        Read it even if this process has done so and it looks unchanged since.
    """
    if again:
        _examined.cache_clear()
    return _examined(path.absolute(), _stamp(path))[0]


def is_sealed(path: Path) -> bool:
    """Whether a file ends with a seal, whatever that says."""
    return _examined(path.absolute(), _stamp(path))[1]


def _stamp(path: Path) -> tuple[int, ...]:
    """What changes when somebody writes to a file."""
    found = path.stat()
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


@lru_cache(maxsize=4096)
def _examined(path: Path, stamp: tuple[int, ...]) -> tuple[str, bool]:
    """What is wrong with the bytes of a file, and whether it ends with a seal."""
    with open(path, "rb") as stream:
        size = os.fstat(stream.fileno()).st_size
        head = stream.read(52)
        stream.seek(max(size - _SEAL.size, 0))
        sealed = _read_seal(stream.read(_SEAL.size))
        if sealed is None:  # where the content ends as the first bytes of HDF5 say, if they do
            at = _END_STATED.get(head[8]) if len(head) == 52 and head.startswith(_HDF5) else None
            cut = at is not None and size > int.from_bytes(head[at : at + 8], "little")
            return "its last bytes are not those that were written" if cut else "", False
        length, checksum = sealed
        if length != size - _SEAL.size:
            return f"it holds {size - _SEAL.size} bytes where {length} were written", True
        stream.seek(0)
        whole = _checksum(stream, length) == checksum
        return "" if whole else "its bytes are not those that were written", True


def _read_seal(found: bytes) -> tuple[int, int] | None:
    """Length and checksum that a seal states; None if these bytes are none."""
    mark, *stated = unpack_with_checksum(_SEAL, found) or (None,)
    return (stated[0], stated[1]) if mark == _MARK else None


def _checksum(stream: IO[bytes], length: int) -> int:
    checksum = 0
    while length and (part := stream.read(min(length, _AT_ONCE))):
        checksum = zlib.crc32(part, checksum)
        length -= len(part)
    return checksum


def verify_checksum(path: Path) -> bool:
    """Refuse a result whose bytes are not those that were written; warn of one that nothing can be said of.

    Every read asks this, since a file may be damaged after it was opened. Once a process has looked at a file, and as
    long as the system says that nobody has written to it, that costs next to nothing.

    Returns
    -------
    bool
        Whether the result has a checksum, which it then matches.
    """
    try:
        found, sealed = checksum_error(path), is_sealed(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}: expected a result") from error
    if found:
        raise InputError(f"{path}: is damaged: {found}: repeat the run to compute it again")
    if not sealed:
        warn_once(path, f"{path}: {UNSEALED}")
    return sealed


def warn_once(path: Path, message: str) -> None:
    """Log a warning about a file, once as long as the file is as it is."""
    if is_news(path, message):
        log.warning("%s", message)


def is_news(path: Path, message: str) -> bool:
    """Whether nothing has said this of the file as it is now; from now on something has."""
    try:
        stamp = _stamp(path)
    except OSError:
        stamp = ()
    before = len(_warned)
    _warned.add((path.absolute(), stamp, message))
    return len(_warned) > before
