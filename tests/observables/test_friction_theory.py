"""Persson's theory on the waves of a surface: its exact limits, and its integrals."""

import math

import numpy as np
import pytest
from samples import QUICK_RUBBER as RUBBER
from scipy.integrate import cumulative_trapezoid
from scipy.special import erf

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE, Body
from roughvisc.mechanics.materials.series import complex_compliance
from roughvisc.mechanics.sheet import Sheet
from roughvisc.mechanics.steady_sliding import Sliding
from roughvisc.observables.theory import friction_of_waves

SIDE, SPEED = 1e-3, 0.1


def sliding_on(shape, material=RUBBER, body=HALF_SPACE):
    spacing = (SIDE / shape[0], SIDE / shape[1])
    return Sliding(Body(material, body), shape, spacing, SPEED)


@pytest.mark.parametrize("shape", [(15, 11), (16, 10), (9, 20)])
@pytest.mark.parametrize("body", [HALF_SPACE, Sheet(1e-4, 0.3)], ids=["half-space", "sheet"])
def test_full_contact__is_exact(shape, body):
    """Friction is the sum of |h_q|^2 q_x Im 1/(K_q C*(-q_x V)) over all waves, by a plain two-sided transform."""
    height = 1e-6 * np.random.default_rng(3).standard_normal(shape)
    qx, qy = (2 * np.pi * np.fft.fftfreq(n, SIDE / n) for n in shape)
    waves, total = np.fft.fft2(height) / height.size, 0.0
    for i, j in np.ndindex(shape):
        if (i or j) and not (shape[0] % 2 == 0 and i == shape[0] // 2):  # the shortest wave has no slope on the cells
            softness = body.transfer(qx[i], qy[j]) * complex_compliance(RUBBER, -qx[i] * SPEED)
            total -= abs(waves[i, j]) ** 2 * qx[i] * (1 / complex(softness)).imag
    pressure = 1e9
    friction, area = friction_of_waves(sliding_on(shape, body=body), height, pressure)
    assert area == 1
    assert friction == pytest.approx(total / pressure, rel=1e-12)


def test_direction__is_that_of_the_curve():
    """Along y on the surface turned by its diagonal."""
    height = rv.self_affine((SIDE, 8e-4), (12, 9), hurst=0.8, rms_slope=0.1, seed=3)
    turned = height.rename(x="y", y="x").transpose("x", "y")
    found = {}
    for name, surface, direction in (("x", height, "x"), ("y", turned, "y"), ("across", height, "y")):
        asked = {"pressure": 1e4, "speeds": [SPEED], "direction": direction, "progress": False}
        ds = rv.friction(surface, RUBBER, tolerance=0.1, **asked)
        found[name] = float(rv.observables.persson(ds, RUBBER).persson_friction_coefficient[0])
    assert found["y"] == pytest.approx(found["x"], rel=1e-9)
    assert found["across"] != pytest.approx(found["x"], rel=0.01)


def test_waves_of_one_length__have_half_of_their_variance_behind_them():
    """cos(kx) cos(ky): four waves of the stress E* |q| A / 8 each."""
    x, k, amplitude, pressure = (np.arange(12) + 0.5) / 12, 2 * np.pi / SIDE, 1e-6, 3e3
    height = amplitude * np.outer(np.cos(2 * np.pi * x), np.cos(2 * np.pi * x))
    modulus = 1 / complex(complex_compliance(RUBBER, k * SPEED))
    stress, length = abs(modulus) * math.sqrt(2) * k * amplitude / 8, math.sqrt(2) * k
    friction, area = friction_of_waves(sliding_on((12, 12)), height, pressure)
    full = 4 * (amplitude / 4) ** 2 * k * length / 2 * modulus.imag / pressure
    assert friction == pytest.approx(full * erf(pressure / math.sqrt(2 * 2 * stress**2)), rel=1e-10)
    assert area == pytest.approx(erf(pressure / math.sqrt(2 * 4 * stress**2)), rel=1e-10)


def test_sum__is_the_integral_over_an_isotropic_spectrum():
    """mu = 1/2 int q^3 C P int cos(phi) Im E*(q V cos(phi)) / s0, and G = 1/8 int q^3 C int |E* / s0|^2.

    On a surface of 64 waves a side with the density C(q) = c / q^3 between two wave numbers, in every wave as it is.
    """
    cells, pressure = 129, 1e5
    q = 2 * np.pi * np.fft.fftfreq(cells, SIDE / cells)
    length = np.hypot(q[:, None], q)
    low, high = 2 * np.pi / SIDE * np.array([8.5, 60.5])
    density = np.where((length > low) & (length < high), 2e-8 / np.maximum(length, low) ** 3, 0.0)
    waves = cells**2 * np.sqrt(density) * 2 * np.pi / SIDE
    height = np.fft.ifft2(waves).real
    friction, area = friction_of_waves(sliding_on((cells, cells)), height, pressure)

    phi, inside = np.linspace(0, 2 * np.pi, 64, endpoint=False), np.linspace(low, high, 400)
    modulus = 1 / complex_compliance(RUBBER, SPEED * np.multiply.outer(inside, np.cos(phi)))
    squared = 2 * np.pi * np.mean(np.abs(modulus) ** 2, axis=1)
    lost = 2 * np.pi * np.mean(np.cos(phi) * modulus.imag, axis=1)
    g = 2e-8 / (8 * pressure**2) * cumulative_trapezoid(squared, inside, initial=0)
    with np.errstate(divide="ignore"):
        integral = np.trapezoid(lost * erf(1 / (2 * np.sqrt(g))), inside)
    assert area < 0.7
    assert friction == pytest.approx(2e-8 / (2 * pressure) * integral, rel=0.01)
    spectrum = rv.psd_table([low, high], [2e-8 / low**3, 2e-8 / high**3], convention="persson")
    ds = rv.friction_theory(spectrum, RUBBER, speeds=SPEED, pressure=pressure, dissipation_factor=1)
    assert ds.friction_coefficient[0] == pytest.approx(2e-8 / (2 * pressure) * integral, rel=1e-3)
    assert ds.contact_fraction[0] == pytest.approx(area, rel=0.01)
