"""Disks that are full or may only be read: one message, and nothing lost when there is room again."""

import os
from pathlib import Path

import pytest
from support import SMALL

import roughvisc as rv

TWO_LOADS = SMALL + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "two.toml"
    path.write_text(TWO_LOADS)
    return path


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


def test_folder_that_may_not_be_written__is_read_and_refused_for_a_run(study, tmp_path, invoke, protected):
    folder = tmp_path / "results"
    assert invoke("run", study, "--out", folder, "--workers", "0", "-q") == (0, "", "")
    one = tmp_path / "one.toml"
    one.write_text(TWO_LOADS[: TWO_LOADS.index("[sweep]")])
    before = everything(folder)
    protected(folder)
    assert rv.run(one, folder, progress=False).sizes["time"] == 3
    assert rv.open_results(folder).sizes["case"] == 2
    one.write_text(one.read_text().replace("5 mN", "7 mN"))
    for path in (study, one):
        status, out, err = invoke("run", path, "--out", folder, "-q")
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert str(folder) in err
    assert everything(folder) == before
