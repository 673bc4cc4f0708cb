"""The command line: what it writes, what it says, and how it ends."""

import io
import math
import os
import subprocess
import sys
import tomllib

import numpy as np
import pytest
import xarray as xr
from support import BALL

import roughvisc as rv
from roughvisc.cli import main
from roughvisc.study.case import read_cases, vary
from roughvisc.study.execution import run as run_module
from roughvisc.study.first_study import RUBBER
from roughvisc.study.storage.netcdf import write_result
from roughvisc.topography.scans import raw_height

SPHERE = BALL[BALL.index("generate") : BALL.index("[material]")]


def write_study(text=BALL, *replacements):
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    with open("ball.toml", "w") as stream:
        stream.write(text)
    return "ball.toml"


@pytest.mark.thorough
def test_run__writes_result_and_figures_and_sums_up(invoke, tmp_path, coarse_pictures):
    study = write_study()
    status, out, err = invoke("run", study)
    assert (status, err) == (0, "")
    (result,) = (tmp_path / "results" / "ball").glob("*.nc")
    figures = {p.name.rpartition("-")[2] for p in result.parent.glob(f"{result.stem}-*.png")}
    assert figures == {"history.png", "maps.png"}
    assert f"Result: results/ball/{result.name}\n" in out
    assert out.endswith("2 figures: results/ball\n")
    for words in ("24 x 21 cells, free", "5 mN", "stated error", "convolutions"):
        assert words in out
    before = result.stat().st_mtime_ns
    assert "nothing to compute" in invoke("run", study, "--no-plots")[1]
    assert result.stat().st_mtime_ns == before


def test_run__sweep_goes_on_after_a_case_that_fails(invoke, tmp_path):
    sweep = '[sweep]\n"program.0.load" = ["5 mN", "50 N", "6 mN"]'
    status, out, err = invoke("run", write_study(BALL + sweep), "--workers", 0)
    assert status == 1
    folder = tmp_path / "results" / "ball"
    assert len(list(folder.glob("*.nc"))) == 2
    (record,) = folder.glob("*.failed.json")
    assert "case 1" in err
    assert "1 of 3 cases failed" in err
    assert "Results: results/ball\nTable of cases: results/ball/cases.csv\nLog: results/ball/sweep.log\n" in out

    before = record.stat().st_mtime_ns
    assert invoke("run", "ball.toml", "--workers", 0, "-q")[:2] == (1, "")
    assert record.stat().st_mtime_ns > before, "a failed case is tried again"


def test_run__sweep_in_which_all_is_wrong_is_status_2(invoke):
    sweep = '[sweep]\n"program.0.load" = ["50 N", "60 N"]'
    status, _, err = invoke("run", write_study(BALL + sweep), "--workers", 0)
    assert status == 2
    assert err.endswith("roughvisc: no case could be computed: the input is invalid\n")


def test_run__scheduler_that_is_not_there_is_status_2(invoke, tmp_path):
    status, _, err = invoke("run", write_study(), "--scheduler-file", "gone.json")
    assert (status, err[:22]) == (2, "roughvisc: gone.json: ")
    assert [p.name for p in tmp_path.iterdir()] == ["ball.toml"]


@pytest.mark.parametrize("verb", ["plan", "run", "trade"])
def test_study_of_a_scan_without_a_boundary__is_asked_for_it_and_nothing_is_written(invoke, tmp_path, scan_file, verb):
    text = BALL.replace(SPHERE, f'file = "{scan_file}"\n').replace('[solve]\nboundary = "free"\n', "")
    status, out, err = invoke(verb, write_study(text))
    assert (status, out) == (2, "")
    assert err.startswith("roughvisc: ball.toml: solve.boundary: ")
    assert 'boundary = "periodic"' in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ball.toml", "tilted.nc"]


