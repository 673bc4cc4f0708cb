"""Compare the peak memory of a process that computes a case with its estimate: python memory.py 512 1024 2048.

Each case runs in its own process, since the system reports only the peak of a process.
"""

import json
import multiprocessing
import resource
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor

from roughvisc.experiment.accuracy import memory_of
from roughvisc.experiment.memory_limit import PROCESS, march_bytes
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.run import run_case
from roughvisc.study.case import Case, vary
from roughvisc.topography.grid import nominal_area

CASE = {
    "title": "memory",
    "surface": {"generate": "self_affine", "size": [1e-3, 1e-3], "hurst": 0.8, "rms_slope": 0.1, "rolloff": 2.5e-4},
    "program": [{"pressure": 7e3, "over": 0.01}, {"hold": 0.5}],
    "solve": {"tolerance": 1e-2, "boundary": "periodic"},
    "keep": {"fields": ["pressure", "gap"], "times": 5},
}
MATERIALS = {
    "elastic": {"model": "elastic", "shear_modulus": 3e6},
    "zener": {"model": "zener", "shear_modulus": 3e6, "kelvin_modulus": 1e6, "kelvin_viscosity": 1e5},
    "three": {"model": "prony", "glassy": 3e-7, "compliances": [1e-7, 2e-7, 1e-7], "times": [0.01, 0.05, 0.3]},
    "kelvin_voigt": {"model": "kelvin_voigt", "shear_modulus": 1e6, "viscosity": 1e5},
}
BOUNDARIES = {"periodic": {}, "free": {"solve.boundary": "free", "solve.edge": "accept"}}


def measure(sides, materials=tuple(MATERIALS), boundaries=tuple(BOUNDARIES)):
    context = multiprocessing.get_context("spawn")
    for side in sides:
        for boundary in boundaries:
            for material in materials:
                with ProcessPoolExecutor(1, context) as pool:
                    yield pool.submit(one, side, material, boundary).result()


def case_of(side, material):
    """Return the case of a material on a square surface."""
    surface = CASE["surface"] | {"shape": [side, side], "shortcut": max(1.6e-5, 4e-3 / side), "seed": 1}
    return Case.from_json(json.dumps(CASE | {"surface": surface, "material": MATERIALS[material]}))


def one(side, material, boundary):
    """Return the peak memory of this process, and the estimate for the case with its contact. [byte]"""
    case = vary(case_of(side, material), BOUNDARIES[boundary])
    with tempfile.TemporaryDirectory() as folder:
        with open_result(run_case(case, folder)) as ds:
            contact = float(ds.roughvisc.steps.contact_area_counted.max()) / nominal_area(ds)
        taken = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    settings, program = case.settings, case.program.on_area(nominal_area(case.height()))
    memory = memory_of(case.body, program, settings)
    stated = PROCESS + march_bytes(settings, memory, side**2, contact=contact)
    return {
        "case": f"{side} x {side}, {boundary}, {material}",
        "contact": contact,
        "bytes": taken,
        "stated_over_taken": stated / taken,
        "fields": (taken - PROCESS) / (8 * side**2),
    }


if __name__ == "__main__":
    for row in measure(map(int, sys.argv[1].split(",")), *(text.split(",") for text in sys.argv[2:])):
        print(" ".join(f"{name}={value}" for name, value in row.items()), flush=True)
