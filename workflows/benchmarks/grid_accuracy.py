"""Compare ``grid_error`` with true errors, from closed forms and finer grids.

    python workflows/benchmarks/grid_accuracy.py [--orders] [--small]

Prints by quantity in how many cases the stated error is at least 0.8 of the true error, and the median ratio of both.
With ``--orders`` it prints the error of the approach over ``(h/a)^2``, with cells of side h and a contact of radius a,
for balls and cones whose apex lies in a cell or between cells. Some minutes on one core.
"""

import argparse
import itertools

import numpy as np

import roughvisc as rv
from roughvisc.experiment.grid_error import pressure_distance

UNIT, SLOPE = rv.elastic(0.25), 0.01  # contact modulus 1
LOADS = {"sphere": 4 / 3 * SLOPE, "cone": np.pi / 2 * SLOPE, "punch": SLOPE}  # to a contact radius of one
#: Errors below this are solver errors.
NONE = 1e-5
#: kind -> (what makes it, its parameter, height over the distance from the apex, closed form)
CASES = {
    "sphere": (rv.sphere, 1 / SLOPE, lambda r: -SLOPE * r**2 / 2,
               rv.closed_forms.hertz(1 / SLOPE, 1.0, LOADS["sphere"])),
    "cone": (rv.cone, SLOPE, lambda r: -SLOPE * r, rv.closed_forms.cone(SLOPE, 1.0, LOADS["cone"])),
    "punch": (rv.flat_punch, 1.0, lambda r: np.where(r <= 1, 0.0, np.nan),
              rv.closed_forms.flat_punch(1.0, 1.0, LOADS["punch"])),
}  # fmt: skip


def pressed(height, load, approach=None, **settings):
    settings = {"boundary": "free", "tolerance": 1e-4, "progress": False, "fields": ("pressure",), **settings}
    program = rv.Program().load(load, over=0) if approach is None else rv.Program().approach(approach, over=0)
    return rv.simulate(height, UNIT, program, **settings)


def orders(radii=None):
    """Error of the approach over ``(h/a)^2``: least, in the middle, and largest, by kind and parity."""
    for kind in ("sphere", "cone"):
        for parity in (1, 0):
            found = []
            for radius in np.geomspace(2, 32, 33) if radii is None else radii:
                cells = 2 * int(np.ceil(1.2 * radius + 1)) + parity
                make, parameter, _, exact = CASES[kind]
                height = make(parameter, cells / radius, cells)
                ds = pressed(height, LOADS[kind], tolerance=1e-7, fields=())
                found.append((float(ds.approach[0]) / exact.approach - 1) * radius**2)
            least, middle, largest = np.quantile(found, [0, 0.5, 1])
            row = {"kind": kind, "grid": "odd" if parity else "even", "last": found[-1]}
            yield row | {"least": least, "middle": middle, "largest": largest}


def indenters(radii, offsets, seed=1):
    """Balls, cones and punches by their recipes, and ones that lie anywhere between the cells, as data."""
    rng = np.random.default_rng(seed)
    for kind, (make, parameter, profile, exact) in CASES.items():
        for radius in [a for a in radii if kind != "punch" or a >= 1]:  # smaller ones may hold no cell
            for number in range(2 + offsets):
                cells = 2 * int(np.ceil(max(1.3 * radius, 5) + 2)) + number % 2
                size, apex = cells / radius, np.full(2, cells / radius / 2)
                if number < 2:
                    height = make(parameter, size, cells)
                else:
                    apex = apex + rng.uniform(-0.5, 0.5, 2) / radius
                    x = (np.arange(cells) + 0.5) / radius
                    values = profile(np.hypot(x[:, None] - apex[0], x - apex[1]))
                    height = rv.from_array(values, 1 / radius)
                approach = exact.approach if number % 4 > 1 else None
                ds = pressed(height, LOADS[kind], approach, grid_error=True, missing="absent")
                yield {"kind": kind, "radius": radius, "data": number > 1} | _against(ds, exact, LOADS[kind], apex)


