"""What a plan says against what a run takes: convolutions, wall time, memory, disk.

    python workflows/benchmarks/plans.py [KIND ...] [--cells N ...]

Plan and run are processes of their own, one after the other, with one thread; a small case runs before the one that is
timed, for the imports. Printed are ratios, plan over run.
"""

import argparse
import json
import multiprocessing
import os
import resource
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

ROUGH = {"generate": "self_affine", "size": [1e-3, 1e-3], "hurst": 0.8, "rms_slope": 0.1, "rolloff": 2.5e-4, "seed": 1}
ZENER = {"model": "zener", "shear_modulus": 3e6, "kelvin_modulus": 1e6, "kelvin_viscosity": 1e5}
THREE = {"model": "prony", "glassy": 3e-7, "compliances": [1e-7, 2e-7, 1e-7], "times": [0.01, 0.05, 0.3]}
HOLD = [{"pressure": 2e4, "over": 0.01}, {"hold": 0.5}]
CYCLE = [{"pressure": 2e4, "over": 0.05}, {"hold": 0.1}, {"pressure": 0.0, "over": 0.05}]
BALL = {"generate": "sphere", "radius": 1e-3, "size": 1e-4}
GROWING = [{"load": 5e-3, "over": 0.1}, {"hold": 1.0}]
DEEPER = [{"approach": 5e-6, "over": 0.1}, {"hold": 0.5}]
SPEEDS = {"pressure": 2e4, "speeds": [1e-4, 1e-3, 1e-2, 1e-1]}
PERIODIC, FREE = {"boundary": "periodic"}, {"boundary": "free", "edge": "accept"}

#: Surface, material, program, [solve], and numbers of cells, of each kind.
KINDS = {
    "elastic": (ROUGH, {"model": "elastic", "shear_modulus": 3e6}, HOLD[:1], PERIODIC, (64, 256, 1024, 4096, 8192)),
    "creep": (ROUGH, ZENER, HOLD, PERIODIC, (64, 128, 256, 512, 1024, 2048, 4096)),
    "creep, three exponentials": (ROUGH, THREE, HOLD, PERIODIC, (64, 256, 1024)),
    "creep in free space": (ROUGH, ZENER, HOLD, FREE, (64, 256, 1024)),
    "cycle": (ROUGH, ZENER, CYCLE, PERIODIC, (64, 256, 1024)),
    "growing ball": (BALL, ZENER, GROWING, {}, (65, 129, 257, 513)),
    "ball under approach": (BALL | {"size": 3e-4}, ZENER, DEEPER, {}, (65, 257, 1025)),
    "friction": (ROUGH, ZENER, SPEEDS, {}, (64, 256, 1024)),
}


def case_of(kind, cells):
    """The case of a kind on so many cells a side."""
    from roughvisc.study.statement.case import Case

    surface, material, program, solve, _ = KINDS[kind]
    if surface is ROUGH:
        surface = surface | {"shortcut": max(1.6e-5, 8e-3 / cells)}
    stated = {
        "title": kind,
        "surface": surface | {"shape": [cells, cells]},
        "material": material,
        "solve": {"tolerance": 1e-3} | solve,
        "keep": {"fields": ["pressure", "gap"]},
    }
    if kind == "friction":
        return Case.from_json(json.dumps(stated | {"friction": program}))
    stated["keep"]["times"] = 20
    return Case.from_json(json.dumps(stated | {"program": program}))


def planned(kind, cells):
    """What the plan says, and how long that takes."""
    import roughvisc as rv

    case, began = case_of(kind, cells), time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        row = rv.plan([case], folder).isel(case=0)
    found = {name: float(row[name]) for name in ("convolutions", "wall_time", "memory", "disk")}
    return found | {"seconds": time.perf_counter() - began}


def taken(kind, cells):
    """What the run takes."""
    from roughvisc.study.execution.run import run_case
    from roughvisc.study.storage.store import open_result

    with tempfile.TemporaryDirectory() as folder:
        run_case(case_of(kind, 40), folder)  # imports
        case, began = case_of(kind, cells), time.perf_counter()
        path = run_case(case, folder)
        wall = time.perf_counter() - began
        with open_result(path) as ds:
            convolutions = float(ds.convolutions.sum())
        size = Path(path).stat().st_size
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return {"convolutions": convolutions, "wall_time": wall, "memory": memory, "disk": size}


def in_process(work, kind, cells):
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(work, kind, cells).result()


def main(kinds, cells):
    """Print a row for each kind and number of cells."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = "1"
    names = ("convolutions", "wall_time", "memory", "disk")
    print(f"{'':36}{''.join(f'{name:>14}' for name in names)}   run")
    for kind in kinds or KINDS:
        for count in cells or KINDS[kind][-1]:
            said, found = in_process(planned, kind, count), in_process(taken, kind, count)
            ratios = "".join(f"{said[name] / found[name]:14.2f}" for name in names)
            run = f"{found['wall_time']:.2f} s, {found['memory'] / 1e9:.2f} GB (plan in {said['seconds']:.1f} s)"
            print(f"{kind + f', {count}²':36}{ratios}   {run}", flush=True)


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    asked.add_argument("--cells", nargs="+", type=int)
    given = asked.parse_args()
    main(given.kinds, given.cells)
