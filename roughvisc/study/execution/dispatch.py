"""Cases on the workers of a Dask client: one future each, submitted again if its worker is lost."""

from __future__ import annotations

import concurrent.futures
import logging
import secrets
import threading
import time
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from distributed import CancelledError, Client, KilledWorker, as_completed

from roughvisc.errors import RoughviscError
from roughvisc.study.execution.monitor import SweepLog
from roughvisc.study.execution.task import Outcome, Report, on_worker, stop_sweep

log = logging.getLogger("roughvisc")

#: A case is given up for now when its worker was lost so often while it computed it, and it came no further.
_LOSSES = 2
#: Coming further is to pass the furthest point so far by this part of the program.
_FURTHER = 0.01
#: Whatever is known of a case, it is submitted no more often than this.
_SUBMISSIONS = 20
#: A worker that was lost may hold the lock of its case for so long. [s]
_LINGERING = 90.0
#: Seconds that running cases get to reach the end of their step when a sweep is interrupted.
_PATIENCE = 120.0
#: The message if the scheduler does not answer any more.
_LOST = "the scheduler was lost: finished results are kept; repeat the command to resume"
#: Without any worker for so long, the user is told; and so often it is looked. [s]
_ALONE_AFTER, _LOOK_EVERY = 30.0, 5.0


@dataclass
class _CaseStatus:
    """What is known of a case on its way.

    Attributes
    ----------
    submissions : int
        How often it was submitted.
    begun : int
        How often a worker began with it.
    tries : int
        The same, since it last came further.
    furthest : float
        Part of the program that was computed at most.
    worker : str
        Address of the worker that began with it last.
    refused : float or None
        When it was first found locked by a worker that was lost. [s]
    """

    submissions: int = 0
    begun: int = 0
    tries: int = 0
    furthest: float = 0.0
    worker: str = ""
    refused: float | None = None

    def heard(self, report: Report) -> None:
        """A worker reports."""
        if not report["end"]:
            self.begun, self.tries, self.worker = self.begun + 1, self.tries + 1, report["worker"]
        elif (reached := report["now"] / report["end"]) > self.furthest + _FURTHER:
            self.furthest, self.tries = reached, 1

    def is_lingering(self) -> bool:
        """Whether the worker that was lost may be what locks the case."""
        self.refused = self.refused or time.monotonic()
        return self.begun > 1 and time.monotonic() - self.refused < _LINGERING


@dataclass
class _Dispatch:
    """Cases on their way to their ends.

    Attributes
    ----------
    waiting : deque of str
        Keys of the cases that are to be submitted.
    """

    client: Client
    book: SweepLog
    texts: Mapping[str, str]
    arguments: tuple[Any, ...]
    name: str
    finished: Any
    courses: dict[str, _CaseStatus]
    futures: dict[Any, str] = field(default_factory=dict)
    waiting: deque[str] = field(default_factory=deque)

    def feed(self) -> None:
        """Submit the waiting cases."""
        while self.waiting:
            self.submit(self.waiting.popleft())

    def submit(self, key: str) -> None:
        """Submit a case."""
        course = self.courses[key]
        course.submissions += 1
        name = f"{self.name}-{key}-{course.submissions}"
        future = self.client.submit(on_worker, self.texts[key], key, *self.arguments, key=name, pure=False)
        self.futures[future] = key
        self.finished.add(future)

    def heard(self, event: tuple[float, Report]) -> None:
        report = event[1]
        self.courses[report["key"]].heard(report)
        self.book.watch.reached(report["key"], report["now"], report["end"])

    def take(self, going_on: bool) -> None:
        """Record finished cases; submit those again, if the sweep goes on, that a lost worker has left behind."""
        full: OSError | None = None
        for future, result in self.finished.next_batch(block=False):
            key = self.futures.pop(future)
            outcome = _outcome(key, result, self.courses[key], self.client)
            if outcome.kind != "interrupted":
                try:
                    self.book.ended(outcome)
                except OSError as error:  # after the others, which have ended too
                    full = error
            elif going_on:
                log.info("%s: resumes on another worker", key)
                self.waiting.append(key)
        if full is not None:
            raise full


