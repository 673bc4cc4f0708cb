"""Many cases on Dask: one task and one file each; what is finished is kept, and what fails stops nothing else."""

from __future__ import annotations

import importlib.util
import json
import logging
import os
import secrets
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from roughvisc.errors import DiskFullError, InputError, RoughviscError
from roughvisc.study.execution.baggage import pack
from roughvisc.study.execution.cluster import local_client
from roughvisc.study.execution.run import result_folder
from roughvisc.study.execution.script import refuse_unguarded_script
from roughvisc.study.execution.task import Outcome, bring, on_worker, outcome_of, stop_sweep
from roughvisc.study.statement.case import Case, read_cases
from roughvisc.study.storage.failures import forget_failure, record_failure, recorded_failure
from roughvisc.study.storage.index import Entry, Index, index_of, save_index
from roughvisc.study.storage.results import open_results
from roughvisc.study.storage.table import write_table
from roughvisc.study.storage.tidy import tidy

if TYPE_CHECKING:
    import xarray as xr
    from distributed import Client

log = logging.getLogger("roughvisc")

LOG = "sweep.log"
#: Seconds between two savings of the index while a sweep runs.
_SAVE_EVERY = 60.0
#: Seconds that running cases get to reach the end of their step when a sweep is interrupted.
_PATIENCE = 120.0


class Watcher(Protocol):
    """Who is told how a sweep goes on; times in seconds."""

    def begin(self, cases: Sequence[Case], link: str) -> None:
        """The distinct cases, in order, and the address of Dask's dashboard if there is one."""

    def reached(self, key: str, now: float, end: float) -> None:
        """A running case is at this time of so much; from any thread."""

    def ended(self, outcome: Outcome) -> None:
        """A case ended."""

    def tick(self) -> None:
        """Called several times a second."""

    def stopping(self) -> None:
        """The sweep is interrupted and waits for the running cases to stop."""

    def close(self) -> None:
        """Nothing more follows."""


def sweep(
    cases: Sequence[Case] | str | Path,
    out: str | Path | None = None,
    client: Client | None = None,
    *,
    retry_failed: bool = False,
    progress: bool = True,
    workers: int | None = None,
) -> xr.Dataset:
    """Compute many cases, one file each, and open them together.

    Finished cases are not computed again and cases alike are computed once, so the same call goes on after whatever
    ended it. In a script, call it below ``if __name__ == "__main__":``, since the workers of the default cluster
    are processes that import the script.

    Parameters
    ----------
    cases : sequence of Case, or path
        Cases, or the study file that states them.
    out : path, optional
        Folder of the results, on a file system that all workers see under the same path. Default: ``results/`` and
        the study's name, beside the study.
    client : distributed.Client, optional
        Where to compute. Default: a cluster on this machine, one process a core; a single case is computed in
        this process.
    retry_failed : bool
        Compute cases again that failed before.
    progress : bool
        Show how far it is.
    workers : int, optional
        Processes of the default cluster; 0: this process.

    Returns
    -------
    xarray.Dataset
        Results of the cases that are finished, as :func:`open_results` gives them.

    Raises
    ------
    InputError
        If the input is wrong and nothing ran, the call stands at the top level of a script, or the results have no
        times and grid in common.
    RoughviscError
        If no case could be finished. A case that failed beside others is recorded in the folder and logged as a
        warning.
    """
    if isinstance(cases, str | Path):
        cases = read_cases(cases)
    if not cases:
        raise InputError("cases is empty: expected at least one case")
    folder = result_folder(cases[0], out).absolute()
    from roughvisc.study.execution.watch import watcher

    outcomes = run_cases(
        cases, folder, client=client, workers=workers, retry_failed=retry_failed, watch=watcher(progress)
    )
    bad = [outcome for outcome in outcomes.values() if outcome.kind != "done"]
    for outcome in bad:
        log.warning("%s: %s: %s", outcome.key, outcome.kind, outcome.message)
    if not any(outcome.entry for outcome in outcomes.values()):
        kind = InputError if all(o.error in ("InputError", "EdgeContactError") for o in bad) else RoughviscError
        raise kind(f"none of {len(outcomes)} cases could be finished; the first: {bad[0].message}")
    return open_results(folder, cases=cases)


