"""Leakage of results: units, labels, sides, what is refused, frames on Dask."""

import dask.array
import numpy as np
import pytest
import sample_results as made
import xarray as xr
from numpy.testing import assert_allclose
from support import refused

from roughvisc.errors import InputError
from roughvisc.observables import leakage
from roughvisc.variables import VARIABLES

CELL = (2e-6, 3e-6)


def result(*gaps, boundary="free"):
    """A result of which the gap alone is known. [m]"""
    gaps = np.array(gaps, dtype=float)
    axes = {name: (np.arange(n) + 0.5) * d for name, n, d in zip("xy", gaps.shape[1:], CELL, strict=True)}
    fields = {"gap": (("time", "x", "y"), gaps)}
    return xr.Dataset(fields, {"time": np.arange(1.0, 1 + len(gaps)), **axes}, {"boundary": boundary})


def plane(gap=1e-6, shape=(6, 5)):
    return np.full(shape, gap)


def wall(shape=(6, 5)):
    """Cells in contact from one side across the flow to the other, for a flow along x."""
    closed = plane(shape=shape)
    closed[2] = 0.0
    return closed


def test_plane_gap__leaks_as_poiseuille_has_it():
    found = leakage(result(plane(), wall()), viscosity="2 mPa s", pressure_drop="3 bar")
    rate = (1e-6) ** 3 / 12 * 3e5 / 2e-3 * (5 * CELL[1]) / (6 * CELL[0])
    assert_allclose(found.leak_rate.values, [rate, 0.0], rtol=1e-12, atol=0)
    assert (found.leak_rate_error <= 1e-9 * found.leak_rate).all()
    assert_allclose(found.transmissivity.values, [1e-18 / 12, 0.0], rtol=1e-12, atol=0)
    assert_allclose(found.hydraulic_aperture.values, [1e-6, 0.0], rtol=1e-12, atol=0)
    for name, one in found.items():
        assert one.attrs["units"] == VARIABLES[name].units
    assert found.leak_rate.attrs["viscosity"] == 2e-3
    assert found.leak_rate.attrs["pressure_drop"] == 3e5


def test_flow_along_y__is_that_along_x_of_the_map_turned():
    gap = 1e-6 * (0.2 + np.random.default_rng(0).random((6, 5)))
    found = leakage(result(gap), along="y", flow=True)
    turned = leakage(result(gap).rename(x="y", y="x").transpose("time", "x", "y"), flow=True)
    assert_allclose(found.leak_rate.item(), turned.leak_rate.item(), rtol=1e-12, atol=0)
    assert found.flux_x.dims == found.flux_y.dims == ("time", "x", "y")
    assert_allclose(found.flux_y[0], turned.flux_x[0].T, rtol=1e-9, atol=1e-9 * float(turned.flux_x.max()))
    through = found.flux_y.sum("x") * CELL[0]
    assert_allclose(through, np.broadcast_to(found.leak_rate, through.shape), rtol=1e-9, atol=0)
    assert found.leak_rate.attrs["along"] == "y"


def test_flow__is_the_same_through_every_section_if_the_gap_spans_nine_decades():
    source = np.random.default_rng(7)
    gap = np.where(source.random((48, 45)) < 0.72, 1e-6 * 10 ** (-9 * source.random((48, 45))), 0.0)
    found = leakage(result(gap), flow=True)
    assert found.leak_rate_error < 1e-9 * found.leak_rate
    through = found.flux_x.sum("y") * CELL[1]
    assert_allclose(through, np.broadcast_to(found.leak_rate, through.shape), rtol=1e-6, atol=0)


def test_sides__meet_where_the_border_is_periodic():
    gap = np.zeros((3, 5))
    gap[0, 0] = gap[1, 0] = gap[1, 4] = gap[2, 4] = 1e-6
    rates = {one: leakage(result(gap, boundary=one)).leak_rate.item() for one in ("free", "mirror", "periodic")}
    assert rates.pop("periodic") > 0
    assert rates == {"free": 0.0, "mirror": 0.0}


def test_frames__on_dask_are_tasks_of_their_own():
    frames = [1e-6 * np.random.default_rng(seed).random((5, 4)) for seed in range(6)]
    ds = xr.concat([result(*frames[:3]), result(*frames[3:])], dim="case")
    lazy = leakage(ds.chunk(case=2, time=2, x=2), flow=True)
    for one in lazy.values():
        assert isinstance(one.data, dask.array.Array)
        assert one.data.blocks.size == 6 if one.ndim == 2 else set(one.data.chunks[:2]) == {(1, 1), (1, 1, 1)}
    xr.testing.assert_identical(lazy.compute(), leakage(ds, flow=True))
    assert lazy.leak_rate.dims == ("case", "time")


@pytest.mark.parametrize(
    ("key", "found"),
    [("viscosity", "1 bar"), ("viscosity", 0), ("pressure_drop", "much"), ("along", "z")],
)
def test_leakage__refuses_wrong_settings(key, found):
    with refused(key, found):
        leakage(result(plane()), **{key: found})


def test_leakage__refuses_results_that_do_not_say():
    with pytest.raises(InputError, match="holds no 'gap'"):
        leakage(made.rough_creep().drop_vars("gap"))
    with pytest.raises(InputError, match=r"the gap is missing in 68 of 7200 cells, where the surface is absent"):
        leakage(made.rough_creep(frames=1))
