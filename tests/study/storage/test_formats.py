"""Results of the former version are read under the names of today; what is expected is computed from the raw files."""

import json
import os
import shutil
from pathlib import Path

import netCDF4
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from support import run_whole

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.study.storage.formats import FORMER_NAMES
from roughvisc.study.storage.index import INDEX, index_of
from roughvisc.study.storage.store import whole_result, write_result
from roughvisc.study.storage.table import CASES, write_table
from roughvisc.study.trade.files import open_trade
from roughvisc.views.report.case_table import table_row

FORMER = Path(__file__).parent / "format_1"
KINDS = ("creep", "friction", "slide", "sweep")
#: Sides of the cells of the rough surfaces, and their number.
SIDE, CELLS = 2e-6, 17 * 12


def file_of(kind):
    return next((FORMER / kind).glob("*.nc"))


def raw(path):
    """Variables of a file as netCDF4 reads them."""
    with netCDF4.Dataset(path) as file:
        file.set_auto_mask(False)
        return {name: np.asarray(variable[...]) for name, variable in file.variables.items()}


def area_by_hand(gap, force=1.0):
    """Cells without a gap, less 0.088 of a cell for each face to others, periodic; none without a force. [m2]"""
    touching = (gap <= 0) & (force > 0)
    faces = 0
    for i, j in np.argwhere(touching):
        for k, m in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
            faces += not touching[k % touching.shape[0], m % touching.shape[1]]
    return (np.count_nonzero(touching) - 0.088 * faces) * SIDE**2


@pytest.fixture
def folder(tmp_path):
    """A copy of the former sweep, whose stored index takes the files for unchanged."""
    shutil.copytree(FORMER / "sweep", tmp_path / "sweep")
    with np.load(tmp_path / "sweep" / INDEX) as stored:
        head = json.loads(bytes(stored["head"]))
    assert len(head["entries"]) == 2
    for entry in head["entries"]:
        os.utime(tmp_path / "sweep" / entry["file"], ns=(entry["stamp"][1],) * 2)
    return tmp_path / "sweep"


@pytest.mark.parametrize("kind", KINDS)
def test_former_result__has_the_names_of_today(kind):
    path = file_of(kind)
    found, stored = whole_result(path), raw(path)
    steps = ("", "step_") if "step_contact_area" in stored else ("",)
    assert (kind == "creep") == ("step_" in steps)
    size = found.sizes["x"] * found.sizes["y"] * float(found.x[1] - found.x[0]) * float(found.y[1] - found.y[0])
    for step in steps:
        counted, area = stored[f"{step}contact_area"], stored[f"{step}contact_area_corrected"]
        assert (area <= counted).all()
        assert (area < counted).any()
        np.testing.assert_array_equal(found[f"{step}contact_area"], area)
        np.testing.assert_array_equal(found[f"{step}contact_area_counted"], counted)
        np.testing.assert_allclose(found[f"{step}contact_fraction"], area / size, rtol=1e-12)
        assert found[f"{step}contact_area_counted"].attrs["long_name"] == "contact area, counted"
    assert not {"contact_area_corrected", "step_contact_area_corrected", "leak_rate_lower"} & set(found.variables)
    assert found.attrs["result_format"] == 4
    assert {name for name in stored if name not in FORMER_NAMES} <= {*found.variables, "string16", "step"}


def test_former_area__is_that_of_the_kept_gap():
    for path in (FORMER / "sweep").glob("*.nc"):
        found, stored = whole_result(path), raw(path)
        by_hand = [area_by_hand(*row) for row in zip(stored["gap"], stored["force"], strict=True)]
        np.testing.assert_allclose(found.contact_area, by_hand, rtol=1e-12)
        np.testing.assert_allclose(found.contact_fraction, np.array(by_hand) / (CELLS * SIDE**2), rtol=1e-12)
        counts = (stored["gap"] <= 0).sum((1, 2)) * (stored["force"] > 0)
        np.testing.assert_allclose(found.contact_area_counted, counts * SIDE**2, rtol=1e-12)


