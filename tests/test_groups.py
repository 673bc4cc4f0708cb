"""Root and groups of a result: what stands where, and that a selection of a root never carries what is another's."""

import os
import subprocess
import sys
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr
from support import changed_package

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.groups import AT_ROOT, GROUPS, WARNINGS, group_of, split, whole_of
from roughvisc.study.storage.store import whole_result, write_result
from roughvisc.variables import VARIABLES

FORMER = Path(__file__).parent / "study" / "storage" / "format_2"
BALL, RUBBER = rv.sphere(1e-2, 2e-3, (17, 15)), rv.zener(1e6, 1e6, 1e6)
PROGRAM = rv.Program().load(0.01, over=0.5).hold(2.0)
_NEW = "use_new_combine_kwarg_defaults"
#: What a user wants first, and no more.
ROOT = {
    *("force", "nominal_pressure", "approach", "contact_area", "contact_area_counted"),
    *("contact_fraction", "mean_gap", "stated_error", "status"),
    *("height", "pressure", "gap"),
}


@pytest.fixture(scope="module")
def ball():
    return rv.simulate(BALL, RUBBER, PROGRAM, times=5, progress=False)


@pytest.fixture(scope="module")
def heavier(ball):
    program = rv.Program().load(0.02, over=0.5).hold(2.0)
    return rv.simulate(BALL, RUBBER, program, times=ball.time.values, progress=False)


def test_root__holds_what_a_user_wants_first(ball):
    assert set(ball.data_vars) == ROOT
    assert set(ball.roughvisc.energy.data_vars) == {"work", "stored_energy", "dissipated_energy"}
    assert set(ball.roughvisc.cost.data_vars) == {"iterations", "convolutions", "wall_time"}
    accuracy = ball.roughvisc.accuracy
    assert {"time_error", "residual", "pressure_error", "contact_area_solver_lower"} <= set(accuracy.data_vars)
    np.testing.assert_array_equal(accuracy.time, ball.time)
    assert all(VARIABLES[name].group == "accuracy" for name in accuracy.data_vars)


def test_steps__are_all_that_were_accepted_and_meet_the_rows(ball):
    steps = ball.roughvisc.steps
    assert steps.force.dims == ("step",)
    assert steps.sizes["step"] > ball.sizes["time"]
    at = np.searchsorted(steps.time.values, ball.time.values)
    np.testing.assert_array_equal(steps.time.values[at], ball.time.values)
    np.testing.assert_array_equal(steps.contact_area.values[at], ball.contact_area.values)
    np.testing.assert_array_equal(steps.time_error.values[at], ball.roughvisc.accuracy.time_error.values)


def test_steps__of_a_result_that_keeps_them_all_are_its_rows():
    every = rv.simulate(BALL, RUBBER, PROGRAM, progress=False)
    assert "step" not in whole_of(every).dims
    steps = every.roughvisc.steps
    np.testing.assert_array_equal(steps.time, every.time)
    np.testing.assert_array_equal(steps.work, every.roughvisc.energy.work)


@pytest.mark.parametrize(
    "select",
    [
        lambda ds: ds.isel(time=-1),
        lambda ds: ds.isel(time=[3, 1]),
        lambda ds: ds.sel(time=slice(0.1, 0.6)),
        lambda ds: ds[["force", "approach", "pressure"]],
        lambda ds: ds.load().copy(deep=True),
        lambda ds: ds.isel(x=slice(3), y=2),
    ],
    ids=["last", "two", "some", "variables", "copy", "corner"],
)
def test_selection__carries_its_own_part(ball, select):
    found = select(ball)
    for name in ("accuracy", "cost"):
        part = getattr(found.roughvisc, name)
        xr.testing.assert_equal(part, getattr(ball.roughvisc, name).sel(time=found.time.values))
    assert found.roughvisc.steps.equals(ball.roughvisc.steps)


@pytest.mark.parametrize(
    "combine",
    [
        lambda one, other: xr.concat([one, other], "case", data_vars="all"),
        lambda one, other: xr.concat([one.isel(time=[-1]), other.isel(time=[-1])], "time", data_vars="minimal"),
        lambda one, other: one.assign_coords(time=one.time + 1.0),
        lambda one, other: one.assign(force=other.force),
        lambda one, other: one[["pressure"]],
    ],
    ids=["cases", "times", "shifted", "changed", "unknown"],
)
def test_what_is_put_together_of_results__carries_nothing(ball, heavier, combine):
    """xarray keeps the encoding of the first: its errors would be stated of both."""
    with xr.set_options(**({_NEW: True} if _NEW in xr.get_options() else {})):
        found = combine(ball, heavier)
    assert set(whole_of(found).variables) == set(found.variables)
    for name in ("accuracy", "cost"):
        with pytest.raises(InputError, match=rf"carries no group '{name}': expected a result as rv\.simulate"):
            group_of(found, name)


