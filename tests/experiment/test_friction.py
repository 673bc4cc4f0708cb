"""``rv.friction``: labels, directions, bodies, and what is refused."""

from functools import partial

import numpy as np
import pytest
from samples import QUICK_RUBBER as RUBBER
from support import refused

import roughvisc as rv
from roughvisc.mechanics import steady_sliding
from roughvisc.mechanics.materials.series import complex_compliance
from roughvisc.variables import STATUS_MEANINGS, VARIABLES

ROUGH = rv.self_affine((1e-3, 0.8e-3), (40, 36), hurst=0.8, rms_slope=0.1, rolloff=4e-4, seed=1)
PRESS = {"pressure": 2e4, "speeds": [0.2, 2e-3, 20.0]}


@pytest.fixture(scope="module")
def curve():
    return rv.friction(ROUGH, RUBBER, **PRESS, fields=("pressure", "gap"))


def test_dataset__has_declared_variables_over_the_speeds_as_given(curve):
    assert curve.speed.values.tolist() == [0.2, 2e-3, 20.0]
    assert set(curve.variables) <= set(VARIABLES)
    assert curve.pressure.dims == ("speed", "x", "y")
    assert (curve.status == STATUS_MEANINGS.index("converged")).all()
    assert curve.attrs["direction"] == "x"
    assert float(curve.friction_coefficient[0]) == float(curve.friction_coefficient.max())


def test_stated_errors__cover_the_errors_of_a_loose_tolerance():
    """Of area, mean pressure, friction and its coefficient, on rough surfaces at small and at large load."""
    beyond = dict.fromkeys(("contact_area", "mean_contact_pressure", "friction_force", "friction_coefficient"), 0)
    for seed in range(4):
        rough = rv.self_affine((1e-3, 0.9e-3), (32, 28), hurst=0.8, rms_slope=0.1, rolloff=5e-4, seed=seed)
        for pressure in (3e3, 3e4):
            press = {"pressure": pressure, "speeds": [1e-3, 0.2], "fields": (), "progress": False}
            exact = rv.friction(rough, RUBBER, **press, tolerance=1e-7)
            loose = rv.friction(rough, RUBBER, **press, tolerance=1e-3)
            for name in beyond:
                error = loose[f"{name}_error"] + 1e-12 * abs(exact[name])
                beyond[name] += int((abs(loose[name] - exact[name]) > error).sum())
    assert set(beyond.values()) == {0}, beyond


def test_directions__are_those_of_a_turned_surface():
    """Whichever the direction, as along x of the surface turned by so many right angles."""
    one = {"pressure": 2e4, "speeds": 0.2, "fields": ("pressure",), "grid_error": True}
    turned = {"y": lambda z: z[::-1].T, "-x": lambda z: z[::-1, ::-1], "-y": lambda z: z.T[::-1]}
    for direction, turn in turned.items():
        found = rv.friction(ROUGH, RUBBER, **one, direction=direction)
        sides = (1e-3 / 40, 0.8e-3 / 36)
        surface = rv.from_array(turn(ROUGH.values), spacing=sides if direction == "-x" else sides[::-1])
        along_x = rv.friction(surface, RUBBER, **one)
        # the time in which the longer side slides past a point
        passed = RUBBER.contact_compliance(1e-3 * 39 / 40 / 0.2)
        assert found.attrs["compliance_at_end"] == pytest.approx(float(passed), rel=1e-9)
        for name in {name for name in found.data_vars if found[name].dims == ("speed",)} - {"wall_time"}:
            np.testing.assert_allclose(found[name], along_x[name], rtol=1e-9, err_msg=name)
        np.testing.assert_allclose(turn(found.pressure.values[0]), along_x.pressure[0], rtol=1e-9)


@pytest.mark.parametrize(("direction", "across"), [("x", 2.5), ("-y", -0.4)])
def test_force_across__is_to_the_left_of_the_motion(direction, across):
    """An oblique wave in full contact is pushed along its normal, q_y / q_x = 2.5; left of y lies -x."""
    x, y = (2 * np.pi * k * (np.arange(n) + 0.5) / n for n, k in ((15, 1), (21, 2)))
    wave = rv.from_array(1e-6 * np.cos(x[:, None] + y), spacing=(1e-3 / 15, 0.8e-3 / 21))
    found = rv.friction(wave, RUBBER, pressure=1e5, speeds=[0.05, 0.2], direction=direction, tolerance=1e-7)
    assert (found.status == STATUS_MEANINGS.index("full_contact")).all()
    np.testing.assert_allclose(found.friction_force_across, across * found.friction_force, rtol=1e-5)
    assert (found.friction_force > 0).all()


def test_persson__is_that_of_the_surface_as_it_slides(curve):
    """In full contact the theory is exact, in any direction; in partial contact its area is not far off."""
    full = rv.friction(ROUGH, RUBBER, pressure=1e7, speeds=[0.02, 0.2], tolerance=1e-6, direction="-y")
    theory = rv.observables.persson(full, material=RUBBER)
    np.testing.assert_allclose(theory.persson_friction_coefficient, full.friction_coefficient, rtol=1e-5)
    theory = rv.observables.persson(curve, material=RUBBER)
    np.testing.assert_allclose(theory.persson_contact_fraction, curve.contact_fraction, rtol=0.5)


@pytest.mark.parametrize(
    ("settings", "key", "found"),
    [
        ({"speeds": []}, "speeds", []),
        ({"speeds": [1.0, -1.0]}, "speeds", -1.0),
        ({"pressure": None}, "load", None),
        ({"load": 1.0}, "pressure", PRESS["pressure"]),
        ({"pressure": 0.0}, "pressure", 0.0),
        ({"direction": "z"}, "direction", "z"),
    ],
)
def test_friction__refuses(settings, key, found):
    with refused(key, found):
        rv.friction(ROUGH, RUBBER, **PRESS | settings)


