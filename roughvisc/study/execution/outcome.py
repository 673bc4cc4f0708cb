"""Outcome of a case of a sweep; every error of its run becomes a message."""

from __future__ import annotations

import errno
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

from roughvisc.errors import RoughviscError
from roughvisc.study.case import Case
from roughvisc.study.execution.run import run_case, unconverged
from roughvisc.study.storage.index import Entry, read_entry

#: How a case ended. ``hindered``: stopped by a cause outside the case (a full disk, too little memory, a killed
#: process), so that the same command resumes it; ``held``: another run computes it; ``failed``: it would fail again.
Kind = Literal["done", "unconverged", "failed", "hindered", "held", "interrupted"]
#: Words of the display and of the log.
IN_WORDS: dict[Kind, str] = {kind: kind for kind in get_args(Kind)} | {"held": "held by another run"}
#: Errors that refuse the input of a case.
REFUSED = ("InputError", "EdgeContactError", "TooLargeError")


@dataclass(frozen=True)
class Outcome:
    """End of a case, small enough to be sent from a worker.

    Attributes
    ----------
    key : str
        Key of the case.
    kind : str
        How it ended.
    message : str
        Message to the user; empty if the case is done.
    error : str
        Class name of the exception.
    trace : str
        Traceback of an unexpected exception.
    seconds : float
        Wall time. [s]
    entry : Entry or None
        Contents of the result file without the fields.
    reused : bool
        Whether an earlier run computed it.
    disk_full : bool
        Whether the disk was full.
    """

    key: str
    kind: Kind
    message: str = ""
    error: str = ""
    trace: str = ""
    seconds: float = 0.0
    entry: Entry | None = None
    reused: bool = False
    disk_full: bool = False


def outcome_of(entry: Entry, reused: bool = False) -> Outcome:
    """Return the outcome of a case whose result exists."""
    message = unconverged(entry.arrays)
    return Outcome(entry.key, "unconverged" if message else "done", message, entry=entry, reused=reused)


def attempt(case: Case, folder: Path, *, progress: Callable[[float, float], None], **settings: Any) -> Outcome:
    """Run a case with some settings of :func:`run_case` and return its outcome; raise only ``KeyboardInterrupt``."""
    began = time.perf_counter()

    def ended(kind: Kind, message: str, error: Exception, **more: Any) -> Outcome:
        return Outcome(case.key, kind, message, type(error).__name__, seconds=time.perf_counter() - began, **more)

    try:
        path = run_case(case, folder, progress=progress, **settings)
        return replace(outcome_of(read_entry(path)), seconds=time.perf_counter() - began)
    except BlockingIOError as error:
        return ended("held", f"{error.filename}: {error.strerror}", error)
    except RoughviscError as error:
        return ended("hindered" if error.transient else "failed", str(error), error)
    except MemoryError as error:
        advice = "roughvisc plan says how much a case needs, and fewer --workers leave more to each"
        return ended("hindered", f"not enough memory; the last checkpoint is kept: {advice}", error)
    except OSError as error:  # for example a full disk, or a removed folder
        place = f"{error.filename}: " if error.filename else ""
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        return ended("hindered", f"{place}{error.strerror or error}", error, disk_full=full)
    except Exception as error:  # noqa: BLE001  (an unexpected error of one case must not stop the others)
        return ended("failed", f"{type(error).__name__}: {error}", error, trace=traceback.format_exc())
