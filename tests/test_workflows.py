"""Every study that ships runs, and ends with an honest result."""

import importlib
import pathlib

import numpy as np
import pytest
from support import at_rows

from roughvisc.api import run
from roughvisc.observables import history
from roughvisc.study.case import read_cases, read_study, vary

FOLDER = pathlib.Path(__file__).parents[1] / "workflows"
#: But the map of extremes, whose script holds each case against its closed form, the seal, run by its script, the curve
#: of friction, the slide, where contact shrinks, and the tack, where it ends.
APART = ("stability_map", "creeping_seal", "friction", "stop_and_go", "tack")
STUDIES = sorted(path for path in FOLDER.glob("*.toml") if path.stem not in APART)


@pytest.mark.parametrize(
    "path",
    [
        path if path.stem in ("quickstart", "load_sweep") else pytest.param(path, marks=pytest.mark.thorough)
        for path in STUDIES
    ],
    ids=lambda p: p.stem,
)
def test_study__runs(path, tmp_path):
    for case in read_cases(path):
        ds = run(case, tmp_path, progress=False)
        assert float(ds.force[-1]) > 0
        assert (np.diff(ds.contact_area) >= 0).all(), "under a load that is held, the contact grows"
        assert float(at_rows(ds).time_error.max()) <= 1.1 * case.settings.tolerance
        assert 0.01 < float(ds.contact_fraction[-1]) < 0.6


@pytest.fixture
def script(monkeypatch):
    """What imports a script of a folder of the workflows."""
    for folder in (FOLDER / "benchmarks", FOLDER):
        monkeypatch.syspath_prepend(str(folder))
    return importlib.import_module


def test_stop_and_go__has_a_peak_after_the_rest(tmp_path):
    (case,) = read_cases(FOLDER / "stop_and_go.toml")
    ds = run(vary(case, {"surface.shape": (50, 40), "keep.fields": ()}), tmp_path, progress=False)
    steps = history(ds)
    ends = steps.friction_coefficient.sel(time=case.program.corners[2:5:2], method="nearest").values
    assert ends == pytest.approx([ends[1]] * 2, rel=0.01), "both strokes along x settle at one friction"
    again = steps.friction_coefficient.where((steps.time > 12.1e-3) & (steps.time < 18e-3), drop=True)
    first = steps.friction_coefficient.where(steps.time < 7e-3, drop=True)
    assert first.max() < 1.02 * ends[0]
    assert again.max() > 1.04 * ends[0], "contact has grown in the rest"


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["maxwell_step", "zener_step"])
def test_verification_script__draws_profiles_on_the_closed_form(name, tmp_path, script):
    for axes in script(name).main(cells=41, figure=tmp_path / "figure.png").axes:
        for line, points in zip(axes.lines[::2], axes.lines[1::2], strict=True):
            r, p = points.get_data()
            inside = r < 0.8 * line.get_xdata()[np.flatnonzero(line.get_ydata())[-1]]
            assert np.asarray(p)[inside] == pytest.approx(np.interp(r[inside], *line.get_data()), rel=0.03)


@pytest.mark.thorough
def test_moving_line__needs_the_work_of_the_theory(tmp_path, script):
    """A line that recedes needs more than the work of adhesion, one that advances gains less."""
    rows = script("moving_line").main(tmp_path / "line.png", speeds=(0.1, 1.0), holds=(0.1, 10.0), cells=48)
    for name, _, work, theory in rows[:2]:
        assert work == pytest.approx(theory, rel=0.3), name
    slow, fast = (row[2][1] / row[2][0] for row in rows[2:])
    assert slow < 1.1, "a slow pull-off does not depend on the hold"
    assert fast > 1.2


def test_thin_sheet__is_stiffer_than_a_half_space_the_more_the_deeper_the_ball(tmp_path, script):
    lines = script("thin_sheet").main(cells=21, figure=tmp_path / "figure.png").axes[0].lines
    ratio = {line.get_label(): line.get_ydata() for line in lines}["computed"]
    assert (np.diff(ratio, prepend=1.0) > 0).all()


@pytest.mark.thorough
def test_coating__that_is_thicker_has_more_contact(tmp_path, script):
    figure = script("coating").main(cells=20, figure=tmp_path / "figure.png", speeds=[1e-2, 1.0])
    area = np.array([line.get_ydata() for line in figure.axes[2].lines])
    assert (np.diff(area, axis=0) > 0).all()


@pytest.mark.thorough
def test_stability_map__is_right_everywhere(tmp_path, script):
    found = script("stability_map").main(tmp_path / "map.png", every=2)
    assert float(found.duration.max() / found.duration.min()) == pytest.approx(1e24)
    assert (found.error < 1e-3).all(), "none refused, and the tolerance kept"


