"""What is too large, endless, malformed or meant for a terminal is refused or shown, in one sentence."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
import zipfile

import netCDF4
import numpy as np
import pytest
import xarray as xr
from sample_results import hertz_creep
from support import BALL

import roughvisc as rv
from roughvisc.cli import group
from roughvisc.errors import InputError, printable
from roughvisc.study.execution.run import result_folder
from roughvisc.study.statement.case import read_cases, read_study
from roughvisc.study.storage.store import open_result, write_result
from roughvisc.tables import Wanted, read_table
from roughvisc.views.figures.histories import area_against_load

SMALL = BALL.replace("[24, 21]", "[12, 9]")
NASTY = "cost $$ of_a $x \x1b[31m[/b] red"


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "ball.toml"
    path.write_text(SMALL)
    return path


# ----------------------------------------------------------------------------------------------------------------
# sizes


def test_sweep__is_refused_by_the_product_of_its_lengths(study):
    lists = "".join(f'"{key}" = {list(range(1, 2155))}\n' for key in ("surface.seed", "keep.times"))
    study.write_text(f"{SMALL}[sweep]\n{lists}")
    with pytest.raises(InputError, match=r"sweep: found 2154 x 2154 = 4639716 cases: expected at most 100000$"):
        read_cases(study)
    study.write_text(f'{SMALL}[[sweep]]\n"keep.times" = {list(range(1, 100_003))}\n')
    with pytest.raises(InputError, match=r"sweep\.0: found 100002 cases: expected at most 100000$"):
        read_cases(study)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("[12, 9]", "[100000, 100000]", r"shape is \(100000, 100000\), 1e\+10 cells: expected at most"),
        ("[keep]", "tolerance = 1e-17\n[keep]", r"solve\.tolerance: found 1e-17: expected .* at least 1e-12"),
        ('[0, "0.1 s", "200 ms"]', "1000000000", r"keep\.times: found 1000000000: expected a whole number"),
        ("level = 0", f"level = 1{'0' * 400}", r"surface\.level.*found 1000000.*\.\.\."),
        ('"5 mN"', f"1{'0' * 400}", r"program\.0\.load: found 1000.*\.\.\.: expected a number in N.*finite"),
        ('"5 mN"', f"1{'0' * 5000}", r"is not valid TOML: Exceeds the limit"),
        ('"5 mN"', f'"{"9" * 5000} mN"', r"program\.0\.load: found '999[9]{1,60}\.\.\., which is no quantity"),
        ("level = 0", f"level = {'[' * 3000}{']' * 3000}", r"is not valid TOML: it is nested too deeply"),
    ],
)
def test_study__sizes_are_bounded_before_anything_is_allocated(study, old, new, expected):
    study.write_text(SMALL.replace(old, new))
    with pytest.raises(InputError, match=expected) as caught:
        read_study(study).height()
    assert max(map(len, str(caught.value).split("\n"))) < 400


def test_functions__refuse_the_same(study):
    with pytest.raises(InputError, match=r"expected at most 2\.68e"):
        rv.resample(rv.wavy(1e-6, 1e-3, 1e-3, (12, 9)), 10**6)
    for settings in ({"tolerance": 1e-16}, {"times": 10**9}):
        with pytest.raises(InputError, match=r"1e-12|at most 1000000 times"):
            rv.simulate(rv.sphere(1e-2, 1e-3, 12), rv.elastic(1e6), rv.Program().load(1e-3, over=0), **settings)


def test_x3p__a_bomb_is_not_unpacked(tmp_path):
    path = tmp_path / "bomb.x3p"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as parts:
        with parts.open("bindata/data.bin", "w", force_zip64=True) as stream:
            for _ in range(300):
                stream.write(bytes(1 << 20))
        parts.writestr("main.xml", "<p/>")
    with pytest.raises(InputError, match=r"bomb\.x3p: it would take 3\.15e\+08 bytes in memory, \d+ times as many"):
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
        with pytest.raises(InputError, match=r"endless: is a device or a pipe: expected a file"):
            read()


def test_table__a_cell_without_end(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text('time,load\n0,"' + "1" * (csv.field_size_limit() + 9))
    with pytest.raises(InputError, match=r"t\.csv: cannot be read as a table: field larger than"):
        read_table(path, {"time": Wanted("time", "s"), "load": Wanted("load", "N")})


def test_study_and_card__a_byte_order_mark_is_passed_over(tmp_path, study):
    key = read_study(study).key
    study.write_text(SMALL, encoding="utf-8-sig")
    assert read_study(study).key == key
    card = tmp_path / "card.toml"
    card.write_text('generate = "wavy"\namplitude = 1e-6\nwavelength = 1e-3\nsize = 1e-3\nshape = [12, 9]', "utf-8-sig")
    assert rv.open_scan(card).shape == (12, 9)


def test_result_folder__a_tilde_is_the_home(study, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path / "me"))
    assert result_folder(read_study(study), "~/out") == tmp_path / "me" / "out"


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


@pytest.mark.parametrize(
    "attributes", [{"case": "[" * 9999}, {"case": "5"}, {"case": 7}, {"case": b"\xff"}, {"tolerance": "x"}]
)
def test_open_result__attributes_of_foreign_files(tmp_path, invoke, attributes):
    path = write_result(hertz_creep((6, 5), 3), tmp_path / f"{'0' * 16}.nc")
    with netCDF4.Dataset(path, "a") as file:
        file.setncatts(attributes)
    with pytest.raises(InputError, match=r"case that is no case in JSON: expected a result|has the tolerance 'x'"):
        open_result(path)
    for command in (["plot", path], ["report", path], ["report", tmp_path]):
        status, _, err = invoke(*command)
        assert (status, err.count("\n")) == (2, 1)


def test_open_result__variables_of_foreign_files(tmp_path):
    whole = hertz_creep((6, 5), 3)
    for name, change in (
        ("force over", {"force": ("x", np.zeros(6))}),
        ("force as (<U1|object)", {"force": ("time", np.array(["a", "b", "c"], dtype=object))}),
        ("force, approach", {}),
    ):
        foreign = whole.drop_vars(["force", "approach"]).assign(change and {"approach": whole.approach, **change})
        foreign.to_netcdf(tmp_path / "foreign.nc")
        with pytest.raises(InputError, match=rf"foreign\.nc: holds (no )?{name}"):
            open_result(tmp_path / "foreign.nc")


# ----------------------------------------------------------------------------------------------------------------
# what is shown


def test_printable__spells_out_what_steers_a_terminal_and_cuts():
    assert printable("a\tb\x1b]0;x\x07\u202e\ud800é\nc") == "a\\tb\\x1b]0;x\\x07\\u202e\\ud800é\nc"
    shown = printable("x" * 5000)
    assert len(shown) < 1100
    assert "(4000 characters left out)" in shown


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


def test_area_against_load__dollars_of_a_title_begin_no_formula():
    cases = {NASTY: hertz_creep((6, 5), 3), "$$": hertz_creep((6, 5), 3)}
    figure = area_against_load(cases)
    figure.draw_without_rendering()
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == [r"cost \$\$ of_a \$x \x1b[31m[/b] red", r"\$\$"]


# ----------------------------------------------------------------------------------------------------------------
# nothing is written over, and nothing said, unasked


def test_scan__writes_over_nothing_unless_asked_to(tmp_path, invoke, coarse_pictures):
    height = rv.wavy(1e-6, 1e-4, 1e-3, (16, 18))
    rv.save_scan(height, tmp_path / "a.nc")
    assert invoke("scan", "a.nc", "--to", "b.nc")[0] == 0
    for name in ("a.png", "b.nc"):
        (tmp_path / name).write_text("mine")
    status, out, err = invoke("scan", "a.nc")
    assert (status, err) == (0, "")
    assert "Existing picture kept (--force overwrites it): a.png" in out
    for option in (["--plot", "a.png"], ["--to", "b.nc"]):
        status, out, err = invoke("scan", "a.nc", *option)
        assert (status, out) == (2, "")
        assert f"{option[1]}: already exists: expected another name or --force" in err
    assert {(tmp_path / name).read_text() for name in ("a.png", "b.nc")} == {"mine"}
    assert invoke("scan", "a.nc", "--to", "b.nc", "--force")[0] == 0
    xr.testing.assert_allclose(rv.open_scan(tmp_path / "b.nc"), rv.open_scan(tmp_path / "a.nc"))
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
@pytest.mark.parametrize("after", [0.5, 1.0, 1.5, 2.0, 2.4, 2.8, 3.2, 4.0])
def test_run__an_interrupt_while_processes_start_is_quiet(tmp_path, after):
    text = SMALL.replace("[keep]", 'time_step = "100 us"\n[keep]')
    (tmp_path / "s.toml").write_text(f'{text}[sweep]\n"program.1.hold" = ["20 s", "21 s"]\n')
    command = [sys.executable, "-m", "roughvisc", "run", "s.toml", "--workers", "2", "-q"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=-1, stderr=-1, text=True, start_new_session=True)
    time.sleep(after)
    os.killpg(process.pid, signal.SIGINT)
    assert process.communicate(timeout=60) == (
        "",
        "roughvisc: interrupted; finished work is kept; repeat the command to resume\n",
    )
    # Python ends by the signal itself where that struck within exec, as modules that make code do; 130 for a shell too
    assert process.returncode in (130, -signal.SIGINT)
