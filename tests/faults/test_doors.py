"""Input that is too large, endless, malformed or meant for a terminal is refused in one sentence."""

import json
import os
import zipfile

import pytest
from support import SMALL

import roughvisc as rv
from roughvisc.cli import group
from roughvisc.errors import InputError
from roughvisc.study.case import read_cases, read_study
from roughvisc.tables import Wanted, read_table

NASTY = "cost $$ of_a $x \x1b[31m[/b] red"


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "ball.toml"
    path.write_text(SMALL)
    return path


# ----------------------------------------------------------------------------------------------------------------
# sizes


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("[12, 9]", f"1{'0' * 30}", "surface.shape"),
        ("[12, 9]", "[100000, 100000]", "surface.shape"),
        ("[keep]", f'[[sweep]]\n"keep.times" = {list(range(1, 100_003))}\n[keep]', "100001 cases"),
        ("[keep]", "tolerance = 1e-17\n[keep]", "solve.tolerance"),
        ('[0, "0.1 s", "200 ms"]', "1000000000", "keep.times"),
        ("level = 0", f"level = 1{'0' * 400}", "surface.level"),
        ('"5 mN"', f"1{'0' * 400}", "program.0.load"),
        ('"5 mN"', f"1{'0' * 5000}", "TOML"),
        ('"5 mN"', f'"{"9" * 5000} mN"', "program.0.load"),
        ("level = 0", f"level = {'[' * 3000}{']' * 3000}", "TOML"),
    ],
    ids=lambda text: text[:20],
)
def test_study__sizes_are_bounded_before_anything_is_allocated(study, old, new, key):
    study.write_text(SMALL.replace(old, new))
    with pytest.raises(InputError) as caught:
        [case.height() for case in read_cases(study)]
    assert key in str(caught.value)
    assert max(map(len, str(caught.value).split("\n"))) < 400


@pytest.mark.thorough
def test_x3p__a_bomb_is_not_unpacked(tmp_path):
    path = tmp_path / "bomb.x3p"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as parts:
        with parts.open("bindata/data.bin", "w", force_zip64=True) as stream:
            for _ in range(300):
                stream.write(bytes(1 << 20))
        parts.writestr("main.xml", "<p/>")
    with pytest.raises(InputError, match=r"bomb\.x3p"):
        rv.open_scan(path)


# ----------------------------------------------------------------------------------------------------------------
# what is no file


@pytest.mark.parametrize("kind", ["device", "pipe"])
def test_open__devices_and_pipes_are_refused(tmp_path, kind):
    place = tmp_path / "endless"
    if kind == "device":
        place.symlink_to("/dev/zero")
    else:
        os.mkfifo(place)
    card = tmp_path / "card.toml"
    card.write_text(f'file = "endless"\nsha256 = "{"0" * 64}"\nformat = "asc"\n')
    for read in (
        lambda: rv.open_scan(place, format="asc"),
        lambda: rv.open_scan(card),
        lambda: read_table(place, {"time": Wanted("time", "s")}),
        lambda: read_study(place),
    ):
        with pytest.raises(InputError, match=r"endless: is a device or a pipe: "):
            read()


# ----------------------------------------------------------------------------------------------------------------
# one door around every command


@pytest.mark.parametrize(
    ("error", "status", "message"),
    [
        (MemoryError(), 1, "not enough memory"),
        (RecursionError("deep"), 2, "nested too deeply"),
        (OverflowError("int too large"), 2, "too large (int too large)"),
        (RuntimeError("NetCDF: HDF error"), 1, "a result cannot be read (NetCDF: HDF error)"),
    ],
)
def test_commands__end_in_one_sentence(invoke, monkeypatch, error, status, message):
    def fails(*_, **__):
        raise error

    for command in ("run", "plan", "trade", "scan", "new", "plot", "report", "verify", "clean"):
        monkeypatch.setattr(group.main.commands[command], "callback", fails)
        found, out, err = invoke(command, "x")
        assert (found, out) == (status, "")
        assert err.startswith("roughvisc: ")
        assert err.count("\n") == 1
        assert message in err


# ----------------------------------------------------------------------------------------------------------------
# what is shown


def test_commands__show_escapes_and_markup_and_do_not_obey_them(tmp_path, invoke):
    folder = tmp_path / "[b]\x1b[5m$$"
    folder.mkdir()
    (folder / "one.toml").write_text(
        SMALL.replace("A ball", json.dumps(NASTY)[1:-1]) + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'
    )
    status, out, err = invoke("run", folder / "one.toml", "--workers", "0")
    assert status == 0
    assert "\x1b[31m" not in out + err
    assert "\x1b[5m" not in out + err
    assert "[b]\\x1b[5m$$" in out
    status, out, _ = invoke("plan", folder / "one.toml")
    assert "cost $$ of_a $x \\x1b[31m[/b] red" in out
