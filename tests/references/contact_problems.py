"""Contact problems with a tight solution: spheres, cones, punches, waves and rough surfaces, from sparse to full."""

import itertools

import numpy as np
from support import rough_gap

from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.grid import Grid


def problems(cells, boundary):
    """Name, half-space, gap, load and present cells; lengths in cells."""
    shape = (cells, cells - 3)
    whole, mirror = Grid(shape, (1.0, 1.0), boundary), Grid(shape, (1.0, 1.0), "mirror")
    x, y = np.arange(cells)[:, None] - cells / 2 + 0.37, np.arange(cells - 3) - cells / 2 + 1.1
    distance, inside = np.hypot(x, y), np.hypot(x, y) < cells / 3
    for a in (0.08, 0.2, 0.35):
        yield "sphere", whole, distance**2 / (2 * cells), 4 / 3 * (a * cells) ** 3 / cells, None
        yield "cone", whole, 0.1 * distance, 0.1 * (a * cells) ** 2, None
    yield "punch", whole, np.where(inside, 0.0, 3.0), 20.0, inside
    yield "rough punch", whole, np.where(inside, rough_gap(shape), 3.0), 0.05 * cells**2, inside
    waves = np.cos(2 * np.pi * x / cells) + np.cos(2 * np.pi * y / (cells - 3))
    for mean in (0.01, 0.05, 0.15):
        yield "wave", whole, 0.025 * cells * (2 - waves), mean * cells**2, None
    for mean, seed in itertools.product((0.01, 0.05, 0.2, 0.5, 0.9, 1.3), (0, 1)):
        yield "rough", whole, rough_gap(shape, seed), mean * cells**2, None
    if boundary == "periodic":
        corner = np.hypot(np.arange(cells)[:, None] + 0.5, np.arange(cells - 3) + 0.5)  # a sphere and its mirror images
        yield "sphere at a mirror", mirror, corner**2 / (4 * cells), 0.018 * cells**2, None
        yield "rough with mirror images", mirror, rough_gap(shape, 2), 0.1 * cells**2, None


def solved(cells, tolerances):
    """What is solved to which tolerance, the relative L1 error of its pressure, and the solver's estimate of it."""
    for boundary in ("free", "periodic"):
        for name, operator, gap, load, present in problems(cells, boundary):
            given = {"present": present, "max_iterations": 5000}
            exact = solve_contact(operator, gap, load=load, tolerance=1e-10, **given)
            before = solve_contact(operator, gap, load=0.9 * load, tolerance=1e-4, **given).pressure
            touching = exact.pressure > 0
            controls = [("load", load)]
            if boundary == "free" or not touching.all():  # else the approach does not determine the load
                controls.append(("approach", float(np.mean((gap + exact.displacement)[touching]))))
            for (control, value), start, tolerance in itertools.product(controls, (None, before), tolerances):
                state = solve_contact(operator, gap, **{control: value}, tolerance=tolerance, start=start, **given)
                error = float(np.abs(state.pressure - exact.pressure).sum() / load)
                yield f"{name}, {control}, {boundary}", tolerance, error, float(state.error)
