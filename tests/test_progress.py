"""What is shown while something is computed."""

import io

import numpy as np
import pytest
from rich.console import Console

import roughvisc as rv
from roughvisc import progress
from roughvisc.progress import Bar


@pytest.fixture
def shown(monkeypatch):
    """A console on a terminal or not, and what is written to it; everything is shown at once."""
    monkeypatch.setattr(progress, "LINE_EVERY", 0.0)
    monkeypatch.setattr(progress, "PICTURE_EVERY", 0.0)

    def on(terminal, **settings):
        return Console(file=io.StringIO(), force_terminal=terminal, width=100, **settings)

    return on


def test_bar__is_drawn_on_a_terminal_and_vanishes(shown):
    console = shown(True)
    with Bar(console, "a [strange] name") as bar:
        bar.reached(0.25, 2.0)
        drawn = console.file.getvalue()
    assert "a [strange] name " in drawn
    assert "━" in drawn
    assert "t = 0.25 of 2 s, about 0 s left, 0 s so far" in drawn
    assert console.file.getvalue().endswith("\x1b[2K"), "the last line is cleared"


def test_bar__is_lines_elsewhere(shown, monkeypatch):
    console = shown(False)
    with Bar(console, "pressing", lambda now, end: f"{now / end:.0%}") as bar:
        bar.reached(0.0, 0.0)
        bar.reached(0.5, 2.0)
        monkeypatch.setattr(progress, "LINE_EVERY", 100.0)
        bar.reached(0.6, 2.0)
    assert console.file.getvalue().splitlines() == [
        "pressing: starting, 0 s so far",
        "pressing: 25%, about 0 s left, 0 s so far",
    ]


PACES = {  # position after some seconds, and the factor by which the remaining time may be wrong
    "steady": (lambda spent: spent, 1.01),
    "growing steps": (lambda spent: spent**2, 1.05),
    "steps that grow with time": (lambda spent: 1e-3 * np.expm1(spent / 8), 1.1),
    "slowing down": (lambda spent: spent**0.5, 2.1),
    "resumed": (lambda spent: 300 + spent, 1.02),
}


@pytest.mark.parametrize("pace", PACES)
def test_time_left__follows_the_pace(pace, shown, monkeypatch):
    reached, factor = PACES[pace]
    now = [1000.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    with Bar(shown(False), "creep") as bar:
        for spent in np.arange(0.25, 50.1, 0.25):
            now[0] = 1000.0 + spent
            bar.reached(reached(spent), reached(100.0))
        left = bar._pace.left(reached(50.0), reached(100.0))
        assert f", about {progress.clock(left)} left" in bar._line()
    assert 1 / factor < left / 50 < factor


def test_quiet__shows_nothing(shown):
    for terminal in (False, True):
        console = shown(terminal, quiet=True)
        with Bar(console, "pressing") as bar:
            bar.reached(0.5, 2.0)
        assert console.file.getvalue() == ""


@pytest.mark.parametrize("wanted", [True, False])
def test_simulate__shows_itself_on_the_standard_error(shown, wanted, capsys):
    rubber, program = rv.zener(3e6, 1e6, 1e5), rv.Program().load(1e-4, over=0.1)
    rv.simulate(rv.sphere(1e-3, 2e-4, 15), rubber, program, times=2, tolerance=1e-2, progress=wanted)
    out, err = capsys.readouterr()
    assert out == ""
    assert ("pressing: t = " in err) is wanted
    assert (err == "") is not wanted
