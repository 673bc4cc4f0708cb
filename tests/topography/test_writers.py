"""Writing of scans: conversion without loss, and surface cards that state how a file is read."""

import numpy as np
import pytest
import xarray as xr
from scan_files import CELL, tilted, write_sdf, write_x3p

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.topography.grid import spacing
from roughvisc.topography.scans import card_text, save_scan


@pytest.mark.parametrize("suffix", ["nc", "x3p", "sdf", "X3P"])
def test_save_scan__is_read_back_exactly(suffix, tmp_path):
    h = rv.from_array(tilted(), CELL)
    save_scan(h.transpose("y", "x"), tmp_path / f"scan.{suffix}")
    again = rv.open_scan(tmp_path / f"scan.{suffix}")
    np.testing.assert_array_equal(again, tilted())
    np.testing.assert_allclose(spacing(again), CELL, rtol=1e-14)
    np.testing.assert_allclose(again.x, h.x, rtol=1e-12)


def test_save_scan__netcdf_keeps_mask_history_and_origin(tmp_path):
    h = rv.crop(rv.fill(rv.from_array(tilted(), CELL)), x=(4e-6, 2e-5))
    save_scan(h, tmp_path / "scan.nc")
    again = rv.open_scan(tmp_path / "scan.nc")
    xr.testing.assert_equal(again, h)
    assert again["filled"].dtype == bool
    assert again.attrs["history"].startswith(h.attrs["history"])


def test_save_scan__refuses(tmp_path):
    h = rv.from_array(tilted(), CELL)
    with pytest.raises(InputError, match=r"\.stl'.*\.nc, \.x3p, \.sdf"):
        save_scan(h, tmp_path / "scan.stl")
    with pytest.raises(InputError, match="save_scan: found DataArray over"):
        save_scan(h.rename(x="z"), tmp_path / "scan.nc")
    assert list(tmp_path.iterdir()) == []


def test_card_text__makes_a_card_that_opens_as_the_file(tmp_path):
    (tmp_path / "scans").mkdir()
    path = write_x3p(tmp_path / "scans" / 'odd "name" \u00b5.x3p')
    (tmp_path / "card.toml").write_text(card_text(path, tmp_path, {"channel": None}, {}), encoding="utf-8")
    h = rv.open_scan(tmp_path / "card.toml")
    xr.testing.assert_equal(h, rv.open_scan(path))
    assert h.attrs["title"] == 'odd "name" \u00b5'
    write_x3p(path, 2 * tilted())
    with pytest.raises(InputError, match="changed or damaged"):
        rv.open_scan(tmp_path / "card.toml")


def test_card_text__states_the_options_that_the_file_needs(tmp_path):
    np.save(tmp_path / "scan.npy", tilted())
    options = {"unit": "mm", "height_scale": 1e-3, "spacing": CELL, "format": "npy", "channel": 0}
    (tmp_path / "card.toml").write_text(card_text(tmp_path / "scan.npy", tmp_path, options, {}))
    xr.testing.assert_equal(rv.open_scan(tmp_path / "card.toml"), rv.open_scan(tmp_path / "scan.npy", **options))


def test_card_text__has_the_conditioning(tmp_path):
    path = write_sdf(tmp_path / "scan.sdf")
    h = rv.open_scan(path)
    steps = {"crop": {"x": (0.0, 20 * CELL[0]), "y": (0.0, 18 * CELL[1])}, "level": 1, "fill": True}
    (tmp_path / "card.toml").write_text(card_text(path, tmp_path, {}, steps))
    expected = rv.fill(rv.level(rv.crop(h, **steps["crop"]), 1))
    np.testing.assert_array_equal(rv.open_scan(tmp_path / "card.toml"), expected)
    with pytest.raises(InputError, match="is a surface card already"):
        card_text(tmp_path / "card.toml", tmp_path, {}, {})
