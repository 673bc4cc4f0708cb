"""How far a solve is from its limit: the time of as many bare pairs of Fourier transforms as it makes convolutions.

    python workflows/benchmarks/limit.py [CASE ...] [--cells N ...] [--repeats N] [--against CHECKOUT]

A convolution is a displacement or an application of the preconditioner. A bare pair is a transform of the cells, padded
in free space, and its way back: in double precision, by the library that the package uses, with one thread. Each
solve runs in a process of its own, in turn with that of another checkout where one is given. Printed are medians of
processor time over the limit, of the contact solver alone (friction: of all) and of the whole call. A leak rate, which
makes no convolution, is counted in bare pairs: between walls, with a tenth of the area in contact.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from unittest import mock

CELLS = {
    "creep": (64, 128, 256, 512, 1024),
    "elastic": (64, 128, 256, 512, 1024, 2048, 4096),
    "friction": (64, 128, 256, 512),
    "ball": (128,),
    "leak": (64, 128, 256, 512, 1024, 2048, 4096),
}


def measure(case, cells):
    """Seconds of one solve, of its contact problems, of a bare pair; and the number of convolutions."""
    found = leak(cells) if case == "leak" else solved(case, cells)
    return found | {"pair": bare_pair(cells, mirrored=case == "ball")}


def bare_pair(cells, mirrored):
    """Seconds of a transform and its inverse; for the ball of a quarter of the padded cells, by cosines."""
    import numpy as np

    from roughvisc.mechanics.bodies import transforms

    shape = (cells, cells)
    along, field, pairs = transforms.transforms(mirrored), np.random.default_rng(1).random(shape), []
    for _ in range(9 if cells <= 1024 else 3):
        began, count = time.process_time(), 0
        while count == 0 or time.process_time() - began < 0.05:
            along.field_back(along.of_field(field, workers=1), s=shape, overwrite_x=True, workers=1)
            count += 1
        pairs.append((time.process_time() - began) / count)
    return sorted(pairs)[len(pairs) // 2]


def leak(cells):
    """Seconds that a leak rate takes, counted as one convolution."""
    import roughvisc as rv
    from roughvisc.mechanics.transport.flow import flow

    rough = rv.self_affine(1.0, cells, hurst=0.8, rms_slope=0.1, rolloff=0.25, shortcut=8 / cells, seed=1)
    settings = {"boundary": "periodic", "tolerance": 1e-3, "fields": ("gap",), "progress": False}
    ds = rv.simulate(rough, rv.elastic(1.0), rv.Program().pressure(0.02, over=0), **settings)
    gap, spacing = ds.gap[-1].values, (1 / cells, 1 / cells)
    flow(gap[:64, :64], (1.0, 1.0))  # imports
    began = time.process_time()
    flow(gap, spacing)
    spent = time.process_time() - began
    return {"whole": spent, "convolutions": 1, "contact": (spent, 1)}


def solved(case, cells):
    """Seconds of a solve, of its contact problems; and the number of convolutions."""
    import roughvisc as rv
    from roughvisc.mechanics.stepping import step

    def press(cells):
        zener = rv.zener(shear_modulus=1.0, kelvin_modulus=1.0, kelvin_viscosity=1.0)
        if case == "ball":
            ball = rv.sphere(1.0, 2.4, cells)
            return lambda: rv.simulate(ball, zener, rv.Program().load(1.0, over=0).hold(1.0), times=60, progress=False)
        rough = rv.self_affine(
            1.0, (cells, cells), hurst=0.8, rms_slope=1.0, rolloff=0.25, shortcut=max(8 / cells, 1 / 64), seed=1
        )
        if case == "friction":
            return lambda: rv.friction(rough, zener, pressure=0.3, speeds=[0.1, 1.0], progress=False)
        material = rv.elastic(1.0) if case == "elastic" else zener
        program = rv.Program().load(0.6, over=0).hold(1.0)
        numerics = rv.Numerics(time_step=0.05) if case == "creep" else rv.Numerics()
        return lambda: rv.simulate(
            rough, material, program, times=[1.0], fields=(), numerics=numerics, boundary="periodic", progress=False
        )

    press(32)()  # imports
    solve, problems = press(cells), []
    if cells <= 512:
        solve()  # plans of the transforms
    inside = step.solve_contact

    def timed(*given, **named):
        began = time.process_time()
        found = inside(*given, **named)
        problems.append((time.process_time() - began, found.convolutions))
        return found

    with mock.patch.object(step, "solve_contact", timed):
        began = time.process_time()
        ds = solve()
        whole = time.process_time() - began
    total = int(ds.convolutions.sum())

    contact = sum(seconds for seconds, _ in problems), sum(count for _, count in problems)
    if case == "friction":
        contact = whole, total
    return {"whole": whole, "convolutions": total, "contact": contact}


def in_process(checkout, case, cells):
    """The same by the package of a checkout."""
    environment = dict(os.environ, PYTHONPATH=str(checkout), OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    command = [sys.executable, __file__, "--one", case, "--cells", str(cells)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def main(cases, cells, repeats, against):
    """Print a row for each case and number of cells."""
    here = Path(__file__).resolve().parents[2]
    checkouts = [here] if against is None else [Path(against).resolve(), here]
    for case in cases or CELLS:
        for count in cells or CELLS[case]:
            rows = {checkout: [] for checkout in checkouts}
            for _ in range(repeats if count <= 1024 else 1):
                for checkout in checkouts:
                    rows[checkout].append(in_process(checkout, case, count))
            print(f"{case:9}{count:6}²", end="")
            for found in rows.values():
                convolutions = found[0]["convolutions"]
                ratios = [
                    (row["contact"][0] / row["contact"][1] / row["pair"], row["whole"] / convolutions / row["pair"])
                    for row in found
                ]
                contact, whole = (sorted(each)[len(each) // 2] for each in zip(*ratios, strict=True))
                seconds = sorted(row["whole"] for row in found)[len(found) // 2]
                print(
                    f"   contact {contact:5.2f}  whole {whole:5.2f}  ({convolutions} of them, {seconds:.3f} s)", end=""
                )
            print(flush=True)


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CELLS))
    asked.add_argument("--cells", nargs="+", type=int)
    asked.add_argument("--repeats", type=int, default=5)
    asked.add_argument("--against", help="another checkout, measured in turn with this one")
    asked.add_argument("--one", metavar="CASE", help=argparse.SUPPRESS)
    given = asked.parse_args()
    if given.one:
        print(json.dumps(measure(given.one, given.cells[0])))
    else:
        main(given.cases, given.cells, given.repeats, given.against)
