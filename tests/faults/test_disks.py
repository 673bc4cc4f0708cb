"""Disks that are full or may only be read: one message, and nothing lost when there is room again."""

import pytest
import xarray as xr
from support import BALL

import roughvisc as rv
from roughvisc.study.execution.run import run_case
from roughvisc.study.statement.case import read_cases

TWO_LOADS = BALL.replace("[24, 21]", "[12, 9]") + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "two.toml"
    path.write_text(TWO_LOADS)
    return path


def results(folder):
    return rv.open_results(folder).drop_vars("wall_time").load()


@pytest.mark.parametrize("workers", ["0", pytest.param("2", marks=pytest.mark.long)])
def test_sweep__on_a_full_disk(study, tmp_path, small_disk, invoke, workers):
    folder, remount = small_disk
    assert invoke("run", study, "--out", tmp_path / "wanted", "--workers", "0", "-q")[0] == 0
    for size in ("16k", "80k", "120k"):
        remount(f"size={size}")
        status, out, err = invoke("run", study, "--out", folder, "--workers", workers, "-q")
        assert (status, out) == (1, "")
        assert "No space left on device" in err.splitlines()[-1]
        assert "Traceback" not in err
    remount("size=20m")
    assert invoke("run", study, "--out", folder, "--workers", workers, "-q") == (0, "", "")
    xr.testing.assert_equal(results(folder), results(tmp_path / "wanted"))


def test_sweep__on_a_disk_that_may_only_be_read(study, tmp_path, small_disk, invoke):
    folder, remount = small_disk
    remount("size=20m")
    first, second = read_cases(study)
    run_case(first, folder)
    wanted = results(folder)
    remount("ro")
    status, out, err = invoke("run", study, "--out", folder, "-q")
    assert (status, out) == (2, "")
    assert err.endswith("disk: may not be written to: expected a folder with write permission\n")
    assert err.count("\n") == 1
    with pytest.raises(OSError, match="Read-only file system"):
        run_case(second, folder)
    assert run_case(first, folder).exists(), "finished: nothing is written"
    xr.testing.assert_equal(results(folder), wanted)
    assert invoke("verify", folder)[0] == 0
    remount("rw")
    assert invoke("run", study, "--out", folder, "--workers", "0", "-q") == (0, "", "")
    assert invoke("run", study, "--out", tmp_path / "wanted", "--workers", "0", "-q")[0] == 0
    xr.testing.assert_equal(results(folder), results(tmp_path / "wanted"))
