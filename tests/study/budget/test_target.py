"""The grid and the tolerance that are chosen for what is wanted of a number."""

import re
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.study.budget.budget import budgets
from roughvisc.study.budget.grids import first_grids, tolerance_for
from roughvisc.study.budget.solves import Bench
from roughvisc.study.budget.target import parse_targets
from roughvisc.study.execution.monitor import Monitor
from roughvisc.study.quantities import QUANTITIES
from roughvisc.study.statement.case import Case

BALL = """
title = "Ball"
[surface]
generate = "sphere"
radius = "1 mm"
size = "0.2 mm"
shape = [51, 49]
[material]
model = "elastic"
shear_modulus = "1 MPa"
[[program]]
load = "0.2 mN"
over = "10 ms"
"""
ROUGH = """
title = "Rough"
[surface]
generate = "self_affine"
size = ["1 mm", "0.9 mm"]
shape = [27, 25]
hurst = 0.8
rms_slope = 0.2
rolloff = "0.3 mm"
shortcut = "150 um"
amplitudes = "gaussian"
seed = 1
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
pressure = "50 kPa"
over = 0
[[program]]
hold = "1 s"
[keep]
fields = []
times = [0.01, 1.0]
"""
FRICTION = ROUGH[: ROUGH.index("[[program]]")] + '[friction]\nspeeds = [1e-3]\npressure = "50 kPa"\n'


def case(text, tmp_path, **changes):
    path = tmp_path / "study.toml"
    path.write_text(text)
    return rv.vary(rv.read_study(path), changes)


def got(study, tmp_path, want, **options):
    return rv.run(study, tmp_path / "results", want=want, progress=False, **options)


def stated(tmp_path, name):
    with xr.open_dataset(tmp_path / "results" / "budget" / f"budget-{name}.nc") as found:
        return found.load()


def shapes(tmp_path):
    """Cells of all grids that were computed."""
    for path in (tmp_path / "results" / "budget").glob("*.nc"):
        with xr.open_dataset(path) as one:
            if "height" in one:
                yield one["height"].shape


def test_ball__is_computed_on_the_coarsest_grid_that_gives_what_is_wanted(tmp_path):
    """a^3 = 3 F R / (4 E*), with E* = 4 G; the rows are those of the corners of the program, the first without load."""
    exact = np.pi * (3 * 2e-4 * 1e-3 / (4 * 4e6)) ** (2 / 3)
    cells = []
    for part in (0.1, 0.01):
        found = got(case(BALL, tmp_path), tmp_path, {"contact_area": part})
        cells.append(found.sizes["x"])
        assert float(found["contact_area"][-1]) == pytest.approx(exact, rel=part)
        one = stated(tmp_path, "contact_area")
        assert float(one["lower"][-1]) <= exact <= float(one["upper"][-1])
        assert float(one["upper"][-1] / one["value"][-1]) <= (1 + part) * (1 + 1e-12)
        assert found.attrs["tolerance"] == pytest.approx(min(part / 5, 0.01))
        assert one["time"].values.tolist() == [0.0, 0.01]
        assert np.isnan(one["lower"][0])
    assert cells[0] < cells[1]


def test_choice__is_a_case_like_any_other(tmp_path, monkeypatch):
    found = got(case(ROUGH, tmp_path), tmp_path, {"mean_gap": "2 %"})
    chosen = Case.from_json(found.attrs["case"])
    assert not chosen.is_to_be_chosen
    assert chosen.key == found.attrs["case_key"]
    assert set(chosen.varied) == {"surface.band_limit", "solve.tolerance"}
    assert chosen.solving().tolerance == pytest.approx(0.004)
    monkeypatch.setattr("roughvisc.study.execution.run.compute", None)
    again = rv.run(chosen, tmp_path / "results", progress=False)
    xr.testing.assert_identical(again.drop_attrs(), found.drop_attrs())
    assert again.encoding["source"] == found.encoding["source"]
    same = got(case(ROUGH, tmp_path), tmp_path, {"mean_gap": "2 %"})
    assert same.attrs["choice"] == found.attrs["choice"]


