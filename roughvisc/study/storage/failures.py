"""What went wrong in a folder: records of cases that failed, and the log of its sweeps."""

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
    """File of the record of a case that failed."""
    return folder / f"{key}.failed.json"


def record_failure(folder: Path, case: Case, message: str, error: str, trace: str) -> None:
    """Write down that a case failed; its record is named by its key.

    Parameters
    ----------
    folder : Path
        Of the results.
    case : Case
        The case.
    message, error, trace : str
        What went wrong: in words, the class of the exception, and its traceback if it was unexpected.
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
    """Record of a case that failed; None if there is none that can be read.

    Parameters
    ----------
    folder : Path
        Of the results.
    key : str
        Of the case.
    by : str, optional
        Version of the program that must have written it: a failure of another version proves nothing.
    """
    try:
        record = json.loads(record_path(folder, key).read_text())
    except (OSError, ValueError):
        return None
    whole = isinstance(record, dict) and isinstance(record.get("case"), dict)
    return record if whole and by in (None, record.get("source")) else None


def forget_failure(folder: Path, key: str) -> None:
    """Remove the record of a case, if there is one."""
    with suppress(OSError):
        record_path(folder, key).unlink(missing_ok=True)


class _LogFile(logging.FileHandler):
    """A log file that stops nothing if it cannot be written."""

    def emit(self, record: logging.LogRecord) -> None:
        with suppress(OSError):  # it cannot be opened
            super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:
        pass


@contextmanager
def log_file(folder: Path) -> Iterator[None]:
    """Append everything that roughvisc logs to a file next to the results."""
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
