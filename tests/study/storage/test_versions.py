"""After an upgrade: which version computed what, what is computed again and why, what stays and what may go."""

import hashlib
from contextlib import contextmanager
from importlib import metadata

import numpy as np
import pytest
from support import BALL

import roughvisc as rv
from roughvisc.study.execution import run as run_module
from roughvisc.study.execution.run import run_case
from roughvisc.study.statement import identity
from roughvisc.study.statement.case import Case, read_cases, read_study, vary
from roughvisc.study.storage import checkpoint
from roughvisc.study.storage import upkeep as versions
from roughvisc.study.storage.lock import lock_case, lock_path
from roughvisc.study.storage.upkeep import clean_folder

SMALL = BALL.replace("[24, 21]", "[12, 9]")
TWO = SMALL + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'
FRICTION = """
[surface]
generate = "wavy"
amplitude = "1 um"
wavelength = "0.1 mm"
size = "0.1 mm"
shape = [16, 12]
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[friction]
pressure = "10 kPa"
speeds = ["1 mm/s", "10 mm/s"]
[solve]
boundary = "periodic"
"""
TODAY = identity.NUMERICS_REVISION


@pytest.fixture
def version(monkeypatch):
    """Has what is inside be another version, with numerics of another revision."""

    @contextmanager
    def other(name, revision):
        with monkeypatch.context() as patch:
            patch.setattr(metadata, "version", lambda _: name)
            for module in (identity, run_module, checkpoint, versions):
                patch.setattr(module, "NUMERICS_REVISION", revision)
            yield

    return other


def study(tmp_path, text, name="s.toml"):
    (tmp_path / name).write_text(text)
    return tmp_path / name


def digests(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.glob("*.nc")}


def interrupted(case, out):
    with pytest.raises(KeyboardInterrupt):
        run_case(case, out, stop=lambda: True)
    return out / f".{case.key}.unfinished"


def test_run__says_once_what_another_version_has_computed(tmp_path, invoke, version):
    path, out = study(tmp_path, TWO), tmp_path / "out"
    other = study(tmp_path, SMALL.replace("5 mN", "7 mN"), "other.toml")
    with version("0.0.7", TODAY - 1):
        assert invoke("run", path, "--out", out, "--workers", "0", "-q") == (0, "", "")
        run_case(read_study(other), out)
    before = digests(out)
    assert len(before) == 3
    wanted = "roughvisc: {}: 2 results here are of another version (2 by roughvisc 0.0.7 (numerics {})); this is"
    wanted = wanted.format(out, TODAY - 1)
    planned = invoke("plan", path, "--out", out)
    assert planned[0] == 0
    status, said, err = invoke("run", path, "--out", out, "--workers", "0", "-q")
    assert (status, said) == (0, "")
    assert planned[2] == err, "a plan says the same"
    assert err.count("\n") == 1
    assert err.startswith(f"{wanted} {identity.program_version()}, whose numerics may give other numbers: ")
    assert "computed again, and the old files are kept" in err
    assert (out / "sweep.log").read_text().count("2 results here are of another version") == 1
    after = digests(out)
    assert len(after) == 5
    assert before.items() <= after.items(), "no old file is touched"
    assert invoke("run", path, "--out", out, "--workers", "0", "-q") == (0, "", "")
    status, _, err = invoke("run", other, "--out", out, "--no-plots", "-q")
    assert (status, err.count("1 result here is of another version (1 by roughvisc 0.0.7")) == (0, 1)
    assert invoke("run", other, "--out", out, "--no-plots", "-q") == (0, "", "")


def test_run__says_it_in_python_too(tmp_path, version, caplog):
    case, out = read_study(study(tmp_path, SMALL)), tmp_path / "out"
    with version("0.0.7", TODAY + 1):
        run_case(read_study(tmp_path / "s.toml"), out)
    rv.run(case, out, progress=False)
    rv.run(case, out, progress=False)
    assert caplog.text.count("1 result here is of another version (1 by roughvisc 0.0.7") == 1


def test_run__says_it_of_a_generated_surface_whose_recipe_has_more_keys_since(tmp_path, version, caplog, monkeypatch):
    """As a version before wrote it: the checksum of its recipe is another one than today."""
    path, out = study(tmp_path, FRICTION), tmp_path / "out"
    with version("0.0.7", TODAY - 1), monkeypatch.context() as patch:
        patch.setattr(Case, "surface_sha256", "0" * 64)
        run_case(read_study(path), out)
    rv.run(path, out, progress=False)
    assert caplog.text.count("1 result here is of another version (1 by roughvisc 0.0.7") == 1


