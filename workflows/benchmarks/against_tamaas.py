"""Against Tamaas (C++), one thread each: elastic rough contact, free-space sphere, free-space creep."""

import numpy as np
from scenes import ball_under_step_load, elastic, grid, load_for_area, rough_gap, row, seconds, sphere_gap

import roughvisc as rv


def measure(sizes=(256, 512, 1024), areas=(0.05, 0.3, 0.95), creep_steps=(20, 40, 80), creep_cells=128, repeats=3):
    try:
        import tamaas
    except ImportError:
        return
    tamaas.set_log_level(tamaas.LogLevel.error)
    tamaas.initialize(1)
    for cells in sizes:
        gap, operator = rough_gap(cells), grid(cells, "periodic")
        for area in areas:
            mean = load_for_area(operator, gap, area)
            name = f"elastic periodic rough, {area:.0%} area, {cells}^2"
            yield elastic("Tamaas", name, press(tamaas, gap, mean, "periodic"), operator, gap, mean, repeats)
    for cells in sizes:
        gap, mean = sphere_gap(cells)
        name = f"elastic free-space sphere, {cells}^2"
        yield elastic("Tamaas", name, press(tamaas, gap, mean, "free"), grid(cells, "free"), gap, mean, repeats)
    for steps in creep_steps:
        yield from creep(tamaas, creep_cells, steps, repeats)


def press(tamaas, gap, mean, boundary):
    """A function that gives their pressure, at their tolerance 1e-6."""

    def run():
        model = tamaas.Model(tamaas.model_type.basic_2d, [float(n) for n in gap.shape], list(gap.shape))
        model.E, model.nu = 1.0, 0.0
        if boundary == "free":
            tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
        solver = tamaas.PolonskyKeerRey(model, gap.max() - gap, 1e-6)
        if boundary == "free":
            solver.setIntegralOperator("dcfft")
        solver.max_iter = 20_000
        solver.solve(mean)
        return np.array(model.traction)

    return run


def creep(tamaas, cells, steps, repeats):
    """Sphere under a step load on G(t) = 1 + 3 exp(-t): the pressure at t = 2 against the closed form.

    Tamaas' long-time shear modulus is 1, and its first solve ends one time step after the load came on.
    """
    duration, load = 2.0, 0.3
    material = rv.from_relaxation(1.0, (3.0,), (1.0,))
    ball, program, error = ball_under_step_load(material, load, duration, cells)
    size = float(ball.x[-1] + ball.x[0])

    def run():
        model = tamaas.Model(tamaas.model_type.basic_2d, [size, size], [cells, cells])
        model.nu, model.E = 0.5, 3.0
        tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
        solver = tamaas.MaxwellViscoelastic(model, ball.values.copy(), 1e-6, duration / steps, [3.0], [1.0])
        solver.setIntegralOperator("dcfft")
        solver.max_iter = 5000
        for _ in range(steps):
            solver.solve(load / size**2)
        return np.array(model.traction)

    theirs, pressure = seconds(run, 1)
    their_error = error(pressure, duration)
    settings = {"times": [duration], "progress": False, "fields": ("pressure",)}
    for tolerance in 10.0 ** -np.arange(1, 4, 0.25):
        ds = rv.simulate(ball, material, program, tolerance=tolerance, **settings)
        if error(ds.pressure[0].values, duration) <= their_error:
            break
    ours, ds = seconds(lambda: rv.simulate(ball, material, program, tolerance=tolerance, **settings), repeats)
    reached, counted = error(ds.pressure[0].values, duration), int(ds.roughvisc.steps.convolutions.sum())
    name = f"free-space creep, {cells}^2, Tamaas with {steps} steps"
    yield row("Tamaas", name, theirs, ours, their_error, reached, counted)
