"""Compare stated and true errors of random cases, with runs at a thirtieth of the tolerance.

    python workflows/benchmarks/accuracy.py [COUNT] [SEED] [--first N] [--out OUT.nc] [--processes N] [--kept 1 10 50]

``accuracy_cases.py`` draws the cases. The default COUNT is 1000 and SEED 1; ``1 1 --first N`` reruns case N alone. Each
case is printed when done. At the end OUT.nc holds a table of the cases, and a summary is printed. Errors of a row are
relative to the reference: the sum of absolute differences of pressure over the largest force so far, and the
differences of approach, force and work over their largest absolute values so far. Approach and force count if the
program does not prescribe them. ``--kept`` runs each case once more for each number of kept times, evenly spaced up to
the end of the program; all runs of a case share a reference. ``--check N`` compares the references of the first N cases
with runs at a tenth of their tolerance.
"""

import argparse
import contextlib
import logging
import signal
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context

import numpy as np
import xarray as xr
from accuracy_cases import case

import roughvisc as rv


def whole(dataset):
    """A result with the groups that the first edition has."""
    groups = [one for one in ("energy", "accuracy", "cost") if hasattr(type(dataset.roughvisc), one)]
    return dataset.assign({name: part for one in groups for name, part in getattr(dataset.roughvisc, one).items()})


def costly(dataset):
    """The convolutions of a result: of its steps, or of its rows in the first edition."""
    return dataset if "convolutions" in dataset else dataset.roughvisc.steps


SHARPER = 30
QUANTITIES = ("total", "pressure", "approach", "force", "work")
#: Tolerance of references over the tolerance of the runs that check them.
FINER = 10
#: Errors below this part of the tolerance do not count where stated errors are compared with true ones.
FLOOR = 1e-3
#: Processor time of a case, its reference included. [s]
TIME_LIMIT = 60
#: Name of the kept times that a case has drawn itself.
DRAWN = "drawn"


def main(count=1000, seed=1, first=0, out="accuracy.nc", processes=2, time_limit=TIME_LIMIT, kept=(DRAWN,), check=0):
    """Run the cases; the table and the records."""
    found = []
    for results in _judged(range(first, first + count), seed, processes, time_limit, tuple(kept), check):
        print(*map(described, results), sep="\n", flush=True)
        found += results
    found.sort(key=lambda result: (result["number"], str(result["kept_times"])))
    ds = table(found)
    ds.to_netcdf(out, engine="netcdf4")
    summarise(found, ds)
    return ds, found


def _judged(numbers, seed, processes, time_limit, kept, check):
    jobs = [(seed, number, time_limit, kept, number < check) for number in numbers]
    if not processes:
        yield from (judge(*job) for job in jobs)
        return
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for future in as_completed([pool.submit(judge, *job) for job in jobs]):
            yield future.result()


# ----------------------------------------------------------------------------------------------------------------
# one case


def judge(seed, number, time_limit=TIME_LIMIT, kept=(DRAWN,), check=False):
    """Return records of a case, one for each choice of kept times: description, cost, and errors of its rows.

    If a run fails, the record states the failure. With ``check`` the last record has the errors of the reference.
    """
    logging.getLogger("roughvisc").setLevel(logging.ERROR)  # of steep slopes
    drawn = case(seed, number)
    tolerance = drawn.settings["tolerance"]
    about = {"seed": seed, "number": number, **drawn.families, "tolerance": tolerance, "soft": drawn.soft}
    records, runs, part = [], [], "run"
    try:
        with limited(time_limit * len(kept)):
            for one in kept:
                records.append({**about, "kept_times": one, "status": "ok", "rows": {}})
                runs.append(timed(drawn, tolerance, times_of(drawn, one)))
                records[-1] |= {name: runs[-1].attrs[name] for name in ("steps", "cpu")}
                records[-1] |= {"convolutions": int(costly(runs[-1]).convolutions.sum())}
            part = "reference"
            told = {float(time) for ds in runs for time in ds.time.values}
            times = sorted(told | set(watched(drawn.program)))
            exact = timed(drawn, tolerance / SHARPER, times)
            part = "comparison"
            for record, ds in zip(records, runs, strict=True):
                record |= {"reference_cpu": exact.attrs["cpu"], "rows": compared(ds, exact, drawn.program)}
        if check:
            part = "check of the reference"
            with limited(10 * time_limit):
                finest = timed(drawn, tolerance / SHARPER / FINER, times)
                rows = compared(exact.isel(time=np.isin(exact.time.values, list(told))), finest, drawn.program)
            records.append({**records[0], "kept_times": "reference", "rows": rows})
    except Exception as error:
        for record in records:
            if not record["rows"]:
                record["status"] = f"{part}: {type(error).__name__}: {error}"
    return records


