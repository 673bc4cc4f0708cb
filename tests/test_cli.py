"""The command line: what it writes, what it says, and how it ends."""

import re
import subprocess
import sys
import tomllib

import numpy as np
import pytest
import xarray as xr
from support import BALL

import roughvisc as rv
from roughvisc.cli import main
from roughvisc.study.execution import run as run_module
from roughvisc.study.execution.run import result_folder
from roughvisc.study.statement.case import read_cases, vary
from roughvisc.study.storage.store import write_result
from roughvisc.study.trade.files import trade_folder


def write_study(text=BALL, *replacements):
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    with open("ball.toml", "w") as stream:
        stream.write(text)
    return "ball.toml"


def test_run__writes_result_and_figures_and_sums_up(invoke, tmp_path, coarse_pictures):
    status, out, err = invoke("run", write_study())
    assert (status, err) == (0, "")
    (result,) = (tmp_path / "results" / "ball").glob("*.nc")
    figures = {p.name.rpartition("-")[2] for p in result.parent.glob(f"{result.stem}-*.png")}
    assert figures == {"history.png", "maps.png"}
    assert "2 figures: results/ball\n" in out
    assert f"Result: results/ball/{result.name}\n" in out
    for words in (
        "24 x 21 cells, free",
        "to t = 200 ms",
        "5 mN",
        "worst stated error",
        "tolerance 0.001",
        "convolutions",
        "wall time",
    ):
        assert words in out


def test_run__of_what_is_finished_says_that_nothing_is_computed(invoke):
    sweep = '[sweep]\n"program.0.load" = ["5 mN", "6 mN"]'
    for text, options, said in (
        (BALL, ("--no-plots",), "Already finished: nothing to compute"),
        (BALL + sweep, ("--workers", 0), "2, all before: nothing to compute"),
    ):
        study = write_study(text)
        first, again = (invoke("run", study, *options)[1] for _ in range(2))
        assert said not in first
        assert said in again


def test_run__quiet_says_nothing(invoke, tmp_path):
    assert invoke("run", write_study(), "--out", "there", "--no-plots", "-q") == (0, "", "")
    assert [p.suffix for p in (tmp_path / "there").iterdir()] == [".nc"]


def test_run__sweep_goes_on_after_a_case_that_fails(invoke, tmp_path):
    sweep = '[sweep]\n"program.0.load" = ["5 mN", "50 N", "6 mN"]'
    status, out, err = invoke("run", write_study(BALL + sweep), "--workers", 0)
    assert status == 1
    folder = tmp_path / "results" / "ball"
    assert len(list(folder.glob("*.nc"))) == 2
    assert len(list(folder.glob("*.failed.json"))) == 1
    assert err.startswith("roughvisc: case 1: ")
    assert err.endswith("roughvisc: 1 of 3 cases failed\n")
    for words in (
        "case 1 (program.0.load = 50 N): failed: ",
        "2 of 3 cases done, 1 failed",
        "2, 0 of them before",
    ):
        assert words in out
    assert "Results: results/ball\nTable of cases: results/ball/cases.csv\nLog: results/ball/sweep.log\n" in out

    status, out, err = invoke("run", "ball.toml", "--workers", 0, "-q")
    assert (status, out) == (1, "")
    assert "case 1, as before (use --retry-failed to try again): " in err
    assert "as before" not in invoke("run", "ball.toml", "--workers", 0, "--retry-failed")[2]


def test_run__sweep_in_which_all_is_wrong_is_status_2(invoke):
    sweep = '[sweep]\n"program.0.load" = ["50 N", "60 N"]'
    status, _, err = invoke("run", write_study(BALL + sweep), "--workers", 0)
    assert status == 2
    assert err.endswith("roughvisc: no case could be computed: the input is invalid\n")


def test_run__scheduler_that_is_not_there_is_status_2(invoke, tmp_path):
    status, _, err = invoke("run", write_study(), "--scheduler-file", "gone.json")
    assert (status, err[:22]) == (2, "roughvisc: gone.json: ")
    assert [p.name for p in tmp_path.iterdir()] == ["ball.toml"]


def test_plan__says_what_will_be_modelled_and_what_it_costs(invoke, tmp_path):
    sweep = '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]'
    status, out, err = invoke("plan", write_study(BALL + sweep))
    assert (status, err) == (0, "")
    for words in ("2, ", "free, FFTs padded", "1 exponential", "24 x 21 cells", "Convolutions", "Disk", "load", "[mN]"):
        assert words in out
    assert [p.name for p in tmp_path.iterdir()] == ["ball.toml"], "nothing is written"
    status, _, err = invoke("plan", write_study(BALL, ("level = 0", "crop = 3")))
    assert status == 2


