"""Check that the results of random small cases satisfy the contact conditions.

    python workflows/benchmarks/random_cases.py [COUNT] [SEED]

Prints each violation with the number of its case, and exits with status 1 if there is any. COUNT is 2000 and SEED 1
unless given. Of 2000 cases (seed 1, 65 s on one core) none was in violation.
"""

import sys

import numpy as np
import xarray as xr

import roughvisc as rv
from roughvisc.variables import VARIABLES

TOLERANCE = 1e-2


def material(rng):
    """Moduli over four decades, times over six."""
    modulus, kelvin = 10 ** rng.uniform(-2, 2, 2)
    time = 10 ** rng.uniform(-3, 3)
    poisson = rng.uniform(0, 0.5)
    count = rng.integers(1, 6)
    return [
        lambda: rv.elastic(modulus, poisson),
        lambda: rv.maxwell(modulus, modulus * time, poisson),
        lambda: rv.kelvin_voigt(modulus, modulus * time, poisson),
        lambda: rv.zener(modulus, kelvin, kelvin * time, poisson),
        lambda: rv.Prony(rng.choice([0, 1 / modulus]), 0.0, tuple(10 ** rng.uniform(-2, 2, count)),
                         tuple(10 ** rng.uniform(-3, 3, count)), poisson),
        lambda: rv.power_law(rng.choice([0, 1 / modulus]), 1 / kelvin, rng.uniform(0.1, 0.9), time, poisson),
    ][rng.integers(6)]()  # fmt: skip


def surface(rng):
    """Odd and even, long and short grids of one metre or less."""
    shape = tuple(int(n) for n in rng.integers(3, 20, 2))
    kind = rng.integers(6)
    if kind == 0:
        return rv.sphere(2.0, 1.0, shape)
    if kind == 1:
        return rv.cone(0.2, 1.0, shape)
    if kind == 2:
        return rv.wavy(0.02, 1.0, 1.0, shape)
    if kind == 3:
        return rv.self_affine(1.0, shape, hurst=rng.uniform(0.2, 1), rms_slope=10 ** rng.uniform(-3, 0), seed=rng)
    heights = np.zeros(shape)
    if kind == 4:  # spikes of one height, or of many
        spikes = rng.random(shape) < 0.1
        heights[spikes] = 0.1 if rng.random() < 0.5 else rng.uniform(0, 0.1, np.count_nonzero(spikes))
    sides = 1 / np.array(shape) * 4 ** rng.uniform(-1, 0, 2)
    found = rv.from_array(heights, tuple(sides))
    return found.where(rng.random(shape) > 0.2) if rng.random() < 0.3 else found


def program(rng, load, deepest, can_jump):
    """Ramps, jumps and holds, up and down to zero; all of load, all of approach, or load first and then approach."""
    chain, approach = rv.Program(), rng.random() < 0.4
    for number in range(rng.integers(1, 6)):
        over = float(rng.choice([0.0, 10 ** rng.uniform(-2, 1)], p=[0.3, 0.7]))
        value = float(rng.choice([0, rng.uniform(0, 1)], p=[0.2, 0.8]))
        if number and rng.random() < 0.35:
            hold_approach = approach or (can_jump and rng.random() < 0.3)
            chain = chain.hold(10 ** rng.uniform(-2, 1), control="approach" if hold_approach else "load")
            approach = hold_approach
        elif approach:
            chain = chain.approach((1.2 * value - 0.2) * deepest, over=over if can_jump else max(over, 0.01))
        else:
            chain = chain.load(value * load, over=over)
    return chain if chain.duration else chain.hold(1.0)


def case(seed, number):
    """Surface, material, program and settings of one case."""
    rng = np.random.default_rng([seed, number])
    body, height = material(rng), surface(rng)
    boundary = str(rng.choice(["free", "periodic"]))
    gap = float(height.max()) - height
    deepest = 0.9 * float(gap.mean()) if boundary == "periodic" else 0.1
    load = 10 ** rng.uniform(-6, 0) * 0.1 / float(body.contact_compliance(1.0))
    chain = program(rng, load, deepest, float(body.contact_compliance(0.0)) > 0) if deepest else rv.Program().load(
        load, over=0.1)  # fmt: skip
    settings = {"boundary": boundary, "edge": "accept", "missing": "absent", "times": 5, "tolerance": TOLERANCE}
    return height, body, chain, settings


#: Variables that are declared as missing in some rows, such as the mean pressure without contact, with their errors.
_MAY_BE_MISSING = {
    name
    for quantity, variable in VARIABLES.items()
    if variable.missing
    for name in (quantity, variable.error, variable.grid_error)
}


def violations(ds):
    """Return the violations of a result."""
    present = np.isfinite(ds.height.values)
    pressure, force = ds.pressure.values, ds.force.values
    area = float(np.prod([float(ds[axis][1] - ds[axis][0]) for axis in ("x", "y")]))
    found = [
        f"{name} is not finite"
        for name in set(ds.variables) - {"gap", "height"} - _MAY_BE_MISSING
        if not np.isfinite(ds[name].values).all()
    ]
    if not np.isfinite(ds.gap.values[:, present]).all():
        found.append("gap is not finite")
    if (pressure < 0).any() or (pressure[:, ~present] != 0).any():
        found.append("tension, or pressure where nothing is")
    opening = ds.height.highest - ds.height.values + ds.displacement.values
    opening -= ds.approach.values[:, None, None]
    scale = np.abs(ds.displacement.values[:, present]).max() + np.ptp(ds.height.values[present])
    if np.ptp(ds.height.values[present]) == 0 and ds.boundary == "periodic":
        scale = 1.0  # nothing moves but by rounding
    # the tolerance is relative to the energy; for the gap of a single cell it is about the square root
    allowed = np.sqrt(TOLERANCE) * scale
    deepest = -np.min(opening[:, present])
    if deepest > allowed:
        found.append(f"penetration of {deepest / scale:.1e}")
    touching = np.where(pressure > 0, np.abs(opening), 0) * pressure
    work = touching[:, present].sum(1) * area
    if (work > TOLERANCE * scale * np.maximum(force, 1e-300)).any():
        found.append(f"pressure across a gap: {np.max(work / np.maximum(force, 1e-300)) / scale:.1e}")
    if np.any(np.abs(pressure.sum((1, 2)) * area - force) > 1e-9 * force):
        found.append("force is not balanced")
    if (ds.work.values < -TOLERANCE * scale * force.max() - 1e-15).any():  # joule: rounding, once it is open again
        found.append(f"work from rest: {ds.work.values.min():.1e} J under {force.max():.1e} N")
    return found


def main(count=2000, seed=1):
    wrong = 0
    for number in range(int(count)):
        height, body, chain, settings = case(int(seed), number)
        try:
            with np.errstate(all="raise", under="ignore"):
                ds = rv.simulate(height, body, chain, fields=("pressure", "gap", "displacement"), progress=False,
                                 **settings)  # fmt: skip
            problems = violations(ds)
        except (rv.RoughviscError, ArithmeticError) as error:
            problems = [f"{type(error).__name__}: {error}"]
        wrong += bool(problems)
        if problems:
            print(f"case {number}: {'; '.join(problems)}", flush=True)
    print(f"{int(count)} cases of seed {int(seed)}, {wrong} with violations")
    return wrong


if __name__ == "__main__":
    xr.set_options(keep_attrs=True)
    sys.exit(1 if main(*sys.argv[1:]) else 0)
