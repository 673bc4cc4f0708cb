"""The command line: what it writes, what it says, and how it ends."""

import io
import math
import os
import shlex
import subprocess
import sys
import tomllib

import numpy as np
import pytest
import xarray as xr
from support import BALL

import roughvisc as rv
from roughvisc.cli import main
from roughvisc.runs import run as run_module
from roughvisc.runs.netcdf import write_result
from roughvisc.study.case import read_cases, vary
from roughvisc.study.first_study import RUBBER
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
    unload = '[[program]]\nload = 0\nover = "0.1 s"\n[solve]\ngrid_error = true'
    study = write_study(BALL, ("[solve]", unload), ('"200 ms"]', "0.3]"))
    status, out, err = invoke("run", study)
    assert (status, err) == (0, "")
    (result,) = (tmp_path / "results" / "ball").glob("*.nc")
    figures = {p.name.rpartition("-")[2] for p in result.parent.glob("*.png")}
    assert figures == {"history.png", "maps.png"}
    assert f"Result: results/ball/{result.name}\n" in out
    assert out.endswith("2 figures: results/ball\n")
    shown = {line[:30].strip(): line[30:].strip() for line in out.splitlines()}
    found = [shown["Grid"], shown["Force at the end"], shown["Contact area at the end"].partition(";")[0]]
    assert found == ["24 x 21 cells, free boundary", "0 N", "0 m²"]
    with rv.open_result(result) as ds:
        assert shown["Accuracy: worst grid error"] == f"{100 * float(ds.grid_error.max()):.2g} % of the pressure"
        assert shown["Largest contact area"] == f"{1e6 * float(ds.contact_area[1]):.3g} mm² at t = 100 ms"
    before = result.stat().st_mtime_ns
    assert "nothing to compute" in invoke("run", study, "--no-plots")[1]
    assert result.stat().st_mtime_ns == before


def test_run__sweep_with_a_case_that_fails_is_status_1_and_tried_again(invoke, tmp_path):
    sweep = '[sweep]\n"program.0.load" = ["5 mN", "50 N", "6 mN"]'
    status, out, err = invoke("run", write_study(BALL + sweep), "--workers", 0, "--device", "cpu")
    folder = tmp_path / "results" / "ball"
    (record,) = folder.glob("*.failed.json")
    assert (status, len(list(folder.glob("*.nc"))), "case 1" in err) == (1, 2, True)
    assert "Results: results/ball\nTable of cases: results/ball/cases.csv\nLog: results/ball/sweep.log\n" in out
    settings = [name for name in rv.to_table(folder) if name.startswith(("program.", "solve."))]
    assert settings == ["program.0.load [N]"], "an option is no setting that the study varies"
    before = record.stat().st_mtime_ns
    assert invoke("run", "ball.toml", "--workers", 0, "-q")[:2] == (1, "")
    assert record.stat().st_mtime_ns > before, "a failed case is tried again"


@pytest.mark.parametrize(
    ("step", "error", "status", "message"),
    [
        ("solve", KeyboardInterrupt(), 130, "interrupted; finished work is kept; repeat the command to resume"),
        ("write_result", OSError(28, "No space left on device", "result.nc"), 1, ".nc: No space left on device; "),
    ],
)
def test_run__that_ends_early_has_its_status_and_one_message(
    invoke, tmp_path, monkeypatch, step, error, status, message
):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr(run_module, step, fails)
    found, _, err = invoke("run", write_study())
    assert (found, err.count("\n"), message in err) == (status, 1, True)
    assert not list(tmp_path.rglob("*.nc"))


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
def test_streams__whose_encoding_lacks_letters_end_no_command(tmp_path, monkeypatch, scan_file):
    """Units (µm), rules of tables and titles of studies."""
    monkeypatch.chdir(tmp_path)
    study, results = write_study(BALL, ("A ball", "Härte λ \U0001f600")), "results/ball"
    commands = [("--help",), ("scan", scan_file), ("new", scan_file), ("plan", study), ("run", study, "--no-plots")]
    commands += [(verb, results) for verb in ("audit", "verify", "report", "clean", "plot")]
    for arguments in [*commands, ("budget", study, "-q"), ("run", "λ.toml")]:
        with monkeypatch.context() as patched:
            for name in ("stdout", "stderr"):
                patched.setattr(sys, name, io.TextIOWrapper(io.BytesIO(), encoding="ascii", write_through=True))
            with pytest.raises(SystemExit) as ended:
                main([str(one) for one in arguments])
        assert ended.value.code == (2 if "λ.toml" in arguments else 0), arguments


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
    assert table == {"file": "tilted.nc", "level": 1, "fill": True}
    assert invoke("scan", scan_file, "--plot", "a/b.pdf", "--spacing", "2um,3 um")[0] == 0
    assert (tmp_path / "a" / "b.pdf").exists()


