"""The xarray engine "roughvisc" opens scans as ``open_scan`` does, with its options."""

import numpy as np
import pytest
import xarray as xr
from scan_files import CELL, card, file_card, tilted, write_x3p

from roughvisc.errors import InputError
from roughvisc.topography.backend import RoughviscBackend
from roughvisc.topography.scans import open_scan


def test_engine__gives_what_open_scan_gives(tmp_path):
    path = write_x3p(tmp_path / "scan.x3p")
    xr.testing.assert_identical(xr.open_dataarray(path, engine="roughvisc"), open_scan(path))
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
    with pytest.raises(InputError):
        xr.open_dataarray(tmp_path / "scan.npy", engine=RoughviscBackend)


def test_card__refuses_options_that_belong_in_it(tmp_path):
    path = card(tmp_path, 'generate = "sphere"\nradius = 1\nsize = 1e-6\nshape = 4\n')
    with pytest.raises(InputError, match=r"card\.toml.*unit=, spacing="):
        open_scan(path, unit="um", spacing=1e-6)
