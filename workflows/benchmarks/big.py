"""Large grids: elastic rough contact at 1024 to 8192 squared, by this package, Tamaas and ASPHER; creep at 4096.

    python workflows/benchmarks/big.py elastic [CELLS[:AREA,...[:PEER,...]] ...]
    python workflows/benchmarks/big.py creep|threads|machine|guess [CELLS ...]

Areas are parts of the surface, or "sphere". Every solution runs in a process of its own, which tells its time, wall and
processor, and its largest memory. Iterations on nested grids count by their cells. The error is the L1 difference of
the pressure to a solution to a duality gap of 1e-12, over the load. Peers are Tamaas and ASPHER, left out where they
are not installed; "none" asks for neither.
"""

import json
import math
import os
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from unittest import mock

import numpy as np
from scenes import load_for_area, rough_gap, sphere_gap
from scipy import fft

import roughvisc as rv
from roughvisc.experiment.resources import retain_arena
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import solve_contact, solver

AREAS = (0.05, 0.3, 0.95)
REFERENCE = 1e-12
# What takes hours is left out; so long is waited for one solution of a peer. [s]
LARGEST = {"ASPHER": 8192, "Tamaas": 2048}
PATIENCE = 2700
# A solution that takes less than this is timed five times. [s]
SHORT = 10
# Solutions of at most so many cells a side take less than a second: more of them are timed.
FEW = 1024


def scene(cells, area):
    """Gap and mean pressure over the contact modulus; the load for an area is that of a quarter of the width."""
    if area == "sphere":
        return (*sphere_gap(cells), "free")
    few = min(cells, 512)
    gap, operator = rough_gap(few), Operator((few, few), (1.0, 1.0), "periodic")
    return rough_gap(cells), load_for_area(operator, gap, area), "periodic"


def ours(gap, mean, boundary, tolerance, threads):
    operator = Operator(gap.shape, (1.0, 1.0), boundary)
    passes, pcg = [], solver.pcg

    def counted(*given, **named):
        state = pcg(*given, **named)
        passes.append(state.iterations * state.pressure.size / gap.size)
        return state

    counting = mock.patch.object(solver, "pcg", counted)
    with counting, fft.set_workers(threads), retain_arena(gap.nbytes):  # the last two as a march does
        state = solve_contact(operator, gap, load=mean * gap.size, tolerance=tolerance)
    return state.pressure, state.iterations, sum(passes)


def by_tamaas(gap, mean, boundary, tolerance, threads):
    import tamaas

    tamaas.set_log_level(tamaas.LogLevel.error)
    tamaas.initialize(threads)
    model = tamaas.Model(tamaas.model_type.basic_2d, [float(n) for n in gap.shape], list(gap.shape))
    model.E, model.nu = 1.0, 0.0
    if boundary == "free":
        tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
    solver = tamaas.PolonskyKeerRey(model, gap.max() - gap, tolerance)
    if boundary == "free":
        solver.setIntegralOperator("dcfft")
    solver.max_iter = 20_000
    solver.solve(mean)
    return np.array(model.traction), None, None


def by_aspher(gap, mean, boundary, tolerance, threads):
    import aspher

    cells = gap.shape[0]
    backend = "periodic" if boundary == "periodic" else "fft"
    found = aspher.solve_nested(
        cells, gap.ravel(), mean, domain_size=float(cells), tol=tolerance, backend=backend, light_result=True
    )
    return np.asarray(found.pressure).reshape(gap.shape), int(found.iterations), None


SOLVERS = {"roughvisc": ours, "ASPHER": by_aspher, "Tamaas": by_tamaas}


def one(solver, cells, area, tolerance, threads, folder):
    """In a process of its own: solve, tell, and keep the pressure."""
    gap, mean, boundary = scene(cells, area)
    held = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    wall, spent = time.perf_counter(), time.process_time()
    pressure, iterations, passes = SOLVERS[solver](gap, mean, boundary, tolerance, threads)
    told = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - spent}
    told |= {"iterations": iterations, "passes": passes}
    told["area"] = float(np.mean(pressure > 0))
    told["fields"] = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) * 1024 / (8 * gap.size)
    told["fields_before"] = held * 1024 / (8 * gap.size)
    np.save(pathlib.Path(folder) / f"{solver}-{tolerance:g}.npy", pressure)
    print(json.dumps(told))


def apart(solver, cells, area, tolerance, threads, folder, patience=None):
    """What a process of its own tells; None where the solver is not there, nothing where it takes too long."""
    environment = os.environ | {"OMP_NUM_THREADS": str(threads)}
    command = [sys.executable, __file__, "one", *map(str, (solver, cells, area, tolerance, threads, folder))]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment, timeout=patience)
    except subprocess.TimeoutExpired:
        return {}
    if "No module named" in done.stderr:
        return None
    if done.returncode == -signal.SIGTERM:  # stopped by hand
        return {}
    if done.returncode:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


