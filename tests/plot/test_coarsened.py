"""Maps of more cells than are drawn: extremes stay, little is read at a time, small maps are as they were."""

import sys

import numpy as np
import pytest
import xarray as xr

import roughvisc as rv
from roughvisc.plot.maps import frame_of
from roughvisc.study.storage import netcdf

SHAPE, CELL = (50, 37), (2e-6, 3e-6)


def result(displacement=False):
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
    if displacement:
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


@pytest.fixture
def stored(tmp_path, monkeypatch):
    """The result in a file of small chunks, and the shapes that are read of it."""
    monkeypatch.setattr(netcdf, "_MANY_CELLS", 100)
    monkeypatch.setattr(netcdf, "_CHUNK_OF_MANY", (1, 8, 8))
    path, shapes = netcdf.write_result(result(displacement=True), tmp_path / "result.nc"), []
    read = netcdf._Field._read

    def told(self, key):
        found = read(self, key)
        shapes.append(found.shape)
        return found

    monkeypatch.setattr(netcdf._Field, "_read", told)
    with netcdf.open_result(path) as dataset:
        yield dataset, shapes


def test_present__keeps_the_extremes_of_every_block(coarse):
    ds = result(displacement=True)
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


def test_maps__show_a_lone_spot_and_say_so(coarse):
    figure = rv.plot.maps(result(), times=[0.1, 0.2])
    images = [image for ax in figure.axes for image in ax.images][:2]
    assert [float(image.get_array().max()) for image in images] == pytest.approx([2.0, 9.0])
    assert (images[0].get_array() > 0).sum() == 1
    told = figure.get_supxlabel().replace("\n", " ")
    assert "4 × 4" in told
    assert "largest pressure" in told
    assert "smallest gap" in told


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_observables__of_a_file_are_those_in_memory_and_read_a_frame_at_a_time(stored, boundary):
    opened, shapes = stored
    opened.attrs["boundary"] = boundary
    loaded = opened.copy(deep=True).load()
    shapes.clear()
    for name in ("clusters", "distribution"):
        observe = getattr(rv.observables, name)
        xr.testing.assert_allclose(observe(opened).compute(), observe(loaded), rtol=1e-13)
        xr.testing.assert_allclose(observe(loaded.chunk(time=1)).compute(), observe(loaded), rtol=1e-13)
    areas = rv.observables.cluster_areas(opened)
    xr.testing.assert_identical(areas, rv.observables.cluster_areas(loaded))
    contact = rv.observables.contact(opened)
    assert contact.chunks
    assert max(int(np.prod(shape)) for shape in shapes) == SHAPE[0] * SHAPE[1], "a frame"
    xr.testing.assert_equal(contact.compute(), rv.observables.contact(loaded))
