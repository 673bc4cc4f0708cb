"""Progress on the screen: the time left, and nothing where quiet is asked for."""

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


@pytest.mark.parametrize("pace", ["steady", "resumed"])
def test_time_left__follows_the_pace(pace, shown):
    console, now, start = shown(False), [1000.0], {"steady": 0.0, "resumed": 300.0}[pace]
    with Bars(console) as bars:
        bars.get_time = lambda: now[0]
        for spent in range(51):
            now[0] = 1000.0 + spent
            bars.reached("creep", start + spent, start + 100.0, "half")
        bars.line("creep")
    assert console.file.getvalue() == "creep: half, about 50 s left, 50 s so far\n"


def test_quiet__shows_nothing(shown):
    for terminal in (False, True):
        console = shown(terminal, quiet=True)
        with reporting("pressing", "{} of {}".format, console) as report:
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
