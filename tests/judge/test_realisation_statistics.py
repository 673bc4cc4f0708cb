"""Statistics over realisations: against Student, log-normal samples whose mean is known, and sweeps of real cases."""

import json

import numpy as np
import pytest
import scipy.stats
import xarray as xr
from support import ROUGH, refused

from roughvisc.runs.csv_files import to_table
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.run import run_case
from roughvisc.runs.sweep import sweep
from roughvisc.runs.sweep_data import open_results
from roughvisc.study.case import read_cases, read_study
from roughvisc.study.sweep_table import over_realisations


def of(values, **coords):
    return xr.DataArray(np.asarray(values, float), dims=("realisation", "time")[: np.ndim(values)], coords=coords)


def test_over_realisations__of_both_signs_is_student():
    values = np.random.default_rng(3).normal(0.1, 1.0, (7, 5))
    found = over_realisations(of(values))
    low, high = scipy.stats.t.interval(0.95, 6, values.mean(0), scipy.stats.sem(values))
    np.testing.assert_allclose(found["lower"], low)
    np.testing.assert_allclose(found["upper"], high)
    np.testing.assert_allclose(found["standard_deviation"], values.std(0, ddof=1))
    half = scipy.stats.t.ppf(0.975, 6) * np.hypot(values.std(0, ddof=1), scipy.stats.sem(values))
    np.testing.assert_allclose(found["patch_upper"] - found["mean"], half)
    np.testing.assert_allclose(found["mean"] - found["patch_lower"], half)


@pytest.mark.parametrize(("count", "spread"), [(6, 0.05), (6, 0.7), (24, 1.2)])
def test_over_realisations__holds_what_log_normal_samples_were_drawn_from(count, spread):
    draws = np.random.default_rng(1).normal(0.0, spread, (count + 1, 4000))
    found = over_realisations(of(np.exp(draws[:count])))
    true = np.exp(spread**2 / 2)
    of_mean = float(((found["lower"] <= true) & (true <= found["upper"])).mean())
    of_patch = float(((found["patch_lower"] <= np.exp(draws[-1])) & (np.exp(draws[-1]) <= found["patch_upper"])).mean())
    assert 0.92 < of_mean < 0.965
    assert abs(of_patch - 0.95) < 0.012  # 3.5 standard deviations of so many draws
    assert (found["lower"] <= found["mean"]).mean() > 0.999


def test_over_realisations__zeros_and_missing_values():
    nan = np.nan
    found = over_realisations(of([[0, 0, 2, nan, nan], [0, 1, 3, 4, nan], [0, 2, np.inf, nan, nan]]))
    assert found["count"].values.tolist() == [3, 3, 2, 1, 0]
    np.testing.assert_array_equal(found["mean"], [0, 1, 2.5, 4, nan])
    for name in ("lower", "upper", "patch_lower", "patch_upper"):
        assert np.isfinite(found[name]).values.tolist() == [False, False, True, False, False], name
    found = over_realisations(of([-1.0, 0.0, 1.0]))  # a zero among both signs is a value as any
    assert float(found["upper"]) == pytest.approx(scipy.stats.t.ppf(0.975, 2) / np.sqrt(3))


def test_over_realisations__the_surface_itself_stands_apart():
    values = of([[9.0, 1.0, 0.1], [1.1, 1.1, 1.1], [0.9, 0.9, 0.9], [1.0, 1.0, 1.0]], realisation=[0, 1, 2, 3])
    found = over_realisations(values)
    assert found["count"].values.tolist() == [3, 3, 3]
    np.testing.assert_allclose(found["mean"], 1.0)
    np.testing.assert_allclose(found["ratio"], [9, 1, 0.1])
    found, scaled = over_realisations(values), over_realisations(values * 1e-9)
    np.testing.assert_allclose(scaled["patch_upper"], 1e-9 * found["patch_upper"])
    assert "itself" not in over_realisations(values[1:])
    with refused("area", ["time"]):
        over_realisations(values.isel(realisation=0, drop=True).rename("area"))


