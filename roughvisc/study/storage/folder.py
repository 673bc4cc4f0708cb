"""Folder of results: names, locks, and files that are written whole or not at all.

A case with the key ``K`` has the result ``K.nc``. While it is computed, ``.K.lock`` is locked and ``.K.unfinished``
holds its checkpoint. A file that is being written has a hidden name that ends in ``.part`` and its suffix. A damaged
result is renamed to ``K.nc.damaged``.
"""

from __future__ import annotations

import errno
import gzip
import json
import logging
import os
import secrets
import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from roughvisc.errors import InputError

log = logging.getLogger("roughvisc")

#: Errors of :func:`read_json`, and of finding other values than were written.
DAMAGED = (OSError, EOFError, ValueError, LookupError, TypeError, AttributeError, RecursionError, zlib.error)
#: The lock of a killed process is free when the system has removed the process. [s]
_PATIENCE = 2.0


def result_path(folder: Path, name: str) -> Path:
    """File of a result in a folder; that of a case is named by its key."""
    return folder / f"{name}.nc"


def lock_path(folder: Path, key: str) -> Path:
    """Lock of a case in a folder."""
    return folder / f".{key}.lock"


def checkpoint_path(folder: Path, key: str) -> Path:
    """Folder with the checkpoint of a case in a folder."""
    return folder / f".{key}.unfinished"


def result_files(folder: Path) -> list[Path]:
    """Files of a folder that may be results, by name; none that is being written."""
    return sorted(path for path in folder.glob("*.nc") if not path.name.startswith("."))


def no_results(folder: Path) -> InputError:
    """Return the error of a folder without a result."""
    return InputError(f"{folder}: holds no results: expected files .nc, as roughvisc run writes them")


def results_at(place: Path) -> list[Path]:
    """Files that may be results: those of a folder, at least one; or the file itself, which need not exist.

    Raises
    ------
    InputError
        If the folder holds none.
    """
    paths = result_files(place) if place.is_dir() else [place]
    if not paths:
        raise no_results(place)
    return paths


def existing_part(folder: Path) -> Path:
    """A folder, or the nearest one above it that exists."""
    return next(place for place in (folder, *folder.absolute().parents) if place.exists())


def is_writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which need not exist yet."""
    return os.access(existing_part(folder), os.W_OK)


def require_writable(folder: Path, why: str = "") -> None:
    """Refuse a folder in which no file can be made.

    Raises
    ------
    InputError
        If neither the folder nor a file in it can be made; with the reason for which it is needed.
    """
    if not is_writable(folder):
        needed = f", {why}" if why else ""
        raise InputError(
            f"{existing_part(folder)}: is not writable: expected a folder with write permission{needed}", transient=True
        )


def require_folder(folder: Path) -> None:
    """Refuse a folder that is absent, or a file.

    Raises
    ------
    InputError
        If it is.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: {'is a file' if folder.exists() else 'does not exist'}: expected a results folder")


def require_file(path: Path) -> None:
    """Refuse everything but a regular file that can be read: opening a pipe would wait forever.

    Raises
    ------
    InputError
        If it is absent, a folder, a pipe or a device, or must not be read.
    """
    try:
        mode = path.stat().st_mode
        if stat.S_ISREG(mode):
            path.open("rb").close()
            return
        found = "is a folder" if stat.S_ISDIR(mode) else "is no regular file"
    except FileNotFoundError:
        found = "does not exist"
    except OSError as error:
        found = f"cannot be read: {error.strerror or error}"
    expected = "a result of roughvisc (.nc)"
    raise InputError(
        f"{path}: {found}: expected {expected}", key=str(path), found=found, expected=expected, transient=True
    )


@contextmanager
def atomic_write(path: str | Path) -> Iterator[Path]:
    """Yield a temporary name; the file becomes `path` if the block succeeds and is removed if it fails.

    Parameters
    ----------
    path : path
        The file to be. Its folder is made if need be.

    Yields
    ------
    Path
        Name in the same folder, with the same suffix.

    Raises
    ------
    InputError
        If the folder cannot be made or written to.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        text = f"{path.parent}: cannot be made: {error.strerror or error}: expected a folder"
        raise InputError(text, transient=True) from error
    require_writable(path.parent)
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(4)}.part{path.suffix}")
    try:
        yield temporary
        _sync(temporary)
        os.replace(temporary, path)
        with suppress(PermissionError):  # Windows opens no folder
            _sync(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> Path:
    """Write a text to a file, completely or not at all."""
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def _sync(path: Path) -> None:
    """Have the operating system put a file, or the names in a folder, on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def partial_files(path: Path) -> list[Path]:
    """Return what interrupted writes of a result have left next to it."""
    return list(path.parent.glob(f".{path.stem}.*.part{path.suffix}"))


def write_json(path: Path, value: Any) -> None:
    """Write a compressed JSON file, which has a checksum; if that is impossible, the file is not changed."""
    with suppress(OSError, InputError), atomic_write(path) as temporary:
        temporary.write_bytes(gzip.compress(json.dumps(value).encode(), compresslevel=1, mtime=0))


def read_json(path: Path) -> Any:
    """Read the value of a compressed JSON file; one of :data:`DAMAGED` is raised if that is impossible."""
    return json.loads(gzip.decompress(path.read_bytes()))


@cache
def warn_once(message: str) -> None:
    """Log a warning, once in a process."""
    log.warning("%s", message)


@contextmanager
def lock_case(path: Path, patience: float = _PATIENCE) -> Iterator[None]:
    """Hold the lock of a case; it ends with the process, however the process ends.

    Parameters
    ----------
    path : path
        File of the lock, in a folder that exists. Every machine that shares the folder sees it.
    patience : float
        Time to wait for another process. [s]

    Raises
    ------
    BlockingIOError
        If another run holds it.
    """
    lock = FileLock(path)
    try:
        lock.acquire(timeout=patience)
    except Timeout as error:
        raise BlockingIOError(
            errno.EWOULDBLOCK,
            "another run is at work on this case in this folder: expected one run at a time; wait for it, or use "
            "another folder",
            str(path),
        ) from error
    try:
        yield
    finally:
        with suppress(OSError):  # before the release: a waiting run that has opened this file opens a new one
            path.unlink()
        lock.release()
