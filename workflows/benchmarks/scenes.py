"""Contact problems of the benchmarks, with a closed form or a sharp solution, and their errors."""

import sys
import time
from pathlib import Path

import numpy as np

import roughvisc as rv
from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.grid import Grid

sys.path.append(str(Path(__file__).parents[2] / "tests"))
from references.half_space import lee_radok_step

RADIUS = 1.0


def seconds(run, repeats):
    """Median processor time of repeated runs, and the last one's result: other programs do not count."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        result = run()
        times.append(time.process_time() - start)
    return float(np.median(times)), result


def ball_under_step_load(material, load, duration, cells):
    """Sphere, program, and a function that measures the L1 error of a pressure at a time, over the load."""
    exact = lee_radok_step(RADIUS, material, load)
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


def load_for_area(operator, gap, fraction):
    """Mean pressure over the contact modulus at which this fraction of the cells is in contact."""
    low, high = 1e-4, 20.0
    for _ in range(25):
        mean = (low * high) ** 0.5
        state = solve_contact(operator, gap, load=mean * gap.size, tolerance=1e-2)
        low, high = (mean, high) if np.mean(state.pressure > 0) < fraction else (low, mean)
    return mean


def tight_pressure(operator, gap, mean):
    return solve_contact(operator, gap, load=mean * gap.size, tolerance=1e-10, max_iterations=5000).pressure


def solved_to(operator, gap, mean, exact, error, repeats):
    """Our time to reach an L1 error: the loosest tolerance of a ladder that does."""
    for tolerance in 10.0 ** -np.arange(1, 10, 0.5):
        before = operator.convolutions
        state = solve_contact(operator, gap, load=mean * gap.size, tolerance=tolerance)
        convolutions = operator.convolutions - before
        reached = float(np.abs(state.pressure - exact).sum() / exact.sum())
        if reached <= error:
            break
    took, _ = seconds(lambda: solve_contact(operator, gap, load=mean * gap.size, tolerance=tolerance), repeats)
    return took, reached, convolutions


def elastic(peer, name, theirs, operator, gap, mean, repeats):
    """A peer's pressure, computed by ``theirs``, against ours at the loosest tolerance that is not less accurate."""
    exact = tight_pressure(operator, gap, mean)
    took, pressure = seconds(theirs, repeats)
    their_error = float(np.abs(pressure - exact).sum() / exact.sum())
    ours, error, convolutions = solved_to(operator, gap, mean, exact, their_error, repeats)
    return row(peer, name, took, ours, their_error, error, convolutions)


def row(peer, name, theirs, ours, their_error, error, convolutions, **more):
    return {
        "case": name,
        "peer": peer,
        "peer_seconds": theirs,
        "seconds": ours,
        "ratio": theirs / ours,
        "peer_error": their_error,
        "error": error,
        "convolutions": convolutions,
        **more,
    }


def sphere_gap(cells):
    """Gap under a sphere, and the mean pressure over the contact modulus that presses it on 0.3 of the width."""
    x = np.arange(cells) - cells / 2 + 0.5
    return (x[:, None] ** 2 + x[None, :] ** 2) / (2 * cells), 4 / 3 * (0.3 * cells) ** 3 / cells / cells**2


def grid(cells, boundary):
    return Grid((cells, cells), (1.0, 1.0), boundary)
