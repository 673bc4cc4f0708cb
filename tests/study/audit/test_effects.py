"""Effects that the model leaves out: limits of JKR and DMT, printed numbers, and integrals done another way."""

import cmath
import math

import numpy as np
import pytest
from scipy import special
from scipy.integrate import quad
from scipy.optimize import brentq

from roughvisc.mechanics.sheet import Sheet, complement
from roughvisc.study.audit import effects


def jkr_force(a, radius, modulus, w):
    """Load over the contact radius: Hertz less what the stress at the edge takes (Johnson 1985, eq. 5.47)."""
    return 4 * modulus * a**3 / (3 * radius) - math.sqrt(8 * math.pi * a**3 * modulus * w)


def test_pull_off__is_that_of_jkr_and_of_dmt_in_the_limits():
    radius, w = 2e-3, 0.04
    assert effects.pull_off_force(radius, w) == pytest.approx(1.5 * math.pi * w * radius, rel=1e-15)
    assert effects.pull_off_force(radius, w, tabor=0.0) == pytest.approx(2 * math.pi * w * radius, rel=1e-15)
    # by the curve of load over contact radius, whose least value is the force of separation
    least = min(jkr_force(a, radius, 1e6, w) for a in np.linspace(0, 1e-3, 10_001))
    assert -least == pytest.approx(effects.pull_off_force(radius, w), rel=1e-6)


def maugis_balance(m, a, parameter):
    """Zero where the rim of attraction, m times as wide as the contact, does the work of adhesion (Maugis 1992)."""
    root, angle = math.sqrt(m**2 - 1), math.acos(1 / m)
    within = parameter * a**2 / 2 * (root + (m**2 - 2) * angle)
    return within + 4 * parameter**2 * a / 3 * (root * angle - m + 1) - 1


@pytest.mark.parametrize("parameter", [0.03, 0.1, 0.3, 1.0, 3.0])
def test_pull_off__between_the_limits_is_that_of_maugis(parameter):
    """By his equations, in his units of radius and force: the least force over all contact radii."""
    forces = []
    for a in np.geomspace(0.01, 3, 400):
        m = brentq(maugis_balance, 1.0, 1e6, args=(a, parameter))
        forces.append(a**3 - parameter * a**2 * (math.sqrt(m**2 - 1) + m**2 * math.acos(1 / m)))
    found = effects.pull_off_force(1.0, 1.0, parameter / 1.1570) / math.pi
    assert found == pytest.approx(-min(forces), rel=1.7e-2)


def test_tabor_parameter__is_the_height_of_the_neck_over_the_range():
    """With (R w^2 / E*^2)^(1/3), of a rubber ball of a centimetre some micrometres."""
    radius, modulus, w = 1e-2, 1e6, 0.1
    neck = (radius * w**2 / modulus**2) ** (1 / 3)
    assert effects.tabor_parameter(radius, modulus, w, neck) == pytest.approx(1.0, rel=1e-14)
    assert effects.tabor_parameter(8 * radius, modulus, w, neck) == pytest.approx(2.0, rel=1e-14)


def test_conformal_energy__is_half_the_work_of_the_pressure_that_flattens_a_wave():
    a, k, modulus = 1e-6, 2e5, 4e6
    x = (np.arange(64) + 0.5) / 64 * 2 * np.pi / k
    flattening = modulus * k * a / 2 * np.cos(k * x)  # Westergaard: p* = E* k a / 2
    work = np.mean(flattening * a * np.cos(k * x)) / 2
    assert effects.conformal_energy(k * a**2 / 2, modulus) == pytest.approx(work, rel=1e-12)


def test_relief__has_the_integrals_that_are_stated():
    for base, expected in (("bonded", 1.7702), ("slipping", 1.16758)):
        integral = quad(lambda s, base=base: float(complement(s, 0.5, base)), 0, 40)[0]
        assert integral == pytest.approx(expected, abs=5e-5)
        assert Sheet(1.0, 0.5, base).relief == pytest.approx(expected / math.pi, rel=1e-4)


