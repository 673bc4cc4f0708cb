"""Sweeps: many cases in this process or on Dask, with one file each; a failed case does not stop the others."""

from __future__ import annotations

import errno
import importlib.util
import json
import logging
import time
from collections.abc import Iterable, Sequence
from contextlib import nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from roughvisc.errors import InputError, RoughviscError
from roughvisc.experiment.resources import cores
from roughvisc.labels import warnings_of
from roughvisc.study.case import Case, program, read_cases
from roughvisc.study.execution.cluster import (
    default_client,
    local_client,
    require_same_version,
    side_by_side,
    threads_each,
)
from roughvisc.study.execution.display import Display
from roughvisc.study.execution.run import REFUSED, Outcome, attempt, outcome_of, result_folder
from roughvisc.study.storage.folder import (
    is_writable,
    log_file,
    record_failure,
    record_path,
    recorded_failure,
    require_writable,
)
from roughvisc.study.storage.index import clean_folder, index_of
from roughvisc.study.storage.results_table import write_table
from roughvisc.study.storage.sweep_data import open_results, sweep_cases, write_sweep

if TYPE_CHECKING:
    import xarray as xr
    from distributed import Client

log = logging.getLogger("roughvisc")

#: Time after which a running sweep writes its index and its table again. [s]
_SAVE_EVERY = 60.0


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
        given, a cluster on this machine, or this process for a single case. The cluster has one process per core, or
        fewer processes with more threads each if the memory is too small.
    retry_failed : bool
        Compute cases that failed before again.
    progress : bool
        Show a progress bar.
    workers : int, optional
        Number of processes of the default cluster; 0: this process.
    threads : int, optional
        Number of threads of each case on a large grid. Default: an equal share of the cores; with a client, all threads
        of a worker.

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
        that needs more memory than its worker has is refused and not recorded, because it may fit elsewhere.
    """
    if isinstance(cases, str | Path):
        cases = read_cases(cases)
    if not cases:
        raise InputError("cases is empty: expected at least one case")
    folder = result_folder(cases[0], out).absolute()
    if client is None and workers is None:
        client = default_client()
    outcomes = run_cases(
        cases,
        folder,
        client=client,
        workers=workers,
        retry_failed=retry_failed,
        threads=threads,
        display=Display(progress),
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
    display: Display,
    client: Client | None = None,
    workers: int | None = None,
    retry_failed: bool = False,
    threads: int | None = None,
) -> dict[str, Outcome]:
    """Compute the cases without a result; see :func:`sweep`.

    Returns
    -------
    dict
        Key of each distinct case -> its outcome, in the order of the cases.

    Raises
    ------
    InputError
        If a setting is wrong, or there are cases to compute and the folder is not writable.
    OSError
        If the disk is full; no further case is started.
    RoughviscError
        If the scheduler was lost.
    KeyboardInterrupt
        If interrupted; running cases finish their step first.
    """
    if workers is not None and (client is not None or workers < 0):
        expected = "no number of workers together with a client" if client is not None else "0 or more"
        raise InputError(key="workers", found=workers, expected=expected)
    if client is not None and client.asynchronous:
        raise InputError(key="client", found=client, expected="a Client(asynchronous=False)")
    distinct, folder = {case.key: case for case in cases}, folder.absolute()
    writable = is_writable(folder)
    if writable:
        folder.mkdir(parents=True, exist_ok=True)
        clean_folder(folder)
    with log_file(folder) if writable else nullcontext():
        index = index_of(folder) if folder.exists() else {}
        outcomes: dict[str, Outcome] = {}
        for key in distinct:
            if entry := index.get(key):
                outcomes[key] = outcome_of(entry, reused=True)
            elif (failed := recorded_failure(folder, key)).get("source") == program() and not retry_failed:
                outcomes[key] = Outcome(key, "failed", failed["message"], failed["error"], reused=True)
        todo = {key: case for key, case in distinct.items() if key not in outcomes}
        if todo:
            require_writable(folder, f"since there are cases to compute ({len(todo)} of {len(distinct)})")
        if client is None and workers is None:
            workers = side_by_side(list(todo.values()), min(cores(), len(todo))) if len(todo) > 1 else 0
        log.info("sweep of %d cases, %d of them to compute", len(distinct), len(todo))
        record = Record(folder, cases, outcomes, display)
        if not writable:
            record.warn(f"{folder}: is not writable: all cases are finished, and nothing is written")
        try:
            _compute(todo, record, client, min(workers or 0, len(todo)), threads)
            record.warn_of_cases(todo)
        except (KeyboardInterrupt, SystemExit, OSError) as error:
            reason = str(error) or type(error).__name__
            log.warning("interrupted after %d of %d cases: %s", len(outcomes), len(distinct), reason)
            raise
        finally:
            record.save()
            display.close()
    return {key: outcomes[key] for key in distinct}


def _compute(todo: dict[str, Case], record: Record, client: Client | None, processes: int, threads: int | None) -> None:
    """Compute cases on the workers of a client, in some processes of a local cluster, or in this process."""
    if todo and (client is not None or processes):
        from roughvisc.study.execution.dispatch import distribute  # slow to import

        texts = {key: case.to_json() for key, case in todo.items()}
        if client is not None:
            require_same_version(client)
            record.begin(client.dashboard_link)
            distribute(texts, record, client, threads)
        else:
            with local_client(processes) as own:
                record.begin(own.dashboard_link if importlib.util.find_spec("bokeh") else "")
                distribute(texts, record, own, threads or threads_each(processes), own=True)
        return
    record.begin()
    for key, case in todo.items():
        progress = partial(record.display.reached, key)
        record.ended(attempt(case, record.folder, progress=progress, threads=threads or cores()))


class Record:
    """Record of a running sweep: outcomes of its cases, log, table and index.

    Parameters
    ----------
    folder : Path
        Results folder.
    cases : sequence of Case
        Cases in the order of the study.
    outcomes : dict
        Key -> outcome of each finished case; the record adds further outcomes.
    display : Display
        Display of the sweep.
    """

    def __init__(self, folder: Path, cases: Sequence[Case], outcomes: dict[str, Outcome], display: Display) -> None:
        self.folder, self.display = folder, display
        self._stated, self._outcomes = cases, outcomes
        self._cases = {case.key: case for case in cases}
        self._listed = sweep_cases(cases)
        self._saved = time.monotonic()
        write_sweep(folder, self._listed)

    def begin(self, link: str = "") -> None:
        """Display the cases, and the address of Dask's dashboard."""
        if link:
            log.info("dashboard: %s", link)
        self.display.begin(self._stated, link)
        for outcome in self._outcomes.values():
            self.display.ended(outcome)

    def ended(self, outcome: Outcome) -> None:
        """Record the end of a case.

        Raises
        ------
        OSError
            If the disk was full, because further cases would also fail.
        """
        self._outcomes[outcome.key] = outcome
        case, level = self._cases[outcome.key], logging.INFO if outcome.kind == "done" else logging.WARNING
        told = (outcome.key, outcome.kind, outcome.seconds, json.dumps(dict(case.varied)), outcome.message)
        log.log(level, "%s %s %.3g s %s %s", *told)
        if outcome.trace:
            log.error("%s", outcome.trace)
        if outcome.kind == "failed" and len(self._cases) > 1:
            record_failure(self.folder, case, outcome.message, outcome.error, outcome.trace)
        self.display.ended(outcome)
        if time.monotonic() - self._saved > _SAVE_EVERY:
            self.save()
        if outcome.disk_full:
            finished = sum(one.entry is not None for one in self._outcomes.values())
            raise OSError(errno.ENOSPC, f"{outcome.message} ({finished} of {len(self._cases)} cases are finished)")

    def warn(self, text: str) -> None:
        """Display and log an urgent message."""
        log.warning("%s", text)
        self.display.warn(text)

    def warn_of_cases(self, keys: Iterable[str]) -> None:
        """Display one warning of each subject in the results of some cases, and the number of cases that have it."""
        found: dict[str, dict[str, str]] = {}
        for key in keys:
            entry = self._outcomes[key].entry
            for subject, text in warnings_of(entry.attributes).items() if entry else ():
                if subject not in ("accuracy", "speeds"):  # the messages of the cases state unsolved speeds
                    found.setdefault(subject, {})[key] = text
        for texts in found.values():
            key, text = next(iter(texts.items()))
            if len(texts) > 1:
                text += f" ({len(texts)} of {len(self._cases)} cases have a warning of this kind.)"
            log.warning("%s: %s", key, text)
            self.display.say(text, key)

    def save(self) -> None:
        """Write the index and the table of the folder, and take over results that another run has finished."""
        self._saved = time.monotonic()
        if not is_writable(self.folder):
            return
        index = index_of(self.folder, [outcome.entry for outcome in self._outcomes.values() if outcome.entry])
        for key, outcome in self._outcomes.items():
            if key in index:
                with suppress(OSError):  # the case failed before
                    record_path(self.folder, key).unlink(missing_ok=True)
                if outcome.entry is None:
                    self._outcomes[key] = outcome_of(index[key], reused=True)
        write_table(self.folder)
