"""A result as a user has it: one flat Dataset, the history of its steps, and what xarray does to both."""

from functools import partial

import netCDF4
import numpy as np
import pytest
import xarray as xr
from support import STUDY, assert_missing_as_declared, refused

import roughvisc as rv
from roughvisc.variables import VARIABLES

BALL, RUBBER = rv.sphere(1e-2, 2e-3, (17, 15)), rv.zener(1e6, 1e6, 1e6)
PROGRAM = rv.Program().load(0.01, over=0.5).hold(2.0)


@pytest.fixture(scope="module")
def ball():
    return rv.simulate(BALL, RUBBER, PROGRAM, times=5, progress=False)


@pytest.fixture(scope="module")
def heavier(ball):
    program = rv.Program().load(0.02, over=0.5).hold(2.0)
    return rv.simulate(BALL, RUBBER, program, times=ball.time.values, progress=False)


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stored")
    (folder / "ball.toml").write_text(STUDY)
    return rv.run(folder / "ball.toml", progress=False)


def concatenated(results, dim, **how):
    new = "use_new_combine_kwarg_defaults"
    with xr.set_options(**({new: True} if new in xr.get_options() else {})):
        return xr.concat(results, dim, **how)


@pytest.fixture(scope="module")
def results(stored):
    """Results of each experiment, with all errors and, if the surface parts, without values."""
    rough = rv.self_affine((1e-3, 0.9e-3), (24, 21), hurst=0.8, rms_slope=0.1, rolloff=5e-4, seed=1)
    body = rv.sheet(RUBBER, 1e-3)
    press = rv.Program().pressure(1e4, over=0.1)
    how = {"grid_error": True, "progress": False}
    every = how | {"boundary": "periodic", "times": 4, "fields": ("pressure", "gap", "displacement")}
    return {
        "stored": stored,
        "curve": rv.friction(rough, body, speeds=[1e-3, 1e-2], load=0.02, fields=("pressure", "gap"), **how),
        "slide": rv.simulate(rough, body, press.slide(1e-4, over=0.1).load(0.0, over=0).hold(0.1), **every),
        "rest": rv.simulate(rough, body, press, **every),
    }


def test_result__has_plain_attributes_and_values_that_exist_unless_it_is_declared(results):
    for ds in results.values():
        assert all(isinstance(value, str | int | float | np.number) for value in ds.attrs.values())
        assert_missing_as_declared(ds)
    parted = results["slide"].isel(time=-1)
    assert parted.force == 0
    assert {"mean_contact_pressure", "friction_coefficient"} < {name for name in parted if parted[name].isnull().any()}
    assert results["stored"].stated_error.attrs["long_name"] == "numerical error"


def test_variables__name_their_errors_which_every_result_has(results):
    named = {variable.error for variable in VARIABLES.values()} | {one.grid_error for one in VARIABLES.values()}
    assert {name for name in VARIABLES if "grid_error" in name or name.endswith("_error")} - named == {
        "stated_error",  # of several quantities
        "time_error",  # of the time steps
    }
    for variable in VARIABLES.values():
        assert not variable.error or VARIABLES[variable.error].units == variable.units
        assert not variable.grid_error or VARIABLES[variable.grid_error].units == "1"
    for kind, ds in results.items():
        for name in {"force", "contact_area", "mean_contact_pressure", "friction_coefficient"} & set(ds.variables):
            assert VARIABLES[name].error in ds.variables, (kind, name)
            assert ds[name].attrs["ancillary_variables"].split()[0] == VARIABLES[name].error


def test_attributes__state_program_body_material_and_version(ball, stored):
    """They are the same for every way to compute a result; the text of a series makes the series again."""
    wave = rv.wavy(1e-6, 1e-3, (1e-3, 1e-4), (24, 3), waves=1)
    curve = rv.friction(wave, rv.sheet(RUBBER, 1e-3), pressure=5e4, speeds=[1e-3, 0.1], progress=False)
    for ds, body in ((ball, "half-space"), (stored, "half-space"), (curve, repr(rv.sheet(RUBBER, 1e-3).kernel))):
        assert ds.attrs["body"] == body
        assert ds.attrs["source"].startswith("roughvisc ")
    for ds in (ball, curve):
        assert eval(ds.attrs["material"], {"Prony": rv.Prony}) == RUBBER
    assert ball.attrs["program"] == "load to 10 mN over 500 ms, hold 2 s"
    assert curve.attrs["program"] == "Steady sliding: 2 speeds from 1 mm/s to 100 mm/s along x, under 50 kPa"
    assert stored.attrs["program"] == "load to 5 mN at once, hold 200 ms"


def test_steps__hold_every_accepted_step_and_the_rows_among_them(ball, stored):
    for ds in (ball, stored):
        steps = ds.roughvisc.steps
        assert steps.force.dims == ("step",)
        assert steps.sizes["step"] > ds.sizes["time"]
        assert (np.diff(steps.wall_time) >= 0).all()
        at = np.searchsorted(steps.time.values, ds.time.values)
        for name in ("time", "force", "contact_area", "work"):
            np.testing.assert_array_equal(steps[name].values[at], ds[name].values)
        for name in ("time_error", "residual", "convolutions", "status", "nominal_pressure"):
            assert name not in ds.variables
            assert np.isfinite(steps[name]).all()


@pytest.mark.parametrize(
    "select",
    [
        lambda ds: ds.isel(time=[3, 1], x=slice(3), y=2),
        lambda ds: ds[["force", "pressure"]],
        lambda ds: ds.load().copy(deep=True),
    ],
    ids=["rows", "variables", "copy"],
)
def test_steps__belong_to_every_selection_of_rows(ball, select):
    xr.testing.assert_identical(select(ball).roughvisc.steps, ball.roughvisc.steps)


