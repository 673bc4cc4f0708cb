"""Every study that ships runs, and ends with an honest result."""

import importlib
import pathlib

import numpy as np
import pytest
import xarray as xr

from roughvisc.study.execution.single import run
from roughvisc.study.statement.case import read_cases, vary

FOLDER = pathlib.Path(__file__).parents[1] / "workflows"
#: But the map of extremes, whose script holds each case against its closed form.
STUDIES = sorted(path for path in FOLDER.glob("*.toml") if path.stem != "stability_map")


@pytest.mark.parametrize("path", STUDIES, ids=lambda p: p.stem)
def test_study__runs(path, tmp_path):
    for case in read_cases(path):
        ds = run(case, tmp_path, progress=False)
        assert float(ds.force[-1]) > 0
        assert (np.diff(ds.contact_area) >= 0).all(), "under a load that is held, the contact grows"
        assert float(ds.time_error.max()) <= case.settings.solve.tolerance
        assert 0.01 < float(ds.contact_fraction[-1]) < 0.6


@pytest.mark.parametrize("name", ["maxwell_step", "zener_step"])
def test_validation_script__draws_profiles_on_the_closed_form(name, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    figure = importlib.import_module(name).main(cells=41, figure=tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    for axes in figure.axes:
        exact, computed = axes.lines[::2], axes.lines[1::2]
        assert len(exact) == len(computed) == 4
        assert "p / p_H" in axes.get_ylabel()
        for line, points in zip(exact, computed, strict=True):
            r, p = points.get_data()
            inside = r < 0.8 * line.get_xdata()[np.flatnonzero(line.get_ydata())[-1]]
            assert np.asarray(p)[inside] == pytest.approx(np.interp(r[inside], *line.get_data()), rel=0.03)


def test_thin_sheet__has_computed_forces_on_the_integral_equation(tmp_path, monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(FOLDER))
    figure = importlib.import_module("thin_sheet").main(cells=21, figure=tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    ratio, deviation = ({line.get_label(): line.get_data() for line in axes.lines} for axes in figure.axes)
    at, computed = ratio["computed"]
    exact = np.interp(at, *ratio["integral equation"])
    np.testing.assert_allclose(computed, exact, rtol=5e-3)
    np.testing.assert_allclose(deviation["computed"][1], 100 * (computed / exact - 1), atol=1e-9)
    off = np.interp([0.5, 1.0], *deviation["Dimitriadis et al. (2002)"])
    np.testing.assert_allclose(off, [-8, -16], atol=0.5)
    assert len(capsys.readouterr().out.splitlines()) == len(at), "the table"


def test_stability_map__is_right_everywhere(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    found = importlib.import_module("stability_map").main(tmp_path / "map.png", every=2)
    assert (tmp_path / "map.png").stat().st_size > 10_000
    assert found.error.shape == (5, 5)
    assert float(found.duration.max() / found.duration.min()) == pytest.approx(1e24)
    assert (found.error < 1e-3).all(), "none refused, and the tolerance kept"


def test_friction_curve__rises_and_falls_as_the_rubber_stiffens(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    module = importlib.import_module("friction_curve")
    curve = module.main(48, tmp_path / "curve.png", tmp_path / "curve.nc")
    assert (tmp_path / "curve.png").stat().st_size > 10_000
    assert curve.speed.size == 13
    assert (curve.status == 0).all()
    friction = curve.friction_coefficient.values
    most = int(friction.argmax())
    assert 0 < most < 12
    assert (np.diff(friction[: most + 1]) > 0).all()
    assert (np.diff(friction[most:]) < 0).all()
    assert (np.diff(curve.contact_area_corrected) < 0).all(), "the area falls with the speed"
    assert ((curve.last_octave_friction > 0) & (curve.last_octave_friction < 1)).all()
    assert (curve.last_octave_area < 0).all(), "finer roughness takes area away"
    with xr.open_dataset(tmp_path / "curve.nc") as stored:
        assert stored.identical(curve)


def test_benchmarks__run_small(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER / "benchmarks"))
    tables = importlib.import_module("run").main(small=True, out=tmp_path / "table.nc")
    assert (tmp_path / "table.nc").exists()
    for row in tables["seed"] + tables["tamaas"] + tables["contact_mechanics"]:
        assert row["error"] <= row["peer_error"]
    scaled, followed = tables["scaling"][:-4], tables["scaling"][-4:]
    assert all(0 < row["transform_share"] < 1 for row in scaled)
    assert all(row["error"] < 1e-3 for row in followed)
    assert len({row["seconds"] for row in followed}) == 4
    swept, stored = tables["sweep"][:1], tables["sweep"][1:]
    assert all(0 < row["busy"] <= 1 for row in swept)
    assert len(stored) == 2
    assert all(0 < row["storing"] < 1 for row in stored)


def test_tolerance_matrix__is_kept_by_a_zener_material(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER / "benchmarks"))
    module = importlib.import_module("tolerance_matrix")
    ds = module.main(tmp_path / "t.nc", tmp_path / "t.png", materials=("Zener 1:1",), tolerances=(1e-2,), workers=0)
    assert ds.error_over_tolerance.shape == (1, 7, 1)
    assert (ds.error_over_tolerance <= 1).all()
    assert (ds.error_over_tolerance > 1e-3).all(), "the reference is another run"
    assert (tmp_path / "t.png").exists()


def test_accuracy__of_random_cases_is_judged_and_resumed(tmp_path, monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(FOLDER / "benchmarks"))
    module = importlib.import_module("accuracy")
    ds, _ = module.main(3, first=10, out=tmp_path / "accuracy.nc", processes=0)
    assert (ds.status == "ok").all()
    assert (ds.rows.sel(quantity="pressure") >= 8).all()
    worst = ds.worst_error_over_tolerance.sel(quantity="pressure")
    assert (worst <= 1).all()
    assert (worst > 1e-4).all(), "the reference is another run"
    again, _ = module.main(3, first=10, out=tmp_path / "accuracy.nc", processes=0)
    assert again.identical(ds), "cases in the record are taken from there"
    assert "3 cases taken from" in capsys.readouterr().out
    late = module.judge(1, 12, time_limit=0.01)
    assert late["status"].startswith("run: TimeoutError"), "reported, not dropped"


def test_accuracy_cost__of_a_checkout_is_that_of_itself(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER / "benchmarks"))
    module = importlib.import_module("accuracy_cost")
    ratios = module.against(FOLDER.parent, 1, first=26, ladder=(3e-2, 1e-2))
    assert [ratio["convolutions"] for ratio in ratios] == [1.0]
    assert module.ratio(np.array([[1e-2, 10], [1e-4, 100]]), np.array([[1e-2, 20], [1e-4, 200]])) == pytest.approx(2)


def test_grid_accuracy__is_what_the_docs_say(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER / "benchmarks"))
    module = importlib.import_module("grid_accuracy")
    for row in module.main(small=True):
        assert row["cases"] >= 3
        assert row["bounded"] == 1
        assert row["bounded_area"] >= 2 / 3
        assert 0.8 < row["middle"] < 10
    for row in module.main(small=True, constants=True):
        assert -0.08 < row["least"] <= row["largest"] < 0.03


def test_scan_to_area__creeps_from_the_glassy_to_the_rubbery_contact(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    coarse = {"surface.resample": [96, 84], "solve.tolerance": 5e-3}
    figure = importlib.import_module("scan_to_area").main(tmp_path, coarse)
    assert (tmp_path / "area_against_load.png").stat().st_size > 10_000
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert list(lines) == [
        "elastic, glassy",
        "after 20 ms",
        "after 60 ms",
        "after 200 ms",
        "elastic, rubbery",
        "low loads, glassy",
        "low loads, rubbery",
    ]
    areas = np.array([line.get_ydata() for name, line in lines.items() if "low" not in name])
    assert areas.shape == (5, 3)
    assert (np.diff(areas, axis=0) > 0).all(), "the contact grows with time"
    assert (np.diff(areas, axis=1) > 0).all(), "and with load"
    results = [run(vary(case, coarse), tmp_path, progress=False) for case in read_cases(FOLDER / "scan_to_area.toml")]
    for i, ds in enumerate(results):
        ends = ds.contact_area_corrected[[0, -1]] * 1e6  # the axis is in mm2
        np.testing.assert_allclose(ends, areas[[0, -1], i], rtol=0.01)
        assert "filled" in ds.variables, "what was invented stays marked in the result"
