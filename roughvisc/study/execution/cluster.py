"""Dask clients: a local cluster for few long tasks, a scheduler that runs elsewhere; and what fits on this machine."""

from __future__ import annotations

import ast
import json
import logging
import math
import signal
import sys
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from importlib import metadata
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

from roughvisc.errors import InputError
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.resources import (
    PART,
    PROCESS,
    WORTH_ASKING,
    cores,
    curve_bytes,
    least_rows,
    march_bytes,
    memory_available,
)
from roughvisc.experiment.scene import memory_options
from roughvisc.mechanics.memory_choice import choose_memory
from roughvisc.study import study_file
from roughvisc.study.case import Case
from roughvisc.topography.grid import nominal_area

if TYPE_CHECKING:
    from distributed import Client

#: What a worker imports anyway, xarray's look for other kinds of arrays included.
_PRELOADED = ["distributed.nanny", "roughvisc.study.execution.task", "dask.array", "pint"]
#: Signals that the process of a sweep answers for its workers too.
_OURS = (signal.SIGINT, signal.SIGTERM)
#: A file that is smaller holds no surface of :data:`WORTH_ASKING` cells. [byte]
_SMALL_FILE = WORTH_ASKING


def refuse_unguarded_script() -> None:
    """Refuse to start processes for a script's line that each of them would run again.

    Raises
    ------
    InputError
        If the call comes from the top level of the script that Python was started with, and not from below
        ``if __name__ == "__main__":``.
    """
    main = sys.modules.get("__main__")
    path = getattr(main, "__file__", None)
    if path is None or getattr(main, "__spec__", None) is not None:  # a prompt, a notebook, python -c, python -m
        return
    frame: FrameType | None = sys._getframe()
    while frame is not None:
        code = frame.f_code
        if code.co_name == "<module>" and frame.f_globals.get("__name__") == "__main__" and code.co_filename == path:
            if not _guarded(Path(path), frame.f_lineno):
                raise InputError(
                    f"{path}, line {frame.f_lineno}: rv.sweep starts processes that import this script, and each would "
                    'start its own: expected the call below `if __name__ == "__main__":`, or workers=0'
                )
            return
        frame = frame.f_back


def _guarded(path: Path, line: int) -> bool:
    """Whether a line of a script stands in a block that depends on ``__name__``; true where that cannot be told."""
    try:
        tree = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return True
    return any(
        isinstance(node, ast.If)
        and any(isinstance(one, ast.Name) and one.id == "__name__" for one in ast.walk(node.test))
        and node.lineno <= line <= (node.end_lineno or line)
        for node in ast.walk(tree)
    )