@pytest.mark.parametrize("name", ["tilted.png", "own.pdf"])
def test_scan__replaces_its_own_picture_and_keeps_any_other(name, invoke, tmp_path, scan_file):
    """Another spacing changes the picture; a file of another origin stays."""
    command = ["scan", scan_file] if name == "tilted.png" else ["scan", scan_file, "--plot", name]
    assert f"Picture: {name}\n" in invoke(*command)[1]
    first = (tmp_path / name).read_bytes()
    assert f"Picture: {name}\n" in invoke(*command, "--spacing", "2um")[1]
    assert (tmp_path / name).read_bytes() != first
    (tmp_path / name).write_bytes(b"mine")
    status, out, err = invoke(*command)
    assert (tmp_path / name).read_bytes() == b"mine"
    if name == "tilted.png":
        assert (status, err) == (0, "")
        assert "kept" in out
    else:
        assert (status, out) == (2, "")
        assert name in err


def test_new__writes_a_study_that_runs_and_brings_some_per_cent_into_contact(invoke, tmp_path, scan_file):
    status, out, err = invoke("new", scan_file, "--contact", "10 %")
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
        assert float(ds.contact_fraction[-1]) == pytest.approx(0.1, rel=0.05)
        assert float(ds.contact_fraction[0]) < float(ds.contact_fraction[-1])


def test_new__of_a_scan_that_misses_its_contact_warns(invoke, tmp_path):
    heights = np.zeros((20, 24))
    heights[9:11] = -1e-7  # the rest touches under any pressure
    rv.save_scan(rv.from_array(heights, 1e-6), tmp_path / "plateaus.nc")
    status, _, err = invoke("new", "plateaus.nc", "--contact", "10 %")
    assert status == 0
    (warned,) = err.splitlines()
    assert "10 % requested" in warned
    assert warned.partition("warning: ")[2] in (tmp_path / "plateaus-study.toml").read_text()


def test_new__prints_commands_that_run_for_any_name(invoke, tmp_path, scan_file):
    scan_file.rename(tmp_path / "-5 it's $PWD.nc")
    _, out, _ = invoke("new", "./-5 it's $PWD.nc")
    printed = [line.partition("roughvisc ")[2] for line in out.splitlines() if "roughvisc plan" in line]
    study = tmp_path / "-5 it's $PWD-study.toml"
    assert '(roughvisc new --contact "5 %")' in study.read_text(), "by default"
    printed += [line.partition("roughvisc ")[2].partition("   ")[0] for line in study.read_text().splitlines()[1:3]]
    assert [shlex.split(line)[0] for line in printed] == ["plan", "plan", "run"]
    for line in printed:
        assert main.commands["plan"].make_context("plan", shlex.split(line)[1:]).params["study"].samefile(study)


def test_new__without_a_file_begins_with_an_example(invoke, tmp_path):
    status, out, err = invoke("new")
    assert (status, err) == (0, "")
    assert "Scan: focus_variation.x3p\nStudy: focus_variation-study.toml\nNext: " in out
    (case,) = read_cases("focus_variation-study.toml")
    assert case.height().shape == (160, 256)
    assert (case.material, case.settings.boundary) == (RUBBER, "mirror")
    ds = rv.run(vary(case, {"surface.resample": (20, 32), "keep.times": 2}), progress=False)
    assert 0 < float(ds.contact_fraction[-1]) < 1
    assert invoke("new", "-o", "again.toml")[0] == 0, "the scan is there already"
    (tmp_path / "focus_variation.x3p").write_bytes(b"mine")
    assert invoke("new", "-o", "third.toml")[0] == invoke("new", "-o", "third.toml", "--unit", "um")[0] == 2
    assert not (tmp_path / "third.toml").exists()
    assert (tmp_path / "focus_variation.x3p").read_bytes() == b"mine"


