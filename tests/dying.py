"""Runs a case over and over, each time until something happens at one of its file operations.

Between two operations a kill leaves on the disk what it leaves at the second one.
"""

import errno
import math
import os
import random
import signal
import subprocess
import sys
import traceback
from pathlib import Path

from roughvisc.errors import RoughviscError
from roughvisc.runs import checkpoint
from roughvisc.runs.run import run_case
from roughvisc.study.case import read_study

#: What is asked of the system of a folder's files. Not listing it: what is not found is not there.
EVENTS = ("open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.truncate", "os.utime")


def strike(case, folder, at, what):
    """In this process: run the case until operation number ``at``; without one, give their number."""
    count = 0

    def hook(event, arguments):
        nonlocal count
        if event not in EVENTS or not str(arguments[0]).startswith(str(folder)):
            return
        count += 1
        if count != at:
            return
        if what == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        if what == "MemoryError":
            raise MemoryError
        raise OSError(getattr(errno, what), os.strerror(getattr(errno, what)), str(arguments[0]))

    sys.addaudithook(hook)
    checkpoint._SHARE = math.inf  # at every step, however long it takes to write
    run_case(case, folder, checkpoint_seconds=0)
    return count


def attempted(case, folder, at, what):
    """How a run of the case ends in a process of its own."""
    reading, writing = os.pipe()
    if not (pid := os.fork()):
        try:
            said = f"finished {strike(case, folder, at, what)}"
        except (RoughviscError, OSError, MemoryError) as error:
            said = f"{type(error).__name__} {error}"
        except BaseException:  # noqa: BLE001  (whatever it is, the parent is told of it)
            said = f"TRACEBACK {traceback.format_exc()}"
        os.write(writing, said.replace("\n", " | ").encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        said = pipe.read()
    os.waitpid(pid, 0)
    return said or "killed"


def struck(study, out, most, *ways):
    """What happened, at which operation, and how the run ended, for each run in a process that this one starts.

    Results are in ``OUT/WAY/NUMBER``. So many operations are drawn, or all of them. Something is a kill, the name of an
    error number, or a MemoryError.
    """
    command = [sys.executable, __file__, study, out, most, *ways]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=True)
    assert "Traceback" not in done.stderr
    return [line.split(" ", 2) for line in done.stdout.splitlines()]


def main(study, out, most, *ways):
    """Write one line for each run."""
    case = read_study(study)
    total = int(attempted(case, Path(out, "count"), -1, "").removeprefix("finished "))
    drawn = random.Random(20)
    for way in ways:
        numbers = range(1, total + 1) if most == "all" else sorted(drawn.sample(range(1, total + 1), int(most)))
        for at in numbers:
            print(way, at, attempted(case, Path(out, way, str(at)), at, way), flush=True)
            if way == "kill":  # and the run that goes on from there
                attempted(case, Path(out, way, str(at)), (at + 1) // 2, way)


if __name__ == "__main__":
    main(*sys.argv[1:])
