"""Complex compliance: against the relaxation spectrum, a numerical Fourier integral, and the series of a table."""

import mpmath
import numpy as np
import pytest

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.series import complex_compliance

FREQUENCIES = np.array([-30.0, -1.0, 0.01, 0.7, 100.0])


@pytest.mark.parametrize("poisson", [0.5, 0.3])
def test_series__is_the_inverse_of_its_complex_modulus(poisson):
    """G* = G_e + sum G_k i w theta_k / (1 + i w theta_k) is what dynamic tests measure."""
    material = rv.from_relaxation(1e6, [4e6, 2e6], [0.02, 3.0], poisson)
    w = 1j * FREQUENCIES
    modulus = 1e6 + 4e6 * w * 0.02 / (1 + w * 0.02) + 2e6 * w * 3.0 / (1 + w * 3.0)
    np.testing.assert_allclose(complex_compliance(material, FREQUENCIES), (1 - poisson) / 2 / modulus, rtol=1e-10)
    assert complex_compliance(material, 0.0) == pytest.approx((1 - poisson) / 2 / 1e6)


def test_fluid__flows_without_end_at_zero_frequency():
    w = np.array([0.0, 2.0])
    found = complex_compliance(rv.maxwell(2.0, 3.0), w)
    assert np.isinf(found[0])
    assert found[1] == pytest.approx(0.25 * (1 / 2 + 1 / (3j * 2)))


def test_power_law__is_the_transform_of_its_creep():
    """C*(w) = i w int_0^inf C(t) exp(-i w t) dt, with the path turned to where the integrand dies."""
    material, w = rv.power_law(0.5, 2.0, 0.3, time_scale=0.1, poisson=0.4), 1.7
    creep = mpmath.quad(lambda s: (mpmath.mpf(s) / (mpmath.mpc(0, w) * 0.1)) ** 0.3 * mpmath.exp(-s), [0, 1, 50])
    expected = 0.3 * (0.5 + 2.0 * complex(creep))
    np.testing.assert_allclose(complex_compliance(material, [w, -w]), [expected, np.conj(expected)], rtol=1e-9)
    assert np.isinf(complex_compliance(material, 0.0))


def test_function_of_the_users_own__is_followed_from_the_lowest_frequency_to_the_highest():
    law = rv.power_law(0.5, 2.0, 0.3, time_scale=0.1, poisson=0.4)
    own, w = rv.creep(lambda t: 0.5 + 2.0 * (t / 0.1) ** 0.3, poisson=0.4), np.geomspace(1e-3, 1e3, 13)
    np.testing.assert_allclose(complex_compliance(own, w), complex_compliance(law, w), rtol=1e-3)


def test_table__has_its_own_poisson_ratio():
    t = np.geomspace(1e-4, 1e4, 40)
    half, third = (
        complex_compliance(rv.creep_table(t, 1 + t**0.3, poisson=nu, kind="shear"), [0.1, 2.0]) for nu in (0.5, 0.3)
    )
    np.testing.assert_allclose(third, half * 0.7 / 0.5, rtol=1e-12)


def test_pair__adds_both():
    a, b = rv.power_law(0.5, 2.0, 0.3), rv.zener(1.0, 1.0, 1.0)
    np.testing.assert_allclose(
        complex_compliance(rv.pair(a, b), FREQUENCIES),
        complex_compliance(a, FREQUENCIES) + complex_compliance(b, FREQUENCIES),
    )


def test_shift__multiplies_the_frequency():
    for material in (rv.zener(1.0, 1.0, 1.0), rv.power_law(0.5, 2.0, 0.3)):
        shifted = complex_compliance(rv.shift(material, 7.0), FREQUENCIES)
        np.testing.assert_allclose(shifted, complex_compliance(material, 7.0 * FREQUENCIES), rtol=1e-12)


def test_frequencies_below_those_of_a_table__are_refused():
    """A table of creep until 1 s says nothing of an oscillation of 1 rad/s, which needs a hundred times as long."""
    t = np.geomspace(1e-6, 1.0, 60)
    table = rv.creep_table(t, 1 + t**0.3, kind="shear")
    assert complex_compliance(table, 1e3).imag < 0
    with pytest.raises(InputError, match="the table ends at 1 s"):
        complex_compliance(table, 1.0)
