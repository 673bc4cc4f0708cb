"""Files of results: whole or absent, plain to every reader, lazy to ours."""

import tracemalloc

import numpy as np
import pytest
import xarray as xr
from sample_results import hertz_creep, rough_creep
from support import assert_missing_as_declared, refused

import roughvisc as rv
from roughvisc.experiment.base import Row
from roughvisc.runs import netcdf
from roughvisc.runs.checkpoint import CheckpointWriter
from roughvisc.runs.netcdf import open_result, write_result
from roughvisc.variables import VARIABLES


def test_missing__of_a_punch_is_what_is_declared_missing_where_it_is_absent():
    punch, rubber = rv.flat_punch(5e-5, 2e-4, 20), rv.zener(3e6, 1e6, 1e5)
    program = rv.Program().load(1e-4, over=0.05).hold(0.1)
    ds = rv.simulate(punch, rubber, program, times=[0, 0.05, 0.15], edge="accept", progress=False)
    assert_missing_as_declared(ds)
    absent = {name for name in ds.variables if VARIABLES[name].missing == VARIABLES["height"].missing}
    assert {name for name in ds.variables if ds[name].isel(time=-1, missing_dims="ignore").isnull().any()} == absent


def test_write_result__gives_the_same_numbers_back(tmp_path):
    written = rough_creep(shape=(21, 34), frames=5)
    path = write_result(written, tmp_path / "new" / "result.nc")
    assert [p.name for p in path.parent.iterdir()] == ["result.nc"]
    with open_result(path) as read:
        assert not read["pressure"]._in_memory
        xr.testing.assert_identical(read.load().drop_attrs(), written.drop_attrs())
        assert read.attrs["title"] == written.attrs["title"]
        assert read["time"].dtype.kind == "f", "seconds stay numbers"


def test_write_result__refuses_what_is_not_declared(tmp_path):
    with pytest.raises(KeyError, match="colour"):
        write_result(hertz_creep((5, 6), 2).assign(colour=3.0), tmp_path / "r.nc")
    assert not list(tmp_path.iterdir())


def test_write_result__leaves_nothing_behind_when_it_fails(tmp_path, monkeypatch):
    path = write_result(hertz_creep((5, 6), 2), tmp_path / "r.nc")
    before = path.read_bytes()

    def fails(*_):
        assert any(p.name.endswith(".part.nc") for p in tmp_path.iterdir())
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(netcdf, "_write", fails)
    with pytest.raises(OSError, match="No space left"):
        write_result(hertz_creep((5, 6), 3), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_write_result__holds_one_layer_of_chunks(tmp_path):
    """Of fields that are read when they are asked for: the one before is let go first."""
    ds = hertz_creep((257, 256), 24)
    shape = ds["pressure"].shape

    recorder = CheckpointWriter(tmp_path / "rows")
    for row in range(shape[0]):
        recorder.append(Row(row, {"force": 1.0}, {"pressure": np.full(shape[1:], float(row))}), "time", 0.0)
    assert list((tmp_path / "rows").iterdir()), "some rows are in a file"
    pressure = recorder.field("pressure", range(shape[0]), shape[1:])
    ds = ds.assign(pressure=(ds["pressure"].dims, pressure, ds["pressure"].attrs))
    write_result(ds, tmp_path / "first.nc")  # what is imported late is there
    tracemalloc.start()
    try:
        path = write_result(ds, tmp_path / "r.nc")
        largest = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert largest < 1.5 * ds["pressure"].nbytes / 3
    with open_result(path) as read:
        np.testing.assert_array_equal(read["pressure"][:, 3, 5], np.arange(24.0))


def test_save_result__keeps_values_and_steps_and_rounds_the_gap_to_its_error(tmp_path):
    waves, press = rv.wavy("1 um", "1 mm", "1 mm", 48), rv.Program().load("2 N", over="0.1 s").hold("1 s")
    ds = rv.simulate(waves, rv.zener(3e6, 1e6, 1e5), press, times=9, tolerance=1e-2, progress=False)
    whole = rv.open_result(rv.save_result(ds, tmp_path / "whole.nc"))
    xr.testing.assert_equal(whole.load(), ds)
    xr.testing.assert_equal(whole.roughvisc.steps, ds.roughvisc.steps)
    rounded = rv.open_result(rv.save_result(ds, tmp_path / "rounded.nc", gap_part=0.1))
    assert (abs(rounded.gap - ds.gap).max(("x", "y")) <= 0.1 * ds.approach_error).all()
    assert (tmp_path / "rounded.nc").stat().st_size < (tmp_path / "whole.nc").stat().st_size
    for key, call in {
        "dataset": lambda: rv.save_result(xr.Dataset({"a": 1}), tmp_path / "no.nc"),
        "path": lambda: rv.save_result(ds, tmp_path / "no.txt"),
        "gap_part": lambda: rv.save_result(ds.drop_vars("gap"), tmp_path / "no.nc", gap_part=0.1),
    }.items():
        with refused(key):
            call()
    assert not list(tmp_path.glob("no.*"))