@pytest.mark.parametrize("verb", ["plan", "run", "trade"])
def test_study_of_a_scan_without_a_boundary__is_asked_for_it_and_nothing_is_written(invoke, tmp_path, scan_file, verb):
    surface = BALL[BALL.index("generate") : BALL.index("[material]")]
    text = BALL.replace(surface, f'file = "{scan_file}"\n').replace('[solve]\nboundary = "free"\n', "")
    status, out, err = invoke(verb, write_study(text))
    assert (status, out) == (2, "")
    first, *rows = err.strip().split("\n")
    assert first.startswith(
        "roughvisc: ball.toml: solve.boundary: is 'auto', the default, and the surface does not tell"
    )
    answers = [row.partition(": ")[2].partition(" with")[0].partition(";")[0] for row in rows]
    assert answers == ['boundary = "periodic"', 'boundary = "free"', 'boundary = "free"']
    assert rows[-1].endswith('edge = "accept"')
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ball.toml", "tilted.nc"]


def test_plan__of_a_study_that_cannot_run_says_why_and_shows_no_table(invoke):
    study = write_study(BALL, ("level = 0", "crop = { x = ['2 mm', '3 mm'] }"))
    status, out, err = invoke("plan", study)
    assert (status, out) == (2, "")
    assert err.startswith("roughvisc: ball.toml: cannot run: surface: crop")
    ramp = 'approach = "1 um"'
    text = BALL.replace('load = "5 mN"', ramp).replace('"zener"\nshear', '"kelvin_voigt"\nshear')
    text = text.replace('kelvin_modulus = "1 MPa"\nkelvin_', "")
    sweep = '[sweep]\n"program.0.over" = [0, 0.1]'
    status, out, err = invoke("plan", write_study(text + sweep))
    assert status == 2
    assert "cannot run: 1 of 2 cases: at 0 s the approach jumps" in err
    assert [line.split()[-2:] for line in out.splitlines() if "cannot" in line] == [["cannot", "run"]]


def test_help__summaries_of_commands_are_whole(invoke):
    listed = invoke("--help")[1].split("Commands:")[1].strip().splitlines()
    assert len(listed) == 11
    assert all(line.endswith(".") and not line.endswith("..") for line in listed)


def test_run__not_converged_is_status_1_and_the_file_is_kept(invoke, tmp_path, stubborn):
    status, out, err = invoke("run", write_study(), "--no-plots")
    assert status == 1
    assert "1 of 3 kept times did not converge" in err
    assert "Result: " in out
    assert len(list((tmp_path / "results" / "ball").iterdir())) == 1


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"5 mN"', '"5 mm"', "program.0.load: found '5 mm', which is in millimeter: expected a number in N"),
        ('radius = "10 mm"', 'radios = "10 mm"', "surface.radios: unknown key; did you mean 'radius'?"),
        ('"3 MPa"', '"-3 MPa"', "material.shear_modulus: found '-3 MPa': expected a number in Pa"),
        ('"0.1 MPa s"', '"0.1 MPa s"\npoisson = 0.51', "material.poisson: found 0.51: expected a number above -1"),
        ("[24, 21]", "[0, 21]", "surface.shape.0: found 0: expected a whole number at least 1"),
        ('"5 mN"', "nan", "program.0.load: found nan: expected a number"),
        ('"5 mN"', '"50 N"', "boundary"),
    ],
)
def test_run__bad_input_is_status_2_and_one_message(invoke, tmp_path, old, new, words):
    status, out, err = invoke("run", write_study(BALL, (old, new)), "-q")
    assert (status, out) == (2, "")
    assert err.startswith("roughvisc: ball.toml: ")
    assert words in err
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


def test_scan__says_what_is_there_and_draws_it(invoke, tmp_path, scan_file):
    status, out, err = invoke("scan", scan_file)
    assert (status, err) == (0, "")
    for words in ("40 µm x 30 µm", "40 x 30 points", "1 µm x 1 µm", "3 (0.25 %)", "Sq, levelled", "rms slope"):
        assert words in out
    assert "Picture: tilted.png" in out
    assert (tmp_path / "tilted.png").stat().st_size > 10_000
    assert invoke("scan", scan_file, "--plot", "a/b.pdf", "--spacing", "2um,3 um")[0] == 0
    assert (tmp_path / "a" / "b.pdf").exists()


