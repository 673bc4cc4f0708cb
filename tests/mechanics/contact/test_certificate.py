"""What is known of a pressure that is no solution, by dense linear algebra and by Fourier series."""

import itertools
import math

import numpy as np
import pytest
from support import rough_gap

from roughvisc.mechanics import arrays as passes
from roughvisc.mechanics.bodies.operator import Operator
from roughvisc.mechanics.contact import certificate as full_contact
from roughvisc.mechanics.contact import problem
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


def test_scaled_problem__is_the_same_in_other_units():
    """Lengths over one of them, pressures over another, heights from the lowest point that is there."""
    there = rough_gap(SHAPE) > 0
    for known in ({"load": 3.0}, {"approach": 2.0}):
        case = Case(present=there, **known)
        problem, lowest = case.problem, case.gap[there].min()
        assert problem.lowest == lowest > case.gap.min()
        assert problem.gap * problem.length_scale + lowest == pytest.approx(case.gap)
        pressure = np.arange(case.gap.size, dtype=float).reshape(SHAPE)
        displaced = problem.influence.displacement(pressure)
        assert displaced * problem.length_scale == pytest.approx(
            case.operator.displacement(pressure * problem.pressure_scale)
        )
        if "load" in known:
            assert problem.load * problem.pressure_scale == pytest.approx(3.0)
        else:
            assert problem.target * problem.length_scale + lowest == pytest.approx(2.0)


@pytest.mark.parametrize("known", [{"load": 3.0}, {"approach": 2.0}], ids=["load", "approach"])
@pytest.mark.parametrize("told", [False, True])
def test_first_guess__is_made_admissible(known, told):
    case = Case(present=CORNER, **known)
    guess = np.random.default_rng(4).standard_normal(SHAPE)
    if told:
        guess = np.abs(guess) * CORNER
    displacement = case.operator.displacement(guess) if told else None
    pressure, displaced = case.problem.initial_iterate(guess.copy(), displacement)
    expected = np.maximum(guess, 0) * CORNER
    expected *= 3.0 / expected.sum() if "load" in known else 1.0
    assert pressure * case.problem.pressure_scale == pytest.approx(expected)
    if told:
        assert displaced == pytest.approx((case.matrix @ pressure.ravel()).reshape(SHAPE))
    else:
        assert displaced is None


def test_first_guess__without_one_presses_what_lies_below_the_approach():
    under = Case(approach=2.0)
    for nothing in (None, np.zeros(SHAPE)):
        pressure, displaced = under.problem.initial_iterate(nothing, None)
        assert displaced is None
        assert pressure * under.problem.length_scale == pytest.approx(np.maximum(2.0 - under.gap, 0))
        loaded = Case(load=3.0, present=CORNER).problem.initial_iterate(nothing, None)[0]
        assert loaded == pytest.approx(CORNER / CORNER.sum())


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


def test_certificate__of_nothing_is_none():
    for known in ({"load": 3.0}, {"approach": 2.0}):
        for boundary in ("free", "periodic"):
            case = Case(boundary, **known)
            nothing = np.zeros(SHAPE)
            contact = np.arange(1)
            found, _ = certify(case.problem, nothing, contact, nothing)
            assert not found.converged
            assert not found.settled


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


def test_certificate__is_settled_where_it_converged_or_cannot():
    assert Certificate(1.0, 1.0, 1.0, True, False).settled
    assert Certificate(1.0, 1.0, 1.0, False, True).settled
    assert not Certificate(1.0, 1.0, 1.0, False, False).settled


def stiffness_by_fourier(case, separation, contact):
    """``w.(1/K)w / mean(w)^2`` for the open gap: the periodic kernel is ``2 / |q|``."""
    w = np.maximum(separation - case.problem.target, 0)
    w.reshape(-1)[contact] = 0
    qx = 2 * np.pi * np.fft.fftfreq(SHAPE[0], SPACING[0])[:, None]
    qy = 2 * np.pi * np.fft.fftfreq(SHAPE[1], SPACING[1])
    over = np.fft.ifft2(np.fft.fft2(w) * np.hypot(qx, qy) / 2).real
    return float((w * over).sum()) / w.mean() ** 2 * case.problem.length_scale / case.problem.pressure_scale


def test_stiffness__is_that_of_the_open_gap():
    case = Case("periodic", approach=0.9 * float(rough_gap(SHAPE).mean()), touching=0.8)
    found = full_contact.stiffness(case.problem, case.contact, case.separation.copy())
    assert found == pytest.approx(stiffness_by_fourier(case, case.separation, case.contact), rel=1e-5)
    assert full_contact.stiffness(case.problem, np.arange(case.gap.size), case.separation.copy()) == math.inf


