"""Messages on the screen: short whatever went wrong, the rest in the log; each thing said once and by its name."""

import os
import re
import socket

import pytest
from support import BALL

import roughvisc as rv
from roughvisc.errors import InputError, shortened
from roughvisc.study.execution import task as task_module
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


def test_run__two_hundred_problems_take_600_characters(tmp_path, invoke):
    path = study(tmp_path, UNKNOWN)
    status, out, err = invoke("run", path)
    assert (status, out) == (2, "")
    assert len(err.rstrip("\n")) <= LONGEST
    first, second, *others = err.splitlines()
    assert first == f"roughvisc: {path}: 200 problems"
    assert second.startswith("  surface.unknown_0: unknown key: expected one of crop, ")
    assert others[-1] == f"  and {200 - (len(others))} more"
    assert not (tmp_path / "results").exists()


def test_run__the_log_has_what_the_screen_has_not(tmp_path, invoke):
    path = study(tmp_path, UNKNOWN)
    out = tmp_path / "out"
    out.mkdir()
    err = invoke("run", path, "--out", out)[2]
    assert len(err.rstrip("\n")) <= LONGEST
    assert re.search(rf"\n  and \d+ more; all of it is in {out / 'sweep.log'}\n$", err)
    logged = (out / "sweep.log").read_text()
    assert set(map(int, re.findall(r"surface\.unknown_(\d+): unknown key", logged))) == set(range(200))
    assert logged.count(" ERROR ") == 1
    study(tmp_path, SMALL.replace("radius", "diameter"))
    assert "sweep.log" not in invoke("run", path, "--out", out)[2], "a short message is whole"
    assert (out / "sweep.log").read_text() == logged


def test_run__a_long_value_below_long_folders(tmp_path, invoke):
    path = study(tmp_path.joinpath(*["folder" * 30] * 8), SMALL.replace('"zener"', f'"{"z" * 4000}"'))
    status, out, err = invoke("run", path)
    assert (status, out) == (2, "")
    assert len(err.rstrip("\n")) <= LONGEST
    for part in (str(tmp_path)[:20], "/s.toml: ", "material.model: ", "zzz...", "expected one of elastic, "):
        assert part in err


def test_run__two_hundred_cases_that_fail(tmp_path, invoke, monkeypatch):
    loads = ", ".join(f'"{number} mN"' for number in range(1, 201))
    path, out = study(tmp_path, SMALL + f'[sweep]\n"program.0.load" = [{loads}]\n'), tmp_path / "out"

    def fail(case, *rest, **settings):
        raise InputError(f"program.0.load: found {case.varied['program.0.load']:.3f}, {'x' * 300}: expected less")

    monkeypatch.setattr(task_module, "run_case", fail)
    status, said, err = invoke("run", path, "--out", out, "--workers", "0", "-q")
    assert (status, said) == (2, "")
    cases, last = err.rstrip("\n").rsplit("\n", 1)
    assert len(cases) <= LONGEST
    assert cases.startswith("roughvisc: case 0: program.0.load: found 0.001, ")
    assert cases.endswith(f"all of it is in {out / 'sweep.log'}")
    assert last == "roughvisc: no case could be computed: the input is invalid"
    assert len(re.findall(r"found 0\.\d{3}, x{300}: expected less\n", (out / "sweep.log").read_text())) == 200
    invoke("clean", out, "--all")
    said = invoke("run", path, "--out", out, "--workers", "0")[1]
    assert said.count(": failed: ") <= 8
    assert "200 failed" in said


@pytest.mark.parametrize("longest", [150, 250, 600])
@pytest.mark.parametrize("lines", [1, 2, 3, 500])
@pytest.mark.parametrize("width", [10, 90, 5000])
@pytest.mark.parametrize("log", ["", "out/sweep.log", "long/" * 200])
def test_shortened__never_takes_more(longest, lines, width, log):
    message = "\n".join(f"{number}: " + "a" * width for number in range(lines))
    text = shortened(message, longest, log)
    assert len(text) <= longest
    assert text == message or text.startswith("0: a")
    counted = re.search(r"and (\d+) more", text)
    shown = len(re.findall(r"^\d+: ", text, re.M))
    assert shown + (int(counted[1]) if counted else 0) == lines


@pytest.mark.parametrize("workers", ["0", pytest.param("2", marks=pytest.mark.long)])
def test_run__a_damaged_result_is_warned_of_once(tmp_path, invoke, capfd, workers):
    path, out = study(tmp_path, TWO), tmp_path / "out"
    rv.sweep(path, out, workers=0, progress=False)
    for case in read_cases(path)[: 1 + int(workers != "0")]:
        result = out / f"{case.key}.nc"
        content = bytearray(result.read_bytes())
        content[len(content) // 2] ^= 8
        result.write_bytes(content)
    (out / "sweep.log").unlink()
    capfd.readouterr()
    status, said, err = invoke("run", path, "--out", out, "--workers", workers)
    assert status == 0
    screen = said + err + capfd.readouterr().err  # of the workers
    assert screen.count(f"{result}: is damaged") == 1
    assert (out / "sweep.log").read_text().count(f"{result}: is damaged") == 1
    assert (out / f"{result.name}.damaged").exists()


def test_report__a_damaged_result_is_warned_of_once(tmp_path, invoke, caplog):
    path, out = study(tmp_path, TWO), tmp_path / "out"
    rv.sweep(path, out, workers=0, progress=False)
    result = sorted(out.glob("*.nc"))[1]
    result.write_bytes(result.read_bytes()[:-100] + b"0" * 100)
    status, said, err = invoke("report", out)
    assert status == 2
    assert (said + err + caplog.text).count("is damaged") == 1


@pytest.mark.thorough
def test_run__a_case_of_another_run_is_held_and_has_not_failed(tmp_path, invoke):
    path, out = study(tmp_path, TWO), tmp_path / "out"
    out.mkdir()
    first, _ = read_cases(path)
    holder = f"process {os.getpid()} on {socket.gethostname()}"
    with lock_case(lock_path(out, first.key)):
        status, said, err = invoke("run", path, "--out", out, "--workers", "0")
        assert status == 1
        assert err.startswith(f"roughvisc: case 0: {lock_path(out, first.key)}: {holder} is at work on this case")
        assert err.endswith("roughvisc: 1 of 2 cases are in use by another run: repeat the command when it has ended\n")
        assert "1 held by another run" in said
        assert re.search(r"^Locked by another run +1 *$", said, re.M)
        logged = (out / "sweep.log").read_text()
        assert f"{first.key} held by another run" in logged
        assert "failed" not in said + err + logged
        row = (out / "cases.csv").read_text(encoding="utf-8-sig").splitlines()[1]
        assert f',held by another run,"{lock_path(out, first.key)}: {holder} is at work' in row
        one = study(tmp_path / "one", SMALL.replace("5 mN", "4 mN"))
        status, said, err = invoke("run", one, "--out", out, "--no-plots", "-q")
        assert (status, said, err.count("\n")) == (1, "", 1)
        assert holder in err
        assert "failed" not in err
    assert invoke("run", path, "--out", out, "--workers", "0", "-q") == (0, "", "")
    assert rv.to_table(out).status.tolist() == ["converged", "converged"]
