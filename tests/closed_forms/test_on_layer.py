"""A layer on a half-space: the equations of elasticity, published solutions, limits, and contact on it."""

import math

import mpmath as mp
import numpy as np
import pytest
from layered import (
    GrowingOnLayer,
    elastic_factor,
    inverted,
)
from references import ElasticLayer, OnSheet, PunchOnSheet
from references.growing_contact import StepLoad
from references.indenters import Paraboloid
from references.layer import layer_complement, layer_factor
from scipy.special import j0

import roughvisc as rv
from roughvisc.mechanics.sheet import reduction

POISSON = [(0.0, 0.3), (0.3, 0.3), (0.4, 0.5), (0.5, 0.5), (0.5, 0.0)]
SOFT = rv.zener(1e6, 3e5, 1e5, 0.4)


@pytest.mark.parametrize(("poisson", "base_poisson"), POISSON)
@pytest.mark.parametrize("ratio", [1e-4, 0.1, 3.0, 1e4, 0.3 + 0.5j, 20 - 40j])
def test_factor__solves_the_equations_of_elasticity(poisson, base_poisson, ratio):
    x = np.array([1e-6, 0.01, 0.3, 0.49, 0.51, 2.0, 7.0])
    exact = [elastic_factor([one], (poisson, base_poisson), (ratio, 1)) for one in x]
    np.testing.assert_allclose(layer_factor(x, poisson, base_poisson, ratio), exact, rtol=1e-14)


@pytest.mark.parametrize(("poisson", "base_poisson"), POISSON)
@pytest.mark.parametrize("ratio", [1e-12, 1e-4, 0.5, 3.0, 1e8])
def test_factor__loses_nothing_to_cancellation(poisson, base_poisson, ratio):
    """Against the equation as published, at high precision; the base nearly rigid, or the layer nearly a plate."""
    for x in (1e-9, 1e-3, 0.2, 0.6, 4.0, 30.0):
        with mp.workdps(60):
            k, base_k, mu, e = (
                3 - 4 * mp.mpf(poisson),
                3 - 4 * mp.mpf(base_poisson),
                mp.mpf(ratio),
                mp.exp(-2 * mp.mpf(x)),
            )
            l, m = (mu * base_k - k) / (mu * base_k + 1), (mu - 1) / (mu + k)
            exact = (1 + 4 * m * x * e - l * m * e**2) / (1 - (l + m + 4 * m * mp.mpf(x) ** 2) * e + l * m * e**2)
        assert float(layer_factor(x, poisson, base_poisson, ratio)) == pytest.approx(float(exact), rel=5e-15, abs=0)
        if abs(1 - exact) > 1e-9:
            assert float(layer_complement(x, poisson, base_poisson, ratio)) == pytest.approx(
                float(1 - exact), rel=1e-14, abs=0
            )


def test_factor__of_materials_that_keep_their_volume_is_burmisters():
    """J. Appl. Phys. 16 (1945) 89: one parameter, N = (1 - n) / (1 + n) with the ratio n of base to layer."""
    m, n = np.array([0.05, 0.4, 1.0, 3.0]), 0.2
    big_n, e = (1 - n) / (1 + n), np.exp(-2 * m)
    burmister = (1 + 4 * big_n * m * e - big_n**2 * e**2) / (1 - 2 * big_n * (1 + 2 * m**2) * e + big_n**2 * e**2)
    np.testing.assert_allclose(layer_factor(m, 0.5, 0.5, 1 / n), burmister, rtol=1e-13)


def test_limits__of_the_factor():
    x = np.geomspace(1e-6, 30, 40)
    for nu in (0.0, 0.3, 0.5):
        np.testing.assert_array_equal(layer_complement(x, nu, nu, 1.0), 0, "equal materials: a half-space")
        np.testing.assert_allclose(layer_factor(x, nu, nu, 1.0), 1, rtol=1e-15)
        for base_nu in (0.2, 0.5):
            np.testing.assert_allclose(layer_factor(x, nu, base_nu, 1e-300), reduction(x, nu, "bonded"), rtol=1e-15)
            for ratio in (0.01, 100.0):
                long = ratio * (1 - base_nu) / (1 - nu)
                assert float(layer_factor(0.0, nu, base_nu, ratio)) == pytest.approx(long, rel=1e-15)
                assert ElasticLayer(1.0, nu, base_nu, ratio).long_wave_factor == pytest.approx(long, rel=1e-15)
                assert float(layer_factor(1e9, nu, base_nu, ratio)) == pytest.approx(1, rel=2e-15)
                assert float(layer_complement(1e9, nu, base_nu, ratio)) == 0


