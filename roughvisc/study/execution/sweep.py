"""Sweeps: many cases in this process or on Dask, with one file each; their display, and their observables.

A failed case does not stop the others.
"""

from __future__ import annotations

import errno
import json
import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr
from rich.console import Console

from roughvisc.errors import InputError, RoughviscError
from roughvisc.labels import warnings_of
from roughvisc.observables import OBSERVABLES
from roughvisc.progress import Bars, clock
from roughvisc.solve import Progress
from roughvisc.study.case import Case, cases_given
from roughvisc.study.case_text import value_text
from roughvisc.study.execution.cluster import (
    default_client,
    distribute,
    local_client,
    require_same_version,
    require_synchronous,
    threads_each,
)
from roughvisc.study.execution.run import FULL, REFUSED, Outcome, attempt, outcome_of, result_folder, run_case
from roughvisc.study.storage.folder import (
    case_path,
    clean_folder,
    lock_case,
    log_file,
    record_failure,
    require_writable,
    write_json,
)
from roughvisc.study.storage.netcdf import open_result, write_result
from roughvisc.study.storage.sweep_data import SWEEP, index_of, numbers_of, open_results, sweep_cases, write_table

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger("roughvisc")

#: Attribute of a result: the arguments of each observable that it contains, as JSON.
OBSERVED = "observed"