def test_plan__of_a_study_that_cannot_run_says_why_and_shows_no_table(invoke):
    study = write_study(BALL, ("level = 0", "crop = { x = ['2 mm', '3 mm'] }"))
    status, out, err = invoke("plan", study)
    assert (status, out) == (2, "")
    assert err.startswith("roughvisc: ball.toml: cannot run: surface.crop")
    ramp = 'approach = "1 um"'
    text = BALL.replace('load = "5 mN"', ramp).replace('"zener"\nshear', '"kelvin_voigt"\nshear')
    text = text.replace('kelvin_modulus = "1 MPa"\nkelvin_', "")
    sweep = '[sweep]\n"program.0.over" = [0, 0.1]'
    status, out, err = invoke("plan", write_study(text + sweep))
    assert status == 2
    assert "cannot run: 1 of 2 cases: at 0 s the approach jumps" in err
    assert [line.split()[-2:] for line in out.splitlines() if "cannot" in line] == [["cannot", "run"]]


@pytest.mark.parametrize(
    ("command", "option"),
    [
        (("scan", "mine.npy", "--unit", "N"), "unit"),
        (("scan", "mine.npy", "--height-scale", "-1"), "height_scale"),
        (("scan", "mine.npy", "--format", "foo"), "mine.npy: format"),
        (("new", "mine.npy", "--contact", "3"), "contact"),
        (("run", "ball.toml", "--for", "much"), "for"),
        (("trade", "ball.toml", "--accuracy", "much"), "accuracy"),
        (("budget", "ball.toml", "--modulus-error", "much"), "modulus_error"),
        (("budget", "ball.toml", "--cutoff", "99 s"), "cutoff"),
    ],
)
def test_refused_option__is_named(invoke, tmp_path, command, option):
    np.save(tmp_path / "mine.npy", np.zeros((9, 8)))
    write_study()
    status, _, err = invoke(*command)
    assert status == 2
    assert err.startswith(f"roughvisc: {option}: found "), err


@pytest.mark.thorough
def test_budget__names_what_open_sources_need(invoke, coarse_pictures):
    status, out, _ = invoke("budget", write_study(), "--modulus-error", "10%")
    assert (status, "--time-scale-error" in out, "--modulus-error" in out) == (0, True, False)
    status, out, _ = invoke("run", write_study(), "--for", "50 % approach", "--no-plots")
    assert (status, "time_scale_error" in out, "--time-scale-error" in out) == (0, True, False), "no option of run"


def test_run__of_contact_at_the_border_is_status_2_and_writes_nothing(invoke, tmp_path):
    status, out, err = invoke("run", write_study(BALL, ('"5 mN"', '"50 N"')), "-q")
    assert (status, out) == (2, "")
    assert err.startswith("roughvisc: ball.toml: ")
    assert "boundary" in err
    assert [p.name for p in tmp_path.iterdir()] == ["ball.toml"], "nothing is half-written"


def test_run__interrupted_is_status_130(invoke, tmp_path, monkeypatch):
    def interrupted(*args, **settings):
        raise KeyboardInterrupt

    monkeypatch.setattr(run_module, "solve", interrupted)
    status, _, err = invoke("run", write_study())
    assert status == 130
    assert err == "roughvisc: interrupted; finished work is kept; repeat the command to resume\n"
    assert [p.name for p in tmp_path.iterdir()] == ["ball.toml"]


def test_run__disk_full_is_status_1(invoke, monkeypatch):
    def full(*args, **settings):
        raise OSError(28, "No space left on device", "result.nc")

    monkeypatch.setattr(run_module, "write_result", full)
    status, _, err = invoke("run", write_study())
    assert status == 1
    assert err.count("\n") == 1
    assert ".nc: No space left on device; what was computed up to the last checkpoint is kept: make room and" in err