def nearly_closed(amiss, short=1e-2, tolerance=1e-6, sign=1.0):
    """All cells but one touch, and in one of those the gap is off; the load is one."""
    case = Case("periodic", approach=(1 - short) * float(rough_gap(SHAPE).mean()), tolerance=tolerance)
    case.contact = np.arange(1, case.gap.size)
    case.separation = np.ones(SHAPE)
    case.separation[0, 0] += case.problem.remaining * case.gap.size
    case.separation[2, 3] += sign * amiss
    return case


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["open", "penetrating"])
def test_load__is_certain_where_the_gap_in_the_contact_is_small_over_what_is_left(sign):
    """A gap of ``e`` on average in the contact is off by as much load as it has stiffness."""
    for amiss, tolerance in ((1e-8, 1e-6), (1e-4, 1e-6), (1e-4, 1e-2)):
        case = nearly_closed(amiss, tolerance=tolerance, sign=sign)
        here = case.separation.take(case.contact)
        load = 2.0
        certain, unknown = full_contact.load_certainty(
            case.problem, case.contact, case.separation.copy(), here, load, 1e-15
        )
        stiff = stiffness_by_fourier(case, case.separation, case.contact)
        part = amiss / (case.gap.size * case.problem.remaining)
        error = stiff * amiss / case.gap.size / load
        limit = 10 * tolerance
        assert not 0.8 < error / limit < 1.25
        assert not 0.8 < part / limit < 1.25
        assert (certain, unknown) == (part <= limit or error <= limit, False)
        assert case.problem.influence.convolutions == int(part > limit), "the stiffness where that is not clear"
    # no iteration can do more than rounding lets it
    case = nearly_closed(1e-4, tolerance=1e-9, sign=sign)
    here = case.separation.take(case.contact)
    assert full_contact.load_certainty(case.problem, case.contact, case.separation.copy(), here, 2.0, 1e-5)[1]
    assert full_contact.load_certainty(case.problem, case.contact, case.separation.copy(), here, 2.0, 1.0) == (
        False,
        True,
    ), "nothing is left to full contact but rounding"


@pytest.mark.parametrize(("short", "expected"), [(-1e-4, False), (1e-4, True), (1e-2, False)])
def test_excess__is_a_load_that_leaves_no_gap_so_near_full_contact(short, expected):
    case = Case("periodic", approach=(1 - short) * float(rough_gap(SHAPE).mean()))
    everywhere = np.arange(case.gap.size)
    # what is left is in parts of the approach above the lowest point
    left = case.problem.remaining
    assert left == pytest.approx(case.problem.gap.mean() - 1.0)
    assert full_contact.carries_excess(case.problem, everywhere) == expected == (0 < left < 1e-3)
    assert not full_contact.carries_excess(case.problem, everywhere[1:])


def test_approach_under_a_load__is_the_level_of_the_contact_weighted_by_pressure():
    case = Case(load=3.0)
    s, p = case.separation, case.pressure
    level = float(s[p > 0].mean())
    found = full_contact.approach_under_load(case.problem, p, case.contact, case.displacement, level)
    assert found == pytest.approx((p * s).sum() / p.sum())


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


@pytest.mark.parametrize("known", [{"load": 3.0}, {"approach": 2.0}], ids=["load", "approach"])
@pytest.mark.parametrize("absent", [False, True])
def test_certificate__is_the_same_by_parts(monkeypatch, known, absent):
    """Parts with and without contact, with and without present cells: the sums differ by rounding alone."""
    present = None
    if absent:
        present = np.ones(SHAPE, bool)
        present[1:4] = False
    case = Case(present=present, **known)
    asked = case.problem, case.pressure, case.contact, case.displacement
    whole, separation = certify(*asked)
    np.testing.assert_array_equal(separation, case.separation.ravel())
    monkeypatch.setattr(passes, "_BLOCK", SHAPE[1])
    monkeypatch.setattr(problem, "is_wide", lambda size: True)
    found, separation = certify(*asked)
    assert separation is None
    for name in ("duality_gap", "energy", "level"):
        assert getattr(found, name) == pytest.approx(getattr(whole, name), rel=1e-12), name
    assert (found.converged, found.hopeless) == (whole.converged, whole.hopeless)


@pytest.mark.parametrize("level", [50.0, -50.0])
@pytest.mark.parametrize("size", [10**6, 21])
def test_certificate__asks_for_no_more_than_the_largest_separation_of_the_contact_is_rounded(monkeypatch, level, size):
    """All that carries is at one level, but for rounding; the cells of the second part carry next to nothing."""
    monkeypatch.setattr(passes, "_BLOCK", size)
    case = Case(load=3.0, tolerance=0.0)
    separation = np.full(case.gap.size, level)
    separation[:21:2] *= 1 + 1e-15
    separation[21:] = max(level, -0.5)
    displacement = separation.reshape(SHAPE) - case.problem.gap
    pressure = np.where(np.arange(separation.size) < 21, case.problem.load / 21, 1e-300).reshape(SHAPE)
    contact = np.arange(separation.size)
    assert np.ptp((case.problem.gap + displacement).reshape(-1)[:21]) > 2e-14
    assert certify(case.problem, pressure, contact, displacement)[0].converged
    displacement.reshape(-1)[0] += 1e-11
    assert not certify(case.problem, pressure, contact, displacement)[0].converged


@pytest.mark.parametrize("absent", [False, True])
def test_free_set__is_the_same_by_parts_and_knows_its_values(monkeypatch, absent):
    present = None
    if absent:
        present = np.ones(SHAPE, bool)
        present[1:4] = False
    case = Case(load=3.0, present=present)
    level = float(np.median(case.separation))
    expected = (case.separation < level) & (True if present is None else present) | (case.pressure > 0)
    for size, known in itertools.product((10**6, SHAPE[1], 1), (None, case.separation.ravel())):
        monkeypatch.setattr(passes, "_BLOCK", size)
        cells, apart, held = case.problem.free_set(case.pressure, case.displacement, level, known)
        np.testing.assert_array_equal(cells, np.flatnonzero(expected))
        np.testing.assert_array_equal(apart, case.separation.take(cells))
        np.testing.assert_array_equal(held, case.pressure.take(cells))
