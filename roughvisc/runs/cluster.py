"""Dask: clients of a local cluster or a running scheduler, the cases on their workers, and how many processes fit.

If a worker is lost, Dask submits its case again, and the case resumes from its checkpoint. The library is imported at
its first use, because it is slow to import.
"""

from __future__ import annotations

import concurrent.futures
import logging
import math
import secrets
import signal
import sys
import threading
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib import metadata
from itertools import count, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roughvisc.errors import InputError, RoughviscError
from roughvisc.experiment.memory_limit import PART, PROCESS
from roughvisc.mechanics.heap import return_freed_memory
from roughvisc.runs.display import Display
from roughvisc.runs.folder import case_path
from roughvisc.runs.run import IN_USE, Outcome, attempt
from roughvisc.study.case import Case

if TYPE_CHECKING:
    from distributed import Client, Future, Worker

log = logging.getLogger("roughvisc")

#: Number of cases at the scheduler at a time, and least number for each worker. The first result does not wait until
#: all cases are sent, and the memory of the scheduler does not grow with the sweep.
_WINDOW = 200
_CASES_AHEAD = 4
#: Time between two looks at finished cases, and for short cases. [s]
_POLL_EVERY = 0.1
_POLL_SHORT = 0.02
#: Time between two counts of the workers. [s]
_COUNT_EVERY = 2.0
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
_LEAVING = ("closing_gracefully", "closing", "closed")
#: A worker computes one case at a time, with all its threads.
_one_at_a_time = threading.Lock()


