"""Steady sliding: against closed forms, against a dense solution of the same equations, and what must hold for any."""

import itertools
import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.mechanics.contact import solve_contact
from roughvisc.mechanics.halfspace.love import HALF_SPACE
from roughvisc.mechanics.halfspace.operator import HalfSpace
from roughvisc.mechanics.halfspace.sheet import Sheet
from roughvisc.mechanics.materials.frequency import complex_compliance
from roughvisc.mechanics.sliding import steady
from roughvisc.mechanics.sliding.steady import Sliding, mixed, steady_state

PERIOD, TIME = 1e-3, 1e-3
LOSSY = {0.2: 0.48, 0.9: 4.4, 2.2: 20.0}  # the largest loss tangent: retarded over instantaneous compliance


def rubber(ratio=3.0):
    """Modulus 1 MPa at once, and so many times the compliance retarded."""
    return rv.zener(1e6, 1e6 / ratio, 1e6 / ratio * TIME)


def slid(height, material, speed, load, body=HALF_SPACE, side=PERIOD, **settings):
    """On a square surface, or on a strip of square cells."""
    nx, ny = height.shape
    spacing = (side / nx, side / ny if ny > 3 else side / nx)
    sliding = Sliding(body, partial(complex_compliance, material), height.shape, spacing, speed)
    return steady_state(sliding, height.max() - height, load, **settings)


def wave(cells, amplitude, across=1):
    x = (np.arange(cells) + 0.5) / cells
    return amplitude * np.cos(2 * np.pi * x)[:, None] * np.ones((1, across))


@pytest.mark.parametrize("loss", LOSSY)
@pytest.mark.parametrize("speed", [0.01, 0.16, 2.0])
@pytest.mark.parametrize("body", [HALF_SPACE, Sheet(1e-4, 0.3)], ids=["half-space", "sheet"])
def test_full_contact_of_a_wave__is_exact(loss, speed, body):
    """mu = k^2 A^2 Im E* / (4 p0) on a half-space; on a sheet with its factor in the modulus."""
    material, amplitude, k = rubber(LOSSY[loss]), 1e-6, 2 * math.pi / PERIOD
    softer = float(body.transfer(k, 0.0)) * k / 2
    modulus = 1 / complex(complex_compliance(material, k * speed)) / softer
    assert modulus.imag / modulus.real <= loss * 1.02
    pressure, area = 3 * amplitude * k * abs(modulus), PERIOD * 3 * PERIOD / 21
    found = slid(wave(21, amplitude, 3), material, speed, pressure * area, body, tolerance=1e-7)
    assert found.converged
    exact = k**2 * amplitude**2 * modulus.imag / (4 * pressure)
    assert found.power_force / (pressure * area) == pytest.approx(exact, rel=1e-5)
    assert found.slope_force / (pressure * area) == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize("ulps", [1, 4])
def test_change_that_is_nothing_but_rounding__ends_the_iteration(monkeypatch, ulps):
    """In full contact the solver's first guess is the answer, and its pressure may differ by rounding at each step."""
    signs = itertools.cycle([1, -1])

    def rounding(*given, **wanted):
        state = solve_contact(*given, **wanted)
        return replace(state, pressure=state.pressure * (1 + next(signs) * ulps * np.finfo(float).eps))

    monkeypatch.setattr(steady, "solve_contact", rounding)
    found = slid(wave(21, 1e-6, 3), rubber(), 2.0, 1e4, tolerance=1e-7)
    assert found.converged
    assert found.outer < 30


