"""Whether many small cases are faster in one process together, as stacks of fields, than one after the other.

    OPENBLAS_NUM_THREADS=1 python workflows/benchmarks/batched.py [CELLS ...] [--sweep COUNT]

Prints the processor time of a creep case by its parts, of transforms and passes over a stack, and of 16 contact
problems solved in lockstep. Two processes measure at the same time, since a sweep keeps all cores busy. With
`--sweep` the processes share this number of contact problems, and solve them one by one and in stacks of 16.
"""

import argparse
import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from unittest import mock

import numpy as np
from lockstep import convolved, lockstep
from scipy import fft

import roughvisc as rv
from roughvisc.experiment.resources import keep_memory
from roughvisc.mechanics.arrays import blocks
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.stepping import step


def main(cells, count=16, repeats=9):
    keep_memory()  # as a run has it
    return [
        {"cells": n} | parts(n, repeats) | stacked(n, count, repeats) | in_lockstep(n, count, repeats) for n in cells
    ]


def in_turn(repeats, *functions):
    """Median processor times of functions that take turns. [s]"""
    found = np.empty((repeats + 1, len(functions)))
    for row in found:
        for place, function in enumerate(functions):
            began = time.thread_time()
            function()
            row[place] = time.thread_time() - began
    return np.median(found[1:], axis=0)


def rough(cells, seed=0):
    """Periodic surface whose shortest waves are eight cells long. [m]"""
    spectrum = {"hurst": 0.8, "rms_slope": 0.1, "rolloff": 5e-4, "shortcut": 8e-3 / cells, "seed": seed}
    return rv.self_affine((1e-3, 1e-3), (cells, cells), **spectrum)


def parts(cells, repeats):
    """Time of a creep case, and of it in the contact solver and in transforms. [s]"""
    height = rough(cells)
    rubber = rv.zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=1e5)
    program = rv.Program().load(0.05, over=0.05).hold(0.5)
    spent, found = {}, []

    def timed(name, function):
        def call(*given, **named):
            began = time.thread_time()
            result = function(*given, **named)
            spent[name] = spent.get(name, 0.0) + time.thread_time() - began
            return result

        return call

    simulate = timed("case", rv.simulate)
    whole = mock.patch.object(Operator, "_whole", timed("transforms", Operator._whole))
    with whole, mock.patch.object(step, "solve_contact", timed("solver", solve_contact)):
        for _ in range(repeats + 1):
            spent.clear()
            ds = simulate(height, rubber, program, boundary="periodic", tolerance=1e-2, times=2, progress=False)
            found.append([spent[name] for name in ("case", "solver", "transforms")])
    times = dict(zip(("case", "solver", "transforms"), np.median(found[1:], axis=0), strict=True))
    return times | {"steps": ds.roughvisc.steps.sizes["step"], "iterations": int(ds.iterations.sum())}


def passes(gap, displacement):
    """What an iteration does to whole fields, transforms apart."""
    separation = gap + displacement
    free = np.flatnonzero(separation < 0.5)
    return separation.reshape(-1).take(free).sum()


def stacked(cells, count, repeats):
    """Time of what is done to each of some fields, over that of the same by one call for all."""
    fields, symbol = np.random.default_rng(0).random((2, count, cells, cells)), np.ones((cells, cells // 2 + 1))

    def gain(work, *stacks):
        def one_by_one():
            for first in range(count):
                work(*(stack[first : first + 1] for stack in stacks))

        one, together = in_turn(repeats, one_by_one, partial(work, *stacks))
        return one / together

    single = partial(convolved, symbol=symbol.astype(np.float32), together=count)
    return {
        "transforms_gain": gain(partial(convolved, symbol=symbol, together=count), fields[0]),
        "single_gain": gain(single, fields[0].astype(np.float32)),
        "passes_gain": gain(passes, *fields),
    }


def in_lockstep(cells, count, repeats, tolerance=1e-5, stack=16):
    """Time of contact problems one after the other over that in lockstep, and what both are off by (L1)."""
    operator = Operator((cells, cells), (1e-3 / cells, 1e-3 / cells), "periodic")
    heights = np.array([rough(cells, seed).values for seed in range(count)])
    gaps, loads = heights.max() - heights, np.geomspace(0.002, 0.02, count) * cells**2
    lengths = loads[:, None] * operator.self_influence
    scaled = (gaps.reshape(count, -1) - gaps.min(axis=(1, 2))[:, None]) / lengths
    kernel = fft.rfft2(operator.displacement(np.eye(1, cells**2).reshape(cells, cells))).real / operator.self_influence
    kernel[0, 0] = 0.0

    def one_by_one(tolerance=tolerance):
        given = zip(gaps, loads, strict=True)
        return [solve_contact(operator, gap, load=load, tolerance=tolerance).pressure / load for gap, load in given]

    def together():
        return np.concatenate([lockstep(scaled[part], kernel, tolerance) for part in blocks(count, stack)])

    def error(found):
        return float(np.median(np.abs(np.reshape(found, exact.shape) - exact).sum(axis=(1, 2))))

    exact = np.array(one_by_one(1e-13))
    one, all_at_once = in_turn(repeats, one_by_one, together)
    errors = {"error": error(one_by_one()), "lockstep_error": error(together())}
    return {"contact": one / count, "lockstep_gain": one / all_at_once} | errors


def sweep(cells, count, repeats=5):
    keep_memory()
    return [{"cells": n} | in_lockstep(n, count // 2, repeats) for n in cells]


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("cells", nargs="*", type=int, default=[16, 64, 128])
    asked.add_argument("--sweep", metavar="COUNT", type=int, help="solve only contact problems, this number in total")
    given = asked.parse_args()
    work = main if given.sweep is None else partial(sweep, count=given.sweep)
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        for rows in zip(*pool.map(work, [given.cells, given.cells]), strict=True):
            print("  ".join(f"{name} {np.mean([row[name] for row in rows]):.3g}" for name in rows[0]))