def _against(ds, exact, load, apex, points=8):
    """Return the true errors of a result: the largest of pressure (L1), force and approach, and the corrected area."""
    side = float(ds.x[1] - ds.x[0])
    inside = (np.arange(points) + 0.5) / points - 0.5
    x, y = ((ds[axis].values[:, None] + side * inside).ravel() - at for axis, at in zip("xy", apex, strict=True))
    r = np.hypot(x[:, None], y)
    fine = np.where(r < 1, exact.pressure(np.minimum(r, 1 - 1e-12)), 0.0)
    means = fine.reshape(ds.sizes["x"], points, ds.sizes["y"], points).mean((1, 3))
    means *= load / max(means.sum() * side**2, 1e-300)  # the singular edge of a punch is not found by points
    pressure = np.abs(ds.pressure[0].values - means).sum() * side**2 / load
    approach, force = (float(one) for one in (ds.approach[0] / exact.approach, ds.force[0] / load))
    return _row(
        ds, pressure=pressure, approach=approach - 1, force=force - 1, area=float(ds.contact_area[0]) / np.pi - 1
    )


def _row(ds, **true):
    """Return stated over true errors by quantity; errors below the tolerance of the runs count as zero."""
    stated = ds
    side = float(ds.x[1] - ds.x[0])
    return {"cells": float(ds.roughvisc.steps.contact_area_counted[-1]) / side**2} | {
        name: (float(stated[own if (own := f"grid_error_{name}") in stated else "grid_error"][0]), abs(float(error)))
        for name, error in true.items()
    }


def scans(seeds, cells=(32, 48), finer=5, shortcuts=(4.0, 8.0, 16.0), fractions=(0.003, 0.03, 0.15)):
    """Compare rough surfaces of one spectrum with the same surfaces on shorter cells."""
    for seed, count in itertools.product(range(seeds), cells):
        for shortcut in shortcuts:  # shortest wave, in cells
            fine = rv.self_affine(1.0, count * finer, hurst=0.8, rms_slope=0.1, rolloff=0.5, shortcut=shortcut / count,
                                  seed=seed)  # fmt: skip
            scan = rv.from_array(fine.values[finer // 2 :: finer, finer // 2 :: finer], 1 / count)
            for boundary in ("periodic", "free"):
                for fraction in fractions:
                    load = fraction * 0.1 / 2  # about: p = 0.5 E* slope * fraction
                    settings = {"boundary": boundary, "edge": "accept"}
                    ds = pressed(scan, load, grid_error=True, **settings)
                    exact = pressed(fine, load, **settings)
                    names = {"approach": "approach", "gap": "mean_gap", "area": "contact_area"}
                    true = {name: float(ds[of][0] / exact[of][0]) - 1 for name, of in names.items()}
                    row = _row(ds, pressure=pressure_distance(ds, exact)[0] / load, **true)
                    yield {"kind": f"scan, {boundary}", "radius": shortcut, "data": True} | row


def judged(rows):
    """By kind and quantity: the part of the cases whose stated error is at least 0.8 of the true one; the middle ratio.

    Prescribed quantities have no error.
    """
    for kind in dict.fromkeys(row["kind"] for row in rows):
        for name in ("pressure", "force", "approach", "gap", "area"):
            pairs = np.array([row[name] for row in rows if row["kind"] == kind and name in row and row[name][1] > NONE])
            if len(pairs):
                ratio = pairs[:, 0] / pairs[:, 1]
                known = np.isfinite(ratio)
                yield {
                    "kind": kind,
                    "quantity": name,
                    "cases": len(pairs),
                    "missing": int(np.sum(~known)),
                    "bounded": float(np.mean(ratio[known] >= 0.8)),
                    "middle": float(np.median(ratio[known])),
                    "stated": float(np.median(pairs[known, 0])),
                }


def measure(radii=None, offsets=6, seeds=4, **rough):
    radii = np.geomspace(0.5, 24, 14) if radii is None else radii
    return [*indenters(radii, offsets), *scans(seeds, **rough)]


def main(small=False, constants=False):
    if constants:
        table = list(orders((2.0, 5.0) if small else None))
    else:
        few = {"radii": (0.7, 3.3, 8.1), "offsets": 1, "seeds": 1, "cells": (32,), "shortcuts": (8.0,)}
        table = list(judged(measure(**(few if small else {}))))
    for row in table:
        print("  ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()), flush=True)
    return table


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--orders", action="store_true")
    parser.add_argument("--small", action="store_true")
    given = parser.parse_args()
    main(given.small, given.orders)
