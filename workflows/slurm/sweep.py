"""A sweep whose workers are SLURM jobs; the same command resumes it.

Needs dask-jobqueue. On a cluster, run it on the login node in tmux, or as a job with a long walltime. Without a
cluster, one_node.sh starts SLURM on this machine::

    python workflows/slurm/sweep.py STUDY.toml /shared/results --queue normal --walltime 02:00:00 --jobs 40
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from pathlib import Path

from dask.distributed import Client
from dask_jobqueue import SLURMCluster

import roughvisc as rv


def cluster(queue: str, walltime: str, memory: str = "4GB", logs: str = "slurm-logs") -> SLURMCluster:
    """Return a cluster with one process per job; jobs end before their walltime."""
    hours, minutes, seconds = map(int, walltime.split(":"))
    allowed = 3600 * hours + 60 * minutes + seconds
    return SLURMCluster(
        queue=queue,
        cores=1,
        processes=1,
        memory=memory,
        walltime=walltime,
        log_directory=os.path.abspath(logs),
        scheduler_options={"dashboard_address": ":0"},  # whichever port is free
        # time for a step and a checkpoint, and not all jobs at the same time
        worker_extra_args=["--lifetime", f"{0.85 * allowed:.0f}s", "--lifetime-stagger", f"{0.1 * allowed:.0f}s"],
        # scancel and the walltime send SIGTERM to the job's shell too: it waits for the worker's checkpoint
        job_script_prologue=["trap : TERM"],
    )


def main(arguments: list[str] | None = None) -> None:
    """Compute all cases of a study."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path)
    parser.add_argument("out", type=Path, help="on a file system that all nodes share")
    parser.add_argument("--queue", default="normal")
    parser.add_argument("--walltime", default="02:00:00")
    parser.add_argument("--jobs", type=int, default=10, help="at most so many at a time")
    given = parser.parse_args(arguments)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # dask-jobqueue has Ctrl-C end with status 0
    with cluster(given.queue, given.walltime) as jobs, Client(jobs) as client:
        jobs.adapt(minimum=1, maximum=given.jobs)  # a job that left is replaced as long as cases wait
        try:
            results = rv.sweep(given.study, out=given.out, client=client)
        except KeyboardInterrupt:
            sys.exit("interrupted: what was computed is kept, and the same command goes on")
    print(f"{results.sizes['case']} cases in {given.out}")


if __name__ == "__main__":
    sys.exit(main())
