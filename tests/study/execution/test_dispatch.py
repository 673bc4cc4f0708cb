"""Cases on a cluster: whatever becomes of its workers, every case ends with the same numbers."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from types import SimpleNamespace

import dask
import pytest
import xarray as xr
from distributed import Client, KilledWorker, LocalCluster
from support import LOADS, LONG, assert_same, numbers

import roughvisc as rv
from roughvisc.errors import EdgeContactError, InputError, InUseError, RoughviscError
from roughvisc.study.execution import dispatch
from roughvisc.study.execution.cluster import connect, has_other_versions
from roughvisc.study.execution.monitor import LiveMonitor, Monitor
from roughvisc.study.execution.sweep import run_cases, sweep
from roughvisc.study.execution.task import Outcome
from roughvisc.study.statement.case import vary
from roughvisc.study.statement.identity import program_version
from roughvisc.study.storage.failures import record_path

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


class Ear(Monitor):
    """Keeps what a sweep is told: times reached, and messages."""

    def __init__(self):
        self.heard, self.messages = [], []

    def reached(self, key, now, end):
        self.heard.append((key, now, end))

    def message(self, text):
        self.messages.append(text)

    def wait_until(self, condition):
        until = time.monotonic() + 60
        while not condition(self.heard):
            assert time.monotonic() < until, "never heard of"
            time.sleep(0.02)


@pytest.mark.long
def test_killed_worker__with_all_cases_in_its_queue(study, tmp_path):
    """A scheduler that forgives no death, and gives all cases to one worker at once: as bad as it can be."""
    cases = study(LONG + LOADS)
    settings = {"distributed.scheduler.allowed-failures": 0, "distributed.scheduler.worker-saturation": "inf"}
    with dask.config.set(settings), bare_cluster() as client, worker_process(client):
        client.wait_for_workers(1, timeout=60)
        killed = kill_working(client, times=1)
        outcomes = run_cases(cases, tmp_path / "out", watch=Ear(), client=client)
        killed.join()
        assert killed.victims
    assert [o.kind for o in outcomes.values()] == ["done"] * 4


@pytest.mark.long
def test_lifetime__of_each_worker_is_shorter_than_the_sweep(study, tmp_path):
    cases = study(LONG.replace('hold = "0.2 s"', 'hold = "0.4 s"').replace(', "200 ms"', "") + LOADS)
    lifetime = ["--lifetime", "5s", "--lifetime-stagger", "1s", "--lifetime-restart"]
    with bare_cluster() as client, worker_process(client, *lifetime), worker_process(client, *lifetime):
        outcomes = run_cases(cases, tmp_path / "out", watch=(ear := Ear()), client=client)
    assert [o.kind for o in outcomes.values()] == ["done"] * 4
    assert sum(end == 0 for _, _, end in ear.heard) > 4, "some were begun again"
    run_cases(cases, tmp_path / "calm", watch=Monitor(), workers=0)
    assert_same(numbers(tmp_path / "out"), numbers(tmp_path / "calm"))


# ----------------------------------------------------------------------------------------------------------------
# workers with another version of roughvisc


@contextmanager
def foreign_worker(client, folder):
    """A worker process with a package of the same name that states another version and holds nothing else."""
    (folder / "other" / "roughvisc").mkdir(parents=True)
    (folder / "other" / "roughvisc" / "__init__.py").write_text('__version__ = "0.0.7"\n')
    command = [sys.executable, "-m", "dask", "worker", client.scheduler.address, "--nthreads", "1"]
    process = subprocess.Popen(
        [*command, "--no-nanny", "--no-dashboard"],
        cwd=folder / "other",
        stdout=-3,
        stderr=-3,
    )
    try:
        yield process
    finally:
        process.terminate()
        process.wait(60)


def test_other_version__of_all_workers_ends_the_sweep_and_of_some_leaves_them_out(study, tmp_path):
    cases, version = study(), program_version()
    with bare_cluster() as client, foreign_worker(client, tmp_path) as process:
        with pytest.raises(InputError) as caught:  # it joins when the sweep waits already
            run_cases(cases, tmp_path / "out", watch=Monitor(), client=client)
        ((foreign, _),) = client.nthreads().items()
        beginning = f"worker {foreign} has roughvisc 0.0.7, while this process has {version}: expected "
        assert str(caught.value).startswith(beginning)
        assert not list((tmp_path / "out").glob("*.failed.json"))

        client.cluster.scale(1)
        client.wait_for_workers(2, timeout=60)
        assert has_other_versions(client)
        outcomes = run_cases(cases, tmp_path / "out", watch=(ear := Ear()), client=client)
        assert [one.kind for one in outcomes.values()] == ["done"] * 4
        (message,) = ear.messages
        assert message.startswith(f"worker {foreign} has roughvisc 0.0.7, while this process has {version}: no ")
        assert process.poll() is None, "it was sent nothing that it cannot load"


def test_other_version__cases_of_lost_workers_go_to_those_that_match(study, tmp_path, monkeypatch):
    """A worker leaves while its cases wait for it alone, and another one comes."""
    monkeypatch.setattr(dispatch, "_LOOK_EVERY", 0.1)
    submit, cases = dispatch._Dispatch.submit, study()[:2]

    def nowhere_at_first(self, key, workers=None):
        lost = self.courses[key].submissions == 0
        self.refused |= {"tcp://10.0.0.9:1": "0.0.7"}
        submit(self, key, ["tcp://10.0.0.8:1"] if lost else workers)

    monkeypatch.setattr(dispatch._Dispatch, "submit", nowhere_at_first)
    with bare_cluster() as client:
        client.cluster.scale(1)
        outcomes = run_cases(cases, tmp_path / "out", watch=Ear(), client=client)
        assert [one.kind for one in outcomes.values()] == ["done"] * 2
        assert not has_other_versions(client)


# ----------------------------------------------------------------------------------------------------------------
# the client that the user has made the default


def test_default_client__computes_cases_and_sweeps(study, tmp_path, monkeypatch):
    cases, reached, submitted = study(), [], []
    submit = dispatch._Dispatch.submit

    def noted(self, key, workers=None):
        submitted.append(key)
        submit(self, key, workers)

    monkeypatch.setattr(dispatch._Dispatch, "submit", noted)
    first, second, third, fourth = (case.key for case in cases)
    rv.run(cases[0], tmp_path / "here", progress=False)
    with (
        LocalCluster(n_workers=1, processes=False, dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster) as client,
    ):
        ds = rv.run(cases[0], tmp_path / "one", progress=lambda now, end: reached.append(end))
        rv.sweep(cases[:2], tmp_path / "several", progress=False)
        within = client.submit(rv.run, cases[2], tmp_path / "task", progress=False, pure=False).result()
        rv.sweep(cases[3:], tmp_path / "several", workers=0, progress=False)
        with pytest.raises(EdgeContactError, match="boundary"):
            rv.run(vary(cases[0], {"program.0.load": 50.0}), tmp_path / "one", progress=False)
    assert submitted[:-1] == [first, first, second], "but neither within a task nor with workers of its own"
    assert within.attrs["case_key"] == third
    assert (tmp_path / "several" / f"{fourth}.nc").exists()
    assert ds.encoding["source"] == str(tmp_path / "one" / f"{first}.nc")
    assert_same(numbers(tmp_path / "one"), numbers(tmp_path / "here"))
    assert all(end == pytest.approx(0.2) for end in reached)


# ----------------------------------------------------------------------------------------------------------------
# workers that are lost


@pytest.mark.long
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
    xr.testing.assert_equal(ds.drop_vars("wall_time").load(), wanted.drop_vars("wall_time").load())


@pytest.mark.thorough
def test_sweep__gives_up_for_now_a_case_whose_workers_die(study, tmp_path, by_hand):
    cases = study(LONG + LOADS)[:2]
    with connect(file=by_hand) as client:
        killed = kill_working(client, times=2)
        with pytest.raises(RoughviscError, match=r"none of 1 cases .* was lost 2 times.* repeat the command to resume"):
            sweep(cases[:1], tmp_path / "out", client, progress=False)
        killed.join()
        client.wait_for_workers(2, timeout=60)
    assert not record_path(tmp_path / "out", cases[0].key).exists(), "it is not the case that failed"


def kill_working(client, times):
    """A thread that kills so many workers in the midst of a case."""

    def kill():
        until = time.monotonic() + 60
        while len(killer.victims) < times and time.monotonic() < until:
            busy = [worker for worker, keys in client.processing().items() if keys]
            for worker in busy[:1]:
                begun = "__import__('roughvisc.study.execution.task') and __import__('os').getpid()"
                pid = client.run(eval, begun, workers=[worker], on_error="ignore").get(worker)
                time.sleep(0.3)
                if pid and pid not in killer.victims and client.processing().get(worker):
                    os.kill(pid, signal.SIGKILL)
                    killer.victims.append(pid)
            time.sleep(0.1)

    killer = threading.Thread(target=kill, daemon=True)
    killer.victims = []
    killer.start()
    return killer


def killed_worker():
    worker = SimpleNamespace(address="tcp://10.0.0.7:4000")
    return KilledWorker("task", worker, 3)


def course(*reports, submissions=1):
    made = dispatch._CaseStatus(submissions=submissions)
    for now, end in reports:
        made.heard({"key": "k", "worker": "tcp://10.0.0.7:4000", "now": now, "end": end})
    return made


@pytest.mark.parametrize(
    ("reports", "kind"),
    [
        ([], "interrupted"),  # it merely queued there
        ([(0, 0)], "interrupted"),
        ([(0, 0), (0, 0)], "hindered"),
        ([(0, 0), (0.5, 2.0), (0, 0), (0.5, 2.0)], "hindered"),
        ([(0, 0), (0.5, 2.0), (0, 0), (0.6, 2.0)], "interrupted"),  # it came further each time
        ([(0, 0), (0.5, 2.0), (0, 0), (0.6, 2.0), (0, 0)], "hindered"),
    ],
)
def test_lost_workers__condemn_no_innocent_case(reports, kind):
    """A case is tried again unless it was itself at work when its workers were lost, twice, and came no further."""
    assert dispatch._outcome("k", killed_worker(), course(*reports)).kind == kind


def test_lost_workers__whatever_is_known_a_case_is_not_submitted_for_ever():
    found = dispatch._outcome("k", killed_worker(), course(submissions=dispatch._SUBMISSIONS))
    assert found.kind == "hindered"
    assert "10.0.0.7" in found.message


def test_lost_workers__may_still_hold_the_lock_of_their_case():
    refused = Outcome("k", "hindered", "at work", InUseError.__name__)
    assert dispatch._outcome("k", refused, course((0, 0))) is refused, "another run is at work"
    assert dispatch._outcome("k", refused, course((0, 0), (0, 0))).kind == "interrupted"


@pytest.mark.timeout(60)  # Ctrl-C waits for nobody where there is nobody
@pytest.mark.parametrize("interruption", [KeyboardInterrupt, SystemExit])
def test_no_workers__is_told_and_interrupted_at_once(study, tmp_path, monkeypatch, interruption):
    monkeypatch.setattr(dispatch, "_ALONE_AFTER", 0.3)
    monkeypatch.setattr(dispatch, "_LOOK_EVERY", 0.1)

    class CtrlC(Ear):
        def tick(self):
            if self.messages and not self.pressed:
                self.pressed = True
                raise interruption

        def stopping(self):
            self.stopped = True

        pressed = stopped = False

    ear = CtrlC()
    with bare_cluster() as client, pytest.raises(interruption):
        run_cases(study(), tmp_path / "out", watch=ear, client=client)
    assert ear.stopped
    (message,) = ear.messages
    assert message.startswith("the cluster has had no worker for 0 s (4 cases to go): start workers")
    assert "the cluster has had no worker" in (logged := (tmp_path / "out" / "sweep.log").read_text())
    assert "interrupted after 0 of 4 cases" in logged
    assert not list((tmp_path / "out").glob("*.failed.json"))


def test_message__is_seen_whoever_watches(capsys):
    Monitor().message("no worker")
    LiveMonitor(None).message("no worker")
    assert capsys.readouterr().err == "roughvisc: no worker\nno worker\n"


@pytest.mark.thorough
def test_worker_told_to_leave__writes_its_checkpoint_first(study, tmp_path):
    """SIGTERM reaches every process of a job; another worker goes on from where the case was then."""
    (case,) = study(LONG.replace('hold = "0.2 s"', 'hold = "0.1 s"').replace(', "200 ms"', ""))
    ear, outcomes = Ear(), {}
    with bare_cluster() as client:

        def work():
            outcomes.update(run_cases([case], tmp_path / "out", watch=ear, client=client))

        thread = threading.Thread(target=work)
        with worker_process(client) as first:
            thread.start()
            ear.wait_until(lambda heard: any(now > 0 for _, now, _ in heard))
            os.killpg(first.pid, signal.SIGTERM)
            first.wait(60)
        left_at = max(now for _, now, _ in ear.heard)
        assert list((tmp_path / "out" / f".{case.key}.unfinished").glob("checkpoint.*")), "long before one was due"
        with worker_process(client):
            thread.join(60)
    assert [o.kind for o in outcomes.values()] == ["done"]
    second = [end for _, _, end in ear.heard].index(0.0, 1)
    assert ear.heard[second + 1][1] > left_at, "it did not begin anew"
    run_cases([case], tmp_path / "calm", watch=Monitor(), workers=0)
    assert_same(numbers(tmp_path / "out"), numbers(tmp_path / "calm"))
