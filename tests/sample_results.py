"""Small results for the tests of views and of storage."""

from functools import cache

import numpy as np

import roughvisc as rv


def _solved(height, material, program, times, **settings):
    settings |= {"fields": ("pressure", "gap", "displacement"), "tolerance": 1e-2, "grid_error": False}
    return rv.simulate(height, material, program, times=times, progress=False, **settings).drop_encoding()


@cache
def _ball(shape, times):
    ball = rv.from_array(rv.sphere(10e-3, (2.0e-3, 1.5e-3), shape).values, (2.0e-3 / shape[0], 1.5e-3 / shape[1]))
    program = rv.Program().load(0.06, over=0)
    program = program.hold(times[-1]) if times[-1] else program
    ds = _solved(ball, rv.zener(3e6, 1e6, 0.5e6), program, times, boundary="free", edge="accept")
    ds["displacement"][:] = ds["height"] - ds["height"].max() + ds["gap"] + ds["approach"]  # to rounding
    return ds.assign_attrs(title="Sphere on a Zener rubber")


@cache
def _rough(shape, frames, absent):
    height = rv.self_affine((1.2e-3, 0.9e-3), shape, hurst=0.8, rms_height=1.5e-6, rolloff=3e-4, seed=5)
    if absent:
        height[20:27, 30:38] = height[-3:, 5:9] = np.nan
    times = np.geomspace(1e-2, 1e4, frames)
    program, rubber = rv.Program().load(0.4, over=0).hold(1e4), rv.Prony(3e-8, 0.0, (6e-8, 12e-8), (0.1, 1e3))
    ds = _solved(height, rubber, program, times, boundary="periodic", missing="absent")
    return ds.assign_attrs(title="A rough surface on rubber")


def hertz_creep(shape=(61, 44), frames=30, times=None):
    """A sphere on a Zener half-space under a step load: contact grows over decades of time; free space."""
    times = np.append(0.0, np.geomspace(1e-3, 100.0, frames - 1)) if times is None else times
    return _ball(shape, tuple(map(float, times))).copy(deep=True)


def rough_creep(shape=(96, 75), frames=12, absent=True):
    """A contact of many spots that grows with the logarithm of time; periodic, with absent cells."""
    return _rough(shape, frames, absent).copy(deep=True)


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