@contextmanager
def local_client(processes: int) -> Iterator[Client]:
    """Yield a client of a cluster of processes on this machine, which no other machine can reach.

    Raises
    ------
    RoughviscError
        If a process is lost while it starts. The processes import the script that is running, which must not start
        another sweep.
    """
    import dask
    from distributed import Client, LocalCluster
    from distributed.system import MEMORY_LIMIT

    settings = {
        "distributed.scheduler.worker-saturation": 1.0,  # a lost worker has no queued cases
        "distributed.comm.timeouts.connect": "60s",
        # a killed worker may take long to start again on a busy machine
        "distributed.deploy.lost-worker-timeout": "300s",
        "distributed.worker.profile.enabled": False,  # profiling slows the cases down
        "distributed.admin.tick.interval": "1s",  # 20 ms by default in each of three servers, half of their idle cost
    }
    with dask.config.set(settings):
        try:
            own = LocalCluster(
                n_workers=processes,
                threads_per_worker=1,
                memory_limit=MEMORY_LIMIT // processes,
                processes=True,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
        except RuntimeError as error:
            lost = "a process of this machine was lost while it started: expected rv.sweep below "
            raise RoughviscError(lost + '`if __name__ == "__main__":` in a script; or use workers=0') from error
        with own as cluster, Client(cluster, set_as_default=False) as client:
            yield client


def default_client() -> Client | None:
    """Return the user's default client; None within a Dask task, whose cases run in its own process."""
    distributed = sys.modules.get("distributed")
    if distributed is None:  # not imported, so no client exists
        return None
    with suppress(ValueError):
        distributed.get_worker()
        return None
    with suppress(ValueError):
        return distributed.default_client()
    return None


def require_synchronous(client: Client | None) -> None:
    """Refuse an asynchronous client, whose results cannot be waited for.

    Raises
    ------
    InputError
        If the client is asynchronous.
    """
    if client is not None and client.asynchronous:
        raise InputError(key="client", found=client, expected="a Client(asynchronous=False)")


def require_same_version(client: Client) -> None:
    """Refuse a cluster in which a worker has another version of roughvisc, or none.

    Raises
    ------
    InputError
        If a version differs; the message states the address of the worker and both versions.
    """
    here = metadata.version("roughvisc")
    for address, about in client.get_versions(packages=["roughvisc"])["workers"].items():
        version = about["packages"].get("roughvisc")
        if version != here:
            raise InputError(key=f"worker {address}", found=version, expected=f"roughvisc {here}, as in this process")


def processes_that_fit(largest: float, most: int, free: float) -> int:
    """Return the number of processes that fit in the memory at the same time, at least one.

    Parameters
    ----------
    largest : float
        Memory of the largest case with its process. [byte]
    most : int
        Largest number of processes.
    free : float
        Available memory. [byte]

    Examples
    --------
    >>> processes_that_fit(2e9, 4, 8e9), processes_that_fit(9e9, 2, 8e9)
    (3, 1)
    """
    return max(1, min(most, int(PART * free / max(largest, PROCESS))))


def threads_each(processes: int) -> int:
    """Return the number of threads per process for some processes on this machine."""
    from dask.system import CPU_COUNT

    return max(1, CPU_COUNT // max(processes, 1))


def distribute(
    cases: Mapping[str, Case],
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
    cases : dict
        Key -> case.
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
    from distributed import as_completed

    name = f"roughvisc-{secrets.token_hex(4)}"
    stop_file = folder / f".{name}.part.stop"
    settings = {"folder": str(folder), "stop_file": str(stop_file), "name": name, "threads": threads, "own": own}
    futures: dict[Future[Outcome], str] = {}
    workers: dict[str, list[str]] = {key: [] for key in cases}  # in the order in which they began each case
    number = count()
    taken_over = set[str]()
    finished = as_completed([], loop=client.loop)

    def submit(keys: Sequence[str]) -> None:
        names = [f"{name}-{key}-{next(number)}" for key in keys]
        new = client.map(on_worker, [cases[key].to_json() for key in keys], keys, key=names, pure=False, **settings)
        futures.update(zip(new, keys, strict=True))
        finished.update(new)

    def heard(event: tuple[float, dict[str, Any]]) -> None:
        key, worker, begins, now, end = event[1].values()
        if begins:
            if workers[key]:
                log.info("%s: worker %s has gone, resumes on %s", key, workers[key][-1], worker)
                display.say(f"worker {workers[key][-1]} has gone; the case resumes on {worker}", key)
            workers[key].append(worker)
        display.reached(key, now, end)

    client.subscribe_topic(name, heard)
    alone_since = time.monotonic()
    try:
        waiting = iter(cases)
        left = len(cases)
        ahead = _WINDOW
        counted_at = -math.inf
        pause = _POLL_EVERY
        while True:
            if left and time.monotonic() - counted_at > _COUNT_EVERY:  # each question costs as much as a look
                ahead = max(_WINDOW, _CASES_AHEAD * len(client.nthreads()))
                counted_at = time.monotonic()
            keys = list(islice(waiting, max(0, ahead - len(futures))))
            if keys:
                submit(keys)
            left -= len(keys)
            if not futures:
                break
            for future in finished.next_batch(block=False):
                key = futures.pop(future)
                outcome = _outcome(key, future)
                pause = min(pause, max(_POLL_SHORT, outcome.seconds / 10))
                if outcome.error == IN_USE and len(workers[key]) > 1 and key not in taken_over:
                    taken_over.add(key)  # a lost worker of this sweep still holds the lock
                    with suppress(OSError):  # then the case is refused once more
                        case_path(folder, key, "lock").unlink()
                    submit([key])
                elif outcome.kind != "interrupted":
                    yield outcome
                elif client.status == "running":  # its worker closes, or another client has restarted the workers
                    submit([key])
                else:
                    raise RoughviscError(_LOST)
            time.sleep(pause)
            if time.monotonic() - alone_since > _ALONE_AFTER:
                alone_since = time.monotonic()
                if not client.nthreads():
                    log.warning(_ALONE, len(futures))
                    warnings.warn(_ALONE % len(futures), stacklevel=1)  # also without a display
    except (KeyboardInterrupt, SystemExit, GeneratorExit):  # dask-jobqueue turns Ctrl-C into SystemExit
        display.say("stopping: the running cases finish their step; Ctrl-C again ends at once")
        with suppress(OSError):  # a full disk, or a lost scheduler
            stop_file.touch()
            begun = [future for future, key in futures.items() if workers[key]]
            until = time.monotonic() + _PATIENCE
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
    from distributed import CancelledError, KilledWorker

    try:
        return future.result()
    except (CancelledError, concurrent.futures.CancelledError):
        return Outcome(key, "interrupted")
    except KilledWorker as error:
        name = "KilledWorker"
        place = error.last_worker.address
        message = (
            f"its worker was lost {error.allowed_failures + 1} times, the last at {place}: killed, out of memory "
            "(roughvisc plan says how much a case needs), or out of time; repeat the command to resume from the last "
            "checkpoint"
        )
    except Exception as error:  # noqa: BLE001  (such as a worker without roughvisc)
        name = type(error).__name__
        message = f"{type(error).__name__}: {error}"
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
    from distributed import get_worker

    worker = get_worker()
    task = worker.get_current_task()
    last = 0.0
    worker.loop.add_callback(_take_signals, worker, own)
    if own and not log.handlers:
        log.addHandler(logging.NullHandler())  # the process of the sweep displays the warnings of the result

    def report(now: float, end: float, *, begins: bool = False) -> None:
        nonlocal last
        if begins or time.monotonic() - last >= _REPORT_EVERY:
            last = time.monotonic()
            about = {"key": key, "worker": worker.address, "begins": begins, "now": float(now), "end": float(end)}
            worker.log_event(name, about)

    def stop() -> bool:
        state = worker.state.tasks.get(task)  # None or cancelled if the client has closed
        return worker.status.name in _LEAVING or state is None or state.state == "cancelled" or Path(stop_file).exists()

    with _one_at_a_time:
        if stop():
            return Outcome(key, "interrupted")
        report(0.0, 0.0, begins=True)
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
        finally:
            return_freed_memory()


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
