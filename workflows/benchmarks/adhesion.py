"""Sticky contact against dense rings, other programs and sharper runs, and its cost.

    python workflows/benchmarks/adhesion.py [PART ...] [--count 100] [--seed 1]

Each part prints one table: balls, speeds, tamaas, contact_mechanics, scenes, cost. `tamaas` needs Tamaas, and
`contact_mechanics` needs the packages ContactMechanics and Adhesion.
"""

import argparse
import logging
import warnings

import numpy as np
from scenes import seconds  # also puts the references on the path

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE

from references.rings import retracted  # isort: skip

#: Radius of a ball and relaxed contact modulus [m, Pa], and range over radius.
RADIUS, MODULUS, RANGE = 1.0, 1.0, 1e-4
ELASTIC = rv.elastic(shear_modulus=MODULUS / 4)


def attraction(tabor):
    """Attraction at a Tabor number: the cube root of R w^2 / (E^2 range^3)."""
    return rv.adhesion(work=MODULUS * (tabor**3 * RANGE**3 / RADIUS) ** 0.5, range=RANGE)


def cell(sticky, ratio):
    """Cell side at which the ratio of a cell is this one. [m]"""
    return ratio * RANGE**2 * MODULUS / sticky.work / float(HALF_SPACE.influence((1, 1), (1.0, 1.0))[0, 0])


def scales(sticky):
    """Contact radius at zero load, and half the approach of the pull-off, by Johnson, Kendall and Roberts. [m]"""
    length = sticky.work / MODULUS
    return (4.5 * np.pi * length * RADIUS**2) ** (1 / 3), (np.pi**2 * length**2 * RADIUS) ** (1 / 3)


def ball(sticky, ratio, width):
    """Ball on a grid of a width in contact radii at zero load."""
    side = cell(sticky, ratio)
    count = 2 * int(np.ceil(width * scales(sticky)[0] / side))
    return rv.sphere(RADIUS, count * side, count)


def run(surface, body, program, sticky, **options):
    given = {"boundary": "free", "progress": False, "grid_error": False, "fields": (), "edge": "accept"} | options
    return rv.simulate(surface, body, program, adhesion=sticky, **given)


def cost(ds):
    return int(rv.observables.history(ds).convolutions.sum())


def balls(
    cases=((0.3, 0.02, 5.0), (1.0, 0.4, 2.5), (1.0, 0.2, 2.5), (3.0, 0.8, 1.5), (3.0, 0.5, 1.5)),
):
    """Pull-off and contact radius of an elastic ball, against dense rings."""
    for tabor, ratio, width in cases:
        sticky = attraction(tabor)
        radius, depth = scales(sticky)
        low = -3.0 if tabor < 0.5 else -1.2
        program = rv.Program().approach(depth, over=0).approach(low * depth, over=1)
        surface = ball(sticky, ratio, width)
        times = np.linspace(0, 1, 61) if tabor < 2 else None
        ds = run(surface, ELASTIC, program, sticky, times=times)
        rings = retracted(
            tabor, 1.0, 1.0, depth / RANGE, low * depth / RANGE, hold=1e-2, count=300, steps=150, width=1.3 * width
        )
        at = int(ds.force.values.argmin())
        at_rest = [np.interp(0, -one, two) for one, two in (
            (ds.approach.values[::1], np.sqrt(ds.contact_area.values / np.pi) / radius), (rings[:, 0], rings[:, 2])
        )]  # fmt: skip
        yield {
            "tabor": tabor,
            "ratio": ratio,
            "cells": surface.shape[0],
            "pull_off": -float(ds.force[at]) / (np.pi * sticky.work * RADIUS),
            "rings": -float(rings[:, 1].min()),
            "radius": at_rest[0],
            "rings_radius": at_rest[1],
        }


def work_of_line(force, radius, sticky):
    """Energy release rate of a relaxed ball over the work of adhesion, from force and contact radius [N, m]."""
    hertz = 4 * MODULUS * radius**3 / (3 * RADIUS)
    return (hertz - force) ** 2 / (8 * np.pi * MODULUS * radius**3) / sticky.work


