"""Separation of the mean plane of a profile and the undeformed plane in free space, by hand."""

import numpy as np
import pytest

import roughvisc as rv

RUBBER = rv.elastic(1e6)
PRESS = rv.Program().load(2e-2, over=0.1).hold(0.3)
SIZE = 1e-3


def bump(shape, shift=0.0):
    """Waves on a cap, at the cell centres of a grid; the waves may lie so many cells further."""
    x, y = np.meshgrid(*((np.arange(n) + 0.5 - shift) / n for n in shape), indexing="ij")
    rng = np.random.default_rng(0)
    waves = sum(
        np.cos(2 * np.pi * (a * x + b * y) + phase) / (1 + np.hypot(a, b)) ** 1.5
        for a, b, phase in zip(rng.integers(-12, 13, 40), rng.integers(-12, 13, 40), 6 * rng.random(40), strict=True)
    )
    heights = 1e-6 * waves - 4e-5 * ((x + shift / shape[0] - 0.5) ** 2 + (y + shift / shape[1] - 0.5) ** 2)
    return rv.from_array(heights, (SIZE / shape[0], SIZE / shape[1]))


def pressed(h, **options):
    return rv.simulate(h, RUBBER, PRESS, **{"boundary": "free", "times": [0.4], "progress": False} | options)


@pytest.mark.parametrize("shape", [(25, 28), (97, 101)])  # the second follows the contact with a window
def test_mean_plane__is_the_mean_undeformed_gap_less_the_approach(shape):
    h = bump(shape)
    ds = pressed(h)
    for found, approach in ((ds.mean_plane_separation, ds.approach), (ds.step_mean_plane_separation, ds.step_approach)):
        np.testing.assert_allclose(found, (float(h.max()) - h.values).mean() - approach, rtol=1e-12)
    # from the other side: where a cell touches, the profile is at the displaced surface
    fields = pressed(h, fields=["pressure", "displacement"])
    touching = fields.pressure.values[-1] > 0
    above_mean_plane = (h.values - h.values.mean() - fields.displacement.values[-1])[touching]
    np.testing.assert_allclose(above_mean_plane, float(fields.mean_plane_separation[-1]), atol=1e-9)


def test_mean_plane__counts_the_present_cells():
    h = bump((25, 28))
    h = h.where((h.x < 0.9 * SIZE) | (h.y > 0.2 * SIZE))
    ds = pressed(h, missing="absent")
    np.testing.assert_allclose(ds.mean_plane_separation, float(h.max() - h.mean()) - ds.approach, rtol=1e-12)


def test_mean_plane__hardly_depends_on_where_the_cells_lie_as_the_approach_does():
    """Parts of a cell further the highest cell is another one, of another height; the surface is hardly another."""
    found = [pressed(bump((29, 31), shift)) for shift in (-0.4, -0.2, 0.0, 0.2, 0.4)]
    spread = {name: np.ptp([float(ds[name][-1]) for ds in found]) for name in ("approach", "mean_plane_separation")}
    assert spread["approach"] > 1e-8
    assert spread["mean_plane_separation"] < 0.2 * spread["approach"]


def test_mean_plane__is_left_out_where_there_is_none():
    ball = rv.sphere(1e-2, SIZE, 25)
    assert "mean_plane_separation" not in pressed(ball)
    assert "step_mean_plane_separation" not in pressed(ball, edge="accept")
    assert "mean_plane_separation" in pressed(ball + 0 * bump((25, 25)).values + 1e-7 * np.eye(25))
    rough = rv.self_affine(SIZE, (25, 28), hurst=0.8, rms_slope=0.1, seed=1)
    ds = pressed(rough, boundary="periodic", fields=["gap"])
    assert "mean_plane_separation" not in ds
    # there the mean gap is the separation of the mean planes: the mean displacement is zero
    np.testing.assert_allclose(ds.mean_gap, (float(rough.max()) - rough.values).mean() - ds.approach, rtol=1e-5)
