"""Log of the sweeps of a folder: what roughvisc logs while they run, and messages that are too long for the screen."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from roughvisc.errors import FolderError
from roughvisc.study.storage.links import open_unlinked

log = logging.getLogger("roughvisc")

LOG = "sweep.log"


def append(folder: Path, message: str) -> Path | None:
    """Write a message to the log of a folder; the log's path, None if there is no such folder or it cannot be written.

    Parameters
    ----------
    folder : Path
        Of results; not made.
    message : str
        What is logged as an error.
    """
    path = folder / LOG
    if not folder.is_dir():
        return None
    record = logging.LogRecord("roughvisc", logging.ERROR, "", 0, message, None, None)
    try:
        with os.fdopen(
            _opened(str(path), os.O_WRONLY | os.O_APPEND), "a", encoding="utf-8", errors="backslashreplace"
        ) as stream:
            stream.write(f"{_formatter().format(record)}\n")
    except (OSError, FolderError):
        return None
    return path


def _formatter() -> logging.Formatter:
    return logging.Formatter(f"%(asctime)s {os.getpid()} %(levelname)s %(message)s")


def _opened(path: str, flags: int) -> int:
    return open_unlinked(path, flags, "the log of a sweep")


@contextmanager
def log_file(folder: Path) -> Iterator[None]:
    """Everything that roughvisc logs, appended to a file beside the results."""
    handler = _LogFile(folder / LOG, delay=True, encoding="utf-8")
    handler.setFormatter(_formatter())
    level = log.level
    log.addHandler(handler)
    log.setLevel(min(level or logging.INFO, logging.INFO))
    try:
        yield
    finally:
        log.setLevel(level)
        log.removeHandler(handler)
        with suppress(OSError):
            handler.close()


class _LogFile(logging.FileHandler):
    """A log that stops nothing where it cannot be written, and follows no link."""

    def _open(self) -> TextIO:
        return open(self.baseFilename, self.mode, encoding=self.encoding, opener=_opened)

    def emit(self, record: logging.LogRecord) -> None:
        with suppress(OSError, FolderError):  # it cannot be opened
            super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:
        pass
