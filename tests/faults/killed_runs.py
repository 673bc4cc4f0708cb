"""Runs that are killed at any time, once or twice, and given again: each ends with the same bits, and nothing else."""

import os
import shutil
import signal
import subprocess
import sys
import time
import traceback
from pathlib import Path

import xarray as xr
from damage import Hang, within
from dying import strike
from outcome import Outcome
from support import BALL

import roughvisc as rv
from roughvisc.cli import main as command
from roughvisc.errors import InputError
from roughvisc.study.execution.monitor import Monitor
from roughvisc.study.execution.run import run_case
from roughvisc.study.execution.sweep import run_cases
from roughvisc.study.statement.case import read_cases
from roughvisc.study.storage.store import result_files, whole_result
from roughvisc.study.storage.upkeep import clean_folder, verify

_ONE = BALL.replace("[24, 21]", "[12, 9]")
_TWO = _ONE + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'
#: Seconds that a run may take in all, and that one may wait until what another left behind lets go of its files.
_PATIENCE, _LINGERING = 60.0, 60.0
#: How a run is started, and how often of twenty: in a fork, by its function, struck at a file operation or at a time;
#: in a fork, by the command; as the command in processes of its own, with two workers.
_WAYS = ("operation",) * 6 + ("function",) * 5 + ("command",) * 6 + ("workers",) * 3
#: File operations of a run of the one case, of those that Python tells of.
_OPERATIONS = range(1, 144)
_SIGNALS = (signal.SIGKILL, signal.SIGKILL, signal.SIGKILL, signal.SIGTERM)


def prepare(folder):
    """Studies of one case and of two; what runs of them give that nobody interrupts, and how long they take."""
    studies = {}
    for name, text in (("one", _ONE), ("two", _TWO)):
        path = folder / f"{name}.toml"
        path.write_text(text)
        cases = read_cases(path)
        began = time.monotonic()
        if name == "one":
            run_case(cases[0], folder / name, checkpoint_steps=3)
        else:
            run_cases(cases, folder / name, watch=Monitor(), workers=0)
        studies[name] = path, cases, _values(folder / name), time.monotonic() - began
    began = time.monotonic()
    _wait(
        _forked(lambda: command(_arguments(studies["two"][0], folder / "three"), standalone_mode=True), folder / "log")
    )
    studies["two"] = (*studies["two"][:3], time.monotonic() - began)
    return studies


def _values(folder):
    """Every variable but the wall time of all that counts as a result in a folder."""
    found = {}
    for path in result_files(folder):
        with whole_result(path) as ds:
            found[path.name] = ds.drop_vars("wall_time").load()
    return found


def _arguments(path, out, *more):
    return ["run", str(path), "--out", str(out), "-q", "--no-plots", *(more or ("--workers", "0"))]


def examine(studies, folder, number, rng):
    way = str(rng.choice(_WAYS))
    path, cases, wanted, lasts = studies["one" if way in ("operation", "function") else "two"]
    out, log = folder / f"out{number}", folder / f"log{number}"
    kills = []
    outcome = Outcome(number, way, "")
    try:
        for _ in range(1 + (rng.random() < 0.3)):  # what goes on after a kill may be killed, too
            kills.append(_killed(way, path, cases, out, log, lasts, rng))
            _check(out, wanted, whole=False)
        _finished(way, path, cases, out, log)
        _check(out, wanted, whole=True)
        said = log.read_text(errors="replace") if log.exists() else ""
        if "Traceback" in said:
            outcome.failed(f"a traceback: {said[-1500:]}")
    except (Hang, subprocess.TimeoutExpired) as error:
        outcome.failed(f"a hang: {error}")
    except BaseException as error:  # noqa: BLE001  (whatever it is, it is a fault)
        outcome.failed(f"{type(error).__name__}: {error} {''.join(traceback.format_tb(error.__traceback__)[-2:])}")
    outcome.change = "; ".join(kills)
    shutil.rmtree(out, ignore_errors=True)
    log.unlink(missing_ok=True)
    return outcome


