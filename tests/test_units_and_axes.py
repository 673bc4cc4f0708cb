"""Each column of each experiment: the same in other units, and on a surface that is read along its other axis."""

import numpy as np
import pytest
import xarray as xr

import roughvisc as rv
from roughvisc.variables import VARIABLES

#: Cells of 1 : 4.
SHAPE, SIDES = (20, 7), (0.03, 0.12)
X, Y = (np.arange(count) * side for count, side in zip(SHAPE, SIDES, strict=True))
ROUGH = rv.self_affine((0.6, 0.84), SHAPE, hurst=0.8, rms_slope=0.1, seed=3).values
#: The highest point lies in the first row along y.
AT_BORDER = -0.5 * ((X[:, None] - 0.28) ** 2 + (Y + 0.03) ** 2)
WITH_HOLES = np.where(np.random.default_rng(0).random(SHAPE) > 0.15, ROUGH, np.nan)


class Frame:
    """Units in which a problem is stated, and whether x and y are exchanged."""

    def __init__(self, length=1.0, pressure=1.0, time=1.0, is_turned=False):
        self.length, self.pressure, self.time, self.is_turned = length, pressure, time, is_turned
        self.force, self.speed = pressure * length**2, length / time
        self.units = {"": 1.0, "1": 1.0, "m": length, "m^2": length**2, "s": time, "m/s": self.speed}
        self.units |= {"Pa": pressure, "N": self.force, "J": self.force * length}

    def surface(self, height):
        """Heights, of a strip of one cell too."""
        axes = ("y", "x") if self.is_turned else ("x", "y")
        sides = zip(axes, height.shape, SIDES, strict=True)
        places = {axis: self.length * side * (np.arange(count) + 0.5) for axis, count, side in sides}
        return xr.DataArray(self.length * height, places, axes).transpose("x", "y")

    def ball(self):
        """Ball that is pressed beyond its border, so that its grid grows."""
        size, shape = (0.3 * self.length, 0.24 * self.length), (14, 7)
        return rv.sphere(self.length, size[::-1] if self.is_turned else size, shape[::-1] if self.is_turned else shape)

    def direction(self, along_x):
        return along_x.replace("x", "y") if self.is_turned else along_x

    def zener(self, stiffer=1.0, slower=1.0, poisson=0.5):
        modulus = stiffer * self.pressure
        return rv.zener(modulus, modulus, 0.3 * slower * modulus * self.time, poisson)

    def layers(self):
        return rv.layer(self.zener(), 0.05 * self.length, on=self.zener(2.0, 5.0, 0.3))

    def sheet(self):
        return rv.sheet(self.zener(poisson=0.4), 0.1 * self.length)

    def power_law(self):
        return rv.power_law(0.3 / self.pressure, 1 / self.pressure, 0.4, time_scale=self.time)

    def kelvin_voigt(self):
        return rv.kelvin_voigt(self.pressure, 0.2 * self.pressure * self.time)

    def loads(self):
        program = rv.Program().load(0.02 * self.force, over=0.5 * self.time).hold(0.5 * self.time, control="approach")
        return program.load(0.01 * self.force, over=0).hold(0.3 * self.time)

    def approaches(self):
        program = rv.Program().approach(0.01 * self.length, over=0.5 * self.time).hold(0.5 * self.time)
        return program.approach(-0.01 * self.length, over=0.2 * self.time).approach(0.008 * self.length, over=self.time)

    def cycles(self):
        return rv.Program.cycle(0.02 * self.force, 0.015 * self.force, 0.5 * self.time, 2)

    def slide(self):
        program = rv.Program().load(0.02 * self.force, over=0)
        program = program.slide(0.3 * self.length, speed=0.5 * self.speed, direction=self.direction("-x"))
        return program.hold(0.2 * self.time)

    def result(self, variable):
        """Values of a variable of a result in the units and axes of the first frame."""
        values = variable.values / self.units[VARIABLES[variable.name].units]
        if self.is_turned and variable.dims[-2:] == ("x", "y"):
            return values.swapaxes(-1, -2)
        return -values if self.is_turned and variable.name == "friction_force_across" else values


FIRST = Frame()
#: Kilometres, and forces 1e9 times as large; nanometres, and forces 1e-6 times as large, with x and y exchanged. Powers
#: of two keep the rounding.
OTHERS = (Frame(2.0**10, 2.0**10, 2.0**-10), Frame(2.0**-30, 2.0**40, 2.0**10, is_turned=True))


