"""What is shown while something is computed."""

import io

import pytest
from rich.console import Console

import roughvisc as rv
from roughvisc import progress
from roughvisc.progress import Bars, reporting


@pytest.fixture
def shown(monkeypatch):
    """A console on a terminal or not, and what is written to it; every line is written."""
    monkeypatch.setattr(progress, "LINE_EVERY", 0.0)

    def on(terminal, **settings):
        return Console(file=io.StringIO(), force_terminal=terminal, width=100, **settings)

    return on


def test_bar__is_drawn_on_a_terminal_and_vanishes(shown):
    console = shown(True)
    with reporting(True, "a [strange] name", console) as report:
        report(0.25, 2.0)
        drawn = console.file.getvalue()
        report(0.5, 2.0)
    drawn = console.file.getvalue()
    assert "a [strange] name " in drawn
    assert "t = 0.5 of 2 s" in drawn
    assert drawn.endswith("\x1b[2K"), "the last line is cleared"


def test_bar__is_lines_elsewhere(shown, monkeypatch):
    console = shown(False)
    with reporting(True, "pressing", console, lambda now, end: f"{now / end:.0%}") as report:
        report(0.0, 0.0)
        report(0.5, 2.0)
        monkeypatch.setattr(progress, "LINE_EVERY", 100.0)
        report(0.6, 2.0)
    first, second = console.file.getvalue().splitlines()
    assert first == "pressing: starting, 0 s so far"
    assert second.startswith("pressing: 25%")


def test_measurements_in_turn__have_one_bar_and_a_line_each(shown):
    console = shown(False)
    with reporting(True, "", console) as report:
        for label in ("coarse", "fine"):
            report(label, 0.0, 0.0)
            report(label, 1.0, 2.0)
    written = console.file.getvalue().splitlines()
    assert [line for line in written if line.startswith("measuring")] == ["measuring coarse", "measuring fine"]
    with Bars(shown(True)) as bars:
        bars.only("coarse", 1.0, 2.0)
        bars.only("fine", 1.0, 2.0)
        assert [task.description for task in bars._progress.tasks] == ["fine"]


@pytest.mark.parametrize("pace", ["steady", "resumed"])
def test_time_left__follows_the_pace(pace, shown):
    console, now, start = shown(False), [1000.0], {"steady": 0.0, "resumed": 300.0}[pace]
    with Bars(console) as bars:
        bars._progress.get_time = lambda: now[0]
        for spent in range(51):
            now[0] = 1000.0 + spent
            bars.reached("creep", start + spent, start + 100.0, "half")
        bars.line("creep")
    assert console.file.getvalue() == "creep: half, about 50 s left, 50 s so far\n"


def test_quiet__shows_nothing(shown):
    for terminal in (False, True):
        console = shown(terminal, quiet=True)
        with reporting(True, "pressing", console) as report:
            report(0.5, 2.0)
        assert console.file.getvalue() == ""


@pytest.mark.parametrize("wanted", [True, False])
def test_simulate__shows_itself_on_the_standard_error(shown, wanted, capsys):
    rubber, program = rv.zener(3e6, 1e6, 1e5), rv.Program().load(1e-4, over=0.1)
    rv.simulate(rv.sphere(1e-3, 2e-4, 15), rubber, program, times=2, tolerance=1e-2, progress=wanted)
    out, err = capsys.readouterr()
    assert out == ""
    assert ("pressing: t = " in err) is wanted
    assert (err == "") is not wanted
