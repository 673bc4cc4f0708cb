"""The pressure of a long program is that of a short one: what a step leaves of its error does not grow."""

import numpy as np
import pytest
from support import relative_errors

import roughvisc as rv


@pytest.mark.parametrize("tolerance", [1e-3, pytest.param(1e-5, marks=pytest.mark.thorough)])
def test_relaxed_contact_of_two_cells__is_the_elastic_one_after_many_steps(tolerance):
    """The displacement that steps extrapolate stays that of the pressure."""
    rng, y = np.random.default_rng(364), np.arange(40) / 40
    height = sum(0.01 * rng.normal() * k**-1.3 * np.cos(2 * np.pi * (k * y + rng.random())) for k in range(1, 9))
    ridge = rv.from_array(np.tile(height, (2, 1)), spacing=1 / 40)
    program = rv.Program().pressure(5.46e-3, over=0.2).hold(1.0)
    settings = {"boundary": "periodic", "times": [0.8, 1.0, 1.2], "fields": ("pressure",), "progress": False}
    found, exact = (
        rv.simulate(ridge, body, program, tolerance=tolerance, numerics=rv.Numerics(time_step=step), **settings)
        for body, step in ((rv.Prony(0.08, 0.0, (0.92,), (0.03,)), 2e-3), (rv.Prony(1.0), "auto"))
    )
    assert int((exact.pressure[0] > 0).sum()) == 4  # two cells in each of both rows
    assert relative_errors(found, exact).max() < tolerance
