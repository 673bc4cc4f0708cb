"""Ctrl-C and SIGTERM on the command line: one message, and exit status 130 or 143, at whatever moment they come.

It is imported before all else, so it imports nothing that takes time.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

INTERRUPTED = "interrupted; finished work is kept; repeat the command to resume"

#: An interrupt that came during an import is tried again after so long. [s]
_AGAIN = 0.01
#: Signals that came during an import and wait for its end.
_waiting: list[int] = []


class Terminated(KeyboardInterrupt):
    """SIGTERM, which batch systems send some time before they kill."""


@contextmanager
def ending_at_once() -> Iterator[None]:
    """Have Ctrl-C and SIGTERM end the process there and then: what is inside computes nothing, and may be an import."""
    with _handled(_end_process):
        yield


@contextmanager
def terminable() -> Iterator[None]:
    """Have SIGTERM end what is inside as Ctrl-C does, so that a running case writes its checkpoint first.

    Libraries take an interrupt during their import for an error of their own, and some end the process by it. So it
    waits for the end of an import.
    """
    with _handled(_interrupt):
        yield


@contextmanager
def _handled(action: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Take both signals, but for one that somebody else takes care of."""
    mine = threading.current_thread() is threading.main_thread()
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)} if mine else {}
    usual = (signal.SIG_DFL, signal.default_int_handler, _end_process)
    taken = {number: found for number, found in before.items() if found in usual}
    for number in taken:
        signal.signal(number, action)
    try:
        yield
    finally:
        for number, found in taken.items():
            signal.signal(number, found)


def _end_process(number: int, _: FrameType | None) -> None:
    os.write(2, f"roughvisc: {INTERRUPTED}\n".encode())
    os._exit(128 + number)


def end_if_interrupted() -> None:
    """Raise the interrupt that waits for the end of an import: called before anything is written."""
    if _waiting:
        _interrupt(_waiting[-1], None)


def _interrupt(number: int, frame: FrameType | None) -> None:
    if _imports(frame):
        _waiting.append(number)
        later = threading.Timer(_AGAIN, _send, (number,))
        later.daemon = True
        later.start()
        return
    _waiting.clear()
    if number == signal.SIGTERM:
        signal.signal(number, signal.SIG_IGN)  # once is enough: the checkpoint is being written
        raise Terminated
    raise KeyboardInterrupt


def _imports(frame: Any) -> bool:
    """Whether a module is being imported where a signal came."""
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False


def _send(number: int) -> None:
    """Send a signal to the main thread, which may be waiting for something."""
    if not _waiting:  # it was raised meanwhile
        return
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, number)
    else:
        signal.raise_signal(number)
