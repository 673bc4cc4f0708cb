"""Cases on the workers of a Dask client: one future each, submitted anew where its worker was lost.

Only workers with the version of this process compute. A worker cannot be sent anything of roughvisc before its version
is known: where it cannot unpickle what it gets, it closes. So the task is a text that looks at the version first.
"""

from __future__ import annotations

import concurrent.futures
import logging
import secrets
import threading
import time
from collections import deque
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from distributed import CancelledError, Client, KilledWorker, as_completed

from roughvisc import errors
from roughvisc.errors import DiskFullError, InputError, RoughviscError
from roughvisc.study.execution.cluster import SOURCE, VERSION
from roughvisc.study.execution.monitor import Monitor, SweepLog, watcher
from roughvisc.study.execution.task import INPUTS, Outcome, Progress, Report, serialize_with_inputs, stop_sweep
from roughvisc.study.statement.case import Case
from roughvisc.study.statement.identity import program_version

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
#: Without any worker for so long, the user is told; and so often it is looked. [s]
_ALONE_AFTER, _LOOK_EVERY = 30.0, 5.0
#: The task of a worker, for :func:`eval`: the case's outcome, or the worker's address and version if that is another.
_TASK = (
    f"__import__('roughvisc.study.execution.task', fromlist=['']).on_worker(*arguments) if ({VERSION}) == version"
    f" else (__import__('distributed').get_worker().address, {VERSION})"
)


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
    refused : dict
        Address of each worker with another version -> that version.
    named : set of str
        Those of them that the user was told of.
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
    refused: dict[str, str] = field(default_factory=dict)
    named: set[str] = field(default_factory=set)

    def feed(self) -> None:
        """Submit the cases that wait.

        Where workers with another version must be left out, no more cases are submitted than the others have threads:
        a worker that comes later then gets cases, too.
        """
        if not self.refused:
            while self.waiting:
                self.submit(self.waiting.popleft())
        elif self.waiting:
            matching = {address: n for address, n in self.client.nthreads().items() if address not in self.refused}
            for _ in range(min(len(self.waiting), sum(matching.values()) - len(self.futures))):
                self.submit(self.waiting.popleft(), matching)

    def submit(self, key: str, workers: Collection[str] | None = None) -> None:
        """Submit a case to any worker, or to one of some."""
        course = self.courses[key]
        course.submissions += 1
        names = {"source": SOURCE, "version": program_version(), "arguments": (self.texts[key], key, *self.arguments)}
        name, where = f"{self.name}-{key}-{course.submissions}", list(workers or ()) or None
        future = self.client.submit(eval, _TASK, names, key=name, pure=False, workers=where)
        self.futures[future] = key
        self.finished.add(future)

    def resubmit_stranded(self) -> None:
        """Have cases wait again that were submitted to workers of which none is left."""
        processing = {key for keys in self.client.processing().values() for key in keys}
        stranded = [one for one in self.futures if one.key not in processing and one.status == "pending"]
        for future in stranded:
            self.waiting.append(self.futures.pop(future))
        self.client.cancel(stranded)

    def matching(self, workers: Iterable[str]) -> set[str]:
        """Those of some workers that are not known to have another version."""
        return {address for address in workers if address not in self.refused}

    def name_refused(self) -> None:
        """Say of each worker that is left out that it is, once."""
        if others := self.refused.keys() - self.named:
            self.named |= others
            self.book.tell(f"{self.other_versions(others)}: no case runs there, the other workers are used")

    def have_begun(self) -> bool:
        """Whether a worker has begun with a case, so that one with this version is known."""
        return any(course.begun for course in self.courses.values())

    def other_versions(self, workers: Iterable[str]) -> str:
        """What is wrong with some workers that were refused."""
        found = [(address, self.refused[address]) for address in sorted(workers)]
        named = [f"worker {address} has {version}" for address, version in found[:3]]
        more = [f"{len(found) - 3} more workers have other versions, too"] if len(found) > 3 else []
        return f"{', '.join(named + more)}, while this process has {program_version()}"

    def heard(self, event: tuple[float, Report]) -> None:
        report = event[1]
        self.courses[report["key"]].heard(report)
        self.book.watch.reached(report["key"], report["now"], report["end"])

    def take(self, going_on: bool) -> None:
        """Take up what has ended; submit anew, if the sweep goes on, what a lost worker has left behind."""
        for future, result in self.finished.next_batch(block=False):
            key = self.futures.pop(future, None)
            if key is None:  # it was stranded, and waits again
                continue
            if future.status == "finished" and isinstance(result, tuple):
                worker, version = result
                self.refused[worker] = version
                self.waiting.append(key)
                continue
            outcome = _outcome(key, result, self.courses[key])
            if outcome.kind != "interrupted":
                self.book.ended(outcome)
            elif going_on:
                log.info("%s: resumes on another worker", key)
                self.waiting.append(key)


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
    InputError
        If all workers have another version of roughvisc.
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
        except (KeyboardInterrupt, SystemExit, DiskFullError):  # dask-jobqueue makes a Ctrl-C a SystemExit
            book.watch.stopping()
            _stop(cases)
            raise
    finally:
        with suppress(OSError, RuntimeError, ValueError):  # the scheduler may be gone
            client.unsubscribe_topic(name)


