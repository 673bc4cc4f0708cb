"""Runs a case over and over, each time with little memory left that may be allocated; a script of its own.

Arguments: the study, the folder of the results, how many runs, the seed by which the bytes left are drawn. Writes one
line a run: the bytes, and how the run ended. Needs Linux, whose limit is one of the addresses of a process.
"""

import os
import random
import resource
import sys
import traceback
from pathlib import Path

from roughvisc.errors import RoughviscError
from roughvisc.study.execution.run import run_case
from roughvisc.study.statement.case import read_study, vary


def starve(left):
    """Let this process allocate so many bytes more."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + left
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.getrlimit(resource.RLIMIT_AS)[1]))


def attempted(case, folder, left):
    """How a run of the case ends in a process of its own."""
    reading, writing = os.pipe()
    if not (pid := os.fork()):
        try:
            starve(left)
            run_case(case, folder, checkpoint_steps=3)
            said = "finished"
        except (RoughviscError, OSError, MemoryError) as error:
            said = f"{type(error).__name__} {error}"
        except BaseException:  # noqa: BLE001  (whatever it is, the parent is told of it)
            said = f"TRACEBACK {traceback.format_exc()}"
        resource.setrlimit(resource.RLIMIT_AS, (resource.getrlimit(resource.RLIMIT_AS)[1],) * 2)
        os.write(writing, said.replace("\n", " | ").encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        said = pipe.read()
    _, status = os.waitpid(pid, 0)
    return said or f"killed by signal {os.waitstatus_to_exitcode(status)}"


def main(study, out, count, seed):
    """Each run in a folder of its own, ``OUT/NUMBER``, after a small one that imports what a run needs."""
    case, drawn = read_study(study), random.Random(int(seed))
    run_case(vary(case, {"surface.shape": [8, 6]}), Path(out, "small"))
    for number in range(int(count)):  # each decade has its share
        left = int(10 ** (5.0 + 2.0 * (number + drawn.random()) / int(count)))
        print(left, attempted(case, Path(out, str(number)), left), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
