"""The sliding cylinder: its limits, and what is refused."""

import math

import pytest
from references import sliding_cylinder

import roughvisc as rv

RADIUS, LOAD, TIME = 1e-2, 100.0, 1e-3
RUBBER = rv.zener(1e6, 0.5e6, 0.5e6 * TIME, poisson=0.4)
AT_ONCE, IN_THE_END = 0.3e-6, 0.9e-6


@pytest.mark.parametrize(("speed", "compliance"), [(1e-5, IN_THE_END), (1e6, AT_ONCE)], ids=["slow", "fast"])
def test_ends_of_the_speed_axis__are_those_of_hertz(speed, compliance):
    found = sliding_cylinder(RADIUS, RUBBER, LOAD, speed)
    assert found.load == pytest.approx(LOAD, rel=1e-12)
    assert found.half_width == pytest.approx(math.sqrt(4 * RADIUS * LOAD * compliance / math.pi), rel=1e-5)


def test_slow_sliding__loses_the_first_order_in_the_speed():
    """With q = C p + C1 V tau p' in place of the memory the moment of p about the axis is C1 V tau W / C."""
    for speed in (1e-5, 1e-4):
        exact = (IN_THE_END - AT_ONCE) / IN_THE_END * speed * TIME / RADIUS
        assert sliding_cylinder(RADIUS, RUBBER, LOAD, speed).friction_coefficient == pytest.approx(exact, rel=1e-3)
