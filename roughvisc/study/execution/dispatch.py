"""Cases on the workers of a Dask client: the task of a worker, and the loop that submits and records cases.

If a worker is lost, Dask submits its case again, and the case resumes from its checkpoint.
"""

from __future__ import annotations

import concurrent.futures
import logging
import secrets
import signal
import threading
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from distributed import CancelledError, Client, KilledWorker, as_completed, get_worker
from distributed.core import Status

from roughvisc.errors import RoughviscError
from roughvisc.study.case import Case
from roughvisc.study.execution.run import IN_USE, Outcome, attempt
from roughvisc.study.execution.sweep import Display
from roughvisc.study.storage.folder import case_path

if TYPE_CHECKING:
    from distributed import Future, Worker

log = logging.getLogger("roughvisc")

#: Time between two reports of one case. [s]
_REPORT_EVERY = 0.5
#: Time for running cases to finish their step after an interrupt. [s]
_PATIENCE = 120.0
#: Time without any worker after which the sweep displays a warning. [s]
_ALONE_AFTER = 30.0
_ALONE = (
    "there has been no worker for a while (%d cases to go): start workers (dask worker), or check whether their "
    "jobs are queued (squeue). The cases start as soon as one joins. Ctrl-C ends the sweep; the same command resumes it"
)
_LOST = "the scheduler was lost: finished results are kept; repeat the command to resume"
#: States of a worker that closes, after a signal or at the end of its lifetime.
_LEAVING = (Status.closing_gracefully, Status.closing, Status.closed)
#: A worker computes one case at a time, with all its threads.
_one_at_a_time = threading.Lock()


def distribute(
    texts: Mapping[str, str],
    folder: Path,
    display: Display,
    client: Client,
    threads: int | None,
    *,
    own: bool = False,
) -> Iterator[Outcome]:
    """Compute cases on the workers of a client and yield their outcomes.

    Parameters
    ----------
    texts : dict
        Key -> case as JSON.
    folder : Path
        Results folder, absolute.
    display : Display
        Display of the sweep.
    client : distributed.Client
        Client of the workers.
    threads : int or None
        Number of threads of each case. None: all threads of its worker.
    own : bool
        Whether the workers are child processes of this process, which then handles their signals.

    Raises
    ------
    RoughviscError
        If the scheduler was lost.
    KeyboardInterrupt, SystemExit, GeneratorExit
        If interrupted. Running cases write a checkpoint first, unless their workers were lost.
    """
    name = f"roughvisc-{secrets.token_hex(4)}"
    stop_file = folder / f".{name}.part.stop"
    settings = {"folder": str(folder), "stop_file": str(stop_file), "name": name, "threads": threads, "own": own}
    futures: dict[Future[Outcome], str] = {}
    workers: dict[str, list[str]] = {key: [] for key in texts}  # in the order in which they began each case
    number, taken_over = count(), set[str]()
    finished = as_completed([], loop=client.loop)

    def submit(keys: Sequence[str]) -> None:
        names = [f"{name}-{key}-{next(number)}" for key in keys]
        new = client.map(on_worker, [texts[key] for key in keys], keys, key=names, pure=False, **settings)
        futures.update(zip(new, keys, strict=True))
        finished.update(new)

    def heard(event: tuple[float, dict[str, Any]]) -> None:
        key, worker, now, end = event[1].values()
        if not end:
            if workers[key]:
                log.info("%s: worker %s has gone, resumes on %s", key, workers[key][-1], worker)
                display.say(f"worker {workers[key][-1]} has gone; the case resumes on {worker}", key)
            workers[key].append(worker)
        display.reached(key, now, end)

    client.subscribe_topic(name, heard)
    alone_since = time.monotonic()
    try:
        submit(list(texts))
        while futures:
            for future in finished.next_batch(block=False):
                key = futures.pop(future)
                outcome = _outcome(key, future)
                if outcome.error == IN_USE and len(workers[key]) > 1 and key not in taken_over:
                    taken_over.add(key)  # a lost worker of this sweep still holds the lock
                    case_path(folder, key, "lock").unlink(missing_ok=True)
                    submit([key])
                elif outcome.kind != "interrupted":
                    yield outcome
                elif client.status == "running":  # its worker closes, or another client has restarted the workers
                    submit([key])
                else:
                    raise RoughviscError(_LOST)
            time.sleep(0.1)
            if time.monotonic() - alone_since > _ALONE_AFTER:
                alone_since = time.monotonic()
                if not client.nthreads():
                    log.warning(_ALONE, len(futures))
                    warnings.warn(_ALONE % len(futures), stacklevel=1)  # also without a display
    except (KeyboardInterrupt, SystemExit, GeneratorExit):  # dask-jobqueue turns Ctrl-C into SystemExit
        display.say("stopping: the running cases finish their step; Ctrl-C again ends at once")
        with suppress(OSError):  # a full disk, or a lost scheduler
            stop_file.touch()
            begun, until = [future for future, key in futures.items() if workers[key]], time.monotonic() + _PATIENCE
            while time.monotonic() < until and client.nthreads() and not all(future.done() for future in begun):
                time.sleep(0.1)
        raise
    except OSError as error:
        raise RoughviscError(_LOST) from error
    finally:
        with suppress(OSError, RuntimeError, ValueError):  # the scheduler may be lost
            client.cancel(list(futures))
            client.unsubscribe_topic(name)
        stop_file.unlink(missing_ok=True)


