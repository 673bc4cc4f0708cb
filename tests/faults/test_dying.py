"""A run that dies, is refused something, or finds its files damaged: the next one ends with the same bits."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from damage import damaged_bytes, within
from support import BALL

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.study.execution.monitor import Monitor
from roughvisc.study.execution.run import run_case
from roughvisc.study.execution.sweep import run_cases
from roughvisc.study.statement.case import read_cases, read_study
from roughvisc.study.storage.index import INDEX
from roughvisc.study.storage.store import open_result
from roughvisc.study.storage.sweep_cases import SWEEP
from roughvisc.study.storage.upkeep import clean_folder

SMALL = BALL.replace("[24, 21]", "[12, 9]")
TWO_LOADS = SMALL + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'
WAYS = ("kill", "ENOSPC", "EROFS", "EIO", "MemoryError")

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")


def struck(tmp_path, most):
    """What happened, at which operation, and how the run ended, for each run."""
    script = Path(__file__).with_name("dying.py")
    command = [sys.executable, script, tmp_path / "ball.toml", tmp_path, most, "20", *WAYS]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=True)
    assert "Traceback" not in done.stderr
    return [line.split(" ", 2) for line in done.stdout.splitlines()]


@pytest.fixture
def case(tmp_path):
    (tmp_path / "ball.toml").write_text(SMALL)
    return read_study(tmp_path / "ball.toml")


@pytest.fixture
def wanted(case, tmp_path):
    with open_result(run_case(case, tmp_path / "wanted")) as ds:
        return ds.drop_vars("wall_time").load()


@pytest.mark.timeout(7200)  # the large one: some 700 runs
@pytest.mark.parametrize(
    "most", [pytest.param("2", marks=pytest.mark.thorough), pytest.param("all", marks=pytest.mark.long)]
)
def test_at_a_file_operation(case, wanted, tmp_path, most):
    lines = struck(tmp_path, most)
    assert len(lines) == 2 * len(WAYS) if most == "2" else len(lines) > 30 * len(WAYS)
    for way, at, end in lines:
        assert end == "killed" if way == "kill" else "TRACEBACK" not in end
        folder = tmp_path / way / at
        with open_result(run_case(case, folder)) as found:
            xr.testing.assert_equal(found.drop_vars("wall_time"), wanted)
        clean_folder(folder)
        assert [path.name for path in folder.iterdir()] == [f"{case.key}.nc"], (way, at, end)


@pytest.mark.skipif(sys.platform != "linux", reason="limits the addresses of a process")
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("count", [2, pytest.param(200, marks=pytest.mark.long)])
def test_at_an_allocation(tmp_path, count):
    """Libraries of C die of it here and there; no run is the worse for it."""
    path = tmp_path / "ball.toml"
    path.write_text(BALL.replace("[24, 21]", "[128, 112]"))
    script = Path(__file__).with_name("starving.py")
    command = [sys.executable, script, path, tmp_path, str(count), "23"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=True)
    ends = [line.split(" ", 1)[1] for line in done.stdout.splitlines()]
    assert len(ends) == count
    assert not [end for end in ends if "TRACEBACK" in end]
    assert any(end != "finished" for end in ends)
    case = read_study(path)
    with open_result(run_case(case, tmp_path / "wanted")) as ds:
        wanted = ds.drop_vars("wall_time").load()
    for number in range(count):
        with open_result(run_case(case, tmp_path / str(number))) as found:
            xr.testing.assert_equal(found.drop_vars("wall_time"), wanted)


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("count", [8, pytest.param(300, marks=pytest.mark.long)])
def test_damaged_checkpoints(case, wanted, tmp_path, count):
    """One of the two, both, or the rows: each run ends with the same bits, from the other one or from the start."""
    rng, steps = np.random.default_rng(24), iter(range(1000))
    with pytest.raises(KeyboardInterrupt):
        run_case(case, tmp_path / "stopped", checkpoint_steps=2, stop=lambda: next(steps) >= 6)
    (unfinished,) = (tmp_path / "stopped").glob(".*.unfinished")
    names = sorted(path.name for path in unfinished.iterdir())
    assert names == ["checkpoint.0", "checkpoint.1", "rows"]
    for number in range(count):
        there = tmp_path / str(number) / unfinished.name
        shutil.copytree(unfinished, there)
        for name in rng.choice(names, size=rng.integers(1, 3), replace=False):
            (there / name).write_bytes(damaged_bytes(rng, (unfinished / name).read_bytes()))
        with within(20), open_result(run_case(case, there.parent)) as found:
            xr.testing.assert_equal(found.drop_vars("wall_time"), wanted)
        assert [path.name for path in there.parent.iterdir()] == [f"{case.key}.nc"]


@pytest.mark.parametrize("count", [12, pytest.param(300, marks=pytest.mark.long)])
def test_damaged_results(tmp_path, count):
    """Each is refused where it is opened, and a sweep ends with the same bits."""
    path = tmp_path / "two.toml"
    path.write_text(TWO_LOADS)
    cases, out, rng = read_cases(path), tmp_path / "out", np.random.default_rng(21)
    run_cases(cases, out, watch=Monitor(), workers=0)
    wanted = rv.open_results(out, cases=cases).drop_vars("wall_time").load()
    places = [out / f"{case.key}.nc" for case in cases]
    whole = [place.read_bytes() for place in places]
    refused = 0
    for number in range(count):
        place, content = places[number % 2], whole[number % 2]
        place.write_bytes(damaged_bytes(rng, content))
        with within(20):
            try:
                with open_result(place) as found:
                    xr.testing.assert_identical(found.load(), wanted_alone(content, tmp_path))
            except InputError:
                refused += 1
            if number % 10 == 0:
                outcomes = run_cases(cases, out, watch=Monitor(), workers=0)
                assert {one.kind for one in outcomes.values()} == {"done"}
                found = rv.open_results(out).drop_vars("wall_time")
                xr.testing.assert_equal(found.load(), wanted)
        place.write_bytes(content)
    assert refused > 0.8 * count


def wanted_alone(content, tmp_path):
    path = tmp_path / "whole.nc"
    path.write_bytes(content)
    with open_result(path) as ds:
        return ds.load()


@pytest.mark.parametrize("count", [12, pytest.param(300, marks=pytest.mark.long)])
def test_damaged_index(tmp_path, count):
    path = tmp_path / "two.toml"
    path.write_text(TWO_LOADS)
    cases, out, rng = read_cases(path), tmp_path / "out", np.random.default_rng(22)
    run_cases(cases, out, watch=Monitor(), workers=0)
    wanted = rv.open_results(out).load()
    whole = {name: (out / name).read_bytes() for name in (INDEX, SWEEP)}
    for number in range(count):
        name = (INDEX, SWEEP)[number % 2]
        (out / name).write_bytes(damaged_bytes(rng, whole[name]))
        with within(20):
            xr.testing.assert_identical(rv.open_results(out, cases=cases).load(), wanted)
            try:
                xr.testing.assert_identical(rv.open_results(out).load(), wanted)
            except InputError as error:
                assert error.key == SWEEP  # noqa: PT017
        (out / name).write_bytes(whole[name])
