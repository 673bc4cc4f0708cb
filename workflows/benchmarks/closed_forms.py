"""Rates of rows that state too little error, on random scenes with closed forms or sharp references.

    python workflows/benchmarks/closed_forms.py [KIND ...] [--scenes N] [--seed S] [--worst N]

A row is one number of a result with its true and its stated error. Kinds:

- ``friction``: pressure and friction of waves that slide in full contact, on half-spaces, sheets and layers; closed
  form.
- ``channels``: leak rate of channels in series and in parallel, over up to five decades of the gap; closed form.
- ``grid``: error of the grid of line contacts, at rest (Westergaard, finest grid of 1,536 cells) and sliding (16 times
  the cells).
- ``area``: contact area and approach of balls, cones and crossed waves, compared with a tolerance 100 times tighter.

The seed is the date unless given, so that each day draws other scenes. Prints by kind the number of rows; those without
a stated error; those beyond the tolerance; those that are bad: beyond 1.5 tolerances and 1.5 times the stated error;
the median of stated over true error; and the convolutions. The tolerance of ``grid`` is the noise of its references.
100 scenes of a kind take half a minute on one core, those of ``channels`` a second.
"""

import argparse
import datetime
import logging
import math
import time
import warnings
from typing import NamedTuple

import numpy as np
from scipy.special import gamma

import roughvisc as rv
from roughvisc.mechanics.layer import effective_compliance
from roughvisc.mechanics.transport import flow

#: A row is bad if its error exceeds both the tolerance and the stated error by this factor.
BAD = 1.5
#: Errors below this fraction of the tolerance count as this fraction in the ratio of stated over true error.
SMALL = 1e-3


class Row(NamedTuple):
    """One number of a result: relative errors, tolerance, and the convolutions that no other row counts."""

    true: float
    stated: float
    tolerance: float
    convolutions: int
    scene: str = ""


def scale(rng, low, high):
    """Return a number that is uniform in its decimal logarithm."""
    return float(10 ** rng.uniform(low, high))


