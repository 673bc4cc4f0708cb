"""Time and memory of a leak rate, by each solver and by the independent program reynoldsflow.

    python workflows/benchmarks/leakage.py [CELLS ...]
    python workflows/benchmarks/leakage.py history [CELLS ...]

The gap of a rough surface on an elastic body, out of contact and with a few parts of the area in contact, on 512
squared cells unless other numbers are given, between walls. Each solver has a process of its own, which goes from the
gap to the conductance: `factors` and `two grids` of this package, with bounds that close; and reynoldsflow
(`pip install reynoldsflow`), without. Printed are the bounds, processor and wall time, and the memory that it took
beyond what was there before. Conductances of the two agree to rounding; reynoldsflow has whole cells between its sides
and the first centres, where this package has half ones.

`history` compares the processor time of both solvers on the 50 kept gaps of a rough surface that creeps under a ramp
and a hold, until half of it is in contact; each gap is solved by the one and the other in turn.
"""

import math
import multiprocessing
import resource
import sys
import time

import numpy as np

SIDE, SLOPE, SHEAR_MODULUS = 1e-3, 0.1, 1e6
#: Nominal pressure over contact modulus and slope -> about twice the part of the area in contact.
PRESSURES = (0.0, 0.05, 0.12, 0.2)


def gaps(cells):
    """Part of the area in contact, and the gap. [m]"""
    import roughvisc as rv

    shape = {"hurst": 0.8, "rms_slope": SLOPE, "rolloff": SIDE / 4, "shortcut": 8 * SIDE / cells, "seed": 1}
    height = rv.self_affine(SIDE, cells, **shape)
    yield 0.0, height.values.max() + 1e-7 - height.values
    modulus = 4 * SHEAR_MODULUS
    for pressure in PRESSURES[1:]:
        program = rv.Program().pressure(pressure * modulus * SLOPE, over=0)
        settings = {"boundary": "periodic", "tolerance": 1e-3, "fields": ("gap",), "progress": False}
        ds = rv.simulate(height, rv.elastic(SHEAR_MODULUS), program, **settings)
        yield float(ds.contact_fraction[-1]), ds.gap[-1].values


def by_this_package(gap, solver):
    """Lower and upper bound of the conductance by one of the two solvers. [m3]"""
    from roughvisc.mechanics.transport import flow

    flow._LARGE = 0 if solver == "two grids" else np.inf
    spacing = (SIDE / gap.shape[0], SIDE / gap.shape[1])

    def solve():
        found = flow.flow(gap, spacing)
        return found.lower, found.upper

    return solve


def by_reynoldsflow(gap):
    """The same by reynoldsflow, whose numba functions are compiled before."""
    from reynoldsflow import transport

    def solve(gap):
        open_, _, flux = transport.solve_fluid_problem(gap, p_west=1.0, p_east=0.0)
        return (math.nan, transport.compute_total_flux(open_, flux, len(gap))[0] / 12)

    gap = np.maximum(gap, 0.0)
    solve(np.ones((16, 16)))
    return lambda: solve(gap)


def measure(gap, solver, sender):
    """Send what a solver finds, its times [s] and its memory [MB]."""
    try:
        work = by_reynoldsflow(gap) if solver == "reynoldsflow" else by_this_package(gap, solver)
    except ImportError:
        sender.send(None)
        return
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    wall, processor = time.perf_counter(), time.process_time()
    found = work()
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    sender.send((found, processor, wall, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e3))


def main(*sizes):
    """Print a row for each gap and solver."""
    context = multiprocessing.get_context("spawn")
    rows = []
    for cells in sizes or (512,):
        for fraction, gap in gaps(cells):
            for solver in ("factors", "two grids", "reynoldsflow"):
                receiver, sender = context.Pipe(duplex=False)
                process = context.Process(target=measure, args=(gap, solver, sender))
                process.start()
                found = receiver.recv()
                process.join()
                if found is None:
                    continue
                row = {"cells": cells, "contact": round(fraction, 3), "solver": solver}
                row |= dict(
                    zip(("lower", "upper", "processor", "wall", "memory"), (*found[0], *found[1:]), strict=True)
                )
                print(row, flush=True)
                rows.append(row)
    return rows


def history(*sizes, times=50):
    """Print a row for the gaps of each history: processor times, and the largest distance of bounds and answers."""
    import roughvisc as rv

    rubber = rv.from_relaxation(0.3e6, [3e6, 2e6, 1.2e6, 0.7e6, 0.4e6], [0.01, 0.1, 1, 10, 100])
    settings = {"boundary": "periodic", "tolerance": 1e-2, "fields": ("gap",), "times": times, "progress": False}
    rows = []
    for cells in sizes or (256,):
        shape = {"hurst": 0.8, "rms_slope": SLOPE, "rolloff": SIDE / 4, "shortcut": 8 * SIDE / cells, "seed": 1}
        height = rv.self_affine(SIDE, cells, **shape)
        ds = rv.simulate(height, rubber, rv.Program().pressure(5e4, over=1e-2).hold(200), **settings)
        row = {"cells": cells, "gaps": ds.sizes["time"]}
        row |= dict.fromkeys(("factors", "two grids", "bounds", "answers"), 0.0)
        for gap in ds.gap.values:
            found = {}
            for solver in ("factors", "two grids"):
                solve = by_this_package(gap, solver)
                start = time.process_time()
                found[solver] = solve()
                row[solver] += time.process_time() - start
            one, (lower, upper) = found["factors"], found["two grids"]
            if upper > 0:
                row["bounds"] = max(row["bounds"], 1 - lower / upper)
                row["answers"] = max(row["answers"], abs((lower + upper) / sum(one) - 1))
        print(row | {"ratio": row["two grids"] / row["factors"]}, flush=True)
        rows.append(row)
    return rows


if __name__ == "__main__":
    if sys.argv[1:2] == ["history"]:
        history(*map(int, sys.argv[2:]))
    else:
        main(*map(int, sys.argv[1:]))