def test_former_bounds__are_those_of_today():
    """Cells in doubt count with their four faces; the error of the grid is over the largest area."""
    in_doubt = 0
    for path in (file_of("creep"), file_of("slide"), *(FORMER / "sweep").glob("*.nc")):
        found, stored = whole_result(path), raw(path)
        area, counted = stored["contact_area_corrected"], stored["contact_area"]
        lowest, highest = stored["contact_area_lower"], stored["contact_area_upper"]
        in_doubt += np.count_nonzero(highest > counted) * np.count_nonzero(lowest < counted)
        lower = np.maximum(area - (1 + 4 * 0.088) * (counted - lowest), 0.0)
        upper = np.minimum(area + (1 + 4 * 0.088) * (highest - counted), highest)
        np.testing.assert_allclose(found.contact_area_solver_lower, lower, rtol=1e-12)
        np.testing.assert_allclose(found.contact_area_solver_upper, upper, rtol=1e-12)
        assert ("contact_area_lower" in found) == ("grid_error_area" in stored), "only where the grid's part is known"
        if "grid_error_area" in stored:
            grid = stored["grid_error_area"] * area.max()
            np.testing.assert_allclose(found.contact_area_lower, lower - grid, rtol=1e-12)
            np.testing.assert_allclose(found.contact_area_upper, upper + grid, rtol=1e-12)
    assert in_doubt, "it is put to the test"


def test_former_bounds_of_the_leak_rate__are_named_after_the_solver():
    path = next((FORMER / "sweep").glob("*.nc"))
    found, stored = whole_result(path), raw(path)
    for end in ("lower", "upper"):
        np.testing.assert_array_equal(found[f"leak_rate_solver_{end}"], stored[f"leak_rate_{end}"])


def test_former_and_new_results_of_one_folder__have_one_meaning(folder):
    text = (FORMER / "sweep.toml").read_text().partition("[sweep]")[0].replace('"100 kPa"', '"120 kPa"')
    (folder.parent / "study.toml").write_text(text)
    run_whole(folder.parent / "study.toml", out=folder, progress=False)
    assert len(index_of(folder).entries) == 3
    found = rv.open_results(folder, cases="all").load()
    assert found.sizes["case"] == 3
    assert found.attrs["result_format"] == 4
    rows = [zip(*case, strict=True) for case in zip(found.gap.values, found.force.values, strict=True)]
    by_hand = np.array([[area_by_hand(*row) for row in case] for case in rows])
    np.testing.assert_allclose(found.contact_area, by_hand, rtol=1e-12)
    np.testing.assert_allclose(found.contact_fraction, by_hand / (CELLS * SIDE**2), rtol=1e-12)
    again = rv.open_results(folder, cases="all").load()
    xr.testing.assert_identical(found, again)


def test_former_index_and_table__are_made_anew(folder):
    by_hand = {path.name: area_by_hand(raw(path)["gap"][-1]) for path in folder.glob("*.nc")}
    former = pd.read_csv(folder / CASES, index_col="file")
    assert "contact_area_corrected [m^2]" in former
    table = rv.to_table(folder).set_index("file")
    write_table(folder, index_of(folder), {})
    written = pd.read_csv(folder / CASES, index_col="file")
    for found in (table, written):
        assert "contact_area_corrected [m^2]" not in found
        assert "contact_area_upper [m^2]" not in found
        for name, area in by_hand.items():
            row = found.loc[name]
            assert row["contact_area [m^2]"] == pytest.approx(area, rel=1e-6)
            assert row["contact_fraction"] == pytest.approx(area / (CELLS * SIDE**2), rel=1e-6)
            bounds = row["contact_area_solver_lower [m^2]"], row["contact_area_solver_upper [m^2]"]
            assert bounds[0] <= row["contact_area [m^2]"] <= bounds[1]