# --------------------------------------------------------------------------------------------------------------
# contact


def gao(x, nu):
    """Share of a layer of `x` punch radii in the stiffness.

    H. Gao, C.-H. Chiu, J. Lee, Int. J. Solids Struct. 29 (1992) 2471.
    """
    bent = (1 - 2 * nu) * x * math.log((1 + x**2) / x**2) - x / (1 + x**2)
    return 2 / math.pi * math.atan(x) + bent / (2 * math.pi * (1 - nu))


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("wide", [0.2, 1.0, 5.0])
def test_punch__on_a_layer_of_nearly_the_bases_modulus_is_gaos(poisson, wide):
    """Exact in the first order of the difference: what is left is of second order."""
    share = gao(1 / wide, poisson)
    left = []
    for more in (0.02, 0.01):
        punch = PunchOnSheet(wide, ElasticLayer(1.0, poisson, poisson, 1 + more))
        stiffness = punch.scaled_stiffness / (2 * wide) * (1 + more)  # over the base's contact modulus
        left.append(abs(stiffness - 1 - more * share))
    assert left[0] < 0.1 * 0.02 * share
    assert math.log2(left[0] / left[1]) == pytest.approx(2, abs=0.05)


@pytest.mark.parametrize("ratio", [0.02, 5.0, 100.0])
@pytest.mark.parametrize("radius", [0.2, 2.5])
def test_pressure__carries_the_force_and_displaces(ratio, radius):
    layer = ElasticLayer(1.0, 0.4, 0.3, ratio)
    contact = OnSheet(Paraboloid(10.0), layer)
    nodes, weights = np.polynomial.legendre.leggauss(160)
    u = (1 - nodes) / 2
    r, area = radius * (1 - u**2), 2 * np.pi * radius**2 * (1 - u**2) * u * weights
    pressure = contact.scaled_pressure(r, radius)
    assert (pressure > 0).all()
    assert float(pressure @ area) == pytest.approx(float(contact.scaled_force(radius)), rel=1e-5)
    q = (np.arange(8000) + 0.5) * 0.01 / radius
    spectrum = np.array([float((pressure * area) @ j0(one * r)) for one in q])
    at = radius * np.array([0.0, 0.6, 1.2, 3.0])
    found = [float(np.sum(layer.factor(q) * spectrum * j0(q * one))) * (q[1] - q[0]) / np.pi for one in at]
    np.testing.assert_allclose(contact.displacement(at, radius), found, atol=1e-3 * found[0])


# --------------------------------------------------------------------------------------------------------------
# creep: the oracles of the tests of the body


def test_inversion__knows_a_pair():
    t = np.array([0.01, 1.0, 30.0])
    np.testing.assert_allclose(inverted(lambda s: 1 / (s * (1 + s * 0.4)), t), -np.expm1(-t / 0.4), rtol=1e-8)
    np.testing.assert_allclose(inverted(lambda s: s**-1.3, t), t**0.3 / math.gamma(1.3), rtol=1e-8)


def profile(x):
    return np.asarray(x) ** 2 / 100.0


def test_growing_contact__on_moduli_that_creep_alike_is_that_of_lee_and_radok():
    """Of one time function the march is exact, whatever the steps; so is the closed form with the ratio of moduli."""
    alike, times = rv.zener(4e6, 12e5, 4e5, 0.3), np.append(0, np.geomspace(0.01, 2, 6))
    for base, layer in ((SOFT, ElasticLayer(1.0, 0.4, 0.4, 1.0)), (alike, ElasticLayer(1.0, 0.4, 0.3, 0.25))):
        exact = StepLoad(OnSheet(Paraboloid(100.0), layer), SOFT, 3e4)
        found = GrowingOnLayer(profile, SOFT, base, 3e4, times)
        np.testing.assert_allclose(found.radius, exact.radius(times), rtol=1e-8)
        np.testing.assert_allclose(found.approach, exact.approach(times), rtol=1e-8)
