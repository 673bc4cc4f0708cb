"""The trade of accuracy against speed: what is measured, against what, and what is advised. No time is asserted."""

import numpy as np
import pytest
import xarray as xr
from support import (
    EXACT,
    LOAD,
    PRESS,
    RADIUS,
    ROUGH,
    RUBBER,
    SIZE,
    STUDY,
    TIMES,
    case_of,
    measured,
    true_errors,
)

import roughvisc as rv
from roughvisc import closed_forms
from roughvisc.experiment import grid_error as grid_convergence
from roughvisc.study.statement.case import vary
from roughvisc.study.storage.store import write_dataset
from roughvisc.study.trade.bench import QUANTITIES, TimedRuns
from roughvisc.study.trade.files import open_trade
from roughvisc.study.trade.ladder import FLOAT32, Setting, changed, ladder, shape_of
from roughvisc.study.trade.reference import closed_form
from roughvisc.variables import VARIABLES


def error_of(ds, index, quantity):
    return float(ds.error.sel(quantity=quantity)[index])


# ----------------------------------------------------------------------------------------------------------------
# what is measured


def test_errors__are_those_against_the_closed_form(tmp_path):
    settings = [Setting(1e-2), Setting(1e-3, coarsening=0.5), Setting(1e-2, time_step=0.05, method="seed")]
    ds = measured(case_of(tmp_path), *settings)
    assert ds.reference.values.tolist() == ["Lee and Radok, Ting"] * 5
    assert not ds.reference_grid_uncertainty.any()
    assert not ds.reference_time_uncertainty.any()
    given = [
        ((33, 31), {"tolerance": 1e-2}),
        ((67, 63), {"tolerance": 1e-3}),
        ((33, 31), {"tolerance": 1e-2, "numerics": rv.Numerics(time_step=0.05, method="seed")}),
    ]
    for i, (shape, solve) in enumerate(given):
        again = rv.simulate(rv.sphere(RADIUS, SIZE, shape), RUBBER, PRESS, times=TIMES, progress=False, **solve)
        both, _ = true_errors(again)
        found = max(error_of(ds, i, "pressure"), error_of(ds, i, "approach"))
        assert found == pytest.approx(both, rel=1e-7)
        exact = np.pi * EXACT.radius(TIMES) ** 2
        for name in ("contact_area", "contact_area_counted"):
            expected = np.abs(again[name].values - exact).max() / exact.max()
            assert error_of(ds, i, name) == pytest.approx(expected, rel=1e-9)
        assert float(ds.transforms[i]) == int(again.convolutions.sum())
        assert (int(ds.cells_x[i]), int(ds.cells_y[i])) == shape
    assert (ds.error[1] < ds.error[0]).all(), "four times the cells are nearer in everything"
    assert ((ds.run_time > 0) & (ds.steps > 2) & (ds.peak_memory > 1e8) & (ds.disk_size > 1e3)).all()


def test_mean_gap__of_the_closed_form_is_what_the_solver_converges_to(tmp_path):
    ds = measured(case_of(tmp_path), *(Setting(1e-4, coarsening=c) for c in (2, 1, 0.5, 0.25)))
    errors = ds.error.sel(quantity="mean_gap").values
    assert errors[-1] < 1e-4
    assert np.all(np.diff(errors) < 0)


def test_rounded_fields__count_with_their_rounding(tmp_path):
    ds = measured(case_of(tmp_path), Setting(1e-3), Setting(1e-3, precision=0.3), Setting(1e-3, precision=FLOAT32))
    assert error_of(ds, 1, "pressure") > 2 * error_of(ds, 0, "pressure")
    assert error_of(ds, 2, "pressure") == pytest.approx(error_of(ds, 0, "pressure"), rel=1e-5)
    assert error_of(ds, 1, "approach") == error_of(ds, 0, "approach")
    assert ds.disk_size[1] < ds.disk_size[0]


def test_seed__pays_for_every_step_with_a_field(tmp_path):
    few, many = (Setting(1e-2, time_step=0.4 / n, method="seed") for n in (4, 40))
    ds = measured(case_of(tmp_path), few, many)
    assert ds.steps.values.tolist() == [5.0, 41.0]
    assert float(ds.peak_memory[1] - ds.peak_memory[0]) == pytest.approx(36 * 33 * 31 * 8)