def schapery(speed, sticky, glassy):
    """Work of separation over w at a speed of the contact line [m per retardation time], without a fitted number.

    A crack with a cohesive zone of the strength of the attraction [1]: ``G C(d / 3 v) = w C(infinity)`` with the length
    ``d = pi G E / 4 strength^2`` of the zone in the relaxed body, half of it on each side of the line.

    .. [1] R. A. Schapery, Int. J. Fract. 11 (1975) 369; J. A. Greenwood, J. Phys. D 37 (2004) 2557.
    """
    low, high = 1.0, 1 / glassy
    for _ in range(60):
        middle = (low * high) ** 0.5
        passing = np.pi * middle * sticky.work * MODULUS / (4 * sticky.strength**2) / (3 * speed)
        compliance = glassy + (1 - glassy) * (1 - np.exp(-passing))
        low, high = (middle, high) if middle * compliance < 1 else (low, middle)
    return middle


def speeds(tabor=2.0, glassy=0.1, values=(0.01, 0.1, 1.0, 10.0, 100.0, 1e4), ratio=0.7, width=1.7, steps=500):
    """Retraction of a ball from a Zener body: pull-off against rings, work of the moving line against theory."""
    sticky = attraction(tabor)
    depth = scales(sticky)[1]
    # compliance 1 in the end, `glassy` at once, retardation time 1
    body = rv.zener(0.25 * MODULUS / glassy, 0.25 * MODULUS / (1 - glassy), 0.25 * MODULUS / (1 - glassy))
    surface = ball(sticky, ratio, width)
    for value in values:
        lasting = 5.0 * depth / (value * RANGE)
        program = rv.Program().approach(depth, over=0).hold(20).approach(-4 * depth, over=lasting)
        times = np.concatenate([[20.0], 20 + lasting * np.linspace(0.01, 1, 100)])
        ds = run(surface, body, program, sticky, times=times)
        rings = retracted(
            tabor, glassy, value, depth / RANGE, -4 * depth / RANGE, hold=20, count=200, steps=steps, width=1.4 * width
        )
        wide = np.sqrt(ds.contact_area.values / np.pi)
        moving = -np.gradient(wide, ds.time.values)
        middle = int(np.argmin(abs(wide - 0.7 * wide[0])))
        yield {
            "speed": value,
            "pull_off": -float(ds.force.min()) / (np.pi * sticky.work * RADIUS),
            "rings": -float(rings[:, 1].min()),
            "line_speed": moving[middle] / RANGE,
            "work": work_of_line(float(ds.force[middle]), wide[middle], sticky),
            "schapery": schapery(moving[middle], sticky, glassy),
            "error": float(ds.stated_error.max()),
            "convolutions": cost(ds),
        }


def rough(count, side, rms, seed):
    return rv.self_affine(
        count * side, count, hurst=0.8, rms_height=rms, rolloff=count * side / 2, shortcut=4 * side, seed=seed
    )


def tamaas(count=64, approaches=9, seed=5):
    """Rough periodic surface at nine approaches: largest differences to Tamaas, which minimises the same energy."""
    try:
        import tamaas as other
    except ImportError:
        return
    other.set_log_level(other.LogLevel.error)
    side, rms = 1 / count, 2e-3
    surface = rough(count, side, rms, seed)
    response = float(HALF_SPACE.influence((1, 1), (side, side))[0, 0])
    sticky = rv.adhesion(work=0.3 * rms**2 * MODULUS / response, range=rms)
    mean = float(surface.max() - surface.mean())
    parts = np.linspace(0.1, 0.85, approaches)
    program = rv.Program().approach(parts[-1] * mean, over=1)
    times = parts / parts[-1]
    options = {"boundary": "periodic", "tolerance": 1e-6, "fields": ("pressure", "gap")}
    ds = run(surface, ELASTIC, program, sticky, times=times, **options)
    for row, part in enumerate(parts):
        model = other.Model(other.model_type.basic_2d, [1.0, 1.0], [count, count])
        model.E, model.nu = MODULUS, 0.0
        adhesive = other.ExponentialAdhesionFunctional(surface.values)
        adhesive.setParameters({"rho": sticky.range, "surface_energy": sticky.work})
        by_gap = other.PolonskyKeerRey.gap
        solver = other.PolonskyKeerRey(model, surface.values, 1e-12, by_gap, by_gap)
        solver.addFunctionalTerm(adhesive)
        solver.max_iter = 20_000
        solver.solve((1 - part) * mean)
        pressure, gap = np.array(model.traction), np.array(model["gap"])
        own = ds.pressure.values[row]
        yield {
            "approach": part,
            "contact": float(ds.contact_fraction[row]),
            "pressure": float(abs(own - pressure).sum() / abs(pressure).sum()),
            "gap": float(abs(ds.gap.values[row] - gap).max() / sticky.range),
            "force": abs(float(ds.force[row]) / (pressure.sum() * side**2) - 1),
        }


