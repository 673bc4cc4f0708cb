"""Creep of each wave on a layered body, and the series that stands for it."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.mechanics.bodies.layered import Layered
from roughvisc.mechanics.bodies.sheet import Sheet
from roughvisc.mechanics.bodies.wave_series import Strata, wave_series

RUBBER, POLYMER = rv.zener(3e6, 1e6, 1e5, poisson=0.4), rv.zener(1e7, 2e6, 2e4, poisson=0.3)
FLUID, SOFT = rv.maxwell(1e6, 1e5), rv.kelvin_voigt(1e6, 1e5)
Q, T = np.geomspace(1e2, 3e5, 19), np.geomspace(1e-5, 1.0, 17)


@pytest.mark.parametrize("material", [RUBBER, FLUID, SOFT])
def test_creep__of_one_material_is_its_own(material):
    found = Strata((1e-4,), (material, material)).creep(Q, T)
    np.testing.assert_allclose(found, np.tile(material.contact_compliance(T), (Q.size, 1)), rtol=1e-8)


def test_creep__on_a_rigid_base_is_that_of_a_bonded_sheet():
    q = Q[Q > 2e3]
    found = Strata((1e-4,), (RUBBER, rv.elastic(1e15))).creep(q, T)
    factor = q / 2 * Sheet(1e-4, RUBBER.poisson).transfer(q, 0.0)
    np.testing.assert_allclose(found, np.outer(factor, RUBBER.contact_compliance(T)), rtol=1e-5)


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
def test_wave_series__is_as_near_as_it_says_and_has_no_negative_term(materials):
    strata = Strata((1e-4,), materials)
    found = wave_series(strata, 1e-5, 1.0, 1e-3)
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


def test_wave_series__of_one_material_has_its_times_alone():
    found = wave_series(Strata((1e-4,), (RUBBER, RUBBER)), 1e-5, 1.0, 1e-4)
    np.testing.assert_allclose(found.times, RUBBER.times)
    assert found.error < 1e-8


def test_wave_series__its_kernel_in_free_space_is_that_of_elastic_layers():
    found = wave_series(Strata((1e-4,), (rv.elastic(1e6, poisson=0.5), rv.elastic(5e6, poisson=0.3))), 0.0, 0.0, 1e-5)
    kernel, elastic = found.kernel(np.zeros(0)), Layered((1e-4,), (0.5, 0.3), (1.0, 0.2))
    far = kernel.influence((3001, 1), (1e-3, 1e-3))[1000::1000, 0]
    np.testing.assert_allclose(far, 0.25e-6 * elastic.influence((3001, 1), (1e-3, 1e-3))[1000::1000, 0], rtol=1e-4)
    expected = elastic.influence((41, 23), (1e-5, 3e-5)) * 0.25e-6
    np.testing.assert_allclose(
        kernel.influence((41, 23), (1e-5, 3e-5)), expected, rtol=1e-4, atol=1e-5 * expected.max()
    )


def test_wave_series__at_once_is_rigid_where_the_top_is():
    assert not Strata((1e-4,), (SOFT, RUBBER)).at_once(np.append(1e-8, Q)).any()
    below = Strata((1e-4,), (RUBBER, SOFT)).at_once(Q[Q > 2e3])
    factor = Q[Q > 2e3] / 2 * Sheet(1e-4, RUBBER.poisson).transfer(Q[Q > 2e3], 0.0)
    np.testing.assert_allclose(below, factor * RUBBER.contact_compliance(0.0), rtol=1e-6)
