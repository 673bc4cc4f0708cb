"""Is a number as accurate as it was asked to be, and what does that cost? 40 requests on surfaces that are known.

    python workflows/benchmarks/whole_error_requests.py [--first N] [--count N] [--out requests.jsonl]

Surfaces are those of ``whole_error.py``, 64 x 64 cells of 1 mm with Gaussian amplitudes, pressed on a Zener rubber or
slid on it. A request is a quantity, a target, and whether it is of the patch or of all surfaces of the recipe. It is
*met* if the number is within the target of the truth. Of a patch that is the number on cells eight times shorter, or
that of the surface down to its true cut-off, on cells four times shorter, where the scan does not hold all waves; of
all surfaces it is the mean of the logarithms of 64 others with cells half as long, whose own error widens the target.
It is *refused rightly* if the floor is above the target, and the truth within the interval that the first grid states.
The cost is the wall time of all solves over that of the naive finest choice: one solve with cells a quarter as long and
a tolerance of 1e-3; for all surfaces as many of them as their scatter takes, and 20 at least. Lines are appended to
OUT; requests that are found there are not run again.
"""

import argparse
import json
import math
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from whole_error import FAMILIES, study

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.study.budget.grids import first_grids, grids_of
from roughvisc.study.budget.solves import Bench
from roughvisc.study.budget.target import choose, wanting
from roughvisc.study.execution.monitor import Monitor
from roughvisc.study.execution.run import compute
from roughvisc.study.quantities import QUANTITIES

PATCHES = 64
#: Family, nominal pressure, seed.
PATCH_SCENES = [
    ("smooth", 5e4, 1),
    ("held", 5e4, 2),
    ("held", 2e4, 3),
    ("half an octave", 5e4, 4),
    ("smooth", 1e4, 8),
    ("an octave", 2e4, 9),
]
ALL_SCENES = [("smooth", 5e4, 5), ("held", 2e4, 6)]
PATCH_TARGETS = {"contact_area": 0.03, "mean_gap": 0.01, "leak_rate": 0.1, "friction_coefficient": 0.02}
ALL_TARGETS = {
    "contact_area": (0.06, 0.03),
    "mean_gap": (0.1, 0.05),
    "leak_rate": (0.4, 0.25),
    "friction_coefficient": (0.1, 0.05),
}
REQUESTS = [("patch", *scene, name, target) for scene in PATCH_SCENES for name, target in PATCH_TARGETS.items()]
REQUESTS += [
    ("ensemble", *scene, name, target) for scene in ALL_SCENES for name, two in ALL_TARGETS.items() for target in two
]


def main(first=0, count=40, out="requests.jsonl"):
    """Run the requests that are not in the record yet, and print what was found."""
    record = Path(out)
    lines = [json.loads(line) for line in record.read_text().splitlines()] if record.exists() else []
    known = {line["number"] for line in lines}
    for number in range(first, min(first + count, len(REQUESTS))):
        if number not in known:
            lines.append({"number": number, **request(*REQUESTS[number])})
            with record.open("a") as file:
                file.write(json.dumps(lines[-1]) + "\n")
            print(*REQUESTS[number], lines[-1], flush=True)
    summary(lines)


@cache
def scene(family, load, seed, friction):
    """The case of a scan; with 0.1 s of creep, or one speed."""
    text = study(family, load, "zener", seed, 64, friction)
    text = text.replace("speeds = [0.0001, 0.001, 0.01]", "speeds = [0.001]")
    text = text.replace('hold = "1 s"', 'hold = "0.1 s"').replace("times = [0.01, 0.1, 1.0]", "times = [0.1]")
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "scan.toml").write_text(text)
        return rv.vary(rv.read_study(Path(folder) / "scan.toml"), {"keep.fields": ["gap"]})


def number_of(case, name):
    """A quantity of a case, and the wall time of its solve. [s]"""
    result = compute(case, progress=False)
    return float(QUANTITIES[name].of(result, case)[-1]), float(result["wall_time"].values[-1])


