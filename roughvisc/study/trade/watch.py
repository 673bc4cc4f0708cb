"""What a trade shows while it runs: which setting is being measured and how far it is, or nothing."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

Report = Callable[[str, float, float], None]

#: Seconds between two pictures of the bar.
_EVERY = 0.2


@contextmanager
def reporting(progress: bool | Report, console: Console | None = None) -> Iterator[Report]:
    """A function to call with a setting's name, the time reached and the time at the end. [s]

    It draws a bar; where there is no terminal it writes a line for each setting.
    """
    if callable(progress):
        yield progress
    elif not progress or (console is not None and console.quiet):
        yield lambda _label, _now, _end: None
    else:
        console = console or Console(stderr=True)
        if console.is_terminal:
            columns = BarColumn(), TextColumn("{task.description}")
            with Progress(*columns, console=console, transient=True) as bar:
                yield _bar(bar)
        else:
            yield _lines(console)


def _bar(bar: Progress) -> Report:
    task = bar.add_task("", total=1.0)
    shown = 0.0

    def report(label: str, now: float, end: float) -> None:
        nonlocal shown
        if time.monotonic() - shown > _EVERY:
            shown = time.monotonic()
            bar.update(task, description=label, completed=now / end if end else 1.0)

    return report


def _lines(console: Console) -> Report:
    last = ""

    def report(label: str, _now: float, _end: float) -> None:
        nonlocal last
        if label != last:
            last = label
            console.print(f"measuring {label}", highlight=False, soft_wrap=True)

    return report