def test_friction__rises_and_falls_as_the_rubber_stiffens(tmp_path):
    small = {"surface.shape": 48, "surface.shortcut": 8 * 2e-3 / 48, "keep.fields": []}
    curve = run(vary(read_study(FOLDER / "friction.toml"), small), tmp_path, progress=False)
    assert curve.speed.size == 13
    assert (curve.status == 0).all()
    friction = curve.friction_coefficient.values
    most = int(friction.argmax())
    assert 0 < most < 12
    assert (np.diff(friction[: most + 1]) > 0).all()
    assert (np.diff(friction[most:]) < 0).all()
    assert (np.diff(curve.contact_area) < 0).all(), "the area falls with the speed"


@pytest.mark.thorough
def test_benchmarks__run_small(tmp_path, script):
    tables = script("run").main(small=True, out=tmp_path / "table.nc")
    assert (tmp_path / "table.nc").exists()
    for row in tables["paper"] + tables["tamaas"] + tables["contact_mechanics"]:
        assert row["error"] <= row["peer_error"]


@pytest.mark.thorough
def test_accuracy__of_random_cases_is_judged(tmp_path, script):
    module = script("accuracy")
    ds, _ = module.main(3, first=10, out=tmp_path / "accuracy.nc", processes=0)
    assert (ds.status == "ok").all()
    worst = ds.worst_error_over_tolerance.sel(quantity="pressure")
    assert (worst <= 1).all()
    assert (worst > 1e-4).all(), "the reference is another run"
    (late,) = module.judge(1, 12, time_limit=0.01)
    assert late["status"].startswith("run: TimeoutError"), "reported, not dropped"


def test_closed_forms__are_within_what_rows_state(script):
    kinds = ["cells-many", "slides", "work-approach", "work-load", "friction", "channels"]
    rates = script("closed_forms").main(kinds, scenes=3, seed=1)
    assert rates["friction"]["rows"] == 54
    bad, rows = (sum(kind[name] for kind in rates.values()) for name in ("bad", "rows"))
    assert bad <= 0.01 * rows
    for kind in rates:
        assert rates[kind]["stated/true"] >= 1
    assert all(rates[kind]["stated/true"] < 10 for kind in ("cells-many", "slides", "friction", "channels"))


@pytest.mark.thorough
def test_grid_accuracy__is_what_the_docs_say(script):
    for row in script("grid_accuracy").main(small=True):
        assert row["bounded"] >= (2 / 3 if row["quantity"] == "area" else 1)
        assert row["middle"] > 0.8
        # one coarser solve overstates; a force shares its number with pressure and approach
        assert row["middle"] < 20 or row["quantity"] == "force"


@pytest.mark.thorough
def test_scan_to_area__grows_with_time_and_load(tmp_path, script):
    coarse = {"surface.resample": [96, 84], "solve.tolerance": 5e-3}
    figure = script("scan_to_area").main(tmp_path, coarse)
    areas = np.array([line.get_ydata() for line in figure.axes[0].lines[:5]])
    assert areas.shape == (5, 3)
    assert (np.diff(areas, axis=0) > 0).all()
    assert (np.diff(areas, axis=1) > 0).all()
    ds = run(vary(read_cases(FOLDER / "scan_to_area.toml")[0], coarse), tmp_path, progress=False)
    np.testing.assert_allclose(ds.contact_area[[0, -1]] * 1e6, areas[[0, -1], 0], rtol=0.01)  # the axis is in mm2


@pytest.mark.thorough
def test_creeping_seal__leaks_less_and_less_until_it_closes(tmp_path, script):
    rate = script("creeping_seal").main(tmp_path / "seal.png").leak_rate.values
    last = int(np.flatnonzero(rate)[-1])
    assert (np.diff(rate[: last + 1]) < 0).all(), "under a load that is held, the channels narrow"
    assert not rate[last + 1 :].any(), "what is closed stays closed"
    assert rate[0] / rate[last] > 1e5


def test_rolling__is_that_of_contact(script):
    for row in script("measured_and_computed").rolling().values():
        assert row["peak [MPa]"] == pytest.approx(row["peak by CONTACT [MPa]"], rel=2e-3)
        assert row["cells"] == pytest.approx(row["cells by CONTACT"])


@pytest.mark.thorough
def test_records__are_computed_as_the_page_says(tmp_path, script):
    module = script("measured_and_computed")
    found = module.brain(tmp_path / "brain.png")
    assert found["searched"]["misfit"] < 3e-3
    retraction = module.brain_retraction()
    assert retraction["without adhesion"]["rms in hold [nN]"] < 0.05
    with_adhesion = list(retraction.values())[-1]
    assert with_adhesion["least force [nN]"] == pytest.approx(retraction["least force, measured [nN]"], rel=0.01)
    for choice in list(module.cell(tmp_path / "cell.png").values())[1:]:
        assert choice["rms in predicted hold [nN]"] < 10
