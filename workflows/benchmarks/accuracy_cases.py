"""The random cases of ``accuracy.py``: each a function of a seed and a number alone, so that any can be rerun alone.

Families of material, program, surface and kept times are drawn uniformly and independently, then their parameters.
Nothing of the solver is used to draw them. Lengths are about one metre, programs last seconds.
"""

from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from scipy.special import erfinv

import roughvisc as rv

#: Largest number of cells a side for each tolerance, and how often it is drawn: the sharper, the dearer.
TOLERANCES = {1e-2: (33, 0.45), 1e-3: (25, 0.4), 1e-4: (15, 0.15)}
KEPT = ("8 even", "40 even", "20 logarithmic", "200 even", "every step")


@dataclass(frozen=True)
class Case:
    """Surface, material, program and kept times."""

    number: int
    height: xr.DataArray
    material: object
    program: rv.Program
    times: list | None
    settings: dict
    families: dict = field(default_factory=dict)

    @property
    def soft(self):
        """Return whether the instantaneous compliance is so small that the pressure jumps in entering cells."""
        at_once, final = self.material.contact_compliance(np.array([0.0, self.program.duration]))
        return bool(at_once < 0.1 * final)


def case(seed, number):
    """Case of this seed and number."""
    rng = np.random.default_rng([seed, number])
    limits, shares = zip(*TOLERANCES.values(), strict=True)
    drawn = rng.choice(len(TOLERANCES), p=shares)
    tolerance, shape = tuple(TOLERANCES)[drawn], tuple(int(n) for n in rng.integers(9, limits[drawn] + 1, 2))
    families = {
        "material": str(rng.choice(list(MATERIALS))),
        "program": str(rng.choice(list(PROGRAMS))),
        "surface": str(rng.choice(list(SURFACES))),
        "kept": str(rng.choice(KEPT)),
    }
    height, boundary, scaled_load, deepest = SURFACES[families["surface"]](rng, shape)
    if rng.random() < 0.2:
        families["surface"] += ", absent cells"
        height = height.where(rng.random(shape) > rng.choice([0.05, 0.3]))
    if boundary == "periodic":  # below full contact, also where cells are absent
        deepest = min(deepest, 0.9 * float((height.max() - height).mean()))
    modulus, span = 10 ** rng.uniform(0, 9), 4.0
    material = MATERIALS[families["material"]](rng, 1 / modulus, span)
    can_jump = float(material.contact_compliance(0.0)) > 0
    load = scaled_load / float(material.contact_compliance(span))
    program = PROGRAMS[families["program"]](rng, load, deepest, can_jump)
    end = program.duration
    times = {"every step": None, "20 logarithmic": np.geomspace(1e-4 * end, end, 20).tolist()}
    times |= {f"{count} even": np.linspace(0, end, count).tolist() for count in (8, 40, 200)}
    kept = times[families["kept"]]
    settings = {"boundary": boundary, "tolerance": tolerance, "edge": "accept", "missing": "absent"}
    return Case(number, height, material, program, kept, settings, families)


# ----------------------------------------------------------------------------------------------------------------
# materials: of a compliance of about ``unit`` [1/Pa], for programs of about ``span`` [s]


def _solid_or_fluid(rng, unit, span, index, poisson):
    """One of the four of springs and dashpots."""
    time, ratio = span * 10 ** rng.uniform(-2, 2), 10 ** rng.uniform(-2, 2)
    return [
        lambda: rv.elastic(1 / unit, poisson),
        lambda: rv.maxwell(1 / unit, time / unit, poisson),
        lambda: rv.kelvin_voigt(1 / unit, time / unit, poisson),
        lambda: rv.zener(1 / unit, ratio / unit, ratio * time / unit, poisson),
    ][index]()


def _named(index):
    return lambda rng, unit, span: _solid_or_fluid(rng, unit, span, index, poisson=rng.uniform(0, 0.5))


def _burgers(rng, unit, span):
    count = rng.integers(1, 3)
    compliances, times = unit * 10 ** rng.uniform(-1, 1, count), span * 10 ** rng.uniform(-2, 1, count)
    fluidity = unit / (span * 10 ** rng.uniform(-1, 2))
    return rv.Prony(unit, fluidity, tuple(compliances), tuple(times), rng.uniform(0, 0.5))


def _prony(rng, unit, span):
    """Draw times over up to eight decades, in some cases all much shorter than the program."""
    count = rng.integers(1, 7)
    slowest = 1e-8 if rng.random() < 0.15 else 10 ** rng.uniform(-2, 2)
    times = span * slowest * 10 ** (-rng.uniform(0, 8) * rng.random(count))
    glassy = unit * (0.0 if rng.random() < 0.1 else 10 ** rng.uniform(-2, 0.5))
    return rv.Prony(glassy, 0.0, tuple(unit * 10 ** rng.uniform(-1, 1, count)), tuple(times), rng.uniform(0, 0.5))


def _power_law(pure):
    def drawn(rng, unit, span):
        glassy = 0.0 if pure else unit * 10 ** rng.uniform(-3, 0)
        return rv.power_law(glassy, unit, rng.uniform(0.1, 0.9), span * 10 ** rng.uniform(-1, 1), rng.uniform(0, 0.5))

    return drawn


