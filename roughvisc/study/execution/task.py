"""The task of a sweep on a Dask worker: computes one case, reports progress, stops on request, records errors."""

from __future__ import annotations

import errno
import logging
import signal
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict, get_args

import numpy as np
from distributed.core import Status

from roughvisc.errors import RoughviscError
from roughvisc.study.case import Case
from roughvisc.study.execution.run import run_case, unconverged
from roughvisc.study.storage.index import Entry, read_entry

if TYPE_CHECKING:
    from distributed import Worker


log = logging.getLogger("roughvisc")
Progress = Callable[[float, float], None]
#: How a case ended. ``hindered``: something outside the case was in the way (a full disk, too little memory, a process
#: that was killed), so the same command goes on from its checkpoint; ``held``: another run is at work on it; ``failed``
#: is what would fail again.
Kind = Literal["done", "unconverged", "failed", "hindered", "held", "interrupted"]
#: What the user reads for it.
IN_WORDS: dict[Kind, str] = {kind: kind for kind in get_args(Kind)} | {"held": "held by another run"}
#: Errors of a case that is refused as it stands.
REFUSED = ("InputError", "EdgeContactError", "TooLargeError")
#: Seconds between two reports of one case.
_REPORT_EVERY = 0.5
#: Sweeps whose cases are to stop, in this process.
_stopped: set[str] = set()
#: netCDF-4 does not stand two threads, so a process brings one case at a time whatever its number of threads.
_one_at_a_time = threading.Lock()
#: States of a worker that was told to leave: by a signal, or since its lifetime is over.
_LEAVING = (Status.closing_gracefully, Status.closing, Status.closed)


def close_on_sigterm(worker: Worker) -> None:
    """Have a worker close in order at SIGTERM; called by its task, from whatever thread.

    Batch systems send SIGTERM to every process of a job. Dask's nanny knows what to do; its worker would end there and
    then. No plugin of the cluster: a worker without roughvisc could not load it.
    """
    worker.loop.add_callback(_take_signals, worker)


def _take_signals(worker: Worker) -> None:
    if threading.current_thread() is not threading.main_thread():  # a thread of the user's own process
        return
    if signal.getsignal(signal.SIGTERM) != signal.SIG_IGN:  # else the process of the sweep answers for it
        signal.signal(signal.SIGTERM, lambda *_: worker.loop.add_callback(worker.close, nanny=False, reason="SIGTERM"))


class Report(TypedDict):
    """What a worker reports of a case: the time reached and the time at the end, both 0 when it begins. [s]"""

    key: str
    worker: str
    now: float
    end: float


@dataclass(frozen=True)
class Outcome:
    """How a case ended: small enough to be sent from a worker.

    Attributes
    ----------
    key : str
        Of the case.
    kind : str
        How it ended.
    message : str
        What to tell the user; empty where all went well.
    error : str
        Name of the exception's class, if there was one.
    trace : str
        Traceback of an exception that nobody raised on purpose.
    seconds : float
        Wall time. [s]
    entry : Entry or None
        What an index keeps of the file, if there is one.
    reused : bool
        Whether it ended so in an earlier run.
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


def run_case_safely(
    case: Case,
    folder: Path,
    *,
    progress: Progress,
    stop: Callable[[], bool] | None,
    threads: int,
) -> Outcome:
    """Bring a case to its file and say how that ended; :class:`KeyboardInterrupt` passes through.

    Parameters
    ----------
    case : Case
        What to compute.
    folder : Path
        Of the results.
    progress : callable
        Called with the time reached and the time at the end. [s]
    stop : callable, optional
        Asked at every step.
    threads : int
        Of a large grid.
    """
    began = time.perf_counter()
    try:
        path = run_case(case, folder, progress=progress, stop=stop, threads=threads)
        outcome = outcome_of(read_entry(path))
    except BlockingIOError as error:
        outcome = Outcome(case.key, "held", f"{error.filename}: {error.strerror}", type(error).__name__)
    except RoughviscError as error:
        kind: Kind = "hindered" if error.transient else "failed"
        outcome = Outcome(case.key, kind, str(error), type(error).__name__)
    except MemoryError:
        text = "not enough memory; what was computed up to the last checkpoint is kept: roughvisc plan says how much a "
        outcome = Outcome(
            case.key, "hindered", f"{text}case needs, and fewer --workers leave more to each", "MemoryError"
        )
    except OSError as error:  # a full disk, a folder that went away: not the fault of the case
        place = f"{error.filename}: " if error.filename else ""
        text, full = f"{place}{error.strerror or error}", error.errno in (errno.ENOSPC, errno.EDQUOT)
        outcome = Outcome(case.key, "hindered", text, type(error).__name__, disk_full=full)
    except Exception as error:  # noqa: BLE001  (whatever it is, it stops no other case; its traceback is kept)
        text = f"{type(error).__name__}: {error}"
        outcome = Outcome(case.key, "failed", text, type(error).__name__, traceback.format_exc())
    return replace(outcome, seconds=time.perf_counter() - began)


def outcome_of(entry: Entry, reused: bool = False) -> Outcome:
    """How a case ended whose file is there."""
    message = unconverged(entry.histories)
    return Outcome(entry.key, "unconverged" if message else "done", message, entry=entry, reused=reused)


def on_worker(text: str, key: str, folder: str, sweep: str, threads: int | None) -> Outcome:
    """The task of a worker: :func:`run_case_safely`, with progress sent to the scheduler.

    It ends as interrupted, with a checkpoint, if the sweep is stopped or the worker told to leave.

    Parameters
    ----------
    text : str
        The case as JSON.
    key : str
        What the sweep calls it.
    folder : str
        Of the results, absolute.
    sweep : str
        Name of the sweep: the topic of the reports, and what :func:`stop_sweep` is told.
    threads : int or None
        Of a large grid; None: as many as the worker has.
    """
    from distributed import get_worker

    worker = get_worker()
    close_on_sigterm(worker)
    last = -np.inf

    def report(now: float, end: float) -> None:
        nonlocal last
        if time.monotonic() - last >= _REPORT_EVERY:
            last = time.monotonic()
            event: Report = {"key": key, "worker": worker.address, "now": float(now), "end": float(end)}
            worker.log_event(sweep, event)

    def stop() -> bool:
        return sweep in _stopped or worker.status in _LEAVING

    with _one_at_a_time:
        if stop():
            return Outcome(key, "interrupted")
        report(0.0, 0.0)
        try:
            case = Case.from_json(text)
            if case.key != key:
                there = f"{worker.address} computes other numbers than the sweep expects ({case.key}, not {key})"
                return Outcome(key, "hindered", f"{there}: expected the same roughvisc and the same files there")
            threads = threads or worker.state.nthreads
            return run_case_safely(case, Path(folder), progress=report, stop=stop, threads=threads)
        except RoughviscError as error:  # a file that this machine does not have
            advice = "expected the files of the study where every worker can read them, under the same path"
            return Outcome(key, "hindered", f"on {worker.address}: {error}; {advice}", type(error).__name__)
        except KeyboardInterrupt:  # would take the worker down with it
            return Outcome(key, "interrupted")


def stop_sweep(sweep: str) -> None:
    """Have the cases of a sweep stop at their next step, in this process."""
    _stopped.add(sweep)
