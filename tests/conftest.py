"""What tests of several modules share.

The suite runs with the transforms of SciPy; mechanics/test_convolution.py compares those of ducc0 with them.
"""

import importlib
import os
import shutil
import signal
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner

os.environ["ROUGHVISC_TRANSFORMS"] = "scipy"
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the workers of pytest-xdist share the cores
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # a shell's background job, from which all runs would inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)

import strategies  # noqa: F401  (loads the profile of the random examples)
from support import BALL, LOADS

from roughvisc.cli import main
from roughvisc.mechanics.grid import Grid
from roughvisc.plot import save as save_module
from roughvisc.study.case import read_cases


@pytest.fixture
def docs_script(monkeypatch):
    """Import a script of the documentation by its name."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[1] / "docs"))
    return importlib.import_module


@pytest.fixture
def solved_on(monkeypatch):
    """Shapes of the grids that were solved on, in order."""
    shapes = []
    begin = Grid.__init__

    def noted(self, shape, *rest, **named):
        shapes.append(shape)
        begin(self, shape, *rest, **named)

    monkeypatch.setattr(Grid, "__init__", noted)
    return shapes


@pytest.fixture
def invoke(tmp_path, monkeypatch):
    """Runs a command in an empty folder; gives its status and what it wrote to either stream."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        done = CliRunner().invoke(main, [str(a) for a in arguments])
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
        return done.exit_code, done.stdout, done.stderr

    return run


@pytest.fixture
def study(tmp_path):
    """Writes a study into a folder of its own and reads its cases."""

    def write(text=BALL + LOADS, name="ball"):
        (tmp_path / f"{name}.toml").write_text(text)
        return read_cases(tmp_path / f"{name}.toml")

    return write


@pytest.fixture
def small_disk(tmp_path):
    """A mount of few kilobytes, and what mounts it anew with other options."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=16k", "tmpfs", folder]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("mounting is not permitted here")

    def remount(options):
        subprocess.run(["mount", "-o", f"remount,{options}", folder], check=True)

    yield folder, remount
    subprocess.run(["umount", "-l", folder], check=True)


@pytest.fixture
def coarse_pictures(monkeypatch):
    """Pictures are written with few points, where nobody looks at them."""
    monkeypatch.setattr(save_module, "DPI", 40)