@pytest.mark.parametrize(
    "change",
    [
        lambda one, other: concatenated([one, other], "case", data_vars="all"),
        lambda one, other: concatenated([one.isel(time=[-1]), other.isel(time=[-1])], "time", data_vars="minimal"),
        lambda one, other: one.interp(time=[0.1, 0.2]),
        lambda one, other: one.assign(force=other.force),
    ],
    ids=["cases", "times", "interpolated", "changed"],
)
def test_steps__of_another_result_are_refused(ball, heavier, change):
    """xarray keeps the encoding of the first Dataset."""
    with refused("steps", None):
        _ = change(ball, heavier).roughvisc.steps


def test_file__has_the_group_of_steps_which_netcdf_of_xarray_loses(stored, tmp_path):
    path = stored.encoding["source"]
    with netCDF4.Dataset(path) as file:
        assert list(file.groups) == ["steps"]
    with xr.open_datatree(path) as tree:
        assert set(tree.data_vars) == set(stored.data_vars)
        np.testing.assert_array_equal(tree["steps"]["force"], stored.roughvisc.steps["force"])
    stored.to_netcdf(tmp_path / "mine.nc")
    found = rv.open_result(tmp_path / "mine.nc")
    xr.testing.assert_identical(found.load(), stored.load())
    with refused("steps", None):
        _ = found.roughvisc.steps
    assert found.roughvisc.plot_history()


#: Operations of xarray that change no number and lose the steps.
LOSSES = {
    "where": lambda ds, path: ds.where(ds.time >= 0),
    "merge": lambda ds, path: xr.merge([ds], compat="equals", join="exact"),
    "map": lambda ds, path: ds.map(lambda one: one, keep_attrs=True),
    "drop_encoding": lambda ds, path: ds.drop_encoding(),
    "dict": lambda ds, path: xr.Dataset.from_dict(ds.to_dict()),
    "file": lambda ds, path: [ds.to_netcdf(path), xr.load_dataset(path)][1],
}


@pytest.fixture(scope="module")
def cycles():
    """Two cycles and a slide, with rows that are no ends of the cycles."""
    rough = rv.self_affine(1e-3, (16, 14), hurst=0.8, rms_slope=0.1, rolloff=5e-4, seed=1)
    program = rv.Program().pressure(2e4, over=0.1) + rv.Program.cycle(2e4, 1e4, 0.5, 2, control="pressure")
    how = {"boundary": "periodic", "tolerance": 0.1, "progress": False}
    return rv.simulate(rough, RUBBER, program.slide(2e-4, over=0.1), times=[0.3, 0.9, 1.2], **how)


@pytest.mark.parametrize("lose", LOSSES.values(), ids=LOSSES)
def test_result_without_steps__gives_no_other_numbers(cycles, lose, tmp_path):
    """What needs the steps is refused or not known, and figures have no line between the rows."""
    lost = lose(cycles, tmp_path / "lost.nc")
    theory = partial(rv.observables.area_by_theory, material=RUBBER)
    for function in (rv.observables.history, rv.observables.cycle_work, theory):
        assert function(cycles)
        with pytest.raises(rv.InputError, check=lambda error: error.key in ("steps", "height")):
            function(lost)
    for draw in (partial(rv.plot.history, quantities=["force", "work"]), rv.plot.area_against_load):
        for ds, styles in ((cycles, {"-", "None"}), (lost, {"None"})):
            assert {line.get_linestyle() for ax in draw(ds).axes for line in ax.lines} <= styles
    assert rv.audit(cycles, density=1e3).verdict.sel(assumption="inertia") == "holds"
    if lost.height.dims == ("x", "y"):
        assert rv.audit(lost, density=1e3).verdict.sel(assumption="inertia") == "not known"
    else:
        with refused("height", ("x", "y", "time")):  # xarray repeats it at each row
            rv.audit(lost, density=1e3)


def test_cycle_work__of_rows_at_the_ends_of_the_cycles_needs_no_steps(cycles):
    program = rv.Program().load(0.01, over=0.1) + rv.Program.cycle(0.01, 0.005, 0.5, 2)
    ds = rv.simulate(BALL, RUBBER, program, times=[0.1, 0.6, 1.1], tolerance=0.1, fields=(), progress=False)
    work = rv.observables.cycle_work
    xr.testing.assert_equal(work(ds.drop_encoding()), work(ds))


def test_warnings__are_one_attribute_of_one_line_each():
    """A tilted scan: it repeats with a step, its slopes are steep, its time step is too long, and 5.2 % are filled."""
    rough = rv.self_affine((1e-3, 0.9e-3), (24, 21), hurst=0.8, rms_slope=0.4, rolloff=5e-4, seed=1)
    tilted = rough.copy(data=rough.values + 3e-4 * np.arange(24)[:, None] / 24)
    numerics = rv.Numerics(time_step=0.05)
    program = rv.Program().pressure(1e4, over=0.1)

    def subjects(height):
        ds = rv.simulate(height, RUBBER, program, boundary="periodic", numerics=numerics, progress=False)
        return {line.partition(": ")[0] for line in ds.attrs["warnings"].splitlines()}

    for missing, own in ((26, {"filled"}), (25, set())):  # of 504 points, with a limit of 5 %
        holed = tilted.copy(deep=True)
        holed.values.flat[: 19 * missing : 19] = np.nan
        assert subjects(rv.fill(holed)) == {"border", "slope", "tolerance"} | own
    assert "filled" in subjects(rv.mirror(rv.fill(tilted.where(tilted.x > 1e-4))))