def test_group__that_there_is_not_is_refused(ball, tmp_path):
    path = write_result(ball, tmp_path / "ball.nc")
    with pytest.raises(InputError, match="group is 'errors': expected one of steps, energy, accuracy, cost"):
        rv.open_result(path, group="errors")


def test_file__has_the_groups_and_gives_them_back(ball, tmp_path):
    path = write_result(ball, tmp_path / "ball.nc")
    with netCDF4.Dataset(path) as file:
        assert list(file.groups) == list(GROUPS)
        assert set(file.variables) == ROOT | {"time", "x", "y", "x_bounds", "y_bounds"}
        assert "step" not in file.dimensions
        assert file["steps"].dimensions["step"].size == ball.roughvisc.steps.sizes["step"]
    found = rv.open_result(path)
    xr.testing.assert_equal(found.load(), ball)
    for name in GROUPS:
        group = getattr(ball.roughvisc, name)
        xr.testing.assert_identical(rv.open_result(path, group=name), group)
        xr.testing.assert_equal(getattr(found.roughvisc, name), group)
        with xr.open_dataset(path, group=name) as plain:  # by xarray as it comes
            xr.testing.assert_equal(plain.load(), group)
    with xr.open_datatree(path) as tree:
        assert set(tree.children) == set(GROUPS)


def test_file__that_xarray_alone_has_opened_gives_its_groups(ball, heavier, tmp_path):
    paths = [write_result(one, tmp_path / f"{name}.nc") for name, one in (("ball", ball), ("heavier", heavier))]
    with xr.open_dataset(paths[0]) as plain, xr.open_dataset(paths[1]) as other:
        xr.testing.assert_equal(plain.roughvisc.accuracy, ball.roughvisc.accuracy)
        xr.testing.assert_equal(plain.isel(time=-1).roughvisc.cost, ball.isel(time=-1).roughvisc.cost)
        assert plain.roughvisc.steps.sizes == ball.roughvisc.steps.sizes
        together = xr.concat([plain.isel(time=[-1]), other.isel(time=[-1])], "time", data_vars="minimal")
        with pytest.raises(InputError, match="carries no group 'cost'"):
            _ = together.roughvisc.cost


def test_variables__refer_to_those_of_their_own_group(ball):
    for part in split(whole_of(ball)).values():
        named = [one.attrs.get("ancillary_variables", "").split() for one in part.variables.values()]
        assert {other for others in named for other in others} <= set(part.variables)


def test_friction__has_groups_over_speed():
    rough = rv.self_affine((1e-3, 0.9e-3), (24, 21), hurst=0.8, rms_slope=0.1, rolloff=5e-4, seed=1)
    curve = rv.friction(rough, RUBBER, speeds=[1e-4, 1e-3], load=0.02, grid_error=True, progress=False)
    assert {"friction_coefficient", "stated_error", "dissipated_power"} <= set(curve.data_vars)
    assert {"friction_residual", "pressure_residual"} <= set(curve.roughvisc.accuracy.data_vars)
    assert curve.roughvisc.accuracy.grid_error_friction.dims == ("speed",)
    assert (curve.isel(speed=1).roughvisc.cost.outer_iterations > 0).all()
    with pytest.raises(InputError, match="carries no group 'steps'"):
        _ = curve.roughvisc.steps


def test_sweep__carries_the_groups_of_its_cases(tmp_path):
    (tmp_path / "balls.toml").write_text(
        f"{(FORMER.parent / 'format_1' / 'creep.toml').read_text()}\n"
        '[sweep]\n"program.0.load" = ["5 mN", "6 mN"]\n'.replace("grid_error = true", "")
    )
    results = rv.sweep(tmp_path / "balls.toml", out=tmp_path / "out", workers=0, progress=False)
    assert results.roughvisc.accuracy.time_error.dims == ("case", "time")
    for number, key in enumerate(results.case_key.values):
        alone = rv.open_result(tmp_path / "out" / f"{key}.nc")
        for found in (results.isel(case=number), results.isel(case=[1, 0]).isel(case=1 - number)):
            np.testing.assert_array_equal(found.roughvisc.accuracy.residual, alone.roughvisc.accuracy.residual)
        steps = results.isel(case=number).roughvisc.steps.force.values
        np.testing.assert_array_equal(steps[np.isfinite(steps)], alone.roughvisc.steps.force.values)


