"""Steady sliding on a layer: against closed forms and dense solutions with a symbol that is found another way."""

import numpy as np
import pytest
from references.dense import PERIOD, dense, line_profiles
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
@pytest.mark.parametrize("speed", [0.03, 0.5])
@pytest.mark.parametrize("profile", ["wave", "rough"])
def test_line_contact__agrees_with_a_dense_solution(pair, speed, profile):
    """And the force times the speed is what both bodies dissipate."""
    height, thickness, load = line_profiles(63)[profile], 8e-5, 4e-4
    exact = dense(height, lambda q: sliding_symbol(q, speed, *PAIRS[pair], thickness), load)
    found = on_layer(height[:, None], PAIRS[pair], thickness, speed, load, tolerance=1e-8)
    assert 0.05 < np.mean(exact > 0) < 0.9
    assert np.abs(found.pressure[:, 0] - exact).sum() < 1e-5 * exact.sum()
    area = PERIOD * PERIOD / 63
    dissipated = power(height, exact, speed, PAIRS[pair], thickness) * area
    assert found.power_force * speed == pytest.approx(dissipated, rel=1e-5)
