"""Steady sliding: against closed forms, against a dense solution of the same equations, and what must hold for any."""

import math

import numpy as np
import pytest
from references.dense import PERIOD, dense, half_space_symbol, line_profiles, rubber, slid

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE
from roughvisc.mechanics.contact.solver import solve_contact
from roughvisc.mechanics.grid import Grid
from roughvisc.mechanics.materials.series import complex_compliance
from roughvisc.mechanics.sheet import Sheet

LOSSY = {0.2: 0.48, 0.9: 4.4, 2.2: 20.0}  # the largest loss tangent: retarded over instantaneous compliance


def mean_traction(height, pressure):
    """Friction over the area by pressure times slope of the profile along x. [Pa]"""
    q = 2 * np.pi * np.fft.fftfreq(len(height), PERIOD / len(height))
    q[len(q) // 2] *= len(q) % 2  # the shortest wave of an even number of cells has no slope
    return -float(np.mean(pressure * np.fft.ifft(1j * q[:, None] * np.fft.fft(height, axis=0), axis=0).real))


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
    exact = k**2 * amplitude**2 * modulus.imag / (4 * pressure)
    assert found.power_force / (pressure * area) == pytest.approx(exact, rel=1e-5)
    assert mean_traction(wave(21, amplitude, 3), found.pressure) / pressure == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize("load", [3e-6, 1e-4])
@pytest.mark.parametrize("ratio", [3.0, 30.0, 3000.0])
@pytest.mark.parametrize("profile", ["wave", "rough", "broad"])
def test_partial_contact__agrees_with_a_dense_solution(profile, ratio, load):
    height, tolerance, active = line_profiles(81)[profile], 1e-3, None
    load *= 256 / len(height)  # on a row of square cells
    for speed in (3e-3, 0.06, 1.0):  # each begins with the contact of the one before
        exact = dense(height, half_space_symbol(rubber(ratio), speed), load, active)
        active = exact > 0
        found = slid(height[:, None], rubber(ratio), speed, load, tolerance=tolerance)
        error = np.abs(found.pressure[:, 0] - exact).sum() / exact.sum()
        assert error < 2 * tolerance
        assert error <= tolerance / 50 or 0.8 * error < found.residual <= 5 * error


def test_power_and_slopes__agree_as_the_grid_is_refined():
    material, load = rubber(), 3e-5
    differences = []
    for cells in (64, 256, 1024):
        height = wave(cells, 1e-5)
        found = slid(height, material, 0.2, load * 64 / cells, tolerance=1e-7)  # on one row of cells
        by_power = found.power_force * cells / PERIOD**2
        differences.append(abs(mean_traction(height, found.pressure) / by_power - 1))
    assert differences[-1] < 1e-4
    assert -np.polyfit(np.log([64, 256, 1024]), np.log(differences), 1)[0] > 1


ROUGH = rv.self_affine(PERIOD, (45, 40), hurst=0.8, rms_slope=0.1, rolloff=PERIOD / 3, seed=1).values
LOAD = 0.02


@pytest.mark.parametrize(("speed", "compliance"), [(1e-6, 1e-6), (1e4, 0.25e-6)], ids=["relaxed", "at once"])
def test_ends_of_the_speed_axis__are_elastic_and_without_friction(speed, compliance):
    """Under one row of cells: waves across the motion, which others have, stand still and relax at any speed."""
    row = ROUGH[:, :1]
    found = slid(row, rubber(), speed, 2e-4)
    spacing = (PERIOD / 45, PERIOD / 45)
    load = 2e-4 * compliance / math.prod(spacing)
    elastic = solve_contact(Grid((45, 1), spacing, "periodic"), row.max() - row, load=load)
    assert 0.1 < np.mean(found.pressure > 0) < 0.9
    assert 0 < found.power_force < 1e-2 * slid(row, rubber(), 0.1, 2e-4).power_force
    np.testing.assert_allclose(found.pressure, elastic.pressure / compliance, atol=2e-3 * found.pressure.max())
    assert found.approach == pytest.approx(elastic.approach, rel=1e-3)


@pytest.mark.parametrize("ratio", [3.0, 30.0])
@pytest.mark.parametrize("speed", [0.02, 0.5])
def test_residuals__bound_what_the_iteration_leaves(ratio, speed):
    exact = slid(ROUGH, rubber(ratio), speed, LOAD, tolerance=1e-7)
    for tolerance in (1e-2, 1e-3):
        found = slid(ROUGH, rubber(ratio), speed, LOAD, tolerance=tolerance)
        assert max(found.residual, found.friction_residual) <= tolerance
        assert np.abs(found.pressure - exact.pressure).sum() <= 2 * tolerance * exact.pressure.sum()
        assert found.power_force == pytest.approx(exact.power_force, rel=tolerance)


def test_low_speed__has_the_friction_of_a_tighter_tolerance():
    """Pressures are nearly those at rest, and friction, which is proportional to the speed, is not."""
    low, found = (slid(ROUGH, rubber(), speed, LOAD) for speed in (1e-5, 1e-4))
    exact = slid(ROUGH, rubber(), 1e-4, LOAD, tolerance=1e-8)
    assert found.power_force == pytest.approx(exact.power_force, rel=1e-3)
    assert exact.power_force == pytest.approx(10 * low.power_force, rel=0.05)


@pytest.mark.parametrize("seed", range(2))
def test_loss_tangent_of_ten_thousand__is_solved(seed):
    height = rv.from_array(1e-7 * np.random.default_rng(seed).standard_normal((16, 12)), spacing=1e-6)
    settings = {"speeds": [0.4], "pressure": 1e5, "boundary": "periodic", "fields": ("pressure",), "progress": False}
    found, tight = (
        rv.friction(height, rv.kelvin_voigt(1e6, 1e4), tolerance=tolerance, grid_error=False, **settings)
        for tolerance in (1e-3, 1e-7)
    )
    apart = float(np.abs(found.pressure - tight.pressure).sum() / tight.pressure.sum())
    assert apart < float(found.stated_error[0]) < 1e-3
    assert float(found.friction_force[0]) == pytest.approx(float(tight.friction_force[0]), rel=1e-3)


def test_two_periods_of_a_gel__slide_like_one():
    """A Kelvin-Voigt gel without instantaneous compliance: the stiffness of its waves spans seven decades."""
    gel = rv.kelvin_voigt(1e6 / 0.64, 0.25e6)
    height = 1e-7 * np.random.default_rng(0).random((12, 13))
    one, two = (
        rv.friction(
            rv.from_array(np.tile(height, (copies, 1)), 1e-6), gel, pressure=5e4, speeds=1e-3, grid_error=False,
            progress=False,
        )
        for copies in (1, 2)
    )  # fmt: skip
    stated = float(one.stated_error[0] + two.stated_error[0])
    assert stated < 2e-3
    assert float(two.friction_coefficient[0]) == pytest.approx(float(one.friction_coefficient[0]), rel=stated)


def test_two_cells_that_compete_for_the_load__are_solved():
    """Two crests of almost equal height under a light load, on a material with a loss tangent of about ten."""
    x = (np.arange(25) + 0.5) / 25
    height = 1e-9 * (np.cos(2 * np.pi * (x - 0.3)) + 0.6 * np.cos(6 * np.pi * (x - 0.7)))
    load = 0.1 * PERIOD**2 / 25
    exact = dense(height, half_space_symbol(rubber(300.0), 10.0), load)
    found = slid(height[:, None], rubber(300.0), 10.0, load, tolerance=1e-4)
    assert np.count_nonzero(exact) == 2
    assert np.abs(found.pressure[:, 0] - exact).sum() <= 2e-4 * exact.sum()


def test_friction_far_beyond_full_contact__is_that_of_the_wave():
    """The pressure is almost uniform, and friction is of second order in its variation."""
    amplitude, k, cells = 1e-6, 2 * math.pi / PERIOD, 24
    modulus = 1 / complex(complex_compliance(rubber(), k * 0.16))
    pressure = 400 * amplitude * k * abs(modulus) / 2
    found = rv.friction(
        rv.from_array(wave(cells, amplitude, 2), PERIOD / cells), rubber(), speeds=0.16, pressure=pressure,
        tolerance=1e-2, grid_error=False, progress=False,
    )  # fmt: skip
    exact = k**2 * amplitude**2 * modulus.imag / (4 * pressure)
    assert float(found.friction_coefficient[0]) == pytest.approx(exact, rel=float(found.stated_error[0]))
