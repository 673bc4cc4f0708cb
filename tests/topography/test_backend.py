"""The xarray engine "roughvisc"."""

import io

import numpy as np
import pytest
import xarray as xr
from scan_files import CELL, card, file_card, tilted, write_sdf, write_x3p

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.topography.backend import RoughviscBackend
from roughvisc.topography.readers import from_array
from roughvisc.topography.scans import open_scan


@pytest.mark.parametrize("engine", [{"engine": "roughvisc"}, {}])
def test_engine__gives_what_open_scan_gives(engine, tmp_path):
    path = write_x3p(tmp_path / "scan.x3p")
    xr.testing.assert_identical(xr.open_dataarray(path, **engine), open_scan(path))
    path = file_card(tmp_path, "fill = true\nresample = [6, 4]\n")
    xr.testing.assert_identical(xr.open_dataarray(path, engine="roughvisc"), open_scan(path))


def test_engine__takes_the_options_of_open_scan(tmp_path):
    np.save(tmp_path / "scan.npy", tilted())
    options = {"unit": "um", "spacing": CELL}
    h = xr.open_dataarray(tmp_path / "scan.npy", engine=RoughviscBackend, **options)
    xr.testing.assert_identical(h, open_scan(tmp_path / "scan.npy", **options))
    assert "height" not in xr.open_dataset(
        tmp_path / "scan.npy", engine=RoughviscBackend, drop_variables="height", **options
    )
    for wrong in (tmp_path / "scan.npy", io.BytesIO(b"x")):
        with pytest.raises(InputError):
            xr.open_dataarray(wrong, engine=RoughviscBackend)


def test_engine__opens_many_scans_and_aligns_none_silently(tmp_path):
    write_x3p(tmp_path / "0.x3p")
    write_sdf(tmp_path / "1.sdf", 2 * tilted())
    options = {"engine": RoughviscBackend, "combine": "nested", "concat_dim": "scan", "join": "exact"}
    options |= {"coords": "minimal", "compat": "override"}
    ds = xr.open_mfdataset(sorted(tmp_path.glob("*.*")), **options)
    np.testing.assert_array_equal(ds.height[1], 2 * tilted())
    pytest.importorskip("x3pio").write(tmp_path / "2.x3p", tilted().T, x_scale=CELL[0] * 1.0001, y_scale=CELL[1])
    with pytest.raises(ValueError, match="exact"):
        xr.open_mfdataset(sorted(tmp_path.glob("*.x3p")), **options)
    with pytest.raises(InputError):
        rv.combine(from_array(tilted(), CELL), from_array(tilted(), (CELL[0] * 1.0001, CELL[1])))


def test_card__refuses_options_that_belong_in_it(tmp_path):
    path = card(tmp_path, 'generate = "sphere"\nradius = 1\nsize = 1e-6\nshape = 4\n')
    with pytest.raises(InputError, match=r"card\.toml.*unit=, spacing="):
        open_scan(path, unit="um", spacing=1e-6)
