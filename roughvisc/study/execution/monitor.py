"""Displays and records of a running sweep."""

from __future__ import annotations

import errno
import json
import logging
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from roughvisc.errors import printable
from roughvisc.progress import Bars, clock
from roughvisc.study.case import Case
from roughvisc.study.execution.task import IN_WORDS, Outcome
from roughvisc.study.storage.failures import forget_failure, record_failure
from roughvisc.study.storage.files import is_writable
from roughvisc.study.storage.index import Entry, index_of, save_index
from roughvisc.study.storage.sweep_cases import number_by_key, sweep_cases, write_sweep
from roughvisc.study.storage.table import write_table

log = logging.getLogger("roughvisc")

#: Seconds between two savings of the index while a sweep runs.
_SAVE_EVERY = 60.0
#: Most messages on cases that ended badly.
_SHOWN = 8


def watcher(progress: bool, console: Console | None = None, summary: bool = True) -> Monitor:
    """Return a live display, or one that shows urgent messages only."""
    return LiveMonitor(console, summary) if progress else Monitor()


class Monitor:
    """Display of a running sweep, times in seconds; this one shows urgent messages only."""

    def begin(self, cases: Sequence[Case], link: str) -> None:
        """The cases, in the order of the study, and the address of Dask's dashboard if there is one."""

    def reached(self, key: str, now: float, end: float) -> None:
        """A running case has reached `now` of `end`; called from any thread."""

    def ended(self, outcome: Outcome) -> None:
        """A case ended."""

    def tick(self) -> None:
        """Called several times a second."""

    def message(self, text: str) -> None:
        """Show an urgent message."""
        print(f"roughvisc: {printable(text)}", file=sys.stderr)

    def stopping(self) -> None:
        """The sweep is interrupted and waits for the running cases to stop."""

    def close(self) -> None:
        """Nothing more follows."""


class LiveMonitor(Monitor):
    """A bar for the sweep and one for each running case; lines on cases that end badly.

    Parameters
    ----------
    console : rich.console.Console or None
        Default: the standard error. Without a terminal it has a line every few seconds.
    summary : bool
        Whether a last line states how many cases are done.
    """

    def __init__(self, console: Console | None, summary: bool = True) -> None:
        self._sums_up = summary
        self._lock = threading.Lock()
        self._names: dict[str, str] = {}
        self._at: dict[str, Callable[[float, float], str]] = {}
        self._running: dict[str, float] = {}  # fraction of the program that is computed
        self._ended: dict[str, Outcome] = {}
        self._began = time.monotonic()
        self._bars = Bars(console)
        self._complaints = 0

    def begin(self, cases: Sequence[Case], link: str) -> None:
        self._at = {case.key: case.at for case in cases}
        numbers = number_by_key(sweep_cases(cases))
        self._names = {case.key: _name(case, numbers[case.key]) for case in reversed(cases)}
        self._began = time.monotonic()
        if link:
            self._bars.say(f"Dashboard: {link}")
        self._bars.start()
        self._show()

    def reached(self, key: str, now: float, end: float) -> None:
        with self._lock:
            if key in self._ended:
                return
            self._running[key] = now / end if end else 0.0
            self._bars.reached(self._names[key], now, end, self._at[key](now, end) if end else "")
        self._show()

    def ended(self, outcome: Outcome) -> None:
        with self._lock:
            self._ended[outcome.key] = outcome
            self._running.pop(outcome.key, None)
            self._bars.close(self._names[outcome.key])
        self._show()
        if outcome.kind in ("failed", "hindered", "held", "unconverged") and not outcome.reused:
            self._complaints += 1
            if self._complaints <= _SHOWN:
                self._bars.say(f"{self._names[outcome.key]}: {IN_WORDS[outcome.kind]}: {outcome.message}")
            elif self._complaints == _SHOWN + 1:
                self._bars.say("further cases that end so are counted here, and named in the log")

    def tick(self) -> None:
        self._bars.line("sweep")

    def message(self, text: str) -> None:
        self._bars.say(text)

    def stopping(self) -> None:
        self._bars.say("stopping: the running cases finish their step; Ctrl-C again ends at once")

    def close(self) -> None:
        self._bars.stop()
        if self._names and self._sums_up:
            self._bars.say(f"{self._summary()}, in {clock(time.monotonic() - self._began)}")

    def _show(self) -> None:
        """Move the bar of the sweep."""
        with self._lock:
            done = sum(self._running.values()) + len(self._ended)
        self._bars.reached("sweep", done, len(self._names), self._summary())

    def _summary(self) -> str:
        with self._lock:
            kinds = [outcome.kind for outcome in self._ended.values()]
            running = len(self._running)
        parts = [f"{kinds.count('done')} of {len(self._names)} cases done"]
        for kind in ("unconverged", "failed", "hindered", "held"):
            parts += [f"{kinds.count(kind)} {IN_WORDS[kind]}"] if kind in kinds else []
        return ", ".join([*parts, *([f"{running} running"] if running else [])])