@pytest.mark.parametrize("kind", ["creep", "slide"])
def test_former_result__is_sorted_into_groups(kind, tmp_path):
    (path,) = (FORMER / kind).glob("*.nc")
    with netCDF4.Dataset(path) as file:
        assert not file.groups
        file.set_auto_mask(False)
        stored = {name: np.asarray(one[...]) for name, one in file.variables.items() if name != "case_key"}
    root = rv.open_result(path)
    assert root.attrs["result_format"] == 4
    assert not {"time_error", "step"} & set(root.variables)
    for name, values in stored.items():
        if name.startswith("step_"):
            found = root.roughvisc.steps[name.removeprefix("step_")]
        elif name != "step":
            found = whole_result(path)[name]
        else:
            continue
        np.testing.assert_array_equal(found, values)
    again = write_result(root, tmp_path / "again.nc")
    xr.testing.assert_equal(rv.open_result(again).load(), root.load())
    xr.testing.assert_identical(rv.open_result(again, group="accuracy"), rv.open_result(path, group="accuracy"))


#: What a new variable touches, and above which line: its entry, and where the rows are made.
NEW_VARIABLE = [
    ("variables/__init__.py", '    "nominal_pressure": Variable('),
    ("experiment/loading.py", '            "force": shown.force,'),
]

USED = """
import sys
import roughvisc as rv
from roughvisc.study.storage.store import may_be_missing

group = sys.argv[3]
assert may_be_missing("largest_pressure") == bool(group)
ds = rv.run(sys.argv[1], sys.argv[2], progress=False)

def holder(ds):
    return ds.roughvisc.cost if group else ds

peak = holder(ds).largest_pressure
assert ("largest_pressure" in ds) == (not group)
assert (peak == ds.pressure.max(("x", "y"))).all() and peak.units == "Pa" and peak.long_name == "largest pressure"
assert ds.roughvisc.steps.largest_pressure.max() >= peak.max()
assert rv.observables.history(ds).largest_pressure.sizes["time"] == ds.roughvisc.steps.sizes["step"]
rv.open_results(sys.argv[2])
assert holder(rv.open_results(sys.argv[2], cases="all")).largest_pressure.dims == ("case", "time")
assert rv.to_table(sys.argv[2])["largest largest_pressure [Pa]"].item() == peak.max()
rv.to_csv(ds, sys.argv[2] + "/ball.csv")
assert "largest_pressure [Pa]" in open(sys.argv[2] + "/ball.csv").readline()
"""


