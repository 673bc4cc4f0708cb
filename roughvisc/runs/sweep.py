"""Sweeps: many cases in this process or on Dask, with one file each.

A failed case does not stop the others.
"""

from __future__ import annotations

import errno
import json
import logging
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from roughvisc.arguments import count
from roughvisc.errors import InputError, RoughviscError
from roughvisc.labels import warnings_of
from roughvisc.runs.cluster import (
    default_client,
    distribute,
    local_client,
    require_same_version,
    require_synchronous,
    threads_each,
)
from roughvisc.runs.csv_files import update_table
from roughvisc.runs.display import Display
from roughvisc.runs.folder import (
    case_path,
    clean_folder,
    log_file,
    record_failure,
    require_writable,
)
from roughvisc.runs.observed import observe
from roughvisc.runs.run import FULL, REFUSED, Outcome, attempt, outcome_of, result_folder, run_case
from roughvisc.runs.sweep_data import index_of, numbers_of, open_results, require_own_folder, write_sweep
from roughvisc.solve import Progress
from roughvisc.study.case import Case, cases_given

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger("roughvisc")

#: Time that a cluster on this machine needs to start, mostly for the imports of its processes. [s]
_START = 3.0


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
        If the input is invalid, the folder holds the sweep of another study, or the client is asynchronous (nothing
        runs); if the call is at the top level of a script, or some results lie over time and others over speed; or if a
        quantity in ``[observe]`` cannot be computed from a result (the results are kept).
    RoughviscError
        If no case could be finished. If some cases fail, they are recorded in the folder and logged as warnings. A case
        that needs more memory than its worker has is refused and not recorded, because it may fit elsewhere.

    See Also
    --------
    roughvisc.vary, roughvisc.open_results, roughvisc.to_table, roughvisc.plot.sweep

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> ball, press = rv.sphere(radius=1e-3, size=2e-4, shape=15), rv.Program().load(1e-5, over="1 s")
    >>> case = rv.Case(ball, rv.zener(3e6, 1e6, 1e5), press, tolerance=1e-2, times=3)
    >>> cases = rv.vary(case, {"material.shear_modulus": ["2 MPa", "4 MPa"]})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     results = rv.sweep(cases, folder, workers=0, progress=False).load()
    >>> results.material_shear_modulus.values.tolist()
    [2000000.0, 4000000.0]
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
        If the folder holds the sweep of another study; if a quantity cannot be computed from the result, which is
        kept; and as :func:`run_case`.
    """
    require_own_folder([case], folder)
    path = run_case(case, folder, progress=progress, threads=threads)
    observe([case], folder, progress=False)
    return path


def run_study(
    cases: Sequence[Case], folder: Path, *, display: Display, client: Client | None = None, **computing: Any
) -> dict[str, Outcome]:
    """Compute cases and the quantities that they request in ``[observe]``; see :func:`run_cases`.

    Raises
    ------
    InputError
        If the folder holds the sweep of another study; if a quantity cannot be computed from a result, which is kept;
        and as :func:`run_cases`.
    """
    require_own_folder(cases, folder)
    outcomes = run_cases(cases, folder, display=display, client=client, **computing)
    if any(case.observed for case in cases):
        display.say("computes the quantities in [observe]")
        with client.as_current() if client is not None else nullcontext():
            observe(cases, folder, progress=False)
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
    count("threads", threads, 1)
    if count("workers", workers, 0) is not None and client is not None:
        raise InputError(key="workers", found=workers, expected="None together with a client")
    require_synchronous(client)
    distinct = {case.key: case for case in cases}
    folder = folder.absolute()
    require_writable(folder, "for the results")
    folder.mkdir(parents=True, exist_ok=True)
    clean_folder(folder)
    distinct = {key: case.stored(folder) for key, case in distinct.items()}
    with log_file(folder):
        write_sweep(cases, folder)
        index = index_of(folder)
        outcomes = dict[str, Outcome]()
        for key in distinct:
            if entry := index.get(key):
                outcomes[key] = outcome_of(entry, reused=True)
        todo = {key: case for key, case in distinct.items() if key not in outcomes}
        log.info("sweep of %d cases, %d of them to compute", len(distinct), len(todo))
        for key, case in distinct.items():
            if case.late_times:
                log.info("%s: %s", key, case.note)
        display.begin(cases, numbers_of({case.key: {"varied": dict(case.varied)} for case in cases}))
        for outcome in outcomes.values():
            display.ended(outcome)
        warned = set[str]()
        try:
            with closing(_computed(todo, folder, display, client, workers, threads)) as computed:
                for outcome in computed:
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
            update_table(folder)
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
    todo = dict(todo)
    processes = min(threads_each(1) if workers is None else workers, len(todo))
    if client is None and workers is None and processes > 1:
        for outcome in _while_a_cluster_would_start(todo, folder, display, threads):
            del todo[outcome.key]
            yield outcome
        processes = min(processes, len(todo))
    if not todo or (client is None and (not processes or (workers is None and processes == 1))):
        for key, case in todo.items():
            display.reached(key, 0.0, 0.0)
            yield attempt(case, folder, progress=partial(display.reached, key), threads=threads or threads_each(1))
        return
    if client is not None:
        require_same_version(client)
        log.info("dashboard: %s", client.dashboard_link)
        display.say(f"Dashboard: {client.dashboard_link}")
        yield from distribute(todo, folder, display, client, threads)
        return
    while todo:
        large = {}
        with local_client(processes) as own:
            display.say(f"Dashboard: {own.dashboard_link}")
            for outcome in distribute(todo, folder, display, own, threads or threads_each(processes), own=True):
                if outcome.error == "TooLargeError" and workers is None and processes > 1:
                    large[outcome.key] = todo[outcome.key]
                else:
                    yield outcome
        todo = large
        processes = max(1, min(processes // 2, len(large)))
        if large:
            display.say(f"{len(large)} cases need more memory: they are computed in fewer processes ({processes})")


def _while_a_cluster_would_start(
    todo: Mapping[str, Case], folder: Path, display: Display, threads: int | None
) -> Iterator[Outcome]:
    """Compute cases in this process for the time in which a cluster would start, and all if little more is needed.

    A case that is not finished then has a checkpoint, from which a worker continues to the same bits.
    """
    began = time.monotonic()
    total = len(todo)
    finished = 0
    is_over = False

    def stop() -> bool:
        nonlocal is_over
        spent = time.monotonic() - began
        is_over = spent > _START and spent / max(finished, 1) * (total - finished) > _START
        return is_over

    for key, case in list(todo.items()):
        display.reached(key, 0.0, 0.0)
        progress = partial(display.reached, key)
        try:
            outcome = attempt(case, folder, progress=progress, stop=stop, threads=threads or threads_each(1))
        except KeyboardInterrupt:
            if not is_over:  # Ctrl-C
                raise
            return
        finished += 1
        yield outcome
        if stop():
            return


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
