"""Cost and error of several tolerances and grids, measured against the finest run."""

import json

import numpy as np
import pytest
import xarray as xr
from samples import RUBBER
from support import FRICTION, PRESS, RADIUS, ROUGH, SIZE, STUDY, TIMES, case_of, measured, refused, true_errors

import roughvisc as rv
from roughvisc.judge.trade import cheapest, format_tolerance, pareto_front, uncertainty
from roughvisc.runs.netcdf import write_dataset

WAVE = {
    "surface": {"generate": "wavy", "amplitude": 2e-6, "wavelength": 1e-3, "size": 1e-3, "shape": [24, 2], "waves": 1},
    "material": {"model": "zener", "shear_modulus": 1e6, "kelvin_modulus": 3e5, "kelvin_viscosity": 300.0},
    "program": [{"pressure": 1e4, "over": 1e-3}, {"slide": 1e-3, "speed": 0.1}, {"hold": 2e-3}],
    "solve": {"boundary": "periodic"},
}
RUBBING, AREA = "friction_coefficient", "contact_area"


def errors_of(ds, name):
    return ds.error.sel(quantity=name).values


# ----------------------------------------------------------------------------------------------------------------
# measured


@pytest.mark.parametrize("shape", [(33, 31), pytest.param((48, 44), marks=pytest.mark.thorough)])
def test_uncertainty_of_the_reference__holds_its_error_against_lee_and_radok(tmp_path, shape):
    ds = measured(case_of(tmp_path, surface__shape=list(shape)), (1e-3, 1))
    assert ds.attrs["reference"] == "finest run: tolerance = 2e-4"
    unsure = (ds.reference_grid_uncertainty + ds.reference_time_uncertainty).sel(quantity=["pressure", AREA]).values
    ball = rv.sphere(RADIUS, SIZE, shape)
    true = np.array(true_errors(rv.simulate(ball, RUBBER, PRESS, times=TIMES, tolerance=2e-4, progress=False)))
    assert (true < unsure).all()
    assert (unsure < 10 * true).all()


@pytest.mark.thorough
def test_finer_grid__has_the_smaller_errors_and_transforms_more_cells(tmp_path):
    ds = measured(case_of(tmp_path), (1e-3, 2.0), (1e-3, 1), (1e-3, 0.5))
    assert (np.diff(ds.error.values, axis=0) < 0).all()
    assert (np.diff(ds.transforms * ds.cells_x * ds.cells_y) > 0).all()
    assert ds.cells_x.values.tolist() == [17, 33, 67]


def test_friction__errors_are_those_against_its_finest_run(tmp_path):
    case = case_of(tmp_path, FRICTION, friction__speeds=[5e-3, 0.2])
    ds = measured(case, (0.1, 1), (0.01, 1), (1e-3, 2.0))
    assert set(ds.quantity.values) == {"pressure", "approach", AREA, "mean_gap", RUBBING}

    def curve(height, tolerance):
        return rv.friction(height, case.material, pressure=2e4, speeds=[5e-3, 0.2], tolerance=tolerance, progress=False)

    fine = curve(case.height(), 2e-4)
    few = rv.resample(case.height(), (13, 10), periodic=True)
    runs = [curve(case.height(), 0.1), curve(case.height(), 0.01), curve(few, 1e-3)]
    for name in (RUBBING, AREA, "approach", "mean_gap"):
        expected = [float(abs(run[name] - fine[name]).max() / fine[name].max()) for run in runs]
        assert errors_of(ds, name) == pytest.approx(expected, rel=1e-9), name


def test_friction__uncertainty_of_the_finest_run_holds_its_true_error(tmp_path):
    """The true error is that of a wave against eight times as many cells."""
    sliding = {"program": None, "keep": None, "friction": {"pressure": 1e4, "speeds": [0.03, 0.3]}}
    case = case_of(tmp_path, **WAVE | sliding)
    ds = measured(case, (1e-3, 1))
    wave = {"amplitude": 2e-6, "wavelength": 1e-3, "size": (1e-3, 1e-3), "waves": 1}
    solve = {"pressure": 1e4, "speeds": [0.03, 0.3], "tolerance": 2e-4, "progress": False}
    fine, found = (rv.friction(rv.wavy(shape=(cells, 2), **wave), case.material, **solve) for cells in (192, 24))
    for name in (RUBBING, AREA, "approach", "mean_gap"):
        true = float(abs(found[name] - fine[name]).max() / fine[name].max())
        assert 0.3 * true < uncertainty(ds, name) < 1, name


