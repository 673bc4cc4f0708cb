"""A run that is interrupted, by whatever means, ends with the same bits as one that is not."""

import errno
import logging
import os
import shutil
import threading
from contextlib import nullcontext

import numpy as np
import pytest
import xarray as xr
from dying import struck
from support import STUDY, refused, with_steps

import roughvisc as rv
from roughvisc.mechanics.grid import transform_library
from roughvisc.runs import run as run_module
from roughvisc.runs.folder import lock_case
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.run import run_case
from roughvisc.study.case import read_study, vary

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
GROWING = (
    STUDY.replace('"1 mm"', '["0.15 mm", "0.12 mm"]')
    .replace("[33, 31]", "[15, 12]")
    .replace("over = 0", 'over = "0.2 s"')
    .replace('["pressure", "displacement"]\ntimes = [0, "0.1 s", "200 ms"]', '["gap"]\ntimes = "all"')
    + "[solve]\ntolerance = 3e-2\n"
)
# Slides, rests with what the slide has left, and slides back.
SLIDING = (
    MODES.replace("[40, 33]", "[20, 15]")
    .replace('load = "5 mN"\nover = 0', 'slide = "0.3 mm"\nspeed = "5 mm/s"')
    .replace('hold = "0.2 s"\ncontrol = "approach"', 'hold = "0.1 s"\n[[program]]\nslide = "0.25 mm"\nover = "0.1 s"')
    .replace("[solve]", 'direction = "-y"\n[solve]')
    .replace('times = "all"', "times = 9")
)
# Presses in, pulls out and presses again, with little compliance at once.
PULLED = (
    SOFT.replace('model = "kelvin_voigt"\nshear_modulus = "1 MPa"', 'model = "zener"\nshear_modulus = "300 MPa"')
    .replace('viscosity = "0.1 MPa s"', 'kelvin_modulus = "1 MPa"\nkelvin_viscosity = "0.1 MPa s"')
    .replace('load = "20 mN"', 'approach = "8 um"')
    .replace('load = "5 mN"\nover = "1 ms"', 'approach = "2 um"\nover = "50 ms"')
    .replace('hold = "0.2 s"\ncontrol = "approach"', 'approach = "9 um"\nover = "50 ms"')
)
# Sticks, and is pulled off; the same on an elastic body, whose contact jumps.
STICKY = (
    MODES.replace("[40, 33]", "[16, 13]")
    .replace("[[program]]", '[adhesion]\nwork = "0.1 J/m^2"\nrange = "2 um"\n[[program]]', 1)
    .replace('load = "20 mN"', 'approach = "1 um"')
    .replace('load = "5 mN"\nover = 0', 'approach = "-12 um"\nover = "0.1 s"')
)
JUMPING = STICKY.replace('model = "zener"', 'model = "elastic"').replace('kelvin_modulus = "1 MPa"\n', "")
JUMPING = JUMPING.replace('kelvin_viscosity = "0.1 MPa s"\n', "").replace('"3 MPa"', '"0.6 MPa"')
# Two materials that creep in different times: a memory of the waves.
LAYER = (
    MODES.replace("[40, 33]", "[20, 15]")
    .replace("[[program]]", 'thickness = "0.1 mm"\n[material.on]\nmodel = "maxwell"\nshear_modulus = "2 MPa"\n'
             'viscosity = "1 MPa s"\n[[program]]', 1)
    .replace("[keep]", '[keep]\nfields = ["gap"]')
)  # fmt: skip
# Steady sliding: a row is a speed.
CURVE = (
    MODES[: MODES.index("[[program]]")].replace("[40, 33]", "[20, 15]")
    + """
[friction]
pressure = "20 kPa"
speeds = { from = "0.1 mm/s", to = "1 m/s", count = 13 }
[solve]
boundary = "periodic"
"""
)
CASES = {
    "modes": MODES,
    "soft": SOFT,
    "growing": GROWING,
    "sliding": SLIDING,
    "pulled": PULLED,
    "layer": LAYER,
    "sticky": STICKY,
    "jumping": JUMPING,
    "curve": CURVE,
}


