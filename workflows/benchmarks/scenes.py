"""What the benchmarks press: scenes with a closed form or a tight solution, and how errors are measured."""

import time

import numpy as np

import roughvisc as rv
from roughvisc import closed_forms
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.halfspace import HalfSpace

RADIUS = 1.0


def seconds(run, repeats):
    """Median wall time of repeated runs, and the last one's result."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        result = run()
        times.append(time.perf_counter() - start)
    return float(np.median(times)), result


def ball_under_step_load(material, load, duration, cells):
    """Sphere, program, and a function that measures the L1 error of a pressure at a time, over the load."""
    exact = closed_forms.lee_radok_step(RADIUS, material, load)
    size = 2.4 * float(exact.radius(duration))
    ball = rv.sphere(RADIUS, size, cells)
    distance = np.hypot(ball.x.values[:, None] - size / 2, ball.y.values - size / 2)

    def error(pressure, t):
        return float(np.abs(pressure - exact.pressure(distance, t)).sum() * (size / cells) ** 2 / load)

    return ball, rv.Program().load(load, over=0).hold(duration), error


def rough_gap(cells, seed=0):
    """Gap under a periodic self-affine surface whose spectrum is fixed in cells; rms slope 1, cells one long."""
    surface = rv.self_affine(
        float(cells), (cells, cells), hurst=0.8, rms_slope=1.0, rolloff=cells / 4, shortcut=8.0, seed=seed
    )
    return float(surface.max()) - surface.values


def load_for_area(halfspace, gap, fraction):
    """Mean pressure over the contact modulus at which this fraction of the cells is in contact."""
    low, high = 1e-4, 20.0
    for _ in range(25):
        mean = (low * high) ** 0.5
        state = solve_contact(halfspace, gap, load=mean * gap.size, tolerance=1e-4)
        low, high = (mean, high) if np.mean(state.pressure > 0) < fraction else (low, mean)
    return mean


def tight_pressure(halfspace, gap, mean):
    return solve_contact(halfspace, gap, load=mean * gap.size, tolerance=1e-13, max_iterations=5000).pressure


def solved_to(halfspace, gap, mean, exact, error, repeats):
    """Our time to reach an L1 error: the loosest tolerance of a ladder that does."""
    for tolerance in 10.0 ** -np.arange(1, 14):
        took, state = seconds(lambda t=tolerance: solve_contact(halfspace, gap, load=mean * gap.size, tolerance=t), 1)
        reached = float(np.abs(state.pressure - exact).sum() / exact.sum())
        if reached <= error:
            break
    took, state = seconds(lambda: solve_contact(halfspace, gap, load=mean * gap.size, tolerance=tolerance), repeats)
    return took, reached, state


def grid(cells, boundary):
    return HalfSpace((cells, cells), (1.0, 1.0), boundary)