def test_settings__that_cannot_run_say_why(tmp_path):
    soft = case_of(tmp_path, material__kelvin_modulus="30 kPa", material__kelvin_viscosity="3 kPa s")
    soft = vary(soft, {"program.0.load": "2 mN"})
    ds = measured(soft, Setting(1e-2), Setting(time_step=0.2, method="seed"))
    assert ds.note[0] == ""
    assert "unstable with a time step" in ds.note[1].item()
    assert np.isnan(ds.run_time[1])
    assert np.isnan(ds.error[1]).all()


def test_budget__leaves_out_what_would_take_longer(tmp_path):
    ds = measured(case_of(tmp_path), Setting(1e-2), Setting(1e-3), budget=1e-6)
    assert all("of the budget" in note for note in ds.note.values)
    assert ds.attrs["recommendation"] == ""


def test_budget__stops_a_run_that_takes_longer_than_expected(tmp_path):
    case = case_of(tmp_path, keep__fields=["pressure"])
    bench = TimedRuns(case, case.height(), tmp_path, 1e4, lambda *_: setattr(bench, "_until", 0.0))
    with pytest.raises(rv.RoughviscError, match="stopped when the budget was spent"):
        bench.run(Setting(1e-2))


def test_time__is_the_least_of_three_runs(tmp_path, monkeypatch):
    """What else the machine does only adds to it."""
    monkeypatch.undo()
    case = case_of(tmp_path, keep__fields=["pressure"])
    bench = TimedRuns(case, case.height(), tmp_path, 1e4, lambda *_: None)
    timed, clock = bench._timed, [3e-3, 1e-3, 2e-3]
    monkeypatch.setattr(bench, "_timed", lambda *given: (clock.pop(0), *timed(*given)[1:]))
    assert bench.run(Setting(1e-1)).seconds == 1e-3
    assert not clock


def test_expected_time__counts_the_window_and_not_the_whole_domain(tmp_path):
    """A contact a twentieth as wide as its domain: all that differs is whether it may reach the border."""
    case = vary(case_of(tmp_path), {"surface.shape": [301, 307], "program.0.load": 1e-5})
    benches = [
        TimedRuns(vary(case, {"solve.edge": edge}), case.height(), tmp_path, 1e4, print) for edge in ("error", "accept")
    ]
    for bench in benches:
        bench._convolution = 1.0
    followed, whole = (bench.expected(Setting(1e-4)) for bench in benches)
    assert followed < 0.1 * whole


def test_reference__that_would_take_too_long_is_refused(tmp_path):
    with pytest.raises(rv.InputError, match=r"study\.toml: surface: the reference run"):
        measured(case_of(tmp_path, ROUGH), Setting(1e-2), budget=1e-6)


def test_settings__finer_than_the_affordable_reference_are_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(TimedRuns, "expected", lambda _self, setting: 1e9 if setting.coarsening < 1 else 0.0)
    ds = measured(case_of(tmp_path), Setting(1e-2), Setting(1e-2, coarsening=0.5), reference="run")
    assert set(ds.reference.values) == {"finest run: tolerance = 2e-3"}
    assert ds.note[0] == ""
    assert ds.note[1].item().startswith("finer than the run to measure it against")


def test_reference__is_not_on_a_coarser_grid_than_the_study(tmp_path, monkeypatch):
    monkeypatch.setattr(TimedRuns, "expected", lambda _self, setting: 1e9 if setting.coarsening < 2 else 0.0)
    with pytest.raises(rv.InputError, match=r"would take about 1e\+09 s"):
        measured(case_of(tmp_path), Setting(1e-2), Setting(1e-2, coarsening=2.0), reference="run")


@pytest.mark.parametrize(
    ("options", "message"),
    [({"budget": 0}, "budget is 0"), ({"reference": "best"}, "reference is 'best'")],
)
def test_trade__refuses(tmp_path, options, message):
    with pytest.raises(rv.InputError, match=message):
        measured(case_of(tmp_path), Setting(), **options)


def test_trade__refuses_no_settings_and_impossible_ones(tmp_path):
    with pytest.raises(rv.InputError, match="settings is empty"):
        measured(case_of(tmp_path))
    for wrong in ({"tolerance": 2.0}, {"time_step": -1.0}, {"coarsening": 0.0}):
        with pytest.raises(rv.InputError, match=next(iter(wrong))):
            Setting(**wrong)


