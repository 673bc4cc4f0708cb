"""What was varied labels every result file, in a way that xarray takes without this package."""

import netCDF4
import pytest
import xarray as xr
from support import BALL

import roughvisc as rv
from roughvisc.arguments import arguments
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.study.case import read_study, vary
from roughvisc.study.study_file import TABLES
from roughvisc.variables import VARIABLES

SMALL = BALL.replace("[24, 21]", "[12, 9]").replace("[keep]", "tolerance = 1e-2\n[keep]")
SWEEP = """
[sweep]
"program.0.load" = ["2 mN", "1 mN"]
"solve.edge" = ["error", "accept"]
"""
TOGETHER = {"concat_dim": "case", "data_vars": "all", "coords": "different", "compat": "equals", "join": "outer"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of a sweep of four cases, which take different numbers of steps."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "balls.toml").write_text(SMALL + SWEEP)
    rv.sweep(folder / "balls.toml", folder / "out", workers=0, progress=False)
    return folder / "out"


def test_file__of_a_varied_case_is_labelled(tmp_path):
    (tmp_path / "ball.toml").write_text(SMALL)
    case = vary(read_study(tmp_path / "ball.toml"), {"program.0.load": "2 mN", "program.1": {"hold": "0.3 s"}})
    path = rv.run(case, tmp_path, progress=False).encoding["source"]
    with xr.open_dataset(path) as ds:  # by xarray as it comes
        scalar = {name: one.item() for name, one in ds.coords.items() if not one.dims}
        assert ds.attrs["case_key"] == case.key
        assert scalar["program_0_load"] == 2e-3
        assert ds.program_0_load.attrs == {"long_name": "program.0.load", "units": "N"}
        assert '"hold": 0.3' in scalar["program_1"], "a table as JSON"
        assert set(scalar) == {"program_0_load", "program_1"}
    with netCDF4.Dataset(path) as file:
        assert str not in {one.dtype for one in file.variables.values()}, "netCDF4 crashes on strings of any length"
        assert {
            one.coordinates for one in file.variables.values() if "time" in one.dimensions[:1] and one.ndim > 1
        } == {"program_0_load program_1"}


_NEW = "use_new_combine_kwarg_defaults"


@pytest.mark.parametrize("options", [{}, *([{_NEW: True}] if _NEW in xr.get_options() else [])], ids=str)
def test_files__open_together_by_xarray_alone(folder, options):
    with (
        xr.set_options(**options),
        xr.open_mfdataset(f"{folder}/*.nc", combine="nested", **TOGETHER) as ds,
    ):
        assert sorted(ds.program_0_load.values) == [1e-3, 1e-3, 2e-3, 2e-3]
        accepted = ds.sel(case=ds.solve_edge == "accept").sortby("program_0_load")
        assert accepted.force.isel(time=-1).values == pytest.approx([1e-3, 2e-3], rel=1e-12)
        areas = ds.contact_area.isel(time=-1).groupby("program_0_load").mean().load()
        assert areas.sel(program_0_load=2e-3) > areas.sel(program_0_load=1e-3)
        frame = ds[["force"]].to_dataframe()
        assert len(frame.query("program_0_load > 1.5e-3 and solve_edge == 'error'")) == ds.sizes["time"]
        apart = ds[["force", "contact_area"]].set_index(case=["program_0_load", "solve_edge"]).unstack()
        assert apart.force.sel(program_0_load=1e-3, solve_edge="error")[0].values == pytest.approx(1e-3, rel=1e-12)
        ours = rv.plot.sweep(ds.load(), "contact_area", along="program_0_load")
        theirs = rv.plot.sweep(rv.open_results(folder), "contact_area", along="program.0.load")
        assert [ax.get_xlabel() for ax in ours.axes] == [ax.get_xlabel() for ax in theirs.axes]
        assert ours.axes[0].get_xlabel() == "Load [mN]"


def test_labels__are_apart_from_all_variables():
    tables = {f"{name}_" for name in TABLES if name != "friction"}
    names = {*VARIABLES}
    assert not [name for name in names if any(name.startswith(table) for table in tables)]
    assert not names & {f"friction_{key}" for key in arguments(SteadySliding)}
    assert not {*VARIABLES} & {*TABLES}