STUDY = (
    ROUGH.replace("seed = 3", 'seed = 5\namplitudes = "gaussian"')
    .replace('load = "10 mN"\nover = "50 ms"', 'pressure = "10 kPa"\nover = 0')
    .replace('times = [0, "20 ms", "50 ms"]', 'fields = ["pressure"]')
)
SWEEP = '[sweep]\nrealisations = {count}\n"program.0.pressure" = ["10 kPa", "20 kPa"]\n'


@pytest.fixture
def study(tmp_path):
    def write(sweep=""):
        path = tmp_path / "study.toml"
        path.write_text(STUDY + sweep)
        return path

    return write


def test_sweep__realisations_are_a_dimension_that_grows(study, tmp_path):
    out = tmp_path / "out"
    alone = open_result(run_case(read_study(study()), out))  # as no realisation of anything
    first = sweep(study(SWEEP.format(count=2)), out, workers=0, progress=False)
    assert first["contact_area"].dims == ("case", "realisation", "time")
    assert float(first["contact_area"][0, 0, -1]) == float(alone["contact_area"][-1])
    before = {path.name: path.stat().st_mtime_ns for path in out.glob("*.nc")}
    assert len(before) == 4
    more = sweep(study(SWEEP.format(count=3)), out, workers=0, progress=False)
    assert all((out / name).stat().st_mtime_ns == changed for name, changed in before.items())
    assert more["realisation"].values.tolist() == [1, 2, 3]
    assert more["surface_seed"].values.tolist() == [[5, 6, 7]] * 2
    assert more["program_0_pressure"].dims == ("case",)
    again = open_results(out)
    xr.testing.assert_identical(again.compute(), more.compute())
    for case, realisation in ((0, 2), (1, 0)):
        one = again.isel(case=case, realisation=realisation)
        with open_result(out / f"{one['case_key'].item()}.nc") as file:
            np.testing.assert_array_equal(one["pressure"], file["pressure"])
            np.testing.assert_array_equal(one["height"], file["height"])
            assert json.loads(file.attrs["case"])["surface"]["seed"] == 5 + realisation
            assert one["program_0_pressure"] == file.roughvisc.steps.nominal_pressure[-1]
    for part in (again, again.isel(case=1), again.isel(realisation=[2, 0]), again.sel(realisation=2).isel(case=0)):
        assert part["work_error"].dims == part["contact_area"].dims
        assert part["case_key"].equals(part["case_key"])
    table = to_table(out)
    assert table["realisation"].tolist() == [1, 2, 3] * 2
    assert table.index.tolist() == [0, 0, 0, 1, 1, 1]


def test_realisations__of_a_study_in_which_nothing_else_varies(study, tmp_path):
    found = sweep(study("[sweep]\nrealisations = 3\n"), tmp_path / "out", workers=0, progress=False)
    assert found["contact_area"].dims == ("case", "realisation", "time")
    assert found["realisation"].values.tolist() == [1, 2, 3]


def test_open_results__what_is_not_computed_is_missing(study, tmp_path):
    out = tmp_path / "out"
    sweep(study(SWEEP.format(count=3)), out, workers=0, progress=False)
    lost = read_cases(study(SWEEP.format(count=3)))[4]
    (out / f"{lost.key}.nc").unlink()
    found = open_results(out)
    np.testing.assert_array_equal((found["case_key"] == "").values, [[0, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(np.isnan(found["contact_area"][..., -1]), [[0, 0, 0], [0, 1, 0]])
    assert found["pressure"][1, 1].isnull().all()
    assert found["work_error"][1, 1].isnull().all()
    assert over_realisations(found["contact_area"])["count"][:, -1].values.tolist() == [3, 2]
    assert found.isel(case=1)["force"].dims == ("realisation", "time")
