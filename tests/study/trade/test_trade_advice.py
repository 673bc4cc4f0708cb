"""What a trade advises, with made-up times; how advice gets into a study; the command and the figure."""

import io
import json
import tomllib

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_hex
from PIL import Image
from rich.console import Console
from support import ROUGH, STUDY, case_of, measured, numbers_told

import roughvisc as rv
from roughvisc.study.statement.case import read_study
from roughvisc.study.storage.store import write_dataset
from roughvisc.study.trade import recommend
from roughvisc.study.trade.apply import apply
from roughvisc.study.trade.bench import QUANTITIES
from roughvisc.study.trade.ladder import Setting
from roughvisc.views.console.accuracy_tables import trade_table
from roughvisc.views.figures.trade import _FAMILIES

AREA = "contact_area"
#: setting, wall time [s], error
MADE_UP = [
    (Setting(1e-1), 1.0, 0.05),
    (Setting(3e-2), 2.0, 0.009),
    (Setting(1e-2), 4.0, 0.004),
    (Setting(1e-3), 190.0, 0.0008),
    (Setting(1e-2, coarsening=2.0), 0.5, 0.006),
    (Setting(0.1, time_step=0.02), 3.0, 0.008),
    (Setting(1e-3, method="seed", time_step=0.02), 400.0, 0.02),
]


def made_up(rows=MADE_UP, unsure=0.0, grid_unsure=0.0, grid_is_data=0):
    """A trade in which all quantities have the errors given."""
    settings = [row[0] for row in rows]
    errors = np.array([row[2] for row in rows], float)[:, None] * np.ones(len(QUANTITIES))

    def column(name):
        return "setting", [np.nan if getattr(s, name) is None else getattr(s, name) for s in settings]

    coords = {
        "setting": [setting.label((96, 90)) for setting in settings],
        "quantity": list(QUANTITIES),
        "cells_x": ("setting", [96] * len(rows)),
        "cells_y": ("setting", [90] * len(rows)),
        **{name: column(name) for name in ("family", "method", "memory", "tolerance", "time_step", "coarsening")},
        "precision": column("precision"),
    }
    spent = np.array([row[1] for row in rows], float)
    variables = {
        "error": (("setting", "quantity"), errors),
        "coarsening_error": (("setting", "quantity"), np.where(coords["coarsening"][1] == 1, 0, errors.T / 2).T),
        "note": ("setting", ["" if np.isfinite(time) else "would take a day" for time in spent]),
        "reference": ("quantity", ["finest run"] * 5),
        "reference_time_uncertainty": ("quantity", [unsure] * 5),
        "reference_grid_uncertainty": ("quantity", [grid_unsure] * 5),
        **dict.fromkeys(("run_time", "transforms", "steps", "peak_memory", "disk_size"), ("setting", spent)),
    }
    ds = xr.Dataset(variables, coords, {"grid_is_data": grid_is_data, "title": "Made up"})
    return ds.assign_attrs(recommendation=recommend.recommendation(ds))


def cheapest(target, **options):
    index = recommend.cheapest(made_up(**options), AREA, target)
    return None if index is None else MADE_UP[index][0]


# ----------------------------------------------------------------------------------------------------------------
# advice


@pytest.mark.parametrize(
    ("target", "expected"),
    [(0.1, MADE_UP[4]), (0.01, MADE_UP[4]), (0.005, MADE_UP[2]), (0.001, MADE_UP[3]), (0.0005, (None,))],
)
def test_cheapest__is_the_fastest_that_is_accurate_enough(target, expected):
    assert cheapest(target) == expected[0]


def test_cheapest__keeps_the_grid_where_it_is_data():
    assert cheapest(0.01, grid_is_data=1) == MADE_UP[1][0]


def test_cheapest__counts_the_references_own_uncertainty():
    assert cheapest(0.01, unsure=0.005) == MADE_UP[2][0]
    assert cheapest(0.01, grid_unsure=0.005) == MADE_UP[2][0]
    assert cheapest(0.01, grid_unsure=0.005, grid_is_data=1) == MADE_UP[1][0], "that of a grid of data is no setting's"
    assert cheapest(0.01, unsure=np.nan) is None


