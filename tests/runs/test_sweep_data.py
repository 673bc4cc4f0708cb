"""All results of a sweep as one Dataset, in numbers and labels those of the single results."""

import json
import shutil
import threading
from functools import partial

import numpy as np
import pytest
import xarray as xr
from support import BALL, FRICTION, LOADS, ROUGH, refused

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.runs import sweep_data
from roughvisc.runs.netcdf import open_result, write_result
from roughvisc.runs.run import attempt
from roughvisc.runs.sweep import sweep
from roughvisc.runs.sweep_data import INDEX, SWEEP, index_of, read_entry
from roughvisc.study.case import vary

SMALL = BALL.replace("[24, 21]", "[12, 9]").replace("[keep]", "tolerance = 1e-2\n[keep]")
OWN_TIMES = (
    SMALL.replace("over = 0", 'over = "10 ms"')
    .replace('[0, "0.1 s", "200 ms"]', '"all"')
    .replace('"displacement"', '"gap"')
    + """
[sweep]
"program.0.load" = ["4 mN", "5 mN"]
"program.0.over" = ["10 ms", "50 ms"]
"program.1.hold" = ["0.1 s", "10 s"]
"""
)


@pytest.fixture(scope="module")
def own_times(tmp_path_factory):
    """Folder and results of a sweep over ramps and holds: each case keeps every step of its own."""
    folder = tmp_path_factory.mktemp("own_times")
    (folder / "study.toml").write_text(OWN_TIMES)
    return folder / "out", rv.sweep(folder / "study.toml", folder / "out", workers=0, progress=False)


def test_own_times__each_case_is_its_result_and_missing_after_it(own_times):
    folder, ds = own_times
    assert ds.pressure.dims == ("case", "row", "x", "y")
    assert ds.time.dims == ds.force.dims == ds.work_error.dims == ("case", "row")
    assert ds.case.values.tolist() == list(range(8))
    assert len(set(ds.rows.values)) > 1
    assert ds.pressure.chunks is not None
    for number, one in ds.groupby("case", squeeze=False):
        with open_result(folder / f"{one.case_key.item()}.nc") as alone:
            count = alone.sizes["time"]
            assert one.rows.item() == count
            assert one.time[0, count - 1] == one.program_0_over + one.program_1_hold
            for name in ("time", "force", "contact_area", "work_error", "pressure"):
                np.testing.assert_array_equal(one[name][0, :count], alone[name], str(number))
                assert one[name][0, count:].isnull().all(), name
            np.testing.assert_array_equal(ds.height, alone.height)


@pytest.mark.thorough
def test_own_times__have_observables_as_each_result(own_times):
    folder, ds = own_times
    case = int(ds.rows.values.argmin())
    count = int(ds.rows[case])
    derive = {
        "clusters": rv.observables.clusters,
        "gaps": partial(rv.observables.distribution, name="gap"),
        "leakage": lambda one: rv.observables.leakage(one, viscosity=1e-3, pressure_drop=1e5),
    }
    with open_result(folder / f"{ds.case_key[case].item()}.nc") as alone:
        for name, function in derive.items():
            found, wanted = function(ds.isel(case=[case])).isel(case=0), function(alone)
            for variable in wanted.data_vars:
                if "time" in wanted[variable].dims:
                    np.testing.assert_allclose(found[variable][:count], wanted[variable], 1e-12, err_msg=name)
                    assert found[variable][count:].isnull().all(), variable


