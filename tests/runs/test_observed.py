"""``[observe]`` after a run: what a study asks for stands in the files of its results."""

import json

import numpy as np
import pytest
import xarray as xr
from support import BALL, ROUGH

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.plot.save import save_sweep_figures
from roughvisc.study.case import read_cases

#: It is pressed until nothing is open.
STUDY = ROUGH.replace('load = "10 mN"', 'pressure = "1 kPa"\nover = 0\n[[program]]\npressure = "2 MPa"')
LEAKAGE = '[observe.leakage]\nviscosity = "1 mPa s"\npressure_drop = "1 bar"\n'
LOADS = '[sweep]\n"program.0.pressure" = ["1 kPa", "2 kPa"]\n'


@pytest.fixture
def study(tmp_path):
    def written(text):
        path = tmp_path / "seal.toml"
        path.write_text(STUDY + text)
        return path

    return written


def test_run__ends_with_what_is_observed(invoke, study, tmp_path, coarse_pictures):
    status, told, _ = invoke("run", study(LEAKAGE), "--out", "out")
    assert status == 0
    assert "Leak rate at the end" in told
    (path,) = (tmp_path / "out").glob("*.nc")
    assert (tmp_path / "out" / f"{path.stem}-leakage.png").exists()
    with rv.open_result(path) as ds:
        assert ds.leak_rate[0] > 0
        assert (ds.leak_rate > 0).values.tolist() == [True, False, False]
        assert ds.leak_rate.attrs["viscosity"] == 1e-3
        assert json.loads(ds.attrs["observed"]) == {"leakage": {"viscosity": 1e-3, "pressure_drop": 1e5}}
        xr.testing.assert_allclose(ds.leak_rate, rv.observables.leakage(ds).leak_rate, rtol=1e-12, atol=0)
    written = path.stat().st_mtime_ns
    assert invoke("run", study(LEAKAGE), "--out", "out", "--no-plots")[0] == 0
    assert path.stat().st_mtime_ns == written, "nothing was asked anew"


def test_another_viscosity__keeps_the_run(invoke, study, tmp_path, solved_on):
    assert invoke("run", study(LEAKAGE), "--out", "out", "--no-plots")[0] == 0
    (path,) = (tmp_path / "out").glob("*.nc")
    with rv.open_result(path) as ds:
        before = ds.load()
    solved_on.clear()
    thick = LEAKAGE.replace("1 mPa s", "4 mPa s")
    status, told, _ = invoke("run", study(thick), "--out", "out", "--no-plots")
    assert (status, solved_on) == (0, [])
    assert "Already finished" in told
    with rv.open_result(path) as ds:
        np.testing.assert_allclose(4 * ds.leak_rate, before.leak_rate, rtol=1e-12, atol=0)
        assert json.loads(ds.attrs["case"])["observe"]["leakage"]["viscosity"] == 4e-3
        names = [name for name in before.variables if not name.startswith("leak_rate")]
        xr.testing.assert_identical(before[names].drop_attrs(), ds[names].load().drop_attrs())


@pytest.mark.thorough
def test_sweep__has_it_in_table_results_and_figures(invoke, study, tmp_path, coarse_pictures):
    assert invoke("run", study(LEAKAGE + LOADS), "--out", "out", "--workers", 0)[0] == 0
    results = rv.open_results(tmp_path / "out")
    assert results.leak_rate.dims == ("case", "time")
    assert (results.leak_rate[:, 0] > 0).all()
    heading, *rows = (tmp_path / "out" / "cases.csv").read_text(encoding="utf-8-sig").splitlines()
    assert "leak_rate [m^3/s]" in heading
    assert len(rows) == 2
    written = [path.name for path in save_sweep_figures(results, tmp_path / "figures")]
    assert "sweep-leak_rate-time.png" in written


def test_run_and_sweep__compute_what_is_observed(study, tmp_path):
    """As ``roughvisc run`` does; after a change of the viscosity `observe` changes the files alone."""
    assert (rv.run(study(LEAKAGE), tmp_path / "one", progress=False).leak_rate[0] > 0).all()
    swept = rv.sweep(study(LEAKAGE + LOADS), tmp_path / "out", workers=0, progress=False)
    assert (swept.leak_rate[:, 0] > 0).all()
    path = study(LEAKAGE.replace("1 mPa s", "4 mPa s") + LOADS)
    told = []
    added = rv.observe(path, tmp_path / "out", progress=lambda done, of: told.append((done, of)))
    assert sorted(one.stem for one in added) == sorted(case.key for case in read_cases(path))
    assert told == [(0, 2), (1, 2)]
    assert rv.observe(path, tmp_path / "out", progress=False) == []
    assert all(rv.open_result(one).roughvisc.steps.sizes["step"] > 3 for one in added), "the steps stay in the file"
    np.testing.assert_allclose(4 * rv.open_results(tmp_path / "out").leak_rate, swept.leak_rate, rtol=1e-12, atol=0)


def test_observe__refuses_absent_cells_and_leaves_the_result(invoke, study, tmp_path):
    punch = BALL.replace("sphere", "flat_punch").replace("10 mm", "0.3 mm").replace("displacement", "gap")
    path = study("")
    path.write_text(punch + LEAKAGE)
    status, _, complaint = invoke("run", path, "--out", "out", "--no-plots")
    assert status == 2
    assert "where the surface is absent" in complaint
    (file,) = (tmp_path / "out").glob("*.nc")
    with rv.open_result(file) as ds:
        assert "leak_rate" not in ds
    with pytest.raises(InputError, match="where the surface is absent"):
        rv.observe(path, tmp_path / "out")


@pytest.mark.thorough
def test_two_observers_of_one_file__lose_nothing(study, tmp_path, monkeypatch):
    """The second begins while the first computes: it is refused, and adds its own afterwards."""
    from roughvisc.observables import OBSERVABLES

    fields = 'fields = ["pressure", "gap"]\n'
    one = read_cases(study(fields + LEAKAGE))
    two = read_cases(study(fields + "[observe.conductance]\nresistivity = [1.0, 1.0]\n"))
    (unobserved,) = read_cases(study(fields))  # the same key
    rv.run(unobserved, tmp_path / "out", progress=False)
    plain, refused = rv.observables.leakage, []

    def meanwhile(*given, **named):
        monkeypatch.setitem(OBSERVABLES, "leakage", plain)
        try:
            rv.observe(two, tmp_path / "out")
        except BlockingIOError as error:
            refused.append(error)
        return plain(*given, **named)

    monkeypatch.setitem(OBSERVABLES, "leakage", meanwhile)
    (path,) = rv.observe(one, tmp_path / "out")
    assert refused
    rv.observe(two, tmp_path / "out")
    with rv.open_result(path) as ds:
        assert {"leak_rate", "thermal_conductance"} <= set(ds)
