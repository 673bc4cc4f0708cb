"""A run that is interrupted, by whatever means, ends with the same bits as one that is not."""

import errno
import logging
import math
import os
import random
import shutil
import subprocess
import sys
import threading
from contextlib import nullcontext
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import roughvisc as rv
from roughvisc.errors import InUseError
from roughvisc.experiment.loading import Loading, LoadingState
from roughvisc.mechanics.bodies.body import body_of
from roughvisc.mechanics.bodies.transforms import transform_library
from roughvisc.mechanics.hereditary.direct import Block, HistoryState
from roughvisc.mechanics.hereditary.exponentials import ModesState
from roughvisc.mechanics.sparse import Sparse
from roughvisc.mechanics.stepping.state import ControllerState, Instant, State
from roughvisc.problem import Problem
from roughvisc.recorder import Checkpoint, MemoryRecorder
from roughvisc.settings import Settings
from roughvisc.solve import solve
from roughvisc.study.execution import run as run_module
from roughvisc.study.execution.run import run_case
from roughvisc.study.statement.case import read_study, vary
from roughvisc.study.storage import checkpoint as checkpoint_module
from roughvisc.study.storage.checkpoint import CheckpointWriter, RowFile, load_checkpoint, save_checkpoint
from roughvisc.study.storage.lock import lock_case
from roughvisc.study.storage.store import open_result


def loaded(path, key):
    """How far a run through a program has come."""
    return load_checkpoint(path, key, Loading.states)


# Recovers after a jump down, holds the approach, and keeps times that no step would land on by itself.
MODES = """
title = "Interrupted"
[surface]
generate = "self_affine"
size = "1 mm"
shape = [40, 33]
hurst = 0.8
rms_slope = 0.05
seed = 3
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
load = "20 mN"
over = "0.1 s"
[[program]]
hold = "0.3 s"
[[program]]
load = "5 mN"
over = 0
[[program]]
hold = "0.2 s"
control = "approach"
[solve]
boundary = "periodic"
tolerance = 1e-2
[keep]
times = "all"
"""
# A soft material, whose kept rows show more than the state.
SOFT = (
    MODES.replace('model = "zener"\nshear_modulus = "3 MPa"', 'model = "kelvin_voigt"\nshear_modulus = "1 MPa"')
    .replace('kelvin_modulus = "1 MPa"\nkelvin_viscosity = "0.1 MPa s"', 'viscosity = "0.1 MPa s"')
    .replace('times = "all"', 'times = ["0.05 s", "0.37 s", "0.5 s"]')
    .replace("over = 0\n", 'over = "1 ms"\n')
)
# Grows from 15 x 12 cells while it is loaded: twice and more.
GROWING = """
title = "Growing"
[surface]
generate = "sphere"
radius = "1 mm"
size = ["30 um", "24 um"]
shape = [15, 12]
[material]
model = "maxwell"
shear_modulus = "1 MPa"
viscosity = "1 MPa s"
[[program]]
load = "1 mN"
over = "0.2 s"
[[program]]
hold = "0.5 s"
[solve]
tolerance = 3e-2
[keep]
fields = ["gap"]
times = "all"
"""
# Creep data with a kink, as they are: every pressure is kept.
_TIMES = [i / 40 for i in range(41)]
DIRECT = MODES.replace(
    'model = "zener"\nshear_modulus = "3 MPa"\nkelvin_modulus = "1 MPa"\nkelvin_viscosity = "0.1 MPa s"',
    f'model = "tabulated"\ntimes = {_TIMES}\ncompliances = {[1e-7 * (1 + t + 20 * max(t - 0.2, 0)) for t in _TIMES]}',
).replace("[solve]", '[solve]\nmemory = "direct"')
SEED = MODES.replace("[solve]", '[solve]\nmethod = "seed"\ntime_step = "20 ms"').replace('control = "approach"\n', "")
# Begins on a window of 32 cells that grows with the contact.
FOLLOWING = GROWING.replace('"30 um", "24 um"', '"206 um", "242 um"').replace("[15, 12]", "[103, 121]")
# Slides, rests with what the slide has left, and slides back.
SLIDING = (
    MODES.replace("[40, 33]", "[20, 15]")
    .replace('load = "5 mN"\nover = 0', 'slide = "0.3 mm"\nspeed = "5 mm/s"')
    .replace('hold = "0.2 s"\ncontrol = "approach"', 'hold = "0.1 s"\n[[program]]\nslide = "0.25 mm"\nover = "0.1 s"')
    .replace("[solve]", 'direction = "-y"\n[solve]')
    .replace('times = "all"', "times = 9")
)
CASES = {
    "following": FOLLOWING,
    "modes": MODES,
    "soft": SOFT,
    "growing": GROWING,
    "direct": DIRECT,
    "sliding": SLIDING,
}


