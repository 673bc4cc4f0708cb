"""What this process may use: memory that it may yet take, and cores.

Memory is limited by the machine, by control groups (containers, batch systems), by the process's own limit and by its
Dask worker; cores by the affinity of the process and the quota of its container.
"""

from __future__ import annotations

import multiprocessing
import sys
import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scipy import fft

from roughvisc.errors import InputError

_PROCESS, _GROUPS = Path("/proc/self"), Path("/sys/fs/cgroup")
#: Files of a control group: its limit, what is used, and what of that is a cache of files that may go at any time.
_FILES = {
    "memory": ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    "": ("memory.max", "memory.current", "inactive_file"),
}


@dataclass(frozen=True)
class Available:
    """Memory that may yet be taken.

    Attributes
    ----------
    size : float
        [byte]
    words : str
        Whose limit that is, as the end of a sentence that begins with the size.
    """

    size: float
    words: str


def memory_available() -> Available:
    """Memory that this process may yet take, and what limits it."""
    return min([*_machine(), *_groups(), *_own(), *_worker()], key=lambda one: one.size)


def _machine() -> Iterator[Available]:
    import psutil

    yield Available(float(psutil.virtual_memory().available), "free in this machine")


def _groups() -> Iterator[Available]:
    """What the control groups of this process leave, of version 1 and 2, up to the outermost."""
    try:
        lines = (_PROCESS / "cgroup").read_text().split()
    except OSError:  # no Linux
        return
    for line in lines:
        _, kind, path = line.split(":", 2)
        if kind not in _FILES:
            continue
        root = _GROUPS / kind
        group = root / path.lstrip("/")
        for folder in {root, group, *(place for place in group.parents if root in place.parents)}:
            with suppress(OSError, ValueError):  # not to be seen from inside a container, or without a limit
                limit, used, cache = _FILES[kind]
                counts = dict(line.split() for line in (folder / "memory.stat").read_text().splitlines())
                taken = int((folder / used).read_text()) - int(counts.get(cache, 0))
                yield Available(float(int((folder / limit).read_text()) - taken), "left of the container's limit")


def _own() -> Iterator[Available]:
    """What is left of the address space that the process may have."""
    with suppress(ImportError):  # there is none on Windows
        import resource

        import psutil

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            yield Available(
                float(limit - psutil.Process().memory_info().vms), "left of this process's limit (ulimit -v)"
            )


def _worker() -> Iterator[Available]:
    worker = _dask_worker()
    limit = getattr(getattr(worker, "memory_manager", None), "memory_limit", None)
    if limit:
        import psutil

        taken = psutil.Process().memory_info().rss
        yield Available(float(limit - taken), "left of the Dask worker's memory limit")


def _dask_worker() -> Any:
    """The worker whose task this is; None where it is none."""
    distributed = sys.modules.get("distributed")
    if distributed is not None:
        with suppress(ValueError):
            return distributed.get_worker()
    return None


def cores() -> int:
    """Cores that this process may use."""
    from dask.system import CPU_COUNT

    return int(CPU_COUNT)


def threads_for(asked: int | None) -> int:
    """Threads of a case that is computed here.

    Parameters
    ----------
    asked : int or None
        None: as ``scipy.fft.set_workers`` has it; where nobody has set that, all cores for a case that is alone, in
        the main thread of a process that no other has started, and else one.

    Raises
    ------
    InputError
        If it is no positive whole number.
    """
    if asked is not None:
        if isinstance(asked, bool) or not isinstance(asked, int) or asked < 1:
            raise InputError(f"threads is {asked!r}: expected a whole number of at least 1, or None")
        return asked
    stated = int(fft.get_workers())
    alone = threading.current_thread() is threading.main_thread() and multiprocessing.parent_process() is None
    return cores() if stated == 1 and alone else stated