@pytest.mark.parametrize(("times", "least"), [("all", 1), pytest.param(20, 3, marks=pytest.mark.thorough)])
def test_slides__are_compared_where_the_profile_has_moved_by_whole_cells_of_all_grids(tmp_path, times, least):
    """The coarsest grid, for the accuracy of the reference, has 6 cells along the wave."""
    ds = measured(case_of(tmp_path, **WAVE, keep={"times": times}), (0.1, 1), (1e-2, 2.0))
    assert np.isfinite(ds.error).all()
    kept = np.array(json.loads(ds.attrs["case"])["keep"]["times"])
    cells = (kept - 1e-3) / 1e-2 * 6
    inside = cells[(cells > 1e-9) & (cells < 6 - 1e-9)]
    assert len(inside) >= least
    assert inside == pytest.approx(np.round(inside), abs=1e-9)
    assert errors_of(ds, RUBBING)[0] < errors_of(ds, RUBBING)[1] < 0.1


# ----------------------------------------------------------------------------------------------------------------
# a scan


def test_scan__on_a_coarser_grid_is_another_surface_and_has_no_finer_one(tmp_path):
    case = case_of(tmp_path, ROUGH)
    ds = measured(case, (1e-2, 1), (1e-3, 2.0))
    assert ds.error.sel(quantity="pressure")[1] > 2 * ds.error.sel(quantity="pressure")[0]
    with refused("settings", (1e-3, 0.5)):
        measured(case, (1e-3, 0.5))


@pytest.mark.parametrize(
    ("settings", "options", "key", "found"),
    [
        ([(2.0, 1)], {}, "settings", 2.0),
        ([(1e-3, 0.0)], {}, "settings", 0.0),
        ([], {}, "settings", []),
        ([(1e-3, 1)], {"quantity": ["colour"]}, "quantity", "colour"),
        ([(1e-3, 1)], {"quantity": RUBBING}, "quantity", RUBBING),
    ],
)
def test_trade__refuses(tmp_path, settings, options, key, found):
    with refused(key, found):
        measured(case_of(tmp_path), *settings, **options)


# ----------------------------------------------------------------------------------------------------------------
# choice

#: tolerance, coarsening, wall time [s], error
MADE_UP = [(1e-1, 1, 1.0, 0.05), (3e-2, 1, 2.0, 0.009), (1e-2, 1, 4.0, 0.004), (1e-3, 1, 190.0, 8e-4)]
MADE_UP += [(1e-2, 2, 0.5, 0.006)]


def made_up(rows=MADE_UP, unsure=0.0, grid_unsure=0.0, grid_is_data=0):
    """A trade in which all quantities have the errors given."""
    quantities = ["pressure", "approach", AREA]
    tolerance, coarsening, spent, error = np.array(rows, float).T
    coords = {
        "setting": [f"tolerance = {format_tolerance(row[0])}, {row[1]}" for row in rows],
        "quantity": quantities,
        "tolerance": ("setting", tolerance),
        "coarsening": ("setting", coarsening),
        "cells_x": ("setting", (96 / coarsening).astype(int)),
        "cells_y": ("setting", (90 / coarsening).astype(int)),
    }
    variables = {
        "error": (("setting", "quantity"), error[:, None] * np.ones(3)),
        "reference_time_uncertainty": ("quantity", [unsure] * 3),
        "reference_grid_uncertainty": ("quantity", [grid_unsure] * 3),
        **dict.fromkeys(("run_time", "transforms"), ("setting", spent)),
    }
    return xr.Dataset(variables, coords, {"grid_is_data": grid_is_data, "reference": "finest run", "title": "Made up"})


