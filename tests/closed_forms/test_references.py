"""Solutions that other tests compare the solver with: against published values, limits, and each other."""

import math

import numpy as np
import pytest
from references.cylinder import sliding_cylinder
from references.layered import ElasticLayer, PunchOnSheet

import roughvisc as rv
from roughvisc.mechanics.sheet import Sheet

ZENER = rv.zener(1.0, 0.5, 0.5)
#: W. C. Hayes, L. M. Keer, G. Herrmann, L. F. Mockros, J. Biomech. 5 (1972) 541, table 1: force over that of a
#: half-space under a flat punch on a bonded layer, by Poisson's ratio, over the ratios of radius to thickness.
RATIOS = (0.2, 0.4, 0.6, 0.8, 1.0)
HAYES = {
    0.30: (1.207, 1.472, 1.784, 2.124, 2.480),
    0.35: (1.218, 1.502, 1.839, 2.211, 2.603),
    0.40: (1.232, 1.542, 1.917, 2.337, 2.789),
    0.45: (1.252, 1.599, 2.031, 2.532, 3.085),
    0.50: (1.281, 1.683, 2.211, 2.855, 3.609),
}


@pytest.mark.parametrize("poisson", HAYES)
def test_punch_on_sheet__agrees_with_hayes(poisson):
    found = [PunchOnSheet(a, Sheet(1.0, poisson)).scaled_stiffness / (2 * a) for a in RATIOS]
    np.testing.assert_allclose(found, HAYES[poisson], rtol=3e-3)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("wide", [0.2, 1.0, 5.0])
def test_punch_on_layer__of_nearly_the_bases_modulus_is_gaos(nu, wide):
    """H. Gao, C.-H. Chiu, J. Lee, Int. J. Solids Struct. 29 (1992) 2471: exact in the first order of the difference."""
    x = 1 / wide
    bent = (1 - 2 * nu) * x * math.log((1 + x**2) / x**2) - x / (1 + x**2)
    share, left = 2 / math.pi * math.atan(x) + bent / (2 * math.pi * (1 - nu)), []
    for more in (0.02, 0.01):
        punch = PunchOnSheet(wide, ElasticLayer(1.0, nu, nu, 1 + more))
        left.append(abs(punch.scaled_stiffness / (2 * wide) * (1 + more) - 1 - more * share))
    assert left[0] < 0.1 * 0.02 * share
    assert math.log2(left[0] / left[1]) == pytest.approx(2, abs=0.05)


@pytest.mark.parametrize(("speed", "compliance"), [(1e-5, 0.9e-6), (1e6, 0.3e-6)], ids=["slow", "fast"])
def test_sliding_cylinder__is_that_of_hertz_at_the_ends_of_the_speed_axis(speed, compliance):
    """At low speed, with q = C p + C1 V tau p', the moment of the pressure about the axis is C1 V tau W / C."""
    rubber = rv.zener(1e6, 0.5e6, 0.5e3, poisson=0.4)
    found = sliding_cylinder(1e-2, rubber, 100.0, speed)
    assert found.load == pytest.approx(100.0, rel=1e-12)
    assert found.half_width == pytest.approx(math.sqrt(4 * 1e-2 * 100.0 * compliance / math.pi), rel=1e-5)
    if speed < 1:
        assert found.friction_coefficient == pytest.approx(2 / 3 * speed * 1e-3 / 1e-2, rel=1e-3)
