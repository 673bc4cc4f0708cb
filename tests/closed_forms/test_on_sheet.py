"""Axisymmetric contact with a sheet: published values, limits, and what must hold for any solution."""

import numpy as np
import pytest
from references import OnSheet, PunchOnSheet
from references.growing_contact import StepLoad
from references.indenters import Cone, Paraboloid

import roughvisc as rv
from roughvisc.mechanics.sheet import Sheet

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
INDENTERS = [Paraboloid(10.0), Cone(0.1)]


@pytest.mark.parametrize("poisson", HAYES)
def test_punch__agrees_with_hayes(poisson):
    found = [PunchOnSheet(a, Sheet(1.0, poisson)).scaled_stiffness / (2 * a) for a in RATIOS]
    np.testing.assert_allclose(found, HAYES[poisson], rtol=3e-3)


@pytest.mark.parametrize("indenter", INDENTERS)
@pytest.mark.parametrize("base", ["bonded", "slipping"])
def test_thick_sheet__tends_to_the_half_space_to_first_order(indenter, base):
    a = 0.7
    differences = []
    for thickness in (20.0, 40.0):
        sheet = Sheet(thickness, 0.4, base)
        force = float(OnSheet(indenter, sheet).scaled_force(a))
        assert force == pytest.approx(float(indenter.scaled_force(a)), rel=1e-3)
        less = float(indenter.reduced(a)) - float(OnSheet(indenter, sheet).reduced(a))
        assert less == pytest.approx(sheet.relief * force, rel=5e-3), "the base raises the surface all alike"
        differences.append(less)
    assert differences[0] / differences[1] == pytest.approx(2, rel=1e-2)


@pytest.mark.parametrize(("poisson", "base"), [(0.3, "bonded"), (0.0, "bonded"), (0.5, "slipping")])
def test_thin_sheet__is_a_row_of_springs(poisson, base):
    """First order in thickness over radius: a^2 = 2 R d, and the force of springs that each hold their own cell."""
    errors = []
    for thickness in (0.04, 0.02):
        sheet = Sheet(thickness, poisson, base)
        contact = OnSheet(Paraboloid(100.0), sheet)
        springs = np.pi * 0.5**4 / (4 * 100.0) / sheet.uniform_displacement
        errors.append(abs(float(contact.scaled_force(0.5)) / springs - 1))
        assert float(contact.reduced(0.5)) == pytest.approx(0.5**2 / 200, rel=2 * thickness)
    assert errors[1] < 0.05
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("indenter", INDENTERS)
@pytest.mark.parametrize("sheet", [Sheet(1.0), Sheet(0.3, 0.3), Sheet(0.5, 0.4, "slipping")])
@pytest.mark.parametrize("radius", [0.2, 1.0, 2.5])
def test_pressure__carries_the_force_and_is_positive(indenter, sheet, radius):
    contact = OnSheet(indenter, sheet)
    nodes, weights = np.polynomial.legendre.leggauss(160)
    u = (1 - nodes) / 2  # r = a (1 - u^2): smooth at the edge
    r, dr = radius * (1 - u**2), radius * u * weights
    pressure = contact.scaled_pressure(r, radius)
    assert (pressure > 0).all()
    assert 2 * np.pi * float(np.sum(pressure * r * dr)) == pytest.approx(float(contact.scaled_force(radius)), rel=1e-5)
    assert contact.scaled_pressure([radius, 2 * radius], radius).tolist() == [0, 0]


@pytest.mark.parametrize("sheet", [Sheet(1.0), Sheet(0.4, 0.3), Sheet(0.5, 0.4, "slipping")])
def test_displacement__is_that_of_the_pressure(sheet):
    """Outside, against the transform of the pressure: u = (1/pi) int S(q h) p_q J0(q r) dq, p_q by quadrature."""
    from scipy.special import j0

    from roughvisc.mechanics.sheet import reduction

    contact, a = OnSheet(Paraboloid(10.0), sheet), 0.8
    nodes, weights = np.polynomial.legendre.leggauss(200)
    u = (1 - nodes) / 2
    r, dr = a * (1 - u**2), a * u * weights
    pressure = contact.scaled_pressure(r, a) * r * dr * 2 * np.pi
    q = (np.arange(60000) + 0.5) * 0.01
    spectrum = np.array([float(pressure @ j0(one * r)) for one in q[:6000]])  # the rest is of order q^-2
    at = np.array([0.9, 1.5, 3.0])
    found = contact.displacement(at, a)
    for one, value in zip(at, found, strict=True):
        integrand = reduction(q[:6000] * sheet.thickness, sheet.poisson, sheet.base) * spectrum * j0(q[:6000] * one)
        assert value == pytest.approx(float(np.sum(integrand)) * 0.01 / np.pi, abs=2e-5)
    inside = np.array([0.0, 0.5, 0.8])
    np.testing.assert_allclose(contact.displacement(inside, a), float(contact.reduced(a)) - inside**2 / 20, rtol=1e-12)
    assert float(contact.displacement(a * (1 + 1e-9), a)) == pytest.approx(float(contact.displacement(a, a)), rel=1e-7)


def test_growing_contact__is_that_of_lee_and_radok():
    """The scaled force is the hereditary integral of the load: a load applied at once and kept."""
    material = rv.zener(1e6, 3e5, 1e5)
    contact = OnSheet(Paraboloid(1e-3), Sheet(1e-4))
    press, t = StepLoad(contact, material, 2e-3), np.array([0.0, 0.3, 2.0])
    compliance = np.asarray(material.contact_compliance(t))
    np.testing.assert_allclose(contact.scaled_force(press.radius(t)), 2e-3 * compliance, rtol=1e-11)
    thick = StepLoad(OnSheet(Paraboloid(1e-3), Sheet(1.0)), material, 2e-3)
    half_space = StepLoad(Paraboloid(1e-3), material, 2e-3)
    np.testing.assert_allclose(thick.radius(t), half_space.radius(t), rtol=1e-6)
    assert (press.radius(t) < half_space.radius(t)).all()