def test_process__ends_with_its_status(tmp_path):
    """A real process: exit status, streams, and no heavy import for the help."""
    (tmp_path / "bad.toml").write_text("title = 3")
    command = [sys.executable, "-W", "error", "-m", "roughvisc"]
    bad = subprocess.run([*command, "run", "bad.toml"], cwd=tmp_path, capture_output=True, text=True)
    assert (bad.returncode, bad.stdout, bad.stderr.startswith("roughvisc: bad.toml: ")) == (2, "", True)
    code = (
        "import sys; from roughvisc.cli import main; main(sys.argv[1:], standalone_mode=False); "
        "print(sorted({'numpy', 'xarray', 'pint', 'rich', 'matplotlib'} & set(sys.modules)))"
    )
    for quick in ("--help", "--version"):
        command = [sys.executable, "-c", code, quick]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
        assert done.stdout.endswith("[]\n")


@pytest.mark.thorough
@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_streams__whose_encoding_lacks_letters_end_no_command(tmp_path, monkeypatch, scan_file, encoding):
    """Units (µm), rules of tables and titles of studies."""
    monkeypatch.chdir(tmp_path)
    study = write_study(BALL, ("A ball", "Härte λ \U0001f600"))
    results, budget = "results/ball", ("budget", study, "-q")
    commands = [("--help",), ("scan", scan_file), ("new", scan_file), ("plan", study), ("run", study, "--no-plots")]
    commands += [("audit", results), ("verify", results), ("report", results), ("clean", results), budget]
    for arguments in [*commands, ("plot", results), ("run", "λ.toml")]:
        streams = [io.TextIOWrapper(io.BytesIO(), encoding=encoding, write_through=True) for _ in range(2)]
        monkeypatch.setattr(sys, "stdout", streams[0])
        monkeypatch.setattr(sys, "stderr", streams[1])
        with pytest.raises(SystemExit) as ended:
            main([str(one) for one in arguments])
        monkeypatch.undo()
        monkeypatch.chdir(tmp_path)
        assert ended.value.code == (2 if "λ.toml" in arguments else 0), (arguments, streams[1].buffer.getvalue())


@pytest.fixture
def scan_file(tmp_path):
    """A tilted scan with missing points, as a grid file."""
    h = rv.self_affine((40e-6, 30e-6), (40, 30), hurst=0.8, rms_height=1e-7, seed=2)
    h = h + 1e-2 * h.x
    h.values[3:6, 7] = np.nan
    h.attrs["units"] = "m"
    path = tmp_path / "tilted.nc"
    h.rename("height").to_netcdf(path)
    return path


@pytest.mark.thorough
def test_scan__says_what_is_there_and_draws_it(invoke, tmp_path, scan_file):
    status, out, err = invoke("scan", scan_file)
    assert (status, err) == (0, "")
    for words in ("40 µm x 30 µm", "40 x 30 points", "1 µm x 1 µm", "3 (0.25 %)", "Spikes", "Noise"):
        assert words in out
    assert (tmp_path / "tilted.png").stat().st_size > 10_000
    table = tomllib.loads(out[out.index("[surface]") : out.index("Picture: ")])["surface"]
    assert table == {"file": "tilted.nc", "level": 1, "fill": "harmonic"}
    assert invoke("scan", scan_file, "--plot", "a/b.pdf", "--spacing", "2um,3 um")[0] == 0
    assert (tmp_path / "a" / "b.pdf").exists()


def test_new__writes_a_study_that_runs_and_brings_some_per_cent_into_contact(invoke, tmp_path, scan_file):
    status, out, err = invoke("new", scan_file)
    assert (status, err) == (0, "")
    assert "Study: tilted-study.toml\nNext: roughvisc plan tilted-study.toml\n" in out
    text = (tmp_path / "tilted-study.toml").read_text()
    assert "#" in text.splitlines()[0]
    (case,) = read_cases("tilted-study.toml")
    height = case.height()
    assert height.shape == (40, 30)
    assert not height.isnull().any()
    assert invoke("plan", "tilted-study.toml")[0] == 0
    assert invoke("run", "tilted-study.toml", "--no-plots", "-q") == (0, "", "")
    (result,) = (tmp_path / "results" / "tilted-study").glob("*.nc")
    with xr.open_dataset(result) as ds:
        assert float(ds.contact_fraction[-1]) == pytest.approx(0.05, rel=0.05)
        assert float(ds.contact_fraction[0]) < float(ds.contact_fraction[-1])