def test_missing_points_and_fluids__are_refused():
    with pytest.raises(rv.InputError, match="height is missing"):
        rv.friction(ROUGH.where(ROUGH.x > 1e-4), RUBBER, **PRESS)
    with pytest.raises(rv.InputError, match="expected none, because the surface repeats"):
        rv.friction(rv.flat_punch(1e-4, 4e-4, 15), RUBBER, **PRESS)
    with pytest.raises(rv.InputError, match="creeps without end"):
        rv.friction(ROUGH, rv.maxwell(1e6, 1e6), **PRESS)


ZENER, ROWS = rv.zener(1e6, 1e6, 1e3), np.append(0.0, np.geomspace(1e-6, 1.0, 1200))


@pytest.mark.parametrize("direction", ["x", "-y"])
@pytest.mark.parametrize(
    ("body", "equal", "tolerance"),
    [
        (rv.maxwell(1e6, 1e3), None, 1e-5),
        (rv.power_law(1e-7, 1e-6, 0.3), None, 1e-5),
        (rv.pair(ZENER, rv.maxwell(1e6, 1e3)), None, 1e-5),
        (rv.creep(lambda t: ZENER.creep_compliance(t)), ZENER, 1e-3),
        (rv.creep_table(ROWS, ZENER.creep_compliance(ROWS), kind="shear"), ZENER, 1e-3),
        (rv.sheet(ZENER, 1.0), ZENER, 1e-5),
        (rv.sheet(rv.power_law(1e-7, 1e-6, 0.3, poisson=0.3), 2e-4), None, 1e-5),
    ],
    ids=["maxwell", "power law", "pair", "own", "table", "deep sheet", "compressible sheet"],
)
def test_wave_in_full_contact__slides_with_the_loss_of_any_material(body, equal, tolerance, direction):
    """Full contact of a wave has mu = k^2 A^2 Im E*(k V) / (4 p0), on any number of rows."""
    side, shape, amplitude, speed, k = 1e-3, (21, 5), 1e-7, 0.1, 2 * np.pi / 1e-3
    wave = rv.wavy(amplitude, side, (side, side / 7), shape, waves=1)
    if direction == "-y":
        wave = wave.transpose().rename(x="y", y="x")
    softness = float(body.kernel.transfer(k, 0.0)) if hasattr(body, "kernel") else 2 / k
    material = equal or getattr(body, "material", body)
    modulus = 2 / k / softness / complex(complex_compliance(material, k * speed))
    pressure = 3 * amplitude * k * abs(modulus)
    settings = {"direction": direction, "fields": ("pressure",), "tolerance": 1e-6, "progress": False}
    ds = rv.friction(wave, body, pressure=pressure, speeds=speed, **settings)
    exact = k**2 * amplitude**2 * modulus.imag / (4 * pressure)
    assert float(ds.friction_coefficient[0]) == pytest.approx(exact, rel=tolerance)
    assert float(ds.pressure[0].mean()) == pytest.approx(pressure, rel=1e-9)
    across = "y" if direction == "x" else "x"
    assert float((ds.pressure[0].max(across) - ds.pressure[0].min(across)).max()) == 0


def test_flat_surface__sinks_uniformly_and_slides_freely():
    """Into a bonded sheet by ``h (1 - 2 nu) / (1 - nu)^2`` times the relaxed compliance times the pressure."""
    gel, thickness = rv.zener(1e6, 0.3e6, 0.3e3, poisson=0.3), 1e-4
    found = rv.friction(rv.from_array(np.zeros((6, 5)), 1e-5), rv.sheet(gel, thickness), pressure=2e4, speeds=0.2)
    sunk = thickness * 0.4 / 0.7**2 * 2e4 * float(gel.contact_compliance(np.inf))
    assert float(found.approach[0]) == pytest.approx(sunk, rel=1e-9)
    assert float(found.friction_force[0]) == 0
    assert float(found.contact_fraction[0]) == 1


@pytest.mark.parametrize("slowest", [40.0, 1e6])
def test_own_solid__slides_like_its_series(slowest):
    """Waves across the motion have the compliance after endless creep, however late that is."""
    series = rv.Prony(1e-7, 0.0, (4e-7, 4e-7), (1e-3, slowest))
    press = {"pressure": 2e4, "speeds": [1e-3, 0.1, 10.0], "grid_error": False, "progress": False}
    exact, found = (
        rv.friction(ROUGH, body, **press)
        for body in (rv.pair(series, rv.elastic(1e8)), rv.pair(rv.creep(series.creep_compliance), rv.elastic(1e8)))
    )
    np.testing.assert_allclose(found.friction_coefficient, exact.friction_coefficient, rtol=2e-3)


def test_own_fluid__is_refused_and_has_no_transform():
    glass = rv.creep(lambda t: 1e-7 * (1 + 0.2 * np.log1p(t / 1e-3)))
    with refused("material"):
        rv.friction(ROUGH, glass, **PRESS)
    with refused("material", glass):
        glass.laplace(np.array([1.0]))


def test_unsolved_speed__is_named(monkeypatch):
    """No curve is known on which the iteration stops early: here it has only two iterations."""
    few = partial(steady_sliding.steady_state, max_iterations=2)
    monkeypatch.setattr("roughvisc.experiment.sliding.steady_state", few)
    with pytest.raises(rv.ConvergenceError, match=r"200 mm/s.* expected 0\.001"):
        rv.friction(ROUGH, RUBBER, **PRESS | {"speeds": [0.2, 20.0]})
