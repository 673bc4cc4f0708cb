"""Bars and messages of a sweep on a terminal."""

from __future__ import annotations

import math
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from rich.console import Console

from roughvisc.progress import Bars, clock
from roughvisc.runs.run import Outcome
from roughvisc.study.case import Case
from roughvisc.study.case_text import short_words

#: Longest text of the varied values of a case.
_LONGEST = 60
#: Time between two moves of the bars by running cases. [s]
_MOVE_EVERY = 0.1


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
        self._computed = 0.0  # sum of these fractions
        self._ended: set[str] = set()
        self._kinds = Counter[str]()
        self._moved = -math.inf  # time of the last move of a bar
        self._began = time.monotonic()

    def begin(self, cases: Sequence[Case], numbers: Mapping[str, int]) -> None:
        """Show the cases, in the order of the study; `numbers` gives the number of each key."""
        for case in cases:
            varied = short_words(case.varied)
            self._names[case.key] = f"case {numbers[case.key]}" + (f" ({varied[:_LONGEST]})" if varied else "")
            self._at[case.key] = case.experiment.progress
        self._bars.start()
        with self._lock:
            self._move()

    def reached(self, key: str, now: float, end: float) -> None:
        """Move the bar of a running case, from any thread; both times are zero when it begins."""
        with self._lock:
            if key not in self._ended:
                fraction = now / end if end else 0.0
                self._computed += fraction - self._running.get(key, 0.0)
                self._running[key] = fraction
                if end and time.monotonic() - self._moved < _MOVE_EVERY:
                    return
                self._moved = time.monotonic()
                self._bars.reached(self._names[key], now, end, self._at[key](now, end) if end else "")
                self._move()

    def ended(self, outcome: Outcome) -> None:
        """Close the bar of a case, and write the message of a failed case."""
        with self._lock:
            self._ended.add(outcome.key)
            self._kinds[outcome.kind] += 1
            self._computed -= self._running.pop(outcome.key, 0.0)
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
        self._bars.reached("sweep", self._computed + len(self._ended), len(self._names), self._summary())
        self._bars.line("sweep")

    def _summary(self) -> str:
        parts = [f"{self._kinds['done']} of {len(self._names)} cases done"]
        for kind in ("failed", "hindered"):
            if self._kinds[kind]:
                parts.append(f"{self._kinds[kind]} {kind}")
        return ", ".join([*parts, *([f"{len(self._running)} running"] if self._running else [])])
