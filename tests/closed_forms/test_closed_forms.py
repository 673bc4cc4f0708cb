"""Each closed form against an independent check: balance of forces, direct integration, limits, printed numbers."""

from itertools import pairwise

import numpy as np
import pytest
import references
from references import growing_contact
from references.indenters import Cone, Paraboloid
from scipy.integrate import quad
from scipy.special import ellipkm1

from roughvisc.errors import InputError
from roughvisc.mechanics import closed_forms as cf
from roughvisc.mechanics.materials import models as materials
from roughvisc.mechanics.program import Program

ELASTIC = {
    "sphere": cf.hertz(2e-3, 3e6, 0.05),
    "cone": cf.cone(0.07, 3e6, 0.05),
    "punch": cf.flat_punch(1e-3, 3e6, 0.05),
}


def graded(low, high, levels=24, order=8):
    """Gauss panels between two ends that halve towards both: nodes, distances to both ends, weights.

    The nodes go through ``sin^2``, which takes away square roots at the ends, and their inverses.
    """
    nodes, weights = np.polynomial.legendre.leggauss(order)
    edges = np.concatenate([[0.0], 0.5 * 0.5 ** np.arange(levels, -1, -1)]) * np.pi / 2
    width = np.diff(edges)[:, None]
    v, w = (edges[:-1, None] + width * (nodes + 1) / 2).ravel(), (width * weights / 2).ravel()
    v, w = np.concatenate([v, np.pi / 2 - v]), np.concatenate([w, w])
    v_complement = np.concatenate([np.pi / 2 - v[: len(v) // 2], v[: len(v) // 2]])
    length = high - low
    near, far = length * np.sin(v) ** 2, length * np.sin(v_complement) ** 2
    return low + near, near, far, length * 2 * np.sin(v) * np.sin(v_complement) * w


def force_of(pressure, *radii, levels=24):
    """``int p 2 pi r dr`` between consecutive radii, with roots at either end allowed."""
    total = 0.0
    for low, high in pairwise((0.0, *radii)):
        r, _, _, weights = graded(low, high, levels)
        total += np.sum(weights * 2 * np.pi * r * pressure(np.minimum(r, np.nextafter(high, 0))))
    return total


def boussinesq(pressure, radius, r, modulus):
    """Displacement of a half-space by ``u = 1/(pi E*) int p / distance``, ring by ring."""
    total = 0.0
    for low, high in ((0.0, min(r, radius)), (r, radius)):
        if low < high:
            s, near, far, weights = graded(low, high, order=12)
            distance = far if high == r else near if low == r else r - s
            # a ring of unit pressure: 4 s K(m) / (s + r), m = 4 s r / (s + r)^2
            ring = 4 * s / (s + r) * ellipkm1((distance / (s + r)) ** 2)
            total += np.sum(weights * pressure(np.minimum(s, np.nextafter(radius, 0))) * ring)
    return total / (np.pi * modulus)


@pytest.mark.parametrize("name", ELASTIC)
def test_elastic__pressure_carries_the_force(name):
    contact = ELASTIC[name]
    tolerance = 3e-8 if name == "punch" else 1e-12  # at an infinite edge the radii's rounding is felt
    assert force_of(contact.pressure, contact.radius) == pytest.approx(contact.force, rel=tolerance)


@pytest.mark.parametrize("name", ELASTIC)
@pytest.mark.parametrize("ratio", [0.31, 0.83, 1.17, 2.9])
def test_elastic__pressure_displaces_the_surface_as_stated(name, ratio):
    contact = ELASTIC[name]
    r = ratio * contact.radius
    direct = boussinesq(contact.pressure, contact.radius, r, 3e6)
    assert direct == pytest.approx(float(contact.displacement(r)), rel=1e-7)


@pytest.mark.parametrize(
    ("name", "height"), [("sphere", lambda r: r**2 / (2 * 2e-3)), ("cone", lambda r: 0.07 * r)], ids=["sphere", "cone"]
)
def test_elastic__surface_meets_the_indenter(name, height):
    contact = ELASTIC[name]
    r = np.linspace(0, 1, 11) * contact.radius
    gap = contact.displacement(r) - contact.approach + height(r)
    np.testing.assert_allclose(gap, 0, atol=1e-15 * contact.approach)
    outside = np.linspace(1.0001, 5, 50) * contact.radius
    assert np.all(contact.displacement(outside) - contact.approach + height(outside) > 0)


@pytest.mark.parametrize("indenter", [Paraboloid(0.3), Cone(0.2)])
def test_indenter__reduced_profile_is_the_abel_transform(indenter):
    def slope(r):
        return (indenter.height(r * (1 + 1e-6)) - indenter.height(r * (1 - 1e-6))) / (2e-6 * r)

    for x in (0.01, 0.2):
        transform = x * quad(lambda v, x=x: slope(x * np.sin(v)), 0, np.pi / 2)[0]
        assert transform == pytest.approx(float(indenter.reduced(x)), rel=1e-8)
        area = 2 * quad(lambda s, x=x: indenter.reduced(x) - indenter.reduced(s), 0, x)[0]
        assert area == pytest.approx(float(indenter.scaled_force(x)), rel=1e-12)
        assert float(indenter.radius_at_scaled_force(indenter.scaled_force(x))) == pytest.approx(x, rel=1e-14)
        assert float(indenter.radius_at_approach(indenter.reduced(x))) == pytest.approx(x, rel=1e-14)


@pytest.mark.parametrize("fraction", [0.03, 0.5, 0.97, 1.6])
def test_westergaard__surface_meets_the_wave(fraction):
    amplitude, wavelength, modulus = 2e-6, 1e-3, 4e6
    full = cf.full_contact_pressure(amplitude, wavelength, modulus, waves=1)
    contact = cf.westergaard(amplitude, wavelength, modulus, fraction * full)
    n = 2**16
    x = (np.arange(n) + 0.5) * wavelength / n
    pressure = contact.pressure(x)
    assert pressure.mean() == pytest.approx(fraction * full, rel=1e-5)  # the midpoint rule on a square root
    # plane strain: a wave of pressure exp(iqx) displaces by 2 / (E* |q|)
    q = 2 * np.pi * np.fft.rfftfreq(n, wavelength / n)
    transform = np.fft.rfft(pressure)
    transform[1:] *= 2 / (modulus * q[1:])
    transform[0] = 0
    gap = np.fft.irfft(transform, n) - amplitude * np.cos(2 * np.pi * x / wavelength)
    touching = np.minimum(x, wavelength - x) < contact.half_width
    gap -= gap[touching].mean()
    np.testing.assert_allclose(gap[touching], 0, atol=1e-6 * amplitude)
    assert np.all(gap[~touching] > -1e-6 * amplitude)


def test_westergaard__full_contact_joins_partial_contact():
    below = cf.westergaard(1.0, 1.0, 1.0, np.pi * (1 - 1e-12))
    above = cf.westergaard(1.0, 1.0, 1.0, np.pi)
    x = np.linspace(-0.5, 0.5, 41)
    np.testing.assert_allclose(below.pressure(x), above.pressure(x), atol=1e-5)
    assert above.contact_fraction == 1


def test_johnson_greenwood_higginson__low_limit_is_hertz_on_every_crest():
    amplitude, wavelength, modulus, pressure = 1e-6, 1e-3, 1e7, 3.0
    crest = cf.hertz(wavelength**2 / (4 * np.pi**2 * amplitude), modulus, pressure * wavelength**2 / 2)
    full = cf.full_contact_pressure(amplitude, wavelength, modulus)
    fraction = cf.johnson_greenwood_higginson(pressure / full, "low")
    assert fraction == pytest.approx(2 * np.pi * crest.radius**2 / wavelength**2, rel=1e-12)


def test_johnson_greenwood_higginson__high_limit_is_a_crack_without_singularity():
    # a round gap of radius b in tension T0 - c r^2 closes smoothly where int r T / sqrt(b^2 - r^2) dr = 0
    full, shortfall, k = 1.0, 1e-3, 2 * np.pi
    b = np.sqrt((1 - cf.johnson_greenwood_higginson(1 - shortfall, "high")) / (2 * np.pi))

    def tension(r):
        return shortfall - full * k**2 / 2 * r**2

    intensity = quad(lambda v: b * np.sin(v) * tension(b * np.sin(v)), 0, np.pi / 2)[0]
    assert intensity == pytest.approx(0, abs=1e-12 * shortfall)


STEP = {
    "maxwell": materials.maxwell(1.0, 1.0),
    "zener": materials.zener(2.0, 1.0, 1.0),
    "zener stiff": materials.zener(100.0, 1.0, 1.0),
    "zener nu": materials.zener(1.0, 2.0, 0.3, poisson=0.3),
    "two modes and flow": materials.Prony(0.2, 0.03, (0.5, 1.0), (0.01, 3.0)),
    "many decades": materials.Prony(1e-3, 0.0, (0.1, 0.2, 1.0), (1e-6, 1e-2, 1e3)),
}


@pytest.mark.parametrize("name", STEP)
@pytest.mark.parametrize("t", [0.0, 0.1, 20.0])
def test_step_load__pressure_carries_the_force(name, t):
    press = growing_contact.lee_radok_step(1.0, STEP[name], 0.7)
    # the pressure has a feature wherever the radius lingered: between the times of the modes
    radii = press.radius(np.concatenate([[0.0], np.geomspace(1e-8, 1, 25) * t]))
    assert force_of(lambda r: press.pressure(r, t), *radii, levels=8) == pytest.approx(0.7, rel=1e-10)


def test_step_load__maxwell_pressure_by_the_printed_integral():
    # a Maxwell half-space has E' = -E exp(-t/tau)/tau, and the radius squared grows as (1 + t/tau)^(2/3)
    press = growing_contact.lee_radok_step(1.0, materials.maxwell(1.0, 1.0), 1.0)
    first = float(press.radius(0.0))

    def root(r, t):
        return np.sqrt(max(first**2 * (1 + t) ** (2 / 3) - r**2, 0.0))

    for r, t in ((0.3, 2.0), (first, 2.0), (1.1 * first, 2.0)):
        entry = max((r / first) ** 3 - 1, 0.0)
        memory = quad(
            lambda z, r=r, t=t, e=entry: np.exp(-(t - e - z * z)) * root(r, e + z * z) * 2 * z,
            0,
            np.sqrt(t - entry),
            epsabs=1e-13,
        )[0]
        printed = 4 * 2 / np.pi * (root(r, t) - memory)
        assert float(press.pressure(r, t)) == pytest.approx(printed, rel=1e-8)


def test_forms__refuse_impossible_input():
    with pytest.raises(InputError, match="force"):
        cf.hertz(1.0, 1.0, -1.0)
    with pytest.raises(InputError, match="waves"):
        cf.full_contact_pressure(1.0, 1.0, 1.0, waves=3)


class PowerLaw:
    """Contact compliance ``glassy + c t^exponent``, with nothing but what a material must have."""

    poisson = 0.5

    def __init__(self, glassy, coefficient, exponent):
        self.glassy_compliance, self.coefficient, self.exponent = glassy, coefficient, exponent

    def contact_compliance(self, t):
        return self.glassy_compliance + self.coefficient * np.asarray(t, dtype=float) ** self.exponent

    def contact_integral(self, t):
        t = np.asarray(t, dtype=float)
        power = self.exponent + 1
        return self.glassy_compliance * t + self.coefficient * t**power / power


ZENER = materials.zener(1.0, 0.5, 0.5)
SPHERE = Paraboloid(1.0)
TRIANGLE = Program().load(1.0, over=1.0).load(0.0, over=1.0)


def test_hereditary_integral__equals_quadrature():
    program = Program().load(0.5, over=0.0).hold(1.0).load(2.0, over=0.5).load(1.0, over=0.0).load(3.0, over=2.0)
    kernel, integral = ZENER.contact_compliance, ZENER.contact_integral
    for t in (0.0, 0.7, 1.2, 1.5, 3.0):
        ramps = quad(lambda s, t=t: kernel(t - s) * 3.0, min(1.0, t), min(1.5, t))[0]
        ramps += quad(lambda s, t=t: kernel(t - s) * 1.0, min(1.5, t), t)[0] if t > 1.5 else 0.0
        jumps = 0.5 * kernel(t) - (kernel(t - 1.5) if t >= 1.5 else 0.0)
        assert float(growing_contact.hereditary_integral(kernel, integral, program, t)) == pytest.approx(
            ramps + jumps, rel=1e-12
        )


def test_lee_radok__of_a_sphere_is_that_of_any_indenter():
    """The same integral, and the elastic contact of the compliance then."""
    program = Program().load(0.2, over=0.0).load(0.5, over=1.5).hold(1.0)
    times = np.array([0.0, 0.3, 1.5, 2.5])
    found, expected = cf.lee_radok(0.7, ZENER, program), growing_contact.lee_radok(Paraboloid(0.7), ZENER, program)
    np.testing.assert_allclose(found.radius(times), expected.radius(times), rtol=1e-14)
    np.testing.assert_allclose(found.approach(times), expected.approach(times), rtol=1e-14)
    for t in times:
        elastic = cf.hertz(0.7, 1 / float(ZENER.contact_compliance(t)), 0.3)
        assert float(cf.lee_radok(0.7, ZENER, "0.3 N").radius(t)) == pytest.approx(elastic.radius, rel=1e-14)
    for wrong in (TRIANGLE, Program().approach(1.0, over=1.0), -1.0):
        with pytest.raises(InputError):
            cf.lee_radok(0.7, ZENER, wrong)


def test_lee_radok__of_a_step_is_that_of_a_step_load():
    times = np.array([0.1, 1.0, 2.0])
    step = growing_contact.lee_radok(SPHERE, ZENER, Program().load(0.3, over=0.0).hold(2.0))
    np.testing.assert_allclose(
        step.approach(times), growing_contact.lee_radok_step(1.0, ZENER, 0.3).approach(times), rtol=1e-14
    )
    with pytest.raises(InputError, match="never falls"):
        growing_contact.lee_radok(SPHERE, ZENER, TRIANGLE)


@pytest.fixture(scope="module")
def triangle():
    return references.ting(SPHERE, ZENER, TRIANGLE)


@pytest.mark.thorough
def test_ting__triangle_on_zener_has_the_known_values(triangle):
    # from an independent program with tabulated memory integrals
    assert triangle.time_of_maximum == pytest.approx(1.084415017, abs=1e-9)
    np.testing.assert_allclose(triangle.radius([1.5, 1.8]), [0.6328325328, 0.4796704874], atol=1e-10)
    np.testing.assert_allclose(triangle.approach([1.5, 1.8]), [0.4325156393, 0.3484303181], atol=1e-10)


@pytest.mark.thorough
def test_ting__half_sine_on_maxwell_has_the_known_values():
    contact = references.ting(SPHERE, materials.maxwell(1.0, 1.0), lambda t: np.sin(np.pi * t / 2), end=2.0)
    assert contact.time_of_maximum == pytest.approx(1.360907073, abs=1e-9)
    assert float(contact.radius(1.9)) == pytest.approx(0.5355782231, abs=1e-10)
    assert float(contact.approach(1.9)) == pytest.approx(0.4100906593, abs=1e-10)


@pytest.mark.thorough
@pytest.mark.parametrize("t", [0.4, 1.0, 1.05, 1.5, 1.95])
def test_ting__pressure_carries_the_load(triangle, t):
    load = 1 - abs(t - 1)
    radii = sorted({float(triangle.radius(s)) for s in (0.5 * t, 1.0, t)})
    radii = [radius for radius in radii if radius <= float(triangle.radius(t))]
    assert force_of(lambda r: triangle.pressure(r, t), *radii, levels=16) == pytest.approx(load, rel=1e-9)


OTHER_LAWS = {
    "kelvin-voigt": materials.kelvin_voigt(1.0, 1.0),
    "power law": PowerLaw(0.0, 0.25, 0.5),
    "glassy power law": PowerLaw(0.1, 0.25, 0.5),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", OTHER_LAWS)
def test_reduced_contact__growth_is_lee_radok(name):
    times, material = [0.1, 1.0, 10.0], OTHER_LAWS[name]
    tolerance = 3e-5 if name == "kelvin-voigt" else 1e-5
    for program in (Program().load(1.0, over=0.0).hold(10.0), Program().load(10.0, over=10.0)):
        exact = growing_contact.lee_radok(SPHERE, material, program)
        found = references.reduced_contact(SPHERE, material, program, times, steps=60, elements=2000)
        np.testing.assert_allclose(found.radius, exact.radius(times), rtol=tolerance)
        np.testing.assert_allclose(found.approach, exact.approach(times), rtol=tolerance)


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["zener", "maxwell", "zener stiff"])
@pytest.mark.parametrize("indenter", [SPHERE, Cone(0.3)], ids=["sphere", "cone"])
def test_reduced_contact__single_maximum_is_ting(name, indenter):
    times = [0.5, 1.2, 1.7, 1.9]
    exact = references.ting(indenter, STEP[name], TRIANGLE)
    found = references.reduced_contact(indenter, STEP[name], TRIANGLE, times)
    np.testing.assert_allclose(found.radius, exact.radius(times), rtol=1e-5)
    np.testing.assert_allclose(found.approach, exact.approach(times), rtol=4e-7)
    assert found.error < 3e-5


@pytest.mark.thorough
def test_reduced_contact__held_approach_relaxes_with_the_modulus():
    material = STEP["two modes and flow"]
    program = Program().load(0.7, over=0.0).hold(3.0, control="approach")
    found = references.reduced_contact(SPHERE, material, program, [0.0, 0.1, 1.0, 3.0], steps=200)
    relaxation = growing_contact.ContactRelaxation.of(material)
    np.testing.assert_allclose(found.force, 0.7 * relaxation(found.times) / relaxation(0.0), rtol=2e-6)
    np.testing.assert_allclose(found.radius, found.radius[0], rtol=1e-6)
    work = 0.4 * 0.7 * found.approach[0]  # int W d(approach) = 2/5 W approach of an elastic sphere
    np.testing.assert_allclose(found.work, work, rtol=1e-5)


@pytest.mark.thorough
@pytest.mark.parametrize(("period", "loss", "digits"), [(3.0, 0.30881, 4e-4), (30.0, 0.16094, 1e-4)])
def test_reduced_contact__settled_cycle_loses_the_known_work(period, loss, digits):
    cycles = 6
    program = Program.cycle(1.0, 0.9, period, cycles)
    found = references.reduced_contact(SPHERE, ZENER, program, np.arange(cycles + 1) * period, steps=40, elements=1500)
    work = np.diff(found.work)
    assert work[-1] == pytest.approx(loss, rel=digits)  # from an independent program, to fewer digits
    assert work[-1] == pytest.approx(work[-2], rel=2e-5)


@pytest.mark.thorough
def test_reduced_contact__kelvin_voigt_under_approach():
    # elements carry E w + eta w': while the sphere sinks g(a) = approach, while it rises g(a) = approach - eta v / E
    material, speed = materials.kelvin_voigt(1.0, 0.5), 0.1
    modulus, viscosity = 4.0, 2.0
    program = Program().approach(0.2, over=0.2 / speed).approach(0.1, over=0.1 / speed)
    found = references.reduced_contact(SPHERE, material, program, [0.5, 1.5, 2.2, 2.7])
    lag = np.array([0, 0, 1, 1]) * viscosity * speed / modulus
    radius = SPHERE.radius_at_approach(found.approach - lag)
    dashpots = np.array([1, 1, 0, 0]) * 2 * radius * viscosity * speed
    np.testing.assert_allclose(found.radius, radius, rtol=1e-5)
    np.testing.assert_allclose(found.force, modulus * SPHERE.scaled_force(radius) + dashpots, rtol=1e-5)


def test_punch__approach_undoes_force():
    # C and E are each other's inverse: hold the approach that a load of one second reached
    relaxation = growing_contact.ContactRelaxation.of(ZENER)
    times = np.linspace(0, 3, 7)
    product = [
        quad(lambda s, t=t: ZENER.contact_compliance(t - s) * relaxation(s), 0, t, epsabs=1e-13)[0] for t in times
    ]
    np.testing.assert_allclose(product, times, atol=1e-12)
    force = references.punch_force(0.2, ZENER, Program().approach(0.1, over=0.0).hold(3.0), times)
    np.testing.assert_allclose(force, 2 * 0.2 * 0.1 * relaxation(times), rtol=1e-14)
    approach = references.punch_approach(0.2, ZENER, Program().load(0.5, over=0.0).hold(3.0), times)
    np.testing.assert_allclose(approach, 0.5 / 0.4 * ZENER.contact_compliance(times), rtol=1e-14)


def test_punch__settled_cycle_loses_what_is_stated():
    period, steps, cycles = 2.0, 400, 8
    times = np.linspace(0, cycles * period, cycles * steps + 1)
    approach = 1.0 + 0.3 * np.sin(2 * np.pi * times / period)
    program = Program.table(times.tolist(), approach.tolist(), control="approach")
    last = slice(-steps - 1, None)
    force = references.punch_force(0.2, ZENER, program, times[last])
    work = np.sum((force[1:] + force[:-1]) / 2 * np.diff(approach[last]))
    assert work == pytest.approx(references.punch_dissipation(0.2, ZENER, 0.3, period), rel=1e-4)


def test_full_contact_wave__starts_elastic_and_relaxes_to_the_rubber():
    amplitude, wavelength = 1e-6, 1e-3
    pressure = references.full_contact_wave(amplitude, 2 * np.pi / wavelength, ZENER, [0.0, 1e3])
    for found, compliance in zip(pressure, ZENER.contact_compliance([0.0, 1e3]), strict=True):
        assert found == pytest.approx(cf.full_contact_pressure(amplitude, wavelength, 1 / compliance, waves=1))
