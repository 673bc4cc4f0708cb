"""Many cases: the same numbers wherever they are computed, nothing lost, and all of them seen as one."""

import contextlib
import errno
import json
import os
import signal
import subprocess
import sys
import time

import psutil
import pytest
import xarray as xr
from support import BALL, LONG, assert_same, numbers, refused

from roughvisc.cli.studies import connect
from roughvisc.errors import InputError, RoughviscError, TooLargeError
from roughvisc.runs import cluster as cluster_module
from roughvisc.runs import run as run_module
from roughvisc.runs import sweep as sweep_module
from roughvisc.runs.csv_files import CASES
from roughvisc.runs.display import Display
from roughvisc.runs.folder import case_path
from roughvisc.runs.sweep import run_cases, sweep
from roughvisc.runs.sweep_data import INDEX, SWEEP

RUN = [sys.executable, "-m", "roughvisc", "run"]

pytestmark = pytest.mark.filterwarnings(
    "ignore:.*Sending large graph.*:UserWarning",
    # as the interpreter collects what distributed leaves behind
    "ignore::pytest.PytestUnraisableExceptionWarning",
)


@contextlib.contextmanager
def in_this_process(processes):
    """A cluster whose workers are threads, so that they see what a test has changed."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=processes, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0"
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield client


def leftovers(folder):
    """What is in a folder besides results, records, log and index."""
    return [
        p.name
        for p in folder.iterdir()
        if p.suffix != ".nc" and p.name not in ("sweep.log", CASES, INDEX, SWEEP, "inputs")
    ]


# ----------------------------------------------------------------------------------------------------------------
# where it is computed


@pytest.mark.thorough
def test_sweep__same_bits_here_and_on_workers_and_on_a_cluster(study, tmp_path, by_hand):
    cases = study()
    here = sweep(cases, tmp_path / "here", workers=0, progress=False)
    one = sweep(cases, tmp_path / "one", workers=1, progress=False)
    several = sweep(cases, tmp_path / "several", workers=2, progress=False)
    with connect(file=by_hand) as client:
        remote = sweep(cases, tmp_path / "remote", client, progress=False)
    wanted = numbers(tmp_path / "here")
    assert len(wanted) == 4
    for name, ds in (("one", one), ("several", several), ("remote", remote)):
        assert_same(numbers(tmp_path / name), wanted)
        xr.testing.assert_equal(ds.load(), here.load())
        assert leftovers(tmp_path / name) == []


@pytest.mark.thorough
def test_run__on_a_cluster_by_its_scheduler_file(study, tmp_path, by_hand):
    study()
    command = [*RUN, "ball.toml", "--scheduler-file", by_hand]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "of them before" not in done.stdout
    assert "4 of 4 cases done" in done.stdout
    address = json.loads(by_hand.read_text())["address"]
    done = subprocess.run([*RUN, "ball.toml", "--scheduler", address], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "4, 4 of them before" in done.stdout


@pytest.mark.thorough
@pytest.mark.parametrize("workers", [2, 0])
def test_run__shows_each_warning_once_and_names_its_case(study, tmp_path, workers):
    """A steep indenter of three loads: the loaded surface of two of them is steeper than the method allows."""
    steep = BALL.replace('"10 mm"', '"0.1 mm"').replace('"1 mm"', '"0.4 mm"')
    study(steep + '[sweep]\n"program.0.load" = ["10 uN", "20 mN", "30 mN"]\n')
    command = [*RUN, "ball.toml", "--workers", str(workers)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    (line,) = (line for line in (done.stdout + done.stderr).splitlines() if "slope" in line)
    assert line.startswith(("case 1 (20 mN): ", "case 2 (30 mN): "))


# ----------------------------------------------------------------------------------------------------------------
# what fails, what is interrupted, what is done again


POISON = '[sweep]\n"program.0.load" = ["4 mN", "50 N", "5 mN", 5e-3]\n'


def test_sweep__a_failing_case_stops_nothing_and_is_not_tried_again(study, tmp_path, monkeypatch, caplog):
    cases = study(BALL + POISON)
    computed = []
    compute = run_module.compute

    def counted(case, *keeper, **settings):
        computed.append(case.varied["program.0.load"])
        return compute(case, *keeper, **settings)

    monkeypatch.setattr(run_module, "compute", counted)
    ds = sweep(cases, tmp_path / "out", workers=0, progress=False)
    assert computed == [4e-3, 50.0, 5e-3], "those alike are computed once"
    assert list(ds["program_0_load"]) == [4e-3, 5e-3]
    assert "boundary" in caplog.text
    record = json.loads(case_path(tmp_path / "out", cases[1].key, "failure").read_text())
    assert record["error"] == "EdgeContactError"
    assert record["case"]["varied"] == {"program.0.load": 50.0}
    assert "failed" in (tmp_path / "out" / "sweep.log").read_text()

    outcomes = run_cases(cases, tmp_path / "out", display=Display(False), workers=0)
    assert computed == [4e-3, 50.0, 5e-3, 50.0], "the failed case alone is tried again"
    assert [o.kind for o in outcomes.values()] == ["done", "failed", "done"]
    assert [o.reused for o in outcomes.values()] == [True, False, True]


def test_sweep__an_error_of_the_program_is_kept_with_its_traceback(study, tmp_path, monkeypatch):
    cases = study()

    def broken(*case, **settings):
        return 1 / 0

    monkeypatch.setattr(run_module, "compute", broken)
    with pytest.raises(RoughviscError, match="none of 4 cases could be finished; the first: ZeroDivisionError"):
        sweep(cases, tmp_path / "out", workers=0, progress=False)
    record = json.loads(case_path(tmp_path / "out", cases[0].key, "failure").read_text())
    assert "return 1 / 0" in record["traceback"]
    monkeypatch.undo()
    assert sweep(cases, tmp_path / "out", workers=0, progress=False).sizes["case"] == 4
    assert leftovers(tmp_path / "out") == [], "the records go when the cases are done"


@pytest.mark.parametrize(
    "error",
    [OSError(5, "Input/output error", "x.nc"), BlockingIOError(errno.EWOULDBLOCK, "in use", "x.lock"), MemoryError()],
)
def test_sweep__what_was_in_the_way_is_tried_again(study, tmp_path, monkeypatch, error):
    cases = study()

    def hindered(*case, **settings):
        raise error

    monkeypatch.setattr(run_module, "compute", hindered)
    outcomes = run_cases(cases, tmp_path / "out", display=Display(False), workers=0)
    assert {o.kind for o in outcomes.values()} == {"hindered"}
    assert not list((tmp_path / "out").glob("*.failed.json"))
    monkeypatch.undo()
    assert sweep(cases, tmp_path / "out", workers=0, progress=False).sizes["case"] == 4


@pytest.mark.parametrize("workers", [0, 1])
def test_sweep__ends_with_one_message_on_a_full_disk(study, tmp_path, monkeypatch, capfd, workers):
    """The second case finds no space: those after it are not begun, and the same command goes on."""
    cases = study()
    compute = run_module.compute

    def full(case, *keeper, **settings):
        (tmp_path / f"begun-{len(list(tmp_path.glob('begun*')))}").touch()
        if len(list(tmp_path.glob("begun*"))) == 2:
            raise OSError(28, "No space left on device; make room", "x.nc")
        if len(list(tmp_path.glob("begun*"))) == 3:
            time.sleep(1)  # the sweep hears of the full disk before the fourth case could begin
        return compute(case, *keeper, **settings)

    if workers:  # the processes of a local cluster are forked from one that has not seen this
        monkeypatch.setattr(sweep_module, "local_client", in_this_process)
    monkeypatch.setattr(run_module, "compute", full)
    with pytest.raises(OSError, match=r"\.nc: No space left .*make room .*\(1 of 4 cases are finished\)$") as caught:
        run_cases(cases, tmp_path / "out", display=Display(False), workers=workers)
    assert caught.value.errno == errno.ENOSPC
    begun = len(list(tmp_path.glob("begun*")))
    assert begun == 2 if workers == 0 else begun < 4
    assert not list((tmp_path / "out").glob("*.failed.json"))
    assert "No space left" in (tmp_path / "out" / "sweep.log").read_text()
    monkeypatch.undo()
    assert sweep(cases, tmp_path / "out", workers=0, progress=False).sizes["case"] == 4


@pytest.mark.thorough
def test_sweep__computes_cases_of_much_memory_in_fewer_processes(study, tmp_path, monkeypatch):
    """A case fits if one process has all the memory, and not if four share it."""
    cases = study()
    compute = run_module.compute
    processes = []

    def cluster(count):
        processes.append(count)
        return in_this_process(count)

    def large(case, *keeper, **settings):
        if case.varied["program.0.load"] == 5e-3 and processes[-1] > 1:
            raise TooLargeError("it needs more")
        return compute(case, *keeper, **settings)

    monkeypatch.setattr(sweep_module, "_START", 0.0)
    monkeypatch.setattr(sweep_module, "threads_each", lambda processes: 4 // processes)
    monkeypatch.setattr(sweep_module, "local_client", cluster)
    monkeypatch.setattr(run_module, "compute", large)
    outcomes = run_cases(cases, tmp_path / "out", display=Display(False))
    assert [outcome.kind for outcome in outcomes.values()] == ["done"] * 4
    assert processes == [4, 2, 1]
    outcomes = run_cases(cases, tmp_path / "two", display=Display(False), workers=2)  # as the user wishes
    assert [outcome.kind for outcome in outcomes.values()] == ["done", "done", "hindered", "hindered"]


def alive(group):
    """Processes of a group that are not zombies."""
    found = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, ProcessLookupError):
            if os.getpgid(process.pid) == group and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process.cmdline())
    return found


@pytest.mark.thorough
def test_run__ctrl_c_is_status_130(study, tmp_path):
    text = LONG.replace('times = [0, "0.1 s", "200 ms"]', "times = 2")
    study(text + '[sweep]\n"program.1.hold" = ["1 ms", "20 s", "21 s", "22 s"]\n')
    command = [*RUN, "ball.toml", "--workers", "2"]
    process = subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    folder = tmp_path / "results" / "ball"
    until = time.monotonic() + 60
    while not list(folder.glob("*.nc")) and time.monotonic() < until:
        time.sleep(0.1)
    time.sleep(1.0)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: all processes get it
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err.count("\n")) == (130, 1)
    until = time.monotonic() + 10
    while (left := alive(process.pid)) and time.monotonic() < until:
        time.sleep(0.1)
    assert not left, "no worker outlives the sweep"
    assert len([p for p in folder.glob("*.nc") if not p.name.startswith(".")]) == 1
    assert "interrupted" in (folder / "sweep.log").read_text()


def test_sweep__refuses_what_makes_no_sense(study, tmp_path):
    with refused("cases", []):
        sweep([], tmp_path)
    with refused("workers", -1):
        sweep(study(), tmp_path, workers=-1)
    bad = BALL + '[sweep]\n"program.0.load" = ["50 N", "60 N"]\n'
    with pytest.raises(InputError, match="none of 2 cases"):
        sweep(study(bad), tmp_path / "bad", workers=0, progress=False)


# ----------------------------------------------------------------------------------------------------------------
# what a user sees


def test_sweep__that_ends_before_a_cluster_would_start_needs_none(study, tmp_path, monkeypatch):
    monkeypatch.setattr(sweep_module, "threads_each", lambda processes: 4 // max(processes, 1))
    monkeypatch.setattr(sweep_module, "local_client", None)
    monkeypatch.setattr(sweep_module, "_START", 1e3)
    outcomes = run_cases(study(), tmp_path / "out", display=Display(False))
    assert [outcome.kind for outcome in outcomes.values()] == ["done"] * 4


def test_sweep__goes_on_in_a_cluster_with_the_same_bits(study, tmp_path, monkeypatch):
    """The first case is stopped at its first step, and a worker continues it from its checkpoint."""
    cases = study()
    monkeypatch.setattr(sweep_module, "threads_each", lambda processes: 2)
    monkeypatch.setattr(sweep_module, "local_client", in_this_process)
    monkeypatch.setattr(sweep_module, "_START", 0.0)
    found = sweep(cases, tmp_path / "out", progress=False)
    assert "resumes after" in (tmp_path / "out" / "sweep.log").read_text()
    wanted = sweep(cases, tmp_path / "calm", workers=0, progress=False)
    names = [name for name in wanted.data_vars if name != "wall_time"]
    xr.testing.assert_identical(found[names].drop_attrs(), wanted[names].drop_attrs())


def test_sweep__of_more_cases_than_a_window(study, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_module, "_WINDOW", 1)
    monkeypatch.setattr(cluster_module, "_CASES_AHEAD", 1)
    monkeypatch.setattr(sweep_module, "local_client", in_this_process)
    outcomes = run_cases(study(), tmp_path / "out", display=Display(False), workers=1)
    assert [outcome.kind for outcome in outcomes.values()] == ["done"] * 4
