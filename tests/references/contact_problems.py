"""Contact problems with a tight solution: spheres, cones, punches, waves and rough surfaces, from sparse to full."""

import itertools

import numpy as np

import roughvisc as rv
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.grid import Grid


def rough_gap(cells, seed=0):
    """Gap under a periodic self-affine surface whose spectrum is fixed in cells; rms slope 1, cells one long."""
    size, waves = float(cells), {"rolloff": cells / 4, "shortcut": 8.0}
    surface = rv.self_affine(size, (cells, cells), hurst=0.8, rms_slope=1.0, seed=seed, **waves)
    return float(surface.max()) - surface.values


def problems(cells, boundary):
    """Name, half-space, gap, load and present cells; lengths in cells."""
    shape = (cells, cells - 3)
    whole = Grid(shape, (1.0, 1.0), boundary)
    mirror = Grid(shape, (1.0, 1.0), "mirror")
    x, y = np.arange(cells)[:, None] - cells / 2 + 0.37, np.arange(cells - 3) - cells / 2 + 1.1
    distance, inside = np.hypot(x, y), np.hypot(x, y) < cells / 3
    for a in (0.08, 0.2, 0.35):
        yield "sphere", whole, distance**2 / (2 * cells), 4 / 3 * (a * cells) ** 3 / cells, None
        yield "cone", whole, 0.1 * distance, 0.1 * (a * cells) ** 2, None
    yield "punch", whole, np.where(inside, 0.0, 3.0), 20.0, inside
    yield "rough punch", whole, np.where(inside, rough_gap(cells)[:, 3:], 3.0), 0.05 * cells**2, inside
    waves = np.cos(2 * np.pi * x / cells) + np.cos(2 * np.pi * y / (cells - 3))
    for mean in (0.01, 0.05, 0.15):
        yield "wave", whole, 0.025 * cells * (2 - waves), mean * cells**2, None
    for mean, seed in itertools.product((0.01, 0.05, 0.2, 0.5, 0.9, 1.3), (0, 1)):
        yield "rough", whole, rough_gap(cells, seed)[:, 3:], mean * cells**2, None
    if boundary == "periodic":
        corner = np.hypot(np.arange(cells)[:, None] + 0.5, np.arange(cells - 3) + 0.5)  # a sphere and its mirror images
        yield "sphere at a mirror", mirror, corner**2 / (4 * cells), 0.018 * cells**2, None
        yield "rough with mirror images", mirror, rough_gap(cells, 2)[:, 3:], 0.1 * cells**2, None


def rows(cells, tolerances):
    """Control, boundary, contact fraction, tolerance, relative L1 error, that of the load, its estimate and bound."""
    for boundary, size in itertools.product(("free", "periodic"), cells):
        for name, operator, gap, load, present in problems(size, boundary):
            given = {"present": present, "max_iterations": 5000}
            exact = solve_contact(operator, gap, load=load, tolerance=1e-10, **given)
            before = solve_contact(operator, gap, load=0.9 * load, tolerance=1e-4, **given).pressure
            touching = exact.pressure > 0
            controls = [("load", load)]
            if boundary == "free" or not touching.all():  # else the approach does not determine the load
                controls.append(("approach", float(np.mean((gap + exact.displacement)[touching]))))
            for (control, value), start, tolerance in itertools.product(controls, (None, before), tolerances):
                state = solve_contact(operator, gap, **{control: value}, tolerance=tolerance, start=start, **given)
                error = np.abs(state.pressure - exact.pressure).sum() / load
                yield {
                    "case": f"{name}, {control}, {boundary}, {size} cells, to {tolerance:g}",
                    "group": f"{control}, {boundary}",
                    "contact": float(np.mean(touching)),
                    "tolerance": tolerance,
                    "error": float(error),
                    "load_error": abs(float(state.load / load) - 1),
                    "estimate": float(state.error),
                    "bound": state.bound,
                }
