"""Bodies other than a half-space: every grid that a case is solved on has the kernel of its body."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from samples import Scaled

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE, Kernel
from roughvisc.mechanics.half_space import love_kernel

FIELDS = ("pressure", "gap", "displacement")
#: What counts time, and what knows a closed form of the half-space.
_NOT_ALIKE = {"wall_time", "mean_gap", "step_mean_gap"}


@dataclass(frozen=True)
class Screened(Kernel):
    """``exp(-k r) / (pi r)``, whose transform is ``2 / sqrt(q^2 + k^2)``: beyond ``1/k`` pressure is not felt."""

    k: float
    raises_surface: bool = False

    def influence(self, shape, spacing):
        nodes, weights = np.polynomial.legendre.leggauss(6)
        x, y = (np.arange(n) * side for n, side in zip(shape, spacing, strict=True))
        r = np.hypot(
            (x[:, None] + 0.5 * spacing[0] * nodes)[:, None, :, None],
            (y[:, None] + 0.5 * spacing[1] * nodes)[None, :, None, :],
        )
        beside_love = np.einsum("ijkl,k,l->ij", np.expm1(-self.k * r) / r, weights, weights) / (4 * math.pi)
        return love_kernel(shape, spacing) + spacing[0] * spacing[1] * beside_love

    def transfer(self, qx, qy):
        return 2 / np.sqrt(np.hypot(qx, qy) ** 2 + self.k**2)


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
    "periodic, approach": (
        rv.wavy(1e-6, 1e-4, 1e-4, 32),
        rv.Program().approach(5e-7, over=0.1),
        {"boundary": "periodic"},
    ),
}


def pressed(path, kernel, material=None):
    height, program, settings = PATHS[path]
    given = {"times": 3, "fields": FIELDS, "tolerance": 1e-2, "progress": False, **settings}
    return rv.simulate(height, rv.Body(material or zener(), kernel), program, **given)


@pytest.mark.parametrize("path", PATHS)
def test_twice_the_kernel__is_half_the_modulus(path):
    found, expected = pressed(path, Scaled(2.0)), pressed(path, HALF_SPACE, zener(0.5))
    assert set(found.variables) == set(expected.variables)
    for name in set(found.variables) - _NOT_ALIKE:
        assert np.array_equal(found[name], expected[name], equal_nan=True), name
    assert found.mean_gap.values == pytest.approx(expected.mean_gap.values, rel=1e-9)
    assert found.attrs["kernel"] == repr(Scaled(2.0))
    assert "kernel" not in expected.attrs


def test_a_local_kernel__presses_springs():
    """Where 1/k is far smaller than the contact, u = (2/k) C p: springs, on which a ball has F = pi R d^2 k / (2 C)."""
    radius, depth, k, soft = 1e-3, 1e-6, 2e6, rv.elastic(1e6)
    ball = rv.sphere(radius, 1.2e-4, (121, 111))
    springs = rv.Body(soft, Screened(k))
    ds = rv.simulate(ball, springs, rv.Program().approach(depth, over=0), times=[0.0], progress=False)
    compliance = float(soft.contact_compliance(0.0))
    assert float(ds.force[0]) == pytest.approx(math.pi * radius * depth**2 * k / (2 * compliance), rel=0.05)


@pytest.mark.parametrize("control", ["load", "approach"])
def test_a_kernel_with_a_mean__has_an_approach_under_uniform_pressure(control):
    """A flat punch over the whole period: u = (2/k) C p everywhere, and approaches beyond full contact exist."""
    k, soft, size = 1e4, rv.elastic(1e6), 1e-3
    compliance = float(soft.contact_compliance(0.0))
    pressure, surface = 1e4, rv.wavy(1e-8, size, size, (24, 21))
    full = float((surface.max() - surface).mean()) + 2 / k * compliance * pressure
    load = pressure * size**2
    program = rv.Program().load(load, over=0) if control == "load" else rv.Program().approach(full, over=0)
    springs = rv.Body(soft, Screened(k))
    ds = rv.simulate(surface, springs, program, boundary="periodic", times=[0.0], progress=False)
    assert ds.attrs["kernel"]
    assert float(ds.approach[0]) == pytest.approx(full, rel=1e-3)
    assert float(ds.force[0]) == pytest.approx(load, rel=1e-3)
    assert float(ds.contact_fraction[0]) == 1