def test_cheapest__does_not_trust_a_stroke_of_luck():
    lucky = [(Setting(1e-1), 1.0, 0.0001), *MADE_UP[1:4]]
    ds = made_up(lucky)
    assert recommend.cheapest(ds, AREA, 0.005) == 2, "the setting in between misses"
    assert recommend.cheapest(ds, AREA, 0.01) == 0, "all sharper ones keep this"


def test_cheapest__does_not_let_the_noise_of_a_clock_decide():
    alike = [(Setting(1e-3), 1.05, 0.001), (Setting(1e-3, memory="direct"), 1.0, 0.001)]
    assert recommend.cheapest(made_up(alike), AREA, 0.01) == 0
    slower = [(Setting(1e-3), 1.2, 0.001), alike[1]]
    assert recommend.cheapest(made_up(slower), AREA, 0.01) == 1


def test_cheapest__takes_none_that_was_not_measured():
    assert recommend.cheapest(made_up([(Setting(1e-2), np.nan, np.nan), MADE_UP[3]]), AREA, 0.01) == 1


def test_front__is_what_nothing_beats():
    assert np.flatnonzero(recommend.pareto_front(made_up(), AREA)).tolist() == [2, 3, 4]
    alike = [(Setting(1e-2), 1.0, 0.01), (Setting(1e-3), 2.0, 0.00999), (Setting(1e-4), 3.0, 0.009)]
    assert recommend.pareto_front(made_up(alike), AREA).tolist() == [True, False, True]


def test_words__name_setting_and_time():
    lines = made_up(MADE_UP[:4]).attrs["recommendation"].splitlines()
    assert lines[0] == "for 1 % on contact area use tolerance = 3e-2: 2 s; for 0.1 % tolerance = 1e-3: 3 min"
    assert len(lines) == 4
    assert "for 0.1 % the same" in made_up(MADE_UP[3:4]).attrs["recommendation"]


def test_words__say_what_is_short():
    text = made_up(MADE_UP[:2]).attrs["recommendation"].splitlines()[0]
    assert text.endswith("; for 0.1 %: no setting measured keeps it, tolerance = 3e-2 comes nearest with 0.9 %")
    text = made_up(MADE_UP[:1]).attrs["recommendation"].splitlines()[0]
    assert text.startswith("for 1 % or 0.1 % on contact area: no setting measured keeps it")
    text = made_up(unsure=0.02).attrs["recommendation"].splitlines()[0]
    assert text == "for 1 % or 0.1 % on contact area: not possible, the uncertainty of the finest run is 2 %"
    text = made_up(grid_unsure=0.4, grid_is_data=1).attrs["recommendation"].splitlines()[-1]
    assert "changes by 0.3 % on cells 2 times as long" in text
    assert text.endswith("leaves about 40 % of it unknown")


def test_table__shows_costs_errors_and_what_was_not_run():
    rows = [*MADE_UP[:4], (Setting(1e-3, method="seed", time_step=0.02), np.nan, np.nan)]
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(trade_table(made_up(rows)))
    text = console.export_text()
    assert "* tolerance = 3e-2" in text
    assert "Not run: method = seed, time_step = 20 ms: would take a day" in text
    assert "3 min" in text
    assert "For 1 % on contact area use tolerance = 3e-2: 2 s" in text
    assert all(len(line) <= 80 for line in text.splitlines())


# ----------------------------------------------------------------------------------------------------------------
# into the study

COMMENTED = """# how it was found
title = "A ball"       # what it is

[solve]                # how
tolerance = 1e-3       # the default
time_step = "5 ms"     # by hand

# what is kept
[keep]
times = 3
"""
REST = STUDY.split("[keep]")[0].split("\n", 2)[2]