def _outcome(key: str, future: Future[Outcome]) -> Outcome:
    """Return the outcome of a case from its future."""
    try:
        return future.result()
    except (CancelledError, concurrent.futures.CancelledError):
        return Outcome(key, "interrupted")
    except KilledWorker as error:
        name, place = "KilledWorker", error.last_worker.address
        message = (
            f"its worker was lost {error.allowed_failures + 1} times, the last at {place}: killed, out of memory "
            "(roughvisc plan says how much a case needs), or out of time; repeat the command to resume from the last "
            "checkpoint"
        )
    except Exception as error:  # noqa: BLE001  (such as a worker without roughvisc)
        name, message = type(error).__name__, f"{type(error).__name__}: {error}"
    return Outcome(key, "hindered", message, name)


def on_worker(
    text: str, key: str, *, folder: str, stop_file: str, name: str, threads: int | None, own: bool
) -> Outcome:
    """Compute a case on a worker; the outcome of a stopped case is ``interrupted``, and it has a checkpoint.

    Parameters
    ----------
    text, key : str
        The case as JSON, and its key.
    folder, stop_file : str
        Results folder, and the file that stops all cases, absolute.
    name : str
        Name of the sweep, the topic of its reports.
    threads : int or None
        Number of threads. None: all threads of the worker.
    own : bool
        Whether the worker is a child process of the process of the sweep.
    """
    worker = get_worker()
    task, last = worker.get_current_task(), 0.0
    worker.loop.add_callback(_take_signals, worker, own)
    if own and not log.handlers:
        log.addHandler(logging.NullHandler())  # the process of the sweep displays the warnings of the result

    def report(now: float, end: float) -> None:
        nonlocal last
        if not end or time.monotonic() - last >= _REPORT_EVERY:
            last = time.monotonic()
            worker.log_event(name, {"key": key, "worker": worker.address, "now": float(now), "end": float(end)})

    def stop() -> bool:
        state = worker.state.tasks.get(task)  # None or cancelled if the client has closed
        return worker.status in _LEAVING or state is None or state.state == "cancelled" or Path(stop_file).exists()

    with _one_at_a_time:
        if stop():
            return Outcome(key, "interrupted")
        report(0.0, 0.0)
        try:
            if not Path(folder).is_dir():
                raise RoughviscError(f"{folder}: does not exist")
            case = Case.from_json(text)
            if case.key != key:
                raise RoughviscError(f"the key of the case is {case.key}, and {key} in the process of the sweep")
            return attempt(case, Path(folder), progress=report, stop=stop, threads=threads or worker.state.nthreads)
        except RoughviscError as error:
            expected = "expected the same roughvisc, results folder and files of the study on every worker"
            return Outcome(key, "hindered", f"on {worker.address}: {error}; {expected}", type(error).__name__)
        except KeyboardInterrupt:  # the exception would end the worker
            return Outcome(key, "interrupted")


def _take_signals(worker: Worker, own: bool) -> None:
    """Ignore signals in a child process of a sweep; let any other worker close in an orderly way at SIGTERM.

    Terminals send Ctrl-C, and batch systems SIGTERM, to every process of a job. The process of the sweep handles both
    for its child processes.
    """
    if threading.current_thread() is not threading.main_thread():  # a worker in a thread of the user's process
        return
    if own:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    else:
        signal.signal(signal.SIGTERM, lambda *_: worker.loop.add_callback(worker.close, nanny=False, reason="SIGTERM"))