@contextmanager
def local_client(processes: int) -> Iterator[Client]:
    """Client of a cluster on this machine, seen from this machine only."""
    import dask
    from distributed import Client, LocalCluster
    from distributed.system import MEMORY_LIMIT

    settings = {
        # a case merely queued on a dying worker is not to blame, and is not to die with it
        "distributed.scheduler.worker-saturation": 1.0,
        "distributed.scheduler.allowed-failures": 1,
        "distributed.comm.timeouts.connect": "60s",
        # a worker that was killed may take long to start again on a busy machine: until then it is not given up
        "distributed.deploy.lost-worker-timeout": "300s",
        # one long task a worker: nobody reads its statistical profile, and sampling takes time from it
        "distributed.worker.profile.enabled": False,
        # a process that computes for seconds need not wake up fifty times a second to see whether it is awake
        "distributed.admin.tick.interval": "1s",
        "distributed.admin.tick.limit": "60s",
        "distributed.worker.memory.monitor-interval": "500ms",
        "distributed.admin.system-monitor.interval": "2s",
        "distributed.admin.system-monitor.gil.enabled": False,
        "distributed.scheduler.active-memory-manager.start": False,  # cases share no data
    } | _quick_start()
    with dask.config.set(settings), ExitStack() as stack:
        with _interrupts_wait():  # a process that dies while it begins leaves the others in disorder
            cluster = LocalCluster(
                n_workers=processes,
                threads_per_worker=1,
                memory_limit=MEMORY_LIMIT // processes,  # fewer processes may take more each
                processes=True,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
            stack.enter_context(cluster)
            client = stack.enter_context(Client(cluster, set_as_default=False))
            client.run(_leave_interrupts_to_the_sweep)
        yield client


@contextmanager
def _interrupts_wait() -> Iterator[None]:
    """Put an interrupt off until what is inside is done; a second one is not put off."""
    if threading.current_thread() is not threading.main_thread():  # which alone is interrupted
        yield
        return
    seen: list[int] = []

    def note(number: int, _: Any) -> None:
        if seen:
            raise KeyboardInterrupt
        seen.append(number)

    # SIGTERM only where somebody takes it for an interrupt, as the command line does
    before = {number: signal.getsignal(number) for number in _OURS}
    before = {n: action for n, action in before.items() if n == signal.SIGINT or callable(action)}
    for number in before:
        signal.signal(number, note)
    try:
        yield
    finally:
        for number, action in before.items():
            signal.signal(number, action)
    for number in seen:
        signal.raise_signal(number)


def _quick_start() -> dict[str, str]:
    """Settings with which workers are forked from one process that has imported everything: each saves a second."""
    if sys.platform != "linux":  # elsewhere a fork is not safe, or there is none
        return {}
    from multiprocessing import forkserver

    import dask

    try:
        from distributed.utils import get_mp_context
    except ImportError:  # an older Dask, which settles that when it is imported
        return {}
    settings = {"distributed.worker.multiprocessing-method": "forkserver"}
    with dask.config.set(settings):
        get_mp_context().set_forkserver_preload(_PRELOADED)  # as Dask asks for it, whose own list would import more
    if threading.current_thread() is threading.main_thread():  # a Ctrl-C meanwhile is this process's own
        mine = {number: signal.signal(number, signal.SIG_IGN) for number in _OURS}  # as it, and all it forks, begin
        try:
            forkserver.ensure_running()
        finally:
            for number, action in mine.items():
                signal.signal(number, action)
    return settings


@contextmanager
def connect(address: str | None = None, file: Path | None = None) -> Iterator[Client]:
    """Client of a scheduler that runs already.

    Parameters
    ----------
    address : str, optional
        As ``tcp://host:8786``.
    file : path, optional
        What ``dask scheduler --scheduler-file`` wrote; this or the address is given.

    Raises
    ------
    InputError
        If it does not answer.
    """
    from distributed import Client

    if (address is None) == (file is None):
        raise InputError("found both an address and a file of the scheduler: expected one of them")
    if file is not None and not file.is_file():
        raise InputError(f"{file}: does not exist: expected the file written by dask scheduler --scheduler-file")
    try:
        where = {"address": address} if file is None else {"scheduler_file": str(file)}
        client = Client(**where, set_as_default=False, timeout="20s")
    except (OSError, ValueError) as error:
        raise InputError(f"{file or address}: no Dask scheduler answers there ({error})") from error
    with _quiet("distributed", "distributed.client"), client:  # a lost scheduler is reported by the sweep, once
        yield client


@contextmanager
def _quiet(*names: str) -> Iterator[None]:
    """Have some loggers report nothing but critical errors."""
    loggers = [logging.getLogger(name) for name in names]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def default_client() -> Client | None:
    """The client that the user has made the default; none within a Dask task, which is there to compute itself."""
    distributed = sys.modules.get("distributed")
    if distributed is None:  # nobody has made one
        return None
    with suppress(ValueError):
        distributed.get_worker()
        return None
    with suppress(ValueError):
        return distributed.default_client()
    return None


def require_same_version(client: Client) -> None:
    """Refuse a cluster that has a worker with another version of roughvisc, or without it.

    Raises
    ------
    InputError
        With the address of the worker and both versions.
    """
    here = metadata.version("roughvisc")
    for address, found in client.get_versions(packages=["roughvisc"])["workers"].items():
        version = found["packages"].get("roughvisc")
        if version != here:
            raise InputError(key=f"worker {address}", found=version, expected=f"roughvisc {here}, as in this process")


def _leave_interrupts_to_the_sweep() -> None:
    """A terminal's Ctrl-C, a batch system's SIGTERM reach all processes: the sweep's own tells the workers to stop."""
    for number in _OURS:
        signal.signal(number, signal.SIG_IGN)


def processes_that_fit(sizes: Iterable[float], most: int, free: float) -> int:
    """Processes side by side, one at least: as many of the largest as there is memory for.

    Parameters
    ----------
    sizes : iterable of float
        Memory of each case, that of its process included; missing ones count as none. [byte]
    most : int
        Processes at most.
    free : float
        Memory there is. [byte]

    Examples
    --------
    >>> processes_that_fit([1e9, 3e9, 2e9, 2e9], 4, 8e9), processes_that_fit([9e9, 1e9], 2, 8e9)
    (3, 1)
    """
    largest = sorted((size for size in sizes if size > 0), reverse=True)[:most]
    together = 0.0
    for count, size in enumerate(largest):
        together += size
        if together > PART * free:
            return max(count, 1)
    return most


def side_by_side(cases: Sequence[Case], most: int) -> int:
    """Processes for some cases on this machine, ``most`` at most: fewer where the memory does not hold so many."""
    if most <= 1:
        return most
    sizes = list(_sizes(cases))
    return processes_that_fit(sizes, most, memory_available().size) if any(sizes) else most


def threads_each(processes: int) -> int:
    """Threads of each of some cases that run side by side on this machine."""
    return max(1, cores() // max(processes, 1))


def _sizes(cases: Sequence[Case]) -> Iterable[float]:
    """Memory of each case that is large; zero of the others. [byte]"""
    surfaces: dict[str, tuple[int, float]] = {}
    for case in cases:
        name = json.dumps(case.surface, sort_keys=True)
        if name not in surfaces:
            surfaces[name] = _cells_and_area(case)
        cells, area = surfaces[name]
        if cells < WORTH_ASKING:
            yield 0.0
            continue
        settings, experiment = case.settings, case.experiment()
        if isinstance(experiment, Loading):
            program = experiment.program.on_area(area)
            memory = choose_memory(case.body(), **memory_options(program, settings)).memory
            yield PROCESS + march_bytes(settings, memory, cells, rows=least_rows(settings, program))
        else:
            yield PROCESS + curve_bytes(settings, cells)


def _cells_and_area(case: Case) -> tuple[int, float]:
    """Cells of a case's surface, and its area [m2]; no cells where it is small, or cannot be had."""
    shape = study_file.cells(case.surface["resample"]) if case.surface.get("resample") else case.made_shape
    if shape is not None:
        return math.prod(shape), 1.0
    file = case.surface.get("file")
    try:
        if file is None or Path(file).stat().st_size < _SMALL_FILE:
            return 0, 1.0
        height = case.height()
    except (OSError, ValueError):  # it fails in its own time
        return 0, 1.0
    return height.size, nominal_area(height)
