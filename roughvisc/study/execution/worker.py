"""A worker that is told to leave: it closes in order, and the case that it computes writes a checkpoint first."""

from __future__ import annotations

import signal
import threading
from typing import TYPE_CHECKING

from distributed.core import Status

if TYPE_CHECKING:
    from distributed import Worker

_LEAVING = (Status.closing_gracefully, Status.closing, Status.closed)


def is_leaving(worker: Worker) -> bool:
    """Whether a worker was told to leave: by a signal, or since its lifetime is over."""
    return worker.status in _LEAVING


def close_on_sigterm(worker: Worker) -> None:
    """Have a worker close in order at SIGTERM; called by its task, from whatever thread.

    Batch systems send SIGTERM to every process of a job. Dask's nanny knows what to do; its worker would end there and
    then. No plugin of the cluster: a worker without roughvisc could not load it.
    """
    worker.loop.add_callback(_take_signals, worker)


def _take_signals(worker: Worker) -> None:
    if threading.current_thread() is not threading.main_thread():  # a thread of the user's own process
        return
    if signal.getsignal(signal.SIGTERM) != signal.SIG_IGN:  # else the process of the sweep answers for it
        signal.signal(signal.SIGTERM, lambda *_: worker.loop.add_callback(worker.close, nanny=False, reason="SIGTERM"))
