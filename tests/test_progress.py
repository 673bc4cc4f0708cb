"""Progress on the screen: the time left, and nothing if no progress is wanted."""

import io

import pytest
from rich.console import Console

import roughvisc as rv
from roughvisc import progress
from roughvisc.progress import Bars


@pytest.fixture(autouse=True)
def every_line(monkeypatch):
    monkeypatch.setattr(progress, "LINE_EVERY", 0.0)


@pytest.mark.parametrize("start", [0.0, 300.0], ids=["steady", "resumed"])
def test_time_left__follows_the_pace(start):
    console, now = Console(file=io.StringIO(), force_terminal=False, width=100), [1000.0]
    with Bars(console) as bars:
        bars.get_time = lambda: now[0]
        for spent in range(51):
            now[0] = 1000.0 + spent
            bars.reached("creep", start + spent, start + 100.0, "half")
        bars.line("creep")
    assert "50 s left, 50 s so far" in console.file.getvalue()


@pytest.mark.parametrize("wanted", [True, False])
def test_simulate__shows_itself_on_the_standard_error(wanted, capsys):
    rubber, program = rv.zener(3e6, 1e6, 1e5), rv.Program().load(1e-4, over=0.1)
    rv.simulate(rv.sphere(1e-3, 2e-4, 15), rubber, program, times=2, tolerance=1e-2, progress=wanted)
    out, err = capsys.readouterr()
    assert (out, "pressing: t = " in err) == ("", wanted)
    assert (err == "") is not wanted
