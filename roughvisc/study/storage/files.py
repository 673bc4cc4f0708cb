"""Files of a results folder, written whole or not at all."""

from __future__ import annotations

import logging
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from roughvisc.errors import InputError

log = logging.getLogger("roughvisc")

#: Files, as they were, and messages that were logged of them.
_warned: set[tuple[Path, tuple[int, ...], str]] = set()


def is_writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which need not exist yet."""
    return os.access(existing_part(folder), os.W_OK)


def require_writable(folder: Path, why: str = "") -> None:
    """Refuse a folder of results in which no file can be made.

    Raises
    ------
    InputError
        If there is none and none can be made, or it is not writable; with the reason that is given.
    """
    if not is_writable(folder):
        needed = f", {why}" if why else ""
        raise InputError(
            f"{existing_part(folder)}: is not writable: expected a folder with write permission{needed}", transient=True
        )


def require_folder(folder: Path) -> None:
    """Refuse what is no folder of results.

    Raises
    ------
    InputError
        If it is absent, or a file.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: {'is a file' if folder.exists() else 'does not exist'}: expected a results folder")


def require_file(path: Path) -> None:
    """Refuse what is no regular file that can be read, before anything opens it: a pipe would wait forever.

    Raises
    ------
    InputError
        If it is absent, a folder, a pipe or a device, or must not be read.
    """
    expected = "a result of roughvisc (.nc)"
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
    raise InputError(
        f"{path}: {found}: expected {expected}", key=str(path), found=found, expected=expected, transient=True
    )


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


def warn_once(path: Path, message: str) -> None:
    """Log a warning about a file, once per state of the file."""
    try:
        found = path.stat()
        stamp = (found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns)
    except OSError:
        stamp = ()
    if (path.absolute(), stamp, message) not in _warned:
        _warned.add((path.absolute(), stamp, message))
        log.warning("%s", message)
