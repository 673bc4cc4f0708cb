"""What do the constants of the time stepping buy? Convolutions and rates with other values.

    python workflows/benchmarks/step_constants.py ["NAME=VALUE ..."] ...

Each argument is a set of constants of ``step_control.py``, ``stepping.py`` and ``stated_error.py``; the first line is
without a change. Prints by set the convolutions of eight plain scenes with 1, 10 and 50 kept times, over those of the
first line; of 30 contacts with entering cells (``tests/experiment/test_entering_cells.py``) the convolutions and the
rows of 210 beyond 1 and 1.5 tolerances and the silent ones, with references of the first line; and of 150 scenes of
``cells-one`` and 50 of ``cells-many`` (``closed_forms.py``) the convolutions and the rows beyond the tolerance, the bad
ones and all. Half a minute a set.
"""

import logging
import sys
import warnings
from pathlib import Path

import numpy as np

import roughvisc as rv
from roughvisc.mechanics import stated_error, step_control, stepping

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(Path(__file__).parent), str(ROOT / "tests"), str(ROOT / "tests/experiment")]

import closed_forms  # noqa: E402
from support import relative_errors  # noqa: E402
from test_entering_cells import TOLERANCE, random_contact  # noqa: E402

SEED = 31337
MODULES = (step_control, stepping, stated_error)


def scenes():
    """Return surfaces, materials, programs and boundaries: ramps, a cycle, and two jumps at the end."""
    zener, law = rv.zener(1e6, 1e6, 1e6), rv.power_law(1e-7, 1e-6, 0.3, 1.0)
    series = rv.Prony(1e-7, 0.0, (5e-7, 5e-7, 1e-6), (0.01, 0.1, 1.0))
    ball = rv.sphere(1e-2, 2e-3, 24)
    rough = rv.self_affine(1e-3, (24, 24), hurst=0.8, rms_slope=0.1, rolloff=5e-4, seed=3)
    start = rv.Program()
    return [
        (ball, zener, start.load(0.5, over=0.1).hold(2), "free"),
        (ball, zener, start.approach(1e-5, over=0.1).hold(2), "free"),
        (ball, series, start.load(0.5, over=1).load(0.05, over=1), "free"),
        (rough, zener, start.pressure(2e4, over=0.1).hold(2), "periodic"),
        (rough, law, start.pressure(2e4, over=1).hold(1), "periodic"),
        (rough, series, start.cycle(mean=0.01, amplitude=0.008, period=1, cycles=2), "periodic"),
        (ball, series, start.approach(1e-5, over=0).hold(2), "free"),
        (rough, series, start.pressure(2e4, over=0).hold(2), "periodic"),
    ]


def plain():
    """Return the convolutions of the scenes with 1, 10 and 50 kept times."""
    totals = []
    for kept in (1, 10, 50):
        total = 0
        for surface, material, program, boundary in scenes():
            times = np.linspace(0, program.duration, kept + 1)[1:].tolist()
            ds = rv.simulate(surface, material, program, times=times, boundary=boundary, progress=False)
            total += closed_forms.convolutions(ds)
        totals.append(total)
    return np.array(totals)


def entering(references):
    """Return convolutions, and rows beyond 1 and 1.5 tolerances and silent ones; fill the references if empty."""
    settings, total, true, stated = {"boundary": "periodic", "fields": ("pressure",), "progress": False}, 0, [], []
    for number in range(30):
        surface, material, program, times = random_contact(np.random.default_rng([SEED, number]))
        ds = rv.simulate(surface, material, program, times=times, tolerance=TOLERANCE, **settings)
        if number not in references:
            given = {"times": ds.time.values.tolist(), "tolerance": TOLERANCE / 8}
            references[number] = rv.simulate(surface, material, program, **given, **settings)
        total += closed_forms.convolutions(ds)
        true.extend(relative_errors(ds, references[number]) / TOLERANCE)
        stated.extend(ds.stated_error.values / TOLERANCE)
    true, stated = np.array(true), np.array(stated)
    missed = true > closed_forms.BAD
    return total, int((true > 1).sum()), int(missed.sum()), int((missed & (true > closed_forms.BAD * stated)).sum())


def cells(kind, count):
    """Return convolutions, rows beyond the tolerance, bad rows and all rows of cells in contact."""
    rows = closed_forms.KINDS[kind](np.random.default_rng([SEED, *kind.encode()]), count)
    found = closed_forms.rates([closed_forms.Row(*row) for row in rows])
    return tuple(int(found[name]) for name in ("convolutions", "beyond", "bad", "rows"))


def main(sets=()):
    """Print a line for each set of constants."""
    warnings.simplefilter("ignore")
    logging.getLogger("roughvisc").setLevel(logging.ERROR)
    given = {(module, name): value for module in MODULES for name, value in vars(module).items() if name.isupper()}
    first, references = None, {}
    for text in ("", *sets):
        changed = dict(pair.split("=") for pair in text.split())
        if unknown := set(changed) - {name for _, name in given}:
            raise SystemExit(f"found {sorted(unknown)}: expected constants of stepping, step_control, stated_error")
        for (module, name), value in given.items():
            setattr(module, name, float(changed.get(name, value)) if name in changed else value)
        used = plain()
        first = used if first is None else first
        over = " ".join(f"{ratio:.3f}" for ratio in used / first)
        rates = f"entering {entering(references)}, cells-one {cells('cells-one', 150)}"
        print(f"{text or 'unchanged'}: plain {over}, {rates}, cells-many {cells('cells-many', 50)}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
