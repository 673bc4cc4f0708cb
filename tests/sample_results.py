"""Sample results for the tests of the views: realistic Datasets from closed forms, made without the solver."""

import numpy as np
import xarray as xr
from scipy import ndimage
from scipy.integrate import cumulative_trapezoid

from roughvisc.labels import label
from roughvisc.mechanics.closed_forms import hertz


def _cells(shape, size):
    steps = [length / count for count, length in zip(shape, size, strict=True)]
    return [(np.arange(count) + 0.5) * step for count, step in zip(shape, steps, strict=True)], steps


def _histories(fields, force, approach):
    """Add the histories that follow from the fields, and errors as they are stated."""
    present = fields["height"].notnull()
    cell = float(np.diff(fields["x"][:2])[0] * np.diff(fields["y"][:2])[0])
    touching = fields["pressure"] > 0
    counted = touching.sum(("x", "y")) * cell
    frames = np.arange(fields.sizes["time"])
    solver = 3e-6 * (1.5 + np.sin(1.7 * frames))
    force, approach = np.asarray(force, dtype=float), np.asarray(approach, dtype=float)
    return fields.assign(
        force=("time", force),
        approach=("time", approach),
        work=("time", cumulative_trapezoid(force, approach, initial=0.0)),
        contact_area=0.97 * counted,
        contact_fraction=0.97 * counted / (cell * present.sum()),
        mean_gap=fields["gap"].mean(("x", "y")),
        stated_error=("time", 6e-4 + 2 * solver),
        work_error=("time", 1e-3 * np.maximum.accumulate(np.abs(force * approach))),
        approach_error=("time", 2e-4 * np.maximum.accumulate(np.abs(approach))),
        contact_area_error=0.01 * counted,
    )


def _attributes(dataset, title, boundary):
    dataset = label(dataset)
    dataset.attrs.update(title=title, boundary=boundary, tolerance=1e-3, Conventions="CF-1.11", result_format=1)
    return dataset


def hertz_creep(shape=(61, 44), frames=30, times=None):
    """A sphere on a Zener half-space under a step load of 60 mN: contact grows over decades of time; free space."""
    radius, force, size = 10e-3, 0.06, (2.0e-3, 1.5e-3)
    (x, y), _ = _cells(shape, size)
    if times is None:
        times = np.concatenate([[0.0], np.geomspace(1e-3, 100.0, frames - 1)])[:frames]
    times = np.asarray(times, dtype=float)
    r = np.hypot(*np.meshgrid(x - size[0] / 2, y - size[1] / 2, indexing="ij"))[None]
    compliance = (1 / 12e6) * (1 + 3 * (1 - np.exp(-times / 0.5)))
    contacts = [hertz(radius, 1 / one, force) for one in compliance]
    approach = np.array([one.approach for one in contacts])
    pressure = np.array([one.pressure(r[0]) for one in contacts])
    displacement = np.array([one.displacement(r[0]) for one in contacts])
    gap = np.where(pressure > 0, 0.0, r**2 / (2 * radius) + displacement - approach[:, None, None])
    fields = xr.Dataset(
        {
            "height": (("x", "y"), -(r[0] ** 2) / (2 * radius)),
            "pressure": (("time", "x", "y"), pressure),
            "gap": (("time", "x", "y"), np.clip(gap, 0, None)),
            "displacement": (("time", "x", "y"), displacement),
        },
        coords={"time": times, "x": x, "y": y},
    )
    return _attributes(_histories(fields, np.full(len(times), force), approach), "Sphere on a Zener rubber", "free")


def rough_creep(shape=(96, 75), frames=12, absent=True, seed=5):
    """A many-spot contact that grows with the logarithm of time; periodic, with absent cells."""
    size = (1.2e-3, 0.9e-3)
    (x, y), steps = _cells(shape, size)
    height = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal(shape), 2.2, mode="wrap")
    height *= 1.5e-6 / height.std()
    if absent:
        height[20:27, 30:38] = np.nan
        height[70:73, 5:9] = np.nan
    times = np.geomspace(1e-2, 1e4, frames)
    level = np.nanmax(height) * (0.75 - 0.07 * np.log10(times / times[0]))
    over = np.nan_to_num(height, nan=-1.0)[None] - level[:, None, None]
    pressure = np.where(over > 0, np.sqrt(np.clip(over, 0, None)), 0.0)
    pressure *= 2.0 / (pressure.sum((1, 2)) * steps[0] * steps[1])[:, None, None]
    gap = np.where(np.isnan(height), np.nan, np.clip(-over, 0, None))
    fields = xr.Dataset(
        {
            "height": (("x", "y"), height),
            "pressure": (("time", "x", "y"), pressure),
            "gap": (("time", "x", "y"), gap),
        },
        coords={"time": times, "x": x, "y": y},
    )
    made = _histories(fields, np.full(frames, 2.0), np.nanmax(height) - level)
    return _attributes(made, "Ground steel on a power-law rubber", "periodic")


def one_frame():
    """The result of a single kept time."""
    return hertz_creep().isel(time=[12])


def open_contact():
    """Two frames with no contact at all, at time zero and later."""
    made = hertz_creep(times=[0.0, 1.0])
    made["pressure"][:] = 0.0
    made["gap"][:] = made["height"].max() - made["height"] + 1e-6
    for name in ("force", "contact_area", "contact_fraction", "stated_error"):
        made[name][:] = 0.0
    return made
