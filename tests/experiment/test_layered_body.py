"""Layers from the surface to the result, against solutions that are found another way."""

import numpy as np
import pytest
from layered_ball import POISSONS, errors
from references.half_space import Cone, Paraboloid
from references.layered import ElasticLayer, OnSheet

import roughvisc as rv
from roughvisc.mechanics.layer import effective_compliance

THICKNESS = 1e-4


def pressed(height, body, program, **settings):
    return rv.simulate(height, body, program, **{"progress": False, **settings})


@pytest.mark.thorough
@pytest.mark.parametrize("poissons", POISSONS)
@pytest.mark.parametrize(("ratio", "wide"), [(0.01, 0.1), (0.5, 1.0), (100.0, 10.0)])
def test_elastic_ball__agrees_with_the_integral_equation(ratio, wide, poissons):
    assert max(errors(ratio, wide, poissons, 129)) < 1e-3


def test_cone__agrees_with_the_integral_equation():
    layer, a = ElasticLayer(THICKNESS, 0.5, 0.3, 0.2), 1.5 * THICKNESS
    body = rv.layer(rv.elastic(1e6), THICKNESS, on=rv.elastic(5e6, 0.3))
    exact = OnSheet(Cone(0.1), layer)
    load = rv.Program().load(float(exact.scaled_force(a)) * 4e6, over=0)
    ds = pressed(rv.cone(0.1, 2.6 * a, 65), body, load)
    assert float(ds.approach[0]) == pytest.approx(float(exact.reduced(a)), rel=1e-3)


@pytest.mark.thorough
def test_pressure__is_that_of_the_integral_equation_and_converges():
    a = 1.2 * THICKNESS
    exact = OnSheet(Paraboloid(20 * a), ElasticLayer(THICKNESS, 0.5, 0.3, 20.0))
    body = rv.layer(rv.elastic(1e6), THICKNESS, on=rv.elastic(1e6 / 20, 0.3))
    load, left = rv.Program().load(float(exact.scaled_force(a)) * 4e6, over=0), []
    for cells in (33, 65, 129):
        ds = pressed(rv.sphere(20 * a, 2.6 * a, cells), body, load, tolerance=1e-6)
        at = np.hypot(ds.x.values[:, None] - 1.3 * a, ds.y.values - 1.3 * a)
        pressure = exact.scaled_pressure(at, a) * 4e6
        left.append(np.abs(ds.pressure[0].values - pressure).sum() / pressure.sum())
    assert left[-1] < 2e-3
    assert -np.polyfit(np.log([33, 65, 129]), np.log(left), 1)[0] > 1.2  # 1.5 on a half-space


def far_apart(ratio, thickness):
    """A layer on a half-space whose moduli are so many times smaller, and a program for it."""
    top = 1e6 * ratio
    body = rv.layer(rv.zener(2 * top, top, 0.1 * top, 0.4), thickness, on=rv.zener(2e6, 1e6, 5e5, 0.5))
    c = float(effective_compliance(3e4, (thickness,), (0.4, 0.5), (1e-6 / ratio, 1e-6)))
    return body, rv.Program().pressure(0.01 / c, over=0.05).hold(0.05)


FAR_APART = {
    "layer softer by 1e5": (1e-5, 5e-5, (21, 24), False),
    "layer stiffer by 1e3": (1e3, 5e-5, (21, 24), False),
    "film stiffer by 1e3, under a jump": (1e3, 1.5e-5, (64, 63), True),  # it bends over a good part of the surface
    "film stiffer by 1e4": (1e4, 1.5e-5, (64, 63), False),
}


@pytest.mark.thorough
@pytest.mark.parametrize("boundary", ["free", "periodic", "mirror"])
@pytest.mark.parametrize("case", FAR_APART)
def test_moduli_far_apart__keep_the_tolerance(boundary, case):
    """Of a layer and its base: the pressure at two tolerances differs by less than the larger one."""
    ratio, thickness, shape, jumps = FAR_APART[case]
    height = rv.self_affine(1e-3, shape, hurst=0.8, rms_slope=0.1, rolloff=5e-4, seed=1)
    body, program = far_apart(ratio, thickness)
    if jumps:
        program = rv.Program().load(10 * program.on_area(1e-6).largest_load, over=0)
    settings = {"boundary": boundary, "times": 2, "edge": "accept"}
    coarse, fine = (pressed(height, body, program, tolerance=one, **settings) for one in (1e-3, 1e-4))
    apart = abs(coarse.pressure - fine.pressure).sum(["x", "y"]) / fine.pressure.sum(["x", "y"])
    assert float(apart.max()) < 1.1e-3
    assert float(coarse.stated_error.max()) <= 1e-3
