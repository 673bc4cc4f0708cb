"""What a sweep costs beside its computing: 200 cases of 64 x 64 cells on all cores.

python workflows/benchmarks/sweep_overhead.py [cases]
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

from dask.system import CPU_COUNT

from roughvisc.study.case import Case, vary
from roughvisc.study.run import compute
from roughvisc.study.sweep import run_cases
from roughvisc.study.watch import Silence

STUDY = """{"title": "overhead", "surface": {"generate": "self_affine", "size": [1e-3, 1e-3], "shape": [64, 64],
"hurst": 0.8, "rms_slope": 0.1, "rolloff": 5e-4, "shortcut": 5e-5, "seed": 1},
"material": {"model": "zener", "shear_modulus": 3e6, "kelvin_modulus": 1e6, "kelvin_viscosity": 1e5},
"program": [{"load": 0.02, "over": 0.05}, {"hold": 0.5}],
"solve": {"boundary": "periodic", "tolerance": 2e-4}, "keep": {"fields": ["pressure", "gap"], "times": 20}}"""


def main(count: int = 200, workers: int = CPU_COUNT, alone: int = 20) -> dict[str, float]:
    """Figures of a sweep over so many surfaces.

    Returns
    -------
    dict
        ``wall`` of the sweep [s]; ``bare`` and ``case``, processor time of a case that is only computed (mean of
        ``alone``) and of one in the sweep [s]; ``busy``, the part of the processes' time that is spent on cases; and
        ``overhead``, the processor time that starting, scheduling and storing add. Other programs spoil ``wall``.
    """
    base = Case.from_json(STUDY)
    cases = [vary(base, {"surface.seed": seed}) for seed in range(count)]
    compute(cases[0], progress=False)  # warm
    began = time.process_time()
    for case in cases[:alone]:
        compute(case, progress=False)
    bare = (time.process_time() - began) / min(alone, count)
    with tempfile.TemporaryDirectory() as folder:
        began, used = time.perf_counter(), processor_time()
        outcomes = run_cases(cases, Path(folder), watch=Silence(), workers=workers)
        wall, used = time.perf_counter() - began, processor_time() - used
    assert all(outcome.entry for outcome in outcomes.values())
    busy = sum(outcome.seconds for outcome in outcomes.values()) / wall / workers
    return {"wall": wall, "bare": bare, "case": used / count, "busy": busy, "overhead": used / (bare * count) - 1}


def processor_time() -> float:
    """Of this process and of those that it has ended. [s]"""
    found = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in found)


if __name__ == "__main__":
    for name, value in main(*map(int, sys.argv[1:2])).items():
        print(f"{name:10} {value:.3g}")
