"""Lock of a case: one run at a time works on it in a folder."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

#: The lock of a killed process is free when the system has cleared the process away: wait so long. [s]
_PATIENCE = 2.0


def lock_path(folder: Path, key: str) -> Path:
    """Lock of a case in a folder of results."""
    return folder / f".{key}.lock"


@contextmanager
def lock_case(path: Path, patience: float = _PATIENCE) -> Iterator[None]:
    """Hold a lock; it ends with the process, however that ends.

    Parameters
    ----------
    path : path
        Its file, in a folder that exists. Every machine that shares the folder sees it.
    patience : float
        How long to wait for a lock that is held. [s]

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
