"""Progress display: live on a terminal or in a notebook, plain lines elsewhere."""

from __future__ import annotations

import math
import time
from bisect import bisect
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from roughvisc.errors import ON_SCREEN, printable, shortened

#: Seconds between two lines, and between two pictures.
LINE_EVERY, PICTURE_EVERY = 10.0, 0.2
#: Ratio of the elapsed times at which two successive progress records are kept.
_NOTED = 1.02
#: Smallest exponent for the extrapolation of progress; progress is then nearly exponential in time.
_LEAST_POWER = 1e-3

#: A label, how much is done of how much (None: no bar), and a text beside the bar.
Row = tuple[str, float, float | None, str]


class Display:
    """Shows rows with bars, or a line now and then.

    Parameters
    ----------
    console : rich.console.Console or None
        Where to; None: the standard error.
    rows : callable
        Gives the rows to draw.
    line : callable
        Gives what is said in a line where nothing can be drawn.
    below : bool
        Whether the line is drawn, too, below the rows.
    """

    def __init__(
        self, console: Console | None, rows: Callable[[], Iterable[Row]], line: Callable[[], str], below: bool = False
    ) -> None:
        self.console = console or Console(stderr=True)
        self._rows, self._line, self._below = rows, line, below
        self._shown, self._said = time.monotonic(), ""
        self._live: Live | None = None

    def start(self) -> None:
        """Begin to draw, where that is possible."""
        self._shown = time.monotonic()
        if self.draws:
            self._live = Live(self._picture(), console=self.console, auto_refresh=False, transient=True)
            self._live.start(refresh=True)

    @property
    def draws(self) -> bool:
        """Whether there is something to draw on."""
        notebook = self.console.is_jupyter and find_spec("ipywidgets") is not None
        return (self.console.is_terminal or notebook) and not (self.console.quiet or self.console.is_dumb_terminal)

    def tick(self) -> None:
        """Show what has changed, if it is time to."""
        if time.monotonic() - self._shown < (LINE_EVERY if self._live is None else PICTURE_EVERY):
            return
        self._shown = time.monotonic()
        if self._live is None:
            self.say(self._line())
        else:
            self._live.update(self._picture(), refresh=True)

    def say(self, line: str) -> None:
        """Write a line, once; a picture stays below it."""
        if line != self._said:
            self._said = line
            self.console.print(Text(shortened(printable(line), ON_SCREEN)), soft_wrap=True)

    def stop(self) -> None:
        """Draw no more: the picture vanishes."""
        if self._live is not None:
            self._live.stop()
            self._live = None

    def _picture(self) -> Group:
        rows = Table.grid(padding=(0, 1))
        for label, done, total, text in self._rows():
            bar = "" if total is None else ProgressBar(total=total or 1.0, completed=done, width=30)
            rows.add_row(Text(printable(label)), bar, Text(text))
        return Group(rows, *([Text(self._line())] if self._below else []))


class Bar:
    """One row, of what is computed one after the other.

    Parameters
    ----------
    console : rich.console.Console, optional
        Where to; None: the standard error.
    label : str
        What is computed.
    at : callable, optional
        Text for the time reached and the time at the end. [s]
    """

    def __init__(
        self, console: Console | None = None, label: str = "", at: Callable[[float, float], str] | None = None
    ) -> None:
        self._at = at or (lambda now, end: f"t = {now:.3g} of {end:.3g} s")
        self._label, self._now, self._end, self._pace = label, 0.0, 0.0, Pace()
        self._display = Display(console, self._rows, self._line)

    def __enter__(self) -> Bar:
        self._display.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._display.stop()

    def reached(self, now: float, end: float) -> None:
        """It is at this time of so much. [s]"""
        self._now, self._end = now, end
        self._pace.reached(now)
        self._display.tick()

    def measured(self, label: str, now: float, end: float) -> None:
        """Of several things computed in turn, this one is at this time of so much [s]; a line names each anew."""
        if label != self._label:
            self._label, self._pace = label, Pace()
            if not self._display.draws:
                self._display.say(f"measuring {label}")
        self.reached(now, end)

    def _rows(self) -> list[Row]:
        return [(self._label, self._now, self._end, self._text())]

    def _line(self) -> str:
        return f"{self._label}: {self._text()}"

    def _text(self) -> str:
        words = [self._at(self._now, self._end) if self._end else "starting"]
        if 0 < self._now < self._end:
            words.append(f"about {clock(self._pace.left(self._now, self._end))} left")
        return ", ".join([*words, f"{clock(self._pace.spent)} so far"])


class Pace:
    """Progress of a computation that starts when this object is created."""

    def __init__(self) -> None:
        self._began = time.monotonic()
        self._noted: list[tuple[float, float]] = []  # elapsed time [s] and position

    @property
    def spent(self) -> float:
        """Elapsed time. [s]"""
        return time.monotonic() - self._began

    def reached(self, now: float) -> None:
        """Record that the computation has reached this position."""
        if not self._noted or self.spent > _NOTED * self._noted[-1][0]:
            self._noted.append((self.spent, now))

    def left(self, now: float, end: float) -> float:
        """Estimated time from the position ``now`` to the end. [s]"""
        return time_left([*self._noted, (self.spent, now)], end)


@contextmanager
def reporting(
    progress: bool | Callable[..., None],
    label: str = "",
    console: Console | None = None,
    at: Callable[[float, float], str] | None = None,
) -> Iterator[Callable[..., None]]:
    """What a computation calls with the time it has reached and the time at its end [s]; a bar ends with the block.

    Parameters
    ----------
    progress : bool or callable
        Whether to draw a bar, or what is called instead.
    label : str
        What is computed; where empty, the call begins with the name of what is computed at the time.
    console : rich.console.Console, optional
        Where to; None: the standard error.
    at : callable, optional
        As :class:`Bar` takes it.
    """
    if callable(progress):
        yield progress
    elif not progress:
        yield lambda *_: None
    else:
        with Bar(console, label, at) as bar:
            yield bar.reached if label else bar.measured


def time_left(noted: list[tuple[float, float]], end: float) -> float:
    """Estimated remaining time of a computation, extrapolated from its recent progress. [s]

    The time steps of a creeping contact grow with time, so the simulated time increases ever faster. The estimate finds
    the exponent, at most one, for which this power of the position increased linearly over the last two thirds of the
    elapsed time, and continues that line to the end.

    Parameters
    ----------
    noted : list of (float, float)
        Elapsed time [s] and position, in order; the last record is the present one.
    end : float
        Position at the end.

    Examples
    --------
    >>> time_left([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)], 10.0)
    8.0
    """
    (began, _), (spent, now) = noted[0], noted[-1]
    thirds = (began + (spent - began) * part / 3 for part in (1, 2))
    (early, first), (middle, then) = (noted[max(bisect(noted, (third, math.inf)) - 1, 0)] for third in thirds)
    if not (early < middle < spent and first < then < now):
        return spent * (end - now) / now

    def quickened(power: float) -> bool:
        """Whether this power of the position increased faster in the last third of the time than in the second."""
        last, before = 1 - (then / now) ** power, (then / now) ** power - (first / now) ** power
        return last * (middle - early) > before * (spent - middle)

    low, high = _LEAST_POWER, 1.0  # the exponent lies between them
    if not quickened(high):
        low = high
    while high - low > _LEAST_POWER:
        power = (low + high) / 2
        low, high = (low, power) if quickened(power) else (power, high)
    return (spent - middle) * ((end / now) ** high - 1) / (1 - (then / now) ** high)


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
