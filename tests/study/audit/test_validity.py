"""How far the model goes: waves under a moving load, heat of a sliding spot, force on a sheet, by other solutions."""

import cmath
import math

import numpy as np
import pytest
from references import OnSheet
from references.indenters import Paraboloid
from scipy import special

from roughvisc.errors import InputError
from roughvisc.mechanics.sheet import Sheet
from roughvisc.study.audit import validity


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
    found = validity.moving_load_excess(mach * wave, shear, density, poisson)
    assert 1 + found == pytest.approx(moving / still, rel=1e-5)


@pytest.mark.parametrize(("poisson", "rayleigh"), [(0.0, 0.87403), (0.25, 0.91940), (0.5, 0.95531)])
def test_moving_load_excess__is_infinite_from_the_rayleigh_speed_on(poisson, rayleigh):
    """Roots of Rayleigh's equation as textbooks have them."""
    for part, infinite in ((0.9999, False), (1.0001, True), (1.2, True)):
        assert math.isinf(validity.moving_load_excess(part * rayleigh, 1.0, 1.0, poisson)) == infinite
    assert validity.moving_load_excess(1e-9, 1.0, 1.0, poisson) == pytest.approx(0, abs=1e-12)


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
    found = validity.flash_temperature(3e5, 2e-5, peclet * 0.2 / (2e-5 * 1.8e6), 0.2, 1.8e6)
    exact = 3e5 * 2e-5 / 0.2 * exact_flash(peclet)
    assert 0.96 * exact < found <= 1.0005 * exact


def test_flash_temperature__has_both_limits_of_jaeger():
    """Slow: a disk at rest, 8 q a / 3 pi k on average. Fast: heat flows straight down since the leading edge."""
    slow = validity.flash_temperature(1e5, 1e-5, 1e-9, 0.2, 1.8e6)
    assert slow == pytest.approx(8 / (3 * math.pi) * 1e5 * 1e-5 / 0.2, rel=1e-6)
    y, part = (np.arange(2000) + 0.5) / 2000, (np.arange(400) + 0.5) / 400
    chord = 2 * np.sqrt(1 - y**2)
    behind = np.sqrt(part[:, None] * chord).mean(0) @ chord / chord.sum() * math.sqrt(1e-5 / 1e3)
    fast = 2 * 1e5 * behind / math.sqrt(math.pi * 0.2 * 1.8e6)
    assert validity.flash_temperature(1e5, 1e-5, 1e3, 0.2, 1.8e6) == pytest.approx(fast, rel=1e-3)
    assert validity.flash_temperature(0.0, 1e-5, 1.0, 0.2, 1.8e6) == 0


@pytest.mark.parametrize(("poisson", "base"), [(0.5, "bonded"), (0.2, "bonded"), (0.3, "slipping")])
@pytest.mark.parametrize("depth", [0.1, 0.3, 0.5, 1.0])
def test_half_space_shortfall__agrees_with_the_fredholm_equation(poisson, base, depth):
    ball, sheet = Paraboloid(1.0), Sheet(1.0, poisson, base)
    on_sheet, approach = OnSheet(ball, sheet), depth**2
    force, actual = (float(one.scaled_force(one.radius_at_approach(approach))) for one in (ball, on_sheet))
    found = validity.half_space_shortfall(sheet, 1.0, force, approach)
    assert found == pytest.approx(1 - force / actual, rel=0.07)


@pytest.mark.parametrize(
    "call",
    [
        lambda: validity.moving_load_excess(-1.0, 1e6, 1e3, 0.5),
        lambda: validity.flash_temperature(-1.0, 1e-5, 1.0, 0.2, 1e6),
        lambda: validity.flash_temperature(1.0, 1e-5, 1.0, 0.0, 1e6),
    ],
)
def test_what_is_out_of_range__is_refused(call):
    with pytest.raises(InputError, match="expected"):
        call()
