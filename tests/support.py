"""What tests of several modules share: cases, scenes, and how they are looked at."""

import codecs
import re

import numpy as np
import pytest
import xarray as xr
from references.half_space import lee_radok_step
from samples import RUBBER

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.memory import Memory
from roughvisc.mechanics.stepping import Scene
from roughvisc.runs.netcdf import open_result
from roughvisc.study.case import changed, read_study
from roughvisc.variables import VARIABLES

#: The ball, the rubber and the press of BALL.
RADIUS, LOAD, SIZE, TIMES = 10e-3, 5e-3, (1e-3, 1e-3), [0.0, 0.1, 0.2]
PRESS = rv.Program().load(LOAD, over=0).hold(0.2)
EXACT = lee_radok_step(RADIUS, RUBBER, LOAD)


def true_errors(ds):
    """Of pressure and approach, the larger; and of the corrected area, each at its worst time."""
    r = np.hypot(ds.x.values[:, None] - SIZE[0] / 2, ds.y.values - SIZE[1] / 2)
    cell = float(np.prod([SIZE[i] / ds.sizes[axis] for i, axis in enumerate(("x", "y"))]))
    pressure = [np.abs(ds.pressure[i].values - EXACT.pressure(r, t)).sum() * cell / LOAD for i, t in enumerate(TIMES)]
    approach = np.abs(ds.approach.values - EXACT.approach(TIMES)) / EXACT.approach(TIMES[-1])
    area = np.abs(ds.contact_area.values / (np.pi * EXACT.radius(TIMES) ** 2) - 1)
    return max(*pressure, *approach), float(area.max())


BALL = """
title = "A ball"
[surface]
generate = "sphere"
radius = "10 mm"
size = "1 mm"
shape = [24, 21]
level = 0    # what is conditioned counts as measured: its grid does not grow
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
load = "5 mN"
over = 0
[[program]]
hold = "0.2 s"
[solve]
boundary = "free"
[keep]
fields = ["pressure", "displacement"]
times = [0, "0.1 s", "200 ms"]
"""

LOADS = '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n"material.kelvin_viscosity" = ["0.05 MPa s", "0.1 MPa s"]\n'
#: Fewer cells, for what takes its time in files.
SMALL = BALL.replace("[24, 21]", "[12, 9]")
#: Takes some seconds a case, in steps of milliseconds.
LONG = BALL.replace("[keep]", 'time_step = "100 us"\n[keep]')


def numbers(folder):
    """Every result in a folder, see :func:`with_steps`."""
    found = {}
    for path in sorted(folder.glob("*.nc")):
        with open_result(path) as ds:
            found[path.name] = with_steps(ds)
    return found


def at_rows(ds):
    """Histories of a result over time at its rows, with what only the steps have."""
    return rv.observables.history(ds).sel(time=ds.time)


def assert_missing_as_declared(ds):
    """A value is NaN only if its variable declares when it is missing; a bound or a conductance may be infinite."""
    for name, values in ds.variables.items():
        if values.dtype.kind == "f" and not VARIABLES[str(name)].missing:
            assert not values.isnull().any(), name


def with_steps(ds):
    """Every variable of a result, and over time of its steps, without the wall time."""
    if "time" not in ds.dims:
        return ds.load().drop_vars("wall_time")
    steps = ds.roughvisc.steps.drop_vars("wall_time").reset_coords()
    return ds.load().assign({f"step_{name}": variable for name, variable in steps.items()})


def assert_same(one, other):
    assert one.keys() == other.keys()
    for name, ds in one.items():
        xr.testing.assert_equal(ds, other[name])


def direct(pressure, spacing):
    """Superposition of cells, one by one."""
    nx, ny = pressure.shape
    kernel = HALF_SPACE.influence(pressure.shape, spacing)
    i, j = np.arange(nx), np.arange(ny)
    influence = kernel[np.abs(i[:, None] - i)[:, None, :, None], np.abs(j[:, None] - j)[None, :, None, :]]
    return np.einsum("ijkl,kl->ij", influence, pressure)


