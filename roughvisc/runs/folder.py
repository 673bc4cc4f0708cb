"""Folder of results: names, locks, atomic writing, records of failures, the log of sweeps, leftovers of killed runs.

A case with the key ``K`` has the result ``K.nc``. During its run ``.K.lock`` is locked and ``.K.unfinished`` contains
its checkpoint. The record of a failed case is ``K.failed.json``. During writing, a file has a hidden name that ends in
``.part`` and its suffix. A damaged result is renamed to ``K.nc.damaged``.
"""

from __future__ import annotations

import errno
import gzip
import json
import logging
import os
import re
import shutil
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Literal

from filelock import FileLock, Timeout

from roughvisc.errors import InputError
from roughvisc.paths import atomic_write as atomic_write
from roughvisc.paths import existing_part as existing_part
from roughvisc.paths import flaw_of, path_of, read_bytes, regular
from roughvisc.paths import require_writable as require_writable
from roughvisc.paths import write_text as write_text
from roughvisc.study.case import Case

log = logging.getLogger("roughvisc")

#: Log of the sweeps in a folder.
LOG = "sweep.log"
#: Names of the files of a case.
_NAMES = {"result": "{}.nc", "lock": ".{}.lock", "checkpoint": ".{}.unfinished", "failure": "{}.failed.json"}
#: Pattern of a key, and of the hidden files of a case: its lock, its checkpoint, and incomplete files.
KEY = "[0-9a-f]" * 16
_OF_A_CASE = re.compile(rf"\.({KEY})\.")
#: State of an unfinished case, in the folder of its checkpoint.
STATE = "state.npz"
#: Age of an incomplete file that belongs to no case, above which the file counts as a leftover. [s]
_ABANDONED = 3600.0
#: Errors of :func:`read_json`, and errors due to unexpected values in the file.
DAMAGED = (OSError, EOFError, ValueError, LookupError, TypeError, AttributeError, RecursionError, zlib.error)
#: Time to wait for a lock: the lock of a killed process is free when the system has removed the process. [s]
_PATIENCE = 2.0


def case_path(folder: Path, key: str, what: Literal["result", "lock", "checkpoint", "failure"]) -> Path:
    """Return the path of a file of a case in a folder; its checkpoint is a folder."""
    return folder / _NAMES[what].format(key)


def result_files(folder: Path) -> list[Path]:
    """Return the files of a folder that may be results, sorted by name, without incomplete files."""
    return sorted(path for path in folder.glob("*.nc") if not path.name.startswith((".", "heights-")))


def no_results(folder: Path) -> InputError:
    """Return the error of a path that is not a folder with results."""
    state = "holds no results" if folder.is_dir() else "is a file" if folder.exists() else "does not exist"
    return InputError(f"{folder}: {state}: expected a folder with results (.nc), as roughvisc run writes them")


def results_at(place: Path) -> list[Path]:
    """Return the files of a folder that may be results, or the file itself, which may be absent.

    Raises
    ------
    InputError
        If the folder contains none.
    """
    paths = result_files(place) if place.is_dir() else [place]
    if not paths:
        raise no_results(place)
    return paths


def unusable(path: Path, found: str, expected: str = "a result of roughvisc (.nc)") -> InputError:
    """Return the error of an unexpected file. It is transient, because the file may be replaced."""
    text = f"{path}: {found}: expected {expected}"
    return InputError(text, key=str(path), found=found, expected=expected, transient=True)


def require_result(path: Path) -> None:
    """Refuse a path that is not a regular file; the key of the error is the path."""
    if flaw := flaw_of(path):
        raise unusable(path, flaw)


def write_json(path: Path, value: Any, default: Callable[[Any], Any] | None = None) -> None:
    """Write a compressed JSON file with a checksum; if writing fails, an existing file is not changed.

    `default` returns the JSON of any other object.
    """
    with suppress(OSError, InputError), atomic_write(path) as temporary:
        text = json.dumps(value, default=default).encode()
        temporary.write_bytes(gzip.compress(text, compresslevel=1, mtime=0))