@pytest.mark.parametrize(
    ("target", "options", "row"),
    [
        (0.1, {}, 4),
        (0.005, {}, 2),
        (0.001, {}, 3),
        (0.0005, {}, None),
        (0.01, {"grid_is_data": 1}, 1),
        (0.01, {"unsure": 0.005}, 2),
        (0.01, {"grid_unsure": 0.005}, 2),
        (0.01, {"grid_unsure": 0.005, "grid_is_data": 1}, 1),
        (0.01, {"unsure": np.nan}, None),
    ],
)
def test_cheapest__is_the_fastest_that_is_accurate_enough(target, options, row):
    assert cheapest(made_up(**options), AREA, target) == row


def test_chance__makes_no_setting_accurate():
    """The loosest tolerance is right by chance: a sharper one is not, and its error is the one that is stated."""
    lucky = made_up([(1e-1, 1, 1.0, 0.000498), (1e-2, 1, 2.0, 0.0021), (1e-3, 1, 3.0, 0.0017)])
    assert cheapest(lucky, AREA, 0.001) is None
    assert cheapest(lucky, AREA, 0.0022) == 0


def test_front__is_what_nothing_beats():
    assert np.flatnonzero(pareto_front(made_up(), AREA)).tolist() == [2, 3, 4]
    equal = [(1e-2, 1, 1.0, 0.01), (1e-3, 1, 2.0, 0.00999), (1e-4, 1, 3.0, 0.009)]
    assert pareto_front(made_up(equal), AREA).tolist() == [True, False, True]


# ----------------------------------------------------------------------------------------------------------------
# file, command, figure


def test_trade__survives_its_file(tmp_path):
    ds = measured(case_of(tmp_path), (1e-2, 1), (1e-1, 2.0))
    assert (ds.run_time.attrs["units"], ds.error.dims) == ("s", ("setting", "quantity"))
    with xr.open_dataset(write_dataset(ds, tmp_path / "trade.nc")) as stored:
        xr.testing.assert_equal(stored.load(), ds)


def test_command__writes_its_files_and_marks_the_cheapest(invoke, tmp_path, monkeypatch):
    rungs = [(1e-1, 1), (1e-2, 1), (1e-2, 2.0)]
    monkeypatch.setattr("roughvisc.judge.trade._ladder", lambda data, shape: rungs)
    (tmp_path / "ball.toml").write_text(STUDY)
    status, out, err = invoke("trade", "ball.toml", "--accuracy", "90 %")
    assert status == 0, err
    assert out.count(">*") == 1
    folder = tmp_path / "results" / "ball" / "trade"
    assert {"trade.nc", "trade.png"} < {path.name for path in folder.iterdir()}


def test_figure__draws_every_setting_and_the_front():
    ds = made_up(unsure=0.001)
    (ax,) = rv.plot.trade(ds, AREA).axes
    lines = {line.get_label(): line.get_xydata() for line in ax.lines}
    assert lines["96 × 90 cells"] == pytest.approx(np.array(MADE_UP[:4])[:, 2:] * [1, 100])
    assert lines["48 × 45 cells"] == pytest.approx(np.array([[0.5, 0.6]]))
    assert lines["Pareto front"] == pytest.approx(np.array([[0.5, 0.6], [4.0, 0.4]])), "not below the uncertainty"
    with refused("quantity", "colour"):
        rv.plot.trade(ds, "colour")
    with refused():
        rv.plot.trade(xr.Dataset())


def test_labels_of_the_figure__do_not_overlap():
    """Four runs as fast and as accurate as each other, to a few per cent, and one far away that sets the axes."""
    near = [(10.0**-number, 1, 1.0 + 0.03 * number, 0.01 * (1 + 0.05 * number)) for number in range(1, 5)]
    (ax,) = rv.plot.trade(made_up([*near, (1e-5, 2.0, 1e-3, 1.0)]), AREA).axes
    ax.figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in ax.texts]
    assert len(boxes) == 5
    for number, box in enumerate(boxes):
        assert not box.count_overlaps(boxes[:number])