def test_selected_case__is_judged_as_its_file(tmp_path):
    """Its attributes, its recipe, its steps and its own rows, although those of other cases differ."""
    cycle = '[[program]]\ncycle = { mean = "5 mN", amplitude = "2 mN", period = "0.1 s", cycles = 2 }\n'
    text = (
        SMALL.replace('[[program]]\nhold = "0.2 s"\n', cycle)
        .replace("level = 0", "")
        .replace('[0, "0.1 s", "200 ms"]', '[0, "0.13 s"]')
    )
    text = text.replace('boundary = "free"\n', "") + '[audit]\ndensity = "1 g/cm^3"\nthickness = "1 mm"\n'
    sweeps = (
        '"surface.radius" = ["10 mm", "5 mm"]\n"program.1.cycle.period" = ["0.1 s", "0.2 s"]',
        '"keep.times" = [["0.13 s"], [0, "0.11 s", "0.15 s"]]',
    )
    named = ("radius 10 mm", "radius 5 mm"), ("times", "times")
    for number, keys in enumerate(sweeps):
        (tmp_path / f"{number}.toml").write_text(f"{text}[sweep]\n{keys}\n")
        ds = rv.sweep(tmp_path / f"{number}.toml", workers=0, progress=False)
        for case, value in zip((ds.isel(case=0), ds.isel(case=-1)), named[number], strict=True):
            alone = rv.open_result(tmp_path / "results" / str(number) / f"{case.case_key.item()}.nc")
            xr.testing.assert_identical(rv.observables.cycle_work(case), rv.observables.cycle_work(alone))
            xr.testing.assert_identical(case.roughvisc.steps, alone.roughvisc.steps)
            xr.testing.assert_identical(rv.audit(case), rv.audit(alone))
            assert value in rv.audit(case).attrs["title"], "varied values as a person would write them"
            assert rv.to_csv(case, tmp_path / "a.csv").read_text() == rv.to_csv(alone, tmp_path / "b.csv").read_text()


def test_clusters__of_cases_with_different_boundaries_are_refused(tmp_path):
    """Across the border they are one cluster under one boundary, two under the other."""
    text = ROUGH.replace("displacement", "gap") + '[sweep]\n"solve.boundary" = ["periodic", "mirror"]\n'
    (tmp_path / "rough.toml").write_text(text)
    ds = rv.sweep(tmp_path / "rough.toml", workers=0, progress=False)
    with refused("boundary"):
        rv.observables.clusters(ds)
    for case in (ds.isel(case=0), ds.isel(case=1)):
        alone = rv.open_result(tmp_path / "results/rough" / f"{case.case_key.item()}.nc")
        found, wanted = rv.observables.clusters(case), rv.observables.clusters(alone)
        np.testing.assert_array_equal(found.cluster_count, wanted.cluster_count)


def test_own_speeds__are_rows(tmp_path):
    speeds = '[[sweep]]\n"friction.speeds" = [["1 mm/s", "10 mm/s"], ["1 mm/s", "2 mm/s", "5 mm/s"]]\n'
    (tmp_path / "slide.toml").write_text(FRICTION + speeds)
    ds = rv.sweep(tmp_path / "slide.toml", tmp_path / "out", workers=0, progress=False)
    assert ds.friction_coefficient.dims == ds.speed.dims == ("case", "row")
    assert ds.rows.values.tolist() == [2, 3]
    np.testing.assert_array_equal(ds.speed, [[1e-3, 1e-2, np.nan], [1e-3, 2e-3, 5e-3]])
    assert ds.friction_coefficient[0, 0] == ds.friction_coefficient[1, 0]
    assert ds.friction_coefficient.notnull().equals(ds.speed.notnull())


def test_open_results__on_different_grids_has_histories(study, tmp_path, caplog):
    cases = study(SMALL + '[sweep]\n"surface.shape" = [[12, 9], [16, 12]]\n')
    ds = sweep(cases, tmp_path / "out", workers=0, progress=False)
    assert ds.contact_area.dims == ("case", "time")
    assert not {"x", "y", "pressure", "height"} & set(ds.variables)
    assert "12 x 9 cells" in caplog.text
    assert "16 x 12 cells" in caplog.text


@pytest.mark.parametrize("text", [BALL, FRICTION])
def test_entry__of_a_computed_result_is_that_of_its_file(study, tmp_path, text):
    (case,) = study(text)
    outcome = attempt(case, tmp_path, progress=lambda *_: None)
    entry = read_entry(tmp_path / f"{case.key}.nc")
    assert outcome.entry.key == case.key
    for name in ("file", "stamp", "attributes", "of_height", "fields"):
        assert getattr(outcome.entry, name) == getattr(entry, name), name
    assert outcome.entry.arrays.keys() == entry.arrays.keys()
    for name, values in entry.arrays.items():
        assert outcome.entry.arrays[name].dtype == values.dtype, name
        np.testing.assert_array_equal(outcome.entry.arrays[name], values)


