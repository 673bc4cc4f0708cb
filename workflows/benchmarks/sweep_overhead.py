"""Measure what a sweep costs besides its solves: python sweep_overhead.py [CASES] [CASES_OF_A_WINDOW].

Prints the overhead of a case in this process, the start of a cluster (`_START` of `roughvisc.runs.sweep`), and sweeps
on one worker with windows of 50, 200 and 800 cases (`_WINDOW` of `roughvisc.runs.cluster`). Times are processor times
of all processes of the sweep, unless stated otherwise.
"""

import os
import resource
import sys
import tempfile
import time

import roughvisc as rv
from roughvisc.runs import cluster
from roughvisc.runs import sweep as sweeps
from roughvisc.runs.cluster import local_client

WINDOWS = (50, 200, 800)


def spent():
    """Processor time of this process and of its finished child processes. [s]"""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in both)


def cases(count, shift=0.0):
    """Elastic cases of 32 x 32 cells with one row, which differ in their modulus."""
    base = rv.Case(
        rv.self_affine(1e-3, 32, hurst=0.8, rms_slope=0.1, seed=1),
        rv.elastic(1e6, 0.5),
        rv.Program().load(0.01, over=0),
        boundary="periodic",
        grid_error=False,
    )
    return rv.vary(base, {"material": [rv.elastic(1e6 + shift + i, 0.5) for i in range(count)]})


def swept(many, workers):
    """Sweep into a new folder; return processor time, wall time, and wall time of the first result. [s]"""
    first = []
    original = sweeps.Display.ended

    def ended(display, outcome):
        first.append(time.monotonic())
        original(display, outcome)

    sweeps.Display.ended = ended
    began = time.monotonic()
    before = spent()
    try:
        with tempfile.TemporaryDirectory() as folder:
            rv.sweep(many, folder, workers=workers, progress=False)
    finally:
        sweeps.Display.ended = original
    return spent() - before, time.monotonic() - began, first[0] - began


def overhead(count):
    """Print the time of a case in a sweep of this process, and in a loop of `simulate`."""
    many = cases(count)
    swept(many[:3], 0)
    height = many[0].height()
    before = spent()
    for case in many:
        rv.simulate(height, case.body, case.experiment.program, boundary="periodic", grid_error=False, progress=False)
    loop = spent() - before
    before = spent()
    keys = {case.key for case in many}
    named = spent() - before
    whole, _, _ = swept(many, 0)
    print(f"| {len(keys)} cases | loop of simulate | sweep in this process | overhead, keys included |")
    print("|---|---|---|---|")
    each = [1e3 * seconds / count for seconds in (loop, whole + named, whole + named - loop)]
    print("| ms a case | " + " | ".join(f"{number:.1f}" for number in each) + " |\n")


def start():
    """Print the time until a worker of a new cluster has computed something."""
    print("| start of a cluster of one worker | wall [s] | processor [s] |")
    print("|---|---|---|")
    for name in ("first", "second"):
        began = time.monotonic()
        before = spent()
        with local_client(1) as client:
            client.submit(os.getpid).result()
            wall = time.monotonic() - began
        print(f"| {name} | {wall:.1f} | {spent() - before:.1f} |")
    print()


def windows(count):
    """Print the times of sweeps on one worker with several windows."""
    print(f"| window, {count} cases | processor, ms a case | first result, wall [s] | whole, wall [s] |")
    print("|---|---|---|---|")
    usual = cluster._WINDOW
    for number, window in enumerate(WINDOWS):
        cluster._WINDOW = window
        processor, wall, first = swept(cases(count, 1e5 * (number + 1)), 1)
        print(f"| {window} | {1e3 * processor / count:.1f} | {first:.1f} | {wall:.1f} |")
    cluster._WINDOW = usual


if __name__ == "__main__":
    overhead(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
    start()
    windows(int(sys.argv[2]) if len(sys.argv) > 2 else 1000)
