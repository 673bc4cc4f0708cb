"""Steady sliding on a layer: against closed forms and dense solutions with a symbol that is found another way."""

import math

import numpy as np
import pytest
from references.dense import PERIOD, dense_on_body, line_profiles, slid
from references.layered import sliding_symbol

import roughvisc as rv
from roughvisc.mechanics.steady_sliding import Sliding, steady_state

#: Times of the materials lie about PERIOD over the speeds; Poisson's ratios differ.
RUBBER, POLYMER = rv.zener(1e6, 3e5, 3e2, 0.5), rv.zener(8e6, 2e6, 8e3, 0.35)
SPRING = rv.elastic(3e6, 0.3)
PAIRS = {
    "rubber on polymer": (RUBBER, POLYMER),
    "polymer on rubber": (POLYMER, RUBBER),
    "elastic on rubber": (SPRING, RUBBER),
    "rubber on elastic": (RUBBER, SPRING),
}


def on_layer(height, pair, thickness, speed, load, **settings):
    """On a strip of square cells, or a square."""
    nx, ny = height.shape
    body = rv.layer(pair[0], thickness, on=pair[1])
    spacing = (PERIOD / nx, PERIOD / (ny if ny > 3 else nx))
    return steady_state(Sliding(body, height.shape, spacing, speed), height.max() - height, load, **settings)


def power(height, pressure, speed, pair, thickness):
    """What both bodies dissipate over the area of a line, by the loss of each wave of pressure. [W/m2]"""
    q = 2 * np.pi * np.fft.fftfreq(len(height), PERIOD / len(height))[1:]
    p = np.fft.fft(pressure)[1:] / len(height)
    loss = -sliding_symbol(np.abs(q), -speed, *pair, thickness).imag
    return float(np.sum(np.abs(p) ** 2 * np.abs(q) * speed * loss))


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("speed", [0.02, 0.3, 4.0])
@pytest.mark.parametrize("thickness", [3e-5, 2e-4])
def test_full_contact_of_a_wave__is_exact(pair, speed, thickness):
    """mu = k A^2 |Im 1/C| / (2 p0), with displacement over pressure C of the wave."""
    amplitude, k = 1e-6, 2 * math.pi / PERIOD
    stiffness = 1 / complex(sliding_symbol(k, speed, *PAIRS[pair], thickness))
    height = amplitude * np.cos(2 * math.pi * (np.arange(21) + 0.5) / 21)[:, None] * np.ones((1, 3))
    pressure, area = 3 * amplitude * abs(stiffness), PERIOD * 3 * PERIOD / 21
    found = on_layer(height, PAIRS[pair], thickness, speed, pressure * area, tolerance=1e-7)
    assert found.converged
    exact = k * amplitude**2 * abs(stiffness.imag) / (2 * pressure)
    assert found.power_force / (pressure * area) == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("speed", [0.03, 0.5])
@pytest.mark.parametrize("profile", ["wave", "rough"])
def test_line_contact__agrees_with_a_dense_solution(pair, speed, profile):
    """And the force times the speed is what both bodies dissipate."""
    height, thickness, load = line_profiles(63)[profile], 8e-5, 4e-4
    exact = dense_on_body(height, lambda q: sliding_symbol(q, speed, *PAIRS[pair], thickness), load)
    found = on_layer(height[:, None], PAIRS[pair], thickness, speed, load, tolerance=1e-8)
    assert 0.05 < np.mean(exact > 0) < 0.9
    assert np.abs(found.pressure[:, 0] - exact).sum() < 1e-5 * exact.sum()
    area = PERIOD * PERIOD / 63
    dissipated = power(height, exact, speed, PAIRS[pair], thickness) * area
    assert found.power_force * speed == pytest.approx(dissipated, rel=1e-5)


@pytest.mark.parametrize("speed", [0.03, 0.5])
def test_line_contact__of_one_material_is_that_on_a_half_space(speed):
    height, load = line_profiles(63)["rough"][:, None], 3e-5
    once = slid(height, RUBBER, speed, load, tolerance=1e-8)
    twice = on_layer(height, (RUBBER, RUBBER), 8e-5, speed, load, tolerance=1e-8)
    np.testing.assert_allclose(twice.pressure, once.pressure, atol=1e-7 * once.pressure.max())
    assert twice.power_force == pytest.approx(once.power_force, rel=1e-7)


@pytest.mark.parametrize("poisson", [0.3, 0.5])
def test_line_contact__on_a_rigid_base_is_that_on_a_sheet(poisson):
    material = rv.zener(1e6, 3e5, 3e2, poisson)
    height, load = line_profiles(63)["rough"][:, None], 3e-5
    sheet = slid(height, material, 0.1, load, rv.sheet(material, 8e-5).kernel, tolerance=1e-8)
    errors = []
    for modulus in (1e10, 1e11):
        stiff = on_layer(height, (material, rv.elastic(modulus, 0.3)), 8e-5, 0.1, load, tolerance=1e-8)
        errors.append(np.abs(stiff.pressure - sheet.pressure).sum() / sheet.pressure.sum())
    assert errors[1] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.1), "the base gives way in proportion to its compliance"
