"""SIGTERM, as a batch system sends it before it kills: a checkpoint is written, and the same command goes on."""

import os
import signal
import subprocess
import sys
import time

import pytest
import xarray as xr
from support import SMALL, with_steps

from roughvisc.runs.netcdf import open_result
from roughvisc.runs.run import run_case
from roughvisc.study.case import read_cases

MANY_STEPS = SMALL.replace("[keep]", 'time_step = "160 us"\n[keep]')
TWO = MANY_STEPS + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'


def terminated(folder, *options, whole_group, after):
    """Run a study, send SIGTERM some seconds after its cases have begun to march; how it ended."""
    command = [sys.executable, "-m", "roughvisc", "run", "s.toml", "-q", "--no-plots", "--out", "out", *options]
    process = subprocess.Popen(command, cwd=folder, stdout=-1, stderr=-1, text=True, start_new_session=True)
    cases = len(read_cases(folder / "s.toml"))
    while len(list(folder.glob("out/.*.unfinished"))) < cases:
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    time.sleep(after)
    (os.killpg if whole_group else os.kill)(process.pid, signal.SIGTERM)
    return (*process.communicate(timeout=100), process.returncode)


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize(
    ("text", "options", "whole_group"),
    [
        (MANY_STEPS, [], False),
        pytest.param(TWO, ["--workers", "2"], False, marks=pytest.mark.long),
        pytest.param(TWO, ["--workers", "2"], True, marks=pytest.mark.long),
    ],
)
def test_run__writes_its_checkpoint_and_ends_quietly(tmp_path, text, options, whole_group):
    (tmp_path / "s.toml").write_text(text)
    cases = read_cases(tmp_path / "s.toml")
    for after in (0.2, 0.4, 0.8, 1.6, 3.2):  # on a busy machine there is no step to keep so early
        ended = terminated(tmp_path, *options, whole_group=whole_group, after=after)
        assert ended == ("", "roughvisc: interrupted; finished work is kept; repeat the command to resume\n", 143)
        if all([*tmp_path.glob(f"out/.{case.key}.unfinished/state.npz")] for case in cases):
            break
    for case in read_cases(tmp_path / "s.toml"):
        unfinished = tmp_path / "out" / f".{case.key}.unfinished"
        assert list(unfinished.glob("state.npz")), "long before one is due"
        reached = []
        path = run_case(case, tmp_path / "out", progress=lambda now, end, all=reached: all.append(now))
        assert min(reached) > 0, "it goes on"
        with open_result(path) as found, open_result(run_case(case, tmp_path / "calm")) as wanted:
            xr.testing.assert_equal(with_steps(found), with_steps(wanted))
        assert [one.name for one in unfinished.parent.glob(f"*{case.key}*")] == [path.name]


def test_import__leaves_the_handlers_of_the_process_alone():
    script = "import signal; b = [signal.getsignal(n) for n in (2, 15)]; import roughvisc.cli\n"
    script += "assert [signal.getsignal(n) for n in (2, 15)] == b"
    assert subprocess.run([sys.executable, "-c", script]).returncode == 0
