"""Disks that are full or may only be read: one message, and nothing lost when there is room again."""

import os
from pathlib import Path

import pytest
import xarray as xr
from support import SMALL

import roughvisc as rv
from roughvisc.study.case import read_cases

TWO_LOADS = SMALL + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "two.toml"
    path.write_text(TWO_LOADS)
    return path


def results(folder):
    return rv.open_results(folder).drop_vars("wall_time").load()


@pytest.mark.thorough
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


def everything(folder):
    """Names, times of change and bytes of all that a folder holds."""
    found = sorted(folder.rglob("*"))
    return [(str(one), one.lstat().st_mtime_ns, one.read_bytes() if one.is_file() else b"") for one in found]


@pytest.fixture
def protected(monkeypatch):
    """Has a folder be one that is not writable by its permissions, which do not stop everybody."""
    access = os.access

    def protect(folder):
        monkeypatch.setattr(
            os, "access", lambda path, mode: (mode != os.W_OK or Path(path) != folder) and access(path, mode)
        )

    return protect


def test_run__shows_what_is_finished_in_a_folder_that_may_not_be_written(study, tmp_path, invoke, protected, caplog):
    folder = tmp_path / "results"
    assert invoke("run", study, "--out", folder, "--workers", "0", "-q") == (0, "", "")
    one = tmp_path / "one.toml"
    one.write_text(TWO_LOADS[: TWO_LOADS.index("[sweep]")])
    (key,) = {case.key for case in read_cases(one)}
    (folder / f".{key}.unfinished").mkdir()  # which a run would remove
    before = everything(folder)
    protected(folder)
    for path in (study, one):
        status, out, err = invoke("run", path, "--out", folder, "-q")
        assert (status, out, err.count("\n")) == (0, "", 1), err
    assert rv.run(one, folder, progress=False).sizes["time"] == 3
    assert "cannot be written" not in caplog.text
    study.write_text(TWO_LOADS.replace("4 mN", "6 mN"))
    one.write_text(one.read_text().replace("5 mN", "7 mN"))
    for path in (study, one):
        status, out, err = invoke("run", path, "--out", folder, "-q")
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert str(folder) in err
    assert everything(folder) == before
