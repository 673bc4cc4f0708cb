"""Do two checkouts compute the same? Scenes in each; variables that both have are compared bit by bit.

    python workflows/benchmarks/same_bits.py OTHER_CHECKOUT [SCENE ...]

Run it from the checkout that is to be judged. Variables of one checkout alone are listed. Exit status 1 if anything
that both have differs.
"""

import pickle
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np

#: Variables and attributes that differ between runs of one program, and texts.
LEFT_OUT = ("wall_time", "roughvisc_version", "history", "source", "result_format", "step")
LEFT_OUT += ("notes", "details", "warnings", "title", "Conventions")


def whole(dataset):
    """All values of a result by name, with those of its steps and of the groups that the first edition has."""
    values = {name: np.asarray(one.values) for name, one in dataset.variables.items()}
    for group in ("energy", "accuracy", "cost", "steps"):
        try:
            part = getattr(dataset.roughvisc, group)
        except (AttributeError, ValueError):  # there is none
            continue
        prefix = "step_" if group == "steps" else ""
        values |= {f"{prefix}{name}": np.asarray(one.values) for name, one in part.variables.items()}
    return values


def scenes():
    """Each scene by its name, a callable that gives a Dataset."""
    import roughvisc as rv

    zener = rv.zener(1e6, 1e6, 1e6, 0.5)
    soft = rv.kelvin_voigt(1e6, 1e6, 0.5)
    prony = rv.Prony(glassy=1e-7, compliances=(1e-7, 3e-7, 1e-6, 2e-6), times=(0.01, 0.1, 1.0, 10.0))
    law = rv.power_law(glassy=1e-8, coefficient=1e-6, exponent=0.3)
    at_rest = rv.Program()
    hold, ramp = at_rest.load(0.01, over=0).hold(2.0), at_rest.load(0.01, over=1.0).hold(1.0)
    ball = rv.sphere(1e-2, 2e-3, (33, 31))
    rough = rv.self_affine((1e-3, 0.9e-3), (36, 33), hurst=0.8, rms_slope=0.1, rolloff=5e-4, seed=1)
    # fields of more than one block of cells: what is added up by blocks shows nowhere else
    wide = rv.self_affine((1e-3, 0.9e-3), (402, 390), hurst=0.8, rms_slope=0.1, rolloff=5e-4, seed=1)
    holes = rough.where(np.random.default_rng(3).random(rough.shape) > 0.1)
    few = {"times": 5, "progress": False, "fields": ("pressure", "gap", "displacement")}
    periodic = few | {"boundary": "periodic"}
    light = at_rest.load(0.02, over=0).hold(2.0)
    opening = rv.Program.cycle("2 µm", "4 µm", 1.0, 2, control="approach")
    triangle = at_rest.load(0.01, over=0.5).load(0.0, over=0.5)
    slide = at_rest.load(0.02, over=0.1).slide(3e-4, over=1.0)
    up_and_down = at_rest.approach(5e-6, over=1.0).hold(1.0).approach(0.0, over=1.0)
    return {
        "ball": lambda: rv.simulate(ball, zener, hold, **few),
        "ball on several times": lambda: rv.simulate(ball, prony, ramp, **few),
        "every step": lambda: rv.simulate(ball, zener, ramp, progress=False),
        "cone": lambda: rv.simulate(rv.cone(0.05, 2e-3, (25, 27)), zener, ramp, **few),
        "punch": lambda: rv.simulate(rv.flat_punch(5e-4, 2e-3, (25, 27)), zener, ramp, **few),
        "rough, periodic": lambda: rv.simulate(rough, zener, light, **periodic),
        "rough, wide": lambda: rv.simulate(wide, zener, light, **periodic | {"times": 2, "tolerance": 1e-2}),
        "rough, free": lambda: rv.simulate(rough, prony, ramp, edge="accept", **few),
        "growing": lambda: rv.simulate(
            rv.sphere(1e-2, 1e-3, (13, 15)), prony, at_rest.load(0.1, over=0).hold(2.0), **few
        ),
        "unloading": lambda: rv.simulate(ball, zener, triangle, **few),
        "approach": lambda: rv.simulate(ball, prony, up_and_down, **few),
        "no compliance at once": lambda: rv.simulate(ball, soft, ramp, **few),
        "flow": lambda: rv.simulate(ball, rv.maxwell(1e6, 1e6, 0.5), hold, **few),
        "power law": lambda: rv.simulate(ball, law, hold, **few),
        "opening cycle": lambda: rv.simulate(ball, zener, opening, **few),
        "slide": lambda: rv.simulate(rough, zener, slide, **periodic),
        "friction": lambda: rv.friction(rough, zener, speeds=[1e-4, 1e-3], load=0.02, progress=False),
        "sheet": lambda: rv.simulate(ball, rv.sheet(zener, 1e-3), hold, **few),
        "absent cells": lambda: rv.simulate(holes, zener, light, missing="absent", **periodic),
        "elastic": lambda: rv.simulate(rough, rv.elastic(1e6, 0.5), light, **periodic),
    }


def computed(names, path):
    """All variables and attributes of the scenes, written to a file."""
    warnings.simplefilter("ignore")
    results = {}
    for name, scene in scenes().items():
        if names and name not in names:
            continue
        try:
            dataset = scene()
        except Exception as error:  # a checkout without this feature
            results[name] = {"error": f"{type(error).__name__}: {error}"}
            continue
        values = {key: one for key, one in whole(dataset).items() if key.removeprefix("step_") not in LEFT_OUT}
        told = {f"attribute {key}": value for key, value in dataset.attrs.items() if key not in LEFT_OUT}
        results[name] = values | told
    Path(path).write_bytes(pickle.dumps(results))


def differing(one, other):
    """What differs between two results, and by how much of the largest value."""
    for key in sorted(one.keys() | other.keys()):
        a, b = one.get(key), other.get(key)
        if a is None or b is None:
            continue
        if not isinstance(a, np.ndarray):
            if str(a) != str(b):
                yield f"{key}: {b} -> {a}"
        elif a.shape != b.shape:
            yield f"{key}: shape {b.shape} -> {a.shape}"
        elif a.tobytes() != b.tobytes():
            with np.errstate(all="ignore"):
                yield f"{key}: {np.nanmax(np.abs(a - b)) / np.nanmax(np.abs(b)):.1e} of the largest"


def main(other, *names):
    """Print what differs; whether anything does."""
    here, found = Path(__file__).resolve(), []
    for checkout in (here.parents[2], Path(other).resolve()):
        path = checkout / ".same_bits.pickle"
        subprocess.run(
            [sys.executable, str(here), "--compute", str(path), *names],
            env={"PYTHONPATH": str(checkout), "PATH": "/usr/bin:/bin", "OMP_NUM_THREADS": "1"},
            check=True,
        )
        found.append(pickle.loads(path.read_bytes()))
        path.unlink()
    any_differs, alone = False, set()
    for name, result in found[0].items():
        lines = list(differing(result, found[1][name]))
        any_differs |= bool(lines)
        alone.update(result.keys() ^ found[1][name].keys())
        print(f"{name}: {'the same' if not lines else ''}", *lines, sep="\n    " if lines else "", flush=True)
    print("in one checkout alone:", ", ".join(sorted(alone)))
    return any_differs


if __name__ == "__main__":
    if sys.argv[1] == "--compute":
        computed(sys.argv[3:], sys.argv[2])
    else:
        sys.exit(main(*sys.argv[1:]))
