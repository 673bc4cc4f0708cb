"""Paths as arguments; reading of regular files, with one sentence for a file that cannot be read; atomic writing."""

from __future__ import annotations

import errno
import os
import secrets
import shlex
import stat
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader
from pathlib import Path
from typing import Any

from roughvisc.errors import InputError


def path_of(value: Any, key: str, what: str = "a file or a folder") -> Path:
    """Return an argument as a path; refuse an empty text, which would mean the current folder.

    Parameters
    ----------
    value : str or path-like
        The argument.
    key : str
        Its name.
    what : str
        Description of the file or folder, for the message.

    Raises
    ------
    InputError
        If the value is empty or not a path, such as a Dataset.
    """
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(text, str) or not text:
        found = value if isinstance(value, str) else type(value).__name__
        raise InputError(key=key, found=found, expected=f"the path of {what}, such as '.' for this folder")
    return Path(value)


def shell_word(path: Path) -> str:
    """Return a path as one word of a command for the shell, which does not begin like an option.

    Examples
    --------
    >>> shell_word(Path("my scan.toml")), shell_word(Path("-5um.toml")), shell_word(Path("scan.toml"))
    ("'my scan.toml'", './-5um.toml', 'scan.toml')
    """
    text = f".{os.sep}{path}" if str(path).startswith("-") else str(path)
    return subprocess.list2cmdline([text]) if os.name == "nt" else shlex.quote(text)


def regular(path: Path, expected: str = "a file") -> None:
    """Refuse a path that is not a regular file, because reading a pipe or a device may never end.

    Parameters
    ----------
    path : Path
        File to open.
    expected : str
        Description of the file, for the message.

    Raises
    ------
    InputError
        If the file is absent, a folder, a pipe, a device or a link to an absent file.
    """
    if flaw := flaw_of(path):
        raise unreadable(path, flaw, expected)


def unreadable(path: Path, cause: str, expected: str) -> InputError:
    """Return the error of a file that cannot be read. It is transient, because the file may be replaced."""
    return InputError(f"{path}: {cause}: expected {expected}", found=str(path), expected=expected, transient=True)


def flaw_of(path: Path) -> str:
    """Return why a path is not a regular file, in words; empty for a regular file."""
    try:
        mode = os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return "is a link to a file that does not exist" if os.path.islink(path) else "does not exist"
    except (OSError, ValueError) as error:  # such as a null character
        return cause_of_system(error) or f"cannot be the name of a file ({error})"
    if stat.S_ISREG(mode):
        return ""
    return "is a folder" if stat.S_ISDIR(mode) else "is a device or a pipe"


@contextmanager
def opened(path: Path, expected: str = "a file") -> Iterator[BufferedReader]:
    """Open a regular file for reading.

    Raises
    ------
    InputError
        As :func:`regular`, or if the system cannot open or read the file.
    """
    regular(path, expected)
    try:
        with path.open("rb") as stream:
            yield stream
    except OSError as error:
        if cause := cause_of_system(error):
            raise unreadable(path, cause, expected) from error
        raise


def read_bytes(path: Path, expected: str = "a file") -> bytes:
    """Return the content of a regular file; errors as for :func:`opened`."""
    with opened(path, expected) as stream:
        return stream.read()


def cause_of_system(error: BaseException) -> str:
    """Return why the system could not read a file, in words; empty if the content of the file is the cause.

    Examples
    --------
    >>> cause_of_system(PermissionError(13, "Permission denied")), cause_of_system(OSError(-101, "NetCDF: HDF error"))
    ('cannot be read: Permission denied', '')
    """
    if isinstance(error, UnicodeEncodeError):  # only names are encoded when a file is read
        return "has letters that the locale of this process lacks (LC_ALL=C.UTF-8 has all)"
    # libraries have negative numbers; a damaged header may lead to a position before the first byte, which is EINVAL
    if isinstance(error, OSError) and (error.errno or 0) > 0 and error.errno != errno.EINVAL:
        return f"cannot be read: {error.strerror or error}"
    return ""


def existing_part(folder: Path) -> Path:
    """Return the folder, or its nearest parent that exists."""
    return next(filter(Path.exists, (folder, *folder.absolute().parents)))


def require_writable(folder: Path, why: str = "") -> None:
    """Refuse a folder in which files cannot be created.

    Raises
    ------
    InputError
        If neither the folder nor a file in it can be created; the message includes the purpose `why`.
    """
    if not os.access(there := existing_part(folder), os.W_OK):
        needed = f", {why}" if why else ""
        text = f"{there}: is not writable: expected a folder with write permission{needed}"
        raise InputError(text, transient=True)


@contextmanager
def atomic_write(path: str | Path) -> Iterator[Path]:
    """Yield a temporary name; the file becomes `path` if the block succeeds and is removed if it fails.

    Parameters
    ----------
    path : path
        Final path of the file. Its folder is created if necessary.

    Yields
    ------
    Path
        Name in the same folder, with the same suffix.

    Raises
    ------
    InputError
        If the path is a folder, a pipe or a device, or its folder cannot be created or written to.
    """
    path = path_of(path, "path")
    if os.path.exists(path) and (flaw := flaw_of(path)):  # a rename would remove a device, and fails on a folder
        raise InputError(f"{path}: {flaw}: expected a file to replace, or another name", transient=True)
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
        with suppress(PermissionError):  # Windows cannot open a folder
            _sync(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> Path:
    """Write a text to a file atomically."""
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="surrogateescape")  # as in the names of files
    return path


def _sync(path: Path) -> None:
    """Flush a file, or the directory entries of a folder, to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