def _killed(way, path, cases, out, log, lasts, rng):
    """Start a run, and kill it; how, in words."""
    if way == "operation":
        at = int(rng.choice(_OPERATIONS))
        status = _wait(_forked(lambda: strike(cases[0], out, at, "kill"), log))
        return f"SIGKILL at file operation {at}{_ended(status)}"
    sent = _SIGNALS[rng.integers(len(_SIGNALS))] if way != "function" else signal.SIGKILL
    after = float(rng.uniform(0, 1.05 * lasts))
    if way == "workers":
        after = float(rng.uniform(1.0, 7.0))  # modules are imported, processes start, cases run, results are written
        whole_group = bool(rng.random() < 0.5)
        with log.open("ab") as stream:
            process = subprocess.Popen(_command(path, out), stdout=stream, stderr=stream, start_new_session=True)
        try:
            process.wait(after)
        except subprocess.TimeoutExpired:
            (os.killpg if whole_group else os.kill)(process.pid, sent)
        status = process.wait(_PATIENCE)
        return f"{sent.name} to {'all processes' if whole_group else 'the first'} after {after:.3f} s{_ended(status)}"
    if way == "function":
        pid = _forked(lambda: run_case(cases[0], out, checkpoint_steps=3), log)
    else:
        pid = _forked(lambda: command(_arguments(path, out), standalone_mode=True), log)
    time.sleep(after)
    os.kill(pid, sent)
    return f"{sent.name} after {after:.3f} s{_ended(_wait(pid))}"


def _ended(status):
    return {0: ", which had finished"}.get(status, "") if status >= 0 or status == -signal.SIGKILL else f" ({status})"


def _command(path, out):
    return [sys.executable, "-m", "roughvisc", *_arguments(path, out, "--workers", "2")]


def _forked(act, log):
    """Process that does something and writes what it says to a file."""
    if pid := os.fork():
        return pid
    status = 70
    try:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        descriptor = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
        os.dup2(descriptor, 1)
        os.dup2(descriptor, 2)
        act()
        status = 0
    except SystemExit as end:
        status = end.code or 0
    except BaseException:  # noqa: BLE001  (told of in the file)
        os.write(2, traceback.format_exc().encode())
    os._exit(status if isinstance(status, int) else 71)


def _wait(pid):
    """How a process ended; one that does not is ended, and is a hang."""
    give_up = time.monotonic() + _PATIENCE
    while time.monotonic() < give_up:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.002)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    raise Hang(f"a process did not end within {_PATIENCE} s")


def _finished(way, path, cases, out, log):
    """The same again, to its end."""
    if way in ("operation", "function"):
        with within(_PATIENCE):
            run_case(cases[0], out, checkpoint_steps=3)
    elif way == "command":
        status = _wait(_forked(lambda: command(_arguments(path, out), standalone_mode=True), log))
        assert status == 0, f"exit status {status}: {log.read_text()[-500:]}"
    else:
        give_up = time.monotonic() + _LINGERING
        while True:  # workers whose first process was killed may hold a case for a while, which is refused by name
            with log.open("ab") as stream:
                done = subprocess.run(_command(path, out), stdout=stream, stderr=stream, timeout=_PATIENCE)
            if done.returncode == 0:
                break
            said = log.read_text()[-500:]
            assert time.monotonic() < give_up, f"exit status {done.returncode}: {said}"
            time.sleep(1.0)


def _check(out, wanted, whole):
    """What counts as a result is one, and has the bits of a run that nobody interrupted."""
    if not out.exists():
        assert not whole
        return
    found = _values(out)
    unsealed = [one.path.name for one in verify(out) if not one.sealed] if found else []
    assert not unsealed, f"{unsealed} count as results and have no checksum"
    assert set(found) <= set(wanted), f"{sorted(found)} count as results"
    assert not whole or set(found) == set(wanted), f"only {sorted(found)} are there"
    for name, ds in found.items():
        xr.testing.assert_equal(ds, wanted[name])
    try:
        served = rv.open_results(out, cases="all")
    except InputError:
        assert not found
    else:
        assert sorted(f"{key}.nc" for key in served["case_key"].values) == sorted(found)
    if whole:
        clean_folder(out)
        left = [one.name for one in Path(out).iterdir() if one.suffix == ".part" or ".unfinished" in one.name]
        assert not left, f"{left} are left behind"
