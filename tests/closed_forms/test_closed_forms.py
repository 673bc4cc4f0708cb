"""Closed forms of the package against direct integration, and as limits of each other."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipkm1
from support import refused

import roughvisc as rv
from roughvisc.mechanics import closed_forms as cf

MODULUS = 3e6
ELASTIC = {
    "sphere": (cf.hertz(2e-3, MODULUS, 0.05), lambda r: r**2 / (2 * 2e-3)),
    "cone": (cf.cone(0.07, MODULUS, 0.05), lambda r: 0.07 * r),
    "punch": (cf.flat_punch(1e-3, MODULUS, 0.05), lambda r: 0.0 * r),
}


def over_rings(contact, weight, *at):
    """``int p weight dr`` over the contact; ``r = a sin(angle)`` takes away the root at its edge."""
    a, ends = contact.radius, [0.0, *(np.arcsin(r / contact.radius) for r in at if r < contact.radius), np.pi / 2]

    def ring(angle):
        return float(contact.pressure(a * np.sin(angle))) * weight(a * np.sin(angle)) * a * np.cos(angle)

    return sum(quad(ring, *part, epsrel=1e-10, limit=200)[0] for part in pairwise(ends))


@pytest.mark.parametrize("name", ELASTIC)
def test_elastic__pressure_carries_the_force_and_the_surface_meets_the_indenter_in_the_contact_alone(name):
    """By Boussinesq's ``u = 1/(pi E*) int p / distance``: a ring of unit pressure gives 4 s K(m) / (s + r)."""
    contact, height = ELASTIC[name]
    assert over_rings(contact, lambda r: 2 * np.pi * r) == pytest.approx(contact.force, rel=1e-7)
    assert not contact.pressure(np.array([1.0001, 1.17, 2.9]) * contact.radius).any()
    for r in np.array([0.07, 0.31, 0.83, 0.99, 1.02, 1.17, 2.9]) * contact.radius:
        displaced = over_rings(contact, lambda s, r=r: 4 * s / (s + r) * ellipkm1(((s - r) / (s + r)) ** 2), r)
        displaced /= np.pi * MODULUS
        if r < contact.radius:
            assert displaced == pytest.approx(contact.approach - height(r), rel=1e-6)
        elif name != "punch":
            assert displaced > contact.approach - height(r)


@pytest.mark.parametrize("fraction", [0.03, 0.5, 0.97, 1.6])
def test_westergaard__surface_meets_the_wave(fraction):
    amplitude, wavelength, modulus, n = 2e-6, 1e-3, 4e6, 2**16
    full = np.pi * modulus * amplitude / wavelength
    contact = cf.westergaard(amplitude, wavelength, modulus, fraction * full)
    assert contact.full_contact_pressure == pytest.approx(full, rel=1e-14)
    x = (np.arange(n) + 0.5) * wavelength / n
    pressure = contact.pressure(x)
    assert pressure.mean() == pytest.approx(fraction * full, rel=1e-5)  # the midpoint rule on a square root
    # plane strain: a wave of pressure exp(iqx) displaces by 2 / (E* |q|)
    transform = np.fft.rfft(pressure)
    transform[1:] *= 2 / (modulus * 2 * np.pi * np.fft.rfftfreq(n, wavelength / n)[1:])
    transform[0] = 0
    gap = np.fft.irfft(transform, n) - amplitude * np.cos(2 * np.pi * x / wavelength)
    touching = np.minimum(x, wavelength - x) < contact.half_width
    gap -= gap[touching].mean()
    np.testing.assert_allclose(gap[touching], 0, atol=1e-6 * amplitude)
    assert (gap[~touching] > -1e-6 * amplitude).all()


