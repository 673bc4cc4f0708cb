"""Links in a results folder: none is followed where a run writes, and nothing beyond one is changed or deleted."""

import os

import pytest
from support import BALL

import roughvisc as rv
from roughvisc.errors import FolderError
from roughvisc.study.execution.dispatch import serialize_with_inputs
from roughvisc.study.execution.run import run_case
from roughvisc.study.statement.case import read_cases

SMALL = BALL.replace("[24, 21]", "[12, 9]")
TWO_LOADS = SMALL + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'

pytestmark = pytest.mark.skipif(not hasattr(os, "O_NOFOLLOW"), reason="links of POSIX")


@pytest.fixture
def precious(tmp_path):
    """A folder of somebody else's, with the names that a run uses; and what looks whether it is as it was."""
    folder = tmp_path / "precious"
    folder.mkdir()
    for name in ("rows", "checkpoint.0", "checkpoint.1", ".hidden", "log"):
        (folder / name).write_text(f"mine: {name}")
    before = {path.name: (path.read_text(), path.stat().st_mtime_ns) for path in folder.iterdir()}

    def untouched():
        return {path.name: (path.read_text(), path.stat().st_mtime_ns) for path in folder.iterdir()} == before

    return folder, untouched


@pytest.mark.parametrize("text", [SMALL, TWO_LOADS])
@pytest.mark.parametrize(
    ("name", "target"),
    [
        (".{key}.unfinished", "."),
        (".{key}.unfinished/rows", "rows"),
        (".{key}.unfinished/checkpoint.1", "checkpoint.1"),
        (".{key}.lock", "log"),
        ("sweep.log", "log"),
        ("inputs", "."),
    ],
)
def test_run__refuses_a_link_and_touches_nothing_beyond_it(tmp_path, precious, invoke, text, name, target):
    folder, untouched = precious
    (tmp_path / "s.toml").write_text(text)
    cases = read_cases(tmp_path / "s.toml")
    link = tmp_path / "out" / name.format(key=cases[0].key)
    link.parent.mkdir(parents=True)
    link.symlink_to(folder / target)
    if link.parent.name != "out":
        (link.parent / "checkpoint.0").write_text("without one the folder is of no use, and goes")
    status, _, err = invoke("run", "s.toml", "--out", "out", "--workers", "0", "-q", "--no-plots")
    assert untouched()
    assert link.is_symlink()
    if text == SMALL and not name.startswith("."):  # a single case has neither a log nor copies of its inputs
        assert status == 0
        return
    inside = "unfinished/" in name and text == TWO_LOADS  # the other case is computed
    assert status == (1 if inside else 2)
    assert f"out/{name.format(key=cases[0].key)}: is a link: expected " in err
    assert "Traceback" not in err
    assert not list((tmp_path / "out").glob("*.failed.json")), "it is no fault of the case"


def test_clean__removes_the_link_itself_at_most(tmp_path, precious, invoke):
    folder, untouched = precious
    out, key = tmp_path / "out", "0" * 16
    (out / f".{key}.unfinished").mkdir(parents=True)
    (out / f".{key}.unfinished" / "rows").symlink_to(folder / "rows")
    links = [out / f".{'1' * 16}.unfinished", out / f".{'2' * 16}.lock", out / f"{key}.nc.damaged"]
    for link in links:
        link.symlink_to(folder, target_is_directory=True)
    status, said, err = invoke("clean", out, "--all")
    assert (status, err) == (0, "")
    assert said.endswith("4 leftovers removed\n")
    assert list(out.iterdir()) == []
    assert untouched()


def test_inputs__are_copied_to_no_folder_behind_a_link(tmp_path, precious):
    folder, untouched = precious
    rv.save_scan(rv.sphere(1e-2, 1e-3, (12, 9)), tmp_path / "scan.nc")
    surface = SMALL[SMALL.index("generate") : SMALL.index("[material]")]
    (tmp_path / "s.toml").write_text(SMALL.replace(surface, 'file = "scan.nc"\n'))
    (case,) = read_cases(tmp_path / "s.toml")
    serialize_with_inputs(case, tmp_path / "plain")
    (digest,) = [path.name for path in (tmp_path / "plain").iterdir()]
    (tmp_path / "inputs").mkdir()
    (tmp_path / "inputs" / digest).symlink_to(folder, target_is_directory=True)
    with pytest.raises(FolderError, match=rf"inputs/{digest}: is a link: expected a folder of copied inputs"):
        serialize_with_inputs(case, tmp_path / "inputs")
    assert untouched()


def test_folder_itself__may_be_a_link_and_so_may_a_result(tmp_path, precious):
    folder, untouched = precious
    (tmp_path / "s.toml").write_text(SMALL)
    (case,) = read_cases(tmp_path / "s.toml")
    (tmp_path / "scratch").mkdir()
    (tmp_path / "out").symlink_to(tmp_path / "scratch", target_is_directory=True)
    path = run_case(case, tmp_path / "out")
    assert [one.name for one in (tmp_path / "scratch").iterdir()] == [path.name]
    # an archive puts links in the place of results
    (tmp_path / "archive.nc").write_bytes(path.read_bytes())
    path.unlink()
    path.symlink_to(tmp_path / "archive.nc")
    assert run_case(case, tmp_path / "out") == path
    assert path.is_symlink()
    path.unlink()
    path.symlink_to(folder / "log")
    run_case(case, tmp_path / "out")
    assert not path.is_symlink(), "what is no result is set aside, and computed anew"
    assert (tmp_path / "scratch" / f"{path.name}.damaged").is_symlink()
    assert untouched()