def assert_same(found, expected, frame, but=(), stops_alike=True):
    """Compare all columns; a column that takes one side, or one unit, for another one differs."""
    assert found.variables.keys() == expected.variables.keys()
    for name in set(expected.variables) - {"x", "y", "wall_time", "convolutions", *but}:
        wanted = expected[name].values
        # by rounding the solver may stop one iteration earlier, and stated errors contain its error
        part = 0.25 if name == "residual" or (name.endswith("_error") and not stops_alike) else 1e-3
        precision = part * np.abs(wanted).max(initial=1e-300, where=np.isfinite(wanted))
        np.testing.assert_allclose(frame.result(found[name]), wanted, rtol=0, atol=precision, err_msg=name)


FREE = {"boundary": "free", "edge": "accept"}
#: Surface, body, program and settings.
CASES = {
    "loads": (ROUGH, Frame.zener, Frame.loads, {"grid_error": True}),
    "peak at the border": (AT_BORDER, Frame.zener, Frame.approaches, {"grid_error": True, **FREE}),
    "ball": (Frame.ball, Frame.zener, Frame.approaches, {"boundary": "auto"}),
    "mirror": (ROUGH, Frame.zener, Frame.loads, {"grid_error": True, "boundary": "mirror"}),
    "absent cells": (WITH_HOLES, Frame.zener, Frame.approaches, {"missing": "absent", **FREE}),
    "strip of one cell": (ROUGH[:, :1], Frame.zener, Frame.loads, FREE),
    "strip of two cells": (ROUGH[:, :2], Frame.zener, Frame.approaches, {"grid_error": True}),
    "cycles": (ROUGH, Frame.zener, Frame.cycles, {}),
    "power law": (ROUGH, Frame.power_law, Frame.approaches, {}),
    "no instantaneous compliance": (ROUGH[:, :2], Frame.kelvin_voigt, Frame.approaches, {}),
    "sheet": (ROUGH, Frame.sheet, Frame.loads, FREE),
    "layers": (ROUGH, Frame.layers, Frame.loads, {}),
    "slide": (ROUGH, Frame.zener, Frame.slide, {"grid_error": True}),
    "slide on layers": (ROUGH, Frame.layers, Frame.slide, {}),
}


SLOW = ("layers", "slide on layers", "slide", "mirror")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.thorough if name in SLOW else ()) for name in CASES]
)
def test_rows_and_steps_of_a_program__are_neutral_to_units_and_axes(name):
    height, body, program, settings = CASES[name]
    settings = {
        "boundary": "periodic",
        "times": 5,
        "tolerance": 1e-2,
        "fields": ("pressure", "gap", "displacement"),
    } | settings

    def pressed(frame):
        surface = height(frame) if callable(height) else frame.surface(height)
        rows = rv.simulate(surface, body(frame), program(frame), progress=False, **settings)
        return rows, rows.roughvisc.steps

    expected = pressed(FIRST)
    for frame in OTHERS:
        results = pressed(frame)
        stops_alike = np.allclose(results[1].residual, expected[1].residual, rtol=1e-3)
        for found, wanted in zip(results, expected, strict=True):
            assert_same(found, wanted, frame, stops_alike=stops_alike)


@pytest.mark.parametrize("body", [Frame.zener, Frame.sheet, Frame.layers])
def test_rows_of_steady_sliding__are_neutral_to_units_and_axes(body):
    """The grid error depends on which cells a coarser grid keeps, and those on the side that the surface leads with."""

    def slid(frame):
        curve = {"speeds": [0.5 * frame.speed, 0.05 * frame.speed], "load": 0.02 * frame.force}
        settings = {"direction": frame.direction("x"), "fields": ("pressure", "gap"), "grid_error": True}
        return rv.friction(frame.surface(ROUGH), body(frame), **curve, **settings, progress=False)

    expected = slid(FIRST)
    of_grids = {variable.grid_error for variable in VARIABLES.values()}
    for frame in OTHERS:
        assert_same(slid(frame), expected, frame, of_grids if frame.is_turned else ())


@pytest.mark.parametrize("program", [Frame.loads, Frame.slide])
def test_periodic_surface_that_begins_elsewhere__has_the_same_rows(program):
    """Contact across the border is contact like any other."""
    settings = {"boundary": "periodic", "times": 5, "tolerance": 1e-2, "fields": ("pressure",), "progress": False}
    surface, shift = FIRST.surface(ROUGH), {"x": 14, "y": 4}
    moved = surface.roll(shift)
    found, wanted = (rv.simulate(one, FIRST.zener(), program(FIRST), **settings) for one in (moved, surface))
    assert ((wanted.pressure[-1, :, 0] > 0) & (wanted.pressure[-1, :, -1] > 0)).any()
    assert_same(found, wanted.roll(shift), FIRST)
    assert_same(found.roughvisc.steps, wanted.roughvisc.steps, FIRST)