def contact_mechanics(ratio=0.4):
    """Pressed ball in free space at Tabor 1: differences to ContactMechanics, which minimises the same energy."""
    try:
        from Adhesion.Interactions import Exponential
        from Adhesion.System import BoundedSmoothContactSystem
        from ContactMechanics import FreeFFTElasticHalfSpace
        from SurfaceTopography import Topography
    except ImportError:
        return
    sticky = attraction(1.0)
    surface, depth = ball(sticky, ratio, 2.5), scales(sticky)[1]
    ds = run(
        surface, ELASTIC, rv.Program().approach(depth, over=1), sticky, times=[1], tolerance=1e-6,
        fields=("pressure", "gap"),
    )  # fmt: skip
    own, gap = ds.pressure.values[0] / sticky.strength, ds.gap.values[0] / RANGE
    shape, size = surface.shape, surface.shape[0] * cell(sticky, ratio) / RANGE  # lengths in ranges
    body = FreeFFTElasticHalfSpace(shape, young=MODULUS / sticky.strength, physical_sizes=(size, size))
    heights = surface.values / RANGE
    system = BoundedSmoothContactSystem(body, Exponential(1.0, 1.0), Topography(heights, (size, size)))
    start = np.zeros(body.nb_subdomain_grid_pts)
    cells = slice(shape[0]), slice(shape[1])
    start[cells] = np.maximum(heights + depth / RANGE, 0)
    system.minimize_proxy(
        offset=depth / RANGE, initial_displacements=start, method="L-BFGS-B", lbounds="auto",
        options={"gtol": 1e-10, "ftol": 0, "maxcor": 50, "maxiter": 100_000, "maxfun": 1_000_000},
    )  # fmt: skip
    pressure = -system.substrate.force[cells] * shape[0] ** 2 / size**2
    yield {
        "cells": shape[0],
        "contact": float((gap == 0).mean()),
        "pressure": float(abs(own - pressure).sum() / abs(pressure).sum()),
        "gap": float(abs(system.disp[cells] - heights - depth / RANGE - gap).max()),
        "force": abs(float(own.sum() / pressure.sum()) - 1),
    }


def drawn(rng):
    """Random scene: surface, boundary, body, attraction and program."""
    sticky = attraction(rng.uniform(0.5, 1.7))
    side = cell(sticky, rng.uniform(0.3, 0.8))
    count = int(rng.integers(14, 25))
    kind = rng.choice(["ball", "rough periodic", "rough free"])
    boundary = "periodic" if kind == "rough periodic" else "free"
    rms = RANGE * rng.uniform(0.5, 3)
    surface = rough(count, side, rms, int(rng.integers(1 << 30)))
    deep, high = RANGE * rng.uniform(0.5, 2), -RANGE * rng.uniform(2, 8)
    if kind == "ball":
        surface, deep = rv.sphere(RADIUS, count * side, count), RANGE * rng.uniform(0.5, 4)
    elif kind == "rough periodic":
        deep = min(deep, 0.7 * float(surface.max() - surface.mean()))
    glassy, late = rng.uniform(0.05, 0.8), rng.uniform(0.3, 3)
    quarter = 0.25 * MODULUS
    stiff, soft = quarter / glassy, quarter / (1 - glassy)
    bodies = {
        "elastic": ELASTIC,
        "zener": rv.zener(stiff, soft, soft * late),
        "two times": rv.Prony(4 * glassy, compliances=[2 - 2 * glassy] * 2, times=[0.1 * late, late]),
        "maxwell": rv.maxwell(2 * quarter, 1.5),
        "power law": rv.power_law(4 * glassy, 4 * (1 - glassy), exponent=0.4, time_scale=6.0),
    }
    name = rng.choice(list(bodies))
    start = rv.Program().approach(high, over=0) if rng.random() < 0.5 else rv.Program()
    programs = {
        "pull": start.approach(deep, over=1).hold(1).approach(high, over=1),
        "jump": rv.Program().approach(deep, over=0).hold(1.5).approach(high, over=1),
        "cycle": start.approach(deep, over=1).cycle(deep, 0.7 * (deep - high), 1.0, 2, control="approach"),
    }
    if boundary == "periodic":  # below full contact
        programs["cycle"] = start.approach(deep, over=1).approach(high, over=1).approach(deep, over=1)
    moves = rng.choice(list(programs))
    return f"{kind}, {name}, {moves}", surface, boundary, bodies[name], sticky, programs[moves]