def run_cases(
    cases: Sequence[Case],
    folder: Path,
    *,
    watch: Watcher,
    client: Client | None = None,
    workers: int | None = None,
    retry_failed: bool = False,
) -> dict[str, Outcome]:
    """Bring all cases to their files; see :func:`sweep`.

    Returns
    -------
    dict
        Key of each distinct case -> how it ended, in the order of the cases.

    Raises
    ------
    InputError
        If a setting is wrong.
    DiskFullError
        If the disk is full; the cases that are left are not begun.
    RoughviscError
        If the scheduler was lost.
    KeyboardInterrupt
        If interrupted; the running cases have reached the end of a step by then.
    """
    if workers is not None and (client is not None or workers < 0):
        problem = "a client has workers of its own" if client is not None else "expected 0 or more"
        raise InputError(f"workers is {workers}: {problem}")
    if client is not None and client.asynchronous:
        raise InputError("client is asynchronous: expected a Client(asynchronous=False)")
    distinct = {case.key: case for case in cases}
    folder = folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    with _log_file(folder):
        tidy(folder)
        index = index_of(folder)
        outcomes = _known(distinct, folder, index, retry_failed)
        todo = {key: case for key, case in distinct.items() if key not in outcomes}
        if client is None and _processes(workers, len(todo)):
            try:
                refuse_unguarded_script()
            except InputError:
                with suppress(OSError):  # of other results in it
                    folder.rmdir()
                raise
        log.info("sweep of %d cases, %d of them to compute", len(distinct), len(todo))
        book = _Book(folder, distinct, outcomes, watch, [o.entry for o in outcomes.values() if o.entry])
        try:
            _compute(todo, folder, book, client, workers)
        except KeyboardInterrupt:
            log.warning("interrupted after %d of %d cases", len(outcomes), len(distinct))
            raise
        except DiskFullError as error:
            log.warning("%s", error)
            raise
        finally:
            book.save()
            watch.close()
        hindered = {key: case for key, case in todo.items() if outcomes[key].kind == "hindered"}
        for key, entry in index_of(folder).entries.items() if hindered else ():
            if key in hindered:  # another run has finished it meanwhile
                outcomes[key] = outcome_of(entry, reused=True)
    return {key: outcomes[key] for key in distinct}


def _known(distinct: Mapping[str, Case], folder: Path, index: Index, retry_failed: bool) -> dict[str, Outcome]:
    """What needs not be computed: finished cases, and those that are known to fail."""
    outcomes = {}
    for key in distinct:
        record = recorded_failure(folder, key)
        if key in index.entries:
            forget_failure(folder, key)
            outcomes[key] = outcome_of(index.entries[key], reused=True)
        elif record is not None and not retry_failed:
            outcomes[key] = Outcome(key, "failed", record["message"], record["error"], reused=True)
    return outcomes


@dataclass
class _Book:
    """Keeps account of a sweep: who is told, what is recorded, what the index holds."""

    folder: Path
    cases: Mapping[str, Case]
    outcomes: dict[str, Outcome]
    watch: Watcher
    entries: list[Entry]
    saved: float = 0.0

    def begin(self, link: str = "") -> None:
        self.saved = time.monotonic()
        self.watch.begin(list(self.cases.values()), link)
        for outcome in self.outcomes.values():
            self.watch.ended(outcome)
        if link:
            log.info("dashboard: %s", link)

    def ended(self, outcome: Outcome) -> None:
        self.outcomes[outcome.key] = outcome
        case = self.cases[outcome.key]
        varied = json.dumps(dict(case.varied))
        level = logging.INFO if outcome.kind == "done" else logging.WARNING
        log.log(level, "%s %s %.3g s %s %s", outcome.key, outcome.kind, outcome.seconds, varied, outcome.message)
        if outcome.trace:
            log.error("%s", outcome.trace)
        if outcome.kind == "failed" and len(self.cases) > 1:
            record_failure(self.folder, case, outcome.message, outcome.error, outcome.trace)
        elif outcome.entry is not None:
            self.entries.append(outcome.entry)
            forget_failure(self.folder, outcome.key)
        self.watch.ended(outcome)
        if time.monotonic() - self.saved > _SAVE_EVERY:
            self.save()
        if outcome.error == DiskFullError.__name__:  # the others would fill the log with the same
            finished = sum(one.entry is not None for one in self.outcomes.values())
            raise DiskFullError(f"{outcome.message} ({finished} of {len(self.cases)} cases are finished)")

    def save(self) -> None:
        self.saved = time.monotonic()
        index = Index(index_of(self.folder, self.entries).entries, tuple(self.cases))
        save_index(self.folder, index)
        write_table(self.folder, index, {key: json.loads(case.to_json()) for key, case in self.cases.items()})


