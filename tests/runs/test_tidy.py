"""Nothing stays behind: what a killed run left is removed, and what somebody needs is not."""

import os
import time

import pytest
from sample_results import hertz_creep

from roughvisc.runs.folder import clean_folder, lock_case
from roughvisc.runs.netcdf import write_result

KEYS = [f"{i:016x}" for i in range(4)]


def leave(folder, key, *, checkpoint=True):
    """What a run of a case leaves that is killed at its worst moment."""
    (folder / f".{key}.unfinished").mkdir(parents=True)
    (folder / f".{key}.unfinished" / ("state.npz" if checkpoint else "rows-0000.npz")).write_bytes(b"0")
    (folder / f".{key}.lock").write_text("")
    (folder / f".{key}.1a2b3c4d.part.nc").write_bytes(b"0")
    (folder / f".{key}.failed.1a2b3c4d.part.json").write_bytes(b"0")


@pytest.fixture
def folder(tmp_path):
    """A finished case, an unfinished one, one that has nothing to go on from, a failed one."""
    out = tmp_path / "out"
    for key in KEYS[:3]:
        leave(out, key, checkpoint=key != KEYS[2])
    write_result(hertz_creep((6, 5), 2).assign_attrs(case_key=KEYS[0]), out / f"{KEYS[0]}.nc")
    (out / f"{KEYS[3]}.failed.json").write_text("{}")
    (out / f"{KEYS[3]}.nc.damaged").write_bytes(b"0")
    for name, age in (("..index.1a2b3c4d.part.npz", 7200), (".new.1a2b3c4d.part.png", 60), (".mine", 7200)):
        (out / name).write_bytes(b"0")
        os.utime(out / name, (time.time() - age,) * 2)
    return out


def test_tidy__keeps_results_and_what_a_run_goes_on_from(folder):
    clean_folder(folder)
    kept = {f"{KEYS[0]}.nc", f".{KEYS[1]}.unfinished", ".new.1a2b3c4d.part.png", ".mine"}
    assert {path.name for path in folder.iterdir()} == kept | {f"{KEYS[3]}.failed.json", f"{KEYS[3]}.nc.damaged"}
    assert clean_folder(folder) == []


def test_clean__removes_all_but_results_if_asked_to(folder, invoke):
    status, out, err = invoke("clean", folder, "--all")
    assert (status, err) == (0, "")
    assert {path.name for path in folder.iterdir()} == {f"{KEYS[0]}.nc", ".new.1a2b3c4d.part.png", ".mine"}
    assert f"removed .{KEYS[1]}.unfinished\n" in out
    assert invoke("clean", folder)[1] == "0 leftovers removed\n"
    assert invoke("clean", folder / "none")[0] == 2


def test_tidy__leaves_a_case_alone_that_is_being_computed(folder):
    before = {path.name for path in folder.glob(f".{KEYS[0]}.*")}
    with lock_case(folder / f".{KEYS[0]}.lock"):
        clean_folder(folder, everything=True)
        assert {path.name for path in folder.glob(f".{KEYS[0]}.*")} == before
    clean_folder(folder)
    assert not list(folder.glob(f".{KEYS[0]}.*"))