def run_quietly(scene, solve, *arguments, **options):
    """Return the result of a run, or None after a printed refusal."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return solve(*arguments, progress=False, **options)
    except rv.RoughviscError as error:
        print(f"{scene}: {type(error).__name__}: {str(error)[:110]}", flush=True)
        return None


def convolutions(ds):
    """Return the number of convolutions of a run over time."""
    return int(ds.roughvisc.steps.convolutions.sum())


# ------------------------------------------------------------------------------------------------------------ friction


def sliding_material(rng, poisson):
    """Return a material with instantaneous compliance, and its shear compliance at complex rates. [1/Pa]"""
    if rng.random() < 0.5:
        count = int(rng.integers(1, 5))
        glassy, terms = 1e-6 * scale(rng, -1.5, 0.5), np.array([1e-6 * scale(rng, -3, 1) for _ in range(count)])
        times = np.array([scale(rng, -4, 4) for _ in range(count)])
        series = rv.Prony(glassy, 0.0, tuple(terms), tuple(times), poisson)
        return series, lambda s: glassy + (terms / (1 + np.asarray(s)[..., None] * times)).sum(-1)
    glassy, coefficient, exponent = 1e-6 * scale(rng, -1, 1), 1e-6 * scale(rng, -4, 0), float(rng.uniform(0.1, 0.9))
    law = rv.power_law(glassy, coefficient, exponent, 1.0, poisson)
    return law, lambda s: glassy + coefficient * gamma(1 + exponent) * np.asarray(s) ** -exponent


def sheet_over_half_space(x, poisson, base):
    """Return the displacement of a sheet over that of a half-space, for wave number times thickness (Johnson 5.8)."""
    x = np.minimum(x, 300)
    if base == "slipping":
        return (np.cosh(2 * x) - 1) / (np.sinh(2 * x) + 2 * x)
    k = 3 - 4 * poisson
    return (k * np.sinh(2 * x) - 2 * x) / (k * np.cosh(2 * x) + 2 * x**2 + 5 - 12 * poisson + 8 * poisson**2)


def scenes_of_friction(rng, count):
    """Yield rows of pressure (L1) and friction of random waves in full contact, at nine speeds over eight decades."""
    for number, draw in enumerate(rng.spawn(count)):
        poisson = float(draw.choice([0.5, 0.3]))
        material, law = sliding_material(draw, poisson)
        cells, side = int(draw.integers(6, 25)), 1e-3
        height = draw.standard_normal((cells, 1)) * 1e-6 * np.ones((1, 2))
        kind, base = str(draw.choice(["half-space", "sheet", "layer"])), str(draw.choice(["bonded", "slipping"]))
        thickness = side / (2 * math.pi) * scale(draw, -2, 1)
        below, law_below = sliding_material(draw, 0.5)
        tolerance = float(draw.choice([1e-2, 1e-3, 1e-4]))
        beyond = 1.1 if draw.random() < 0.5 else 1.1 * scale(draw, 0, 3.5)
        speeds = np.geomspace(1e-4, 1e4, 9) * side / (2 * math.pi)
        waves = np.fft.fft(height[:, 0])
        qx = 2 * math.pi * np.fft.fftfreq(cells, side / cells)
        q = np.where(qx == 0, 1.0, np.abs(qx))
        body = material
        if kind == "sheet":
            body = rv.sheet(material, thickness, base)
        elif kind == "layer":
            body = rv.layer(material, thickness, on=below)
        exact = []
        for speed in speeds:
            rate = 1j * np.where(qx == 0, 1e-30, -qx * speed)
            if kind == "layer":
                compliance = effective_compliance(q, (thickness,), (poisson, 0.5), [law(rate), law_below(rate)])
            else:
                compliance = (1 - poisson) / 2 * law(rate)
                if kind == "sheet":
                    compliance = compliance * sheet_over_half_space(q * thickness, poisson, base)
            pressed = np.where(qx == 0, 0, waves * q / 2 / compliance)
            if cells % 2 == 0:  # the sine of the shortest wave vanishes at the centres of the cells
                half = cells // 2
                pressed[half] = waves[half] * q[half] / 2 / compliance[half].real
            seen = np.abs(np.fft.fftfreq(cells)) < 0.4999
            force = abs((np.conj(pressed) * 1j * qx * waves)[seen].sum().real) / cells**2
            exact.append((np.fft.ifft(pressed).real, force))
        mean = beyond * max(-float(pressure.min()) for pressure, _ in exact)
        scene = f"friction {number} {kind} pressure {beyond:.3g} tolerance {tolerance:g}"
        surface = rv.from_array(height, side / cells)
        options = {"speeds": speeds, "pressure": mean, "tolerance": tolerance, "fields": ("pressure",)}
        ds = run_quietly(scene, rv.friction, surface, body, **options)
        for row, (pressure, force) in enumerate(exact if ds is not None else []):
            stated, where = float(ds.stated_error[row]), f"{scene} speed {row}"
            off = np.abs(ds.pressure.values[row, :, 0] - pressure - mean).mean() / mean
            yield Row(float(off), stated, tolerance, int(ds.convolutions[row]), f"{where} pressure")
            off = abs(float(ds.friction_coefficient[row]) * mean / force - 1)
            yield Row(off, stated, tolerance, 0, f"{where} friction")


# ------------------------------------------------------------------------------------------------------------ channels


def scenes_of_channels(rng, count):
    """Yield rows of the leak rate of gaps that change along the flow, across it, or in separate channels."""
    for number, draw in enumerate(rng.spawn(count)):
        nx, ny = int(draw.integers(2, 90)), int(draw.integers(1, 90))
        dx, decades = scale(draw, -7, -4), draw.uniform(0, 6)
        dy = dx * scale(draw, -1.5, 1.5)
        kind, wrap = str(draw.choice(["series", "parallel", "separate", "closed"])), bool(draw.random() < 0.5)
        along = 1e-6 * 10 ** (decades * draw.uniform(-1, 0, nx))
        across = 1e-6 * 10 ** (decades * draw.uniform(-1, 0, ny))
        if kind == "parallel":
            gap, exact = np.repeat(across[None], nx, axis=0), float((across**3).sum()) * dy / (12 * nx * dx)
        elif kind == "separate":  # channels of one column between walls
            gap, exact = np.zeros((nx, ny)), 0.0
            for column in range(0, ny, 2):
                gap[:, column] = 1e-6 * 10 ** (decades * draw.uniform(-1, 0, nx))
                exact += dy / dx / float((12 / gap[:, column] ** 3).sum())
            wrap = wrap and ny % 2 == 0
        else:
            gap, exact = np.repeat(along[:, None], ny, axis=1), ny * dy / dx / float((12 / along**3).sum())
            if kind == "closed":
                gap[int(draw.integers(nx))], exact = 0.0, 0.0
        found = flow(gap, (dx, dy), wrap=wrap)
        size = exact or 1e-300
        scene = f"channels {number} {kind} {nx} x {ny} dy/dx {dy / dx:.3g} decades {decades:.2g}"
        yield Row(abs(found.conductance - exact) / size, found.error / size, 1e-9, 0, scene)


# ---------------------------------------------------------------------------------------------------------------- grid


def line(profile, cells):
    """Return a surface of period one that is uniform along y, from a function of x."""
    x = (np.arange(cells) + 0.5) / cells
    return rv.from_array(profile(x)[:, None] * np.ones((1, 2)), (1 / cells, 1 / cells))


def scenes_of_grid(rng, count):
    """Yield rows of the error of the grid, of line contacts at rest and sliding in turn."""
    for number, draw in enumerate(rng.spawn(count)):
        yield from (_sliding if number % 2 else _resting)(draw, f"grid {number}")


def _resting(draw, scene):
    """Yield the errors of the grid of a wave at rest, from the smallest contact to beyond full contact."""
    cells, waves, amplitude = int(draw.integers(12, 80)), int(draw.choice([1, 1, 2, 3])), 1e-3
    part = scale(draw, -3, 0) if draw.random() < 0.5 else float(1 - scale(draw, -4, -0.3))
    if draw.random() < 0.15:
        part = float(draw.uniform(1, 2))
    phase, elastic = float(draw.random()), rv.elastic(0.25)

    def profile(x):
        return amplitude * np.cos(2 * math.pi * waves * (x - phase))

    def solve(count, **options):
        program = rv.Program().load(part * math.pi * amplitude * waves * 2 / count, over=0.0)
        options |= {"boundary": "periodic", "tolerance": 1e-5, "fields": ("pressure",)}
        return run_quietly(scene, rv.simulate, line(profile, count), elastic, program, **options)

    scene = f"{scene} at rest {cells} cells {waves} waves p/p* {part:.5g} phase {phase:.3g}"
    ds, fine = solve(cells, grid_error=True), solve(1536)
    if ds is None or fine is None:
        return
    area = rv.closed_forms.westergaard(amplitude, 1 / waves, 1.0, part * math.pi * amplitude * waves).contact_fraction
    exact = {"area": area * 2 / cells, "approach": float(fine.approach[0]), "gap": float(fine.mean_gap[0])}
    names = {"area": "contact_area", "approach": "approach", "gap": "mean_gap"}
    for quantity, name in names.items():
        value, stated = float(ds[name][0]), float(ds[f"grid_error_{quantity}"][0])
        size = max(abs(value), 1e-3 * amplitude if quantity == "gap" else 1e-12)
        yield Row(abs(value - exact[quantity]) / size, stated, 2e-5, 0, f"{scene} {quantity}")


def _sliding(draw, scene):
    """Yield the errors of the grid of a sliding wave, two waves or a parabola, at five speeds."""
    cells, phase, part = int(draw.integers(12, 100)), float(draw.random()), float(draw.uniform(0.1, 0.6))
    kind, second, terms = str(draw.choice(["wave", "two", "parabola"])), float(draw.random()), int(draw.integers(1, 4))
    compliances, times = (
        tuple(1e-6 * scale(draw, -1, 1) for _ in range(terms)),
        (scale(draw, -2, 2) for _ in [0] * terms),
    )
    rubber = rv.Prony(1e-6 * scale(draw, -1.5, 0.3), 0.0, compliances, tuple(times))
    pressure = math.pi * 1e-6 / float(rubber.contact_compliance(math.inf)) * scale(draw, -2, 0.3)
    speeds = np.geomspace(1e-4, 1e4, 5) * float(draw.uniform(0.5, 2)) / (2 * math.pi)

    def profile(x):
        x = (x - phase) % 1
        if kind == "parabola":
            return -((x - 0.5) ** 2) * 4e-6
        return 1e-6 * np.cos(2 * math.pi * x) + (kind == "two") * part * 1e-6 * np.cos(6 * math.pi * (x - second))

    def solve(count, **options):
        options |= {"speeds": speeds, "pressure": pressure, "tolerance": 1e-4}
        return run_quietly(scene, rv.friction, line(profile, count), rubber, **options)

    scene = f"{scene} sliding {kind} {cells} cells"
    ds, fine = solve(cells, grid_error=True), solve(16 * cells, grid_error=False)
    if ds is None or fine is None:
        return
    names = {"friction": "friction_coefficient", "area": "contact_fraction", "approach": "approach", "gap": "mean_gap"}
    for row in range(len(speeds)):
        for quantity, name in names.items():
            value, exact = float(ds[name][row]), float(fine[name][row])
            off, stated = abs(value - exact) / max(abs(value), 1e-300), float(ds[f"grid_error_{quantity}"][row])
            used = int(ds.convolutions[row]) * (quantity == "friction")
            yield Row(off, stated, 2e-4, used, f"{scene} speed {row} {quantity}")


# ---------------------------------------------------------------------------------------------------------------- area


def scenes_of_area(rng, count):
    """Yield rows of contact area and approach: loaded, held and unloaded, at a tolerance and at a hundredth of it."""
    for number, draw in enumerate(rng.spawn(count)):
        cells, kind = int(draw.integers(12, 40)), str(draw.choice(["ball", "cone", "crossed waves"]))
        boundary = "periodic" if kind == "crossed waves" else "free"
        surface = {
            "ball": rv.sphere(1e-2, 1e-3, cells),
            "cone": rv.cone(0.02, 1e-3, cells),
            "crossed waves": rv.wavy(2e-6, 1e-3, (1e-3, 1e-3), (cells, cells)),
        }[kind]
        if draw.random() < 0.4:
            material = rv.elastic(0.25e6)
        else:
            material = rv.zener(3e6, scale(draw, 5, 7), scale(draw, 4, 6))
        compliance, radius = float(material.contact_compliance(1.0)), 3e-4 * draw.uniform(0.2, 1)
        load = {
            "ball": 4 / 3 * radius**3 / 1e-2 / compliance,
            "cone": math.pi / 2 * 0.02 * radius**2 / compliance,
            "crossed waves": 1e-6 * math.sqrt(2) * math.pi * 2e-3 / compliance * draw.uniform(0.01, 1.1),
        }[kind]
        program = rv.Program().load(load, over=float(draw.choice([0, 0.1]))).hold(0.5)
        program = program.load(load * draw.uniform(0.1, 1), over=0.3)
        tolerance, times = float(draw.choice([1e-2, 1e-3])), [0.2, 0.5, 0.7, program.duration]
        options = {"boundary": boundary, "times": times, "fields": (), "grid_error": False}
        options["edge"] = "accept" if boundary == "free" else "error"
        scene = f"area {number} {kind} {cells} cells tolerance {tolerance:g}"
        pair = [
            run_quietly(scene, rv.simulate, surface, material, program, tolerance=limit, **options)
            for limit in (tolerance, tolerance / 100)
        ]
        if any(ds is None for ds in pair):
            continue
        ds, sharp = pair
        for name in ("contact_area", "approach"):
            largest = float(sharp[name].max())
            off = np.abs(ds[name].values - sharp[name].values) / largest
            stated = (ds[f"{name}_error"].values + sharp[f"{name}_error"].values) / largest
            for row in range(off.size):
                used = convolutions(ds) * (row == 0 and name == "approach")
                yield Row(float(off[row]), float(stated[row]), tolerance, used, f"{scene} row {row} {name}")


# --------------------------------------------------------------------------------------------------------------- rates

KINDS = {
    "friction": scenes_of_friction,
    "channels": scenes_of_channels,
    "grid": scenes_of_grid,
    "area": scenes_of_area,
}


def is_bad(row):
    """Return whether a row is beyond its tolerance and beyond its stated error; without a statement it is not."""
    return row.true > BAD * row.tolerance and row.true > BAD * row.stated


def rates(rows):
    """Return the rates of rows of one kind, by name."""
    floor = [SMALL * row.tolerance for row in rows]
    ratios = [max(row.stated, least) / max(row.true, least) for row, least in zip(rows, floor, strict=True)]
    ratios = [ratio for ratio in ratios if math.isfinite(ratio)]
    return {
        "rows": len(rows),
        "not stated": sum(math.isnan(row.stated) for row in rows),
        "beyond": sum(row.true > row.tolerance for row in rows),
        "bad": sum(map(is_bad, rows)),
        "stated/true": float(np.median(ratios)) if ratios else math.nan,
        "convolutions": sum(row.convolutions for row in rows),
    }


def main(kinds=(), scenes=100, seed=None, worst=5):
    """Print the rates of some kinds, all of them by default, and their worst rows; return the rates by kind."""
    logging.getLogger("roughvisc").setLevel(logging.ERROR)
    seed = int(f"{datetime.date.today():%Y%m%d}") if seed is None else seed
    found = {}
    print(f"{scenes} scenes of each kind, seed {seed}")
    for kind in kinds or KINDS:
        began = time.perf_counter()
        rows = [Row(*row) for row in KINDS[kind](np.random.default_rng([seed, *kind.encode()]), scenes)]
        found[kind] = rates(rows)
        text = ", ".join(f"{name} {value:.3g}" if isinstance(value, float) else f"{name} {value}"
                         for name, value in found[kind].items())  # fmt: skip
        print(f"{kind}: {text}, {time.perf_counter() - began:.0f} s", flush=True)
        for row in sorted(filter(is_bad, rows), key=lambda row: row.true / max(row.stated, 1e-300))[::-1][:worst]:
            print(f"    true {row.true:.1e} stated {row.stated:.1e}: {row.scene}", flush=True)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--seed", type=int, help="the date by default")
    parser.add_argument("--worst", type=int, default=5, help="number of bad rows to print")
    given = parser.parse_args()
    for kind in given.kinds:
        if kind not in KINDS:
            parser.error(f"found {kind!r}: expected some of {', '.join(KINDS)}")
    main(given.kinds, given.scenes, given.seed, given.worst)
