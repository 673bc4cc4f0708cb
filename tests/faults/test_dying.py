"""Runs that are killed or refused a file: the next run ends with the same bits."""

import os

import pytest
import xarray as xr
from dying import struck
from support import SMALL, with_steps

from roughvisc.runs.folder import clean_folder
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.run import run_case
from roughvisc.study.case import read_study

WAYS = ("kill", "ENOSPC", "EROFS", "EIO", "MemoryError")

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")


@pytest.fixture
def case(tmp_path):
    (tmp_path / "ball.toml").write_text(SMALL)
    return read_study(tmp_path / "ball.toml")


@pytest.fixture
def wanted(case, tmp_path):
    with open_result(run_case(case, tmp_path / "wanted")) as ds:
        return with_steps(ds)


@pytest.mark.timeout(7200)  # the large one: some 700 runs
@pytest.mark.parametrize(
    "most", [pytest.param("2", marks=pytest.mark.thorough), pytest.param("all", marks=pytest.mark.long)]
)
def test_at_a_file_operation(case, wanted, tmp_path, most):
    lines = struck(tmp_path / "ball.toml", tmp_path, most, *WAYS)
    assert len(lines) == 2 * len(WAYS) if most == "2" else len(lines) > 30 * len(WAYS)
    for way, at, end in lines:
        assert end == "killed" if way == "kill" else "TRACEBACK" not in end
        folder = tmp_path / way / at
        with open_result(run_case(case, folder)) as found:
            xr.testing.assert_equal(with_steps(found), wanted)
        clean_folder(folder)
        assert [path.name for path in folder.iterdir()] == [f"{case.key}.nc"], (way, at, end)
