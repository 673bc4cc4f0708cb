"""The floor of a trade: what no setting lessens, from budgets; and errors of what is derived from results."""

import json
import math
from functools import partial

import numpy as np
import pytest
import xarray as xr
from support import ROUGH, STUDY, case_of, measured
from test_trade_advice import made_up

import roughvisc as rv
from roughvisc.study.budget.budget import budgets
from roughvisc.study.statement.case import vary
from roughvisc.study.trade import recommend
from roughvisc.study.trade.ladder import Setting
from roughvisc.study.trade.recommend import with_floors

AREA = "contact_area"


def budget_of(case, value=(1.0, 2.0)):
    """A budget of the contact area: of the solver, of the grid, of an octave that lessens it, and one that is open."""
    half = [[0.3, 0.3], [0.1, 0.2], [0.2, 0.1], [math.nan, math.nan]]
    direction = np.array([[0, 0], [0, 0], [-1, -1], [0, 0]], dtype="int8")
    return xr.Dataset(
        {
            "half_width": (("source", "time"), half),
            "direction": (("source", "time"), direction),
            "state": ("source", ["counted", "counted", "counted", "open"]),
            "value": ("time", list(value)),
        },
        coords={"source": ["time steps and solver", "grid", "next octave of waves", "modulus"]},
        attrs={"quantity": AREA, "case": case.to_json()},
    )


@pytest.mark.parametrize("grid_is_data", [0, 1])
def test_floor__is_of_what_settings_do_not_change(tmp_path, grid_is_data):
    """Half of the interval, by hand: the worst of two rows over the largest value."""
    found = with_floors(made_up(grid_is_data=grid_is_data), [budget_of(case_of(tmp_path))])
    grid = np.array([0.1, 0.2]) * grid_is_data
    octave = np.array([0.2, 0.1])
    half = np.array([1.0, 2.0]) * (np.exp(grid) - np.exp(-np.hypot(grid, octave))) / 2
    assert float(found.floor.sel(quantity=AREA)) == pytest.approx(half.max() / 2)
    assert np.isnan(found.floor.sel(quantity="pressure"))
    assert str(found.floor_open.sel(quantity=AREA).values) == "modulus"
    assert found.floor.attrs["long_name"] == "error that no setting lessens"


def test_words__say_the_floor_and_what_is_sharp_enough(tmp_path):
    """A fifth of 2 % is 0.4 %: of the settings made up the fastest that keeps it has just that."""
    ds = with_floors(made_up(), [budget_of(case_of(tmp_path))])
    ds = ds.assign(floor=ds.floor.where(ds.quantity != AREA, 0.02))
    assert (
        "no setting makes the contact area better than 2 %, most of it by next octave of waves (still open, and not "
        "in it: modulus): tolerance = 1e-2 is sharp enough, 4 s"
    ) in recommend.recommendation(ds).splitlines()
    assert "no setting makes" not in made_up().attrs["recommendation"]


def test_figure__draws_the_floor_as_a_line(tmp_path):
    ds = with_floors(made_up(), [budget_of(case_of(tmp_path))])
    area, pressure = rv.plot.trade(ds, [AREA, "pressure"]).axes
    lines = {one.get_label(): one for one in area.lines}
    floor = 100 * float(ds.floor.sel(quantity=AREA))
    np.testing.assert_allclose(lines["no setting is better"].get_ydata(), floor)
    assert area.get_ylim()[0] < floor < area.get_ylim()[1]
    assert "still open: modulus" in area.get_title(loc="right").replace("\n", " ")
    assert "no setting is better" not in {one.get_label() for one in pressure.lines}


def test_trade__takes_the_floor_of_a_budget_of_the_same_study_alone(tmp_path):
    case = case_of(tmp_path)
    found = measured(case, Setting(1e-1), floor=budget_of(vary(case, {"solve.tolerance": 1e-4, "keep.fields": []})))
    assert float(found.floor.sel(quantity=AREA)) > 0
    other = budget_of(vary(case, {"program.0.load": "2 mN"}))
    with pytest.raises(rv.InputError, match="floor: the budget of contact_area is of another study: program differ"):
        measured(case, Setting(1e-1), floor=[other])
    with pytest.raises(rv.InputError, match="floor holds a Dataset that is no budget"):
        measured(case, Setting(1e-1), floor=found)


def test_errors__of_what_is_derived_are_those_of_the_observable(tmp_path):
    """Of a leak rate and a force; at the tolerance of the finest run there is no difference."""
    case = case_of(tmp_path, ROUGH, observe={"leakage": {"viscosity": "1 mPa s", "along": "y"}})
    loose, sharp = (
        rv.run(vary(case, {"solve.tolerance": one, "keep.fields": ["gap"]}), out=tmp_path / "own", progress=False)
        for one in (1e-1, 2e-3)
    )
    found = measured(case, Setting(1e-1), Setting(1e-2), quantities=["leak_rate", "force"])
    rates = [rv.observables.leakage(one, viscosity=1e-3, along="y")["leak_rate"].values for one in (loose, sharp)]
    expected = np.abs(rates[0] - rates[1]).max() / rates[1].max()
    assert float(found.error.sel(quantity="leak_rate")[0]) == pytest.approx(expected, rel=1e-5)
    assert expected > 1e-6
    assert float(found.error.sel(quantity="force")[0]) == 0
    assert "leak rate" in found.attrs["recommendation"]
    with pytest.raises(rv.InputError, match="quantities: found 'friction_coefficient': expected one of"):
        measured(case, Setting(1e-1), quantities=["friction_coefficient"])


@pytest.mark.thorough
def test_command__shows_the_floor_of_a_budget_that_is_there(invoke, tmp_path, monkeypatch, caplog, coarse_pictures):
    monkeypatch.setattr("roughvisc.study.trade.trade.ladder", lambda *_: [Setting(1e-1)])
    monkeypatch.setattr("roughvisc.study.budget.budget.budgets", partial(budgets, workers=0))
    (tmp_path / "ball.toml").write_text(STUDY)
    status, out, _ = invoke("trade", "ball.toml", "--floor")
    assert (status, "no setting better than" in out, "No setting makes the contact area" in out) == (0, True, True)
    with xr.open_dataset(tmp_path / "results" / "ball-trade" / "trade.nc") as file:
        assert (file.floor.sel(quantity=["contact_area", "approach", "mean_gap"]) >= 0).all()
        assert "modulus" in str(file.floor_open.sel(quantity=AREA).values)
    path = tmp_path / "results" / "ball" / "budget" / "budget-contact_area.nc"
    with xr.open_dataset(path) as file:
        other = file.load()
    case = json.loads(other.attrs["case"])
    case["program"][0]["load"] *= 2
    other.assign_attrs(case=json.dumps(case)).to_netcdf(path)
    assert invoke("trade", "ball.toml", "-q")[0] == 0
    with xr.open_dataset(tmp_path / "results" / "ball-trade" / "trade.nc") as file:
        assert np.isfinite(file.floor.sel(quantity=["approach", "mean_gap"])).all()
        assert np.isnan(file.floor.sel(quantity=AREA))
    assert (
        "budget-contact_area.nc: does not count: floor: the budget of contact_area is of another study" in caplog.text
    )