def test_numbers__of_cases_are_those_of_the_study_if_one_is_missing(study, tmp_path):
    cases = study(SMALL + LOADS)
    sweep(cases, tmp_path / "out", workers=0, progress=False)
    (tmp_path / "out" / f"{cases[1].key}.nc").unlink()
    ds, table = rv.open_results(tmp_path / "out"), rv.to_table(tmp_path / "out")
    assert ds.case.values.tolist() == [0, 2, 3]
    assert table.index[table["status"] == "converged"].tolist() == [0, 2, 3]
    np.testing.assert_array_equal(table.loc[ds.case.values, "force [N]"], ds.force[:, -1])


def test_list_of_cases__damaged_is_refused(study, tmp_path):
    out = tmp_path / "out"
    sweep(study(SMALL + LOADS), out, workers=0, progress=False)
    whole = (out / SWEEP).read_bytes()
    for content in (whole[:-3], b"[]", whole.replace(whole[20:24], b"abcd")):
        (out / SWEEP).write_bytes(content)
        for read in (rv.open_results, rv.to_table):
            with refused(SWEEP):
                read(out)
    (out / SWEEP).write_bytes(whole)
    assert rv.open_results(out).sizes["case"] == 4


def synthetic(folder, loads=10, seeds=6, template=None, shape=(8, 6), times=4):
    """Results of a sweep over loads and seeds, made up: fast to write, in the form that a run writes."""
    rng = np.random.default_rng(1)
    series = {
        name: ("time", rng.random(times)) for name in ("force", "approach", "residual", "time_error", "wall_time")
    }
    ds = xr.Dataset(
        {
            **series,
            "status": ("time", np.zeros(times, "int8")),
            "height": (("x", "y"), rng.random(shape)),
            "pressure": (("time", "x", "y"), rng.random((times, *shape))),
        },
        coords={"time": np.arange(times) * 0.1, "x": np.arange(shape[0]) * 1e-6, "y": np.arange(shape[1]) * 1e-6},
    )
    surface = {"generate": "self_affine", "size": [1e-3, 1e-3], "hurst": 0.8, "seed": 0}
    for i in range(loads):
        for j in range(seeds):
            case = {
                "title": "made up",
                "surface": {**surface, "seed": j},
                "program": [{"load": 0.5 * (i + 1), "over": 0.1}, {"hold": 1.0}],
                "varied": {"program.0.load": 0.5 * (i + 1), "surface.seed": j},
            }
            ds.attrs = {"case": json.dumps(case), "case_key": f"{i:08x}{j:08x}", "boundary": "periodic"}
            ds["force"][:] = 0.5 * (i + 1)
            ds["pressure"][:] = i + 100 * j
            write_result(ds, folder / f"{i:08x}{j:08x}.nc")
    return folder


@pytest.fixture(scope="module")
def sixty(tmp_path_factory):
    folder = synthetic(tmp_path_factory.mktemp("sixty"))
    rv.open_results(folder)
    return folder


def test_open_results__varied_parameters_are_coordinates(sixty):
    ds = rv.open_results(sixty)
    assert ds.sizes == {"case": 60, "time": 4, "x": 8, "y": 6}
    assert ds.pressure.dims == ("case", "time", "x", "y")
    assert ds.pressure.chunks is not None
    assert ds.height.dims == ("case", "x", "y"), "the seed changes the surface"
    assert ds.attrs["title"] == "made up"
    assert ds.pressure.attrs["units"] == "Pa"
    grid = ds.set_index(case=["program_0_load", "surface_seed"]).unstack("case")
    assert (grid.sizes["program_0_load"], grid.sizes["surface_seed"]) == (10, 6)
    picked = grid.pressure.sel({"program_0_load": 2.0, "surface_seed": 4}).isel(time=-1)
    assert (picked.values == 403).all()
    loads = ds.set_xindex("program_0_load").sel(program_0_load=1.5)
    assert loads.sizes["case"] == 6
    assert (loads.force == 1.5).all()
    assert ds.sel(time=0.2).pressure.max("case").compute().shape == (8, 6)


def test_open_results__reads_no_file_that_the_index_knows(sixty, monkeypatch):
    import netCDF4

    def forbidden(*args, **settings):
        raise AssertionError("a result was opened")

    monkeypatch.setattr(netCDF4, "Dataset", forbidden)
    ds = rv.open_results(sixty)
    assert len(rv.to_table(sixty)) == 60
    assert float(ds.force.sum()) == pytest.approx(0.5 * 55 * 6 * 4)
    with pytest.raises(AssertionError, match="a result was opened"):
        ds.pressure.compute(scheduler="sync")


