"""Dask clients of a local cluster or a running scheduler, and the number of processes that fit in the memory."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import metadata
from typing import TYPE_CHECKING

from roughvisc.errors import InputError, RoughviscError
from roughvisc.experiment.resources import PART, PROCESS
from roughvisc.solve import cores

if TYPE_CHECKING:
    from distributed import Client


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


def require_same_version(client: Client) -> None:
    """Refuse a cluster in which a worker has another version of roughvisc, or none.

    Raises
    ------
    InputError
        If a version differs; the message states the address of the worker and both versions.
    """
    here = metadata.version("roughvisc")
    for address, found in client.get_versions(packages=["roughvisc"])["workers"].items():
        version = found["packages"].get("roughvisc")
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
    return max(1, cores() // max(processes, 1))
