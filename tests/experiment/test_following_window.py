"""A window that follows the contact in free space gives what the whole domain gives."""

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.errors import EdgeContactError

RUBBER = rv.zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=1e5)


def rough_profile(number):
    """A self-affine surface of odd, unequal sizes, every second one with a bump under it."""
    rng = np.random.default_rng(number)
    shape = tuple(int(count) for count in 97 + 2 * rng.permutation(32)[:2])
    size = tuple(1e-6 * count for count in shape)
    height = rv.self_affine(size, shape, hurst=0.8, rms_slope=0.1, rolloff=2e-5, seed=number)
    if number % 2:
        x, y = height.x - height.x.mean(), height.y - height.y.mean()
        height = height - (x**2 + y**2) / (2 * rng.choice([3e-4, 1e-3]))
    return height, float(rng.choice([1e-6, 1e-5]))


@pytest.mark.parametrize("first", [0, *(pytest.param(n, marks=pytest.mark.thorough) for n in (15, 30, 45))])
def test_window__gives_the_contact_of_the_whole_domain(first):
    inside = 0
    for number in range(first, first + 15):
        height, load = rough_profile(number)
        program = rv.Program().load(load, over=0.1)
        settings = {"boundary": "free", "tolerance": 1e-2, "times": [0.1], "fields": ("pressure",), "progress": False}
        whole = rv.simulate(height, RUBBER, program, edge="accept", **settings)
        pressure = whole.pressure.values[0]
        border = np.concatenate([pressure[0], pressure[-1], pressure[:, 0], pressure[:, -1]])
        if border.any():
            with pytest.raises(EdgeContactError):
                rv.simulate(height, RUBBER, program, **settings)
            continue
        inside += 1
        windowed = rv.simulate(height, RUBBER, program, **settings)
        assert np.abs(windowed.pressure.values[0] - pressure).sum() <= 1e-3 * pressure.sum()
        assert float(windowed.approach[0]) == pytest.approx(float(whole.approach[0]), rel=1e-3)
    assert inside > 5