def _table(rng, unit, span):
    """Rows of a power law or of a relaxing solid, noisy, with a row at time zero or without."""
    times = span * np.geomspace(10 ** rng.uniform(-6, -2), 3.0, rng.integers(20, 61))
    exponent, ratio, time = rng.uniform(0.1, 0.9), 10 ** rng.uniform(-1, 1.5), span * 10 ** rng.uniform(-2, 0.5)
    values = 0.3 + (times / span) ** exponent if rng.random() < 0.5 else 1 - ratio * np.expm1(-times / time)
    values *= unit * (1 + rng.uniform(0, 0.03) * np.clip(rng.standard_normal(times.size), -3, 3))
    if rng.random() < 0.5:
        times, values = np.append(0.0, times), np.append(rng.uniform(0.5, 1) * values.min(), values)
    return rv.creep_table(tuple(times), tuple(values), noise=0.25, poisson=rng.uniform(0, 0.5), kind="shear")


def _bulk(rng, unit, span):
    """A Maxwell fluid, or a solid of a few terms, in shear."""
    count = rng.integers(1, 4)
    moduli, times = 10 ** rng.uniform(-1, 1, count) / unit, span * 10 ** rng.uniform(-2, 2, count)
    equilibrium = rng.integers(2) * 10 ** rng.uniform(-1, 1) / unit
    bulk_modulus = 10 ** rng.uniform(-0.5, 3) / unit
    return rv.from_relaxation(equilibrium, moduli.tolist(), times.tolist(), bulk_modulus=bulk_modulus)


def _pair(rng, unit, span):
    bodies = [name for name in MATERIALS if name != "pair"]
    return rv.pair(*(MATERIALS[str(rng.choice(bodies))](rng, unit * 10 ** rng.uniform(-1, 0), span) for _ in "ab"))


MATERIALS = {
    "elastic": _named(0),
    "Maxwell": _named(1),
    "Kelvin-Voigt": _named(2),
    "Zener": _named(3),
    "Burgers": _burgers,
    "Prony": _prony,
    "power law, glassy": _power_law(False),
    "power law, pure": _power_law(True),
    "table": _table,
    "elastic bulk": _bulk,
    "pair": _pair,
}

# ----------------------------------------------------------------------------------------------------------------
# programs: up to ``load`` [N] or ``deepest`` [m]


def _over(rng):
    return 10 ** rng.uniform(-1.5, 0.3)


def _step_hold(rng, load, deepest, can_jump):
    return rv.Program().load(load, over=0).hold(4.0)


def _ramp_hold(rng, load, deepest, can_jump):
    if rng.random() < 0.5:
        return rv.Program().load(load, over=_over(rng)).hold(2.0)
    return rv.Program().approach(deepest, over=_over(rng)).hold(2.0)


def _triangle(rng, load, deepest, can_jump):
    left = rng.choice([0.0, rng.uniform(0, 0.5)])
    if rng.random() < 0.5:
        return rv.Program().load(load, over=2.0).load(left * load, over=2.0)
    return rv.Program().approach(deepest, over=2.0).approach(left * deepest, over=2.0)


def _triangle_hold_reload(rng, load, deepest, can_jump):
    again = load * rng.uniform(0.5, 1)
    return rv.Program().load(load, over=1.0).load(0.0, over=1.0).hold(_over(rng)).load(again, over=1.0)


def _recovery(rng, load, deepest, can_jump):
    up, down = (float(rng.choice([0.0, 0.1, 0.5])) for _ in "ab")
    return rv.Program().load(load, over=up).hold(1.0).load(0.0, over=down).hold(_over(rng)).load(load, over=up or 0.2)


def _cycles(rng, control, top, lowest, highest):
    """A sine wave about a part of ``top``, between ``lowest`` and ``highest`` of its peak, reached by a ramp."""
    mean = top * rng.uniform(lowest, highest)
    period = 4.0 / (cycles := int(rng.integers(1, 21)))
    start = getattr(rv.Program(), control)(mean, over=0.3)
    return start + rv.Program.cycle(mean, top - mean, period, cycles, control)


def _relaxation(rng, load, deepest, can_jump):
    return rv.Program().load(load, over=0 if can_jump and rng.random() < 0.5 else _over(rng)).hold(3.0, "approach")


def _mixed(rng, load, deepest, can_jump):
    chain = rv.Program().load(load * rng.uniform(0.2, 1), over=_over(rng))
    for _ in range(rng.integers(2, 5)):
        kind = rng.integers(4)
        if kind == 0:
            chain = chain.load(load * rng.uniform(0, 1), over=_over(rng))
        elif kind == 1:
            chain = chain.approach(deepest * rng.uniform(-0.2, 1), over=_over(rng))
        else:
            chain = chain.hold(_over(rng), "load" if kind == 2 else "approach")
    return chain