def test_all_times__become_common_ones(tmp_path):
    ds = measured(case_of(tmp_path, keep__times="all"), Setting(1e-2), Setting(1e-1))
    assert np.isfinite(ds.error).all()


# ----------------------------------------------------------------------------------------------------------------
# against what


@pytest.mark.parametrize(
    "changes",
    [
        {},
        pytest.param({"surface__shape": [48, 44]}, marks=pytest.mark.thorough),
        pytest.param(
            {"surface": {"generate": "cone", "slope": 0.02, "size": [2e-3, 1.9e-3], "shape": [41, 38]}},
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            {"program": [{"load": 0.05, "over": 0.1}, {"load": 0.1, "over": 0.1}]}, marks=pytest.mark.thorough
        ),
    ],
    ids=["33 x 31", "48 x 44", "cone", "ramps"],
)
def test_richardson__bounds_the_true_error_of_the_finest_run(tmp_path, changes):
    changes = {"keep__times": [0.0, 0.1, 0.2], **changes}
    case = case_of(tmp_path, **changes)
    sharp = Setting(1e-3 / 5)
    run = measured(case, Setting(1e-3), reference="run")
    true = measured(case, sharp).error[0]
    assert set(run.reference.values) == {"finest run: tolerance = 2e-4"}
    unsure = run.reference_grid_uncertainty + run.reference_time_uncertainty
    assert (true < unsure).all(), f"{true.values} against {unsure.values}"
    assert (unsure < 100 * true).all(), f"{true.values} against {unsure.values}"
    assert unsure[0] < 10 * true[0], "the pressure's is of its size"
    assert (run.reference_time_uncertainty < 1e-3).all()


def test_richardson__takes_the_order_it_sees():
    cell = 0.1  # an error of cell^1.5 on three grids
    near, far = ((2**1.5) ** n * (2**1.5 - 1) * cell**1.5 for n in (0, 1))
    assert grid_convergence.grid_uncertainty("pressure", near, far, 2.0) == pytest.approx(1.25 * cell**1.5)
    wild = grid_convergence.grid_uncertainty("pressure", near, near, 2.0)
    assert wild > 2 * cell**1.5, "no convergence seen: the lowest order is believed"
    assert grid_convergence.grid_uncertainty("approach", 0.0, 0.0, 2.0) == 0
    chance = grid_convergence.grid_uncertainty("pressure", 1e-3 * near, far, 2.0)
    assert chance == pytest.approx(1.25 * cell**1.5), "the two finer grids agree by chance"
    two = grid_convergence.grid_uncertainty("pressure", [near, near], [far, np.nan], 2.0)
    assert two[1] / two[0] == pytest.approx(3 / 1.25), "a larger factor without a third grid"


def test_errors__against_the_finest_run_are_near_the_true_ones(tmp_path):
    case = case_of(tmp_path)
    settings = [Setting(1e-1), Setting(1e-2, coarsening=2.0)]
    run, true = (measured(case, *settings, reference=name) for name in ("run", "auto"))
    unsure = run.reference_grid_uncertainty + run.reference_time_uncertainty
    assert (abs(run.error - true.error) < unsure + 1e-12).all()


SPHERE = {"generate": "sphere", "radius": 0.01, "size": [2.4e-3, 2.3e-3], "shape": [33, 31]}
HOLD = [{"load": 0.1, "over": 0}, {"hold": 0.4}]
ZENER = {"model": "zener", "shear_modulus": 3e6, "kelvin_modulus": 3e6, "kelvin_viscosity": 3e5}
CREEP = {"model": "power_law", "glassy": 1e-7, "coefficient": 1e-7, "exponent": 0.5}
UNLOADED = [{"load": 0.1, "over": 0.2}, {"load": 0.05, "over": 0.2}]
AGAIN = [{"load": 0.1, "over": 0.1}, {"load": 0.02, "over": 0.1}, {"load": 0.1, "over": 0.2}]
PUNCH = {"generate": "flat_punch", "radius": 5e-4, "size": 1.5e-3, "shape": [35, 36]}


