"""The boundary that a surface was made for: by its recipe as long as the grid fits, by mirror images."""

import numpy as np
import pytest
from scan_files import ROOT

import roughvisc as rv
from roughvisc.experiment.problem import boundary_of
from roughvisc.topography.borders import is_periodic
from roughvisc.topography.conditioning import boundary_after, condition

SIDE, SHAPE = (1e-3, 1.2e-3), (24, 20)
BALL, TIP, PUNCH = rv.sphere(1e-2, SIDE, SHAPE), rv.cone(0.1, SIDE, SHAPE), rv.flat_punch(3e-4, SIDE, SHAPE)
WAVES = rv.wavy(1e-6, 1e-4, SIDE, SHAPE)
ROUGH = rv.self_affine(SIDE, SHAPE, hurst=0.8, rms_height=1e-6, seed=1)
SCAN = rv.from_array(np.random.default_rng(0).normal(size=SHAPE) * 1e-6, (1e-3 / 24, 1.2e-3 / 20))


@pytest.mark.parametrize(
    ("height", "expected"),
    [
        (BALL, "free"),
        (TIP, "free"),
        (PUNCH, "free"),
        (BALL[3:-1, 2:], "free"),
        (rv.sphere(1e-2, 1e-3, (8, 1)), "free"),
        (WAVES, "periodic"),
        (rv.wavy(1e-6, 1e-3, 1e-3, (16, 1), waves=1), "periodic"),
        (ROUGH, "periodic"),
        (rv.mirror(SCAN), "periodic"),
        (rv.resample(rv.mirror(SCAN), (32, 32)), "periodic"),
        (ROUGH * 2, "periodic"),
        (rv.open_scan(ROOT / "surfaces" / "self_affine.toml"), "periodic"),
        (SCAN, None),
    ],
)
def test_boundary__is_the_one_that_a_surface_was_made_for(height, expected):
    assert boundary_of(height) == expected


@pytest.mark.parametrize(
    "height",
    [
        BALL + 1e-6,
        2 * BALL,
        WAVES + BALL,  # which has the period among its attributes still, and its borders meet
        WAVES[:-1],
        rv.level(ROUGH),
        rv.resample(ROUGH, (12, 10)),
        rv.combine(ROUGH, ROUGH),
        rv.mirror(SCAN)[1:],
        rv.mirror(SCAN) + rv.mirror(BALL),
        rv.level(rv.mirror(SCAN) + rv.mirror(SCAN).x.values[:, None], 1),
        BALL.assign_attrs(recipe=3),
    ],
)
def test_boundary__of_what_was_changed_has_to_be_said(height):
    assert boundary_of(height) is None


@pytest.mark.parametrize("height", [ROUGH, WAVES])
def test_boundary_after__keeps_the_period_as_the_steps_themselves_do(height):
    values = {"rotate90": 1, "invert": True, "shortest_wave": 4e-4, "resample": [12, 10]}
    values |= {"realisation": 2, "level": 1, "filter": 3e-4, "crop": {"x": [0, 5e-4]}}
    for step, value in values.items():
        found = is_periodic(condition(height, {step: value}))
        assert (boundary_after({step: value}, "periodic") == "periodic") == found, step
    assert is_periodic(rv.combine(height, height))
    assert not is_periodic(rv.combine(height, SCAN))
    assert not is_periodic(height.copy(data=height.values + height.x.values[:, None]))
