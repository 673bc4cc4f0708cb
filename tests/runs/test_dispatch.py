"""Cases on a cluster: whatever becomes of its workers, every case ends with the same numbers."""

import asyncio
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from functools import partial
from types import SimpleNamespace

import dask
import pytest
import xarray as xr
from distributed import Client, LocalCluster
from support import BALL, LOADS, LONG, assert_same, numbers, refused

import roughvisc as rv
from roughvisc.cli.studies import connect
from roughvisc.errors import RoughviscError
from roughvisc.runs import cluster as cluster_module
from roughvisc.runs import sweep as sweep_module
from roughvisc.runs.cluster import default_client
from roughvisc.runs.display import Display
from roughvisc.runs.folder import case_path
from roughvisc.runs.sweep import run_cases, sweep

pytestmark = pytest.mark.filterwarnings(
    "ignore:.*Sending large graph.*:UserWarning",
    # as the interpreter collects what distributed leaves behind
    "ignore::pytest.PytestUnraisableExceptionWarning",
)


@contextmanager
def bare_cluster():
    """Client of a scheduler in this process that has no workers."""
    with (
        LocalCluster(
            n_workers=0, processes=False, protocol="tcp://", host="127.0.0.1", dashboard_address="127.0.0.1:0"
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield client


@contextmanager
def thread_workers(count):
    """Client of a cluster whose workers are threads of this process."""
    with (
        LocalCluster(n_workers=count, processes=False, dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield client


@contextmanager
def worker_process(client, *options):
    """A worker as a batch system starts it: in a process group of its own, that gets every signal at once."""
    command = [sys.executable, "-m", "dask", "worker", client.scheduler.address, "--nthreads", "1", "--no-dashboard"]
    process = subprocess.Popen([*command, *options], stdout=-3, stderr=-3, start_new_session=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGTERM)
        process.wait(60)


def short_hold(study):
    """A case that takes some seconds."""
    return study(LONG.replace('hold = "0.2 s"', 'hold = "0.1 s"').replace(', "200 ms"', ""))[0]


class Ear(Display):
    """Keeps what a sweep displays: times reached, and lines."""

    def __init__(self):
        super().__init__(False)
        self.heard, self.lines = [], []

    def reached(self, key, now, end):
        self.heard.append((key, now, end))

    def say(self, text, key=""):
        self.lines.append(text)

    def wait_until(self, condition):
        wait_for(lambda: condition(self.heard))


@contextmanager
def foreign_worker(client, folder):
    """A worker process with a package of the same name that states another version and holds nothing else."""
    (folder / "roughvisc").mkdir(parents=True)
    (folder / "roughvisc" / "__init__.py").touch()
    (folder / "roughvisc-0.0.7.dist-info").mkdir()
    (folder / "roughvisc-0.0.7.dist-info" / "METADATA").write_text("Name: roughvisc\nVersion: 0.0.7\n")
    command = [sys.executable, "-m", "dask", "worker", client.scheduler.address, "--nthreads", "1", "--no-nanny"]
    process = subprocess.Popen([*command, "--no-dashboard"], cwd=folder, stdout=-3, stderr=-3)
    try:
        yield
    finally:
        process.terminate()
        process.wait(60)


def test_worker_with_another_version__is_refused_by_its_address(study, tmp_path):
    with bare_cluster() as client, foreign_worker(client, tmp_path / "other"):
        client.wait_for_workers(1, timeout=60)
        ((address, _),) = client.nthreads().items()
        with refused(f"worker {address}", "0.0.7"):
            run_cases(study(), tmp_path / "out", display=Display(False), client=client)
    assert not list((tmp_path / "out").glob("*.failed.json"))


def test_scan_that_a_worker_cannot_read__fails_no_case(study, tmp_path):
    height = rv.self_affine((1e-3, 1e-3), (24, 20), hurst=0.8, rms_height=1e-6, seed=1)
    rv.save_scan(height, tmp_path / "rough.nc")
    surface = BALL[BALL.index("generate") : BALL.index("[material]")]
    cases = study(BALL.replace(surface, 'file = "rough.nc"\n').replace('"free"', '"periodic"'))
    assert cases[0].key, "this process has read the scan"
    (tmp_path / "rough.nc").rename(tmp_path / "elsewhere.nc")
    with thread_workers(1) as client:
        ((address, _),) = client.nthreads().items()
        (outcome,) = run_cases(cases, tmp_path / "out", display=Display(False), client=client).values()
    assert outcome.kind == "hindered"
    assert str(tmp_path / "rough.nc") in outcome.message
    assert address in outcome.message
    assert not list((tmp_path / "out").glob("*.failed.json"))


def test_program_without_duration__begins_once_on_a_worker(tmp_path):
    """A load that is instantaneous ends at time zero, which is not a start on another worker."""
    height = rv.self_affine((1e-3, 1e-3), 8, hurst=0.8, rms_slope=0.1, seed=1)
    case = rv.Case(height, rv.elastic(1e6, 0.5), rv.Program().load(1e-3, over=0), boundary="periodic")
    with thread_workers(1) as client:
        (outcome,) = run_cases([case], tmp_path, display=(ear := Ear()), client=client).values()
    assert outcome.kind == "done"
    assert not any("has gone" in line for line in ear.lines)


def test_default_client__computes_sweeps_but_not_within_a_task(study, tmp_path):
    cases = study()
    with thread_workers(1) as client, client.as_current():
        assert default_client() is client
        assert client.submit(default_client, pure=False).result() is None
        found = rv.sweep(cases[:1], tmp_path / "out", progress=False)
        stored = [key for _, events in client.get_events().items() for _, event in events if (key := key_of(event))]
    assert found.sizes["case"] == 1
    assert set(stored) == {cases[0].key}, "the worker has reported it"


def test_asynchronous_client__is_refused_before_anything_runs(study, tmp_path):
    """Given, or as the default client, as a notebook may have it."""
    (tmp_path / "out").mkdir()
    cases, out = study(BALL), tmp_path / "out"
    calls = (partial(rv.sweep, cases), partial(rv.budget, cases[0]), partial(rv.observe, cases))

    async def main():
        settings = {"processes": False, "n_workers": 1, "dashboard_address": "127.0.0.1:0", "set_as_default": False}
        async with Client(asynchronous=True, **settings) as client:
            for call in calls[:2]:
                with refused("client", client):
                    call(out=out, client=client)
            with client.as_current():
                for call in (calls[0], calls[2]):
                    with refused("client", client):
                        call(out=out)

    asyncio.run(main())
    assert not list(out.iterdir())


def key_of(event):
    return event.get("key") if isinstance(event, dict) and {"key", "now", "end"} <= event.keys() else None


@pytest.mark.thorough
@pytest.mark.timeout(300)
def test_lost_scheduler__is_one_message_and_no_traceback(study, tmp_path):
    study(LONG)
    scheduler = [sys.executable, "-m", "dask", "scheduler", "--scheduler-file", "s.json", "--host", "127.0.0.1"]
    quiet = {"cwd": tmp_path, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen([*scheduler, "--port", "0", "--no-dashboard"], **quiet)
    wait_for(lambda: (tmp_path / "s.json").exists())
    worker = subprocess.Popen(
        [sys.executable, "-m", "dask", "worker", "--scheduler-file", "s.json", "--nthreads", "1", "--no-dashboard"],
        **quiet,
    )
    try:
        command = [sys.executable, "-m", "roughvisc", "run", "ball.toml", "--scheduler-file", "s.json", "-q"]
        run = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        wait_for(lambda: list((tmp_path / "results" / "ball").glob(".*.unfinished")))
        process.kill()
        out, err = run.communicate(timeout=120)
    finally:
        for one in (process, worker):
            one.kill()
            one.wait(60)
    assert (run.returncode, out) == (1, "")
    assert "scheduler" in err
    assert err.count("\n") == 1


def wait_for(condition):
    until = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < until, "it never came"
        time.sleep(0.05)


# ----------------------------------------------------------------------------------------------------------------
# workers that are lost


@pytest.mark.thorough
def test_sweep__goes_on_when_a_worker_is_killed(study, tmp_path, by_hand):
    cases = study(LONG + LOADS)
    wanted = {}
    with connect(file=by_hand) as client:
        killed = kill_working(client, times=1)
        ds = sweep(cases[:2], tmp_path / "killed", client, progress=False)
        killed.join()
        assert killed.victims
        wanted = sweep(cases[:2], tmp_path / "calm", client, progress=False)
    assert ds.sizes["case"] == 2
    xr.testing.assert_equal(ds.load(), wanted.load())


@pytest.mark.thorough
def test_sweep__gives_up_for_now_a_case_whose_workers_die(study, tmp_path, by_hand):
    cases = study(LONG + LOADS)[:2]
    with connect(file=by_hand) as client:
        killed = kill_working(client, times=2)
        with pytest.raises(RoughviscError, match=r"none of 1 cases .* was lost 2 times.* repeat the command to resume"):
            sweep(cases[:1], tmp_path / "out", client, progress=False)
        killed.join()
        client.wait_for_workers(2, timeout=60)
    assert not case_path(tmp_path / "out", cases[0].key, "failure").exists(), "it is not the case that failed"


def kill_working(client, times):
    """A thread that kills so many workers in the midst of a case."""

    def kill():
        until = time.monotonic() + 60
        while len(killer.victims) < times and time.monotonic() < until:
            busy = [worker for worker, keys in client.processing().items() if keys]
            for worker in busy[:1]:
                pid = client.run(os.getpid, workers=[worker], on_error="ignore").get(worker)
                time.sleep(0.3)
                if pid and pid not in killer.victims and client.processing().get(worker):
                    os.kill(pid, signal.SIGKILL)
                    killer.victims.append(pid)
            time.sleep(0.1)

    killer = threading.Thread(target=kill, daemon=True)
    killer.victims = []
    killer.start()
    return killer


@pytest.mark.timeout(60)  # Ctrl-C waits for nobody where there is nobody
@pytest.mark.parametrize("where", ["cluster", "this machine"])
def test_no_workers__is_told_and_interrupted_at_once(study, tmp_path, monkeypatch, where):
    monkeypatch.setattr(cluster_module, "_ALONE_AFTER", 0.3)
    monkeypatch.setattr(sweep_module, "local_client", lambda processes: bare_cluster())

    ear, messages = Ear(), []

    def ctrl_c(text, **_):
        messages.append(text)
        raise KeyboardInterrupt

    monkeypatch.setattr(cluster_module, "warnings", SimpleNamespace(warn=ctrl_c))
    with bare_cluster() as cluster:
        how = {"client": cluster} if where == "cluster" else {"workers": 2}
        with pytest.raises(KeyboardInterrupt):
            run_cases(study(), tmp_path / "out", display=ear, **how)
    assert ear.lines[-1].startswith("stopping")
    (message,) = messages
    assert "no worker" in message
    assert message in (tmp_path / "out" / "sweep.log").read_text()
    assert not list((tmp_path / "out").glob("*.failed.json"))


@pytest.mark.thorough
@pytest.mark.timeout(300)
@pytest.mark.parametrize("how", ["SIGTERM", "SIGSTOP"])
def test_worker_that_leaves__hands_its_case_over(study, tmp_path, how):
    """Told to leave, it writes its checkpoint first; stopped for good, it still holds the lock of the case."""
    case, out = short_hold(study), tmp_path / "out"
    ear, outcomes = Ear(), {}
    with dask.config.set({"distributed.scheduler.worker-ttl": "10s"}), bare_cluster() as client:
        run = partial(run_cases, [case], out, display=ear, client=client)
        thread = threading.Thread(target=lambda: outcomes.update(run()))
        with worker_process(client) as first:
            thread.start()
            ear.wait_until(lambda heard: any(now > 0 for _, now, _ in heard))
            os.killpg(first.pid, getattr(signal, how))
            if how == "SIGTERM":
                first.wait(60)
                assert list((out / f".{case.key}.unfinished").glob("state.npz")), "long before one was due"
            left_at = max(now for _, now, _ in ear.heard)
            with worker_process(client):
                thread.join(200)
            if how == "SIGSTOP":
                os.killpg(first.pid, signal.SIGKILL)
    assert [o.kind for o in outcomes.values()] == ["done"]
    assert any("has gone; the case resumes on" in line for line in ear.lines)
    if how == "SIGTERM":
        second = [end for _, _, end in ear.heard].index(0.0, 1)
        assert ear.heard[second + 1][1] > left_at, "it did not begin anew"
    run_cases([case], tmp_path / "calm", display=Display(False), workers=0)
    assert_same(numbers(out), numbers(tmp_path / "calm"))


def test_results_folder_that_a_worker_does_not_see__fails_no_case(study, tmp_path):
    """Workers of another machine would write where nobody reads."""
    (case,) = study()[:1]
    with thread_workers(1) as client:
        settings = {"stop_file": str(tmp_path / "stop"), "name": "test", "threads": 1, "own": False}
        outcome = client.submit(
            cluster_module.on_worker, case.to_json(), case.key, folder=str(tmp_path / "elsewhere"), **settings
        ).result()
    assert outcome.kind == "hindered"
    assert str(tmp_path / "elsewhere") in outcome.message
