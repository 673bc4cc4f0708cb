"""Messages on the screen: short whatever went wrong, the rest in the log; each thing said once and by its name."""

import re

import pytest
from support import BALL

import roughvisc as rv
from roughvisc.study.statement.case import read_cases
from roughvisc.study.storage.lock import lock_case, lock_path

SMALL = BALL.replace("[24, 21]", "[12, 9]")
TWO = SMALL + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'
LONGEST = 600


def study(folder, text):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "s.toml").write_text(text)
    return folder / "s.toml"


UNKNOWN = SMALL.replace("level = 0", "level = 0\n" + "\n".join(f"unknown_{number} = 1" for number in range(200)))


def test_run__two_hundred_problems_take_600_characters_and_the_log_has_all(tmp_path, invoke):
    path, out = study(tmp_path, UNKNOWN), tmp_path / "out"
    status, said, err = invoke("run", path, "--out", out)
    assert (status, said, len(err.rstrip("\n")) <= LONGEST) == (2, "", True)
    assert str(path) in err.splitlines()[0]
    assert not out.exists()
    out.mkdir()
    err = invoke("run", path, "--out", out)[2]
    assert len(err.rstrip("\n")) <= LONGEST
    assert str(out / "sweep.log") in err
    logged = (out / "sweep.log").read_text()
    assert set(map(int, re.findall(r"surface\.unknown_(\d+)", logged))) == set(range(200))


@pytest.mark.thorough
def test_run__a_case_of_another_run_is_held_and_has_not_failed(tmp_path, invoke):
    path, out = study(tmp_path, TWO), tmp_path / "out"
    out.mkdir()
    first, _ = read_cases(path)
    with lock_case(lock_path(out, first.key)):
        status, said, err = invoke("run", path, "--out", out, "--workers", "0")
        assert status == 1
        assert str(lock_path(out, first.key)) in err
        assert "held" in said
        assert not list(out.glob("*.failed.json"))
        assert "held" in (out / "cases.csv").read_text(encoding="utf-8-sig").splitlines()[1]
        one = study(tmp_path / "one", SMALL.replace("5 mN", "4 mN"))
        status, said, err = invoke("run", one, "--out", out, "--no-plots", "-q")
        assert (status, said, err.count("\n")) == (1, "", 1)
    assert invoke("run", path, "--out", out, "--workers", "0", "-q") == (0, "", "")
    assert rv.to_table(out).status.tolist() == ["converged", "converged"]