def distribute(texts: Mapping[str, str], book: SweepLog, client: Client, threads: int | None, link: str) -> None:
    """Bring cases to their ends on the workers of a client.

    Parameters
    ----------
    texts : dict
        Key -> case as JSON.
    book : Book
        Keeps account; its folder is that of the results.
    client : distributed.Client
        Of the workers.
    threads : int or None
        Of the transforms; None: as many as a worker has.
    link : str
        Address of Dask's dashboard, if there is one.

    Raises
    ------
    RoughviscError
        If the scheduler was lost.
    KeyboardInterrupt, SystemExit
        If interrupted; the running cases have written a checkpoint by then, if their workers are there.
    """
    name = f"roughvisc-{secrets.token_hex(4)}"
    finished = as_completed([], loop=client.loop, with_results=True, raise_errors=False)
    courses = {key: _CaseStatus() for key in texts}
    cases = _Dispatch(client, book, texts, (str(book.folder), name, threads), name, finished, courses)
    client.subscribe_topic(name, cases.heard)
    try:
        book.begin(link)
        cases.waiting.extend(texts)
        try:
            _go_on(cases)
        except (KeyboardInterrupt, SystemExit, OSError) as error:  # dask-jobqueue makes a Ctrl-C a SystemExit
            if isinstance(error, OSError) and client.status != "running":
                raise RoughviscError(_LOST) from error
            book.watch.stopping()
            _stop(cases)
            raise
    finally:
        with suppress(OSError, RuntimeError, ValueError):  # the scheduler may be gone
            client.unsubscribe_topic(name)


def _go_on(cases: _Dispatch) -> None:
    """Record finished cases until none is left; tell the user if the cluster has no worker."""
    looked = seen = time.monotonic()
    said = False
    while cases.futures or cases.waiting:
        cases.feed()
        cases.take(going_on=True)
        cases.book.watch.tick()
        time.sleep(0.1)
        if time.monotonic() - looked < _LOOK_EVERY:
            continue
        looked = time.monotonic()
        if _workers(cases.client):
            seen, said = looked, False
        elif looked - seen >= _ALONE_AFTER and not said:
            said = True
            cases.book.tell(
                f"the cluster has had no worker for {looked - seen:.0f} s "
                f"({len(cases.futures) + len(cases.waiting)} cases to go): start "
                "workers (dask worker), or check whether their jobs are queued (squeue); the cases start as soon as "
                "one joins. Ctrl-C ends the sweep; finished results are kept, and the same command resumes it"
            )


def _stop(cases: _Dispatch) -> None:
    """Have the running cases stop at the end of their step, and wait for those whose workers are there."""
    client = cases.client

    def tell() -> None:
        with suppress(OSError, RuntimeError, ValueError):  # a worker that does not answer holds up nothing
            client.run(stop_sweep, cases.name, on_error="ignore")

    threading.Thread(target=tell, daemon=True).start()
    until = time.monotonic() + _PATIENCE
    with suppress(RoughviscError, OSError):  # the scheduler is gone, and they with it; or the disk is full again
        while time.monotonic() < until:
            cases.take(going_on=False)
            there = _workers(client)
            if not any(cases.courses[key].worker in there for key in cases.futures.values()):
                break
            cases.book.watch.tick()
            time.sleep(0.1)
    client.cancel(list(cases.futures))


def _workers(client: Client) -> set[str]:
    """Addresses of the workers that the scheduler knows."""
    return set(client.nthreads())


def _outcome(key: str, result: Any, course: _CaseStatus, client: Client) -> Outcome:
    """Return how a future ended; ``interrupted`` is a case that is to be submitted again."""
    if isinstance(result, tuple):  # as_completed gives an exception as sys.exc_info does
        result = result[1]
    again = course.submissions < _SUBMISSIONS
    if isinstance(result, Outcome):
        lingers = result.kind == "held" and course.is_lingering()
        return Outcome(key, "interrupted") if lingers else result
    if isinstance(result, KilledWorker):
        if course.tries < _LOSSES and again:  # it merely queued there, or had come further
            return Outcome(key, "interrupted")
        return Outcome(
            key,
            "hindered",
            f"the worker that computed it was lost {course.tries} times, the last at {result.last_worker.address}: "
            "killed, out of memory (roughvisc plan says how much a case needs), or out of time; repeat the command to "
            "resume from the last checkpoint",
            "KilledWorker",
        )
    if isinstance(result, CancelledError | concurrent.futures.CancelledError):
        if client.status == "running" and again:  # another client has restarted the workers
            return Outcome(key, "interrupted")
        raise RoughviscError(_LOST)
    return Outcome(key, "hindered", f"{type(result).__name__}: {result}", type(result).__name__)