def test_scan__says_what_it_sees_and_prints_a_surface_table_that_a_study_takes(invoke, tmp_path, scan_file):
    status, out, _ = invoke("scan", scan_file)
    assert status == 0
    for words in ("Missing points", "3 (0.25 %)", "Spikes", "° along x", "neighbouring rows", "Noise", "-> "):
        assert words in out
    table = tomllib.loads(out[out.index("[surface]") : out.index("Picture: ")])["surface"]
    assert table == {"file": "tilted.nc", "level": 1, "fill": "harmonic", "mirror": True}


def test_new__writes_a_study_that_runs_and_brings_some_per_cent_into_contact(invoke, tmp_path, scan_file):
    status, out, err = invoke("new", scan_file)
    assert (status, err) == (0, "")
    assert "Study: tilted-study.toml\nNext: roughvisc plan tilted-study.toml\n" in out
    text = (tmp_path / "tilted-study.toml").read_text()
    assert "#" in text.splitlines()[0]
    (case,) = read_cases("tilted-study.toml")
    height = case.settings.surface.height()
    assert height.shape == (80, 60)
    assert not height.isnull().any()
    assert invoke("plan", "tilted-study.toml")[0] == 0
    assert invoke("run", "tilted-study.toml", "--no-plots", "-q") == (0, "", "")
    (result,) = (tmp_path / "results" / "tilted-study").glob("*.nc")
    with xr.open_dataset(result) as ds:
        assert float(ds.contact_fraction[-1]) == pytest.approx(0.05, rel=0.05)
        assert float(ds.contact_fraction[0]) < float(ds.contact_fraction[-1])


def test_new__presses_to_the_contact_that_is_asked_for(invoke, tmp_path, scan_file):
    pressures = {}
    for contact in ("5 %", "20%"):
        study = tmp_path / f"{contact[:-1].strip()}.toml"
        assert invoke("new", scan_file, "--contact", contact, "-o", study)[0] == 0
        text = study.read_text()
        assert f'aims at {contact[:-1].strip()} % of the area in contact in the end (roughvisc new --contact "' in text
        (case,) = read_cases(study)
        pressures[contact] = case.settings.program[0].pressure
    ds = rv.run(case, progress=False)
    assert float(ds.contact_fraction[-1]) == pytest.approx(0.2, rel=0.05)
    assert invoke("new", scan_file, "-o", tmp_path / "usual.toml")[0] == 0
    assert read_cases(tmp_path / "usual.toml")[0].settings.program[0].pressure == pressures["5 %"] < pressures["20%"]


def test_new__refuses_to_write_over_and_names_its_options(invoke, tmp_path, scan_file):
    (tmp_path / "mine.toml").write_text("# mine\n")
    for arguments, words in (
        ([scan_file, "-o", "mine.toml"], "mine.toml: already exists"),
        ([scan_file, "-o", "mine.txt"], "expected a study file, .toml"),
        ([scan_file, "--channel", "7"], "--channel is 7"),
        ([scan_file, "--contact", "5 um"], "--contact: found '5 um': expected a part such as 1% or 0.01"),
        ([scan_file, "--contact", "120 %"], "--contact: found '120 %': expected a part such as 1% or 0.01"),
    ):
        status, _, err = invoke("new", *arguments)
        assert status == 2
        assert words in err
    assert (tmp_path / "mine.toml").read_text() == "# mine\n"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["mine.toml", "tilted.nc"]


def test_new__without_a_file_begins_with_an_example(invoke, tmp_path):
    status, out, err = invoke("new")
    assert (status, err) == (0, "")
    assert "Scan: focus_variation.x3p\nStudy: focus_variation-study.toml\nNext: " in out
    (case,) = read_cases("focus_variation-study.toml")
    assert case.height().shape == (320, 512), "with its mirror images"
    ds = rv.run(vary(case, {"surface.resample": [20, 32], "keep.times": 2}), progress=False)
    assert 0 < float(ds.contact_fraction[-1]) < 1
    assert invoke("new", "-o", "again.toml")[0] == 0, "the scan is there already"
    (tmp_path / "focus_variation.x3p").write_bytes(b"mine")
    for arguments, words in (
        (["-o", "third.toml"], "focus_variation.x3p: already exists and differs from the example"),
        (["-o", "third.toml", "--unit", "um"], "--unit: has no meaning without FILE: expected FILE"),
    ):
        status, _, err = invoke("new", *arguments)
        assert status == 2
        assert words in err
    assert not (tmp_path / "third.toml").exists()


