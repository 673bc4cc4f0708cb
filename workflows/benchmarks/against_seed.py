"""Against the seed paper's own algorithm: a Maxwell step load, at equal or smaller error of the pressure."""

import numpy as np
from scenes import ball_under_step_load, row, seconds, with_symmetry_and_without

import roughvisc as rv


def measure(sizes=((128, 60), (128, 200), (256, 200)), repeats=5):
    material, duration, load = rv.maxwell(1.0, 1.0), 2.0, 0.05
    for cells, steps in sizes:
        ball, program, error = ball_under_step_load(material, load, duration, cells)
        settings = {"times": [duration / 2, duration], "progress": False, "fields": ("pressure",)}

        def worst(ds, error=error):
            return max(error(ds.pressure[i].values, float(t)) for i, t in enumerate(ds.time))

        theirs, seed = seconds(
            lambda b=ball, p=program, n=steps, s=settings: rv.simulate(
                b, material, p, numerics=rv.Numerics(method="seed", time_step=duration / n), edge="accept", **s
            ),
            1,  # minutes: once
        )
        for tolerance in 10.0 ** -np.arange(1, 4, 0.1):
            fast = rv.simulate(ball, material, program, tolerance=tolerance, **settings)
            if worst(fast) <= worst(seed):
                break

        def press(ball=ball, program=program, tolerance=tolerance, settings=settings):
            return rv.simulate(ball, material, program, tolerance=tolerance, **settings)

        name = f"Maxwell step load, {cells}^2, seed with {steps} steps"
        more = {"peer_convolutions": int(seed.convolutions.sum())}
        for how in with_symmetry_and_without():
            ours, fast = seconds(press, repeats)
            counted = int(fast.convolutions.sum())
            yield row("seed paper", name + how, theirs, ours, worst(seed), worst(fast), counted, **more)