def moving_compliance(speed, shear, density, poisson):
    """Displacement of the wave ``exp(ik(x - Vt))``, times ``k``, under a unit pressure: Navier's equations, solved.

    Potentials ``phi = A exp(-k a z)`` and ``psi = B exp(-k b z)``: the surface carries normal and no shear stress.
    """
    lame = 2 * shear * poisson / (1 - 2 * poisson)
    fast, slow = (lame + 2 * shear) / density, shear / density
    a, b = (cmath.sqrt(1 - speed**2 / square) for square in (fast, slow))
    # u = phi_x - psi_z, w = phi_z + psi_x, at z = 0 with k = 1
    normal = [lame * (a**2 - 1) + 2 * shear * a**2, -2j * shear * b]
    shearing = [-2j * shear * a, -shear * (1 + b**2)]
    potentials = np.linalg.solve(np.array([normal, shearing]), [-1.0, 0.0])
    return (-a * potentials[0] + 1j * potentials[1]).real


@pytest.mark.parametrize("poisson", [0.0, 0.25, 0.499])
@pytest.mark.parametrize("mach", [0.1, 0.5, 0.85])
def test_moving_load_excess__is_that_of_navier_equations(poisson, mach):
    shear, density = 1e6, 1100.0
    wave = math.sqrt(shear / density)
    still, moving = (moving_compliance(m * wave, shear, density, poisson) for m in (1e-3, mach))
    found = effects.moving_load_excess(mach * wave, shear, density, poisson)
    assert 1 + found == pytest.approx(moving / still, rel=1e-5)


@pytest.mark.parametrize(("poisson", "rayleigh"), [(0.0, 0.87403), (0.25, 0.91940), (0.5, 0.95531)])
def test_moving_load_excess__is_infinite_from_the_rayleigh_speed_on(poisson, rayleigh):
    """Roots of Rayleigh's equation as textbooks have them."""
    for part, infinite in ((0.9999, False), (1.0001, True), (1.2, True)):
        assert math.isinf(effects.moving_load_excess(part * rayleigh, 1.0, 1.0, poisson)) == infinite
    assert effects.moving_load_excess(1e-9, 1.0, 1.0, poisson) == pytest.approx(0, abs=1e-12)


def exact_flash(peclet):
    """Mean over the spot, over ``q a / k``, by the Fourier transforms of a disk and of a moving source."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    angles, weights = (nodes + 1) * math.pi / 4, weights * math.pi / 4
    s = np.concatenate([np.geomspace(1e-8, 0.5, 600), np.linspace(0.5, 100, 6000)[1:]])
    # beyond the last node J1^2 is 1 / (pi s) on average, and the motion does not matter
    around = 4 * np.sum(weights / np.sqrt(s[:, None] ** 2 + 1j * s[:, None] * np.cos(angles) * peclet), axis=1).real
    return np.trapezoid(special.j1(s) ** 2 / s * around, s) / math.pi + 1 / (math.pi * 100**2)


@pytest.mark.parametrize("peclet", [1e-3, 0.3, 2.0, 10.0])
def test_flash_temperature__is_within_four_per_cent_of_the_moving_disk(peclet):
    found = effects.flash_temperature(3e5, 2e-5, peclet * 0.2 / (2e-5 * 1.8e6), 0.2, 1.8e6)
    exact = 3e5 * 2e-5 / 0.2 * exact_flash(peclet)
    assert 0.96 * exact < found <= 1.0005 * exact


def test_flash_temperature__has_both_limits_of_jaeger():
    """Slow: a disk at rest, 8 q a / 3 pi k on average. Fast: heat flows straight down since the leading edge."""
    slow = effects.flash_temperature(1e5, 1e-5, 1e-9, 0.2, 1.8e6)
    assert slow == pytest.approx(8 / (3 * math.pi) * 1e5 * 1e-5 / 0.2, rel=1e-6)
    y, part = (np.arange(2000) + 0.5) / 2000, (np.arange(400) + 0.5) / 400
    chord = 2 * np.sqrt(1 - y**2)
    behind = np.sqrt(part[:, None] * chord).mean(0) @ chord / chord.sum() * math.sqrt(1e-5 / 1e3)
    fast = 2 * 1e5 * behind / math.sqrt(math.pi * 0.2 * 1.8e6)
    assert effects.flash_temperature(1e5, 1e-5, 1e3, 0.2, 1.8e6) == pytest.approx(fast, rel=1e-3)
    assert effects.flash_temperature(0.0, 1e-5, 1.0, 0.2, 1.8e6) == 0
