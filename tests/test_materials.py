"""Creep compliances against closed forms, and exact conversion over many decades."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate

import roughvisc as rv
from roughvisc.mechanics.materials import one_less_mean_decay

positive = st.floats(1e-6, 1e6)


def test_zener__creep_from_glassy_to_rubbery():
    material = rv.zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=2e6, poisson=0.3)
    t = np.array([0.0, 1.0, 1e9])
    expected = 1 / 3e6 + (1 - np.exp(-t / 2.0)) / 1e6
    assert material.creep_compliance(t) == pytest.approx(expected, rel=1e-14)
    assert material.contact_compliance(t) == pytest.approx(0.35 * expected, rel=1e-14)


def test_maxwell__flows():
    material = rv.maxwell(2.0, 4.0)
    assert material.contact_compliance(3.0) == pytest.approx((1 / 2 + 3 / 4) / 4)
    assert material.contact_integral(3.0) == pytest.approx((3 / 2 + 9 / 8) / 4)


@given(
    compliances=st.lists(st.tuples(positive, st.floats(1e-3, 1e3)), min_size=1, max_size=4),
    glassy=positive,
    fluidity=st.one_of(st.just(0.0), positive),
    t=st.floats(1e-3, 1e3),
)
@settings(max_examples=50, deadline=None)
def test_contact_integral__is_the_integral(compliances, glassy, fluidity, t):
    material = rv.Prony(glassy, fluidity, tuple(c for c, _ in compliances), tuple(x for _, x in compliances))
    breaks = sorted({0.0, t, *(b for _, x in compliances for b in (x / 10, x, 10 * x, 100 * x) if b < t)})
    parts = [
        integrate.quad(material.contact_compliance, a, b, epsabs=0, epsrel=1e-12)[0]
        for a, b in itertools.pairwise(breaks)
    ]
    assert material.contact_integral(t) == pytest.approx(sum(parts), rel=1e-10)


@pytest.mark.parametrize("x", [1e-16, 1e-8, 0.1, 0.299, 0.301, 1.0, 50.0, 1e12])
def test_one_less_mean_decay__keeps_its_digits(x):
    series = sum((-1) ** (k + 1) * x**k / math.factorial(k + 1) for k in range(1, 30)) if x < 2 else None
    expected = series if series is not None else 1 + math.expm1(-x) / x
    assert float(one_less_mean_decay(x)) == pytest.approx(expected, rel=4e-15)


@pytest.mark.parametrize("equilibrium", [0.0, 1e-9, 5.0])
def test_from_relaxation__returns_over_24_decades(equilibrium):
    times = 10.0 ** np.arange(-12, 12, 0.75)
    moduli = 1 + np.arange(times.size) % 3
    material = rv.from_relaxation(equilibrium, moduli, times)
    back, back_moduli, back_times = material.relaxation_spectrum()
    assert back == pytest.approx(equilibrium, rel=1e-12)
    assert np.sort(back_times) == pytest.approx(times, rel=1e-12)
    assert back_moduli[np.argsort(back_times)] == pytest.approx(moduli, rel=1e-10)
    assert (np.array(material.compliances) > 0).all()


def test_from_relaxation__satisfies_the_convolution_identity():
    """``int G(t - s) J(s) ds = t``."""
    material = rv.from_relaxation(0.5, (2.0, 1.0), (0.1, 3.0), poisson=0.3)

    def relaxation(s):
        return 0.5 + 2 * np.exp(-s / 0.1) + np.exp(-s / 3.0)

    for t in (0.01, 0.5, 20.0):
        value = integrate.quad(
            lambda s, t=t: relaxation(t - s) * material.creep_compliance(s),
            0,
            t,
            points=[max(t - 0.3, 0)],
            epsrel=1e-11,
        )[0]
        assert value == pytest.approx(t, rel=1e-9)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rv.elastic(-1.0), r"shear_modulus is -1\.0: expected a positive number \[Pa\]"),
        (lambda: rv.zener(1.0, 0.0, 1.0), r"kelvin_modulus is 0\.0: expected a positive"),
        (lambda: rv.maxwell(1.0, math.nan), r"viscosity is nan"),
        (lambda: rv.elastic(1.0, poisson=0.6), r"poisson is 0\.6: expected a number above -1 and up to 0\.5"),
        (lambda: rv.elastic(1.0, poisson=-1.0), r"poisson is -1\.0"),
        (lambda: rv.Prony(1.0, compliances=(1.0,)), r"1 compliances for 0 times"),
        (lambda: rv.Prony(0.0), r"all compliances are zero"),
        (lambda: rv.from_relaxation(0.0, (), ()), r"all moduli are zero"),
        (lambda: rv.kelvin_voigt(1.0, 1.0).relaxation_spectrum(), r"no finite relaxation modulus"),
    ],
)
def test_bad_input__is_named(make, message):
    with pytest.raises(rv.InputError, match=message):
        make()
