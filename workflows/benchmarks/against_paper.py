"""Against the paper's own algorithm: a Maxwell step load, at equal or smaller error of the pressure."""

import numpy as np
from scenes import ball_under_step_load, row, seconds

import roughvisc as rv
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.paper import press


class Counted(Grid):
    """A grid that counts its convolutions."""

    convolutions = 0

    def displacement(self, pressure, *others, **named):
        self.convolutions += 1
        return super().displacement(pressure, *others, **named)


def measure(sizes=((128, 60), (128, 200), (256, 200)), repeats=5):
    material, duration, load = rv.maxwell(1.0, 1.0), 2.0, 0.05
    for cells, steps in sizes:
        ball, program, error = ball_under_step_load(material, load, duration, cells)
        side = float(ball.x[1] - ball.x[0])
        instants, gap = np.linspace(0, duration, steps + 1), float(ball.max()) - ball.values
        shown = {instants[steps // 2], duration}
        settings = {"times": sorted(shown), "progress": False, "fields": ("pressure",)}

        def theirs(gap=gap, side=side, instants=instants, shown=shown):
            grid = Counted(gap.shape, (side, side))
            pressed = press(grid, gap, lambda age: float(material.contact_compliance(age)), lambda _: load, instants)
            return grid, {time: pressure for time, pressure, _ in pressed if time in shown}

        took, (grid, found) = seconds(theirs, 1)  # minutes: once
        their_error = max(error(pressure, time) for time, pressure in found.items())

        def worst(ds, error=error):
            return max(error(ds.pressure[i].values, float(t)) for i, t in enumerate(ds.time))

        for tolerance in 10.0 ** -np.arange(1, 4, 0.1):
            if worst(rv.simulate(ball, material, program, tolerance=tolerance, **settings)) <= their_error:
                break

        def ours(ball=ball, program=program, tolerance=tolerance, settings=settings):
            return rv.simulate(ball, material, program, tolerance=tolerance, **settings)

        name = f"Maxwell step load, {cells}^2, the paper's with {steps} steps"
        more = {"peer_convolutions": grid.convolutions}
        needed, ds = seconds(ours, repeats)
        counted = int(ds.roughvisc.steps.convolutions.sum())
        yield row("the paper", name, took, needed, their_error, worst(ds), counted, **more)