def test_new__without_a_file_begins_with_an_example(invoke, tmp_path):
    status, out, err = invoke("new")
    assert (status, err) == (0, "")
    assert "Scan: focus_variation.x3p\nStudy: focus_variation-study.toml\nNext: " in out
    (case,) = read_cases("focus_variation-study.toml")
    assert case.height().shape == (160, 256)
    assert (case.material, case.settings.boundary) == (RUBBER, "mirror")
    ds = rv.run(vary(case, {"surface.resample": [20, 32], "keep.times": 2}), progress=False)
    assert 0 < float(ds.contact_fraction[-1]) < 1
    assert invoke("new", "-o", "again.toml")[0] == 0, "the scan is there already"
    (tmp_path / "focus_variation.x3p").write_bytes(b"mine")
    assert invoke("new", "-o", "third.toml")[0] == invoke("new", "-o", "third.toml", "--unit", "um")[0] == 2
    assert not (tmp_path / "third.toml").exists()
    assert (tmp_path / "focus_variation.x3p").read_bytes() == b"mine"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("new SCAN -o mine.toml", "mine.toml"),
        ("new SCAN -o mine.txt", ".toml"),
        ("new SCAN --channel 7", "channel: found 7"),
        ("new SCAN --contact 120%", "contact: found '120%'"),
        ("scan gone.sur", "gone.sur"),
        ("scan SCAN --spacing 2N", "spacing: found '2N'"),
        ("scan SCAN --spacing 1,2,3", "spacing"),
        ("scan SCAN --plot x.docx", "x.docx"),
        ("scan SCAN --plot tilted.nc", "already exists"),
        ("scan SCAN --to tilted.nc", "already exists"),
        ("scan SCAN --to scan.stl", ".x3p"),
    ],
)
def test_commands_of_scans__refuse_with_status_2_and_leave_every_file(invoke, tmp_path, scan_file, arguments, words):
    (tmp_path / "mine.toml").write_text("# mine\n")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    status, _, err = invoke(*arguments.replace("SCAN", str(scan_file)).split())
    assert (status, words in err) == (2, True)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_scan__converts(invoke, tmp_path, scan_file):
    status, out, err = invoke("scan", scan_file, "--to", "out/scan.x3p")
    assert (status, err) == (0, "")
    assert "Converted: out/scan.x3p" in out
    np.testing.assert_array_equal(rv.open_scan(tmp_path / "out" / "scan.x3p"), rv.open_scan(scan_file))


def test_scan__writes_a_card(invoke, tmp_path, scan_file):
    assert invoke("scan", scan_file, "--card", "cards/mine.toml")[0] == 0
    expected = rv.fill(rv.level(rv.open_scan(scan_file), 1), "harmonic")  # as scan recommends
    np.testing.assert_array_equal(rv.open_scan(tmp_path / "cards" / "mine.toml"), expected)
    card = tmp_path / "cards" / "mine.toml"
    assert invoke("scan", card)[0] == 0
    before = card.read_text()
    assert invoke("scan", scan_file, "--card", card)[0] == 2
    assert card.read_text() == before