def _name(case: Case, number: int) -> str:
    """``case 3 (program.0.load = 20 mN)``."""
    varied = ", ".join(f"{key} = {case.written.get(key) or json.dumps(value)}" for key, value in case.varied.items())
    if len(varied) > 60:
        varied = f"{varied[:57]}..."
    return f"case {number}" + (f" ({varied})" if varied else "")


@dataclass
class SweepLog:
    """Keeps account of a sweep.

    Attributes
    ----------
    folder : Path
        Of the results.
    stated : sequence of Case
        The cases, in the order of the study.
    outcomes : dict
        How those ended that have ended.
    watch : Monitor
        Who is told.
    entries : list of Entry
        Of the results that are known.
    saved : float
        When the index was saved last, by the monotonic clock. [s]
    """

    folder: Path
    stated: Sequence[Case]
    outcomes: dict[str, Outcome]
    watch: Monitor
    entries: list[Entry]
    saved: float = 0.0

    def __post_init__(self) -> None:
        self.cases = {case.key: case for case in self.stated}
        self._listed = sweep_cases(self.stated)
        if is_writable(self.folder):
            write_sweep(self.folder, self._listed)

    def begin(self, link: str = "") -> None:
        self.saved = time.monotonic()
        self.watch.begin(self.stated, link)
        for outcome in self.outcomes.values():
            self.watch.ended(outcome)
        if link:
            log.info("dashboard: %s", link)

    def ended(self, outcome: Outcome) -> None:
        self.outcomes[outcome.key] = outcome
        case = self.cases[outcome.key]
        varied = json.dumps(dict(case.varied))
        level = logging.INFO if outcome.kind == "done" else logging.WARNING
        log.log(
            level, "%s %s %.3g s %s %s", outcome.key, IN_WORDS[outcome.kind], outcome.seconds, varied, outcome.message
        )
        if outcome.trace:
            log.error("%s", outcome.trace)
        if outcome.kind == "failed" and len(self.cases) > 1:
            record_failure(self.folder, case, outcome.message, outcome.error, outcome.trace)
        elif outcome.entry is not None:
            self.entries.append(outcome.entry)
            forget_failure(self.folder, outcome.key)
        self.watch.ended(outcome)
        if len(self.cases) > 1 and time.monotonic() - self.saved > _SAVE_EVERY:
            self.save()
        if outcome.disk_full:  # the others would fill the log with the same
            finished = sum(one.entry is not None for one in self.outcomes.values())
            raise OSError(errno.ENOSPC, f"{outcome.message} ({finished} of {len(self.cases)} cases are finished)")

    def tell(self, message: str) -> None:
        """Show an urgent message, and log it."""
        log.warning("%s", message)
        self.watch.message(message)

    def save(self) -> None:
        """Write the index and the table of the folder, unless it is not writable."""
        self.saved = time.monotonic()
        if not is_writable(self.folder):
            return
        index = index_of(self.folder, self.entries)
        save_index(self.folder, index)
        held = {key: outcome.message for key, outcome in self.outcomes.items() if outcome.kind == "held"}
        write_table(self.folder, index, self._listed, held)
