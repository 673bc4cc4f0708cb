"""Solutions that other tests compare the solver with: against published values, limits, and each other."""

import math

import numpy as np
import pytest
from references import (
    ElasticLayer,
    Paraboloid,
    PunchOnSheet,
    lee_radok_step,
    pressure_of_springs,
    punch_approach,
    punch_dissipation,
    punch_force,
    reduced_contact,
    sliding_cylinder,
)
from references.layered import inverted

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


def test_reduced_contact__of_a_triangle_of_load_has_the_known_values():
    """Ting's solution by an independent program with tabulated memory integrals; the pressure carries the load."""
    program = rv.Program().load(1.0, over=1.0).load(0.0, over=1.0)
    found = reduced_contact(Paraboloid(1.0), ZENER, program, [1.5, 1.8])
    np.testing.assert_allclose(found.radius, [0.6328325328, 0.4796704874], rtol=5e-5)
    np.testing.assert_allclose(found.approach, [0.4325156393, 0.3484303181], rtol=1e-5)
    r = found.radius[0] * np.sin(np.linspace(0, np.pi / 2, 4001))
    pressure = pressure_of_springs(found.x, found.springs[0], r)
    assert np.trapezoid(2 * np.pi * r * pressure, r) == pytest.approx(0.5, rel=1e-4)


@pytest.mark.parametrize("material", [ZENER, rv.maxwell(1.0, 1.0), rv.Prony(1e-3, 0.0, (0.1, 1.0), (1e-6, 1e3))])
@pytest.mark.parametrize("t", [0.0, 0.1, 20.0])
def test_step_load__pressure_carries_the_force(material, t):
    press = lee_radok_step(1.0, material, 0.7)
    r = float(press.radius(t)) * np.sin(np.linspace(0, np.pi / 2, 4001))
    assert np.trapezoid(2 * np.pi * r * press.pressure(r, t), r) == pytest.approx(0.7, rel=1e-4)


@pytest.mark.parametrize(("speed", "compliance"), [(1e-5, 0.9e-6), (1e6, 0.3e-6)], ids=["slow", "fast"])
def test_sliding_cylinder__is_that_of_hertz_at_the_ends_of_the_speed_axis(speed, compliance):
    """At low speed, with q = C p + C1 V tau p', the moment of the pressure about the axis is C1 V tau W / C."""
    rubber = rv.zener(1e6, 0.5e6, 0.5e3, poisson=0.4)
    found = sliding_cylinder(1e-2, rubber, 100.0, speed)
    assert found.load == pytest.approx(100.0, rel=1e-12)
    assert found.half_width == pytest.approx(math.sqrt(4 * 1e-2 * 100.0 * compliance / math.pi), rel=1e-5)
    if speed < 1:
        assert found.friction_coefficient == pytest.approx(2 / 3 * speed * 1e-3 / 1e-2, rel=1e-3)


def test_inverted__of_known_pairs():
    t = np.array([0.01, 1.0, 30.0])
    np.testing.assert_allclose(inverted(lambda s: 1 / (s * (1 + s * 0.4)), t), -np.expm1(-t / 0.4), rtol=1e-8)
    np.testing.assert_allclose(inverted(lambda s: s**-1.3, t), t**0.3 / math.gamma(1.3), rtol=1e-8)


def test_fixed_contact__force_undoes_approach_and_a_cycle_loses_what_is_stated():
    times = np.linspace(0, 16.0, 3201)
    approach = punch_approach(0.2, ZENER, rv.Program().load(0.5, over=0.0).hold(16.0), times)
    table = rv.Program.table(times.tolist(), approach.tolist(), control="approach")
    np.testing.assert_allclose(punch_force(0.2, ZENER, table, times)[1:], 0.5, rtol=1e-4)
    cycles = 1.0 + 0.3 * np.sin(np.pi * times)
    last, table = slice(-401, None), rv.Program.table(times.tolist(), cycles.tolist(), control="approach")
    work = np.trapezoid(punch_force(0.2, ZENER, table, times[last]), cycles[last])
    assert work == pytest.approx(punch_dissipation(0.2, ZENER, 0.3, 2.0), rel=1e-4)
