"""The xarray engine: lazy scans that reopen."""

import importlib.metadata
import io
import pickle
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scan_files import CELL, SCANS, TABLE, card, file_card, real, tilted, write_sdf, write_text, write_x3p

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.topography.backend import UNAMBIGUOUS, RoughviscBackend
from roughvisc.topography.readers import from_array, supported_formats
from roughvisc.topography.scans import open_scan, outline


def lazily(path, **options):
    return xr.open_dataarray(path, engine=RoughviscBackend, **options)


def write_nc(path, **options):
    rv.fill(from_array(tilted(), CELL))[::-1].to_netcdf(path, engine="netcdf4", **options)
    return path


WRITERS = {"x3p": write_x3p, "sdf": write_sdf, "asc": write_text, "nc": write_nc, "h5": write_nc}


@pytest.mark.parametrize("suffix", WRITERS)
def test_engine__gives_what_open_scan_gives(suffix, tmp_path):
    path = WRITERS[suffix](tmp_path / f"scan.{suffix}")
    h, expected = lazily(path), open_scan(path)
    assert (h.shape, h.dtype, h.name) == ((13, 9), np.float64, "height")
    xr.testing.assert_identical(h[3:5, 1], expected[3:5, 1])  # part of it, before it is loaded whole
    xr.testing.assert_identical(h.load(), expected)
    h.to_netcdf()


@real
@pytest.mark.parametrize("name", TABLE)
def test_engine__gives_what_open_scan_gives_of_real_scans(name):
    xr.testing.assert_identical(lazily(SCANS / name).load(), open_scan(SCANS / name))


def test_engine__opens_cards_and_takes_the_options_of_open_scan(tmp_path):
    path = file_card(tmp_path, "[conditioning]\nfill = true\nresample = [6, 4]\n")
    xr.testing.assert_identical(lazily(path), open_scan(path))
    np.save(tmp_path / "scan.npy", tilted())
    h = lazily(tmp_path / "scan.npy", unit="um", spacing=CELL)
    np.testing.assert_allclose(h, tilted().T * 1e-6)
    assert "height" not in xr.open_dataset(path, engine=RoughviscBackend, drop_variables="height")
    with pytest.raises(InputError, match=r"scan\.npy: it states no unit"):
        lazily(tmp_path / "scan.npy")
    with pytest.raises(InputError, match="BytesIO"):
        xr.open_dataarray(io.BytesIO(b"x"), engine=RoughviscBackend)


def test_engine__reads_no_heights_until_they_are_used(tmp_path, monkeypatch):
    x3pio = pytest.importorskip("x3pio")
    path = write_x3p(tmp_path / "scan.x3p")
    read, calls = x3pio.read, []
    monkeypatch.setattr(x3pio, "read", lambda *a, **k: calls.append(a) or read(*a, **k))
    h = lazily(path, chunks={})
    part = h[2:4].mean()
    assert float(h.x[0]) == 1e-6
    assert "checksum" not in h.attrs["history"]
    assert calls == []
    assert float(part) == pytest.approx(np.nanmean(tilted()[2:4]))
    assert len(calls) == 1


def test_outline__takes_no_memory(tmp_path):
    path = tmp_path / "large.nc"
    from_array(np.zeros((400, 300)), CELL).to_netcdf(path)
    assert outline(path).values.strides == (0, 0)
    assert outline(write_x3p(tmp_path / "s.x3p")).values.strides == (0, 0)


@pytest.mark.parametrize("suffix", WRITERS)
def test_engine__pickles_and_holds_no_open_file(suffix, tmp_path):
    path = WRITERS[suffix](tmp_path / f"scan.{suffix}")
    expected = open_scan(path)
    for options in ({}, {"chunks": {}}):
        h = pickle.loads(pickle.dumps(lazily(path, **options)))
        xr.testing.assert_identical(h.compute(), expected)


def test_engine__one_chunk_a_file(tmp_path):
    assert lazily(write_x3p(tmp_path / "scan.x3p"), chunks={}).chunks == ((13,), (9,))


@pytest.mark.parametrize("scheduler", ["threads", "synchronous"])
def test_engine__many_kinds_in_dask_threads(scheduler, tmp_path):
    import dask

    paths = [WRITERS[s](tmp_path / f"{i}.{s}") for i in range(6) for s in WRITERS]
    with dask.config.set(scheduler=scheduler, num_workers=8):
        found = dask.compute([lazily(path, chunks={}).chunk(x=4).data for path in paths])[0]
    for values, path in zip(found, paths, strict=True):
        np.testing.assert_array_equal(values, open_scan(path))


def test_open_scan__works_in_threads(tmp_path):
    paths = [WRITERS[s](tmp_path / f"{i}.{s}") for i in range(5) for s in WRITERS]
    with ThreadPoolExecutor(8) as pool:
        for h, path in zip(pool.map(open_scan, paths), paths, strict=True):
            xr.testing.assert_identical(h, open_scan(path))


