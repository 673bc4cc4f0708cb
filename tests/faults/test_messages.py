"""Messages on the screen if another run holds a case."""

import pytest
from support import SMALL

import roughvisc as rv
from roughvisc.study.case import read_cases
from roughvisc.study.storage.folder import lock_case, lock_path

TWO = SMALL + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'


def study(folder, text):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "s.toml").write_text(text)
    return folder / "s.toml"


@pytest.mark.thorough
def test_run__a_case_of_another_run_is_hindered_and_has_not_failed(tmp_path, invoke):
    path, out = study(tmp_path, TWO), tmp_path / "out"
    out.mkdir()
    first, _ = read_cases(path)
    with lock_case(lock_path(out, first.key)):
        status, said, err = invoke("run", path, "--out", out, "--workers", "0")
        assert status == 1
        assert str(lock_path(out, first.key)) in err
        assert "hindered" in said
        assert not list(out.glob("*.failed.json"))
        one = study(tmp_path / "one", SMALL.replace("5 mN", "4 mN"))
        status, said, err = invoke("run", one, "--out", out, "--no-plots", "-q")
        assert (status, said, err.count("\n")) == (1, "", 1)
    assert invoke("run", path, "--out", out, "--workers", "0", "-q") == (0, "", "")
    assert rv.to_table(out).status.tolist() == ["converged", "converged"]