def elastic(sizes, asked=3e-6):
    """Each solver by the loosest of its tolerances, in decades, that brings its measured error below what is asked.

    First come the references, by two threads. Then two solutions run side by side, each by one thread: every one is
    measured beside another.
    """
    widths = {}
    with tempfile.TemporaryDirectory() as folder:
        for cells, areas, peers in sizes:
            for area in areas:
                scene_folder(folder, cells, area).mkdir()
                apart("roughvisc", cells, area, REFERENCE, 2, scene_folder(folder, cells, area))
                for solver in ("roughvisc", *peers):
                    if cells <= LARGEST.get(solver, cells):
                        widths.setdefault((solver, area), []).append(cells)
        print("references are there", flush=True)
        ours_first = sorted(widths.items(), key=lambda item: list(SOLVERS).index(item[0][0]))
        with ThreadPoolExecutor(2) as pool:
            for done in [pool.submit(widening, *which, sizes, folder, asked) for which, sizes in ours_first]:
                done.result()


def scene_folder(folder, cells, area):
    return pathlib.Path(folder) / f"{cells}-{area}"


def widening(solver, area, sizes, folder, asked):
    """One program and one scene on wider and wider grids: none gets a looser tolerance than a narrower one needs."""
    tolerances, wall = [1e-5, 1e-6, 1e-7, 1e-8, 1e-9], 0.0
    for cells in sorted(sizes):
        if solver != "roughvisc" and 4 * wall > PATIENCE:
            print(f"{cells:5d} {area!s:>7} {solver}: not begun, would take more than {4 * wall:.0f} s", flush=True)
            return
        found = loosest(solver, cells, area, tolerances, scene_folder(folder, cells, area), asked)
        if found is None:
            return
        tolerance, wall = found
        tolerances = [each for each in tolerances if each <= tolerance]


def loosest(solver, cells, area, tolerances, folder, asked):
    """Loosest of these tolerances whose measured error is small enough, and its time; None where there is none."""
    patience = None if solver == "roughvisc" else PATIENCE
    for tolerance in tolerances:
        began = time.perf_counter()
        told = apart(solver, cells, area, tolerance, 1, folder, patience)
        if told is None:
            return None
        name = f"{solver} {tolerance:.0e}"
        if not told:
            print(f"{cells:5d} {area!s:>7} {name}: more than {time.perf_counter() - began:.0f} s", flush=True)
            return None
        pressure = folder / f"{solver}-{tolerance:g}.npy"
        found = error_of(pressure, folder / f"roughvisc-{REFERENCE:g}.npy")
        pressure.unlink()
        if found <= asked:
            if told["wall"] < SHORT:
                again = [apart(solver, cells, area, tolerance, 1, folder) for _ in range(4)]
                told = sorted([told, *again], key=lambda each: each["wall"])[2]
            tell(cells, area, name, told, found)
            return tolerance, told["wall"]
        print(f"{cells:5d} {area!s:>7} {name}: error {found:.1e} after {told['wall']:.1f} s", flush=True)
    print(f"{cells:5d} {area!s:>7} {solver}: no tolerance brings its error below {asked}", flush=True)
    return None


def asked_for(cells, areas="0.05,0.3,0.95,sphere", peers="ASPHER,Tamaas"):
    """Cells, areas and peers as the command line has them."""
    named = [] if peers == "none" else peers.split(",")
    if not set(named) <= set(LARGEST):
        raise SystemExit(f"peers are {peers}: expected none, or some of {', '.join(LARGEST)}")
    return int(cells), areas.split(","), named


def error_of(found, exact):
    """By a process of its own: what one held when it began another counts in the largest memory of that one."""
    done = subprocess.run([sys.executable, __file__, "error", found, exact], capture_output=True, text=True, check=True)
    return float(done.stdout)


def error(found, exact):
    pressure, exact = np.load(found), np.load(exact)
    print(np.abs(pressure / pressure.sum() * exact.sum() - exact).sum() / exact.sum())


def tell(cells, area, solver, told, error):
    of_it = ""
    if told["passes"]:
        each = told["cpu"] / cells**2 / told["passes"] * 1e9
        of_it = f" {told['passes']:.1f} with those of nested grids, {each:.1f} ns a cell and iteration,"
    print(
        f"{cells:5d} {area!s:>7} {solver:16s} area {told['area']:.3f}  error {error:.1e}  wall {told['wall']:8.2f} s  "
        f"cpu {told['cpu']:8.2f} s  iterations {told['iterations']},{of_it} "
        f"{told['fields']:.1f} fields (before {told['fields_before']:.1f})",
        flush=True,
    )