def times_of(drawn, kept):
    """Return the kept times of a case as drawn, or a given number."""
    end = drawn.program.duration
    return drawn.times if kept == DRAWN else np.linspace(0, end, kept + 1)[1:].tolist()


@contextlib.contextmanager
def limited(seconds):
    """Raise TimeoutError after a processor time, on systems that can."""

    def stop(*_):
        raise TimeoutError(f"no end after {seconds:g} s of processor time")

    if not hasattr(signal, "setitimer"):
        yield
        return
    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def timed(drawn, tolerance, times):
    """Result of a case, with its accepted steps and processor time."""
    steps = []
    began = time.process_time()
    settings = drawn.settings | {"tolerance": tolerance, "times": times, "fields": ("pressure",)}
    ds = rv.simulate(
        drawn.height, drawn.material, drawn.program, progress=lambda now, end: steps.append(now), **settings
    )
    ds = whole(ds)
    ds.attrs |= {"steps": len(steps), "cpu": round(time.process_time() - began, 3)}
    return ds


def watched(program):
    """Times at which the largest values so far are looked for as well: corners, and eighths of a period."""
    found = list(program.corners)
    for segment, start in zip(program.segments, program.corners, strict=False):
        if segment.amplitude:
            found += [start + t for t in np.arange(0, segment.duration, segment.period / 8)]
    return found


def compared(ds, exact, program):
    """Return true and stated errors of the rows of a result, by quantity; NaN if unknown."""
    so_far = {name: np.maximum.accumulate(np.abs(exact[name].values)) for name in ("force", "approach", "work")}
    rows = np.searchsorted(exact.time.values, ds.time.values - 1e-12 * program.duration)
    if not np.allclose(exact.time.values[rows], ds.time.values, rtol=0, atol=1e-11 * program.duration):
        raise ValueError("the reference does not keep the times of the run")
    exact = exact.isel(time=rows)
    scale = {name: np.where(values > 0, values, np.nan)[rows] for name, values in so_far.items()}
    scale["pressure"] = scale["force"]
    cell = float(np.prod([float(ds[axis][1] - ds[axis][0]) for axis in ("x", "y")]))
    true = {name: np.abs(ds[name].values - exact[name].values) / scale[name] for name in ("approach", "force", "work")}
    true["pressure"] = np.abs(ds.pressure.values - exact.pressure.values).sum((-2, -1)) * cell / scale["force"]
    for name, given in prescribed(program, ds.time.values).items():
        true[name][given] = np.nan
    true["total"] = np.fmax(true["pressure"], np.fmax(true["approach"], true["force"]))
    stated = {"total": _row(ds, "stated_error", "time_error"), "pressure": _row(ds, "pressure_error", "stated_error")}
    stated |= {name: _row(ds, f"{name}_error") / scale[name] for name in ("approach", "force", "work")}
    found = {name: {"true": _short(true[name]), "stated": _short(stated[name])} for name in QUANTITIES}
    area, error = (_row(ds, name) / cell for name in ("contact_area", "contact_area_error"))
    low, high = area - error, area + error
    off = (area - exact.contact_area.values / cell).round(6)
    inside = np.where(np.isfinite(low), (low <= area - off + 1e-6) & (area - off <= high + 1e-6), np.nan)
    found["contact_area"] = {"cells_off": _short(off), "inside": _short(inside), "width": _short(high - low)}
    return found