def test_run__another_version_of_the_same_numerics_is_not_computed_again(tmp_path, invoke, version):
    path, out = study(tmp_path, TWO), tmp_path / "out"
    with version("0.0.7", TODAY):
        assert invoke("run", path, "--out", out, "--workers", "0", "-q") == (0, "", "")
    before = digests(out)
    assert invoke("run", path, "--out", out, "--workers", "0", "-q") == (0, "", "")
    assert digests(out) == before
    assert "kept" not in invoke("clean", out)[1]


def test_clean__removes_the_checkpoints_of_earlier_versions(tmp_path, invoke, version):
    path, out = study(tmp_path, SMALL), tmp_path / "out"
    left = {}
    for revision in (TODAY - 1, TODAY, TODAY + 1):
        with version("0.0.7", revision):
            left[revision] = interrupted(read_study(path), out)
    assert len(set(left.values())) == 3
    clean_folder(out)
    assert all(place.is_dir() for place in left.values()), "a sweep leaves them all"
    status, _, err = invoke("run", study(tmp_path, SMALL.replace("5 mN", "7 mN"), "b.toml"), "--out", out, "-q")
    assert status == 0
    assert f"the checkpoints of 2 unfinished runs are of numerics {TODAY - 1}, {TODAY + 1}: nothing goes on" in err
    earlier = read_key(left[TODAY - 1])
    with lock_case(lock_path(out, earlier)):  # a run of the earlier version goes on
        assert invoke("clean", out)[0] == 0
        assert all(place.is_dir() for place in left.values())
    status, said, err = invoke("clean", out)
    assert (status, err) == (0, "")
    assert f"removed .{earlier}.unfinished\n" in said
    later = left[TODAY + 1].name
    assert f"kept {later}: a checkpoint of a later version (numerics {TODAY + 1})\n" in said
    assert {place.is_dir() for place in left.values()} == {True, False}
    assert not left[TODAY - 1].exists()
    reached = []
    run_case(read_study(path), out, progress=lambda now, end: reached.append(now))
    assert not left[TODAY].exists()
    assert min(reached) > 0, "it goes on"
    invoke("clean", out, "--all")
    assert not left[TODAY + 1].exists()


def read_key(place):
    return place.name.split(".")[1]


def test_clean__removes_superseded_results_if_asked_to(tmp_path, invoke, version):
    path, out = study(tmp_path, TWO), tmp_path / "out"
    with version("0.0.7", TODAY - 1):
        first, second = read_cases(path)
        old = [run_case(first, out), run_case(second, out)]
    size = sum(one.stat().st_size for one in old) / 1e6
    line = f"kept 2 results (2 by roughvisc 0.0.7 (numerics {TODAY - 1})), {size:.3g} MB: not computed by this version"
    assert line in invoke("clean", out, "--superseded")[1]
    new = run_case(read_cases(path)[0], out)
    status, said, err = invoke("clean", out)
    assert (status, err) == (0, "")
    assert "kept 1 result (1 by roughvisc 0.0.7" in said
    assert "MB: computed again by this version; --superseded removes them" in said
    assert all(one.exists() for one in (*old, new))
    with lock_case(lock_path(out, read_key_of(old[0]))):
        invoke("clean", out, "--superseded")
        assert old[0].exists()
    assert f"removed {old[0].name}\n" in invoke("clean", out, "--superseded")[1]
    assert [one.exists() for one in (*old, new)] == [False, True, True]


def read_key_of(path):
    return path.stem


@pytest.mark.parametrize(("text", "changes"), [(SMALL, "program.0.load"), (FRICTION, "friction.pressure")])
def test_open_results__says_which_version_computed_what(tmp_path, version, caplog, text, changes):
    path, out = study(tmp_path, text), tmp_path / "out"
    values = {"program.0.load": ["4 mN", "5 mN", "6 mN"], "friction.pressure": ["9 kPa", "10 kPa", "11 kPa"]}[changes]
    with version("0.0.7", TODAY - 1):
        keys = {run_case(vary(read_study(path), {changes: values[0]}), out).stem: f"0.0.7 (numerics {TODAY - 1})"}
    with version("0.0.8", TODAY):
        keys |= {
            run_case(vary(read_study(path), {changes: one}), out).stem: f"0.0.8 (numerics {TODAY})"
            for one in values[1:]
        }
    found = rv.open_results(out, cases="all")
    rv.open_results(out, cases="all", ragged=True)
    assert dict(zip(found.case_key.values, found.roughvisc_version.values, strict=True)) == {
        key: f"roughvisc {name}" for key, name in keys.items()
    }
    (said,) = [one.getMessage() for one in caplog.records if "several versions" in one.getMessage()]
    assert "1 by roughvisc 0.0.7 (numerics" in said
    assert "2 by roughvisc 0.0.8 (numerics" in said
    caplog.clear()
    one = vary(read_study(path), {changes: values[1]})
    alike = rv.open_results(out, cases=[one])
    assert not caplog.records
    assert np.all(alike.roughvisc_version == f"roughvisc 0.0.8 (numerics {TODAY})")
