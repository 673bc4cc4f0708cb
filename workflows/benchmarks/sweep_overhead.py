"""What a sweep costs beside its computing, and what keeping every step costs: processor time.

200 cases of 64 x 64 cells on all cores, against plain processes that only compute; and cases of 512 x 512 cells of
which every step is kept, against the same that are not stored.
"""

import multiprocessing
import tempfile
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
from dask.system import CPU_COUNT

from roughvisc import solve as driver
from roughvisc.study.execution import run
from roughvisc.study.execution.monitor import Monitor
from roughvisc.study.execution.sweep import run_cases
from roughvisc.study.statement.case import Case, vary
from roughvisc.study.storage import checkpoint

STUDY = """{"title": "overhead", "surface": {"generate": "self_affine", "size": [1e-3, 1e-3], "shape": [64, 64],
"hurst": 0.8, "rms_slope": 0.1, "rolloff": 5e-4, "shortcut": 5e-5, "seed": 1},
"material": {"model": "zener", "shear_modulus": 3e6, "kelvin_modulus": 1e6, "kelvin_viscosity": 1e5},
"program": [{"load": 0.02, "over": 0.05}, {"hold": 0.5}, {"load": 0.0, "over": 0.05}],
"solve": {"boundary": "periodic", "tolerance": 2e-4}, "keep": {"fields": ["pressure", "gap"], "times": 20}}"""


def measure(count=200, workers=CPU_COUNT, cells=512, swept=("periodic", "free")):
    for boundary in swept:
        yield sweep(count, workers, boundary)
    for boundary in ("periodic", "free"):
        yield storing(cells, boundary)


def sweep(count, workers, boundary):
    """Processor time that starting, scheduling and storing add, and how busy the processes are kept.

    The bare time is of the same cases on as many processes at once, since neighbours slow each other down.
    """
    base = vary(Case.from_json(STUDY), {"solve.boundary": boundary, "solve.edge": "accept"})
    cases = [vary(base, {"surface.seed": seed}) for seed in range(count)]
    texts = [case.to_json() for case in cases]
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        bare = sum(pool.map(computing, [texts[first::workers] for first in range(workers)]))
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        with processor_time() as spent:
            outcomes = run_cases(cases, Path(folder), watch=Monitor(), workers=workers)
        wall, used = time.perf_counter() - began, sum(spent.values())
    assert all(outcome.entry for outcome in outcomes.values())
    return {
        "case": f"sweep of {count} {boundary} cases of 64^2 on {workers} processes",
        "seconds": wall,
        "processor_per_case": used / count,
        "overhead": used / bare - 1,
        "busy": sum(outcome.seconds for outcome in outcomes.values()) / wall / workers,
    }


def computing(texts):
    """Processor time that cases take that are only computed. [s]"""
    cases = [Case.from_json(text) for text in texts]
    run.compute(cases[0], progress=False)  # warm
    began = time.process_time()
    for case in cases:
        run.compute(case, progress=False)
    return time.process_time() - began


def storing(cells, boundary):
    """Part of a case's processor time that keeping every step takes: rows, checkpoints and the file."""
    base = Case.from_json(STUDY)
    solve = {"solve.boundary": boundary, "solve.edge": "accept", "solve.tolerance": 1e-3}
    case = vary(base, {"surface.shape": [cells, cells], "surface.shortcut": 5e-3 / cells, "keep.times": "all"} | solve)
    places = ((checkpoint.RowFile, "append"), (run, "keep"), (run.CheckpointWriter, "save"), (driver, "dataset_of"))
    inside, found = [], {place: getattr(*place) for place in places}

    def timed(function):
        def call(*given, **named):
            began = time.process_time()
            result = function(*given, **named)
            inside.append(time.process_time() - began)
            return result

        return call

    for (owner, name), function in found.items():
        setattr(owner, name, timed(function))
    try:
        with tempfile.TemporaryDirectory() as folder:
            began = time.process_time()
            run.run_case(case, Path(folder))
            whole = time.process_time() - began
    finally:
        for (owner, name), function in found.items():
            setattr(owner, name, function)
    return {
        "case": f"every step kept, {boundary}, {cells}^2",
        "processor_per_case": whole,
        "storing": sum(inside) / whole,
    }


@contextmanager
def processor_time():
    """Yields a dictionary: processor time of this process and of each that it starts, and those start. [s]

    They are looked at ten times a second, since a process that another one has ended is accounted for nowhere; the
    time that looking takes is left out.
    """
    this, spent, ended, looking = psutil.Process(), {}, threading.Event(), []
    before = sum(this.cpu_times()[:2])

    def look():
        while not ended.wait(0.1):
            for process in this.children(recursive=True):
                with suppress(psutil.NoSuchProcess):
                    spent[process.pid] = sum(process.cpu_times()[:2])
        looking.append(time.thread_time())

    watcher = threading.Thread(target=look)
    watcher.start()
    try:
        yield spent
    finally:
        ended.set()
        watcher.join()
        spent[this.pid] = sum(this.cpu_times()[:2]) - before - looking[0]