def dense(height, material, speed, load):
    """The same equations of a line contact by a dense matrix and an active set: pressure of the cells. [Pa]

    ``g + K p >= delta`` with equality where ``p > 0``; the matrix has the column of each cell's response, and that is
    the inverse transform of ``2 / |q| C*(-q V)``.
    """
    n = len(height)
    q = 2 * np.pi * np.fft.fftfreq(n, PERIOD / n)
    symbol = np.zeros(n, complex)
    symbol[1:] = 2 / np.abs(q[1:]) * complex_compliance(material, -q[1:] * speed)
    if n % 2 == 0:
        symbol[n // 2] = symbol[n // 2].real
    column = np.fft.ifft(symbol).real
    matrix = column[(np.arange(n)[:, None] - np.arange(n)) % n]
    gap, total = height.max() - height, load / (PERIOD / n) ** 2
    active = gap < np.quantile(gap, 0.3)
    for _ in range(200):
        cells = np.flatnonzero(active)
        system = np.block([[matrix[np.ix_(cells, cells)], -np.ones((len(cells), 1))], [np.ones((1, len(cells))), 0.0]])
        solution = np.linalg.solve(system, np.append(-gap[cells], total))
        pressure = np.zeros(n)
        pressure[cells] = solution[:-1]
        opening = gap + matrix @ pressure - solution[-1]
        wrong = (active & (pressure < 0)) | (~active & (opening < -1e-15))
        if not wrong.any():
            return pressure
        active ^= wrong
    raise AssertionError("the active set does not settle")


@pytest.mark.parametrize("speed", [2e-2, 0.2, 2.0])
@pytest.mark.parametrize("ratio", [3.0, 20.0])
def test_partial_contact__agrees_with_a_dense_solution(speed, ratio):
    height, load, material = wave(63, 1e-5), 3e-5, rubber(ratio)
    exact = dense(height[:, 0], material, speed, load)
    found = slid(height, material, speed, load, tolerance=1e-8)
    assert 0.05 < np.mean(exact > 0) < 0.9
    assert np.abs(found.pressure[:, 0] - exact).sum() < 1e-5 * exact.sum()
    slope = np.fft.ifft(1j * 2 * np.pi * np.fft.fftfreq(63, PERIOD / 63) * np.fft.fft(height[:, 0])).real
    friction = -float(exact @ slope) * (PERIOD / 63) ** 2
    assert found.slope_force == pytest.approx(friction, rel=1e-4)


def test_power_and_slopes__agree_as_the_grid_is_refined():
    material, load = rubber(), 3e-5
    differences = []
    for cells in (64, 256, 1024):
        found = slid(wave(cells, 1e-5), material, 0.2, load * 64 / cells, tolerance=1e-7)  # on one row of cells
        differences.append(abs(found.slope_force / found.power_force - 1))
    assert differences[-1] < 1e-4
    assert -np.polyfit(np.log([64, 256, 1024]), np.log(differences), 1)[0] > 1


ROUGH = rv.self_affine(PERIOD, (45, 40), hurst=0.8, rms_slope=0.1, rolloff=PERIOD / 3, seed=1).values
LOAD = 0.02


@pytest.fixture(scope="module")
def peak():
    return slid(ROUGH, rubber(), 0.1, LOAD, tolerance=1e-6)


def test_contact__is_admissible_and_carries_the_load(peak):
    cell = (PERIOD / 45) * (PERIOD / 40)
    assert (peak.pressure >= 0).all()
    assert float(peak.pressure.sum()) * cell == pytest.approx(LOAD, rel=1e-12)
    opening = ROUGH.max() - ROUGH + peak.displacement - peak.approach
    scale = np.ptp(ROUGH)
    assert np.abs(opening[peak.pressure > 1e-3 * peak.pressure.max()]).max() < 1e-4 * scale
    assert opening.min() > -1e-3 * scale
    assert peak.residual < 1e-6
    assert peak.friction_residual < 1e-6


def test_reversal__on_a_mirrored_surface_has_the_same_friction(peak):
    """Dissipation is the same; the pressure is the mirror image."""
    there = slid(ROUGH[:, ::-1], rubber(), 0.1, LOAD, tolerance=1e-6)
    assert there.power_force == pytest.approx(peak.power_force, rel=1e-5)
    np.testing.assert_allclose(there.pressure[:, ::-1], peak.pressure, atol=1e-4 * peak.pressure.max())


@pytest.mark.parametrize(("speed", "compliance"), [(1e-6, 1e-6), (1e4, 0.25e-6)], ids=["relaxed", "at once"])
def test_ends_of_the_speed_axis__are_elastic_and_without_friction(speed, compliance):
    """Under one row of cells: waves across the motion, which others have, stand still and relax at any speed."""
    row = ROUGH[:, :1]
    found = slid(row, rubber(), speed, 2e-4)
    spacing = (PERIOD / 45, PERIOD / 45)
    load = 2e-4 * compliance / math.prod(spacing)
    elastic = solve_contact(HalfSpace((45, 1), spacing, "periodic"), row.max() - row, load=load)
    assert 0.1 < np.mean(found.pressure > 0) < 0.9
    assert 0 < found.power_force < 1e-2 * slid(row, rubber(), 0.1, 2e-4).power_force
    np.testing.assert_allclose(found.pressure, elastic.pressure / compliance, atol=2e-3 * found.pressure.max())
    assert found.approach == pytest.approx(elastic.approach, rel=1e-3)


def test_slow_sliding__is_relaxed_on_a_rough_surface():
    found = slid(ROUGH, rubber(), 1e-6, LOAD)
    spacing = (PERIOD / 45, PERIOD / 40)
    load = LOAD * 1e-6 / math.prod(spacing)
    elastic = solve_contact(HalfSpace((45, 40), spacing, "periodic"), ROUGH.max() - ROUGH, load=load)
    assert np.abs(found.pressure - elastic.pressure / 1e-6).sum() < 1e-3 * found.pressure.sum()


@pytest.mark.parametrize("ratio", [3.0, 30.0])
@pytest.mark.parametrize("speed", [0.02, 0.5])
def test_residuals__bound_what_the_iteration_leaves(ratio, speed):
    exact = slid(ROUGH, rubber(ratio), speed, LOAD, tolerance=1e-7)
    for tolerance in (1e-2, 1e-3):
        found = slid(ROUGH, rubber(ratio), speed, LOAD, tolerance=tolerance)
        assert found.converged
        assert max(found.residual, found.friction_residual) <= tolerance
        assert np.abs(found.pressure - exact.pressure).sum() <= 2 * tolerance * exact.pressure.sum()
        assert found.power_force == pytest.approx(exact.power_force, rel=tolerance)


def test_start_within_the_tolerance__does_not_freeze_the_friction():
    """From the state of a much lower speed, whose pressure is nearly the same, and whose friction is not."""
    low = slid(ROUGH, rubber(), 1e-5, LOAD)
    found = slid(ROUGH, rubber(), 1e-4, LOAD, start=low.pressure)
    exact = slid(ROUGH, rubber(), 1e-4, LOAD, tolerance=1e-8)
    assert found.power_force == pytest.approx(exact.power_force, rel=1e-3)
    assert exact.power_force == pytest.approx(10 * low.power_force, rel=0.05)


def test_elastic_body__has_no_friction():
    found = slid(ROUGH, rv.elastic(1e6), 1.0, LOAD)
    assert found.power_force == 0
    assert abs(found.slope_force) < 0.05 * LOAD * 0.1
    assert found.converged


def test_units__do_not_matter():
    metres = slid(ROUGH, rubber(), 0.1, LOAD)
    microns = slid(ROUGH * 1e6, rubber(), 0.1e6, LOAD * 1e12, side=PERIOD * 1e6)
    assert microns.power_force / 1e12 == pytest.approx(metres.power_force, rel=1e-8)


def test_not_converged__says_so():
    found = slid(ROUGH, rubber(100.0), 0.1, LOAD, tolerance=1e-6, max_outer=3)
    assert not found.converged
    assert found.outer == 3
    assert max(found.residual, found.friction_residual) > 1e-6


@pytest.mark.parametrize("material", [rv.maxwell(1e6, 1e3), rv.PowerLaw(1e-7, 1e-6, 0.3)])
def test_endless_creep__is_refused_where_waves_stand_still(material):
    with pytest.raises(InputError, match="creeps without end"):
        slid(ROUGH, material, 0.1, LOAD)
    ridge = slid(wave(33, 1e-5), material, 0.1, 1e-5)
    assert ridge.converged
    assert ridge.power_force > 0


@pytest.mark.parametrize("speed", [0.0, -1.0, math.inf, math.nan])
def test_speed__is_positive(speed):
    with pytest.raises(InputError, match="expected a positive number"):
        slid(ROUGH, rubber(), speed, LOAD)


def test_mixed__finds_the_fixed_point_of_a_linear_map():
    """Of two dimensions after three steps, which is what Anderson's acceleration is made for."""
    matrix, fixed = np.array([[0.6, 0.2, 0.2], [0.1, 0.7, 0.2], [0.3, 0.1, 0.6]]), None
    values, vectors = np.linalg.eig(matrix)
    fixed = np.abs(vectors[:, np.argmax(values.real)].real)
    fixed /= fixed.sum()
    point, taken, given = np.array([1.0, 0.0, 0.0]), [], []
    for _ in range(4):
        taken, given = [*taken, point], [*given, matrix @ point]
        point = mixed(taken[-4:], given[-4:], 1.0)
    np.testing.assert_allclose(point, fixed, atol=1e-8)
    assert mixed([np.ones(2)], [np.array([0.5, 1.5])], 2.0).tolist() == [0.5, 1.5]