def prescribed(program, times):
    """Return at which times the program prescribes the approach, and the force."""
    ends = np.array(program.corners[1:])
    given = {"approach": [], "force": []}
    for now in times:
        index = int(np.searchsorted(ends, now - 1e-12 * program.duration))
        while index + 1 < len(ends) and program.segments[index + 1].duration == 0 and ends[index + 1] <= now:
            index += 1
        origin = index
        while (
            origin
            and program.segments[origin].end is None
            and program.segments[origin - 1].control == (program.segments[index].control)
        ):
            origin -= 1
        control = program.segments[index].control if program.segments[origin].end is not None or not origin else ""
        given["approach"].append(control == "approach")
        given["force"].append(control == "load")
    return {name: np.array(where) for name, where in given.items()}


def _row(ds, *names):
    """The first of these variables that the result has along time; NaN if none."""
    present = (ds[name].values for name in names if name in ds and ds[name].dims == ("time",))
    return np.asarray(next(present, np.full(ds.sizes["time"], np.nan)), dtype=float)


def _short(values):
    return [float(f"{value:.3g}") for value in values]


# ----------------------------------------------------------------------------------------------------------------
# all cases


def table(found):
    """Results by case: worst error over tolerance, parts of the rows within, stated over true, cost."""
    names = ("worst_error_over_tolerance", "rows", "fraction_within", "fraction_stated", "stated_over_true")
    columns = {name: np.full((len(found), len(QUANTITIES)), np.nan) for name in names}
    for i, result in enumerate(found):
        for j, name in enumerate(QUANTITIES if result["rows"] else ()):
            over, ratio = over_tolerance(result, name), stated_over_true(result, name)
            columns["rows"][i, j] = over.size
            if over.size:
                columns["worst_error_over_tolerance"][i, j] = over.max()
                columns["fraction_within"][i, j] = np.mean(over <= 1)
            if ratio.size:
                columns["fraction_stated"][i, j] = np.mean(ratio >= 0.8)
                columns["stated_over_true"][i, j] = np.median(ratio)
    variables = {name: (("case", "quantity"), values) for name, values in columns.items()}
    for name in ("steps", "convolutions", "cpu", "reference_cpu", "tolerance"):
        variables[name] = ("case", np.array([result.get(name, np.nan) for result in found], float))
    for name in ("material", "program", "surface", "kept", "kept_times", "status"):
        variables[name] = ("case", np.array([result[name] for result in found], dtype=str))
    variables["soft"] = ("case", np.array([result["soft"] for result in found], "int8"))
    areas = [result["rows"].get("contact_area", {"cells_off": [np.nan], "inside": [np.nan]}) for result in found]
    variables["area_cells_off"] = ("case", [float(np.max(np.abs(area["cells_off"]))) for area in areas])
    variables["area_inside"] = ("case", [float(np.mean(area["inside"])) for area in areas])
    numbers = [result["number"] for result in found]
    return xr.Dataset(variables, {"case": numbers, "quantity": list(QUANTITIES)}, {"sharper": SHARPER, "floor": FLOOR})


def over_tolerance(result, name):
    """Errors of the rows that have one, over the tolerance."""
    true = np.array(result["rows"].get(name, {"true": []})["true"], float)
    return true[np.isfinite(true)] / result["tolerance"]


def stated_over_true(result, name):
    """Stated over true errors, of the rows that state one and whose true error is above the floor."""
    row = result["rows"].get(name, {"true": [], "stated": []})
    true, stated = np.array(row["true"], float), np.array(row["stated"], float)
    counts = (true >= FLOOR * result["tolerance"]) & np.isfinite(stated)
    return stated[counts] / true[counts]