def sweep(
    cases: Sequence[Case] | str | Path,
    out: str | Path | None = None,
    client: Client | None = None,
    *,
    progress: bool = True,
    workers: int | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Compute many cases, store each in a file, and open the results together.

    The files contain the quantities that ``[observe]`` of the study requests.
    Finished cases are not computed again, and identical cases are computed once. Repeat the call to resume; failed
    cases are tried again. In a script, call it below ``if __name__ == "__main__":``, because the workers of the default
    cluster are processes that import the script.

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
        If the input is invalid or the client asynchronous (nothing runs), the call is at the top level of a script,
        some results lie over time and others over speed, or a quantity in ``[observe]`` cannot be computed from a
        result (the results are kept).
    RoughviscError
        If no case could be finished. If some cases fail, they are recorded in the folder and logged as warnings. A case
        that needs more memory than its worker has is refused and not recorded, because it may fit elsewhere.
    """
    cases = cases_given(cases)
    folder = result_folder(cases[0], out).absolute()
    if client is None and workers is None:
        client = default_client()
    outcomes = run_study(
        cases,
        folder,
        client=client,
        workers=workers,
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


def run_one(case: Case, folder: Path, *, progress: bool | Progress = False, threads: int | None = None) -> Path:
    """Compute a case and the quantities that it requests in ``[observe]``, and return the file; see :func:`run_case`.

    Raises
    ------
    InputError
        If a quantity cannot be computed from the result, which is kept; and as :func:`run_case`.
    """
    path = run_case(case, folder, progress=progress, threads=threads)
    observe([case], folder)
    return path


def run_study(
    cases: Sequence[Case], folder: Path, *, display: Display, client: Client | None = None, **computing: Any
) -> dict[str, Outcome]:
    """Compute cases and the quantities that they request in ``[observe]``; see :func:`run_cases`.

    Raises
    ------
    InputError
        If a quantity cannot be computed from a result, which is kept; and as :func:`run_cases`.
    """
    outcomes = run_cases(cases, folder, display=display, client=client, **computing)
    if any(case.observed for case in cases):
        display.say("computes the quantities in [observe]")
        with client.as_current() if client is not None else nullcontext():
            observe(cases, folder)
    return outcomes


def run_cases(
    cases: Sequence[Case],
    folder: Path,
    *,
    display: Display,
    client: Client | None = None,
    workers: int | None = None,
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
        If a setting is wrong, or the folder is not writable.
    OSError
        If the disk is full; no further case is started.
    RoughviscError
        If the scheduler was lost.
    KeyboardInterrupt
        If interrupted; running cases finish their step first.
    """
    if workers is not None and (client is not None or workers < 0):
        raise InputError(key="workers", found=workers, expected="0 or more, and none together with a client")
    require_synchronous(client)
    distinct, folder = {case.key: case for case in cases}, folder.absolute()
    require_writable(folder, "for the results")
    folder.mkdir(parents=True, exist_ok=True)
    clean_folder(folder)
    listed = sweep_cases(cases)
    with log_file(folder):
        write_json(folder / SWEEP, listed)
        index, outcomes = index_of(folder), dict[str, Outcome]()
        for key in distinct:
            if entry := index.get(key):
                outcomes[key] = outcome_of(entry, reused=True)
        todo = {key: case for key, case in distinct.items() if key not in outcomes}
        log.info("sweep of %d cases, %d of them to compute", len(distinct), len(todo))
        for key, case in distinct.items():
            if case.late_times:
                log.info("%s: %s", key, case.note)
        display.begin(cases, numbers_of(listed))
        for outcome in outcomes.values():
            display.ended(outcome)
        warned = set[str]()
        try:
            with closing(_computed(todo, folder, display, client, workers, threads)) as found:
                for outcome in found:
                    outcomes[outcome.key] = outcome
                    _record(outcome, distinct[outcome.key], folder)
                    display.ended(outcome)
                    for subject, text in warnings_of(outcome.entry.attributes).items() if outcome.entry else ():
                        if subject not in warned:
                            warned.add(subject)
                            display.say(f"{text} (The log names all cases with a warning.)", outcome.key)
                    if outcome.error in FULL:  # further cases would also fail
                        done = sum(one.entry is not None for one in outcomes.values())
                        text = f"{outcome.message} ({done} of {len(distinct)} cases are finished)"
                        raise OSError(errno.ENOSPC, text)
        except (KeyboardInterrupt, SystemExit, OSError) as error:
            log.warning("interrupted after %d of %d cases: %r", len(outcomes), len(distinct), error)
            raise
        finally:
            index = index_of(folder, [outcome.entry for outcome in outcomes.values() if outcome.entry])
            for key in [key for key, one in outcomes.items() if one.entry is None and key in index]:
                outcomes[key] = outcome_of(index[key], reused=True)  # another run has finished it
            write_table(folder)
            display.close()
    return {key: outcomes[key] for key in distinct}


def _computed(
    todo: dict[str, Case],
    folder: Path,
    display: Display,
    client: Client | None,
    workers: int | None,
    threads: int | None,
) -> Iterator[Outcome]:
    """Compute cases on the workers of a client, in processes of a local cluster, or in this process."""
    processes = min(threads_each(1) if workers is None else workers, len(todo))
    if not todo or (client is None and (not processes or (workers is None and processes == 1))):
        for key, case in todo.items():
            display.reached(key, 0.0, 0.0)
            yield attempt(case, folder, progress=partial(display.reached, key), threads=threads or threads_each(1))
        return
    texts = {key: case.to_json() for key, case in todo.items()}
    if client is not None:
        require_same_version(client)
        log.info("dashboard: %s", client.dashboard_link)
        display.say(f"Dashboard: {client.dashboard_link}")
        yield from distribute(texts, folder, display, client, threads)
        return
    while texts:
        large = {}
        with local_client(processes) as own:
            display.say(f"Dashboard: {own.dashboard_link}")
            for outcome in distribute(texts, folder, display, own, threads or threads_each(processes), own=True):
                if outcome.error == "TooLargeError" and workers is None and processes > 1:
                    large[outcome.key] = texts[outcome.key]
                else:
                    yield outcome
        texts, processes = large, max(1, min(processes // 2, len(large)))
        if large:
            display.say(f"{len(large)} cases need more memory: they are computed in fewer processes ({processes})")


def _record(outcome: Outcome, case: Case, folder: Path) -> None:
    """Log the end of a case, and write or remove the record of its failure."""
    level = logging.INFO if outcome.kind == "done" else logging.WARNING
    told = (outcome.key, outcome.kind, outcome.seconds, json.dumps(dict(case.varied)), outcome.message)
    log.log(level, "%s %s %.3g s %s %s", *told)
    for text in warnings_of(outcome.entry.attributes).values() if outcome.entry else ():
        log.info("%s: %s", outcome.key, text)
    try:
        if outcome.entry:
            case_path(folder, outcome.key, "failure").unlink(missing_ok=True)  # the case failed before
        elif outcome.kind == "failed":
            record_failure(folder, case, message=outcome.message, error=outcome.error, traceback=outcome.trace)
    except (OSError, InputError) as error:  # must not stop the other cases
        log.warning("%s: its record of a failure cannot be changed: %s", outcome.key, error)


class Display:
    """Bars and messages of a sweep; times in seconds.

    Parameters
    ----------
    show : bool
        Whether to show anything.
    console : rich.console.Console, optional
        Default: the standard error. Without a terminal it shows a line every few seconds.
    """

    def __init__(self, show: bool = True, console: Console | None = None) -> None:
        self._bars = Bars(console if show else Console(quiet=True))
        self._lock = threading.Lock()
        self._names: dict[str, str] = {}
        self._at: dict[str, Callable[[float, float], str]] = {}
        self._running: dict[str, float] = {}  # computed fraction of each program
        self._ended: dict[str, Outcome] = {}
        self._began = time.monotonic()

    def begin(self, cases: Sequence[Case], numbers: Mapping[str, int]) -> None:
        """Show the cases, in the order of the study; `numbers` gives the number of each key."""
        for case in cases:
            varied = ", ".join(f"{name} = {value_text(name, x)}" for name, x in case.varied.items())
            self._names[case.key] = f"case {numbers[case.key]}" + (f" ({varied[:60]})" if varied else "")
            self._at[case.key] = case.experiment.progress
        self._bars.start()
        with self._lock:
            self._move()

    def reached(self, key: str, now: float, end: float) -> None:
        """Move the bar of a running case, from any thread; both times are zero when it begins."""
        with self._lock:
            if key not in self._ended:
                self._running[key] = now / end if end else 0.0
                self._bars.reached(self._names[key], now, end, self._at[key](now, end) if end else "")
                self._move()

    def ended(self, outcome: Outcome) -> None:
        """Close the bar of a case, and write the message of a failed case."""
        with self._lock:
            self._ended[outcome.key] = outcome
            self._running.pop(outcome.key, None)
            self._bars.close(self._names[outcome.key])
            self._move()
        if outcome.kind != "done":
            self.say(f"{outcome.kind}: {outcome.message}", outcome.key)

    def say(self, text: str, key: str = "") -> None:
        """Write a line; with `key` the name of this case comes first."""
        self._bars.say(f"{self._names[key]}: {text}" if key else text)

    def close(self) -> None:
        """End the display."""
        self._bars.stop()
        self._bars.say(f"{self._summary()}, in {clock(time.monotonic() - self._began)}")

    def _move(self) -> None:
        """Move the bar of the sweep."""
        self._bars.reached("sweep", sum(self._running.values()) + len(self._ended), len(self._names), self._summary())
        self._bars.line("sweep")

    def _summary(self) -> str:
        kinds = [outcome.kind for outcome in self._ended.values()]
        parts = [f"{kinds.count('done')} of {len(self._names)} cases done"]
        for kind in ("failed", "hindered"):
            parts += [f"{kinds.count(kind)} {kind}"] if kind in kinds else []
        return ", ".join([*parts, *([f"{len(self._running)} running"] if self._running else [])])


def observe(
    cases: Sequence[Case] | str | Path,
    out: str | Path | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> list[Path]:
    """Compute the quantities in ``[observe]`` of a study from its finished results, and add them to the files.

    :func:`roughvisc.run`, :func:`roughvisc.sweep` and ``roughvisc run`` do so at the end. Call this function with the
    same arguments after a change of ``[observe]``: no case is computed again. Quantities that a file already contains,
    for equal arguments, are not computed again.
    Frames are Dask tasks, on the default client if there is one, otherwise in threads.

    Parameters
    ----------
    cases : sequence of Case, or path
        Cases, or their study file. Unfinished cases are skipped.
    out : path, optional
        Results folder. Default: ``results/`` and the name of the study, next to the study.
    progress : callable, optional
        Called with the number of finished cases and the total number.

    Returns
    -------
    list of pathlib.Path
        The files that were changed.

    Raises
    ------
    InputError
        If a quantity cannot be computed from a result; its file is not changed. If the default client is asynchronous.
    """
    cases = cases_given(cases)
    distinct = {case.key: case for case in cases if case.observed}
    folder = result_folder(cases[0], out).absolute()
    require_synchronous(default_client())
    added = []
    for number, case in enumerate(distinct.values()):
        if progress is not None:
            progress(number, len(distinct))
        path = case_path(folder, case.key, "result")
        if path.exists() and _add(case, path):
            added.append(path)
    if added and len(cases) > 1:
        write_table(folder)
    return added


def _add(case: Case, path: Path) -> bool:
    """Add the missing quantities of one case to its file; return whether any was missing."""
    if not _lacking(case, open_result(path)):
        return False
    with lock_case(case_path(path.parent, case.key, "lock")), open_result(path) as result:
        lacking = _lacking(case, result)  # again, because the file may have changed
        frames = result.chunk({dim: 1 if dim == "time" else -1 for dim in result.dims})  # a block is a frame
        try:
            parts = [OBSERVABLES[name](frames, **arguments) for name, arguments in lacking.items()]
            found = xr.merge(parts, compat="equals", join="exact").compute()
        except InputError as error:
            raise error.prefixed(str(path)) from error
        known = json.loads(result.attrs.get(OBSERVED, "{}")) | lacking
        whole = result.drop_vars(set(found.data_vars) & set(result.data_vars)).merge(
            found, compat="equals", join="exact"
        )
        whole.attrs = result.attrs | {"case": case.to_json(), OBSERVED: json.dumps(known)}
        write_result(whole, path)
    log.info("%s: added %s", path, ", ".join(lacking))
    return True


def _lacking(case: Case, result: xr.Dataset) -> dict[str, Any]:
    """Return the observables that a result lacks, or contains for other arguments."""
    before = json.loads(result.attrs.get(OBSERVED, "{}"))
    return {name: values for name, values in case.observed.items() if before.get(name) != values}
