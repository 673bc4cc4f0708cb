"""Check and time a GPU: python workflows/benchmarks/gpu.py [--sizes 512 1024 2048 4096 8192] [--seconds 240]

First a run is killed three times and resumed, with the bits of a whole run expected, and a surface that is too large
for the memory left must be refused.

Then each scene runs on the GPU, and up to 1,024 squared also on one core of the CPU: the pressures of both are compared
(L1 norm, over the tolerance; expected: below a hundredth). ``solved_s`` is the time without warnings and copies of
fields; ``pairs`` is this time over that of as many bare pairs of transforms as there are convolutions. Sizes are left
out when the time is used up. Needs CuPy (``roughvisc[gpu]``).
"""

import argparse
import multiprocessing
import signal
import time
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import xarray as xr
from memory import case_of

import roughvisc as rv
from roughvisc.mechanics.grid import arrays_of, transforms
from roughvisc.runs.run import run_case
from roughvisc.study.case import vary

TOLERANCE = 1e-3
COMMON = {"tolerance": TOLERANCE, "fields": ("pressure",), "grid_error": False, "progress": False}
GPU, CPU = {"numerics": rv.Numerics(device="gpu")}, {"threads": 1}
RUBBER = rv.zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=1e5)
#: Cells a side up to which a scene also runs on the CPU.
COMPARED = 1024


def rough(cells):
    """A periodic rough surface whose shortest waves have eight cells."""
    shortest = 8e-3 / cells
    return rv.self_affine(1e-3, cells, hurst=0.8, rms_slope=0.1, rolloff=2.5e-4, shortcut=shortest, seed=1)


def creep(height, **device):
    program = rv.Program().pressure("20 kPa", over="10 ms").hold("500 ms")
    return rv.simulate(height, RUBBER, program, boundary="periodic", times=20, **COMMON, **device)


def elastic(height, **device):
    program = rv.Program().pressure("20 kPa", over=0)
    return rv.simulate(height, rv.elastic(3e6), program, boundary="periodic", **COMMON, **device)


def friction(height, **device):
    return rv.friction(height, RUBBER, pressure="20 kPa", speeds=["10 mm/s"], **COMMON, **device)


SCENES = {"creep": creep, "elastic": elastic, "friction": friction}


def run_and_save(device, folder):
    """Run a case with a checkpoint after each step."""
    case = vary(case_of(1100, "zener"), {"solve.device": device, "solve.tolerance": TOLERANCE})
    run_case(case, folder, checkpoint_seconds=0)


def resume(device="gpu", kills=3):
    """Kill a run after some steps, several times, and return the variables whose bits differ from those of a whole run.

    Raises
    ------
    RuntimeError
        If a run fails, or ends before it can be killed.
    """

    def started(out):
        out.mkdir(exist_ok=True)
        process = multiprocessing.get_context("spawn").Process(target=run_and_save, args=(device, out))
        process.start()
        return process

    def ended(process, status):
        process.join()
        if process.exitcode != status:
            raise RuntimeError(f"a run ended with status {process.exitcode}: expected {status}")

    with TemporaryDirectory() as folder:
        whole, killed = Path(folder, "whole"), Path(folder, "killed")
        ended(started(whole), 0)
        for _ in range(kills):
            process, saved = started(killed), set()
            while len(saved) < 3 and process.is_alive():
                saved |= {path.stat().st_mtime_ns for path in killed.glob("*/state.npz")}
            process.kill()
            ended(process, -signal.SIGKILL)
        ended(started(killed), 0)
        one, other = (xr.load_dataset(next(out.glob("*.nc"))) for out in (whole, killed))
        names = set(one.data_vars) - {"wall_time"}
        return sorted(name for name in names if one[name].values.tobytes() != other[name].values.tobytes())


def refusal(xp):
    """Return the message with which a surface is refused that does not fit in the memory left."""
    taken = xp.empty(int(xp.cuda.runtime.memGetInfo()[0] - 2**30), np.uint8)
    try:
        creep(rough(4096), **GPU)
    except rv.TooLargeError as error:
        return str(error)
    finally:
        del taken
        xp.get_default_memory_pool().free_all_blocks()
    raise RuntimeError("the surface was not refused")


def seconds(run):
    """Return the wall time of a call and its result."""
    began = time.perf_counter()
    found = run()
    return time.perf_counter() - began, found


def bare_pair(cells, xp):
    """Return the wall time of a pair of bare transforms in double precision. [s]"""
    both, field = transforms(1, xp), xp.asarray(np.random.default_rng(1).random((cells, cells)))

    def pairs(count):
        for _ in range(count):
            found = both.waves_back(both.waves(field), field.shape)
        float(found.sum())  # waits for the device

    pairs(2)
    return seconds(lambda: pairs(10))[0] / 10


def measure(sizes=(512, 1024, 2048, 4096, 8192), limit=240.0, scenes=tuple(SCENES)):
    """Yield a record for each scene and size, as long as the time lasts. [s]"""
    began, xp = time.perf_counter(), arrays_of("gpu")
    for scene in scenes:
        for cells in (64, 1024):
            SCENES[scene](rough(cells), **GPU)  # compiles the kernels
    for cells in sizes:
        height, pair = rough(cells), bare_pair(cells, xp)
        for scene in scenes:
            if time.perf_counter() - began > limit:
                return
            took, found = seconds(partial(SCENES[scene], height, **GPU))
            record = {"scene": scene, "cells": cells, "gpu_s": took}
            steps = found if scene == "friction" else found.roughvisc.steps
            record["solved_s"] = float(steps.wall_time.max())  # without warnings and copies of the fields
            record["pairs"] = record["solved_s"] / (float(steps.convolutions.sum()) * pair)
            if cells <= COMPARED:
                record["cpu_s"], expected = seconds(partial(SCENES[scene], height, **CPU))
                record["ratio"] = record["cpu_s"] / took
                apart = np.abs(found.pressure.values - expected.pressure.values).sum((1, 2))
                largest = float(expected.pressure.values.sum((1, 2)).max())
                record["apart"] = float(apart.max()) / largest / TOLERANCE
            yield record


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="+", default=[512, 1024, 2048, 4096, 8192])
    parser.add_argument("--seconds", type=float, default=240.0)
    given = parser.parse_args()
    device = arrays_of("gpu")
    print("variables whose bits differ after kills:", *(resume() or ["none"]))
    print("refused:", refusal(device), flush=True)
    for row in measure(given.sizes, given.seconds):
        print("  ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()), flush=True)
