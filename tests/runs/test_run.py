"""One case to one file: what the file says of itself, and what happens when something goes wrong."""

import pytest
import xarray as xr
from support import BALL, with_steps

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.runs import run as run_module
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.run import result_folder
from roughvisc.study.case import Case, read_study


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "ball.toml"
    path.write_text(BALL)
    return path


def test_run__keeps_a_file_that_is_whole_in_itself(study):
    ds = rv.run(study, progress=False)
    case = read_study(study)
    path = study.parent / "results" / "ball" / f"{case.key}.nc"
    assert ds.encoding["source"] == str(path)
    with open_result(path) as read:
        xr.testing.assert_identical(read.load().drop_encoding(), ds.drop_encoding())
        assert {name: read.sizes[name] for name in ("time", "x", "y")} == {"time": 3, "x": 24, "y": 21}
        assert read.attrs["title"] == "A ball"
        assert read.attrs["source"].startswith(f"roughvisc {rv.__version__} (numerics ")
        assert "generated: sphere\n" in read.attrs["history"]
        assert read.attrs["history"].endswith("run of ball.toml")
        assert read.attrs["case_key"] == case.key
        assert read.attrs["surface_sha256"] == case.surface_sha256
        assert (read.attrs["boundary"], read.attrs["tolerance"]) == ("free", 1e-3)
        again = Case.from_json(read.attrs["case"], path.parent)
        assert str(study.parent) not in str(read.attrs)
    assert again == case
    xr.testing.assert_equal(with_steps(rv.run(again, study.parent / "other", progress=False)), with_steps(ds))


def test_run__equals_simulate(study):
    ds = rv.run(study, progress=False)
    direct = rv.simulate(
        rv.level(rv.sphere(10e-3, 1e-3, (24, 21)), 0),
        rv.zener(3e6, 1e6, 1e5),
        rv.Program().load(5e-3, over=0).hold(0.2),
        boundary="free",
        fields=("pressure", "displacement"),
        times=[0, 0.1, 0.2],
        progress=False,
    )
    xr.testing.assert_equal(with_steps(ds), with_steps(direct))


def test_result_folder__is_refused_before_anything_is_computed(study, tmp_path):
    case = read_study(study)
    assert result_folder(case) == tmp_path / "results" / "ball"
    assert result_folder(case, "here") == run_module.Path("here")
    assert result_folder(case.with_fields(origin=None)) == run_module.Path("results/a-ball")
    with pytest.raises(InputError, match=r"ball\.toml: is a file: expected a folder"):
        result_folder(case, study / "below")