def _kept(result):
    """How many rows are kept."""
    kept = result.get("kept_times", DRAWN)
    return result["kept"] if kept == DRAWN else f"{kept} kept"


def described(result):
    """A line for a case."""
    families = ", ".join([*(result[name] for name in ("material", "program", "surface")), _kept(result)])
    line = f"{result['number']:5d} {families}, {result['tolerance']:g}{', soft' if result['soft'] else ''}"
    if result["status"] != "ok":
        return f"{line}: {result['status']}"
    worst = {name: over_tolerance(result, name) for name in QUANTITIES[1:]}
    errors = ", ".join(f"{name} {values.max():.2g}" for name, values in worst.items() if values.size)
    return f"{line}: {errors}; {result['steps']} steps, {result['cpu']:.1f} + {result['reference_cpu']:.1f} s"


def summarise(found, ds):
    """Print a summary of all rows, first without soft cases, then of soft cases, and the worst cases."""
    wrong = [result for result in found if result["status"] != "ok"]
    print(f"\n{len(found)} cases, {len(wrong)} without a comparison", *map(described, wrong), sep="\n")
    print(f"processor time of a case [s]: median {float(ds.cpu.median()):.2f}, largest {float(ds.cpu.max()):.1f}; with "
          f"its reference {float((ds.cpu + ds.reference_cpu).mean()):.2f} in the mean")  # fmt: skip
    own = [result for result in found if result["rows"] and result.get("kept_times", DRAWN) == DRAWN]
    for soft, title in ((False, "materials that give way at once"), (True, "soft: C(0) below a tenth of C(end)")):
        part = [result for result in own if result["soft"] == soft]
        print(
            f"\n{title}: {len(part)} cases\n{'':19}rows  within  within 3  cases within    stated >= 0.8 true  median"
        )
        for label, names in (*((name, (name,)) for name in QUANTITIES), ("all but the total", QUANTITIES[1:])):
            _line(label, names, part)
        off = np.concatenate([np.abs(result["rows"]["contact_area"]["cells_off"]) for result in part] or [[]])
        inside = np.concatenate([result["rows"]["contact_area"]["inside"] for result in part] or [[]])
        inside = inside[np.isfinite(inside)]
        if off.size:
            held = f", {np.mean(inside):.2%} within the stated interval" if inside.size else ""
            print(f"contact area: {np.mean(off > 0):.1%} of rows off, by {off.max():.0f} cells at most{held}")
    for kept in dict.fromkeys(result.get("kept_times", DRAWN) for result in found):
        part = [result for result in found if result["rows"] and result.get("kept_times", DRAWN) == kept]
        if part:
            _verdict(kept, part)
    print(f"(true errors below {FLOOR:g} of the tolerance are left out of stated over true)")
    for soft, title in ((False, "not soft"), (True, "soft")):
        wanted = [result for result in found if result["rows"] and result["soft"] == soft]
        lines = _misses([result for result in wanted if result.get("kept_times", DRAWN) != "reference"])
        print(f"\nworst over the tolerance, {title}: {len(lines)} pairs of case and quantity", *lines[:25], sep="\n")


#: Errors of rows that are to be stated well, over the tolerance; from the second on, a statement below the true error
#: is a fault. How a statement may lie to the true error.
SMALL, LARGE = 1 / 50, 1 / 2
STATED_WITHIN = (0.8, 5.0)


