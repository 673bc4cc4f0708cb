"""Lock file of a run, with the process that holds it.

Where the file system's own locks reach every machine that is all there is to it: they end with the process. Where
they do not, the file's age tells: whoever holds it touches it every few seconds.
"""

from __future__ import annotations

import json
import os
import secrets
import socket
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from roughvisc.errors import InUseError
from roughvisc.study.storage.files import open_unlinked

try:
    import fcntl
except ImportError:  # Windows: the file's age alone
    fcntl = None  # type: ignore[assignment]

#: The holder touches its file so often, and is taken for dead when it has not for so long. [s]
BEAT, STALE = 10.0, 60.0
#: A process that was killed lets go of its lock when the system has cleared it away: so long is waited for that. [s]
_PATIENCE = 2.0


def lock_path(folder: Path, key: str) -> Path:
    """Lock of a case in a folder of results."""
    return folder / f".{key}.lock"


class Lock:
    """A lock that is held."""

    def __init__(self, path: Path, descriptor: int) -> None:
        self._path = path
        self._descriptor = descriptor
        self._mine = json.dumps({"host": socket.gethostname(), "pid": os.getpid(), "token": secrets.token_hex(8)})
        self._released = threading.Event()
        os.ftruncate(descriptor, 0)
        os.lseek(descriptor, 0, os.SEEK_SET)
        os.write(descriptor, self._mine.encode())
        threading.Thread(target=self._beat, name=f"heartbeat of {path.name}", daemon=True).start()

    def check(self) -> None:
        """Make sure that nobody took it over: this process may have been asleep for long.

        Raises
        ------
        InUseError
            If somebody did.
        """
        if self._found() != self._mine:
            raise InUseError(
                f"{self._path}: was taken over by another run while this one did not answer: expected to hold it; "
                "the other run goes on"
            )

    def release(self) -> None:
        """Give it up; the file goes."""
        self._released.set()
        if self._found() == self._mine:
            self._path.unlink(missing_ok=True)
        os.close(self._descriptor)

    def _found(self) -> str:
        try:
            return self._path.read_text()
        except OSError:
            return ""

    def _beat(self) -> None:
        while not self._released.wait(BEAT):
            try:
                os.utime(self._descriptor if os.utime in os.supports_fd else self._path)
            except OSError:  # taken over, or the folder is gone: check() says so
                return


@contextmanager
def lock_case(path: Path, patience: float = _PATIENCE) -> Iterator[Lock]:
    """Hold a lock.

    Parameters
    ----------
    path : path
        Its file, in a folder that exists. Every machine that shares the folder sees it.
    patience : float
        How long to wait for one that is held. [s]

    Raises
    ------
    InUseError
        If another run holds it.
    FolderError
        If a link stands in its place: what that leads to is not touched.
    """
    descriptor = _opened(path, patience)
    try:
        lock = Lock(path, descriptor)
    except OSError:  # a full disk
        path.unlink(missing_ok=True)
        os.close(descriptor)
        raise
    try:
        yield lock
    finally:
        lock.release()


def _opened(path: Path, patience: float) -> int:
    """Descriptor of the lock's file, locked."""
    until = time.monotonic() + patience
    while True:
        descriptor = open_unlinked(path, os.O_RDWR, "the lock of a run")
        try:
            alone = _locked(descriptor)
            if os.path.exists(path) and os.path.samestat(os.fstat(descriptor), os.lstat(path)):
                holder = _holder(descriptor)
                if alone is False and time.monotonic() < until:
                    time.sleep(0.05)
                elif alone is False or (holder and not _dead(path, holder, alone)):
                    who = f"process {holder['pid']} on {holder['host']}" if holder else "another run"
                    raise InUseError(
                        f"{path}: {who} is at work on this case in this folder: expected one run at a "
                        "time; wait for it, or use another folder"
                    )
                else:
                    return descriptor
        except FileNotFoundError:  # whoever held it has just finished
            pass
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)


def _locked(descriptor: int) -> bool | None:
    """Whether the file system's lock is had; None if it has none."""
    if fcntl is None:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def _holder(descriptor: int) -> dict[str, Any]:
    """Who holds it as the file says; empty if nobody."""
    os.lseek(descriptor, 0, os.SEEK_SET)
    try:
        holder = json.loads(os.read(descriptor, 4096))
        return {"host": str(holder["host"]), "pid": int(holder["pid"])}
    except (ValueError, KeyError, TypeError):
        return {}


def _dead(path: Path, holder: dict[str, Any], alone: bool | None) -> bool:
    """Whether the one that a file names is no longer at work."""
    if alone and holder["host"] == socket.gethostname():
        return True  # it would have the system's lock
    with tempfile.TemporaryFile(dir=path.parent) as now:  # by the clock of the file server, not of this machine
        age = os.fstat(now.fileno()).st_mtime - path.stat().st_mtime
    return abs(age) > STALE  # whoever holds it touches it: it is not of tomorrow either