def write(tmp_path, head):
    path = tmp_path / "study.toml"
    path.write_text(head + REST)
    return path


def applied(path, index, rows=MADE_UP):
    return apply(path, recommend.keys_of(made_up(rows), index))


def test_apply__changes_the_values_and_nothing_else(tmp_path):
    path = write(tmp_path, COMMENTED)
    before = path.read_text()
    assert applied(path, 1) == 'solve.tolerance = 3e-2, solve.time_step = "auto"'
    expected = before.replace("tolerance = 1e-3 ", "tolerance = 3e-2 ").replace('"5 ms"', '"auto"')
    assert path.read_text() == expected
    assert read_study(path).settings.solve.tolerance == 0.03
    assert applied(path, 1) == "", "once is enough"
    assert path.read_text() == expected


def test_apply__adds_what_is_not_there(tmp_path):
    path = write(tmp_path, COMMENTED.replace('time_step = "5 ms"     # by hand\n', ""))
    applied(path, 6)
    solve = read_study(path).settings.solve
    assert (solve.method, solve.time_step, solve.tolerance) == ("seed", 0.02, 1e-3)
    text = path.read_text()
    assert 'time_step = "20 ms"\n' in text
    assert text.index('method = "seed"') < text.index("# what is kept")
    assert text.count("#") == COMMENTED.count("#") - 1


def test_apply__without_what_tomlkit_keeps_to_itself(tmp_path, monkeypatch):
    monkeypatch.delattr("tomlkit.container.Container._insert_at")
    path = write(tmp_path, COMMENTED.replace('time_step = "5 ms"     # by hand\n', ""))
    applied(path, 6)
    solve = read_study(path).settings.solve
    assert (solve.method, solve.time_step) == ("seed", 0.02)
    assert path.read_text().count("#") == COMMENTED.count("#") - 1


def test_apply__makes_the_tables_that_are_missing(tmp_path):
    path = write(tmp_path, "")
    applied(path, 4)
    case = read_study(path)
    assert case.settings.solve.tolerance == 1e-2
    assert case.height().shape == (96, 90)
    assert path.read_text().startswith(REST.replace("shape = [33, 31]", "shape = [96, 90]").rstrip("\n"))
    dotted = write(tmp_path, "solve.tolerance = 1e-3  # sharp\n")
    applied(dotted, 1)
    assert "solve.tolerance = 3e-2  # sharp\n" in dotted.read_text()


@pytest.mark.parametrize("tables", [{"solve": {"tolerance": 7.0}}, {"solve": {"speed": 1}}])
def test_apply__leaves_a_study_that_it_would_break(tmp_path, tables):
    path = write(tmp_path, COMMENTED)
    with pytest.raises(rv.InputError, match=rf"^{path}: solve"):
        apply(path, tables)
    assert path.read_text() == COMMENTED + REST
    assert [p.name for p in tmp_path.iterdir()] == ["study.toml"]


def test_apply__follows_a_link_and_keeps_the_mode(tmp_path):
    path = write(tmp_path, COMMENTED)
    path.chmod(0o640)
    link = tmp_path / "link.toml"
    link.symlink_to(path)
    applied(link, 1)
    assert link.is_symlink()
    assert "3e-2" in path.read_text()
    assert path.stat().st_mode & 0o777 == 0o640


