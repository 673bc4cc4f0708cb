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
from roughvisc.study.case import NUMERICS_REVISION, Case, program
from roughvisc.study.storage.folder import atomic_write

log = logging.getLogger("roughvisc")


def record_path(folder: Path, key: str) -> Path:
    """File of the record of a case."""
    return folder / f"{key}.failed.json"


def record_failure(folder: Path, case: Case, message: str, error: str, trace: str) -> Path:
    """Write down that a case failed; its record is named by its key.

    Parameters
    ----------
    folder : Path
        Of the results.
    case : Case
        What was asked.
    message, error, trace : str
        What went wrong: in words, the class of the exception, and its traceback if nobody raised it on purpose.
    """
    record = {
        "case_key": case.key,
        "message": message,
        "error": error,
        "traceback": trace,
        "time": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        **_version(),
        "case": json.loads(case.to_json()),
    }
    path = record_path(folder, case.key)
    try:
        with atomic_write(path) as temporary:
            temporary.write_text(json.dumps(record, indent=1))
    except (OSError, InputError) as problem:
        log.warning("%s cannot be written: %s", path, problem)
    return path


def recorded_failure(folder: Path, key: str) -> dict[str, Any] | None:
    """Record of a case that failed; None if there is none, or if another version failed, which proves nothing."""
    record = stated_failure(folder, key)
    current = record is not None and {name: record.get(name) for name in _version()} == _version()
    return record if current else None


def stated_failure(folder: Path, key: str) -> dict[str, Any] | None:
    """Record of a case that failed, in whatever version; None if there is none that can be read."""
    try:
        record = json.loads(record_path(folder, key).read_text())
    except (OSError, ValueError):
        return None
    return record if isinstance(record, dict) and isinstance(record.get("case"), dict) else None


def forget_failure(folder: Path, key: str) -> None:
    """Remove the record of a case, if there is one."""
    with suppress(OSError):
        record_path(folder, key).unlink(missing_ok=True)


def _version() -> dict[str, Any]:
    return {"source": program(), "numerics": NUMERICS_REVISION}


LOG = "sweep.log"


def _formatter() -> logging.Formatter:
    return logging.Formatter(f"%(asctime)s {os.getpid()} %(levelname)s %(message)s")


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
    """A log file that stops nothing if it cannot be written."""

    def emit(self, record: logging.LogRecord) -> None:
        with suppress(OSError):  # it cannot be opened
            super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:
        pass