@pytest.mark.thorough
def test_open_results__index_follows_the_files(sixty, tmp_path, caplog):
    folder = tmp_path / "copy"
    shutil.copytree(sixty, folder)
    paths = sorted(folder.glob("*.nc"))
    paths[0].unlink()
    paths[1].write_bytes(b"cut short")
    assert rv.open_results(folder).sizes["case"] == 58
    assert f"{paths[1]}: is damaged" in caplog.text
    (folder / INDEX).write_bytes(b"nonsense")
    assert rv.open_results(folder).sizes["case"] == 58
    with open_result(paths[2]) as ds:
        changed = ds.load()
    changed["force"][:] = 77.0
    write_result(changed, paths[2])
    assert (rv.open_results(folder).force == 77.0).any()
    folder.chmod(0o500)
    (folder / INDEX).chmod(0o400)
    assert rv.open_results(folder).sizes["case"] == 58
    folder.chmod(0o700)


def test_open_results__a_file_made_from_a_result_is_none(sixty, tmp_path, caplog):
    folder = tmp_path / "copy"
    shutil.copytree(sixty, folder)
    key = f"{3:08x}{2:08x}"
    with open_result(folder / f"{key}.nc") as ds:
        derived = ds.load()
    derived["force"][:] = 77.0
    for name in ("000-mean.nc", f"{'f' * 16}.nc", "zz.nc"):
        write_result(derived, folder / name)
    (folder / INDEX).unlink()
    ds = rv.open_results(folder)
    assert ds.sizes["case"] == 60
    assert float(ds.force.max()) == 5.0
    assert f"{'f' * 16}.nc: holds the result of case {key}" in caplog.text


def test_open_results__of_the_last_sweep_or_of_some_cases(study, tmp_path):
    out = tmp_path / "out"
    cases = study(SMALL + LOADS)
    sweep(cases, out, workers=0, progress=False)
    tighter = [vary(case, {"solve.tolerance": 2e-3}) for case in cases[:2]]
    assert sweep(tighter, out, workers=0, progress=False).sizes["case"] == 2
    assert list(rv.open_results(out)["solve_tolerance"]) == [2e-3, 2e-3]
    reversed_ = rv.open_results(out, cases=cases[::-1])
    assert list(reversed_.case_key) == [case.key for case in cases[::-1]]


def test_open_results__numbers_strings_and_what_some_cases_lack(study, tmp_path):
    text = (
        BALL
        + '[[sweep]]\n"surface.radius" = ["10 mm", "12 mm"]\n'
        + '[[sweep]]\n"solve.edge" = "accept"\n"material.poisson" = [0.4]\n'
    )
    ds = sweep(study(text), tmp_path / "out", workers=0, progress=False)
    assert list(ds["surface_radius"].values) == [10e-3, 12e-3, 10e-3]
    assert list(ds["solve_edge"].values) == ["", "", "accept"], "the others do not state it"
    np.testing.assert_array_equal(ds["material_poisson"], [np.nan, np.nan, 0.4])
    assert ds.height.dims == ("case", "x", "y")


def test_open_results__nothing_there(tmp_path):
    with pytest.raises(InputError, match="holds no results"):
        rv.open_results(tmp_path)
    with pytest.raises(InputError, match="does not exist: expected a folder with results"):
        rv.open_results(tmp_path / "gone")


def test_open_results__a_client_reads_many_results(sixty, tmp_path, monkeypatch):
    """The workers make the index with the same entries; this process reads only a file that they cannot."""
    from distributed import Client

    folder = shutil.copytree(sixty, tmp_path / "out", ignore=shutil.ignore_patterns(INDEX))
    wanted = index_of(sixty)
    monkeypatch.setattr(sweep_data, "_MANY", 60)
    with Client(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None):
        read_by = []
        read = sweep_data.read_entry
        monkeypatch.setattr(
            sweep_data, "read_entry", lambda path: read_by.append(threading.current_thread()) or read(path)
        )
        found = index_of(folder)
    assert found.keys() == wanted.keys()
    assert all(found[key].attributes == wanted[key].attributes for key in wanted)
    assert len(read_by) == 60
    assert threading.main_thread() not in read_by
