"""What the C library is told of freed memory, and what comes of that."""

import os
import subprocess
import sys

import pytest

import roughvisc as rv
from roughvisc.experiment import loading
from roughvisc.experiment import resources as malloc
from roughvisc.experiment.resources import keep_memory, retain_arena

MB = 1 << 20
MMAP, TRIM = -3, -1


class Library:
    """Notes what it is told."""

    def __init__(self):
        self.told = []

    def mallopt(self, parameter, value):
        self.told.append((parameter, value))
        return 1

    def malloc_trim(self, pad):
        self.told.append("trim")
        return 1


@pytest.fixture
def library(monkeypatch):
    found = Library()
    monkeypatch.setattr(malloc, "_library", lambda: found)
    keep_memory.cache_clear()
    yield found
    keep_memory.cache_clear()


def test_wide_grid__keeps_what_is_freed_till_its_end(library):
    def failing():
        with retain_arena(8 * MB):
            assert library.told == [(MMAP, 32 * MB), (TRIM, 2047 * MB)]
            library.told.clear()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        failing()
    assert library.told == [(TRIM, 64 * MB), "trim"]


def test_memory_of_a_march__is_given_back_when_the_result_is_described(library, monkeypatch):
    """Before the file is written: what the notes take is freed by then."""
    monkeypatch.setattr(malloc, "_WIDE", 1)
    note = loading.slope_note
    monkeypatch.setattr(loading, "slope_note", lambda *given: library.told.append("noted") or note(*given))
    program = rv.Program().load(1e-4, over=0.05)
    rv.simulate(rv.sphere(1e-3, 2e-4, 20), rv.elastic(1e6), program, times=[0.05], tolerance=1e-2, progress=False)
    assert library.told == [(MMAP, 32 * MB), (TRIM, 2047 * MB), "noted", (TRIM, 64 * MB), "trim"]


def test_narrow_grid__changes_nothing(library):
    with retain_arena(8 * MB - 1):
        pass
    assert library.told == []


def test_process_that_keeps_memory__goes_on_to(library):
    assert keep_memory()
    library.told.clear()
    with retain_arena(8 * MB):
        library.told.clear()
    assert library.told == ["trim"]


def test_other_libraries__are_left_alone(monkeypatch):
    monkeypatch.setattr(malloc, "_library", lambda: None)
    with retain_arena(8 * MB):
        pass


LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="counts the page faults of Linux")


def faults(tmp_path, script, *ways):
    """Page faults that a script prints for each way, in a process of its own whose C library is as it comes."""
    (tmp_path / "faults.py").write_text("import resource, sys\n" + script)
    environment = {k: v for k, v in os.environ.items() if not k.startswith("MALLOC_") and k != "GLIBC_TUNABLES"}
    for way in ways:
        command = [sys.executable, tmp_path / "faults.py", way]
        yield int(subprocess.run(command, check=True, capture_output=True, env=environment).stdout)


@LINUX
def test_memory_freed_in_a_wide_march__is_used_again(tmp_path):
    """128 arrays of a megabyte, freed and had again."""
    script = (
        "import numpy as np\n"
        "from roughvisc.experiment.resources import retain_arena\n"
        "with retain_arena(int(sys.argv[1])):\n"
        "    for _ in range(6):\n"
        "        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt\n"
        "        arrays = [np.ones(1 << 17) for _ in range(128)]\n"
        "        del arrays\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)\n"
    )
    narrow, wide = faults(tmp_path, script, "0", str(8 * MB))
    if narrow < 8000:
        pytest.skip("this C library keeps freed memory by itself")
    assert wide < 0.2 * narrow


@pytest.mark.long
@LINUX
def test_freed_memory__is_used_again(tmp_path):
    script = (
        "import roughvisc as rv\n"
        "from roughvisc.experiment import malloc\n"
        "if sys.argv[1] == 'without':\n"
        "    malloc.expect_arrays = lambda size: None\n"
        "rough = rv.self_affine(1.0, (511, 513), hurst=0.8, rms_slope=0.1, rolloff=0.2, shortcut=0.05, seed=1)\n"
        "def run():\n"
        "    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt\n"
        "    rv.simulate(rough, rv.zener(1.0, 1.0, 1.0), rv.Program().load(0.2, over=0).hold(1.0),\n"
        "                boundary='periodic', numerics=rv.Numerics(time_step=0.25), times=[1.0], fields=(),\n"
        "                progress=False)\n"
        "    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before\n"
        "run()\n"
        "print(run())\n"
    )
    kept, without = faults(tmp_path, script, "with", "without")
    if without < 8000:
        pytest.skip("this C library keeps freed memory by itself")
    assert kept < 0.2 * without
