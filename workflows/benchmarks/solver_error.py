"""What error does the contact solver leave, is its estimate honest, and what has its tolerance to do with it?

    python workflows/benchmarks/solver_error.py [CELLS ...]

CELLS are 48, 64 and 131 unless given. Each problem is solved to a duality gap of 1e-14 under its load, then under load
and under the approach found, from nothing and from the solution of nine tenths of the load, to seven tolerances.
Printed are quantiles of the relative L1 error of the pressure over the tolerance, and of the estimate over the error.

Of 4,173 solutions, in sparse to full contact, 98 % had an estimate of at least 0.8 times the error;
the median was 2.4 times, the 98th percentile 8.3 times. The error over the tolerance was, in the median, at the 98th
percentile and at most: 1.0, 6.6, 18 under load and 0.6, 4.0, 10 under approach in free space; 0.24, 3.6, 15 and 0.36,
4.2, 11 with periodic boundaries.
"""

import itertools
import sys

import numpy as np
from scenes import rough_gap, sphere_gap

from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import solve_contact

TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4, 3e-5, 3e-6, 3e-7)
QUANTILES = (0.02, 0.5, 0.98, 1.0)


def problems(cells, boundary):
    """Name, half-space, gap, load and present cells; lengths in cells."""
    shape = (cells, cells - 3)
    whole = Operator(shape, (1.0, 1.0), boundary)
    quarter = Operator(shape, (1.0, 1.0), boundary, mirrored=True)
    x, y = np.arange(cells)[:, None] - cells / 2 + 0.37, np.arange(cells - 3) - cells / 2 + 1.1
    distance, inside = np.hypot(x, y), np.hypot(x, y) < cells / 3
    for a in (0.08, 0.2, 0.35):
        yield "sphere", whole, distance**2 / (2 * cells), 4 / 3 * (a * cells) ** 3 / cells, None
        yield "cone", whole, 0.1 * distance, 0.1 * (a * cells) ** 2, None
    yield "punch", whole, np.where(inside, 0.0, 3.0), 20.0, inside
    yield "rough punch", whole, np.where(inside, rough_gap(cells)[:, 3:], 3.0), 0.05 * cells**2, inside
    waves = np.cos(2 * np.pi * x / cells) + np.cos(2 * np.pi * y / (cells - 3))
    for mean in (0.01, 0.05, 0.15):
        yield "wave", whole, 0.025 * cells * (2 - waves), mean * cells**2, None
    for mean, seed in itertools.product((0.01, 0.05, 0.2, 0.5, 0.9, 1.3), (0, 1)):
        yield "rough", whole, rough_gap(cells, seed)[:, 3:], mean * cells**2, None
    yield "a quarter of a sphere", quarter, sphere_gap(2 * cells)[0][cells:, cells:-3], 0.018 * cells**2, None
    yield "a quarter of a rough surface", quarter, rough_gap(cells, 2)[:, 3:], 0.1 * cells**2, None


def rows(cells, tolerances=TOLERANCES):
    """Control, boundary, contact fraction, tolerance, relative L1 error, that of the load, its estimate and bound."""
    for boundary, size in itertools.product(("free", "periodic"), cells):
        for name, operator, gap, load, present in problems(size, boundary):
            given = {"present": present, "max_iterations": 5000}
            exact = solve_contact(operator, gap, load=load, tolerance=1e-14, **given)
            before = solve_contact(operator, gap, load=0.9 * load, tolerance=1e-8, **given).pressure
            touching = exact.pressure > 0
            controls = [("load", load)]
            if boundary == "free" or not touching.all():  # else the approach does not determine the load
                controls.append(("approach", float(np.mean((gap + exact.displacement)[touching]))))
            for (control, value), start, tolerance in itertools.product(controls, (None, before), tolerances):
                state = solve_contact(
                    operator, gap, **{control: value}, tolerance=tolerance, start=start, estimate_error=True, **given
                )
                error = np.abs(state.pressure - exact.pressure).sum() / load
                yield {
                    "case": f"{name}, {control}, {boundary}, {size} cells, to {tolerance:g}",
                    "group": f"{control}, {boundary}",
                    "contact": float(np.mean(touching)),
                    "tolerance": tolerance,
                    "error": float(error),
                    "load_error": abs(float(state.load / load) - 1),
                    "estimate": float(state.error),
                    "bound": state.bound,
                }


def quantiles(ratios):
    return "  ".join(f"{q:8.2g}" for q in np.quantile(ratios, QUANTILES))


def main(cells=(48, 64, 131)):
    found = list(rows(cells))
    groups = sorted({row["group"] for row in found})
    print(f"{'quantiles':42} " + "  ".join(f"{q:8g}" for q in QUANTILES))
    for group in groups:
        own = [row for row in found if row["group"] == group]
        for tolerance in TOLERANCES:
            ratios = [row["error"] / tolerance for row in own if row["tolerance"] == tolerance]
            print(f"error / tolerance, {group + ', ' + format(tolerance, 'g'):23} {quantiles(ratios)}")
        print(f"error / tolerance, {group:23} {quantiles([row['error'] / row['tolerance'] for row in own])}")
        print(f"load's / tolerance, {group:22} {quantiles([row['load_error'] / row['tolerance'] for row in own])}")
    for group in [*groups, ""]:  # below 1e-9 the exact pressure is not exact enough
        own = [row for row in found if group in row["group"] and row["error"] > 1e-9]
        ratios = np.array([row["estimate"] / row["error"] for row in own])
        bounds = [row["bound"] / row["error"] for row in own]
        print(f"estimate / error, {group or 'all':24} {quantiles(ratios)}   at least 0.8: {np.mean(ratios >= 0.8):.4f}")
        print(f"bound / error, {group or 'all':27} {quantiles(bounds)}   of {len(own)}")


if __name__ == "__main__":
    main(tuple(int(n) for n in sys.argv[1:]) or (48, 64, 131))
