"""The trade of what slides: a curve of friction, and a program with slides."""

import io
import json
import re

import numpy as np
import pytest
from rich.console import Console
from support import STUDY, case_of, labels, measured

import roughvisc as rv
from roughvisc.experiment.resources import PROCESS, curve_bytes
from roughvisc.study.statement.case import read_study
from roughvisc.study.trade import recommend
from roughvisc.study.trade.apply import apply
from roughvisc.study.trade.bench import NotRun, TimedRuns
from roughvisc.study.trade.ladder import Setting, ladder
from roughvisc.study.trade.reference import differences
from roughvisc.views.console.accuracy_tables import trade_table

WAVE = """
[surface]
generate = "wavy"
amplitude = "2 um"
wavelength = "1 mm"
size = "1 mm"
shape = [24, 2]
waves = 1
[material]
model = "zener"
shear_modulus = "1 MPa"
kelvin_modulus = "0.3 MPa"
kelvin_viscosity = "0.3 kPa s"
[solve]
boundary = "periodic"
"""
CURVE = """title = "Sliding"
[surface]
generate = "self_affine"
size = ["1 mm", "0.8 mm"]
shape = [26, 21]
hurst = 0.8
rms_slope = 0.1
rolloff = "0.5 mm"
shortcut = "0.16 mm"
seed = 1
[material]
model = "zener"
shear_modulus = "1 MPa"
kelvin_modulus = "0.3 MPa"
kelvin_viscosity = "0.3 kPa s"
[friction]
pressure = "20 kPa"
speeds = ["5 mm/s", "0.2 m/s"]
[solve]
boundary = "periodic"      # it repeats
"""
SLIDES = (
    WAVE
    + """
[[program]]
pressure = "10 kPa"
over = "1 ms"
[[program]]
slide = "1 mm"
speed = "0.1 m/s"
[[program]]
hold = "2 ms"
"""
)
FRICTION, AREA = "friction_coefficient", "contact_area"


def errors_of(ds, name):
    return ds.error.sel(quantity=name).values


def test_friction__errors_are_those_against_its_finest_run(tmp_path):
    case = case_of(tmp_path, CURVE)
    settings = Setting(0.1), Setting(0.01), Setting(1e-3, coarsening=2.0)
    ds = measured(case, *settings)
    assert set(ds.quantity.values) == {"pressure", "approach", AREA, "contact_area_counted", "mean_gap", FRICTION}
    assert set(ds.reference.values) == {"finest run: tolerance = 2e-4"}

    def curve(height, tolerance):
        return rv.friction(
            height, case.material(), pressure=2e4, speeds=[5e-3, 0.2], tolerance=tolerance, progress=False
        )

    fine = curve(case.height(), 2e-4)
    few = rv.band_limit(case.height(), (13, 10), periodic=True)
    runs = [curve(case.height(), 0.1), curve(case.height(), 0.01), curve(few, 1e-3)]
    for name in (FRICTION, AREA, "approach", "mean_gap"):
        expected = [float(abs(run[name] - fine[name]).max() / fine[name].max()) for run in runs]
        assert errors_of(ds, name) == pytest.approx(expected, rel=1e-9), name
    assert (ds.error.sel(quantity="pressure") > 0).all()
    assert ds.transforms.values.tolist() == [int(run.convolutions.sum()) for run in runs]
    assert ds.steps.values.tolist() == [2, 2, 2]
    assert float(ds.peak_memory[0]) == PROCESS + curve_bytes(case.solving(), 26 * 21)
    assert ds.attrs["rows"] == "speeds"


def test_friction__uncertainty_of_the_finest_run_holds_its_true_error(tmp_path):
    """Of a wave, against eight times as many cells."""
    case = case_of(tmp_path, WAVE + '[friction]\npressure = "10 kPa"\nspeeds = ["30 mm/s", "0.3 m/s"]\n')
    ds = measured(case, Setting(1e-3))
    wave = {"amplitude": 2e-6, "wavelength": 1e-3, "size": (1e-3, 1e-3), "waves": 1}
    fine, found = (
        rv.friction(
            rv.wavy(shape=(cells, 2), **wave),
            case.material(),
            pressure=1e4,
            speeds=[0.03, 0.3],
            tolerance=2e-4,
            progress=False,
        )
        for cells in (192, 24)
    )
    for name in (FRICTION, AREA, "approach", "mean_gap"):
        true = float(abs(found[name] - fine[name]).max() / fine[name].max())
        unsure = recommend.uncertainty(ds, name)
        assert 0.3 * true < unsure < 1, name
    assert recommend.uncertainty(ds, FRICTION) > float(abs(found[FRICTION] / fine[FRICTION] - 1).max())


def test_ladder__has_the_settings_that_the_experiment_has(tmp_path):
    curve = case_of(tmp_path, CURVE)
    assert {one.family for one in ladder(curve, (48, 48))} == {"tolerance", "coarser grid", "rounded fields"}
    with_steps = {one.family for one in ladder(case_of(tmp_path, SLIDES), (48, 48))}
    assert {"fixed steps", "direct history", "finer grid"} <= with_steps
    ds = measured(curve, Setting(0.1), Setting(time_step=0.1), Setting(0.1, memory="direct"))
    assert ds.note[0] == ""
    assert "solve.time_step: found 0.1: steady sliding has none" in ds.note[1].item()
    assert "solve.memory: found 'direct': steady sliding has none" in ds.note[2].item()


