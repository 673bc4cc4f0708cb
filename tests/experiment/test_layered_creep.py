"""Layers whose materials creep differently: space and time do not separate. Against inverted Laplace transforms,
against a dense sum over past steps, and against steady sliding."""

import math

import numpy as np
import pytest
from references.layered import line_contact_history, relaxation_of_wave
from support import relative_errors

import roughvisc as rv

RUBBER, POLYMER = rv.zener(1e6, 3e5, 1e5, 0.5), rv.zener(8e6, 2e6, 2e7, 0.35)  # they creep in 0.3 s, and in 10 s
SPRING = rv.elastic(3e6, 0.3)
TWICE = rv.Prony(5e-7, 0.0, (1e-6, 3e-6), (0.02, 2.0), 0.45)
PAIRS = {
    "rubber on polymer": (RUBBER, POLYMER),
    "polymer on rubber": (POLYMER, RUBBER),
    "elastic on rubber": (SPRING, RUBBER),
    "rubber on elastic": (RUBBER, SPRING),
    "two times on rubber": (TWICE, RUBBER),
}
SIDE = 1e-3


def simulated(height, pair, thickness, program, **settings):
    body = rv.layer(pair[0], thickness, on=pair[1])
    return rv.simulate(height, body, program, **{"progress": False, **settings})


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("thickness", [2e-4, pytest.param(2e-6, marks=pytest.mark.thorough)])
def test_wave_in_full_contact__relaxes_as_the_inverted_transform(pair, thickness):
    """The displacement is that of the profile from the first instant on; its pressure is 1 / (s C(q, s))."""
    amplitude, cells, q, t = 1e-6, (15, 3), 2 * math.pi / SIDE, np.array([1e-3, 0.03, 0.3, 2.0, 20.0])
    crest = amplitude * relaxation_of_wave(q, *PAIRS[pair], thickness, np.append(1e-9, t))
    program = rv.Program().load(1.5 * crest[0] * SIDE**2, over=0).hold(20.0)
    height = rv.wavy(amplitude, SIDE, SIDE, cells, waves=1)
    ds = simulated(height, PAIRS[pair], thickness, program, boundary="periodic", times=t, tolerance=1e-3)
    wave = np.cos(q * ds.x.values)
    found = 2 * np.mean(ds.pressure.values * wave[:, None], axis=(1, 2))
    np.testing.assert_allclose(found, crest[1:], atol=1e-3 * crest[0])
    exact = 1.5 * crest[0] + crest[1:, None, None] * wave[:, None] * np.ones(cells[1])
    error = np.abs(ds.pressure.values - exact).sum(axis=(1, 2)) / exact.sum(axis=(1, 2))
    assert error.max() < 1e-3