def test_engine__refuses_a_file_that_was_changed_since(tmp_path):
    path = write_x3p(tmp_path / "scan.x3p")
    h = lazily(path, chunks={})
    write_x3p(path, 2 * tilted())
    with pytest.raises(InputError, match=r"scan\.x3p: the file was changed"):
        h.load()


def test_engine__refuses_bad_heights_when_they_are_read(tmp_path):
    from_array(tilted(), CELL).copy(data=np.where(tilted() > 1e-5, 1.8e302, 0)).to_netcdf(tmp_path / "scan.nc")
    h = lazily(tmp_path / "scan.nc")
    with pytest.raises(InputError, match=r"1\.8e\+302"):
        h.load()


def test_guess_can_open__claims_what_one_format_alone_has():
    guess = RoughviscBackend().guess_can_open
    assert guess("a/b.X3P")
    assert guess(Path("c.sur"))
    for other in ("a.nc", "a.h5", "a.txt", "a.npy", "a.tif", "a.dat", "a.zarr", "a.zip", "a.001", "a", 3, b"x", None):
        assert not guess(other)
    formats = supported_formats()
    for suffix in UNAMBIGUOUS:
        assert sum(suffix in theirs for name, theirs in formats.items()) - (suffix in ("x3p", "sdf")) <= 1, suffix
        assert any(suffix in theirs for theirs in formats.values()), suffix


def test_engine__is_an_entry_point(tmp_path):
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    module, _, name = project["entry-points"]["xarray.backends"]["roughvisc"].partition(":")
    assert (module, name) == (RoughviscBackend.__module__, RoughviscBackend.__name__)
    if "roughvisc" not in importlib.metadata.entry_points(group="xarray.backends").names:
        pytest.skip("the installed metadata is older than the entry point")
    path = write_x3p(tmp_path / "scan.x3p")
    for options in ({"engine": "roughvisc"}, {}):
        xr.testing.assert_identical(xr.open_dataarray(path, **options).load(), open_scan(path))


def test_backend__is_imported_without_readers():
    code = (
        "import sys, roughvisc.topography.backend; "
        "print(sorted({'SurfaceTopography', 'x3pio', 'sdfio', 'dask', 'matplotlib', 'pint', 'scipy'} & {*sys.modules}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.fixture
def client():
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 2, "processes": True, "dashboard_address": "127.0.0.1:0"}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        yield client


@pytest.mark.long
def test_open_mfdataset__opens_a_hundred_scans_lazily_in_processes(client, tmp_path):
    paths = []
    for i in range(100):
        write = [write_x3p, write_sdf][i % 2]
        paths.append(write(tmp_path / f"{i:03d}.{['x3p', 'sdf'][i % 2]}", tilted() + i * 1e-6))
    options = {"combine": "nested", "concat_dim": "scan", "join": "exact", "coords": "minimal", "compat": "override"}
    ds = xr.open_mfdataset(paths, engine=RoughviscBackend, parallel=True, **options)
    assert (ds.height.dims, ds.height.shape) == (("scan", "x", "y"), (100, 13, 9))
    assert ds.chunks["scan"] == (1,) * 100
    found = ds.height.mean(("x", "y")).compute()
    np.testing.assert_allclose(found, np.nanmean(tilted()) + np.arange(100) * 1e-6, rtol=1e-9)
    assert ds.height.variable._in_memory is False


def test_slightly_different_spacing__is_never_aligned_silently(tmp_path):
    """Where grids meet in xarray, ``join="exact"`` and ``arithmetic_join="exact"`` refuse; so does combine, always."""
    a, b = from_array(tilted(), CELL), from_array(tilted(), (CELL[0] * 1.0001, CELL[1]))
    for join in ("inner", "outer", "exact", "left"):
        with xr.set_options(arithmetic_join=join), pytest.raises(InputError, match="one grid"):
            rv.combine(a, b)
        with xr.set_options(arithmetic_join=join):
            for step in (rv.level, rv.fill, rv.mask_outliers, lambda h: rv.gaussian_filter(h, 1e-5)):
                assert step(a).shape == a.shape
            np.testing.assert_array_equal(rv.combine(a, a), 2 * tilted())
    with xr.set_options(arithmetic_join="exact"), pytest.raises(ValueError, match="exact"):
        a + b
    write_x3p(tmp_path / "0.x3p")
    pytest.importorskip("x3pio").write(tmp_path / "1.x3p", tilted().T, x_scale=CELL[0] * 1.0001, y_scale=CELL[1])
    options = {"combine": "nested", "concat_dim": "scan", "coords": "minimal", "compat": "override"}
    with pytest.raises(ValueError, match="exact"):
        xr.open_mfdataset(sorted(tmp_path.glob("*.x3p")), engine=RoughviscBackend, join="exact", **options)


def test_card__refuses_options_that_belong_in_it(tmp_path):
    path = card(tmp_path, 'generate = "sphere"\nradius = 1\nsize = 1e-6\nshape = 4\n')
    with pytest.raises(InputError, match=r"card\.toml: found unit=, spacing= together with a surface card"):
        open_scan(path, unit="um", spacing=1e-6)
