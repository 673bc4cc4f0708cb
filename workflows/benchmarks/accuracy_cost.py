"""Cost at equal measured error, of this checkout and another: a ladder of tolerances on the cases of ``accuracy.py``.

    python workflows/benchmarks/accuracy.py --against OTHER_CHECKOUT [COUNT] [SEED] [--first N]

Each checkout has a process of its own, which is given the same cases; they take turns, a run at a time. The error of a
run is measured against one reference, of this checkout at a thirtieth of the sharpest tolerance: the worst, over the
kept times, of the pressure (unless the case is soft), of the approach, and of the force where neither is judged.
Costs are interpolated over the error, in logarithms, between those runs that no cheaper one excels.
"""

import contextlib
import logging
import os
import pickle
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
from accuracy import SHARPER, TIME_LIMIT, compared, limited, timed, watched
from accuracy_cases import case

LADDER = (3e-2, 1e-2, 3e-3, 1e-3, 3e-4)
#: Rows of a case that keeps every step, since both checkouts are to keep the same.
ROWS = 40
COSTS = ("convolutions", "cpu")


def against(other, count=12, seed=1, first=0, ladder=LADDER):
    """Ratios of costs, other over this, by case; they are printed as they are found, and at the end by family."""
    found = []
    with checkout(Path(__file__).parents[2]) as this, checkout(Path(other).resolve()) as that:
        for number in range(first, first + count):
            drawn = case(seed, number)
            name = f"{number:5d} {', '.join(drawn.families.values())}{', soft' if drawn.soft else ''}"
            try:
                ratios = compare(drawn, partial(this, seed, number), partial(that, seed, number), ladder)
            except Exception as error:
                print(f"{name}: {type(error).__name__}: {error}", flush=True)
                continue
            found.append((drawn, ratios))
            print(f"{name}: other / this", *(f"{k} {v:.3f}" for k, v in ratios.items()), flush=True)
    summarise(found, count)
    return [ratios for _, ratios in found]


def compare(drawn, this, that, ladder):
    """Ratio of the costs of two checkouts, other over this, at equal error."""
    end = drawn.program.duration
    kept = np.linspace(0, end, ROWS).tolist() if drawn.times is None else drawn.times
    exact = this(ladder[-1] / SHARPER, [*kept, *watched(drawn.program)])
    points = {this: [], that: []}
    for i, tolerance in enumerate((ladder[0], *ladder)):  # the first is to warm up
        for run in (this, that) if i % 2 else (that, this):  # nobody is always first
            ds = run(tolerance, kept)
            cpu = min(ds.attrs["cpu"], run(tolerance, kept).attrs["cpu"]) if _is_short(ds) else ds.attrs["cpu"]
            if i:
                points[run].append((error(drawn, ds, exact), int(ds.convolutions.sum()), cpu))
    return {
        name: ratio(*(np.array(points[run])[:, [0, i + 1]] for run in (this, that))) for i, name in enumerate(COSTS)
    }


def _is_short(ds):
    """Whether a run is worth timing twice: other programs on the machine disturb it."""
    return ds.attrs["cpu"] < 0.3


def error(drawn, ds, exact):
    """The worst error of a run's rows."""
    rows = compared(ds, exact, drawn.program)
    judged = [rows["approach"]["true"], *([] if drawn.soft else [rows["pressure"]["true"]])]
    if not np.isfinite(np.concatenate(judged)).any():
        judged = [rows["force"]["true"]]
    return float(np.nanmax(np.concatenate(judged)))


def ratio(this, other):
    """Geometric mean of the ratio of costs, over the errors that both reach; NaN if there are none."""
    lines = [_frontier(points) for points in (this, other)]
    low, high = max(line[0][0] for line in lines), min(line[0][-1] for line in lines)
    if low > high:
        return np.nan
    at = np.linspace(low, high, 9)
    costs = [np.interp(at, *line) for line in lines]
    return float(np.exp(np.mean(costs[1] - costs[0])))


def _frontier(points):
    """Logarithms of error and cost, errors ascending, of the runs that no other excels in both."""
    ordered = sorted((max(cost, 1e-3), max(error, 1e-15)) for error, cost in points)
    best = [(cost, error) for i, (cost, error) in enumerate(ordered) if all(error < e for _, e in ordered[:i])]
    cost, error = np.log(np.array(best)[::-1]).T
    return error, cost


def summarise(found, count):
    """Median and quartiles over the cases, all and by family."""
    print(f"\n{len(found)} of {count} cases compared; cost other / this at equal error: quartiles, and number of cases")
    groups = {"all": found}
    for kind in ("material", "program"):
        for drawn, ratios in found:
            groups.setdefault(f"{kind}: {drawn.families[kind]}", []).append((drawn, ratios))
    for name, members in groups.items():
        line = f"{name:34}"
        for cost in COSTS:
            values = [ratios[cost] for _, ratios in members if np.isfinite(ratios[cost])]
            quartiles = np.quantile(values, (0.25, 0.5, 0.75)) if values else [np.nan] * 3
            line += f"{cost:>14} " + " ".join(f"{value:6.3f}" for value in quartiles) + f" ({len(values)})"
        print(line)


# ----------------------------------------------------------------------------------------------------------------
# a process for each checkout


@contextlib.contextmanager
def checkout(folder):
    """A function that runs a case in a process which imports the package from a folder."""
    paths = [str(folder), str(Path(__file__).parent)]
    with subprocess.Popen(
        [sys.executable, "-c", "import accuracy_cost; accuracy_cost.serve()"],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths), "PYTHONSAFEPATH": "1"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:

        def run(*task):
            pickle.dump(task, process.stdin)
            process.stdin.flush()
            answer = pickle.load(process.stdout)
            if isinstance(answer, str):
                raise RuntimeError(f"{folder.name}: {answer}")
            return answer

        imported = Path(pickle.load(process.stdout))
        if imported.parents[1] != folder:
            raise RuntimeError(f"the package is imported from {imported}: expected one in {folder}")
        yield run


def serve():
    """Answer each seed, number of a case, tolerance and times on the standard input with a result, or what went wrong.

    The case is drawn here: classes of one checkout are not those of another.
    """
    import roughvisc

    results, sys.stdout = sys.stdout.buffer, sys.stderr
    logging.getLogger("roughvisc").setLevel(logging.ERROR)
    pickle.dump(roughvisc.__file__, results)
    results.flush()
    with contextlib.suppress(EOFError):
        while True:
            seed, number, tolerance, times = pickle.load(sys.stdin.buffer)
            try:
                with limited(TIME_LIMIT):
                    answer = timed(case(seed, number), tolerance, times)
            except Exception as failure:
                answer = f"{type(failure).__name__}: {failure}"
            pickle.dump(answer, results)
            results.flush()