@pytest.mark.parametrize("pair", PAIRS)
def test_contact_that_grows_and_recedes__is_that_of_a_dense_sum_over_past_steps(pair):
    x, steps = (np.arange(32) + 0.5) / 32, 160
    height = 4e-6 * (np.cos(2 * math.pi * x) + 0.4 * np.sin(4 * math.pi * x))
    t = 2.0 * np.arange(1, steps + 1) / steps
    loads = np.where(t < 1, 1.2e4 * t, 1.2e4 - 9e3 * (t - 1)) * SIDE
    exact = line_contact_history(height, SIDE, loads, t[0], *PAIRS[pair], 2e-4)[steps // 4 - 1 :: steps // 4]
    surface = rv.from_array(np.tile(height[:, None], (1, 3)), spacing=SIDE / 32)
    program, times = rv.Program().pressure(1.2e4, over=1.0).pressure(3e3, over=1.0), [0.5, 1.0, 1.5, 2.0]
    ds = simulated(surface, PAIRS[pair], 2e-4, program, boundary="periodic", times=times, tolerance=1e-3)
    error = np.abs(ds.pressure.values[:, :, 1] - exact).sum(axis=1) / exact.sum(axis=1)
    assert error.max() < 1e-3
    areas = (exact > 0).sum(axis=1)
    assert areas[0] <= areas[1] >= areas[3]


@pytest.mark.parametrize(
    "boundary", ["free", *(pytest.param(one, marks=pytest.mark.thorough) for one in ("periodic", "mirror"))]
)
@pytest.mark.parametrize(
    "material",
    [
        rv.maxwell(1e6, 3e5),
        *(pytest.param(one, marks=pytest.mark.thorough) for one in (TWICE, rv.kelvin_voigt(1e6, 1e5))),
    ],
    ids=repr,
)
def test_nearly_equal_materials__are_a_half_space(material, boundary):
    """Times that differ by a part in a million need the memory of waves, and change nothing."""
    height = rv.self_affine((SIDE, 0.8 * SIDE), (22, 17), hurst=0.8, rms_slope=0.05, rolloff=5e-4, seed=4)
    program = rv.Program().pressure(2e4, over=0.05).hold(0.2).pressure(5e3, over=0.1).hold(0.1)
    if boundary == "periodic":
        program = program.slide(0.3 * SIDE, speed=0.02).slide(0.2 * SIDE, speed=0.02, direction="-y")
    else:  # contact that is lost, and found on the dent
        deep = 0.5 * float(height.max() - height.mean())
        program = rv.Program().approach(deep, over=0.1).approach(-deep, over=0.05).approach(deep, over=0.3)
    settings = {"boundary": boundary, "edge": "accept", "times": 6, "fields": ("pressure",)}
    found = simulated(height, (material, rv.shift(material, 1 + 1e-6)), 1e-4, program, **settings)
    expected = rv.simulate(height, material, program, progress=False, **settings)
    assert "waves" in found.attrs["memory"]
    assert relative_errors(found, expected).max() < 1e-3


def test_ball__is_that_on_elastic_layers_at_once_and_in_the_end():
    pair, ball, load = (POLYMER, RUBBER), rv.sphere(1e-2, (8e-4, 7e-4), (23, 21)), rv.Program().load(5e-3, over=0)
    ds = simulated(ball, pair, 2e-4, load.hold(1e3), times=[0.0, 1e3], tolerance=1e-2)
    for row, time in enumerate((0.0, np.inf)):
        elastic = [rv.elastic(1 / float(one.creep_compliance(time)), one.poisson) for one in pair]
        exact = simulated(ball, elastic, 2e-4, load, times=1)
        assert float(ds.approach[row]) == pytest.approx(float(exact.approach[0]), rel=4e-3)
        assert float(abs(ds.pressure[row] - exact.pressure[0]).sum() / exact.pressure[0].sum()) < 4e-3


def test_layer_on_an_almost_rigid_base__is_a_bonded_sheet():
    """The compliances of waves span ten decades."""
    gel, ball = rv.kelvin_voigt(5e5, 2e4, poisson=0.45), rv.sphere(3e-5, 1.5e-5, 15)
    bodies = rv.sheet(gel, 2.5e-6), rv.layer(gel, 2.5e-6, on=rv.elastic(1e16, 0.3))
    settings = {"times": 1, "tolerance": 1e-2, "grid_error": False, "progress": False}
    sheet, layer = (rv.simulate(ball, body, rv.Program().load(3e-7, over=0.1), **settings).pressure for body in bodies)
    assert sheet.shape == layer.shape
    assert float(abs(layer - sheet).sum() / sheet.sum()) < 1e-4


#: They creep in 1 ms, and in 2 ms: over a fifth of the surface, and over two fifths.
QUICK, SLOW, SPEED = rv.zener(1e6, 3e5, 3e2), rv.zener(8e6, 2e6, 4e3, 0.35), 0.2


@pytest.mark.thorough
@pytest.mark.parametrize("pair", [(SPRING, QUICK), (QUICK, SLOW)], ids=["elastic on quick", "quick on slow"])
def test_slide__settles_at_steady_sliding_to_second_order_in_the_cell(pair):
    """Of a third of the wave in contact."""
    errors, cells = [], (32, 64, 128)
    for count in cells:
        height = rv.wavy(4e-6, SIDE, (SIDE, 3 * SIDE / count), (count, 3), waves=1)
        steady = rv.friction(height, rv.layer(pair[0], 1.5e-4, on=pair[1]), speeds=SPEED, pressure=1.2e4)
        program = rv.Program().pressure(1.2e4, over=0).slide(5 * SIDE, speed=SPEED)
        ds = simulated(height, pair, 1.5e-4, program, boundary="periodic", times=1, fields=(), tolerance=1e-5)
        errors.append(abs(float(ds.friction_coefficient[-1] / steady.friction_coefficient[0]) - 1))
    assert errors[-1] < 3e-3
    assert -np.polyfit(np.log(cells), np.log(errors), 1)[0] > 1.6