def _table_of_200(rng, load, deepest, can_jump):
    """A smooth random signal, 200 segments."""
    t = np.linspace(0, 4.0, 201)
    waves = (rng.normal() * np.sin(2 * np.pi * (k * t / 8.0 + rng.random())) / k for k in range(1, 9))
    signal = sum(waves) * (1 - np.exp(-3 * t))
    low, high = (signal.min(), signal.max()) if rng.random() < 0.5 else (signal[0], np.abs(signal).max())
    values = np.maximum((signal - low) / (high - low) if high > low else t / t[-1], 0) * np.minimum(1, 2 * t)
    top = values.max() or 1.0
    if rng.random() < 0.5:
        return rv.Program.table(t, load * values / top)
    return rv.Program.table(t, deepest * (1.2 * values / top - 0.2 * np.minimum(1, 2 * t)), "approach")


def _jumps(rng, load, deepest, can_jump):
    chain, approach = rv.Program(), can_jump and rng.random() < 0.5
    for _ in range(rng.integers(2, 7)):
        level = float(rng.choice([0.0, rng.uniform(0, 1)], p=[0.15, 0.85]))
        chain = chain.approach(level * deepest, over=0) if approach else chain.load(level * load, over=0)
        chain = chain.hold(_over(rng))
    return chain


def _fast_and_slow(rng, load, deepest, can_jump):
    """A slow ramp after a fast one, durations over four decades."""
    fast, part = 4 * 10 ** rng.uniform(-4, -1), rng.uniform(0.1, 0.9)
    if rng.random() < 0.5:
        return rv.Program().load(part * load, over=fast).load(load, over=4.0)
    return rv.Program().approach(part * deepest, over=fast).approach(deepest, over=4.0)


PROGRAMS = {
    "step, hold": _step_hold,
    "ramp, hold": _ramp_hold,
    "triangle": _triangle,
    "triangle, hold, reload": _triangle_hold_reload,
    "recovery": _recovery,
    "cycles of load": lambda rng, load, deepest, can_jump: _cycles(rng, "load", load, 0.5, 0.9),
    "cycles of approach": lambda rng, load, deepest, can_jump: _cycles(rng, "approach", deepest, 0.7, 0.98),
    "opening cycles": lambda rng, load, deepest, can_jump: _cycles(rng, "approach", deepest, -0.7, 0.0),
    "load, hold approach": _relaxation,
    "mixed control": _mixed,
    "table of 200": _table_of_200,
    "jumps and holds": _jumps,
    "fast and slow ramp": _fast_and_slow,
}

# ----------------------------------------------------------------------------------------------------------------
# surfaces: (height, boundary, load times contact compliance [m2], deepest approach [m]); the load is for a part of the
# surface in contact that is drawn, roughly


def _sides(rng):
    return 1.0, float(rng.choice([1.0, rng.uniform(0.5, 2)]))


def _sphere(rng, shape):
    sides = _sides(rng)
    radius = min(sides) * rng.uniform(0.15, 0.6)
    return rv.sphere(2.0, sides, shape), "free", 4 * radius**3 / 6.0, radius**2 / 2.0


def _cone(rng, shape):
    sides = _sides(rng)
    radius = min(sides) * rng.uniform(0.15, 0.6)
    return rv.cone(0.1, sides, shape), "free", np.pi / 2 * 0.1 * radius**2, np.pi / 2 * 0.1 * radius


def _flat_punch(rng, shape):
    sides = _sides(rng)
    radius, depth = min(sides) * rng.uniform(0.25, 0.6), 10 ** rng.uniform(-3, -1)
    return rv.flat_punch(radius, sides, shape), "free", 2 * radius * depth, depth


def _wavy(rng, shape):
    amplitude, waves = 10 ** rng.uniform(-3, -1), int(rng.integers(1, 3))
    height = rv.wavy(amplitude, 1.0, (1.0, float(rng.integers(1, 3))), shape, waves)
    return height, "periodic", *_of_roughness(rng, height, 0.9)


def _rough(boundary):
    def drawn(rng, shape):
        height = rv.self_affine(_sides(rng), shape, hurst=rng.uniform(0.3, 1), rms_slope=10 ** rng.uniform(-2, -0.5),
                                seed=rng)  # fmt: skip
        return height, boundary, *_of_roughness(rng, height, 0.9 if boundary == "periodic" else 1.2)

    return drawn


def _of_roughness(rng, height, deep):
    """Load times compliance by Persson's ``A/A0 = erf(sqrt(2) p / (E* slope))``, and an approach below full contact."""
    slopes = np.gradient(height.values, *(float(height[axis][1] - height[axis][0]) for axis in ("x", "y")))
    slope, part = float(np.sqrt(np.mean(slopes[0] ** 2 + slopes[1] ** 2))), 10 ** rng.uniform(-1.5, -0.03)
    area = float(np.prod([height.sizes[a] * float(height[a][1] - height[a][0]) for a in ("x", "y")]))
    return slope * float(erfinv(part)) / np.sqrt(2) * area, float((height.max() - height).mean()) * deep * part**0.3


SURFACES = {
    "sphere": _sphere,
    "cone": _cone,
    "flat punch": _flat_punch,
    "wavy": _wavy,
    "rough, free": _rough("free"),
    "rough, periodic": _rough("periodic"),
}