def test_scan__lists_channels_and_asks_for_what_a_file_does_not_state(invoke, tmp_path):
    x3pio = pytest.importorskip("x3pio")
    z = 1e-6 * np.random.default_rng(0).normal(size=(2, 20, 30))
    x3pio.write(tmp_path / "two.x3p", z, x_scale=1e-6, y_scale=2e-6)
    status, out, err = invoke("scan", "two.x3p")
    assert (status, err) == (0, "")
    for words in ("layer 0", "layer 1", "30 x 20 points", "Sa, ", "Ssk, ", "Sdr, "):
        assert words in out
    np.save(tmp_path / "plain.npy", z[0])
    for given, missing in (([], "unit"), (["--spacing", "1um"], "unit"), (["--unit", "m"], "spacing")):
        status, _, err = invoke("scan", "plain.npy", *given)
        assert (status, f"expected {missing} = " in err) == (2, True)
    assert "expected unit = " in invoke("run", write_study(BALL, (SPHERE, 'file = "plain.npy"\n')))[2], "a key"
    assert invoke("scan", "plain.npy", "--unit", "m", "--spacing", "1um", "--card", "plain.toml")[0] == 0
    assert rv.open_scan(tmp_path / "plain.toml").shape == (30, 20)


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals of POSIX")
def test_new__asks_a_person_for_what_a_file_does_not_state_and_keeps_the_answers(tmp_path):
    np.save(tmp_path / "plain.npy", np.random.default_rng(0).normal(size=(20, 30)))
    command = [sys.executable, "-m", "roughvisc", "new", "plain.npy"]
    person, terminal = os.openpty()
    process = subprocess.Popen(command, cwd=tmp_path, stdin=terminal, stderr=terminal, stdout=subprocess.PIPE)
    os.write(person, b"um\n1 um\n")
    assert process.wait(100) == 0
    process.stdout.close()
    asked = os.read(person, 4096).decode()
    os.close(person)
    os.close(terminal)
    assert asked.count("plain.npy: ") == 2
    (case,) = read_cases(tmp_path / "plain-study.toml")
    assert float(raw_height("surface", case.surface).x[0]) == 5e-7
    (tmp_path / "plain-study.toml").unlink()
    alone = subprocess.run(command, cwd=tmp_path, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert (alone.returncode, "expected unit" in alone.stderr) == (2, True)


@pytest.mark.thorough
def test_plot__draws_a_file_or_a_folder(invoke, tmp_path, coarse_pictures, monkeypatch):
    from sample_results import rough_creep

    monkeypatch.setattr("roughvisc.progress.LINE_EVERY", math.inf)  # the machine may be slow
    path = write_result(rough_creep(shape=(24, 20), frames=4), tmp_path / "out" / "case.nc")
    for target in (path, path.parent):
        status, out, err = invoke("plot", target, "--out", "figures")
        assert (status, err) == (0, "")
        assert out == "2 figures: figures\n"
    assert {one.name for one in (tmp_path / "figures").iterdir()} == {"case-history.png", "case-maps.png"}
    status, out, err = invoke("plot", path, "--all", "--out", "all")
    drawn = {one.name for one in (tmp_path / "all").iterdir()}
    assert (status, err, out) == (0, "", f"{len(drawn)} figures: all\n")
    assert {"case-history.png", "case-maps.png", "case-section.png", "case-surface.png"} <= drawn
    (tmp_path / "empty").mkdir()
    assert invoke("plot", "empty")[0] == 2
    status, _, err = invoke("plot", "gone.nc")
    assert (status, err) == (2, "roughvisc: gone.nc: does not exist: expected a result of roughvisc (.nc)\n")


def test_table__of_a_result_and_of_a_folder(invoke, tmp_path):
    assert invoke("run", write_study(), "--out", "out", "--no-plots", "-q")[0] == 0
    (path,) = (tmp_path / "out").glob("*.nc")
    assert invoke("table", path) == (0, f"Table: out/{path.stem}.csv\n", "")
    heading, *rows = path.with_suffix(".csv").read_text().splitlines()
    assert heading.startswith("time [s],")
    assert [float(row.split(",")[0]) for row in rows] == [0.0, 0.1, 0.2]
    assert invoke("table", path.parent, "--out", "cases.csv") == (0, "Table: cases.csv\n", "")
    heading, row = (tmp_path / "cases.csv").read_text().splitlines()
    assert "contact_area [m^2]" in heading
    assert path.name in row
    assert invoke("table", "gone")[0] == 2