@cache
def on_level(family, load, seed, name, level):
    """A quantity of a scan on other cells with a tolerance of 1e-3, and its wall time. [s]"""
    case = scene(family, load, seed, name == "friction_coefficient")
    return number_of(grids_of(case, [QUANTITIES[name]], 1e-3).case(level), name)


@cache
def truth(population, family, load, seed, name):
    """Logarithm of the true number, its own error at 95 %, and the scatter of one surface."""
    case = scene(family, load, seed, name == "friction_coefficient")
    if population == "patch":
        if FAMILIES[family][1] >= 2:
            return math.log(on_level(family, load, seed, name, -3)[0]), 0.0, 0.0
        return math.log(number_of(rv.vary(case, {"surface.band_limit": None}), name)[0]), 0.0, 0.0
    logs = others(family, load, seed, name == "friction_coefficient")[name]
    scatter = float(np.std(logs, ddof=1))
    return float(np.mean(logs)), 1.96 * scatter / math.sqrt(PATCHES), scatter


@cache
def others(family, load, seed, friction):
    """Logarithms of all quantities of other surfaces of a recipe, on cells half as long."""
    names = ["friction_coefficient"] if friction else ["contact_area", "mean_gap", "leak_rate"]
    fine = grids_of(scene(family, load, seed, friction), [QUANTITIES[name] for name in names], 3e-3).case(-1)
    found = {name: [] for name in names}
    for n in range(PATCHES):
        other = rv.vary(fine, {"surface.seed": 900_000 + n})
        result = compute(other, progress=False)
        for name in names:
            found[name].append(math.log(QUANTITIES[name].of(result, other)[-1]))
    return found


def request(population, family, load, seed, name, target):
    """What becomes of a request."""
    case = scene(family, load, seed, name == "friction_coefficient")
    want = {name: target, "population": population, "modulus_error": 0.0, "time_scale_error": 0.0}
    if FAMILIES[family][1] < 2:
        want["cutoff"] = FAMILIES[family][1] * 1e-3 / 64
    case = wanting(case, want)
    true, own_error, scatter = truth(population, family, load, seed, name)
    naive = on_level(family, load, seed, name, -2)[1]
    if population == "ensemble":
        naive *= max(20.0, (1.96 * scatter / math.log1p(target)) ** 2)
    with tempfile.TemporaryDirectory() as folder:
        spent = []
        bench = Bench([QUANTITIES[name]], Path(folder) / "budget", Monitor, spent.append)
        try:
            choice = choose(case, Path(folder), watch=Monitor, tell=spent.append)
        except InputError as error:
            around = first_grids(case, bench, {name: target}, math.inf).with_changed_cases()
            off = abs(true - math.log(around.solves[around.level].values[name][-1]))
            right = "whatever the grid" in str(error) and off <= around.error(QUANTITIES[name])
            outcome, cost = "refused rightly" if right else "refused", around.spent / naive
            return {"outcome": outcome, "why": str(error), "cost": cost}
        budget = choice.budgets[name]
        off = abs(true - math.log(float(budget["value"][-1])))
        cost = float(budget["cost"].sum()) + (float(budget["case_cost"]) if population == "patch" else 0.0)
        met = off <= math.hypot(math.log1p(target), own_error)
        cells = choice.case.height().sizes["x"]
    return {"outcome": "met" if met else "missed", "off": off, "cells": cells, "cost": cost / naive}


def summary(lines):
    """Print how many requests were met, and at what cost."""
    for population in ("patch", "ensemble"):
        for name in PATCH_TARGETS:
            some = [line for line in lines if REQUESTS[line["number"]][0::4][:2] == (population, name)]
            if some:
                outcomes = [line["outcome"] for line in some]
                counts = ", ".join(f"{outcomes.count(one)} {one}" for one in dict.fromkeys(outcomes))
                print(f"{population:9s} {name:21s} {counts:40s} cost {np.median([line['cost'] for line in some]):.2f}")
    good = sum(line["outcome"] in ("met", "refused rightly") for line in lines)
    print(
        f"{good} of {len(lines)} met or refused rightly; median cost {np.median([line['cost'] for line in lines]):.2f}"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--out", default="requests.jsonl")
    main(**vars(parser.parse_args()))