def scenes(count=100, seed=1, tolerance=1e-2):
    """Random scenes with 17 rows against a thirtieth of the tolerance: rows beyond it, and silent rows."""
    for number in range(count):
        name, surface, boundary, body, sticky, program = drawn(np.random.default_rng([seed, number]))
        options = {"boundary": boundary, "times": 17, "fields": ("pressure",)}
        try:
            took, ds = seconds(lambda: run(surface, body, program, sticky, tolerance=tolerance, **options), 1)  # noqa: B023
            exact = run(surface, body, program, sticky, tolerance=tolerance / 30, **options | {"times": ds.time.values})
        except rv.RoughviscError as error:
            yield {"scene": name, "number": number, "failed": str(error)[:100]}
            continue
        area = float(np.prod(np.diff(surface.x[:2])) * np.prod(np.diff(surface.y[:2])))
        sizes = np.maximum.accumulate(abs(exact.pressure).sum(("x", "y")).values) * area
        off = abs(ds.pressure - exact.pressure).sum(("x", "y")).values * area
        error = np.maximum(off, abs(ds.force - exact.force).values) / sizes
        stated = ds.stated_error.values
        yield {
            "scene": name,
            "number": number,
            "rows": error.size,
            "worst": float(error.max() / tolerance),
            "beyond": int((error > tolerance).sum()),
            "silent": int((error > 1.5 * np.maximum(stated, tolerance)).sum()),
            "convolutions": cost(ds),
            "seconds": took,
        }


def costs(count=64, tolerance=1e-3):
    """Convolutions at Tabor 1 over those of the same scene without adhesion, 17 rows."""
    sticky = attraction(1.0)
    side, depth = cell(sticky, 0.4), scales(sticky)[1]
    zener = rv.zener(0.5 * MODULUS, 0.5 * MODULUS, 0.5 * MODULUS)
    cases = {"ball, free": (rv.sphere(RADIUS, count * side, count), "free", 2 * depth, 0.0)}
    for times in (1, 3, 6):
        cases[f"rough, rms height {times} ranges, periodic"] = (
            rough(count, side, times * RANGE, 3), "periodic", min(2 * times, 3) * RANGE, max(times - 2, 1) * RANGE,
        )  # fmt: skip
    for name, (surface, boundary, top, low) in cases.items():
        program = rv.Program().approach(top, over=1).approach(low, over=1)
        for body, words in ((ELASTIC, "elastic"), (zener, "Zener")):
            numbers = [
                cost(run(surface, body, program, one, boundary=boundary, times=17, tolerance=tolerance))
                for one in (None, sticky)
            ]
            yield {
                "scene": f"{name}, {words}",
                "without": numbers[0],
                "with": numbers[1],
                "ratio": numbers[1] / numbers[0],
            }


PARTS = {
    "balls": balls,
    "speeds": speeds,
    "tamaas": tamaas,
    "contact_mechanics": contact_mechanics,
    "scenes": scenes,
    "cost": costs,
}


def main(parts=tuple(PARTS), **options):
    """Print the tables and return their rows by part."""
    warnings.simplefilter("ignore")
    logging.getLogger("roughvisc").setLevel(logging.ERROR)
    tables = {}
    for part in parts:
        tables[part] = []
        for row in PARTS[part](**options.get(part, {})):
            tables[part].append(row)
            print(
                part,
                "  ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()),
                flush=True,
            )
        if part == "scenes":
            good = [row for row in tables[part] if "rows" in row]
            rows, beyond, silent = (sum(row[name] for row in good) for name in ("rows", "beyond", "silent"))
            print(f"{len(good)} scenes, {rows} rows: {1 - beyond / rows:.2%} within, {silent / rows:.2%} silent")
    return tables


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", default=list(PARTS))
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    main(given.parts, scenes={"count": given.count, "seed": given.seed})