def test_johnson_greenwood_higginson__limits():
    """Hertz on every crest; and round gaps in a tension T0 - c r^2, closed where int r T / sqrt(b^2 - r^2) dr = 0."""
    amplitude, wavelength, modulus, pressure = 1e-6, 1e-3, 1e7, 3.0
    crest = cf.hertz(wavelength**2 / (4 * np.pi**2 * amplitude), modulus, pressure * wavelength**2 / 2)
    full, shortfall = np.sqrt(2) * np.pi * modulus * amplitude / wavelength, 1e-3
    low, high = (
        cf.johnson_greenwood_higginson(p, limit) for p, limit in ((pressure / full, "low"), (1 - 1e-3, "high"))
    )
    assert low == pytest.approx(2 * np.pi * crest.radius**2 / wavelength**2, rel=1e-12)
    b = np.sqrt((1 - high) / (2 * np.pi))
    s = b * np.sin((np.arange(1000) + 0.5) / 1000 * np.pi / 2)
    intensity = np.mean(s * (shortfall - (2 * np.pi) ** 2 / 2 * s**2)) / np.mean(s * shortfall)
    assert intensity == pytest.approx(0, abs=1e-6)


def test_lee_radok__is_elastic_at_each_instant_with_the_load_and_compliance_since():
    zener = rv.zener(1.0, 0.5, 0.5)
    program = rv.Program().load(0.2, over=0.0).load(0.5, over=1.5).hold(1.0)
    for t in (0.0, 0.3, 1.5, 2.5):
        crept = 0.2 * zener.contact_compliance(t)
        crept += quad(lambda s, t=t: 0.2 * zener.contact_compliance(t - s), 0, min(t, 1.5))[0]
        elastic = cf.hertz(0.7, 1.0, crept)
        found = cf.lee_radok(0.7, zener, program)
        assert float(found.radius(t)) == pytest.approx(elastic.radius, rel=1e-12)
        assert float(found.approach(t)) == pytest.approx(elastic.approach, rel=1e-12)
        step = cf.hertz(0.7, 1 / float(zener.contact_compliance(t)), 0.3)
        assert float(cf.lee_radok(0.7, zener, "0.3 N").radius(t)) == pytest.approx(step.radius, rel=1e-12)


def test_lee_radok__of_a_recorded_load_is_near_the_one_without_noise(caplog):
    times = np.linspace(0.0, 2.0, 101)
    zener, load = rv.zener(1.0, 0.5, 0.5), np.minimum(times, 0.5)
    noise = 0.005 * np.random.default_rng(1).standard_normal(times.size) * (times > 0)
    recorded = rv.Program.table(times, np.maximum(load + noise, 0.0))
    exact = cf.lee_radok(0.7, zener, rv.Program.table(times, load)).radius(times[25:])
    assert not caplog.records
    contact = cf.lee_radok(0.7, zener, recorded)
    assert contact.radius(times[25:]) == pytest.approx(exact, rel=0.05)
    assert np.all(np.diff(contact.radius(times)) >= 0)
    assert len(caplog.records) == 1
    assert contact.program.note == caplog.messages[0]


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: cf.hertz(1.0, 1.0, -1.0), "force"),
        (lambda: cf.johnson_greenwood_higginson(0.1, "middle"), "limit"),
        (lambda: cf.lee_radok(0.7, rv.elastic(1.0), -1.0), "load"),
        (lambda: cf.lee_radok(0.7, rv.elastic(1.0), rv.Program().approach(1.0, over=1.0)), "load"),
        (lambda: cf.lee_radok(0.7, rv.elastic(1.0), rv.Program().load(1.0, over=1.0).slide(1.0, over=1.0)), "load"),
        (lambda: cf.lee_radok(0.7, rv.elastic(1.0), rv.Program.cycle(1.0, 0.5, 1.0, 1)), "load"),
        (lambda: cf.lee_radok(0.7, rv.elastic(1.0), rv.Program().load(1.0, over=1.0).load(0.8, over=1.0)), "load"),
    ],
)
def test_closed_forms__refuse(make, key):
    with refused(key):
        make()