@pytest.mark.parametrize(("times", "least"), [('"all"', 1), pytest.param("20", 3, marks=pytest.mark.thorough)])
def test_slides__are_compared_where_whole_cells_of_all_grids_are_behind(tmp_path, times, least):
    """24 cells and 12 of a wave, for its finest run's accuracy 6 too."""
    ds = measured(case_of(tmp_path, SLIDES + f"[keep]\ntimes = {times}\n"), Setting(0.1), Setting(1e-2, coarsening=2.0))
    assert not any(ds.note.values)
    assert np.isfinite(ds.error).all()
    kept = np.array(json.loads(ds.attrs["case"])["keep"]["times"])
    cells = (kept - 1e-3) / 1e-2 * 6
    inside = cells[(cells > 1e-9) & (cells < 6 - 1e-9)]
    assert len(inside) >= least
    assert inside == pytest.approx(np.round(inside), abs=1e-9)
    assert errors_of(ds, FRICTION)[0] < errors_of(ds, FRICTION)[1], "the coarser grid is the worse one"
    assert errors_of(ds, FRICTION)[1] < 0.1, "and not by another instant"


def test_slides__with_an_algorithm_that_knows_no_motion_say_so(tmp_path):
    ds = measured(case_of(tmp_path, SLIDES), Setting(0.1), Setting(0.1, time_step=1e-3, method="seed"))
    assert "does not model sliding" in ds.note[1].item()


def test_rows_at_other_places__are_not_compared():
    ball, rubber = rv.sphere(1e-3, 2e-4, (15, 13)), rv.zener(3e6, 1e6, 1e5)
    press = rv.Program().load(1e-4, over=0).hold(0.5)
    one, other = (rv.simulate(ball, rubber, press, times=[0, at], progress=False) for at in (0.4, 0.5))
    with pytest.raises(NotRun, match="its kept times are others than those of the run to measure it against"):
        differences(one, other, [AREA])
    assert differences(one, one, [AREA, FRICTION])[AREA] == 0
    assert np.isnan(differences(one, one, [AREA, FRICTION])[FRICTION]), "none of them holds it"


def test_table_and_figure__put_friction_first(tmp_path):
    ds = measured(case_of(tmp_path, CURVE), Setting(0.1), Setting(0.01))
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(trade_table(ds))
    text = console.export_text()
    words = re.sub(r"\s+", " ", text)
    (heading,) = (line for line in text.splitlines() if "transf." in line)
    assert heading.split()[-4:] == ["friction", "pressure", "approach", "area"]
    assert "worst of all speeds. * Pareto-optimal for friction coefficient" in words
    assert "For 1 % on friction coefficient" in words
    shown = [label for label in labels(rv.plot.trade(ds)) if label.startswith("Error")]
    assert shown == ["Error of friction coefficient [%]", "Error of contact area [%]"]
    assert [label for label in labels(rv.plot.trade(ds, ["mean_gap"])) if label.startswith("Error")] == [
        "Error of mean gap [%]"
    ]


def test_advice__on_a_curve_can_be_applied_and_run(tmp_path):
    ds = measured(case_of(tmp_path, CURVE), Setting(0.1), Setting(0.01))
    index = recommend.cheapest(ds, FRICTION, 0.05)
    assert apply(tmp_path / "study.toml", recommend.keys_of(ds, index)).startswith("solve.tolerance = ")
    case = read_study(tmp_path / "study.toml")
    assert case.settings.solve.tolerance == float(ds.tolerance[index])
    fine = rv.friction(case.height(), case.material(), pressure=2e4, speeds=[5e-3, 0.2], tolerance=1e-4, progress=False)
    advised = rv.run(tmp_path / "study.toml", tmp_path / "out", progress=False)
    assert float(abs(advised[FRICTION] - fine[FRICTION]).max() / fine[FRICTION].max()) < 0.05


@pytest.mark.thorough
def test_command__applies_what_it_advises_on_friction(invoke, tmp_path, monkeypatch):
    monkeypatch.setattr("roughvisc.study.trade.trade.ladder", lambda case, shape: [Setting(0.1), Setting(0.01)])
    timed = TimedRuns._timed
    monkeypatch.setattr(
        TimedRuns, "_timed", lambda *given: (1e-3 / given[1].settings.solve.tolerance, *timed(*given)[1:])
    )
    (tmp_path / "slide.toml").write_text(CURVE)
    status, out, err = invoke("trade", "slide.toml", "--apply", "5%", "--quantity", FRICTION)
    assert (status, err) == (0, "")
    (advised,) = re.findall(r"slide\.toml: solve\.tolerance = (0\.1|0\.01)\b", out)
    text = (tmp_path / "slide.toml").read_text()
    assert f"tolerance = {advised}\n" in text
    assert "# it repeats" in text
    folder = tmp_path / "results" / "slide-trade"
    assert sorted(one.name for one in folder.iterdir()) == ["trade.nc", "trade.png"]
    assert invoke("plot", folder / "trade.nc")[0] == 0


def test_command__refuses_friction_of_what_does_not_slide_before_anything_runs(invoke, tmp_path):
    (tmp_path / "ball.toml").write_text(STUDY)
    status, out, err = invoke("trade", "ball.toml", "--quantity", FRICTION)
    assert (status, out) == (2, "")
    assert "--quantity: found 'friction_coefficient': expected one of pressure, approach, contact_area" in err
    assert not (tmp_path / "results").exists()


def test_progress__tells_the_setting_and_the_speeds(tmp_path):
    told = []
    measured(case_of(tmp_path, CURVE), Setting(0.1), progress=lambda *report: told.append(report))
    assert ("tolerance = 1e-1", 2.0, 2.0) in told