def rough_gap(shape, seed=0, slope=1.0):
    """Gap under a random surface with a fixed spectrum; cells are one long."""
    rng = np.random.default_rng(seed)
    qx, qy = np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None, :]
    amplitude = np.maximum(np.hypot(qx, qy), 4 / max(shape)) ** -1.8
    amplitude[np.hypot(qx, qy) > 0.2] = 0
    amplitude[0, 0] = 0
    height = np.fft.irfft2(amplitude * np.fft.rfft2(rng.standard_normal(shape)), s=shape)
    height *= slope / np.sqrt(np.mean(np.gradient(height, axis=0) ** 2 + np.gradient(height, axis=1) ** 2))
    return height.max() - height


def scene(material, program, *, shape=(31, 28), size=1.6, **settings):
    """A sphere of unit radius, its apex on a cell centre."""
    spacing = (size / shape[0], size / shape[1])
    x, y = ((np.arange(n) - n // 2) * d for n, d in zip(shape, spacing, strict=True))
    gap = (x[:, None] ** 2 + y[None, :] ** 2) / 2
    boundary = settings.pop("boundary", "free")
    memory = Memory(material, program.duration, settings.pop("keeps_pressure", False))
    return Scene(Grid(shape, spacing, boundary), gap, memory, program, settings.pop("times", None), **settings)


def displaced(scene, step):
    """Displacement after a step. [m]"""
    return scene.memory.displacement(step.point.history)[0]


#: The same ball on more cells, as a recipe whose grid may grow.
STUDY = re.sub("level = 0.*\n", "", BALL).replace("[24, 21]", "[33, 31]").replace('[solve]\nboundary = "free"\n', "")
ROUGH = """
[surface]
generate = "self_affine"
size = "1 mm"
shape = [30, 26]
hurst = 0.8
rms_slope = 0.1
shortcut = "0.2 mm"
seed = 3
[material]
model = "maxwell"
shear_modulus = "1 MPa"
viscosity = "1 MPa s"
[[program]]
load = "10 mN"
over = "50 ms"
[solve]
boundary = "periodic"
[keep]
times = [0, "20 ms", "50 ms"]
"""

FRICTION = """
title = "Sliding"
[surface]
generate = "self_affine"
size = ["1 mm", "0.8 mm"]
shape = [26, 21]
hurst = 0.8
rms_slope = 0.1
rolloff = "0.5 mm"
shortcut = "0.16 mm"
seed = 1
[material]
model = "zener"
shear_modulus = "1 MPa"
kelvin_modulus = "0.3 MPa"
kelvin_viscosity = "0.3 kPa s"
[friction]
pressure = "20 kPa"
speeds = { from = "2 mm/s", to = "2 m/s", count = 4 }
[solve]
boundary = "periodic"
"""


def case_of(tmp_path, text=STUDY, **changes):
    path = tmp_path / "study.toml"
    path.write_text(text)
    return changed(read_study(path), {key.replace("__", "."): value for key, value in changes.items()})


def measured(case, *settings, **options):
    return rv.trade(case, settings, **{"progress": False, **options})


def lines(ax):
    return {line.get_label(): line for line in ax.lines}


def relative_errors(found, exact):
    """Of each row the largest of pressure, force and approach, over the largest force and approach so far."""
    cell = float(np.prod([float(exact[axis][1] - exact[axis][0]) for axis in ("x", "y")]))
    force, approach = (np.maximum.accumulate(abs(exact[name].values)) for name in ("force", "approach"))
    apart = {name: abs(found[name].values - exact[name].values) for name in ("pressure", "force", "approach")}
    errors = [
        (apart["pressure"].sum(axis=(1, 2)) * cell, force),
        (apart["force"], force),
        (apart["approach"], approach),
    ]
    return np.max([np.divide(one, scale, out=np.zeros_like(one), where=scale > 0) for one, scale in errors], axis=0)


#: Encoding of a text file -> the bytes of a text.
ENCODINGS = {
    "UTF-8": str.encode,
    "UTF-8 with its mark": lambda text: text.encode("utf-8-sig"),
    "UTF-16 little": lambda text: codecs.BOM_UTF16_LE + text.encode("utf-16-le"),
    "UTF-16 big": lambda text: codecs.BOM_UTF16_BE + text.encode("utf-16-be"),
    "Latin-1": lambda text: text.encode("latin-1"),
}


def refused(key=None, found=None):
    """Expect an InputError at this key, and with this value if one is given."""

    def matches(error):
        return (key is None or error.key == key) and (found is None or error.found is found or error.found == found)

    return pytest.raises(rv.InputError, check=matches)