def case_of(text, folder):
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "study.toml"
    path.write_text(text)
    return read_study(path)


def values(path):
    """All variables but wall_time, to the last bit."""
    with open_result(path) as ds:
        loaded = ds.drop_vars("wall_time").load().variables
        return {str(name): (v.dims, v.dtype, v.values.tobytes()) for name, v in loaded.items()}


def names(folder):
    return sorted(path.name for path in folder.iterdir())


class Stop:
    """Says stop when it is asked for the so-many-th time."""

    def __init__(self, at=-1):
        self.at, self.asked = at, 0

    def __call__(self):
        self.asked += 1
        return self.asked == self.at


def stopped(case, folder, at, **settings):
    with pytest.raises(KeyboardInterrupt):
        run_case(case, folder, stop=Stop(at), **settings)
    return folder / f".{case.key}.unfinished"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """What undisturbed runs give: case, its values, and how many steps it takes."""
    known = {}

    def of(text):
        if text not in known:
            folder = tmp_path_factory.mktemp("whole")
            case, stop = case_of(text, folder), Stop()
            known[text] = case, values(run_case(case, folder / "out", stop=stop)), stop.asked
        return known[text]

    return of


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("cuts", ["few", pytest.param("more", marks=pytest.mark.long)])
def test_stopped_run__goes_on_and_ends_with_the_same_bits(whole, tmp_path, name, cuts):
    case, expected, steps = whole(CASES[name])
    assert steps > 10
    for cut in {"few": (1, steps // 2, steps - 1, steps), "more": (2, steps // 3)}[cuts]:
        folder = tmp_path / str(cut)
        unfinished = stopped(case, folder, cut)
        assert names(folder) == [unfinished.name], "no result yet, nor a lock"
        with pytest.raises(KeyboardInterrupt) if cut < steps - 3 else nullcontext():
            run_case(case, folder, stop=Stop(3))  # and once more
        stop = Stop()
        path = run_case(case, folder, stop=stop)
        assert stop.asked == max(steps - cut - 3, 0) if cut < steps - 3 else stop.asked == 0
        assert values(path) == expected
        assert names(folder) == [path.name]


@pytest.mark.parametrize("text", [GROWING, FOLLOWING])
def test_growing__grows_before_and_after_the_cut(whole, tmp_path, text):
    """Otherwise the test above would not test it."""
    case, _, steps = whole(text)
    growths = []
    for cut in (1, steps // 2, steps):
        folder = stopped(case, tmp_path / str(cut), cut)
        growths.append(loaded(folder / "checkpoint.0", case.key).state.growths)
    assert growths == sorted(growths)
    assert 0 <= growths[0] < growths[-1]


def test_direct__keeps_every_pressure(whole, tmp_path):
    """Those of 32 instants are gathered into one block; the jump of the program has two instants and is one row."""
    case, _, steps = whole(DIRECT)
    folder = stopped(case, tmp_path, steps - 5)
    instants = steps - 5 + 1
    memory = loaded(folder / "checkpoint.0", case.key).state.march.memory
    assert isinstance(memory, HistoryState)
    assert instants > 32
    assert [len(block.pressures) for block in memory.blocks] == [32] * (instants // 32) + [1] * (instants % 32)
    assert len(memory.times) == instants
    assert np.count_nonzero(np.diff(memory.times) == 0) == 1


def test_checkpoint__holds_the_state_exactly(tmp_path):
    strange = np.array([[0.1, -0.0, np.inf], [np.nan, 5e-324, 1 / 3]])
    now = Instant(0.1 + 0.2, Sparse.of(strange.T), np.float64(1e-310), -0.0)
    modes = ModesState(np.zeros((0, 2, 3)), strange, None, 1 / 3)
    history = HistoryState((2, 3), np.array([0.0, 0.1]), (Block(np.zeros(0, np.intp), np.zeros((1, 0))),))
    for memory in (modes, history):
        state = State(now, strange, memory, before=None, pace=ControllerState(0.1, 0.5, True), convolutions=2**40)
        reached = Checkpoint(LoadingState(state, (0.1, 2e-7), 3, 0.1), 0.1 + 0.2, 2, 1e-17)
        save_checkpoint(tmp_path / "c", reached, "key")
        back = loaded(tmp_path / "c", "key")
        assert repr(replace(back, state=None)) == repr(replace(reached, state=None))
        for field in fields(State):
            if field.name not in ("now", "displacement", "memory"):
                assert getattr(back.state.march, field.name) == getattr(state, field.name), field.name
        assert repr(replace(back.state, march=None)) == repr(replace(reached.state, march=None))
        assert back.state.march.before is None
        assert (back.state.march.now.force, math.copysign(1, back.state.march.now.approach)) == (1e-310, -1)
        assert back.state.march.now.pressure.flags.c_contiguous
        assert back.state.march.now.pressure.tobytes() == strange.T.tobytes()
        assert back.state.march.displacement.tobytes() == strange.tobytes()
        assert type(back.state.march.memory) is type(memory)
        for field in fields(memory):
            one, other = getattr(back.state.march.memory, field.name), getattr(memory, field.name)
            if isinstance(other, np.ndarray):
                assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    assert back.state.march.memory.shape == (2, 3)
    assert back.state.march.memory.blocks[0].cells.dtype == np.intp


# ----------------------------------------------------------------------------------------------------------------
# what a crash leaves


def after_steps(count):
    """How far a run has come after so many steps of a second."""
    nothing = np.zeros((3, 2))
    at_rest = Sparse.of(nothing)
    states = [State(Instant(float(n), at_rest, 0.0, 0.0), nothing, None) for n in range(1, count + 1)]
    return [Checkpoint(LoadingState(state), done=state.now.time) for state in states]


def last_saved(folder):
    """Time of the latest checkpoint, zero if there is none. [s]"""
    found = [loaded(folder / f"checkpoint.{n}", "key") for n in (0, 1)]
    return max((reached.done for reached in found if reached is not None), default=0.0)


def test_rows__are_counted_with_and_without_values():
    """Under a given approach, steps of a soft material that are not kept leave no row."""
    seen = []

    class Noting(MemoryRecorder):
        def update(self, reached):
            seen.append((reached.rows, 4 + len(self.rows.plain), reached.done, reached.wall_time))

    recorder = Noting()
    recorder.latest = Checkpoint(rows=4, wall_time=1.0)
    ball, soft = rv.sphere(1e-3, 3e-4, (9, 11)), rv.kelvin_voigt(1e6, 1e5)
    press, settings = Loading(rv.Program().approach(1e-6, over=1.0)), Settings(times=3, tolerance=1e-2)
    solve(Problem(ball, body_of(soft), settings), press, recorder)
    counted, held, done, wall_times = (np.array(each) for each in zip(*seen, strict=True))
    assert np.array_equal(counted, held)
    assert set(np.diff(counted)) == {0, 1}
    assert np.all(np.diff(done) > 0)
    assert done[-1] == 1.0
    assert np.all(np.diff([1.0, *wall_times]) > 0)


def test_keeper__writes_a_checkpoint_after_so_many_steps(tmp_path):
    keeper = CheckpointWriter(tmp_path / "run", "key", seconds=1e9, steps=3)
    saved = []
    for reached in after_steps(7):
        keeper.update(reached)
        saved.append(last_saved(tmp_path / "run"))
    keeper.close()
    assert saved == [0, 0, 3, 3, 3, 6, 6]


def test_keeper__takes_no_more_than_a_twentieth_of_the_time(tmp_path, monkeypatch):
    """A step takes 10 s and a checkpoint 4 s. The first is written after 30 s, the next ones after 80 s each."""
    clock, write = [0.0], checkpoint_module.save_checkpoint
    monkeypatch.setattr(checkpoint_module, "time", SimpleNamespace(monotonic=lambda: clock[0]))

    def slowly(*given):
        clock[0] += 4.0
        write(*given)

    monkeypatch.setattr(checkpoint_module, "save_checkpoint", slowly)
    keeper = CheckpointWriter(tmp_path / "run", "key", seconds=30.0)
    saved = []
    for reached in after_steps(20):
        clock[0] += 10.0
        keeper.update(reached)
        saved.append(last_saved(tmp_path / "run"))
    keeper.close()
    assert sorted(set(saved)) == [0, 3, 11, 19]


def test_damaged_checkpoint__is_found_out_wherever_it_is_damaged(whole, tmp_path):
    case, _, steps = whole(GROWING)
    path = stopped(case, tmp_path, steps // 2) / "checkpoint.0"
    sound = path.read_bytes()
    state = loaded(path, case.key).state
    draw = random.Random(1)
    for where in [*range(0, 200, 7), *(draw.randrange(len(sound)) for _ in range(200))]:
        path.write_bytes(sound[:where])
        assert loaded(path, case.key) is None
        path.write_bytes(sound[:where] + bytes([sound[where] ^ (1 << draw.randrange(8))]) + sound[where + 1 :])
        assert loaded(path, case.key) is None
        path.write_bytes(sound[:where] + bytes(len(sound) - where - 1) + b"x")  # length as it was, blocks not written
        assert loaded(path, case.key) is None
    path.write_bytes(sound)
    assert loaded(path, case.key).state.march.now.time == state.march.now.time


@pytest.mark.parametrize("damaged", [("checkpoint.0",), ("checkpoint.1",), ("checkpoint.0", "checkpoint.1"), ("rows",)])
def test_damage__costs_work_and_no_bit_of_the_result(whole, tmp_path, caplog, damaged):
    case, expected, steps = whole(MODES)
    unfinished = stopped(case, tmp_path, steps // 2, checkpoint_steps=5)
    assert names(unfinished) == ["checkpoint.0", "checkpoint.1", "rows"]
    for name in damaged:
        content = (unfinished / name).read_bytes()
        (unfinished / name).write_bytes(content[: len(content) // 2])
    stop = Stop()
    with caplog.at_level(logging.WARNING, "roughvisc"):
        path = run_case(case, tmp_path, stop=stop)
    assert "damaged" in caplog.text
    assert values(path) == expected
    assert names(tmp_path) == [path.name]
    if len(damaged) == 1 and damaged[0] != "rows":
        assert steps // 2 <= stop.asked <= steps - steps // 2 + 5, "the other one was used"
    else:
        assert stop.asked == steps, "from the start"


def test_rows_beyond_the_checkpoint__do_not_count(whole, tmp_path):
    case, expected, steps = whole(MODES)
    rows = stopped(case, tmp_path, steps // 2) / "rows"
    rows.write_bytes(rows.read_bytes() + b"torn off while it was written")
    assert values(run_case(case, tmp_path)) == expected


_KILLED = """
import os, random, signal, sys, time
from pathlib import Path
from roughvisc.study.statement.case import read_study
from roughvisc.study.execution.run import run_case
study, out, kills, seed = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
case, draw, done = read_study(study), random.Random(seed), 0
for warm in ("imports", "timed"):
    began, told = time.perf_counter(), []
    run_case(case, out.parent / warm, checkpoint_steps=2, progress=lambda now, end: told.append(now))
    step = (time.perf_counter() - began) / len(told)

def work(pipe):
    def report(now, end):
        os.write(pipe, f"{now!r}\\n".encode())
    run_case(case, out, progress=report, checkpoint_steps=2)

def after(reports, pipe):
    "What a run has told by then, or before it ended; at a random instant of the next step."
    told = b""
    while told.count(b"\\n") < reports and (more := os.read(pipe, 1000)):
        told += more
    time.sleep(draw.uniform(0.0, step))
    return told.decode().split()

def begun(pipe):
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            work(pipe)
            code = 0
        finally:
            os._exit(code)
    return pid

while done < kills:
    near, far = os.pipe()
    pid = begun(far)
    os.close(far)
    came = after(draw.randrange(int(0.6 * len(told))), near)
    os.kill(pid, signal.SIGKILL)
    _, status = os.waitpid(pid, 0)
    print(*came[:1] or "-", os.WIFSIGNALED(status), flush=True)
    os.close(near)
    if os.WIFSIGNALED(status):
        done += 1
    elif status:
        sys.exit("failed")
    else:  # it was through before: begin anew
        (out / f"{case.key}.nc").unlink()
near, far = os.pipe()
_, status = os.waitpid(begun(far), 0)
sys.exit(status)
"""


def killed(folder, kills, seed):
    """Times at which the killed runs began, as far as they came."""
    arguments = [folder / "study.toml", folder / "out", kills, seed]
    command = [sys.executable, "-c", _KILLED, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return [line.split()[0] for line in done.stdout.splitlines()]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")
@pytest.mark.parametrize(
    ("name", "kills"),
    [
        ("modes", 3),
        *(pytest.param(name, 24, marks=pytest.mark.long) for name in CASES),
    ],
)
def test_killed_at_random_instants__ends_with_the_same_bits(whole, tmp_path, name, kills):
    _, expected, _ = whole(CASES[name])
    case = case_of(CASES[name], tmp_path)
    began = killed(tmp_path, kills, seed=kills)
    assert len(began) >= kills
    assert any(first not in ("-", "0.0") for first in began), "some went on from a checkpoint"
    assert values(tmp_path / "out" / f"{case.key}.nc") == expected
    assert names(tmp_path / "out") == [f"{case.key}.nc"]


@pytest.mark.parametrize("size", ["16k", "200k", "500k", "1080k", "1200k"])
def test_full_disk__loses_nothing(whole, tmp_path, small_disk, size):
    """Wherever it strikes: the first rows, a checkpoint, the result itself."""
    case, expected, steps = whole(MODES)
    folder, remount = small_disk
    remount(f"size={size}")
    with pytest.raises(OSError, match=r"No space left on device; .* make room and run it again") as caught:
        run_case(case, folder, checkpoint_steps=5)
    assert caught.value.errno == errno.ENOSPC
    assert not list(folder.glob("*.nc"))
    assert not list(folder.glob(".*.lock"))
    remount("size=20m")
    stop = Stop()
    path = run_case(case, folder, stop=stop)
    assert values(path) == expected
    assert names(folder) == [path.name]
    if size != "16k":
        assert stop.asked < steps, "it went on"


# ----------------------------------------------------------------------------------------------------------------
# what belongs to whom


def test_finished_case__is_not_run_again(whole, tmp_path, monkeypatch):
    case, _, _ = whole(GROWING)
    path = run_case(case, tmp_path)
    before = path.stat()

    def computed(*_, **__):
        raise AssertionError("it was computed again")

    monkeypatch.setattr(run_module, "solve", computed)
    assert run_case(case, tmp_path) == path
    xr.testing.assert_identical(rv.run(case, tmp_path).load(), open_result(path).load())
    # killed after the result was in place, before all else was gone
    for left in (f".{case.key}.unfinished/rows", f".{case.key}.lock", f".{case.key}.0f0f0f0f.part.nc"):
        (tmp_path / left).parent.mkdir(exist_ok=True)
        (tmp_path / left).write_text("")
    assert run_case(case, tmp_path) == path
    assert names(tmp_path) == [path.name]
    assert path.stat().st_mtime_ns == before.st_mtime_ns
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(AssertionError, match="computed again"):
        run_case(case, tmp_path)


def test_changed_study__does_not_use_what_is_not_its_own(whole, tmp_path, caplog):
    case, _, steps = whole(MODES)
    other = vary(case, {"program.0.load": "21 mN"})
    expected = values(run_case(other, tmp_path / "other"))
    shutil.rmtree(tmp_path / "other")
    unfinished = stopped(case, tmp_path, steps // 2)
    shutil.copytree(unfinished, tmp_path / f".{other.key}.unfinished")  # whoever may have renamed it
    with caplog.at_level(logging.WARNING, "roughvisc"):
        assert values(run_case(other, tmp_path)) == expected
    assert "belongs to another case or revision and is not used" in caplog.text
    assert names(tmp_path) == sorted([unfinished.name, f"{other.key}.nc"])
    (tmp_path / f"{other.key}.nc").rename(tmp_path / f"{case.key}.nc")
    assert values(run_case(case, tmp_path)) == whole(MODES)[1]


@pytest.mark.parametrize("what", ["NUMERICS_REVISION", "RESULT_FORMAT", "_LAYOUT"])
def test_other_revision__begins_again(whole, tmp_path, monkeypatch, caplog, what):
    case, expected, steps = whole(MODES)
    with monkeypatch.context() as patched:
        patched.setattr(checkpoint_module, what, -1)
        stopped(case, tmp_path, steps // 2)
    stop = Stop()
    assert values(run_case(case, tmp_path, stop=stop)) == expected
    assert stop.asked == steps
    assert "belongs to another case or revision and is not used" in caplog.text


def test_other_transforms__go_on_and_are_named(whole, tmp_path, monkeypatch, caplog):
    """The tolerance is kept by either."""
    case, _, steps = whole(MODES)
    stopped(case, tmp_path, steps // 2)
    here = transform_library()
    monkeypatch.setenv("ROUGHVISC_TRANSFORMS", "ducc0")
    there = transform_library()
    assert here.split()[0] == "scipy.fft" != there.split()[0], "the test extra has both"
    stop = Stop()
    path = run_case(case, tmp_path, stop=stop)
    assert stop.asked == steps - steps // 2
    assert not caplog.records
    with open_result(path) as mixed:
        assert mixed.attrs["transforms"] == f"{here}; then {there}"
        force = mixed.pressure.sum(("x", "y")).values
    assert run_case(case, tmp_path, stop=stop) == path
    assert stop.asked == steps - steps // 2, "it is finished"
    monkeypatch.setenv("ROUGHVISC_TRANSFORMS", "scipy")
    with open_result(run_case(case, tmp_path / "scipy")) as same:
        np.testing.assert_allclose(force, same.pressure.sum(("x", "y")).values, rtol=case.settings.solve.tolerance)


def test_two_runs_at_once__the_second_says_so(whole, tmp_path):
    case, expected, _ = whole(MODES)
    refused = []

    def second(now, end):
        if not refused:
            with pytest.raises(InUseError) as caught:
                run_case(case, tmp_path)
            refused.append(caught)

    path = run_case(case, tmp_path, progress=second)
    assert refused
    assert values(path) == expected
    assert names(tmp_path) == [path.name]


def test_seed_method__begins_again(tmp_path):
    case = case_of(SEED, tmp_path)
    stop = Stop()
    expected = values(run_case(case, tmp_path / "whole"))
    seen = []

    def interrupted(now, end):
        seen.append(now)
        if len(seen) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_case(case, tmp_path / "out", progress=interrupted, stop=stop)
    assert not (tmp_path / "out").exists()
    assert values(run_case(case, tmp_path / "out")) == expected


@pytest.mark.parametrize("room", [0, 100_000])
def test_memory__does_not_grow_with_kept_rows(room, whole, tmp_path, monkeypatch):
    case, expected, _ = whole(MODES)
    held_arrays = []
    append = RowFile.append

    def appended(self, plain, arrays):
        append(self, plain, arrays)
        held_arrays.append(sum(array.nbytes for array in arrays_in(list(vars(self).values()))))

    monkeypatch.setattr(checkpoint_module, "_WAITING", room)
    monkeypatch.setattr(RowFile, "append", appended)
    assert values(run_case(case, tmp_path)) == expected
    assert max(held_arrays) <= room
    assert (max(held_arrays) > 0) == (room > 0)


def arrays_in(value):
    """Every array in nested lists and dictionaries."""
    if isinstance(value, np.ndarray):
        yield value
    for part in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from arrays_in(part)


def test_lock__of_a_process_that_is_being_cleared_away_is_waited_for(tmp_path):
    fcntl = pytest.importorskip("fcntl")
    path = tmp_path / "lock"
    with open(path, "w") as dying:
        fcntl.flock(dying, fcntl.LOCK_EX)
        threading.Timer(0.3, fcntl.flock, (dying, fcntl.LOCK_UN)).start()
        with lock_case(path):
            assert path.exists()
    assert not path.exists()


@pytest.mark.parametrize("name", ["modes", "sliding"])
def test_checkpoint_of_the_former_format__is_not_gone_on_from(whole, tmp_path, caplog, name):
    """Its rows have areas of another meaning: the run begins anew, and no row is left of them."""
    case, expected, steps = whole(CASES[name])
    unfinished = stopped(case, tmp_path, steps // 2)
    for path in unfinished.glob("checkpoint.*"):
        with open(path, "rb", buffering=0) as stream:
            plain, arrays = checkpoint_module.read_record(stream)
        del plain["result_format"]  # former versions state none
        with open(path, "wb", buffering=0) as stream:
            checkpoint_module.write_record(stream, plain, arrays)
    stop = Stop()
    with caplog.at_level(logging.WARNING, "roughvisc"):
        path = run_case(case, tmp_path, stop=stop)
    assert stop.asked == steps
    assert "belongs to another case or revision and is not used" in caplog.text
    assert values(path) == expected
