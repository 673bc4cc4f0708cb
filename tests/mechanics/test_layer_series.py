"""Creep of each wave on a layered body, and the series that stands for it."""

import numpy as np
import pytest
from samples import COMPRESSIBLE as RUBBER
from samples import POLYMER

import roughvisc as rv
from roughvisc.mechanics.layer import Layers, layer_series
from roughvisc.mechanics.sheet import Sheet

FLUID, SOFT = rv.maxwell(1e6, 1e5), rv.kelvin_voigt(1e6, 1e5)
Q, T = np.geomspace(1e2, 3e5, 19), np.geomspace(1e-5, 1.0, 17)


@pytest.mark.parametrize(
    "materials",
    [
        (RUBBER, POLYMER),
        (rv.elastic(1e9), RUBBER),
        (RUBBER, rv.elastic(1e9)),
        (FLUID, POLYMER),
        (rv.elastic(1e7), FLUID),
        (RUBBER, SOFT),
    ],
)
def test_layer_series__is_as_near_as_it_says_and_has_no_negative_term(materials):
    strata = Layers((1e-4,), materials)
    found = layer_series(strata, 1e-5, 1.0, 1e-3)
    assert found.error <= 1e-3
    assert (found.compliances >= 0).all()
    q, t = np.exp(np.random.default_rng(1).uniform(np.log(1e2), np.log(3e5), 40)), np.geomspace(1.3e-5, 0.9, 23)
    at_once, *terms = (found.kernel(one, first).transfer(q, 0.0) * q / 2 for first, one in _each(found))
    series = at_once[:, None] + np.transpose(terms) @ np.array([found.crept(one) for one in t]).T
    np.testing.assert_allclose(series, strata.creep(q, t), rtol=1.2e-3)
    np.testing.assert_allclose(at_once, strata.at_once(q), rtol=1e-3, atol=1e-3 * series[:, 0].min())


def _each(series):
    """``C_0`` alone, then each term alone."""
    count = len(series.compliances)
    return [(1.0, np.zeros(count)), *((0.0, one) for one in np.eye(count))]


@pytest.mark.parametrize("boundary", [pytest.param("free", marks=pytest.mark.thorough), "periodic"])
def test_layer_series__its_kernels_add_up_to_those_of_the_elastic_body_after_some_time(boundary):
    """In free space the kernel of each exponential has images of its own."""
    materials, t = (RUBBER, POLYMER), 0.03
    found = layer_series(Layers((1e-4,), materials), 1e-5, 1.0, 1e-4)
    elastic = [rv.elastic(1 / one.glassy, one.poisson) for one in materials]
    exact = rv.layer(elastic[0], 1e-4, on=elastic[1]).kernel
    unit = float(materials[0].contact_compliance(0.0))

    def of(kernel):
        return kernel.transfer(Q, 0.0) if boundary == "periodic" else kernel.influence((41, 23), (2e-5, 3e-5))

    np.testing.assert_allclose(of(found.kernel()), unit * of(exact), rtol=3e-5)
    crept = found.crept(t)
    terms = sum(weight * of(found.kernel(one, 0.0)) for weight, one in zip(crept, np.eye(crept.size), strict=True))
    whole = of(found.kernel(crept))
    np.testing.assert_allclose(of(found.kernel()) + terms, whole, rtol=1e-5)


def test_layer_series__at_once_is_rigid_where_the_top_is():
    assert not Layers((1e-4,), (SOFT, RUBBER)).at_once(np.append(1e-8, Q)).any()
    below = Layers((1e-4,), (RUBBER, SOFT)).at_once(Q[Q > 2e3])
    factor = Q[Q > 2e3] / 2 * Sheet(1e-4, RUBBER.poisson).transfer(Q[Q > 2e3], 0.0)
    np.testing.assert_allclose(below, factor * RUBBER.contact_compliance(0.0), rtol=1e-6)
