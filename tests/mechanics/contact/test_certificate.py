"""What is known of a pressure that is no solution, by dense linear algebra and by Fourier series."""

import math

import numpy as np
import pytest
from support import rough_gap

from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact.certificate import Certificate, RequestedChange, certify, estimated_error
from roughvisc.mechanics.contact.problem import ContactProblem

SHAPE, SPACING = (7, 6), (0.5, 0.8)
CORNER = np.ones(SHAPE, bool)
CORNER[:2, :3] = False


class Case:
    """A problem in its own units, a pressure on part of the cells, and the matrix that displaces them."""

    def __init__(self, boundary="free", present=None, tolerance=1e-6, touching=0.6, **known):
        self.operator = Operator(SHAPE, SPACING, boundary)
        self.gap = rough_gap(SHAPE)
        wanted = {"load": None, "approach": None} | known
        self.problem = ContactProblem.scaled(
            self.operator, self.gap.copy(), **wanted, tolerance=tolerance, present=present
        )
        cells = np.eye(self.gap.size).reshape(-1, *SHAPE)
        ratio = self.problem.pressure_scale / self.problem.length_scale
        self.matrix = np.array([self.operator.displacement(cell).ravel() for cell in cells]) * ratio
        rng = np.random.default_rng(1)
        self.pressure = rng.random(SHAPE) * (rng.random(SHAPE) < touching)
        if present is not None:
            self.pressure *= present
        if self.problem.load is not None:
            self.pressure *= self.problem.load / self.pressure.sum()
        self.displacement = (self.matrix @ self.pressure.ravel()).reshape(SHAPE)
        self.separation = self.problem.gap + self.displacement
        self.contact = np.flatnonzero(self.pressure)

    def certificate(self):
        return certify(self.problem, self.pressure, self.contact, self.displacement)[0]


@pytest.mark.parametrize("present", [None, CORNER], ids=["all", "some"])
def test_certificate__under_a_load_is_the_duality_gap(present):
    """The dual value is that of the same pressure at the largest level at which it is feasible."""
    case = Case(load=3.0, present=present)
    found = case.certificate()
    p, g = case.pressure.ravel(), case.problem.gap.ravel()
    there = slice(None) if present is None else present.ravel()
    primal = 0.5 * p @ case.matrix @ p + g @ p
    lowest = (case.matrix @ p + g)[there].min()
    dual = lowest * p.sum() - 0.5 * p @ case.matrix @ p
    assert found.duality_gap == pytest.approx(primal - dual, rel=1e-10)
    assert found.energy == pytest.approx(p @ case.matrix @ p, rel=1e-12)
    assert found.level == pytest.approx((case.matrix @ p + g)[p > 0].mean(), rel=1e-12)
    assert not found.converged
    assert not found.hopeless


@pytest.mark.parametrize("present", [None, CORNER], ids=["all", "some"])
def test_certificate__under_an_approach_is_the_duality_gap(present):
    """The dual point is the pressure and as much uniform pressure as keeps every present cell from penetrating."""
    case = Case(approach=2.0, present=present, touching=0.2)
    found = case.certificate()
    p, g = case.pressure.ravel(), case.problem.gap.ravel() - case.problem.target
    everywhere = np.ones(g.size, bool) if present is None else present.ravel()
    missing = max(0.0, -(case.matrix @ p + g)[everywhere].min())
    assert missing > 0
    q = p + missing * everywhere / (case.matrix @ everywhere.astype(float))[everywhere].min()
    assert ((case.matrix @ q + g)[everywhere] > -1e-12).all()
    expected = 0.5 * p @ case.matrix @ p + g @ p + 0.5 * q @ case.matrix @ q
    assert found.duality_gap == pytest.approx(expected, rel=1e-10)
    assert found.level == case.problem.target


@pytest.mark.parametrize("more", [0.5, 4.0])
def test_certificate__of_a_periodic_surface_under_an_approach_knows_its_load_and_its_approach(more):
    """The energy error of a pressure among those of its load, and what its own approach is off by."""
    case = Case("periodic", approach=0.9 * float(rough_gap(SHAPE).mean()))
    case.pressure *= more
    case.displacement *= more
    case.separation = case.problem.gap + case.displacement
    p, g = case.pressure.ravel(), case.problem.gap.ravel()
    s = case.matrix @ p + g
    own = p @ s - s.min() * p.sum()
    off = abs(p @ (s - 1.0)) + max(0.0, 1.0 - s.min()) * p.sum()
    assert case.certificate().duality_gap == pytest.approx(max(own, off), rel=1e-10)


def stiffness_by_fourier(case, separation, contact):
    """``w.(1/K)w / mean(w)^2`` for the open gap: the periodic kernel is ``2 / |q|``."""
    w = np.maximum(separation - case.problem.target, 0)
    w.reshape(-1)[contact] = 0
    qx = 2 * np.pi * np.fft.fftfreq(SHAPE[0], SPACING[0])[:, None]
    qy = 2 * np.pi * np.fft.fftfreq(SHAPE[1], SPACING[1])
    over = np.fft.ifft2(np.fft.fft2(w) * np.hypot(qx, qy) / 2).real
    return float((w * over).sum()) / w.mean() ** 2 * case.problem.length_scale / case.problem.pressure_scale


def test_estimated_error__of_a_pressure_that_the_solver_improved():
    case = Case(load=3.0)
    certificate = Certificate(4e-4, 2.0, 1.0, True, False)
    arguments = (case.problem, case.pressure, case.contact, case.displacement)
    # the change asked for, over the pressure, less as the square root of the duality gap fell
    asked = 0.05 * case.problem.influence.scale
    assert estimated_error(*arguments, certificate, RequestedChange(asked, 1e-2)) == pytest.approx(1.25 * 0.05 * 0.2)
    assert estimated_error(*arguments, Certificate(4e-4, 0.0, 1.0, True, False), None) == 0
    assert estimated_error(*arguments, Certificate(-1e-20, 2.0, 1.0, True, False), RequestedChange(asked, 1e-2)) == 0
    assert estimated_error(*arguments, Certificate(4e-4, 2.0, 1.0, False, True), None) == math.inf


def test_estimated_error__where_the_energy_does_not_see_the_load():
    """The change that undoes the residual in the contact, by Fourier series, and the load of a uniform one."""
    case = Case("periodic", approach=0.9 * float(rough_gap(SHAPE).mean()), touching=0.8)
    certificate = Certificate(1e-3, 1.0, 1.0, False, False)
    found = estimated_error(case.problem, case.pressure, case.contact, case.displacement, certificate, None)
    free = (case.separation < 1.0) | (case.pressure > 0)
    residual = np.where(free, case.separation - 1.0, 0.0)
    inverse = np.array(
        [case.problem.influence.operator.approximate_inverse(c.astype(np.float32)).ravel()
         for c in np.eye(case.gap.size).reshape(-1, *SHAPE)]
    ).T  # fmt: skip
    change = (inverse @ residual.ravel())[free.ravel()] * case.problem.length_scale / case.problem.pressure_scale
    uniform = stiffness_by_fourier(case, case.separation, case.contact) * abs(residual.sum()) / case.gap.size
    assert found == pytest.approx((np.abs(change).sum() + uniform) / case.pressure.sum(), rel=1e-4)
