"""Layers on a half-space: the response of waves, the kernel in free space, and the friction of full contact."""

import math

import numpy as np
import pytest
from scipy.special import j0
from support import refused

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE
from roughvisc.mechanics.layer import effective_compliance


def elastic(thicknesses, poissons, compliances):
    """Kernel of elastic layers, whose shear compliances are given."""
    *layers, body = (rv.elastic(1 / one, poisson=nu) for one, nu in zip(compliances, poissons, strict=True))
    for h, material in zip(thicknesses[::-1], layers[::-1], strict=True):
        body = rv.layer(material, h, on=body)
    return body.kernel


@pytest.mark.parametrize("ratio", [1e-5, 1e-3, 0.02, 50.0, 1e3, 1e5])
def test_kernel__its_transform_is_the_exact_response_between_its_waves_too(ratio):
    q = np.geomspace(1e-6, 100, 1000)
    exact = effective_compliance(q, (1.0,), (0.5, 0.3), (4.0, 4.0 * ratio))
    np.testing.assert_allclose(elastic((1.0,), (0.5, 0.3), (1.0, ratio)).transfer(q, 0.0) * q / 2, exact, rtol=2e-6)


@pytest.mark.parametrize(("ratio", "relative"), [(1e-3, 1e-3), (0.02, 2e-4), (50.0, 2e-4), (1e3, 2e-4), (1e5, 2e-4)])
def test_kernel__in_free_space_is_the_transform_of_its_response(ratio, relative):
    """At distances of one and of three thicknesses. A cell's mean differs from its centre by the square of the cell."""
    kernel, side = elastic((1.0,), (0.5, 0.3), (1.0, ratio)), 0.05
    found, love = kernel.influence((61, 2), (side, side)), HALF_SPACE.influence((61, 2), (side, side))
    nodes, weights = np.polynomial.legendre.leggauss(20)
    ends = np.concatenate([[0], np.geomspace(1e-8, 1e-2, 200), np.linspace(1e-2, 30, 600)[1:]])
    halves = np.diff(ends)[:, None] / 2
    q, weights = (ends[:-1, None] + halves * (nodes + 1)).ravel(), (halves * weights).ravel()
    factor = effective_compliance(q, (1.0,), (0.5, 0.3), (4.0, 4.0 * ratio))
    for cell in (20, 60):
        rest = weights @ ((factor - 1) * j0(q * cell * side)) / math.pi * side**2
        assert found[cell, 0] - love[cell, 0] == pytest.approx(rest, abs=1e-4 * love[cell, 0], rel=relative)


#: Thicknesses of two layers.
FAR_APART = [(0.01, 1.0), (1.0, 0.01)]


@pytest.mark.parametrize(
    ("sides", "thicknesses"), [((0.3, 1.2), (0.5, 0.5)), ((4.0, 1.0), FAR_APART[0]), ((4.0, 5.2), FAR_APART[1])]
)
def test_kernel__displacement_by_a_cell_is_that_by_its_nine_parts(sides, thicknesses):
    kernel = elastic(thicknesses, (0.5, 0.1, 0.3), (1.0, 0.1, 8.0))
    whole = kernel.influence((15, 17), sides)
    parts = kernel.influence((50, 50), (sides[0] / 3, sides[1] / 3))
    for i, j in ((0, 0), (2, 1), (14, 5), (3, 15)):
        near = [abs(np.arange(3 * at - 1, 3 * at + 2)) for at in (i, j)]
        assert parts[np.ix_(*near)].sum() == pytest.approx(whole[i, j], rel=1e-7)


@pytest.mark.parametrize("thicknesses", FAR_APART)
def test_layer__lies_on_another_one(thicknesses):
    """Waves much shorter than the thinner layer, much longer than the thicker one, and all between."""
    soft, hard, base = rv.elastic(1e6), rv.elastic(1e8), rv.elastic(1e7)
    both = rv.layer(soft, thicknesses[0], on=rv.layer(hard, thicknesses[1], on=base))
    assert both.thicknesses == thicknesses
    assert both.materials == (soft, hard, base)
    q = np.geomspace(1e-8, 1e5, 500)
    exact = effective_compliance(q, thicknesses, (0.5, 0.5, 0.5), (1.0, 0.01, 0.1))
    np.testing.assert_allclose(both.kernel.transfer(q, 0.0) * q / 2, 4 * exact, rtol=2e-6)
    assert rv.layer(soft, math.inf, on=base) == rv.Body(soft)


def test_creep_functions_that_do_not_creep__are_elastic_layers():
    ball, press = rv.sphere(1e-3, 2e-4, 21), rv.Program().load(1e-4, over=0.1)
    # the table ends before the age at which the kernel is computed otherwise
    constant = rv.creep_table((0.0, 0.05, 0.2), (1e-6, 1e-6, 1e-6), kind="shear"), rv.creep(lambda t: 1e-7 + 0 * t)
    found = rv.simulate(ball, rv.layer(constant[0], 1e-4, on=constant[1]), press, progress=False)
    expected = rv.simulate(ball, rv.layer(rv.elastic(1e6), 1e-4, on=rv.elastic(1e7)), press, progress=False)
    assert float(found.approach[-1]) == pytest.approx(float(expected.approach[-1]), rel=1e-4)


VISCOUS = rv.kelvin_voigt(1e6, 1e5)


ON_LAYER = rv.layer(VISCOUS, 1e-5, on=rv.elastic(1e7))


@pytest.mark.parametrize(
    ("on", "hold", "boundary"),
    [
        (VISCOUS, 0, "free"),
        pytest.param(VISCOUS, 0.1, "free", marks=pytest.mark.thorough),
        (ON_LAYER, 0, "free"),
        pytest.param(ON_LAYER, 0.1, "periodic", marks=pytest.mark.thorough),
    ],
    ids=["half-space", "half-space, held", "layer", "layer, held"],
)
def test_layer_on_a_body_without_instantaneous_compliance__is_at_first_a_bonded_sheet(on, hold, boundary):
    ball, rubber, jump = rv.sphere(1e-3, 2e-4, 21), rv.elastic(1e7), rv.Program().load(1e-4, over=0)
    settings = {"boundary": boundary, "times": [0.0], "progress": False}
    found = rv.simulate(ball, rv.layer(rubber, 2e-5, on=on), jump.hold(hold) if hold else jump, **settings)
    expected = rv.simulate(ball, rv.sheet(rubber, 2e-5), jump, **settings)
    assert float(found.approach[0]) == pytest.approx(float(expected.approach[0]), rel=2e-5)
    assert "series" not in found.attrs.get("warnings", "")


SOLID, SHEET = rv.elastic(1e6), rv.sheet(rv.elastic(1e6), 1e-3)


@pytest.mark.parametrize(
    ("material", "thickness", "on", "key", "found"),
    [
        (SOLID, 0.0, SOLID, "thickness", 0.0),
        (SOLID, 1e-3, SHEET, "on", SHEET),
        (SHEET, 1e-3, SOLID, "material", SHEET),
        (rv.elastic(1e6, poisson=-0.2), 1e-3, SOLID, "material", -0.2),
        (SOLID, 1e-3, rv.pair(SOLID, SOLID), "on", None),
        (SOLID, 1e-3, 2e6, "on", 2e6),
    ],
)
def test_layer__refuses(material, thickness, on, key, found):
    with refused(key, found):
        rv.layer(material, thickness, on=on)