#: Studies that are refused, beside the sound one and one file that is not to be overwritten.
REFUSED = {
    "heavy": BALL.replace('"5 mN"', '"50 N"'),
    "bare": BALL.replace(SPHERE, 'file = "tilted.nc"\n').replace('[solve]\nboundary = "free"\n', ""),
    "cropped": BALL.replace("level = 0", "crop = { x = ['2 mm', '3 mm'] }"),
    "ball": BALL,
    "mine": "# mine\n",
}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("new tilted.nc -o mine.toml", "mine.toml"),
        ("new tilted.nc -o mine.txt", ".toml"),
        ("new tilted.nc --channel 7", "channel: found 7"),
        ("new tilted.nc --contact 120%", "contact: found '120%'"),
        ("scan gone.sur", "gone.sur"),
        ("scan tilted.nc --spacing 2N", "spacing: found '2N'"),
        ("scan tilted.nc --spacing 1,2,3", "spacing"),
        ("scan tilted.nc --plot x.docx", "x.docx"),
        ("scan tilted.nc --plot tilted.nc", "already exists"),
        ("scan tilted.nc --to tilted.nc", "already exists"),
        ("scan tilted.nc --to scan.stl", ".x3p"),
        ("scan tilted.nc --card mine.toml", "already exists"),
        ("scan tilted.nc --height-scale -1", "height_scale: found"),
        ("scan tilted.nc --format foo", "format: found 'foo'"),
        ("run ball.toml --scheduler-file gone.json", "gone.json: "),
        ("run ball.toml --for much", "for: found 'much'"),
        ("trade ball.toml --accuracy much", "accuracy: found 'much'"),
        ("budget ball.toml --modulus-error much", "modulus_error: found 'much'"),
        ("budget ball.toml --cutoff 99s", "cutoff: found '99s'"),
        ("run heavy.toml -q", "heavy.toml: "),
        ("run bare.toml", "bare.toml: solve.boundary: "),
        ("plan bare.toml", "bare.toml: solve.boundary: "),
        ("trade bare.toml", "bare.toml: solve.boundary: "),
        ("plan cropped.toml", "cropped.toml: cannot run: surface.crop"),
        ("plot gone.nc", "gone.nc: "),
        ("table gone", "gone: "),
    ],
)
def test_commands__refuse_with_status_2_and_leave_every_file(invoke, tmp_path, scan_file, arguments, words):
    for name, text in REFUSED.items():
        (tmp_path / f"{name}.toml").write_text(text)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    status, _, err = invoke(*arguments.split())
    assert (status, words in err) == (2, True), err
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_scan__converts_and_writes_a_card(invoke, tmp_path, scan_file):
    card = tmp_path / "cards" / "mine.toml"
    assert invoke("scan", scan_file, "--to", "out/scan.x3p")[0] == 0
    assert invoke("scan", scan_file, "--card", card)[0] == 0
    np.testing.assert_array_equal(rv.open_scan(tmp_path / "out" / "scan.x3p"), rv.open_scan(scan_file))
    expected = rv.fill(rv.level(rv.open_scan(scan_file), 1))  # as scan recommends
    np.testing.assert_array_equal(rv.open_scan(card), expected)
    assert invoke("scan", card)[0] == 0


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
        assert (status, f"expected --{missing} " in err) == (2, True)
    assert "expected unit = " in invoke("run", write_study(BALL, (SPHERE, 'file = "plain.npy"\n')))[2], "a key"
    assert invoke("scan", "plain.npy", "--unit", "m", "--spacing", "1um", "--card", "plain.toml")[0] == 0
    assert rv.open_scan(tmp_path / "plain.toml").shape == (30, 20)


@pytest.mark.thorough
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
    closed = ["sh", "-c", 'exec "$@" <&-', "sh", *command]  # a closed stream is None
    alone = subprocess.run(closed, cwd=tmp_path, capture_output=True, text=True)
    assert (alone.returncode, alone.stderr.count("\n"), "expected --unit" in alone.stderr) == (2, 1, True)


@pytest.mark.thorough
def test_plot__draws_a_file_or_a_folder(invoke, tmp_path, coarse_pictures, monkeypatch):
    from sample_results import rough_creep

    monkeypatch.setattr("roughvisc.progress.LINE_EVERY", math.inf)  # the machine may be slow
    path = write_result(rough_creep(shape=(24, 20), frames=4), tmp_path / "out" / "case.nc")
    for target in (path, path.parent):
        assert invoke("plot", target, "--out", "figures") == (0, "2 figures: figures\n", "")
    assert {one.name for one in (tmp_path / "figures").iterdir()} == {"case-history.png", "case-maps.png"}
    status, out, err = invoke("plot", path, "--all", "--out", "all")
    drawn = {one.name for one in (tmp_path / "all").iterdir()}
    assert (status, err, out) == (0, "", f"{len(drawn)} figures: all\n")
    assert {"case-history.png", "case-maps.png", "case-section.png", "case-surface.png"} <= drawn


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