@pytest.mark.parametrize("kind", KINDS)
def test_former_result__written_again_is_of_the_present_format(kind, tmp_path):
    found = whole_result(file_of(kind)).load()
    with xr.open_dataset(write_result(found, tmp_path / "again.nc"), decode_timedelta=False) as plain:
        assert plain.attrs["result_format"] == 4
    again = whole_result(tmp_path / "again.nc").load()
    assert set(again.variables) == set(found.variables)
    np.testing.assert_array_equal(again.contact_area, found.contact_area)
    np.testing.assert_array_equal(again.contact_fraction, found.contact_fraction)


def test_former_result_opened_by_xarray_alone__is_converted_by_the_accessor_and_refused_elsewhere():
    path = file_of("creep")
    with xr.open_dataset(path, decode_timedelta=False) as plain:
        plain.load()
    growth = plain.roughvisc.area_growth()
    xr.testing.assert_identical(growth, rv.observables.area_growth(whole_result(path)))
    for function in (rv.observables.area_growth, rv.plot.history):
        with pytest.raises(InputError, match=r"format 1, .*rv\.open_result"):
            function(plain)


def test_former_result__in_the_report_has_one_area():
    ds = whole_result(file_of("sweep"))
    row = table_row(ds, file_of("sweep"), 0)
    by_hand = area_by_hand(ds.gap.values[-1])
    assert float(row["fraction"].removesuffix(" %")) == pytest.approx(100 * by_hand / (CELLS * SIDE**2), rel=5e-3)
    assert float(row["area"].split()[0]) == pytest.approx(by_hand * 1e12, rel=5e-3), "in square micrometres"


def test_former_trade__has_the_names_of_today():
    found, stored = open_trade(FORMER / "trade.nc"), raw(FORMER / "trade.nc")
    former = [str(name) for name in stored["quantity"]]
    assert found.attrs["result_format"] == 4
    for name, old in (("contact_area", "contact_area_corrected"), ("contact_area_counted", "contact_area")):
        np.testing.assert_array_equal(found.error.sel(quantity=name), stored["error"][:, former.index(old)])


@pytest.mark.parametrize("number", [5, 0, 1.5, "two"])
def test_unknown_format__is_refused_with_its_number(number, tmp_path):
    path = tmp_path / "later.nc"
    whole_result(file_of("slide")).load().assign_attrs(result_format=number).to_netcdf(path)
    with pytest.raises(InputError, match=rf"later\.nc: result_format is {number!r}: expected 1 to 4"):
        whole_result(path)
    os.replace(path, tmp_path / "0123456789abcdef.nc")
    assert index_of(tmp_path).entries == {}


def test_former_result__of_odd_types_is_refused(tmp_path):
    with xr.open_dataset(file_of("slide"), decode_timedelta=False) as plain:
        plain.load()
    path = tmp_path / "odd.nc"
    plain.assign(contact_area=plain.contact_area.astype(str)).to_netcdf(path)
    with pytest.raises(InputError, match=r"odd\.nc: holds contact_area, .*expected numbers of one length"):
        whole_result(path)


def test_older_name__is_taken_where_a_variable_is_named(folder):
    results = rv.open_results(folder)
    with pytest.warns(FutureWarning, match="contact_area_corrected is now contact_area"):
        figure = rv.plot.sweep(results, "contact_area_corrected")
    assert figure.axes[0].get_ylabel() == rv.plot.sweep(results, "contact_area").axes[0].get_ylabel()
    with pytest.warns(FutureWarning, match="contact_area_corrected"):
        rv.plot.histories_of_cases(results, "contact_area_corrected")
    with pytest.warns(FutureWarning, match="contact_area_corrected"):
        rv.plot.trade(open_trade(FORMER / "trade.nc"), ["contact_area_corrected"])
