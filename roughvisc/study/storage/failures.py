"""Failures in a folder: records of failed cases, and the log of its sweeps."""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from roughvisc.errors import InputError
from roughvisc.study.case import Case, program
from roughvisc.study.storage.folder import write_text

log = logging.getLogger("roughvisc")

LOG = "sweep.log"


def record_path(folder: Path, key: str) -> Path:
    """Return the path of the record of a failed case."""
    return folder / f"{key}.failed.json"


def record_failure(folder: Path, case: Case, message: str, error: str, trace: str) -> None:
    """Write the record of a failed case, which is named by the key of the case.

    Parameters
    ----------
    folder : Path
        Results folder.
    case : Case
        The case.
    message, error, trace : str
        Message to the user, class name of the exception, and traceback of an unexpected exception.
    """
    record = {
        "case_key": case.key,
        "message": message,
        "error": error,
        "traceback": trace,
        "time": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "source": program(),
        "case": json.loads(case.to_json()),
    }
    path = record_path(folder, case.key)
    try:
        write_text(path, json.dumps(record, indent=1))
    except (OSError, InputError) as problem:
        log.warning("%s cannot be written: %s", path, problem)


def recorded_failure(folder: Path, key: str) -> dict[str, Any]:
    """Return the record of a failed case; empty without a readable record."""
    try:
        return dict(json.loads(record_path(folder, key).read_text()))
    except (OSError, ValueError, TypeError):
        return {}


class _LogFile(logging.FileHandler):
    """Log file whose errors are ignored if it cannot be written."""

    def emit(self, record: logging.LogRecord) -> None:
        with suppress(OSError):  # the file cannot be opened
            super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:
        pass


@contextmanager
def log_file(folder: Path) -> Iterator[None]:
    """Append all log messages of roughvisc to a file next to the results, within the block."""
    handler = _LogFile(folder / LOG, delay=True, encoding="utf-8")
    handler.setFormatter(logging.Formatter(f"%(asctime)s {os.getpid()} %(levelname)s %(message)s"))
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