def test_apply__refuses_what_is_no_toml(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text("tolerance = = 3")
    with pytest.raises(rv.InputError, match=r"study\.toml: is not valid TOML"):
        apply(path, {"solve": {"tolerance": 0.1}})
    with pytest.raises(rv.InputError, match="cannot be read"):
        apply(tmp_path / "nowhere.toml", {"solve": {"tolerance": 0.1}})


# ----------------------------------------------------------------------------------------------------------------
# the command


def small(monkeypatch):
    rungs = [Setting(1e-1), Setting(1e-2), Setting(1e-2, coarsening=2.0)]
    monkeypatch.setattr("roughvisc.study.trade.trade.ladder", lambda case, shape: rungs)


def test_command__writes_its_files_and_advises(invoke, tmp_path, monkeypatch):
    small(monkeypatch)
    (tmp_path / "ball.toml").write_text(STUDY)
    status, out, err = invoke("trade", "ball.toml")
    assert (status, err) == (0, "")
    folder = tmp_path / "results" / "ball-trade"
    assert sorted(p.name for p in folder.iterdir()) == ["trade.nc", "trade.png"]
    for words in ("A ball", "tolerance = 1e-1", "17 x 17 cells", "Lee and Radok", "Trade: results/ball-trade/trade.nc"):
        assert words in out
    assert (tmp_path / "ball.toml").read_text() == STUDY, "nothing is applied unasked"


def test_command__applies_what_it_advises(invoke, tmp_path, monkeypatch):
    small(monkeypatch)
    (tmp_path / "ball.toml").write_text(STUDY)
    status, out, err = invoke("trade", "ball.toml", "--out", "there", "--apply", "30 %", "--quantity", "approach", "-q")
    assert (status, out, err) == (0, "", "")
    solve = tomllib.loads((tmp_path / "ball.toml").read_text())["solve"]
    assert solve["tolerance"] in (0.1, 0.01)
    assert "# a comment" in (tmp_path / "ball.toml").read_text()


def test_command__leaves_the_study_where_nothing_is_accurate_enough(invoke, tmp_path, monkeypatch):
    small(monkeypatch)
    (tmp_path / "ball.toml").write_text(STUDY)
    status, _, err = invoke("trade", "ball.toml", "--apply", "1e-9", "-q")
    assert status == 1
    assert "ball.toml: --apply 1e-9: no setting measured keeps it" in err
    assert (tmp_path / "ball.toml").read_text() == STUDY


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--apply", "200%"), "--apply: found '200%': expected a part such as 1%"),
        (("--apply", "much"), "--apply: found 'much'"),
        (("--quantity", "colour"), "--quantity: found 'colour': expected one of pressure"),
        (("--budget", "0"), "--budget: found '0': expected a time"),
        (("--budget", "3 m"), "--budget: found '3 m'"),
    ],
)
def test_command__refuses_wrong_options_before_anything_runs(invoke, tmp_path, options, words):
    (tmp_path / "ball.toml").write_text(STUDY)
    status, out, err = invoke("trade", "ball.toml", *options)
    assert (status, out) == (2, "")
    assert err.startswith("roughvisc: ")
    assert words in err
    assert len(err.splitlines()) == 1
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("tolerance", "toleranze"), "solve.toleranze: unknown key"),
        (("[solve]", '[sweep]\n"program.0.load" = [1, 2]\n[solve]'), "sweep: found 2 cases: expected one"),
    ],
)
def test_command__names_file_and_key_of_a_wrong_study(invoke, tmp_path, change, words):
    (tmp_path / "ball.toml").write_text((STUDY + "[solve]\ntolerance = 1e-2\n").replace(*change))
    status, _, err = invoke("trade", "ball.toml")
    assert status == 2
    assert "ball.toml" in err
    assert words in err


# ----------------------------------------------------------------------------------------------------------------
# the figure


def test_figure__has_a_marker_for_each_family_and_the_front_as_a_line():
    ds = made_up()
    figure = rv.plot.trade(ds, [AREA])
    (ax,) = figure.axes
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    lines = {line.get_label(): line for line in ax.lines}
    front = np.column_stack(lines["Pareto front"].get_data())
    assert front.tolist() == [[0.5, 0.6], [4.0, 0.4], [190.0, 0.08]]
    for family in ("tolerance", "coarser grid", "fixed steps", "seed paper's algorithm"):
        chosen = ds.family.values == family
        assert lines[family].get_xdata().tolist() == ds.run_time.values[chosen].tolist()
        assert lines[family].get_ydata() == pytest.approx(100 * ds.error.values[chosen, 0])
        assert (lines[family].get_marker(), to_hex(lines[family].get_color())) == _FAMILIES[family]
    looks = [_FAMILIES[family] for family in dict.fromkeys(ds.family.values)]
    assert len({marker for marker, _ in looks}) == len(looks)
    assert {text.get_text() for text in ax.texts} >= {"1e-1", "1e-2, 96×90", "20 ms"}
    assert ax.get_ylabel() == "Error of contact area [%]"