def case_of(text, folder):
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "study.toml"
    path.write_text(text)
    return read_study(path)


def values(path):
    """All variables but wall_time, to the last bit."""
    with open_result(path) as ds:
        loaded = with_steps(ds).variables
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


@pytest.mark.thorough
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("cuts", ["few", pytest.param("more", marks=pytest.mark.long)])
def test_stopped_run__goes_on_and_ends_with_the_same_bits(whole, monkeypatch, tmp_path, name, cuts):
    case, expected, steps = whole(CASES[name])
    monkeypatch.setattr("roughvisc.mechanics.stepping.PACKED_FROM", 0)  # pressures are packed, as of large surfaces
    assert steps > 7
    for cut in {"few": (1, steps // 2, steps - 1, steps), "more": {2, steps // 3}}[cuts]:
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


@pytest.mark.parametrize("reports", [1, 2, 6])
def test_interrupt_between_a_row_and_its_state__repeats_no_row(whole, monkeypatch, tmp_path, caplog, reports):
    """In the middle of a pair of steps, or at its end, before the state is recorded. Pressures are packed."""
    case, expected, _ = whole(MODES)
    monkeypatch.setattr("roughvisc.mechanics.stepping.PACKED_FROM", 0)
    told = iter(range(reports))

    def report(now, end):
        if next(told, None) is None:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_case(case, tmp_path, progress=report)
    stopped(case, tmp_path, 3, checkpoint_seconds=0)
    assert values(run_case(case, tmp_path)) == expected
    assert not caplog.records, "both times it went on"


# ----------------------------------------------------------------------------------------------------------------
# what a crash leaves


@pytest.mark.parametrize("damaged", [("state.npz",), ("rows-0000.npz",), ("state.npz", "rows-0001.npz")])
def test_damage__costs_work_and_no_bit_of_the_result(whole, tmp_path, caplog, damaged):
    case, expected, steps = whole(MODES)
    unfinished = stopped(case, tmp_path, steps // 2, checkpoint_seconds=0)
    assert {"state.npz", "rows-0000.npz", "rows-0001.npz"} <= set(names(unfinished))
    for name in damaged:
        content = bytearray((unfinished / name).read_bytes())
        content[len(content) // 2] ^= 4  # one bit of an array
        (unfinished / name).write_bytes(content if name == "rows-0000.npz" else content[: len(content) // 2])
    stop = Stop()
    with caplog.at_level(logging.WARNING, "roughvisc"):
        path = run_case(case, tmp_path, stop=stop)
    assert "damaged" in caplog.text
    assert values(path) == expected
    assert names(tmp_path) == [path.name]
    assert stop.asked == steps, "from the start"


@pytest.mark.parametrize("state", ["kept", "lost"])
def test_rows_beyond_the_checkpoint__do_not_count(whole, tmp_path, state):
    case, expected, steps = whole(MODES)
    unfinished = stopped(case, tmp_path, steps // 2, checkpoint_seconds=0)
    number = len(list(unfinished.glob("rows-*")))
    shutil.copy(unfinished / "rows-0000.npz", unfinished / f"rows-{number:04d}.npz")
    (unfinished / ".rows-0009.0f0f0f0f.part.npz").write_bytes(b"torn off while it was written")
    if state == "lost":  # the run begins anew, is stopped, and finds rows of both runs
        (unfinished / "state.npz").unlink()
        (unfinished / "rows-0000.npz").write_bytes((unfinished / "rows-0001.npz").read_bytes())
        stopped(case, tmp_path, 3, checkpoint_seconds=0)
    assert values(run_case(case, tmp_path)) == expected


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")
@pytest.mark.parametrize(
    ("name", "most"),
    [
        *(
            pytest.param(name, "3", marks=pytest.mark.thorough)
            for name in ("modes", "sliding", "pulled", "layer", "curve")
        ),
        *(pytest.param(name, "24", marks=pytest.mark.long) for name in CASES),
    ],
)
def test_killed_at_some_file_operations__ends_with_the_same_bits(whole, tmp_path, name, most):
    _, expected, _ = whole(CASES[name])
    case = case_of(CASES[name], tmp_path)
    for _, at, end in struck(tmp_path / "study.toml", tmp_path, most, "kill"):
        assert end == "killed"
        path = run_case(case, tmp_path / "kill" / at)
        assert values(path) == expected
        assert names(path.parent) == [path.name]


@pytest.mark.parametrize("size", ["16k", "500k", "1000k"])
def test_full_disk__loses_nothing(whole, monkeypatch, small_disk, size):
    """Wherever it strikes: the first rows, a checkpoint, the result itself."""
    case, expected, steps = whole(MODES)
    folder, remount = small_disk
    remount(f"size={size}")
    monkeypatch.setattr("roughvisc.runs.checkpoint._SHARE", float("inf"))  # saves after each step
    with pytest.raises(OSError, match=r"No space left on device; .* make room and run it again") as caught:
        run_case(case, folder, checkpoint_seconds=0)
    assert caught.value.errno == errno.ENOSPC
    assert not [*folder.glob("*.nc"), *folder.glob(".*.lock")]
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
    for left in (f".{case.key}.unfinished/rows-0000.npz", f".{case.key}.lock", f".{case.key}.0f0f0f0f.part.nc"):
        (tmp_path / left).parent.mkdir(exist_ok=True)
        (tmp_path / left).write_text("")
    assert run_case(case, tmp_path) == path
    assert names(tmp_path) == [path.name]
    assert path.stat().st_mtime_ns == before.st_mtime_ns
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(AssertionError, match="computed again"):
        run_case(case, tmp_path)


def test_result_of_another_case__is_refused(whole, tmp_path):
    case, _, _ = whole(MODES)
    other = vary(case, {"program.0.load": "21 mN"})
    run_case(other, tmp_path).rename(tmp_path / f"{case.key}.nc")
    with refused(str(tmp_path / f"{case.key}.nc")):  # it is whole, and not damaged
        run_case(case, tmp_path)


def test_other_transforms__go_on(whole, tmp_path, monkeypatch, caplog):
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
        assert mixed.attrs["source"].endswith(f"; {there}")
        force = mixed.pressure.sum(("x", "y")).values
    assert run_case(case, tmp_path, stop=stop) == path
    assert stop.asked == steps - steps // 2, "it is finished"
    monkeypatch.setenv("ROUGHVISC_TRANSFORMS", "scipy")
    with open_result(run_case(case, tmp_path / "scipy")) as same:
        np.testing.assert_allclose(force, same.pressure.sum(("x", "y")).values, rtol=case.settings.tolerance)


@pytest.mark.thorough
def test_two_runs_at_once__the_second_says_so(whole, tmp_path):
    case, expected, _ = whole(MODES)
    refused = []

    def second(now, end):
        if not refused:
            with pytest.raises(BlockingIOError) as caught:
                run_case(case, tmp_path)
            refused.append(caught)

    path = run_case(case, tmp_path, progress=second)
    assert refused
    assert values(path) == expected
    assert names(tmp_path) == [path.name]


def test_lock__of_a_process_that_is_being_cleared_away_is_waited_for(tmp_path):
    fcntl = pytest.importorskip("fcntl")
    path = tmp_path / "lock"
    with open(path, "w") as dying:
        fcntl.flock(dying, fcntl.LOCK_EX)
        threading.Timer(0.3, fcntl.flock, (dying, fcntl.LOCK_UN)).start()
        with lock_case(path):
            assert path.exists()
    assert not path.exists()