@pytest.mark.thorough
def test_choice__is_where_the_rule_of_three_grids_first_fits(tmp_path):
    """Of a gap: the larger of the last change and a quarter of the one before."""
    study, cells = case(ROUGH, tmp_path), [[7, 6], [14, 12], [27, 25], [54, 50], [108, 100]]
    found = got(study, tmp_path, {"mean_gap": "0.3 %"})
    gaps = []
    for shape in cells:
        one = rv.vary(study, {"surface.band_limit": shape, "solve.tolerance": 6e-4})
        gaps.append(np.log(rv.run(one, tmp_path / "check", progress=False)["mean_gap"].values))
    last, before = np.abs(np.diff(gaps, axis=0))[1:], np.abs(np.diff(gaps, axis=0))[:-1]
    errors = np.maximum(last, before / 4).max(axis=1)
    fits = [shape[0] for shape, error in zip(cells[2:], errors, strict=True) if error < np.log(1.003)]
    assert len(fits) < 3
    assert found.sizes["x"] == fits[0]
    half = float(stated(tmp_path, "mean_gap")["half_width"].sel(source="grid").max())
    assert half == pytest.approx(errors[[shape[0] for shape in cells[2:]].index(fits[0])], rel=1e-3)


def test_floor__above_the_target_is_refused_with_what_would_help(tmp_path):
    """The approach of a Hertz contact goes with the modulus to the power -2/3."""
    with pytest.raises(InputError) as refused:
        got(case(BALL, tmp_path), tmp_path, {"approach": "1 %", "modulus_error": "10 %"})
    first, second = str(refused.value).splitlines()
    error, known = (float(re.findall(r"±([\d.]+) %", line)[1]) / 100 for line in (first, second))
    assert error == pytest.approx(1.1 ** (2 / 3) - 1, rel=0.1)
    assert known == pytest.approx(1.01**1.5 - 1, rel=0.1)
    assert "want.approach: found ±1 %: its error is" in first
    assert "whatever the grid" in first
    assert second.startswith("  modulus: ")
    assert sorted(path.name for path in (tmp_path / "results").iterdir()) == ["budget"]


def test_floor__of_one_scan_asks_for_so_many(tmp_path):
    rv.save_scan(rv.self_affine(1e-3, (20, 18), hurst=0.8, rms_slope=0.2, rolloff=3e-4, seed=3), tmp_path / "scan.x3p")
    recipe = ROUGH[ROUGH.index("generate") : ROUGH.index("[material]")]
    text = ROUGH.replace(recipe, 'file = "scan.x3p"\nmirror = true\n') + '[solve]\nboundary = "periodic"\n'
    study = case(text, tmp_path, **{"solve.tolerance": 2e-3})
    with pytest.raises(InputError, match="scans would help") as refused:
        got(study, tmp_path, {"mean_gap": "1 %", "population": "ensemble"})
    folder = tmp_path / "results" / "budget"
    found = budgets(study, ["mean_gap"], known={"population": "ensemble"}, out=folder, workers=0, progress=False)
    half = float(found["mean_gap"]["half_width"].sel(source="sample").max())
    told = next(line for line in str(refused.value).splitlines() if "sample" in line)
    assert int(re.search(r"(\d+) scans", told)[1]) == pytest.approx((half / np.log(1.01)) ** 2, rel=0.05)


def test_indenter__has_no_floor_by_sample_and_waves(tmp_path):
    plain = got(case(BALL, tmp_path), tmp_path, {"force": "10 %"})
    told = got(case(BALL, tmp_path), tmp_path, {"force": "10 %", "population": "ensemble", "cutoff": "1 um"})
    assert told.attrs["case_key"] == plain.attrs["case_key"]
    states = stated(tmp_path, "force")["state"]
    assert [str(states.sel(source=name).values) for name in ("sample", "next octave of waves")] == ["none"] * 2


def test_time__gives_the_best_within_it(tmp_path, monkeypatch):
    """A solve takes a second for each cell: four times that of the last grid is expected of the next."""
    read = Bench._read
    a_second_each = lambda self, one, case: replace(read(self, one, case), seconds=float(one["height"].size))  # noqa: E731
    monkeypatch.setattr(Bench, "_read", a_second_each)
    spent = 13 * 13 + 27 * 25 + 51 * 49 + 103 * 99
    for time, cells in (("1 d", 205), (spent + 4.2 * 103 * 99, 205), (spent + 3.9 * 103 * 99, 103)):
        assert got(case(BALL, tmp_path), tmp_path, {"time": time}).sizes["x"] == cells
    with pytest.raises(InputError, match=r"want\.time: found 1e-06 s: expected some .* s at least, for the coarsest"):
        got(case(BALL, tmp_path), tmp_path, {"time": 1e-6})
    with pytest.raises(InputError, match=r"want\.time: found 1e-06 s"):
        got(case(BALL, tmp_path), tmp_path, {"time": 1e-6, "contact_area": "5 %"})


def test_target__that_even_the_finest_grid_misses_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"at least, with cells a quarter as long as those of the study\n  grid: ±"):
        got(case(BALL, tmp_path), tmp_path, {"contact_area": 1e-4})
    assert max(shape[0] for shape in shapes(tmp_path)) == 103  # since the next cannot be better than a quarter of it


