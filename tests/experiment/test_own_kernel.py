"""Bodies other than a half-space: every grid that a case is solved on has the kernel of its body."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from samples import UNIT, Scaled
from support import refused

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE, Kernel

FIELDS = ("pressure", "gap", "displacement")


def zener(times=1.0):
    return rv.zener(3e6 * times, 1e6 * times, 1e5 * times)


RAMP = rv.Program().load(1e-4, over=0.1).hold(0.3)
SMALL = rv.Program().load(1e-5, over=0.1)
JUMP = rv.Program().load(1e-4, over=0).hold(0.3)
PATHS = {
    "free": (rv.sphere(1e-3, 4e-4, (160, 128)), RAMP, {}),
    "free, grows": (rv.sphere(1e-3, 3e-5, 24), SMALL, {}),
    "free, absent cells": (rv.flat_punch(5e-5, 2e-4, (40, 30)), JUMP, {"edge": "accept"}),
    "free, grid error": (rv.sphere(1e-3, 1.2e-4, (45, 40)), SMALL, {"grid_error": True}),
    "periodic, grid error": (rv.wavy(1e-6, 1e-4, 2e-4, (48, 45)), JUMP, {"boundary": "periodic", "grid_error": True}),
}


def pressed(path, kernel, material=None):
    height, program, settings = PATHS[path]
    given = {"times": 3, "fields": FIELDS, "tolerance": 1e-2, "progress": False, **settings}
    return rv.simulate(height, rv.Body(material or zener(), kernel), program, **given)


@pytest.mark.parametrize("path", PATHS)
def test_twice_the_kernel__is_half_the_modulus(path):
    found, expected = pressed(path, Scaled(2.0)), pressed(path, HALF_SPACE, zener(0.5))
    assert set(found.variables) == set(expected.variables)
    for name in set(found.variables) - {"mean_gap"}:
        assert np.array_equal(found[name], expected[name], equal_nan=True), name
    assert found.mean_gap.values == pytest.approx(expected.mean_gap.values, rel=1e-9)
    assert (found.attrs["body"], expected.attrs["body"]) == (repr(Scaled(2.0)), "half-space")


@dataclass(frozen=True)
class Springs(Kernel):
    """A foundation of independent springs: ``u = length C p``."""

    length: float
    raises_surface: bool = False

    def influence(self, shape, spacing):
        kernel = np.zeros(shape)
        kernel[0, 0] = self.length
        return kernel

    def transfer(self, qx, qy):
        return self.length * np.ones(np.broadcast_shapes(np.shape(qx), np.shape(qy)))


def test_springs_of_the_users_own__carry_a_ball():
    """``F = pi R d^2 / (length C)`` and ``a^2 = 2 R d``."""
    ball, springs, depth = rv.sphere(1.0, 0.7, (121, 111)), rv.Body(UNIT, Springs(0.1)), 0.04
    ds = rv.simulate(ball, springs, rv.Program().approach(depth, over=0), progress=False)
    assert float(ds.force[0]) == pytest.approx(math.pi * depth**2 / 0.1, rel=1e-3)
    assert float(ds.contact_area[0]) == pytest.approx(2 * math.pi * depth, rel=0.01)


def test_kernel_that_pressure_lifts__is_refused():
    class Lifting(Springs):
        def transfer(self, qx, qy):
            return -super().transfer(qx, qy)

    height, program, settings = PATHS["periodic, grid error"]
    with refused("kernel", Lifting(0.1)):
        rv.simulate(height, rv.Body(UNIT, Lifting(0.1)), program, progress=False, **settings)