def test_help__names_what_the_example_has_written(invoke):
    assert invoke("new")[0] == 0
    (case,) = read_cases("focus_variation-study.toml")
    results, traded = result_folder(case), trade_folder(case, None)
    there = {"focus_variation.x3p", "focus_variation-study.toml", str(results), str(traded / "trade.nc")}
    named = set()
    for command in (main, *main.commands.values()):
        lines = re.findall(r"^ *roughvisc (\w+) ?(.*)$", command.help, re.M)
        assert lines, f"{command.name} has no example"
        for verb, arguments in lines:
            assert verb in main.commands
            named |= {word for word in arguments.split()[:1] if not word.startswith("-")}
    assert named == there


def test_new__states_in_the_study_what_the_file_does_not(invoke, tmp_path):
    np.save(tmp_path / "plain.npy", np.random.default_rng(0).normal(size=(20, 30)))
    assert invoke("new", "plain.npy", "--unit", "um", "--spacing", "1um,2um", "-o", "a/plain.toml")[0] == 0
    (case,) = read_cases("a/plain.toml")
    height = case.settings.surface.raw()
    assert (height.shape, float(height.x[0]), float(height.y[0])) == ((30, 20), 5e-7, 1e-6)


def test_scan__bad_input_is_status_2(invoke, tmp_path, scan_file):
    for arguments, words in (
        (["gone.sur"], "gone.sur"),
        ([scan_file, "--plot", "x.docx"], "x.docx: is no kind of picture"),
        ([scan_file, "--spacing", "2 N"], "--spacing is '2 N', which is in newton: expected a number in m"),
        ([scan_file, "--spacing", "1,2,3"], "--spacing: found '1,2,3': expected one length, or two"),
        ([scan_file, "--channel", "7"], "channel is 7"),
    ):
        status, _, err = invoke("scan", *arguments)
        assert status == 2
        assert words in err
    assert [p.name for p in tmp_path.iterdir()] == ["tilted.nc"]


@pytest.mark.parametrize("suffix", ["nc", "x3p", "sdf"])
def test_scan__converts(invoke, tmp_path, scan_file, suffix):
    status, out, err = invoke("scan", scan_file, "--to", f"out/scan.{suffix}")
    assert (status, err) == (0, "")
    assert f"Converted: out/scan.{suffix}" in out
    np.testing.assert_array_equal(rv.open_scan(tmp_path / "out" / f"scan.{suffix}"), rv.open_scan(scan_file))


def test_scan__writes_a_card(invoke, tmp_path, scan_file):
    status, out, err = invoke("scan", scan_file, "--card", "cards/mine.toml")
    assert (status, err) == (0, "")
    assert "Card: cards/mine.toml" in out
    expected = rv.open_scan(scan_file)
    np.testing.assert_array_equal(rv.open_scan(tmp_path / "cards" / "mine.toml"), expected)
    assert invoke("scan", scan_file, "--card")[0] == 0
    card = tmp_path / "tilted.toml"
    np.testing.assert_array_equal(rv.open_scan(card), expected)
    assert invoke("scan", card)[0] == 0
    before = card.read_text()
    status, _, err = invoke("scan", scan_file, "--card")
    assert status == 2
    assert "tilted.toml: already exists" in err
    assert card.read_text() == before


def test_scan__lists_channels_and_parameters(invoke, tmp_path):
    x3pio = pytest.importorskip("x3pio")
    z = 1e-6 * np.random.default_rng(0).normal(size=(2, 20, 30))
    x3pio.write(tmp_path / "two.x3p", z, x_scale=1e-6, y_scale=2e-6)
    status, out, err = invoke("scan", "two.x3p")
    assert (status, err) == (0, "")
    for words in (
        "layer 0, one of:",
        "layer 1: height in m, 30 x 20 points",
        "Sa, ",
        "Ssk, ",
        "Sku, ",
        "Sz, ",
        "Sdr, ",
    ):
        assert words in out
    np.save(tmp_path / "plain.npy", z[0])
    status, _, err = invoke("scan", "plain.npy")
    assert status == 2
    missing = (
        "no unit of its heights and no size: pass --unit (such as --unit=um), and pass --spacing (such as --spacing="
    )
    assert f"it states {missing}1um,1um)\n" in err
    status, _, err = invoke("scan", "plain.npy", "--spacing", "1um")
    assert err.endswith("it states no unit of its heights: pass --unit (such as --unit=um)\n")
    status, _, err = invoke("scan", "plain.npy", "--unit", "m")
    assert status == 2
    assert err.endswith("it states no size: pass --spacing (such as --spacing=1um,1um)\n")
    assert invoke("scan", "plain.npy", "--unit", "m", "--spacing", "1um", "--card")[0] == 0
    assert rv.open_scan(tmp_path / "plain.toml").shape == (30, 20)