def run_on(client: Client, case: Case, folder: Path, progress: bool | Progress, threads: int | None = None) -> Path:
    """Bring one case to its file on a worker, and give the file's path.

    Raises
    ------
    RoughviscError
        As :func:`roughvisc.study.execution.run.run_case`; what else went wrong there is one, too.
    """
    watch = ProgressForwarder(progress) if callable(progress) else watcher(progress)
    book = SweepLog(folder, {case.key: case}, {}, watch, [])
    try:
        packed = {case.key: serialize_with_inputs(case, folder / INPUTS)}
        distribute(packed, book, client, threads, client.dashboard_link)
    finally:
        watch.close()
    outcome = book.outcomes[case.key]
    if outcome.entry is None:
        kind = getattr(errors, outcome.error, RoughviscError)
        raise kind(outcome.message)
    return folder / outcome.entry.file


class ProgressForwarder(Monitor):
    """Passes the times reached on to a function."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress

    def reached(self, key: str, now: float, end: float) -> None:
        if end:
            self._progress(now, end)


def _go_on(cases: _Dispatch) -> None:
    """Take up what ends, until nothing is left; say it if no worker is, or some have another version."""
    looked = seen = time.monotonic()
    said = False
    while cases.futures or cases.waiting:
        cases.feed()
        cases.take(going_on=True)
        cases.book.watch.tick()
        if cases.have_begun() or not (cases.futures or cases.waiting):
            cases.name_refused()
        time.sleep(0.1)
        due = time.monotonic() - looked >= _LOOK_EVERY
        if not due and not (cases.refused and cases.waiting):
            continue
        there = _workers(cases.client)
        if there and not cases.matching(there) and not cases.have_begun():
            _end_without_workers(cases, there)
        if not due:
            continue
        looked = time.monotonic()
        if cases.matching(there):
            seen, said = looked, False
            if cases.refused:
                cases.resubmit_stranded()
        elif looked - seen >= _ALONE_AFTER and there:
            _end_without_workers(cases, there)
        elif looked - seen >= _ALONE_AFTER and not said:
            said = True
            cases.book.tell(
                f"the cluster has had no worker for {looked - seen:.0f} s "
                f"({len(cases.futures) + len(cases.waiting)} cases to go): start "
                "workers (dask worker), or check whether their jobs are queued (squeue); the cases start as soon as "
                "one joins. Ctrl-C ends the sweep; finished results are kept, and the same command resumes it"
            )


def _end_without_workers(cases: _Dispatch, workers: Collection[str]) -> None:
    """End a sweep whose workers all have another version."""
    cases.client.cancel(list(cases.futures))
    raise InputError(
        f"{cases.other_versions(workers)}: expected workers with the same version; what is finished is kept"
    )


def _stop(cases: _Dispatch) -> None:
    """Have the running cases stop at the end of their step, and wait for those whose workers are there."""
    client = cases.client

    workers = list(cases.matching(_workers(client)))

    def tell() -> None:
        with suppress(OSError, RuntimeError, ValueError):  # a worker that does not answer holds up nothing
            client.run(stop_sweep, cases.name, workers=workers, on_error="ignore")

    threading.Thread(target=tell, daemon=True).start()
    until = time.monotonic() + _PATIENCE
    with suppress(RoughviscError):  # the scheduler is gone, and they with it; or the disk is full for another one too
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


def _outcome(key: str, result: Any, course: _CaseStatus) -> Outcome:
    """What a future came to; ``interrupted`` is a case that another worker should go on with."""
    if isinstance(result, tuple):  # as_completed gives an exception as sys.exc_info does
        result = result[1]
    again = course.submissions < _SUBMISSIONS
    if isinstance(result, Outcome):
        lingers = result.error == "InUseError" and course.is_lingering()
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
        raise RoughviscError("the scheduler was lost: finished results are kept; repeat the command to resume")
    return Outcome(key, "hindered", f"{type(result).__name__}: {result}", type(result).__name__)