def threads(sizes, area=0.05, tolerance=1e-6, repeats=3):
    """Wall time of one solve by one thread and by two, in turn, and what a cell and an iteration take of it."""
    for cells in sizes:
        walls = {1: [], 2: []}
        with tempfile.TemporaryDirectory() as folder:
            for _ in range(repeats if cells > FEW else 2 * repeats + 1):
                for count, found in walls.items():
                    told = apart("roughvisc", cells, area, tolerance, count, folder)
                    found.append(told["wall"])
        each = {count: np.array(found) / cells**2 / told["passes"] * 1e9 for count, found in walls.items()}
        one_thread, two = (float(np.median(found)) for found in walls.values())
        print(
            f"{cells:5d} wall by one thread {one_thread:.2f} s, by two {two:.2f} s: {one_thread / two:.2f}; "
            + "; ".join(
                f"{count}: {np.median(ns):.1f} ns a cell and iteration ({ns.min():.1f} to {ns.max():.1f})"
                for count, ns in each.items()
            ),
            flush=True,
        )


def machine(sizes, area=0.05, tolerance=1e-6, repeats=3):
    """What two processes do in the time of one, each with a thread and a problem of its own: no program does more."""
    for cells in sizes:
        ratios = []
        with tempfile.TemporaryDirectory() as first, tempfile.TemporaryDirectory() as second:
            for _ in range(repeats):
                alone = apart("roughvisc", cells, area, tolerance, 1, first)["wall"]
                with ThreadPoolExecutor(2) as pool:
                    both = [pool.submit(apart, "roughvisc", cells, area, tolerance, 1, one) for one in (first, second)]
                ratios.append(alone * sum(1 / process.result()["wall"] for process in both))
        found = ", ".join(f"{ratio:.2f}" for ratio in ratios)
        print(f"{cells:5d} two processes of one thread do {found} times as much as one", flush=True)


def guess(sizes, tolerance=1e-6, repeats=5):
    """What first guesses on coarser grids are worth: processor time and iterations with them and without, in turn."""
    for cells in sizes:
        for area in (*AREAS, "sphere"):
            gap, mean, boundary = scene(cells, area)
            found = {solver._COARSE_FROM: [], math.inf: []}
            for _ in range(repeats):
                for least, states in found.items():
                    with mock.patch.object(solver, "_COARSE_FROM", least):
                        spent = time.process_time()
                        _, iterations, _ = ours(gap, mean, boundary, tolerance, 1)
                        states.append((time.process_time() - spent, iterations))
            (with_it, few), (without, many) = (np.median(states, axis=0) for states in found.values())
            print(
                f"{cells:5d} {area!s:>7} {with_it:.3f} s, {few:.0f} iterations; without guesses {without:.3f} s, "
                f"{many:.0f}: {with_it / without:.2f} of the time",
                flush=True,
            )


def creeping(cells, count, fraction=0.08, tolerance=1e-3):
    """Zener, step and hold, in a process of its own: time, steps, memory by so many threads."""
    surface = rv.self_affine(1.0, (cells, cells), hurst=0.8, rms_slope=0.1, rolloff=0.25, shortcut=8 / cells, seed=0)
    material = rv.zener(shear_modulus=3e6, kelvin_modulus=3e6, kelvin_viscosity=3e6)
    softest = float(material.contact_compliance(1e9))
    program = rv.Program().pressure(fraction * 0.1 / softest / 1.9, over=0).hold(5.0)
    settings = {"boundary": "periodic", "tolerance": tolerance, "times": [5.0], "fields": (), "progress": False}
    wall, spent = time.perf_counter(), time.process_time()
    ds = rv.simulate(surface, material, program, threads=count, **settings)
    wall, spent = time.perf_counter() - wall, time.process_time() - spent
    fields = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / (8 * cells**2)
    cost, accuracy = ds, ds
    print(
        f"{cells:5d} creep, {count} threads: contact {float(ds.contact_fraction[-1]):.3f}, wall {wall:.1f} s, "
        f"cpu {spent:.1f} s, {ds.roughvisc.steps.sizes['step']} steps, {int(cost.iterations.sum())} iterations, "
        f"{int(cost.convolutions.sum())} convolutions, time error {float(accuracy.time_error.max()):.1e}, "
        f"{fields:.1f} fields",
        flush=True,
    )


def creep(sizes):
    """The same by two threads, and by one."""
    for cells in sizes:
        for count in (2, 1):
            subprocess.run([sys.executable, __file__, "creeping", str(cells), str(count)], check=True)


if __name__ == "__main__":
    what, *given = sys.argv[1:] or ["elastic"]
    if what == "one":
        program, cells, area, tolerance, count, folder = given
        one(program, int(cells), area if area == "sphere" else float(area), float(tolerance), int(count), folder)
    elif what == "error":
        error(*given)
    elif what == "creeping":
        creeping(*map(int, given))
    elif what == "elastic":
        elastic([asked_for(*each.split(":")) for each in given or ["1024", "2048", "4096"]])
    else:
        {"creep": creep, "threads": threads, "machine": machine, "guess": guess}[what](
            [int(n) for n in given] or [1024, 2048, 4096]
        )
