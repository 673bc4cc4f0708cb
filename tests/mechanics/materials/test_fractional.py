"""Fractional Zener solid against the series of the Mittag-Leffler function, its transform, and its limits."""

import mpmath
import numpy as np
import pytest
from scipy.special import erfcx
from support import refused

import roughvisc as rv
from roughvisc.mechanics.materials.series import complex_compliance


def mittag_leffler(exponent, x):
    """``E(-x)`` by its power series, with the digits that cancel."""
    largest = float(x) ** (1 / exponent)
    with mpmath.workdps(40 + int(largest)):
        terms = range(int(80 + 8 * largest / exponent))
        x, exponent = mpmath.mpf(float(x)), mpmath.mpf(exponent)
        return float(mpmath.fsum((-x) ** k / mpmath.gamma(exponent * k + 1) for k in terms))


@pytest.mark.parametrize("exponent", [0.2, 0.5, 0.9, 1.0])
def test_creep__is_the_mittag_leffler_function(exponent):
    """``G_0 = 4``, ``G_e = 1``: the retardation time is ``tau 4^(1 / alpha)``."""
    x = np.array([1e-6, 0.01, 0.5, 1.5])
    t = 3.0 * (4 * x) ** (1 / exponent)
    exact = [0.25 + 0.75 * (1 - mittag_leffler(exponent, one)) for one in x]
    material = rv.fractional_zener(4.0, 1.0, 3.0, exponent)
    assert material.creep_compliance(t) == pytest.approx(np.array(exact), rel=1e-13)
    assert material.creep_compliance([0.0, np.inf]) == pytest.approx([0.25, 1.0], rel=1e-14)
    assert material.is_solid


def test_creep__over_many_decades_with_exponent_one_half():
    """``E(-x) = exp(x^2) erfc(x)``."""
    x = np.geomspace(1e-8, 1e8, 33)
    found = rv.fractional_zener("1 GPa", "1 MPa", "1 us", 0.5).creep_compliance(1e-6 * (1e3 * x) ** 2)
    assert found == pytest.approx(1e-9 + (1e-6 - 1e-9) * (1 - erfcx(x)), rel=1e-12)


def test_complex_compliance__is_that_of_its_definition_and_of_the_creep():
    material = rv.fractional_zener(2e9, 1e6, 1e-7, 0.4, poisson=0.4)
    omega = np.geomspace(1e-4, 1e9, 27)
    power = (1j * omega * 1e-7) ** 0.4
    modulus = 1e6 + (2e9 - 1e6) * power / (1 + power)
    assert complex_compliance(material, omega) == pytest.approx(0.3 / modulus, rel=1e-12)
    fitted = complex_compliance(rv.creep(material.creep_compliance, poisson=0.4), omega[5:20])
    assert fitted == pytest.approx(complex_compliance(material, omega[5:20]), rel=1e-3)
    warm = rv.shift(material, 1e-3)
    assert complex_compliance(warm, 1e3 * omega) == pytest.approx(complex_compliance(material, omega), rel=1e-12)


def test_friction__is_that_of_the_zener_solid_at_exponent_one():
    wave = rv.self_affine(1e-3, (22, 18), hurst=0.8, rms_slope=0.05, shortcut=1.5e-4, seed=4)
    zener = rv.from_relaxation(0.5e6, [2e6], [1e-3])
    press = {"pressure": 2e4, "speeds": [1e-2, 1.0], "grid_error": False, "progress": False}
    fractional = rv.friction(wave, rv.fractional_zener(2.5e6, 0.5e6, 1e-3, 1.0), **press)
    np.testing.assert_allclose(
        fractional.friction_coefficient, rv.friction(wave, zener, **press).friction_coefficient, rtol=1e-6
    )


@pytest.mark.parametrize(
    ("key", "found"),
    [("equilibrium", 4.0), ("equilibrium", 0.0), ("exponent", 0.01), ("exponent", 1.1), ("poisson", 0.6)],
)
def test_wrong_number__is_refused(key, found):
    with refused(key, found):
        rv.fractional_zener(
            **{"instantaneous": 4.0, "equilibrium": 1.0, "relaxation_time": 1.0, "exponent": 0.5} | {key: found}
        )


def test_own_material__with_its_transform_needs_no_fit():
    """A material of its own says its transform, whatever the number of its parameters."""
    rate = np.array([0.3, 5.0])
    own = rv.creep(lambda t: 1 - np.exp(-t) + t, laplace=lambda s: 1 / (1 + s) + 1 / s)
    exact = rv.Prony(0.0, 1.0, (1.0,), (1.0,))
    assert complex_compliance(own, rate) == pytest.approx(complex_compliance(exact, rate), rel=1e-14)
    assert rv.pair(own, rv.elastic(1.0)).has_laplace
    with refused("laplace", 3.0):
        rv.creep(lambda t: t, laplace=3.0)
