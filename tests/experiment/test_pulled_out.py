"""Contact that is pulled out and pressed again, with hardly any instantaneous compliance: the stated error."""

import numpy as np
import pytest
from support import relative_errors

import roughvisc as rv

TIMES = [0.1, 0.3, 0.5, 0.55, 0.6, 0.7, 0.75, 0.8, 0.9, 1.0, 1.2, 1.3, 1.6]
SURFACES = {
    "ball": (rv.sphere(1.0, (0.8, 0.9), (20, 17)), "free"),
    "rough": (rv.self_affine((1.0, 0.85), (20, 17), hurst=0.8, rms_slope=0.1, rolloff=0.5, seed=3), "periodic"),
}


@pytest.mark.parametrize("tolerance", [1e-2, pytest.param(1e-3, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("instantaneous", [1e-5, pytest.param(1e-3, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("surface", ["rough", pytest.param("ball", marks=pytest.mark.thorough)])
def test_second_press__keeps_the_tolerance_or_states_its_error(surface, instantaneous, tolerance):
    """Against a run at a thirtieth of the tolerance."""
    height, boundary = SURFACES[surface]
    deep = 0.05 if surface == "ball" else 0.5 * float(height.max() - height.mean())
    program = rv.Program().approach(deep, over=0.5).approach(0.3 * deep, over=0.2).approach(1.2 * deep, over=0.5)
    material = rv.Prony(instantaneous, 0.0, (1 - instantaneous,), (0.3,))
    settings = {"boundary": boundary, "times": TIMES, "fields": ("pressure",), "progress": False}
    found, exact = (
        rv.simulate(height, material, program.hold(0.4), tolerance=one, **settings)
        for one in (tolerance, tolerance / 30)
    )
    assert (exact.force.values == 0).any()  # out of contact between both
    true, stated = relative_errors(found, exact), found.stated_error.values
    assert (true <= np.maximum(1.3 * tolerance, stated)).all()
    large = true > 0.5 * tolerance
    assert (stated[large] >= 0.8 * true[large]).all()