def test_figure__front_goes_through_measured_errors_only():
    (ax,) = rv.plot.trade(made_up(unsure=0.001), [AREA]).axes
    front = next(line for line in ax.lines if line.get_label() == "Pareto front")
    assert front.get_xydata().tolist() == [[0.5, 0.6], [4.0, 0.4]], "0.08 % is less than the reference knows"


def test_figure__labels_are_the_settings():
    ds = made_up()
    settings = np.where(np.isfinite(ds.time_step), ds.time_step, ds.tolerance)
    coarser = ds.coarsening.values != 1
    cells = [*ds.cells_x.values[coarser], *ds.cells_y.values[coarser]]
    assert numbers_told(rv.plot.trade(ds, [AREA])) == pytest.approx(sorted([*settings, *map(float, cells)]))


def test_figure__keeps_its_labels_apart():
    figure = rv.plot.trade(made_up())
    for ax in figure.axes:
        boxes = [text.get_window_extent() for text in ax.texts]
        assert len(boxes) == len(MADE_UP)
        assert not any(a.overlaps(b) for n, a in enumerate(boxes) for b in boxes[:n])
        assert all(ax.get_window_extent().padded(1).containsx(box.x1) for box in boxes)


def test_figure__shades_what_the_reference_cannot_tell_and_shows_no_difference_seen():
    ds = made_up([*MADE_UP[:3], (Setting(1e-3), 100.0, 0.0)], unsure=0.004)
    ax = rv.plot.trade(ds, ["pressure"]).axes[0]
    (band,) = ax.patches
    assert band.get_y() + band.get_height() == pytest.approx(0.4)
    assert "none seen" in {text.get_text() for text in ax.texts}
    shown = next(line for line in ax.lines if line.get_label() == "tolerance")
    assert (shown.get_ydata() > 0).all()


def test_figure__refuses_what_is_no_trade():
    with pytest.raises(rv.InputError, match=r"Dataset of rv\.trade"):
        rv.plot.trade(xr.Dataset())
    with pytest.raises(rv.InputError, match="quantities holds 'colour'"):
        rv.plot.trade(made_up(), ["colour"])
    with pytest.raises(rv.InputError, match="no measured setting"):
        rv.plot.trade(made_up([(Setting(1e-2), np.nan, np.nan)]))


def test_plot__draws_the_file_of_a_trade_and_a_folder_of_it(invoke, tmp_path):
    write_dataset(made_up(), tmp_path / "ball-trade" / "trade.nc")
    for target, out, said in (
        ("ball-trade/trade.nc", (), "ball-trade/trade.png"),
        ("ball-trade", ("--out", "figures"), "figures/trade.png"),
    ):
        assert invoke("plot", target, *out) == (0, f"Figure: {said}\n", "")
        with Image.open(tmp_path / said) as picture:
            assert picture.size[0] > 1000
    xr.Dataset({"run_time": ("setting", [1.0])}).to_netcdf(tmp_path / "other.nc")
    status, _, err = invoke("plot", "other.nc")
    assert status == 2
    assert "other.nc" in err


def test_advice__on_a_measured_scene_can_be_run(tmp_path):
    case = case_of(tmp_path, ROUGH)
    ds = measured(case, Setting(1e-1), Setting(1e-2))
    index = recommend.cheapest(ds, "approach", 0.5)
    assert apply(tmp_path / "study.toml", recommend.keys_of(ds, index))
    assert read_study(tmp_path / "study.toml").settings.solve.tolerance == float(ds.tolerance[index])
    assert json.loads(ds.attrs["case"])["surface"]["generate"] == "self_affine"
