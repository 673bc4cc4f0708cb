"""Maps of more cells than are drawn: extremes stay, little is read at a time, small maps are as they were."""

import sys

import numpy as np
import pytest
import xarray as xr

from roughvisc.plot.maps import frame_of

SHAPE, CELL = (50, 37), (2e-6, 3e-6)


def result():
    """Two frames: nothing but one cell in contact; and a patch, with the highest pressure in one cell of it."""
    x, y = ((np.arange(n) + 0.5) * d for n, d in zip(SHAPE, CELL, strict=True))
    random = np.random.default_rng(0)
    height = 1e-6 * random.standard_normal(SHAPE)
    pressure = np.zeros((2, *SHAPE))
    pressure[0, 17, 23] = 2e6
    pressure[1, 10:30, 5:20] = 1e6
    pressure[1, 21, 13] = 9e6
    gap = np.where(pressure > 0, 0.0, 1e-7 + 1e-6 * random.random(pressure.shape))
    kept = {"pressure": (("time", "x", "y"), pressure), "gap": (("time", "x", "y"), gap)}
    kept["displacement"] = (("time", "x", "y"), height + gap - 3e-6)
    histories = {name: ("time", [1.0, 2.0]) for name in ("force", "approach", "contact_area")}
    return xr.Dataset(
        {"height": (("x", "y"), height), **kept, **histories},
        coords={"time": [0.1, 0.2], "x": x, "y": y},
        attrs={"boundary": "periodic", "tolerance": 1e-3, "result_format": 1, "title": "made up"},
    )


@pytest.fixture
def coarse(monkeypatch):
    """Maps of at most 16 cells a side: a cell drawn for 4 x 4."""
    monkeypatch.setattr(sys.modules["roughvisc.plot.maps"], "MOST_CELLS", 16)


def test_present__keeps_the_extremes_of_every_block(coarse):
    ds = result()
    ds["height"][:4, :4] = ds["height"][6, 7] = np.nan
    drawn = {name: frame_of(ds, name, 1) for name in ("pressure", "gap", "displacement")}
    assert drawn["gap"].shape == (13, 10)
    assert np.isnan(drawn["pressure"].values[0, 0])
    assert np.isfinite(drawn["pressure"].values[1, 1])
    for i, j in np.ndindex(13, 10):
        block = ds.isel(time=1, x=slice(4 * i, 4 * i + 4), y=slice(4 * j, 4 * j + 4))
        block = block.where(block["height"].notnull())
        for name, kept in (("pressure", block["pressure"].max()), ("gap", block["gap"].min())):
            np.testing.assert_array_equal(drawn[name][i, j], kept)
        np.testing.assert_allclose(drawn["displacement"][i, j], block["displacement"].mean(), rtol=1e-12)