@pytest.mark.thorough
@pytest.mark.parametrize("group", ["", "cost"])
def test_new_variable__touches_two_files(tmp_path, group):
    """Its entry and where it is computed: file, groups, index, table and labels follow, as the page about it has it."""
    package = changed_package(tmp_path, "howto/add-a-variable.md", "test_groups.py", NEW_VARIABLE)
    if group:
        path = package / "roughvisc" / "variables" / "__init__.py"
        entry = '"largest pressure", every_step=True'
        assert path.read_text().count(entry) == 1
        path.write_text(path.read_text().replace(entry, f'{entry}, group="cost", may_be_missing=True'))
    study = tmp_path / "ball.toml"
    study.write_text((FORMER.parent / "format_1" / "creep.toml").read_text().replace("grid_error = true", ""))
    command = [sys.executable, "-c", USED, study, tmp_path / "out", group]
    env = os.environ | {"PYTHONPATH": str(package)}
    done = subprocess.run(command, capture_output=True, text=True, env=env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def test_group__leaves_the_attributes_of_its_whole(ball):
    whole = whole_of(ball).copy()
    whole.encoding = {}
    whole["force"].attrs["ancillary_variables"] = "force_error"
    assert "force_error" in group_of(whole, "accuracy")
    assert whole["force"].attrs["ancillary_variables"] == "force_error"


def test_result_rewritten_without_its_groups__is_summed_up_all_the_same(tmp_path):
    """xarray alone reads and writes the root of a file."""
    study = tmp_path / "ball.toml"
    study.write_text((FORMER.parent / "format_1" / "slide.toml").read_text())
    path = rv.run(study, progress=False).encoding["source"]
    with xr.open_dataset(path, decode_timedelta=False) as plain:
        plain.load()
    plain.to_netcdf(path)
    command = [sys.executable, "-m", "roughvisc", "run", study, "--no-plots"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "Force at the end" in done.stdout
    assert "Cost" not in done.stdout
    assert rv.open_result(path).status.size > 1
    with pytest.raises(InputError, match="carries no group 'cost'"):
        rv.open_result(path, group="cost")


#: A scan of one tilt: periodic, it repeats with a step, and its slopes are steep.
TILTED = rv.self_affine((1e-3, 0.9e-3), (24, 21), hurst=0.8, rms_slope=0.4, rolloff=5e-4, seed=1)


def test_root__has_few_attributes_and_says_first_what_warns(tmp_path):
    tilted = TILTED.copy(data=TILTED.values + 3e-4 * np.arange(24)[:, None] / 24)
    ds = rv.simulate(
        tilted,
        RUBBER,
        rv.Program().pressure(1e4, over=0.1),
        boundary="periodic",
        numerics=rv.Numerics(time_step=0.05),
        progress=False,
    )
    assert set(ds.attrs) <= set(AT_ROOT)
    known = ds.roughvisc.attributes
    warned = [name for name in WARNINGS if name in known]
    assert {"slope_note", "border_note", "accuracy_note"} <= set(warned)
    lines = ds.attrs["notes"].splitlines()
    assert lines == [f"{name.removesuffix('_note')}: {known[name]}" for name in warned]
    assert "notes:" in repr(ds)
    found = rv.open_result(write_result(ds, tmp_path / "tilted.nc"))
    assert found.attrs.items() >= ds.attrs.items()
    assert found.roughvisc.attributes == known
    with xr.open_dataset(tmp_path / "tilted.nc") as plain:
        assert len(plain.attrs) <= 12
        assert "notes:" in repr(plain)
        assert plain.roughvisc.attributes == known


def test_attributes__of_a_user_stay_where_they_were_put(ball, tmp_path):
    mine = ball.assign_attrs(sample="A7", notes="slope: by eye\nmine: dusty")
    with xr.open_dataset(write_result(mine, tmp_path / "mine.nc")) as plain:
        assert plain.attrs["sample"] == "A7"
        assert plain.attrs["notes"] == "slope: by eye\nmine: dusty"
        assert plain.roughvisc.attributes["slope_note"] == "by eye"
        assert plain.roughvisc.attributes["notes"] == "mine: dusty"


def test_details__that_are_no_table_are_refused(ball, tmp_path):
    path = tmp_path / "odd.nc"
    ball.assign_attrs(details="[1]").to_netcdf(path)
    with pytest.raises(InputError, match=r"odd\.nc: has an attribute details that is no table in JSON"):
        rv.open_result(path)


def test_sheet_opened_by_xarray_alone__is_no_half_space(tmp_path):
    """What a body is stands with the root, not in a group: whoever copies the root keeps it."""
    rough = rv.self_affine((1e-3, 0.9e-3), (24, 21), hurst=0.8, rms_slope=0.1, rolloff=5e-4, seed=1)
    ds = rv.simulate(
        rough,
        rv.sheet(RUBBER, thickness=1e-4, base="bonded"),
        rv.Program().pressure(1e4, over=0.1),
        boundary="periodic",
        progress=False,
    )
    write_result(ds, tmp_path / "sheet.nc")
    with xr.open_dataset(tmp_path / "sheet.nc") as plain:
        plain.load().to_netcdf(tmp_path / "copy.nc")
    with xr.open_dataset(tmp_path / "copy.nc") as plain:
        assert (plain.roughvisc.attributes["thickness"], plain.roughvisc.attributes["base"]) == (1e-4, "bonded")
        with pytest.raises(InputError, match="the theories are of a half-space: found a result with the thickness"):
            rv.observables.area_by_theory(plain, material=RUBBER)


@pytest.mark.parametrize("kind", ["creep", "friction", "slide"])
def test_result_of_format_3__is_sorted_as_those_of_today(kind, tmp_path):
    (path,) = (FORMER.parent / "format_3" / kind).glob("*.nc")
    with netCDF4.Dataset(path) as file:
        file.set_auto_mask(False)
        assert file.result_format == 3
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
        stored = {name: np.asarray(one[...]) for name, one in file.variables.items()}
        groups = {name: {key: one[...] for key, one in part.variables.items()} for name, part in file.groups.items()}
    root = rv.open_result(path)
    assert set(root.attrs) <= set(AT_ROOT)
    assert not {"work", "stored_energy", "friction_work", "friction_residual"} & set(root.variables)
    known = root.roughvisc.attributes
    assert known == attributes | {"result_format": 4}
    whole = whole_result(path)
    for name, values in stored.items():
        np.testing.assert_array_equal(whole[name], values)
    for group, members in groups.items():
        part = getattr(root.roughvisc, group)
        for name, values in members.items():
            np.testing.assert_array_equal(part[name], values)
    again = rv.open_result(write_result(root, tmp_path / "again.nc"))
    xr.testing.assert_identical(again.load(), root.load())
    for group in [name for name in GROUPS if name in groups or (name == "energy" and "work" in stored)]:
        xr.testing.assert_identical(getattr(again.roughvisc, group), getattr(root.roughvisc, group))
