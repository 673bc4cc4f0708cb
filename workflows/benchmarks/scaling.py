"""Cost against size, steps, exponentials and the extent of the contact; the share of the transforms; peak memory."""

import tracemalloc

import numpy as np
from scenes import RADIUS, seconds

import roughvisc as rv
from roughvisc.mechanics.halfspace import HalfSpace


class Clock:
    """Wall time inside the transforms, measured around the half-space's two operators."""

    def __init__(self):
        self.inside = 0.0

    def __enter__(self):
        self.original = {name: getattr(HalfSpace, name) for name in ("displacement", "approximate_inverse")}
        for name, operator in self.original.items():

            def timed(halfspace, field, operator=operator):
                took, result = seconds(lambda: operator(halfspace, field), 1)
                self.inside += took
                return result

            setattr(HalfSpace, name, timed)
        return self

    def __exit__(self, *_):
        for name, operator in self.original.items():
            setattr(HalfSpace, name, operator)


def run(name, surface, material, program, **settings):
    tracemalloc.start()
    rv.simulate(surface, material, program, progress=False, **settings)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    with Clock() as clock:
        took, ds = seconds(lambda: rv.simulate(surface, material, program, progress=False, **settings), 1)
    steps = settings.get("time_step") and program.duration / settings["time_step"]
    fields = peak / (8 * surface.size)
    return {
        "case": name,
        "seconds": took,
        "steps": steps or np.nan,
        "seconds_per_step": took / steps if steps else np.nan,
        "transform_share": clock.inside / took,
        "convolutions": int(ds.convolutions.sum()),
        "iterations": int(ds.iterations.sum()),
        "peak_fields": fields,
    }


def measure(sizes=(128, 256, 512, 1024), steps=(50, 100, 500, 2000), exponentials=(1, 5, 10, 40), window=1024):
    zener, hold = rv.zener(1.0, 1.0, 1.0), rv.Program().load(1.0, over=0).hold(1.0)
    for cells in sizes:
        surface = rv.self_affine(
            1.0, (cells, cells), hurst=0.8, rms_slope=1.0, rolloff=0.25, shortcut=8 / min(sizes), seed=1
        )
        load = rv.Program().load(0.6, over=0).hold(1.0)
        yield run(f"rough periodic creep, {cells}^2, fixed spectrum, 20 steps", surface, zener, load,
                  boundary="periodic", time_step=0.05, times=[1.0], fields=("pressure",))  # fmt: skip
    ball = rv.sphere(RADIUS, 2.4, 128)
    for count in steps:
        yield run(
            f"ball on Zener, 128^2, {count} steps", ball, zener, hold, time_step=1 / count, times=[1.0], fields=()
        )
    for count in exponentials:
        material = rv.Prony(1.0, 0.0, (1.0 / count,) * count, tuple(np.geomspace(1e-2, 1e1, count)))
        yield run(f"ball, 128^2, {count} exponentials, 50 steps", ball, material, hold, time_step=0.02, times=[1.0],
                  fields=())  # fmt: skip
    size = 1.0
    load = 4 * (0.025 * size) ** 3 / (3 * RADIUS) / 0.5
    small = rv.Program().load(load, over=0).hold(1.0)
    wide = rv.sphere(RADIUS, size, window)
    for fields in (("pressure",), ("pressure", "gap")):
        name = f"contact of 5 % of the width, {window}^2, 20 steps, keeping {' and '.join(fields)}"
        yield run(name, wide, zener, small,
                  time_step=0.05, fields=fields)  # fmt: skip