def _verdict(kept, part):
    """Print a line per quantity for all cases with the same choice of kept times."""
    steps, convolutions, cpu = (sum(result[name] for result in part) for name in ("steps", "convolutions", "cpu"))
    print(f"\nkept times: {kept}; {len(part)} cases, {steps} steps, {convolutions} convolutions, {cpu:.1f} s")
    print(f"{'':9}  rows  within   cases  worst  stated 0.8 to 5.0 true    below, of large  median of the worst")
    for name in ("total", "work"):
        over = [over_tolerance(result, name) for result in part]
        over = [values for values in over if values.size]
        if not over:
            continue
        rows, worst = np.concatenate(over), np.array([values.max() for values in over])
        ratio, low = [], 0
        for result in part:
            row = result["rows"].get(name, {"true": [], "stated": []})
            true, stated = np.array(row["true"], float) / result["tolerance"], np.array(row["stated"], float)
            known = np.isfinite(true) & np.isfinite(stated) & (true > SMALL)
            here = stated[known] / result["tolerance"] / true[known]
            ratio.append(here)
            low += int(np.count_nonzero((here < STATED_WITHIN[0]) & (true[known] > LARGE)))
        ratio = np.concatenate(ratio)
        fine = np.mean((ratio >= STATED_WITHIN[0]) & (ratio <= STATED_WITHIN[1])) if ratio.size else np.nan
        print(f"{name:9}{rows.size:6d}{np.mean(rows <= 1):8.2%}{np.mean(worst <= 1):8.1%}{worst.max():7.2f}"
              f"{fine:14.1%} of {ratio.size:5d}{low:19d}{np.median(worst[worst > 0]):21.2f}")  # fmt: skip


def _misses(part):
    """Lines for what misses the tolerance, the worst first."""
    pairs = [(result, name) for result in part for name in QUANTITIES[1:]]
    worst = [over_tolerance(*pair).max(initial=0) for pair in pairs]
    return [_miss(*pairs[i]) for i in np.argsort(worst)[::-1] if worst[i] > 1]


def _miss(result, name):
    """A line for a quantity of a case that misses the tolerance."""
    true = np.array(result["rows"][name]["true"], float) / result["tolerance"]
    statement = "work" if name == "work" else "total"
    stated = np.array(result["rows"][statement]["stated"], float) / result["tolerance"]
    worst = int(np.nanargmax(true))
    rows = f"{np.count_nonzero(true > 1)} of {true.size} rows, the worst row {worst} (states {stated[worst]:.2g})"
    families = ", ".join([*(result[kind] for kind in ("material", "program", "surface")), _kept(result)])
    return f"{result['number']:5d} {name:8} {true[worst]:8.3g} in {rows}; {families}, {result['tolerance']:g}"


def _line(label, names, part):
    over = [np.concatenate([over_tolerance(result, name) for name in names]) for result in part]
    over = [values for values in over if values.size]
    ratio = np.concatenate([stated_over_true(result, name) for result in part for name in names] or [[]])
    if over:
        pooled = np.concatenate(over)
        kept = np.mean([values.max() <= 1 for values in over])
        stated = f"{np.mean(ratio >= 0.8):18.2%}{np.median(ratio):8.2f}" if ratio.size else f"{'not stated':>18}"
        print(
            f"{label:17}{pooled.size:6d}{np.mean(pooled <= 1):8.2%}{np.mean(pooled <= 3):10.2%}{kept:14.1%}    {stated}"
        )


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("count", nargs="?", type=int, default=1000)
    asked.add_argument("seed", nargs="?", type=int, default=1)
    asked.add_argument("--first", type=int, default=0)
    asked.add_argument("--out", default="accuracy.nc")
    asked.add_argument("--processes", type=int, default=2)
    asked.add_argument("--limit", type=float, default=TIME_LIMIT, help="processor time of a case [s]")
    asked.add_argument("--kept", nargs="*", type=int, default=[], help="numbers of kept times beside the drawn ones")
    asked.add_argument("--check", type=int, default=0, help="cases whose reference is checked")
    given = asked.parse_args()
    kept = (DRAWN, *given.kept)
    main(given.count, given.seed, given.first, given.out, given.processes, given.limit, kept, given.check)
