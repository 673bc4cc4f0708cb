"""Each closed form against an independent check: balance of forces, direct integration, limits, printed numbers."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipkm1

from roughvisc.errors import InputError
from roughvisc.mechanics import closed_forms as cf
from roughvisc.mechanics import materials

ELASTIC = {
    "sphere": cf.hertz(2e-3, 3e6, 0.05),
    "cone": cf.sneddon_cone(0.07, 3e6, 0.05),
    "punch": cf.flat_punch(1e-3, 3e6, 0.05),
}


def graded(low, high, levels=24, order=8):
    """Gauss panels between two ends that halve towards both: nodes, distances to both ends, weights.

    The nodes go through ``sin^2``, which takes away square roots at the ends, and their inverses.
    """
    nodes, weights = np.polynomial.legendre.leggauss(order)
    edges = np.concatenate([[0.0], 0.5 * 0.5 ** np.arange(levels, -1, -1)]) * np.pi / 2
    width = np.diff(edges)[:, None]
    v, w = (edges[:-1, None] + width * (nodes + 1) / 2).ravel(), (width * weights / 2).ravel()
    v, w = np.concatenate([v, np.pi / 2 - v]), np.concatenate([w, w])
    v_complement = np.concatenate([np.pi / 2 - v[: len(v) // 2], v[: len(v) // 2]])
    length = high - low
    near, far = length * np.sin(v) ** 2, length * np.sin(v_complement) ** 2
    return low + near, near, far, length * 2 * np.sin(v) * np.sin(v_complement) * w


def force_of(pressure, *radii, levels=24):
    """``int p 2 pi r dr`` between consecutive radii, with roots at either end allowed."""
    total = 0.0
    for low, high in pairwise((0.0, *radii)):
        r, _, _, weights = graded(low, high, levels)
        total += np.sum(weights * 2 * np.pi * r * pressure(np.minimum(r, np.nextafter(high, 0))))
    return total


def boussinesq(pressure, radius, r, modulus):
    """Displacement of a half-space by ``u = 1/(pi E*) int p / distance``, ring by ring."""
    total = 0.0
    for low, high in ((0.0, min(r, radius)), (r, radius)):
        if low < high:
            s, near, far, weights = graded(low, high, order=12)
            distance = far if high == r else near if low == r else r - s
            # a ring of unit pressure: 4 s K(m) / (s + r), m = 4 s r / (s + r)^2
            ring = 4 * s / (s + r) * ellipkm1((distance / (s + r)) ** 2)
            total += np.sum(weights * pressure(np.minimum(s, np.nextafter(radius, 0))) * ring)
    return total / (np.pi * modulus)


@pytest.mark.parametrize("name", ELASTIC)
def test_elastic__pressure_carries_the_force(name):
    contact = ELASTIC[name]
    tolerance = 3e-8 if name == "punch" else 1e-12  # at an infinite edge the radii's rounding is felt
    assert force_of(contact.pressure, contact.radius) == pytest.approx(contact.force, rel=tolerance)


@pytest.mark.parametrize("name", ELASTIC)
@pytest.mark.parametrize("ratio", [0.31, 0.83, 1.17, 2.9])
def test_elastic__pressure_displaces_the_surface_as_stated(name, ratio):
    contact = ELASTIC[name]
    r = ratio * contact.radius
    direct = boussinesq(contact.pressure, contact.radius, r, contact.contact_modulus)
    assert direct == pytest.approx(float(contact.displacement(r)), rel=1e-7)


@pytest.mark.parametrize("name", ["sphere", "cone"])
def test_elastic__surface_meets_the_indenter(name):
    contact = ELASTIC[name]
    r = np.linspace(0, 1, 11) * contact.radius
    gap = contact.displacement(r) - contact.approach + contact.indenter.height(r)
    np.testing.assert_allclose(gap, 0, atol=1e-15 * contact.approach)
    outside = np.linspace(1.0001, 5, 50) * contact.radius
    assert np.all(contact.displacement(outside) - contact.approach + contact.indenter.height(outside) > 0)


@pytest.mark.parametrize("indenter", [cf.Paraboloid(0.3), cf.Cone(0.2)])
def test_indenter__reduced_profile_is_the_abel_transform(indenter):
    def slope(r):
        return (indenter.height(r * (1 + 1e-6)) - indenter.height(r * (1 - 1e-6))) / (2e-6 * r)

    for x in (0.01, 0.2):
        transform = x * quad(lambda v, x=x: slope(x * np.sin(v)), 0, np.pi / 2)[0]
        assert transform == pytest.approx(float(indenter.reduced(x)), rel=1e-8)
        area = 2 * quad(lambda s, x=x: indenter.reduced(x) - indenter.reduced(s), 0, x)[0]
        assert area == pytest.approx(float(indenter.scaled_force(x)), rel=1e-12)
        assert float(indenter.radius_at_scaled_force(indenter.scaled_force(x))) == pytest.approx(x, rel=1e-14)
        assert float(indenter.radius_at_approach(indenter.reduced(x))) == pytest.approx(x, rel=1e-14)


@pytest.mark.parametrize("fraction", [0.03, 0.5, 0.97, 1.6])
def test_westergaard__surface_meets_the_wave(fraction):
    amplitude, wavelength, modulus = 2e-6, 1e-3, 4e6
    full = cf.full_contact_pressure(amplitude, wavelength, modulus, waves=1)
    contact = cf.westergaard(amplitude, wavelength, modulus, fraction * full)
    n = 2**16
    x = (np.arange(n) + 0.5) * wavelength / n
    pressure = contact.pressure(x)
    assert pressure.mean() == pytest.approx(fraction * full, rel=1e-5)  # the midpoint rule on a square root
    # plane strain: a wave of pressure exp(iqx) displaces by 2 / (E* |q|)
    q = 2 * np.pi * np.fft.rfftfreq(n, wavelength / n)
    transform = np.fft.rfft(pressure)
    transform[1:] *= 2 / (modulus * q[1:])
    transform[0] = 0
    gap = np.fft.irfft(transform, n) - amplitude * np.cos(2 * np.pi * x / wavelength)
    touching = np.minimum(x, wavelength - x) < contact.half_width
    gap -= gap[touching].mean()
    np.testing.assert_allclose(gap[touching], 0, atol=1e-6 * amplitude)
    assert np.all(gap[~touching] > -1e-6 * amplitude)


def test_westergaard__full_contact_joins_partial_contact():
    below = cf.westergaard(1.0, 1.0, 1.0, np.pi * (1 - 1e-12))
    above = cf.westergaard(1.0, 1.0, 1.0, np.pi)
    x = np.linspace(-0.5, 0.5, 41)
    np.testing.assert_allclose(below.pressure(x), above.pressure(x), atol=1e-5)
    assert above.contact_fraction == 1


def test_johnson_greenwood_higginson__low_limit_is_hertz_on_every_crest():
    amplitude, wavelength, modulus, pressure = 1e-6, 1e-3, 1e7, 3.0
    crest = cf.hertz(wavelength**2 / (4 * np.pi**2 * amplitude), modulus, pressure * wavelength**2 / 2)
    full = cf.full_contact_pressure(amplitude, wavelength, modulus)
    fraction = cf.johnson_greenwood_higginson(pressure / full, "low")
    assert fraction == pytest.approx(2 * np.pi * crest.radius**2 / wavelength**2, rel=1e-12)


def test_johnson_greenwood_higginson__high_limit_is_a_crack_without_singularity():
    # a round gap of radius b in tension T0 - c r^2 closes smoothly where int r T / sqrt(b^2 - r^2) dr = 0
    full, shortfall, k = 1.0, 1e-3, 2 * np.pi
    b = np.sqrt((1 - cf.johnson_greenwood_higginson(1 - shortfall, "high")) / (2 * np.pi))

    def tension(r):
        return shortfall - full * k**2 / 2 * r**2

    intensity = quad(lambda v: b * np.sin(v) * tension(b * np.sin(v)), 0, np.pi / 2)[0]
    assert intensity == pytest.approx(0, abs=1e-12 * shortfall)


STEP = {
    "maxwell": materials.maxwell(1.0, 1.0),
    "zener": materials.zener(2.0, 1.0, 1.0),
    "zener stiff": materials.zener(100.0, 1.0, 1.0),
    "zener nu": materials.zener(1.0, 2.0, 0.3, poisson=0.3),
    "two modes and flow": materials.Prony(0.2, 0.03, (0.5, 1.0), (0.01, 3.0)),
    "many decades": materials.Prony(1e-3, 0.0, (0.1, 0.2, 1.0), (1e-6, 1e-2, 1e3)),
}


@pytest.mark.parametrize("name", STEP)
@pytest.mark.parametrize("t", [0.0, 1e-3, 0.1, 1.0, 20.0])
def test_step_load__pressure_carries_the_force(name, t):
    press = cf.lee_radok_step(1.0, STEP[name], 0.7)
    # the pressure has a feature wherever the radius lingered: between the times of the modes
    radii = press.radius(np.concatenate([[0.0], np.geomspace(1e-8, 1, 25) * t]))
    assert force_of(lambda r: press.pressure(r, t), *radii, levels=8) == pytest.approx(0.7, rel=1e-10)


def test_step_load__maxwell_pressure_by_the_printed_integral():
    # a Maxwell half-space has E' = -E exp(-t/tau)/tau, and the radius squared grows as (1 + t/tau)^(2/3)
    press = cf.lee_radok_step(1.0, materials.maxwell(1.0, 1.0), 1.0)
    first = float(press.radius(0.0))

    def root(r, t):
        return np.sqrt(max(first**2 * (1 + t) ** (2 / 3) - r**2, 0.0))

    for r, t in ((0.3, 2.0), (first, 2.0), (1.1 * first, 2.0)):
        entry = max((r / first) ** 3 - 1, 0.0)
        memory = quad(
            lambda z, r=r, t=t, e=entry: np.exp(-(t - e - z * z)) * root(r, e + z * z) * 2 * z,
            0,
            np.sqrt(t - entry),
            epsabs=1e-13,
        )[0]
        printed = 4 * 2 / np.pi * (root(r, t) - memory)
        assert float(press.pressure(r, t)) == pytest.approx(printed, rel=1e-8)


def test_kelvin_voigt_step__pressure_carries_the_force_and_ends_as_hertz():
    material = materials.kelvin_voigt(2.0, 3.0, poisson=0.4)
    press = cf.kelvin_voigt_step(0.5, material, 0.7)
    for t in (1e-6, 0.1, 5.0):
        assert force_of(lambda r, t=t: press.pressure(r, t), float(press.radius(t))) == pytest.approx(0.7, rel=3e-8)
    late = cf.hertz(0.5, 2 * 2.0 / (1 - 0.4), 0.7)
    assert float(press.radius(1e3)) == pytest.approx(late.radius, rel=1e-12)
    np.testing.assert_allclose(press.pressure(0.1, 1e3), late.pressure(0.1), rtol=1e-12)


def test_forms__refuse_impossible_input():
    with pytest.raises(InputError, match="force"):
        cf.hertz(1.0, 1.0, -1.0)
    with pytest.raises(InputError, match="waves"):
        cf.full_contact_pressure(1.0, 1.0, 1.0, waves=3)
    with pytest.raises(InputError, match="Kelvin-Voigt"):
        cf.kelvin_voigt_step(1.0, materials.maxwell(1.0, 1.0), 1.0)