@pytest.mark.parametrize(
    ("surface", "material", "program", "name", "unknown"),
    [
        (SPHERE, ZENER, HOLD, "Lee and Radok, Ting", set()),
        (SPHERE, ZENER, UNLOADED, "Ting and Graham", {"mean_gap"}),
        (SPHERE, ZENER, AGAIN, "reduction to independent elements", {"mean_gap", "pressure"}),
        (SPHERE, CREEP, HOLD, "Lee and Radok", {"pressure"}),
        (SPHERE, {"model": "elastic", "shear_modulus": 1e6}, HOLD, "Hertz, Sneddon", set()),
        (
            SPHERE,
            ZENER,
            [{"approach": 1e-5, "over": 0.4}],
            "reduction to independent elements",
            {"mean_gap", "pressure"},
        ),
        (PUNCH, ZENER, HOLD, "flat punch", {"mean_gap", "pressure"}),
    ],
)
def test_closed_forms__are_found_and_met(tmp_path, surface, material, program, name, unknown):
    case = case_of(tmp_path, surface=surface, material=material, program=program, keep__times=[0.2, 0.4])
    exact = closed_form(case, np.array([0.2, 0.4]))
    assert exact.name == name
    assert set(QUANTITIES) - set(exact.quantities) == unknown
    press = rv.simulate(
        case.height(), case.material(), case.program(), times=[0.2, 0.4], tolerance=1e-3, progress=False
    )
    errors = exact.errors(press)
    assert set(errors) == set(exact.quantities)
    assert errors.pop("contact_area_counted") < 0.1
    assert max(errors.values()) < 0.03


@pytest.mark.parametrize(
    "changes",
    [
        {"solve__boundary": "periodic"},
        {"surface__level": 1, "solve__boundary": "free"},
        {"surface__exact": True},
        {
            "surface": {"generate": "wavy", "amplitude": 1e-6, "wavelength": 1e-3, "size": 1e-3, "shape": 16},
            "solve__boundary": "free",
        },
    ],
)
def test_closed_forms__are_not_taken_for_other_scenes(tmp_path, changes):
    assert closed_form(case_of(tmp_path, **changes), np.array([0.1])) is None


def test_infinite_pressure__at_a_cones_apex_is_averaged(tmp_path):
    cone = {"generate": "cone", "slope": 0.02, "size": 2e-3, "shape": 41}
    case = case_of(tmp_path, surface=cone, keep__times=[0.1])
    exact = closed_form(case, np.array([0.1]))
    assert not np.isfinite(exact.pressure(np.zeros(1), 0.1))
    press = rv.simulate(case.height(), case.material(), case.program(), times=[0.1], tolerance=1e-3, progress=False)
    assert 1e-3 < exact.errors(press)["pressure"] < 0.03
    press.pressure[0, 20, 20] = 0.0  # the apex counts: its cell carries a share of the load that is then missing
    lost = float(exact._cell_mean(0.0, 0.0, [2e-3 / 41] * 2, 0.1)) * (2e-3 / 41) ** 2 / LOAD
    assert exact.errors(press)["pressure"] > lost
    hertz = closed_forms.sneddon_cone(0.02, 2.0, 1e-4)  # over a small square the mean of arcosh(a/r) is ln(2a/r)'s
    half, radius = 1e-4 * hertz.radius, hertz.radius
    mean_log = np.log(half) + 0.5 * np.log(2) - 1.5 + np.pi / 4  # of ln r over a square of this half side
    sharp = closed_form(
        case_of(
            tmp_path,
            surface=cone,
            material={"model": "elastic", "shear_modulus": 0.5},
            program=[{"load": 1e-4, "over": 0}, {"hold": 1.0}],
        ),
        np.array([0.5]),
    )
    assert sharp.radius[0] == pytest.approx(radius)
    found = sharp._cell_mean(0.0, 0.0, [2 * half, 2 * half], 0.5)
    assert found == pytest.approx(2.0 * 0.02 / 2 * (np.log(2 * radius) - mean_log), rel=1e-4)


# ----------------------------------------------------------------------------------------------------------------
# where the grid is data


