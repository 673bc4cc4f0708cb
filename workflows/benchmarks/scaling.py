"""Cost against size, steps, exponentials and the extent of the contact; where the time goes; peak memory."""

import tracemalloc

import numpy as np
from scenes import RADIUS, seconds, with_symmetry_and_without, without_window

import roughvisc as rv
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.study.execution.profile import profiled


def run(name, surface, material, program, **settings):
    def press():
        return rv.simulate(surface, material, program, progress=False, **settings)

    tracemalloc.start()
    press()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    took, _ = seconds(press, 3 if surface.size < 1024**2 else 1)  # minutes: once
    with profiled() as profile:
        ds = press()
    steps, iterations = program.duration / settings["numerics"].time_step, int(ds.roughvisc.cost.iterations.sum())
    beside = (1 - profile.share("transforms")) * profile.whole
    return {
        "case": name,
        "seconds": took,
        "steps": steps,
        "seconds_per_step": took / steps,
        "transform_share": profile.share("transforms"),
        "vector_share": profile.share("vector work of the solver"),
        "convolutions": int(ds.roughvisc.cost.convolutions.sum()),
        "iterations": iterations,
        "beside_over_scipy": beside / (iterations * iteration_by_scipy(surface, settings.get("boundary", "free"))),
        "peak_fields": peak / (8 * surface.size),
    }


def iteration_by_scipy(surface, boundary):
    """Seconds that an iteration spends in transforms: a displacement in double precision, and the preconditioner."""
    operator = Operator(surface.shape, (1.0, 1.0), boundary)
    pressure = np.ones(surface.shape)
    single = pressure.astype(np.float32)
    operator.displacement(pressure), operator.approximate_inverse(single)  # makes what the others share
    return (
        seconds(lambda: operator.displacement(pressure), 9)[0]
        + seconds(lambda: operator.approximate_inverse(single), 9)[0]
    )


def following(cells, fields):
    """A contact of 5 % of the width: with the window that follows it and without, with and without symmetry."""
    size = 1.0
    load = 4 * (0.025 * size) ** 3 / (3 * RADIUS) / 0.5
    ball, program = rv.sphere(RADIUS, size, cells), rv.Program().load(load, over=0).hold(1.0)

    def press():
        numerics = rv.Numerics(time_step=0.05)
        return rv.simulate(ball, rv.zener(1.0, 1.0, 1.0), program, numerics=numerics, fields=fields, progress=False)

    for how in with_symmetry_and_without():
        press()
        ours, followed = seconds(press, 5)
        with without_window():
            theirs, whole = seconds(press, 1)
        kept = " and ".join(fields)
        yield {
            "case": f"contact of 5 % of the width, {cells}^2, 20 steps, keeping {kept}{how or ', symmetric'}",
            "peer": "no window",
            "peer_seconds": theirs,
            "seconds": ours,
            "ratio": theirs / ours,
            "error": float(np.abs(followed.pressure - whole.pressure).sum() / whole.pressure.sum()),
        }


def measure(
    sizes=(128, 256, 512, 1024, 2048), steps=(50, 100, 500, 2000), exponentials=(1, 5, 10, 40), window=1024, sparse=512
):
    zener, hold = rv.zener(1.0, 1.0, 1.0), rv.Program().load(1.0, over=0).hold(1.0)
    load = rv.Program().load(0.6, over=0).hold(1.0)
    rv.simulate(rv.sphere(RADIUS, 2.4, 16), zener, hold, progress=False)  # what is imported then is no field
    few = rv.Program().load(0.05, over=0).hold(1.0)
    creeps = [(cells, load, "fixed spectrum") for cells in sizes] + [(sparse, few, "a sparse contact")]
    for boundary in ("periodic", "free"):
        for cells, program, what in creeps:
            surface = rv.self_affine(
                1.0, (cells, cells), hurst=0.8, rms_slope=1.0, rolloff=0.25, shortcut=8 / min(sizes), seed=1
            )
            name = f"rough creep, {boundary}, {cells}^2, {what}, 20 steps"
            edge = {"edge": "accept"} if boundary == "free" else {}
            settings = {"boundary": boundary, "numerics": rv.Numerics(time_step=0.05), "times": [1.0], "fields": ()}
            yield run(name, surface, zener, program, **settings, **edge)
    ball = rv.sphere(RADIUS, 2.4, 128)
    for count in steps:
        name = f"ball on Zener, 128^2, {count} steps"
        yield run(name, ball, zener, hold, numerics=rv.Numerics(time_step=1 / count), times=[1.0], fields=())
    for count in exponentials:
        material = rv.Prony(1.0, 0.0, (1.0 / count,) * count, tuple(np.geomspace(1e-2, 1e1, count)))
        name = f"ball, 128^2, {count} exponentials, 50 steps"
        yield run(name, ball, material, hold, numerics=rv.Numerics(time_step=0.02), times=[1.0], fields=())
    for fields in (("pressure",), ("pressure", "gap")):
        yield from following(window, fields)
