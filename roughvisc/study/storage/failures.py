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
from roughvisc.study.storage.folder import atomic_write

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
        with atomic_write(path) as temporary:
            temporary.write_text(json.dumps(record, indent=1))
    except (OSError, InputError) as problem:
        log.warning("%s cannot be written: %s", path, problem)


def recorded_failure(folder: Path, key: str, *, by: str | None = None) -> dict[str, Any] | None:
    """Return the record of a failed case; None without a readable record.

    Parameters
    ----------
    folder : Path
        Results folder.
    key : str
        Key of the case.
    by : str, optional
        Version of the program; records of other versions are ignored, because this version may not fail.
    """
    try:
        record = json.loads(record_path(folder, key).read_text())
    except (OSError, ValueError):
        return None
    whole = isinstance(record, dict) and isinstance(record.get("case"), dict)
    return record if whole and by in (None, record.get("source")) else None


def forget_failure(folder: Path, key: str) -> None:
    """Remove the record of a failed case, if it exists."""
    with suppress(OSError):
        record_path(folder, key).unlink(missing_ok=True)


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
