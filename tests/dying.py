"""Runs a case over and over, each time until something happens at one of its file operations; a script of its own.

Arguments: the study, the folder of the results, how many operations to take (all: each), the seed by which they are
drawn, and what happens there, one or more of: kill, the name of an error number, MemoryError. Writes one line a run:
what happened, at which operation, and how the run ended.
"""

import errno
import math
import os
import random
import signal
import sys
import traceback
from pathlib import Path

from roughvisc.errors import RoughviscError
from roughvisc.study.case import read_study
from roughvisc.study.execution.run import run_case
from roughvisc.study.storage import checkpoint

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


def main(study, out, most, seed, *ways):
    """Each run in a folder of its own, ``OUT/WAY/NUMBER``."""
    case = read_study(study)
    total = int(attempted(case, Path(out, "count"), -1, "").removeprefix("finished "))
    drawn = random.Random(int(seed))
    for way in ways:
        numbers = range(1, total + 1) if most == "all" else sorted(drawn.sample(range(1, total + 1), int(most)))
        for at in numbers:
            print(way, at, attempted(case, Path(out, way, str(at)), at, way), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