def _compute(todo: Mapping[str, Case], folder: Path, book: _Book, client: Client | None, workers: int | None) -> None:
    from dask.system import CPU_COUNT

    if client is not None and todo:
        luggage = folder / "inputs"
        texts = {key: pack(case, luggage) for key, case in todo.items()}
        _distributed(texts, folder, book, client, None, client.dashboard_link)
    elif not (processes := _processes(workers, len(todo))):
        book.begin()
        for case in todo.values():
            book.ended(_here(case, folder, book, CPU_COUNT))
    else:
        texts = {key: case.to_json() for key, case in todo.items()}
        with local_client(processes) as own:
            link = own.dashboard_link if importlib.util.find_spec("bokeh") else ""
            _distributed(texts, folder, book, own, max(1, CPU_COUNT // processes), link)


def _processes(workers: int | None, cases: int) -> int:
    """Processes of the default cluster for so many cases; 0: this process."""
    from dask.system import CPU_COUNT

    if workers == 0 or (workers is None and cases <= 1):
        return 0
    return min(workers or CPU_COUNT, cases)


def _here(case: Case, folder: Path, book: _Book, threads: int) -> Outcome:
    def report(now: float, end: float) -> None:
        book.watch.reached(case.key, now, end)
        book.watch.tick()

    return bring(case, folder, progress=report, stop=None, threads=threads)


def _distributed(
    texts: Mapping[str, str], folder: Path, book: _Book, client: Client, threads: int | None, link: str
) -> None:
    """One future a case; small arguments and a small outcome each."""
    from distributed import as_completed

    name = f"roughvisc-{secrets.token_hex(4)}"
    client.subscribe_topic(name, lambda event: book.watch.reached(event[1]["key"], event[1]["now"], event[1]["end"]))
    try:
        book.begin(link)
        futures = {
            client.submit(on_worker, text, key, str(folder), name, threads, key=f"{name}-{key}", pure=False): key
            for key, text in texts.items()
        }
        finished = as_completed(futures, loop=client.loop, with_results=True, raise_errors=False)
        try:
            _drain(finished, futures, book)
        except (KeyboardInterrupt, DiskFullError):
            book.watch.stopping()
            client.run(stop_sweep, name, on_error="ignore")
            with suppress(DiskFullError):  # of the others
                _drain(finished, futures, book, _PATIENCE)
            client.cancel(list(futures))
            raise
    finally:
        with suppress(Exception):  # the scheduler may be gone
            client.unsubscribe_topic(name)


def _drain(finished: Any, futures: dict[Any, str], book: _Book, patience: float = float("inf")) -> None:
    """Take up what ends, until nothing is left."""
    until = time.monotonic() + patience
    while futures and time.monotonic() < until:
        for future, result in finished.next_batch(block=False):
            outcome = _outcome(futures.pop(future), result)
            if outcome.kind != "interrupted":
                book.ended(outcome)
        book.watch.tick()
        time.sleep(0.1)


def _outcome(key: str, result: Any) -> Outcome:
    """What a future came to."""
    from concurrent.futures import CancelledError as Cancelled

    from distributed import CancelledError, KilledWorker

    if isinstance(result, tuple):  # as_completed gives an exception as sys.exc_info does
        result = result[1]
    if isinstance(result, Outcome):
        return result
    if isinstance(result, KilledWorker):
        times = result.allowed_failures + 1
        return Outcome(
            key,
            "hindered",
            f"the process that computed it died {times} times, the last on {result.last_worker.address}: killed, or "
            "out of memory (roughvisc plan says how much a case needs); the same command goes on from its checkpoint",
            "KilledWorker",
        )
    if isinstance(result, CancelledError | Cancelled):
        raise RoughviscError("the scheduler was lost: what was finished is kept, and the same command goes on")
    return Outcome(key, "hindered", f"{type(result).__name__}: {result}", type(result).__name__)


@contextmanager
def _log_file(folder: Path) -> Iterator[None]:
    """Everything that roughvisc logs, appended to a file beside the results."""
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


class _LogFile(logging.FileHandler):
    """A log that stops nothing where it cannot be written."""

    def handleError(self, record: logging.LogRecord) -> None:
        pass
