"""Many cases on Dask: one task and one file each; what is finished is kept, and what fails stops nothing else."""

from __future__ import annotations

import importlib.util
import logging
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from roughvisc.errors import InputError, RoughviscError
from roughvisc.experiment.resources import cores
from roughvisc.study.case import Case, read_cases
from roughvisc.study.execution.cluster import (
    default_client,
    local_client,
    refuse_unguarded_script,
    require_same_version,
    side_by_side,
    threads_each,
)
from roughvisc.study.execution.monitor import Monitor, SweepLog
from roughvisc.study.execution.run import result_folder, set_aside_damaged
from roughvisc.study.execution.task import REFUSED, Outcome, outcome_of, run_case_safely
from roughvisc.study.storage.failures import forget_failure, log_file, recorded_failure
from roughvisc.study.storage.files import is_writable, require_writable
from roughvisc.study.storage.index import Index, index_of, warn_of
from roughvisc.study.storage.results import open_results
from roughvisc.study.storage.upkeep import clean_folder

if TYPE_CHECKING:
    import xarray as xr
    from distributed import Client

log = logging.getLogger("roughvisc")


def sweep(
    cases: Sequence[Case] | str | Path,
    out: str | Path | None = None,
    client: Client | None = None,
    *,
    retry_failed: bool = False,
    progress: bool = True,
    workers: int | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Compute many cases, store each in a file, and open the results together.

    Finished cases are not computed again, and identical cases are computed once. Repeat the call to resume. In a
    script, call it below ``if __name__ == "__main__":``, because the workers of the default cluster are processes that
    import the script.

    Parameters
    ----------
    cases : sequence of Case, or path
        Cases, or their study file.
    out : path, optional
        Results folder, under the same path for all workers. Default: ``results/`` and the name of the study, next to
        the study.
    client : distributed.Client, optional
        Client of the cluster. Default: the default client, which ``Client()`` sets. If there is none, or `workers` is
        given, a cluster on this machine, or this process for a single case. It has one process per core, or fewer with
        more threads each if the memory does not hold as many cases.
    retry_failed : bool
        Compute cases that failed before again.
    progress : bool
        Show a progress bar.
    workers : int, optional
        Number of processes of the default cluster; 0: this process.
    threads : int, optional
        Number of threads of each case on a large grid. Default: its share of the cores; on the workers of a client, all
        their threads.

    Returns
    -------
    xarray.Dataset
        Results of the finished cases, as from :func:`open_results`.

    Raises
    ------
    InputError
        If the input is invalid (nothing runs), the call is at the top level of a script, or the results differ in times
        or grid.
    RoughviscError
        If no case could be finished. If some cases fail, they are recorded in the folder and logged as warnings. A case
        that needs more memory than its worker has is refused by itself and not recorded, because it may fit elsewhere.
    """
    if isinstance(cases, str | Path):
        cases = read_cases(cases)
    if not cases:
        raise InputError("cases is empty: expected at least one case")
    folder = result_folder(cases[0], out, to_write=False).absolute()
    if client is None and workers is None:
        client = default_client()
    from roughvisc.study.execution.monitor import watcher

    outcomes = run_cases(
        cases,
        folder,
        client=client,
        workers=workers,
        retry_failed=retry_failed,
        threads=threads,
        watch=watcher(progress),
    )
    bad = [outcome for outcome in outcomes.values() if outcome.kind != "done"]
    for outcome in bad:
        log.warning("%s: %s: %s", outcome.key, outcome.kind, outcome.message)
    if not any(outcome.entry for outcome in outcomes.values()):
        kind = InputError if all(o.error in REFUSED for o in bad) else RoughviscError
        raise kind(f"none of {len(outcomes)} cases could be finished; the first: {bad[0].message}")
    return open_results(folder, cases=cases)


def run_cases(
    cases: Sequence[Case],
    folder: Path,
    *,
    watch: Monitor,
    client: Client | None = None,
    workers: int | None = None,
    retry_failed: bool = False,
    threads: int | None = None,
) -> dict[str, Outcome]:
    """Bring all cases to their files; see :func:`sweep`.

    Returns
    -------
    dict
        Key of each distinct case -> how it ended, in the order of the cases.

    Raises
    ------
    InputError
        If a setting is wrong, or a file under the name of a result cannot be read.
    OSError
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
    writable = is_writable(folder)
    if not folder.exists():
        require_writable(folder)
        folder.mkdir(parents=True)
    with log_file(folder) if writable else nullcontext():
        if writable:
            clean_folder(folder)
        index = index_of(folder, warn=False)
        outcomes = _known(distinct, folder, index, retry_failed)
        todo = {key: case for key, case in distinct.items() if key not in outcomes}
        if todo:
            require_writable(folder, f"since there are cases to compute ({len(todo)} of {len(distinct)})")
        processes = 0 if client is not None else _processes(workers, list(todo.values()))
        if processes:
            try:
                refuse_unguarded_script()
            except InputError:
                with suppress(OSError):  # of other results in it
                    folder.rmdir()
                raise
        log.info("sweep of %d cases, %d of them to compute", len(distinct), len(todo))
        book = SweepLog(folder, cases, outcomes, watch, [o.entry for o in outcomes.values() if o.entry])
        try:
            _tell_beforehand(book, index, todo, writable)
            _compute(todo, folder, book, client, processes, threads)
        except (KeyboardInterrupt, SystemExit):
            log.warning("interrupted after %d of %d cases", len(outcomes), len(distinct))
            raise
        except OSError as error:
            log.warning("%s", error.strerror or error)
            raise
        finally:
            book.save()
            watch.close()
        hindered = {key: case for key, case in todo.items() if outcomes[key].kind in ("hindered", "held")}
        for key, entry in index_of(folder).entries.items() if hindered else ():
            if key in hindered:  # another run has finished it meanwhile
                outcomes[key] = outcome_of(entry, reused=True)
    return {key: outcomes[key] for key in distinct}


def _tell_beforehand(book: SweepLog, index: Index, todo: Mapping[str, Case], writable: bool) -> None:
    """Say what there is to say of the folder before anything is computed, each thing once."""
    if not writable:
        book.tell(f"{book.folder}: is not writable: all cases are finished, and nothing is written")
    problems = dict(index.problems)
    for key in index.problems.keys() & todo.keys():
        if told := set_aside_damaged(todo[key], book.folder):
            book.watch.message(told)
            del problems[key]
    warn_of(book.folder, problems)


def _known(distinct: Mapping[str, Case], folder: Path, index: Index, retry_failed: bool) -> dict[str, Outcome]:
    """What needs not be computed: finished cases, and those that are known to fail."""
    outcomes = {}
    for key in distinct:
        record = recorded_failure(folder, key)
        entry = index.entries.get(key)
        if entry is not None:
            forget_failure(folder, key)
            outcomes[key] = outcome_of(entry, reused=True)
        elif record is not None and not retry_failed:
            outcomes[key] = Outcome(key, "failed", record["message"], record["error"], reused=True)
    return outcomes


def _compute(
    todo: Mapping[str, Case],
    folder: Path,
    book: SweepLog,
    client: Client | None,
    processes: int,
    threads: int | None,
) -> None:
    if not todo or (client is None and not processes):

        def report(key: str, now: float, end: float) -> None:
            book.watch.reached(key, now, end)
            book.watch.tick()

        book.begin()
        for key, case in todo.items():
            progress, here = partial(report, key), threads or cores()
            book.ended(run_case_safely(case, folder, progress=progress, stop=None, threads=here))
        return
    from roughvisc.study.execution.dispatch import distribute

    texts = {key: case.to_json() for key, case in todo.items()}
    if client is not None:
        require_same_version(client)
        distribute(texts, book, client, threads, client.dashboard_link)
        return
    with local_client(processes) as own:
        link = own.dashboard_link if importlib.util.find_spec("bokeh") else ""
        distribute(texts, book, own, threads or threads_each(processes), link)


def _processes(workers: int | None, cases: Sequence[Case]) -> int:
    """Processes of the default cluster for some cases; 0: this process."""
    if workers is not None:
        return min(workers, len(cases))
    if len(cases) <= 1:
        return 0
    return side_by_side(cases, min(cores(), len(cases)))
