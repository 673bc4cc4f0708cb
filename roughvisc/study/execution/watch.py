"""What a sweep shows while it runs: one live display, plain lines where there is no terminal, or nothing."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Sequence
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from roughvisc.study.execution.task import Outcome
from roughvisc.study.statement.case import Case

#: Seconds between two lines, and two pictures of the live display.
_LINE_EVERY, _PICTURE_EVERY = 10.0, 0.2
#: Running cases that are shown.
_SHOWN = 8


def watcher(progress: bool, console: Console | None = None) -> Watch | Silence:
    """Who watches a sweep: a display, or nobody."""
    return Watch(console or Console(stderr=True)) if progress else Silence()


class Silence:
    """Shows nothing."""

    def begin(self, cases: Sequence[Case], link: str) -> None: ...
    def reached(self, key: str, now: float, end: float) -> None: ...
    def ended(self, outcome: Outcome) -> None: ...
    def tick(self) -> None: ...
    def stopping(self) -> None: ...
    def close(self) -> None: ...


class Watch:
    """Cases done, running and failed, and the time left.

    Parameters
    ----------
    console : rich.console.Console
        Where to; without a terminal plain lines are written every few seconds.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._lock = threading.Lock()
        self._names: dict[str, str] = {}
        self._running: dict[str, tuple[float, float]] = {}
        self._ended: dict[str, Outcome] = {}
        self._began = self._shown = time.monotonic()
        self._live: Live | None = None
        self._line = ""
        self._stopping = False

    def begin(self, cases: Sequence[Case], link: str) -> None:
        """The distinct cases, in order, and the address of Dask's dashboard if there is one."""
        self._names = {case.key: _name(case, number, len(cases)) for number, case in enumerate(cases, 1)}
        self._began = self._shown = time.monotonic()
        if link:
            self._console.print(f"Dashboard: {link}", soft_wrap=True, highlight=False)
        if self._console.is_terminal and not self._console.quiet:
            self._live = Live(self._picture(), console=self._console, auto_refresh=False, transient=True)
            self._live.start()

    def reached(self, key: str, now: float, end: float) -> None:
        """A running case is at this time of so much."""
        with self._lock:
            if key not in self._ended:
                self._running[key] = (now, end)

    def ended(self, outcome: Outcome) -> None:
        """A case ended."""
        with self._lock:
            self._ended[outcome.key] = outcome
            self._running.pop(outcome.key, None)
        if outcome.kind in ("failed", "hindered", "unconverged") and not outcome.reused:
            text = f"{self._names[outcome.key]}: {outcome.kind}: {outcome.message}"
            self._console.print(Text(text), soft_wrap=True)

    def tick(self) -> None:
        """Show what has changed."""
        since = time.monotonic() - self._shown
        if self._live is not None and since >= _PICTURE_EVERY:
            self._shown = time.monotonic()
            self._live.update(self._picture(), refresh=True)
        elif self._live is None and since >= _LINE_EVERY:
            self._shown = time.monotonic()
            self._say(self._summary())

    def stopping(self) -> None:
        """The sweep is interrupted and waits for the running cases to stop."""
        self._stopping = True
        self._say("stopping: the running cases finish their step")

    def close(self) -> None:
        """Nothing more follows."""
        if self._live is not None:
            self._live.stop()
            self._live = None
        if self._names:
            self._say(self._summary())

    def _say(self, line: str) -> None:
        if line != self._line:
            self._line = line
            self._console.print(line, highlight=False, soft_wrap=True)

    def _summary(self) -> str:
        with self._lock:
            kinds = [outcome.kind for outcome in self._ended.values()]
            fresh = sum(not outcome.reused for outcome in self._ended.values())
            running = dict(self._running)
        total, elapsed = len(self._names), time.monotonic() - self._began
        parts = [f"{kinds.count('done')} of {total} cases done"]
        for kind in ("unconverged", "failed", "hindered"):
            parts += [f"{kinds.count(kind)} {kind}"] if kind in kinds else []
        if running:
            parts.append(f"{len(running)} running")
        worked = fresh + sum(now / end for now, end in running.values() if end)
        if worked and len(kinds) < total:
            parts.append(f"about {clock(elapsed * (total - len(kinds) + fresh - worked) / worked)} left")
        parts.append(f"{clock(elapsed)} so far" if len(kinds) < total else f"in {clock(elapsed)}")
        return ", ".join(parts)

    def _picture(self) -> Any:
        with self._lock:
            running, ended = dict(self._running), len(self._ended)
        rows = Table.grid(padding=(0, 1))
        rows.add_row(Text("stopping" if self._stopping else "cases", style="bold"), _bar(ended, len(self._names)))
        for key, (now, end) in list(running.items())[:_SHOWN]:
            at = f"t = {now:.3g} of {end:.3g} s" if end else "starting"
            rows.add_row(Text(self._names.get(key, key)), _bar(now, end), Text(at))
        more = len(running) - _SHOWN
        return Group(rows, *([Text(f"and {more} more")] if more > 0 else []), Text(self._summary()))


def _bar(done: float, total: float) -> ProgressBar:
    return ProgressBar(total=total or 1.0, completed=done, width=30)


def _name(case: Case, number: int, total: int) -> str:
    """``case 3 of 12 (program.0.load = 0.02)``."""
    varied = ", ".join(f"{key} = {json.dumps(value)}" for key, value in case.varied.items())
    if len(varied) > 60:
        varied = f"{varied[:57]}..."
    return f"case {number} of {total}" + (f" ({varied})" if varied else "")


def clock(seconds: float) -> str:
    """A length of time as one says it.

    Examples
    --------
    >>> clock(0.04), clock(75), clock(4000), clock(200000)
    ('0 s', '75 s', '67 min', '55.6 h')
    """
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
