"""Creep compliances against closed forms, and exact conversion over many decades."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from references.half_space import relaxation_spectrum
from samples import OF_EACH_KIND
from scipy import integrate
from strategies import series_with_common_times
from support import refused

import roughvisc as rv


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


@pytest.mark.parametrize("equilibrium", [0.0, 1e-9, 5.0])
def test_from_relaxation__returns_over_24_decades(equilibrium):
    times = 10.0 ** np.arange(-12, 12, 0.75)
    moduli = 1 + np.arange(times.size) % 3
    material = rv.from_relaxation(equilibrium, moduli, times)
    back, back_moduli, back_times = relaxation_spectrum(material)
    assert back == pytest.approx(equilibrium, rel=1e-12)
    assert np.sort(back_times) == pytest.approx(times, rel=1e-12)
    assert back_moduli[np.argsort(back_times)] == pytest.approx(moduli, rel=1e-10)
    assert (np.array(material.compliances) > 0).all()


@pytest.mark.parametrize(
    ("make", "key", "found"),
    [
        (lambda: rv.elastic(-1.0), "shear_modulus", -1.0),
        (lambda: rv.zener(1.0, 0.0, 1.0), "kelvin_modulus", 0.0),
        (lambda: rv.maxwell(1.0, math.nan), "viscosity", math.nan),
        (lambda: rv.elastic(1.0, poisson=0.6), "poisson", 0.6),
        (lambda: rv.elastic(1.0, poisson=-1.0), "poisson", -1.0),
        (lambda: rv.power_law(0.0, 1.0, 1.0), "exponent", 1.0),
        (lambda: rv.power_law(0.0, 1.0, 0.0), "exponent", 0.0),
        (lambda: rv.power_law(-1.0, 1.0, 0.5), "glassy", -1.0),
        (lambda: rv.power_law(0.0, 0.0, 0.5), "coefficient", 0.0),
        (lambda: rv.power_law(0.0, 1.0, 0.5, time_scale=0.0), "time_scale", 0.0),
        (lambda: rv.Prony(1.0, compliances=(1.0,)), None, None),  # fewer times
        (lambda: rv.Prony(0.0), None, None),  # rigid
        (lambda: rv.from_relaxation(0.0, (), ()), None, None),  # no stiffness
    ],
)
def test_impossible_material__is_refused(make, key, found):
    with refused(key, found):
        make()


# --- elastic bulk modulus -------------------------------------------------------------------------------------------

#: Equilibrium modulus, moduli and relaxation times.
SHEAR = {
    "elastic": (2.0, (), ()),
    "maxwell": (0.0, (2.0,), (1.5,)),
    "zener": (0.02, (2.0,), (0.3,)),
    "wide": (0.1, 0.1 * (1 + np.arange(17) % 4), 10.0 ** np.arange(-12, 12.1, 1.5)),
}
LAPLACE = 10.0 ** np.arange(-14, 14, 0.25)


def transformed(material, s):
    """``s`` times the Laplace transform of the shear compliance."""
    total = material.glassy + material.fluidity / s
    return total + sum(c / (1 + s * t) for c, t in zip(material.compliances, material.times, strict=True))


@pytest.mark.parametrize("name", SHEAR)
@pytest.mark.parametrize("ratio", [1e-12, 1e-3, 1.0, 30.0, 1e8, 1e12])
def test_bulk_modulus__satisfies_the_correspondence_principle(name, ratio):
    """``(1 - nu)/G = 1/2 (1/G + 3/(3K + G))`` with the transformed modulus; twice the contact compliance."""
    bulk, (equilibrium, moduli, times) = 2.0 * ratio, SHEAR[name]
    modulus = equilibrium + sum(g * LAPLACE * t / (1 + LAPLACE * t) for g, t in zip(moduli, times, strict=True))
    material = rv.from_relaxation(equilibrium, moduli, times, bulk_modulus=bulk)
    found = (1 - material.poisson) * transformed(material, LAPLACE)
    expected = 0.5 * (1 / modulus + 3 / (3 * bulk + modulus))
    assert np.abs(found / expected - 1).max() < 1e-13
    assert min(material.compliances, default=1.0) > 0


@pytest.mark.parametrize("equilibrium", [0.0, 0.3])
@pytest.mark.parametrize("bulk", [0.5, 3.0, 1e6])
def test_bulk_modulus__with_relaxation_in_tension(equilibrium, bulk):
    """``C = (1 - nu^2)/E`` with ``nu = 1/2 - E/(6K)``: ``3/(4E) + 1/(6K) - E/(36 K^2)`` of the transformed modulus."""
    moduli, times = (2.0, 1.0, 0.5), (1e-3, 0.2, 40.0)
    young = equilibrium + sum(e * LAPLACE * t / (1 + LAPLACE * t) for e, t in zip(moduli, times, strict=True))
    material = rv.from_relaxation(equilibrium, moduli, times, kind="tensile", bulk_modulus=bulk)
    found = 0.5 * (1 - material.poisson) * transformed(material, LAPLACE)
    expected = 3 / (4 * young) + 1 / (6 * bulk) - young / (36 * bulk**2)
    assert np.abs(found / expected - 1).max() < 1e-10
    assert min(material.compliances) > 0


def test_bulk_modulus__below_a_ninth_of_youngs_is_refused():
    """``G = 3KE/(9K - E)``."""
    with refused("bulk_modulus", 1.0):
        rv.from_relaxation(4.0, [5.5], [1.0], kind="tensile", bulk_modulus=1.0)
    rv.from_relaxation(4.0, [4.5], [1.0], kind="tensile", bulk_modulus=1.0)


# --- relaxation by ratios -------------------------------------------------------------------------------------------


def test_ratios__are_those_of_finite_element_codes():
    """``G(t) = G_0 [1 - sum g_i (1 - exp(-t / theta_i))]``: at once 1/G_0, finally 1/(G_0 (1 - sum g_i))."""
    material = rv.from_relaxation(instantaneous="4 MPa", ratios=[0.5, 0.2], times=["10 ms", "1 s"], poisson=0.3)
    assert float(material.creep_compliance(0.0)) == pytest.approx(1 / 4e6, rel=1e-14)
    assert float(material.creep_compliance(1e6)) == pytest.approx(1 / 1.2e6, rel=1e-12)
    assert material.poisson == 0.3
    equilibrium, moduli, times = relaxation_spectrum(material)
    assert equilibrium == pytest.approx(1.2e6, rel=1e-12)
    assert np.sort(times) == pytest.approx([0.01, 1.0], rel=1e-10)
    assert moduli[np.argsort(times)] == pytest.approx([2e6, 0.8e6], rel=1e-10)


def test_ratios__of_a_long_term_modulus_and_of_a_relaxing_bulk_modulus():
    """Cards of Abaqus and Ansys: both state the same material, by instantaneous and by long-term moduli."""
    shear, times = np.array([0.3, 0.25, 0.15]), np.array([0.02, 0.7, 15.0])
    bulk, bulk_times = np.array([0.2, 0.1]), np.array([0.02, 3.0])
    terms = {"ratios": shear, "times": times, "bulk_ratios": bulk, "bulk_times": bulk_times}
    at_once = rv.from_relaxation(instantaneous=2e6, bulk_modulus=5e6, **terms)
    in_the_end = rv.from_relaxation(equilibrium=0.3 * 2e6, bulk_modulus=0.7 * 5e6, **terms)
    s = LAPLACE[:, None]
    modulus = 2e6 * (0.3 + (shear * s * times / (1 + s * times)).sum(1))
    volume = 5e6 * (0.7 + (bulk * s * bulk_times / (1 + s * bulk_times)).sum(1))
    exact = 0.25 * (1 / modulus + 3 / (3 * volume + modulus))
    for material in (at_once, in_the_end):
        assert 0.25 * transformed(material, LAPLACE) == pytest.approx(exact, rel=1e-12)


def test_ratios__of_one_in_sum_make_a_fluid():
    """Thirds with ten printed digits are no solid of a ten-billionth of the modulus."""
    thirds = rv.from_relaxation(instantaneous=1e6, ratios=[0.3333333333] * 3, times=[1e-3, 1.0, 1e3])
    assert thirds.fluidity == pytest.approx(1 / (1e6 / 3 * 1001.001), rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "key", "found"),
    [
        ({"instantaneous": 1e6, "ratios": [0.7, 0.4], "times": [1, 2]}, "ratios", [0.7, 0.4]),
        ({"instantaneous": 1e6, "ratios": [-0.1], "times": [1]}, "ratios[0]", -0.1),
        ({"instantaneous": 1e6, "ratios": [0.1], "times": [1, 2]}, "ratios", 1),
        ({"instantaneous": 1e6, "moduli": [2.0], "ratios": [0.1], "times": [1]}, "ratios", [0.1]),
        ({"instantaneous": 1e6, "moduli": [2.0], "times": [1]}, "ratios", 0),
        ({"equilibrium": 1e6, "instantaneous": 2e6}, "instantaneous", 2e6),
        ({"moduli": [2.0], "times": [1]}, "equilibrium", None),
        ({"equilibrium": 1e6, "ratios": [0.5, 0.5], "times": [1, 2]}, "ratios", [0.5, 0.5]),
        ({"equilibrium": 1e6, "bulk_ratios": [0.5], "bulk_times": [1]}, "bulk_ratios", [0.5]),
        ({"equilibrium": 1e6, "bulk_modulus": 1e6, "bulk_ratios": [0.5], "bulk_times": [0]}, "bulk_times[0]", 0),
        ({"instantaneous": 0.0, "ratios": [0.1], "times": [1]}, "instantaneous", 0.0),
        ({"equilibrium": 1.0, "poisson": 0.5, "bulk_modulus": 3.0}, "bulk_modulus", 3.0),
        ({"equilibrium": 1.0, "bulk_modulus": 0.0}, "bulk_modulus", 0.0),
    ],
)
def test_ratios__out_of_range_are_refused(arguments, key, found):
    with refused(key, found):
        rv.from_relaxation(**arguments)


def test_ratios__given_as_moduli_are_refused():
    """Abaqus prints g_i without a unit; as moduli of pascals they would make an elastic body of a polymer."""
    with refused("moduli", [0.35, 0.6]):
        rv.from_relaxation(1739e6, [0.35, 0.6], [1e-3, 10.0])
    with refused("moduli", [0.35, 0.6]):
        rv.from_relaxation("1 kPa", [0.35, 0.6], [1e-3, 10.0])
    rv.from_relaxation(1.0, [0.35, 0.6], [1e-3, 10.0])  # any unit of stress
    rv.from_relaxation("1 GPa", ["0.4 MPa"], [1.0])


# --- every material: antiderivative and mean ------------------------------------------------------------------------


@pytest.mark.parametrize("name", OF_EACH_KIND)
def test_contact_integral__of_every_material_is_the_integral(name):
    material = OF_EACH_KIND[name]
    ends = np.array([[0.0, 1e-9], [0.4, 900.0]])
    found = material.contact_integral(ends)
    for end, value in zip(ends.ravel(), found.ravel(), strict=True):
        exact, _ = integrate.quad(
            lambda x, end=end: end * 5 * x**4 * float(material.contact_compliance(end * x**5)),
            0,
            1,
            epsabs=0,
            epsrel=1e-12,
        )
        assert value == pytest.approx(exact, rel=1e-9, abs=0)


# --- pairs ----------------------------------------------------------------------------------------------------------


@given(series_with_common_times, series_with_common_times, st.floats(0, 100))
def test_pair__of_series_is_a_series(a, b, t):
    both = rv.pair(a, b)
    assert isinstance(both, rv.Prony)
    assert both.contact_compliance(t) == pytest.approx(float(a.contact_compliance(t) + b.contact_compliance(t)))
    assert len(both.times) == len(set(a.times) | set(b.times))


def test_pair__adds_whatever_the_bodies_are():
    a, b = rv.power_law(0.1, 1.0, 0.5, poisson=0.3), rv.zener(1.0, 2.0, 3.0, poisson=0.1)
    both, t = rv.pair(a, b), np.array([0.0, 0.5, 40.0])
    for method in ("contact_compliance", "contact_integral"):
        assert getattr(both, method)(t) == pytest.approx(getattr(a, method)(t) + getattr(b, method)(t))
    # read as the shear compliance of one body at the pair's Poisson ratio, like every other material
    assert 0.5 * (1 - both.poisson) * both.creep_compliance(t) == pytest.approx(both.contact_compliance(t))
    assert both == rv.pair(a, b)
    assert hash(both) == hash(rv.pair(a, b))