def test_closed_gap__has_no_relative_error(tmp_path):
    study = case(ROUGH, tmp_path, **{"program.0.pressure": "3 MPa"})
    with pytest.raises(InputError, match="leak_rate: found zero, or less, at t = 10 ms"):
        got(study, tmp_path, {"leak_rate": "10 %"})


@pytest.mark.thorough
def test_tolerance__is_sharpened_where_steps_and_solver_take_much_of_the_target(tmp_path):
    """A leak rate changes by up to six times as much as the mean gap, of which the steps leave a part."""
    study = case(ROUGH, tmp_path, **{"program.0.over": "10 ms", "program.0.pressure": "100 kPa"})
    told = []
    for part in (0.9, 0.01):
        bench = Bench([QUANTITIES["leak_rate"]], tmp_path / "budget", Monitor, told.append)
        tolerance = tolerance_for(study, {"leak_rate": part})
        around = first_grids(study, bench, {"leak_rate": part}, np.inf)
        half = float(around.solves[0].stated["leak_rate"].max())
        assert (around.asked.variants.case.solving().tolerance < tolerance) == (part == 0.01)
        assert half < 0.5 * np.log1p(part)


@pytest.mark.parametrize(
    ("texts", "want"),
    [
        (["1 % mean_gap", "60 s"], {"mean_gap": "1 %", "time": "60 s"}),
        (["0.02 force"], {"force": "0.02"}),
        (["60 s force", "1% force"], {"time": "60 s", "force": "1%"}),
    ],
)
def test_targets__are_read(texts, want):
    assert parse_targets(texts) == want


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["1 % frobnication"], "'frobnication' is no number that a budget knows: expected one of contact_area"),
        (["1 % mean_gp"], "did you mean 'mean_gap'"),
        (["1"], "found '1': expected a target such as"),
        (["1 %"], "found '1 %': expected a target such as"),
        (["60"], "found '60': expected a target such as"),
        (["3 kg mean_gap"], "expected a target such as"),
        (["1 % force", "2 % force"], "found '2 % force' beside another target for force"),
    ],
)
def test_targets__that_are_none_are_refused(texts, message):
    with pytest.raises(InputError, match=message):
        parse_targets(texts)


@pytest.mark.parametrize(
    ("want", "message"),
    [
        ({"frobnication": "1 %"}, r"want\.frobnication: unknown key"),
        ({"mean_gap": "0 %"}, r"want\.mean_gap: found '0 %': expected 'best', or a part of one above 0"),
        ({"mean_gap": "best"}, r"want\.mean_gap: found 'best' without a time"),
        ({"friction_coefficient": "1 %"}, "expected a study in which the surface slides"),
        ({"cutoff": "1 um"}, "expected a target such as"),
        ("1 %", "expected a dictionary such as"),
    ],
)
def test_want__that_is_none_is_refused(tmp_path, want, message):
    with pytest.raises(InputError, match=message):
        got(case(BALL, tmp_path), tmp_path, want)
    assert not (tmp_path / "results").exists()


def test_sweep__has_no_target(tmp_path, invoke):
    study = BALL + '[sweep]\n"surface.radius" = ["1 mm", "2 mm"]\n[want]\nforce = "1 %"\n'
    (tmp_path / "study.toml").write_text(study)
    with pytest.raises(InputError, match="want: found a target in a sweep"):
        rv.sweep(tmp_path / "study.toml")
    status, _, complained = invoke("run", tmp_path / "study.toml")
    assert status == 2
    assert "want: found a target beside a sweep of 2 cases" in complained
    assert not (tmp_path / "results").exists()


def test_command__says_what_it_chose_and_ends_with_the_budget(tmp_path, invoke):
    (tmp_path / "study.toml").write_text(BALL + '[want]\nmodulus_error = "1 %"\n')
    status, said, complained = invoke("run", tmp_path / "study.toml", "--for", "10 % contact_area", "--no-plots")
    assert status == 0, complained
    assert (
        said.index("Chosen\n  grid: ")
        < said.index("Result: ")
        < said.index("next octave of waves")
        < said.index("Budget: ")
    )
    assert "contact_area ±" in said
    assert "wanted ±10 %" in said
    assert "tolerance: 1e-2, ample for what is wanted" in said
    folder = tmp_path / "results" / "study"
    assert len(list(folder.glob("*.nc"))) == 1
    assert (folder / "budget" / "budget-contact_area.nc").exists()
    status, _, complained = invoke("run", tmp_path / "study.toml", "--for", "0.1 % approach", "--no-plots")
    assert status == 2
    assert "modulus: ±0.6" in complained