def read_json(path: Path) -> Any:
    """Return the value of a compressed JSON file; raise one of :data:`DAMAGED` if it is damaged."""
    return json.loads(gzip.decompress(read_bytes(path)))


@contextmanager
def lock_case(path: Path, patience: float = _PATIENCE) -> Iterator[None]:
    """Hold the lock of a case during the block; the system releases it if the process ends in any way.

    Parameters
    ----------
    path : path
        File of the lock, in an existing folder. The lock is valid on all machines that share the folder.
    patience : float
        Time to wait for another process. [s]

    Raises
    ------
    BlockingIOError
        If another run holds the lock.
    """
    lock = FileLock(path)
    try:
        lock.acquire(timeout=patience)
    except Timeout as error:
        text = "another run is at work on this case in this folder: wait for it, or use another folder"
        raise BlockingIOError(errno.EWOULDBLOCK, text, str(path)) from error
    try:
        yield
    finally:
        with suppress(OSError):  # before the release, so that a run that waits for this file opens a new one
            path.unlink()
        lock.release()


def record_failure(folder: Path, case: Case, **what: str) -> None:
    """Write the record of a failed case: its message, error and traceback, and the case."""
    record = what | {"case": json.loads(case.to_json(folder))}
    write_text(case_path(folder, case.key, "failure"), json.dumps(record, indent=1))


def recorded_failure(folder: Path, key: str) -> dict[str, Any]:
    """Return the record of a failed case; empty without a readable record."""
    try:
        return dict(json.loads(read_bytes(case_path(folder, key, "failure"))))
    except (ValueError, TypeError):
        return {}


class _LogFile(logging.FileHandler):
    def handleError(self, record: logging.LogRecord) -> None:
        """Ignore messages that cannot be written, for example on a full disk."""


@contextmanager
def log_file(folder: Path) -> Iterator[None]:
    """Append all log messages of roughvisc to a file next to the results, within the block."""
    path = folder / LOG
    if os.path.lexists(path):
        regular(path, "a file for the log")
    level = log.level
    handler = _LogFile(path, encoding="utf-8", errors="backslashreplace")
    handler.setFormatter(logging.Formatter(f"%(asctime)s {os.getpid()} %(levelname)s %(message)s"))
    log.addHandler(handler)
    log.setLevel(min(level or logging.INFO, logging.INFO))
    try:
        yield
    finally:
        log.setLevel(level)
        log.removeHandler(handler)
        with suppress(OSError):
            handler.close()


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
    folder = path_of(folder, "folder")
    if not folder.is_dir():
        raise no_results(folder)
    removed: list[Path] = []

    def remove(path: Path) -> None:
        with suppress(OSError):  # removed in the meantime, or the folder is not writable
            shutil.rmtree(path) if path.is_dir() else path.unlink()
            removed.append(path)

    keys: dict[str, None] = {}
    for path in sorted(folder.iterdir()):
        if match := _OF_A_CASE.match(path.name):
            keys[match[1]] = None
        elif path.match(".*.part*"):
            with suppress(OSError):
                if time.time() - path.stat().st_mtime > _ABANDONED:
                    remove(path)
        elif everything and (path.match("*.nc.damaged") or path.match("*.failed.json")):
            remove(path)
    for key in keys:
        lock = case_path(folder, key, "lock")
        checkpoint = case_path(folder, key, "checkpoint")
        with suppress(OSError), lock_case(lock, patience=0.0):  # which also removes the lock
            resumes = (checkpoint / STATE).exists() and not case_path(folder, key, "result").exists()
            for path in sorted(folder.glob(f".{key}.*")):
                if path != lock and (everything or path != checkpoint or not resumes):
                    remove(path)
    return removed
