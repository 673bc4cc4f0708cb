"""Progress of computations: bars on a terminal or in a notebook, a line every few seconds elsewhere."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn
from rich.table import Column
from rich.text import Text

from roughvisc.errors import printable

#: Time between two lines. [s]
LINE_EVERY = 10.0
#: Time from which the speed of a computation is estimated. [s]
_RECENT = 600.0


class Bars(Progress):
    """Progress bars by label; they close at the end of the block.

    Parameters
    ----------
    console : rich.console.Console, optional
        Default: the standard error.
    """

    def __init__(self, console: Console | None = None) -> None:
        console = console or Console(stderr=True)
        draws = find_spec("ipywidgets") if console.is_jupyter else console.is_terminal and not console.is_dumb_terminal
        super().__init__(
            TextColumn(
                "{task.description}", markup=False, table_column=Column(ratio=1, no_wrap=True, overflow="ellipsis")
            ),
            BarColumn(12),
            TextColumn("{task.fields[at]}", markup=False),
            TimeRemainingColumn(compact=True),
            console=console,
            transient=True,
            expand=True,
            disable=console.quiet or not draws,
            speed_estimate_period=_RECENT,
        )
        self._labels: dict[str, TaskID] = {}
        self._line_at = time.monotonic()

    def reached(self, label: str, now: float, end: float, at: str = "") -> None:
        """Move the bar of a computation; both are zero at its start, and `at` describes them."""
        if label not in self._labels:
            self._labels[label] = self.add_task(printable(label), at="")
        self.update(self._labels[label], completed=now, total=end or None, at=at or "starting")

    def close(self, label: str) -> None:
        """Remove the bar of a computation, if there is one."""
        if label in self._labels:
            self.remove_task(self._labels.pop(label))

    def line(self, label: str) -> None:
        """Write a line on a computation, if bars are not drawn and some time has passed since the last line."""
        if self.disable and label in self._labels and time.monotonic() - self._line_at >= LINE_EVERY:
            self._line_at = time.monotonic()
            task = next(task for task in self.tasks if task.id == self._labels[label])
            left = "" if task.time_remaining is None else f", about {clock(task.time_remaining)} left"
            self.say(f"{label}: {task.fields['at']}{left}, {clock(task.elapsed or 0.0)} so far")

    def say(self, line: str) -> None:
        """Write a line, above the bars if there are any."""
        to_file = not self.console.is_terminal  # a terminal without wrapping breaks lines inside words
        self.console.print(Text(printable(line)), soft_wrap=to_file)


@contextmanager
def reporting(
    label: str, at: Callable[[float, float], str], console: Console | None = None
) -> Iterator[Callable[[float, float], None]]:
    """Yield ``report(now, end)``, which moves a progress bar; the bar closes at the end of the block.

    Parameters
    ----------
    label : str
        Name of the computation.
    at : callable
        Description of ``(now, end)``.
    console : rich.console.Console, optional
        Default: the standard error.
    """
    with Bars(console) as bars:

        def report(now: float, end: float) -> None:
            bars.reached(label, now, end, at(now, end) if end else "")
            bars.line(label)

        yield report


@contextmanager
def sign_of_life(what: str) -> Iterator[None]:
    """Show on a terminal, from one second on, that a computation without a known length is running.

    Parameters
    ----------
    what : str
        Activity, such as ``"reads the scan"``.
    """
    status = Console(stderr=True).status(f"{what} ...")
    timer = threading.Timer(1.0, status.start)
    timer.daemon = True
    if status.console.is_terminal:
        timer.start()
    try:
        yield
    finally:
        timer.cancel()
        if timer.is_alive():
            timer.join()
        status.stop()


def clock(seconds: float) -> str:
    """Return a duration as short text.

    Examples
    --------
    >>> clock(0.04), clock(75), clock(4000), clock(200000)
    ('0 s', '75 s', '67 min', '55.6 h')
    """
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
