"""A folder that may only be read: its results are read, a new run is refused, and nothing in it changes."""

import os
from pathlib import Path

from support import SMALL

import roughvisc as rv


def everything(folder):
    """Names, times of change and bytes of all that a folder holds."""
    found = sorted(folder.rglob("*"))
    return [(str(one), one.lstat().st_mtime_ns, one.read_bytes() if one.is_file() else b"") for one in found]


def test_folder_that_may_not_be_written__is_read_and_refused_for_a_run(tmp_path, invoke, monkeypatch):
    """Declared so to the package, because permissions do not stop every user."""
    folder, one, two = (tmp_path / name for name in ("results", "one.toml", "two.toml"))
    one.write_text(SMALL)
    two.write_text(SMALL + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n')
    assert invoke("run", two, "--out", folder, "--workers", "0", "-q") == (0, "", "")
    before, access = everything(folder), os.access
    monkeypatch.setattr(os, "access", lambda path, mode: (mode, Path(path)) != (os.W_OK, folder) and access(path, mode))
    assert rv.run(one, folder, progress=False).sizes["time"] == 3
    assert rv.open_results(folder).sizes["case"] == 2
    one.write_text(SMALL.replace("5 mN", "7 mN"))
    for path in (two, one):
        status, out, err = invoke("run", path, "--out", folder, "-q")
        assert (status, out, err.count("\n"), str(folder) in err) == (2, "", 1, True)
    assert everything(folder) == before
