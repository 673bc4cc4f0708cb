"""Against Tamaas (C++), one thread each: elastic rough contact, free-space sphere, free-space creep."""

import numpy as np
from scenes import ball_under_step_load, grid, load_for_area, rough_gap, seconds, solved_to, tight_pressure

import roughvisc as rv


def measure(sizes=(256, 512, 1024), areas=(0.05, 0.3, 0.95), creep_steps=(20, 40, 80), creep_cells=128, repeats=3):
    try:
        import tamaas
    except ImportError:
        return
    tamaas.set_log_level(tamaas.LogLevel.error)
    tamaas.initialize(1)
    for cells in sizes:
        gap = rough_gap(cells)
        for area in areas:
            halfspace = grid(cells, "periodic")
            mean = load_for_area(halfspace, gap, area)
            yield elastic(tamaas, f"elastic periodic rough, {area:.0%} area, {cells}^2", halfspace, gap, mean, repeats)
    for cells in sizes:
        x = np.arange(cells) - cells / 2 + 0.5
        gap = (x[:, None] ** 2 + x[None, :] ** 2) / (2 * cells)
        mean = 4 / 3 * (0.3 * cells) ** 3 / cells / cells**2
        yield elastic(tamaas, f"elastic free-space sphere, {cells}^2", grid(cells, "free"), gap, mean, repeats)
    for steps in creep_steps:
        yield creep(tamaas, creep_cells, steps, repeats)


def elastic(tamaas, name, halfspace, gap, mean, repeats):
    """Theirs at its tolerance 1e-6, ours at the loosest one that is not less accurate."""
    exact = tight_pressure(halfspace, gap, mean)

    def run():
        model = tamaas.Model(tamaas.model_type.basic_2d, [float(n) for n in gap.shape], list(gap.shape))
        model.E, model.nu = 1.0, 0.0
        if halfspace.boundary == "free":
            tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
        solver = tamaas.PolonskyKeerRey(model, gap.max() - gap, 1e-6)
        if halfspace.boundary == "free":
            solver.setIntegralOperator("dcfft")
        solver.max_iter = 20_000
        solver.solve(mean)
        return np.array(model.traction)

    theirs, pressure = seconds(run, repeats)
    their_error = float(np.abs(pressure - exact).sum() / exact.sum())
    ours, error, state = solved_to(halfspace, gap, mean, exact, their_error, repeats)
    return row(name, theirs, ours, their_error, error, state.convolutions)


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
    for tolerance in (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4):
        ds = rv.simulate(ball, material, program, tolerance=tolerance, **settings)
        if error(ds.pressure[0].values, duration) <= their_error:
            break
    ours, ds = seconds(lambda: rv.simulate(ball, material, program, tolerance=tolerance, **settings), repeats)
    name = f"free-space creep, {cells}^2, Tamaas with {steps} steps"
    return row(name, theirs, ours, their_error, error(ds.pressure[0].values, duration), int(ds.convolutions.sum()))


def row(name, theirs, ours, their_error, error, convolutions):
    return {
        "case": name,
        "peer": "Tamaas",
        "peer_seconds": theirs,
        "seconds": ours,
        "ratio": theirs / ours,
        "peer_error": their_error,
        "error": error,
        "convolutions": convolutions,
    }
