"""A cluster that was started by hand."""

import os
import subprocess
import sys
import time

import pytest

from roughvisc.cli.studies import connect


@pytest.fixture(scope="session")
def by_hand(tmp_path_factory):
    """Scheduler and two workers, each started by hand as a process of its own; gives the scheduler's file."""
    folder = tmp_path_factory.mktemp("cluster")
    file = folder / "scheduler.json"
    environment = os.environ | {
        "DASK_DISTRIBUTED__SCHEDULER__WORKER_SATURATION": "1.0",
        "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1",
    }
    dask = [sys.executable, "-m", "dask"]
    commands = [
        [*dask, "scheduler", "--scheduler-file", file, "--host", "127.0.0.1", "--port", "0", "--no-dashboard"],
        *[[*dask, "worker", "--scheduler-file", file, "--nthreads", "1", "--no-dashboard"]] * 2,
    ]
    log = (folder / "log").open("w")
    started = [
        subprocess.Popen(command, cwd=folder, env=environment, stdout=log, stderr=log, start_new_session=True)
        for command in commands
    ]
    until = time.monotonic() + 60
    while not file.exists() and time.monotonic() < until:
        time.sleep(0.05)
    with connect(file=file) as client:
        client.wait_for_workers(2, timeout=60)
    yield file
    for process in reversed(started):
        process.terminate()
    for process in started:
        process.wait(30)
    log.close()