def test_scan__shows_what_coarsening_makes_of_the_surface(tmp_path):
    case = case_of(tmp_path, ROUGH)
    ds = measured(case, Setting(1e-2), Setting(1e-3, coarsening=2.0), Setting(1e-3, coarsening=0.5))
    assert ds.attrs["grid_is_data"] == 1
    assert "finer grid" in ds.note[2].item()
    assert not ds.coarsening_error[0].any()
    share = ds.coarsening_error[1] / ds.error[1]
    assert share.values == pytest.approx(1, abs=0.1), "at this tolerance the grid makes the whole error"
    assert "the grid is part of the data" in ds.attrs["recommendation"]
    few = changed(case, (30, 26), Setting(coarsening=2.0)).height()
    x, y = (_waves_at(old, new) for old, new in ((30, 15), (26, 13)))
    expected = x @ case.height().values @ y.T
    assert few.values == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_card_of_a_punch__is_made_coarser_by_means(tmp_path):
    """Its material ends within the grid, which the study does not say: waves would be refused."""
    (tmp_path / "punch.toml").write_text('generate = "flat_punch"\nradius = 2e-4\nsize = 1e-3\nshape = [31, 28]\n')
    text = ROUGH[: ROUGH.index("[surface]")] + '[surface]\nfile = "punch.toml"\n\n' + ROUGH[ROUGH.index("[material]") :]
    ds = measured(case_of(tmp_path, text), Setting(1e-2), Setting(1e-2, coarsening=2.0))
    assert not any(ds.note.values)
    assert np.isfinite(ds.run_time).all()


def _waves_at(old, new):
    """Values at the centres of fewer cells, from values at more, by the waves that fewer cells hold."""
    number = np.arange(new) - (new - 1) // 2
    fine, few = (
        np.exp(2j * np.pi * np.outer((np.arange(n) + 0.5) / n, number[2 * abs(number) < new])) for n in (old, new)
    )
    return (few @ fine.conj().T).real / old


def test_ladder__suits_the_scene(tmp_path):
    ball, rough = (case_of(tmp_path, text) for text in (STUDY, ROUGH))
    families = {setting.family for setting in ladder(ball, (48, 48))}
    assert families == {
        "tolerance", "coarser grid", "finer grid", "rounded fields", "direct history", "fixed steps",
        "seed paper's algorithm",
    }  # fmt: skip
    assert "finer grid" not in {setting.family for setting in ladder(rough, (48, 48))}
    assert min(shape_of(ball, (33, 31), s.coarsening)[1] for s in ladder(ball, (33, 31))) >= 12
    jump = vary(ball, {"program": [{"load": 0.1, "over": 0}], "keep.times": [0.0]})
    assert all(setting.time_step is None for setting in ladder(jump, (33, 31)))


def test_mirrored_surface__is_made_coarser_before_it_is_mirrored(tmp_path):
    case = case_of(tmp_path, ROUGH.replace("seed = 3", "seed = 3\nmirror = true"))
    assert case.height().shape == (60, 52)
    assert changed(case, (60, 52), Setting(coarsening=2.0)).height().shape == (30, 26)


# ----------------------------------------------------------------------------------------------------------------
# the file


def test_trade__is_labelled_and_survives_its_file(tmp_path):
    ds = measured(case_of(tmp_path), Setting(1e-2), Setting(1e-1, coarsening=2.0))
    assert set(ds.variables) <= set(VARIABLES)
    for name in ds.variables:
        assert ds[name].attrs.get("units", "") == VARIABLES[name].units
        assert ds[name].dims == VARIABLES[name].dims
    again = open_trade(write_dataset(ds, tmp_path / "trade.nc"))
    xr.testing.assert_equal(again, ds)
    assert again.attrs["recommendation"] == ds.attrs["recommendation"]
    with xr.open_dataset(tmp_path / "trade.nc") as plain:
        assert len(rv.plot.trade(plain).axes) == 2
    with pytest.raises(rv.InputError, match="is not a trade"):
        open_trade(write_dataset(ds[["error"]], tmp_path / "other.nc"))
    with pytest.raises(rv.InputError, match="cannot be opened"):
        open_trade(tmp_path / "nowhere.nc")


def test_progress__tells_the_setting_and_the_time(tmp_path):
    told = []
    measured(case_of(tmp_path), Setting(1e-1), progress=lambda *report: told.append(report))
    assert {label for label, _, _ in told} == {"tolerance = 1e-1"}
    assert told[-1][1:] == (0.4, 0.4)
    assert case_of(tmp_path).program().largest_load == LOAD
