"""Progress display of a trade."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console

from roughvisc.study.progress import Bar

Report = Callable[[str, float, float], None]


@contextmanager
def reporting(progress: bool | Report, console: Console | None = None) -> Iterator[Report]:
    """A function to call with a setting's name, the time reached and the time at the end. [s]

    It draws a bar; where there is no terminal it writes a line for each setting.
    """
    if callable(progress):
        yield progress
    elif not progress:
        yield lambda _label, _now, _end: None
    else:
        with Bar(console) as bar:

            def report(label: str, now: float, end: float) -> None:
                bar.turned_to(label)
                bar.reached(now, end)

            yield report