def test_scan__takes_a_unit_of_heights_and_says_what_a_large_slope_means(invoke, tmp_path):
    x, y = np.meshgrid(np.arange(17), np.arange(21), indexing="ij")
    z = 0.5 * np.sin(x) * np.sin(y)
    np.savetxt(tmp_path / "points.xyz", np.column_stack([1e-3 * x.ravel(), 1e-3 * y.ravel(), z.ravel()]))
    status, out, err = invoke("scan", "points.xyz", "--unit", "mm,um", "--card")
    assert (status, err) == (0, "")
    assert 'unit = "mm"\nheight_unit = "um"' in out
    height = rv.open_scan(tmp_path / "points.toml")
    np.testing.assert_allclose(height, 1e-6 * z, atol=1e-15)
    np.testing.assert_allclose(height.x, (np.arange(17) + 0.5) * 1e-6)
    assert re.search(r"Slope +the rms slope is 0\.\d+ after these steps *\n +-> no action needed", out)
    table = out[out.index("[surface]") : out.index("Picture:")]
    (tmp_path / "study.toml").write_text(table + BALL[BALL.index("[material]") :])
    np.testing.assert_allclose(rv.read_study(tmp_path / "study.toml").settings.surface.raw(), 1e-6 * z, atol=1e-15)
    steep = invoke("scan", "points.xyz", "--unit", "um,mm", "--force")[1]
    assert "check the spacing and the units of x, y and height" in " ".join(steep.split())
    status, _, err = invoke("scan", "points.xyz", "--unit", "mm,parsec per")
    assert status == 2
    assert "--unit is '1 parsec per'" in err


def test_scan__refuses_to_write_over_the_scan_or_in_another_format(invoke, tmp_path, scan_file):
    content = scan_file.read_bytes()
    for arguments, words in (
        (["--to", "tilted.nc"], "already exists"),
        (["--to", "scan.stl"], "expected one of .nc, .x3p, .sdf"),
        (["--plot", "tilted.nc"], "already exists"),
    ):
        status, _, err = invoke("scan", scan_file, *arguments)
        assert status == 2
        assert words in err
    assert scan_file.read_bytes() == content
    assert [p.name for p in tmp_path.iterdir()] == ["tilted.nc"]


@pytest.mark.thorough
def test_plot__draws_a_file_or_a_folder(invoke, tmp_path, coarse_pictures):
    from sample_results import rough_creep

    path = write_result(rough_creep(shape=(24, 20), frames=4), tmp_path / "out" / "case.nc")
    for target in (path, path.parent):
        status, out, err = invoke("plot", target, "--out", "figures")
        assert (status, err) == (0, "")
        assert out == "2 figures: figures\n"
    assert {one.name for one in (tmp_path / "figures").iterdir()} == {"case-history.png", "case-maps.png"}
    status, out, err = invoke("plot", path, "--all", "--out", "all")
    drawn = {one.name for one in (tmp_path / "all").iterdir()}
    assert (status, err, out) == (0, "", f"{len(drawn)} figures: all\n")
    assert {"case-history.png", "case-maps.png", "case-section.png", "case-surface.png"} < drawn
    (tmp_path / "empty").mkdir()
    assert invoke("plot", "empty")[0] == 2
    status, _, err = invoke("plot", "gone.nc")
    assert (status, err) == (2, "roughvisc: gone.nc: does not exist: expected a result of roughvisc (.nc)\n")


def test_help__has_an_example_for_every_command(invoke):
    assert invoke("--version") == (0, f"roughvisc {rv.__version__}\n", "")
    assert "run STUDY" not in invoke("--help")[2]
    for command in main.commands:
        status, out, _ = invoke(command, "--help")
        assert status == 0
        assert f"roughvisc {command} " in out.split("Example:")[1]


def test_process__ends_with_its_status(tmp_path):
    """A real process: exit status, streams, and no heavy import for the help."""
    (tmp_path / "bad.toml").write_text("title = 3")
    command = [sys.executable, "-W", "error", "-m", "roughvisc"]
    bad = subprocess.run([*command, "run", "bad.toml"], cwd=tmp_path, capture_output=True, text=True)
    assert (bad.returncode, bad.stdout) == (2, "")
    assert bad.stderr.startswith("roughvisc: bad.toml: 4 problems\n  title: found 3: expected a text\n")
    code = (
        "import sys; from roughvisc.cli import main; main(sys.argv[1:], standalone_mode=False); "
        "print(sorted({'numpy', 'xarray', 'pydantic', 'pint', 'rich', 'matplotlib'} & set(sys.modules)))"
    )
    for quick in ("--help", "--version"):
        command = [sys.executable, "-c", code, quick]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
        assert done.stdout.endswith("[]\n")
