"""The page about results: what it says, that it holds everything itself, and that its pickers work in a browser."""

import base64
import html
import io
import json
import math
import re
import shutil
import subprocess
import tomllib

import numpy as np
import pytest
import sample_results as made
from click.testing import CliRunner
from PIL import Image

from roughvisc.cli import main
from roughvisc.errors import InputError
from roughvisc.study.execution.run import run_case
from roughvisc.study.statement.case import read_cases
from roughvisc.study.storage.store import write_result
from roughvisc.views.report.case_table import table_row
from roughvisc.views.report.frames import frames_of
from roughvisc.views.report.page import _MAPS, report
from roughvisc.views.sweep_figures.case_text import study_text

SWEEP = """
title = "Bumps & <b>dents</b>"
[surface]
generate = "wavy"
amplitude = "1 um"
wavelength = "50 um"
size = "0.1 mm"
shape = [21, 18]
rotate90 = 1
[material]
model = "zener"
shear_modulus = "3 MPa"
kelvin_modulus = "1 MPa"
kelvin_viscosity = "0.1 MPa s"
[[program]]
load = "1 mN"
over = "50 ms"
[[program]]
hold = "0.2 s"
[solve]
boundary = "periodic"
tolerance = 1e-2
[keep]
times = 4
[sweep]
"program.0.load" = ["2 mN", "10 mN", "1 mN"]
"""
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (
    "headless no-sandbox disable-gpu disable-quic no-first-run disable-background-networking disable-component-update "
    "disable-sync disable-dev-shm-usage enable-logging=stderr v=0 virtual-time-budget=60000 dump-dom"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of a small sweep, and the record of a case that failed."""
    folder = tmp_path_factory.mktemp("results")
    study = folder / "bumps.toml"
    study.write_text(SWEEP)
    for case in read_cases(study):
        run_case(case, folder)
    record = {"message": "contact reached the border", "case": {"title": "Too far", "varied": {"program.0.load": 9.0}}}
    (folder / "0123456789abcdef.failed.json").write_text(json.dumps(record))
    return folder


@pytest.fixture(scope="module")
def page(folder):
    return report(folder, folder / "page" / "report.html")


def rows(text):
    return re.findall(r'<tr data-view="(\d+)".*?</tr>', text)


def views(text):
    return json.loads(re.search(r"^const views = (.*);$", text, re.M)[1])


def test_page__says_what_was_run_and_how_accurate_it_is(page):
    text = page.read_text()
    assert rows(text) == ["0", "1", "2"]
    loads = re.findall(r"<tr data-view.*?<td>\d</td><td>(.*?)</td>", text)
    assert loads == ["1 mN", "2 mN", "10 mN"], "cases in the order of what was varied"
    for words in (
        "zener, shear modulus 3 MPa",
        "hold 200 ms",
        "Stated error",
        "Time steps",
        "Contact solver",
        "converged",
        "surface sha256",
    ):
        assert words in text
    assert "contact reached the border" in text
    assert "Too far: Load 9 N" in text
    assert '<th title="program.0.load">Load</th>' in text
    assert [view["title"] for view in views(text)] == ["Load 1 mN", "Load 2 mN", "Load 10 mN"], "what tells them apart"


def errors_drawn(chart):
    """What the first line of the chart of errors shows, told by its logarithmic ticks, and the tolerance so."""
    (high, first), (low, last) = chart["yticks"][0], chart["yticks"][-1]
    decades = math.log10(float(last) / float(first)) / (low - high)

    def read(pixel):
        return float(first) * 10 ** (decades * (float(pixel) - high))

    points = re.findall(r"M[-\d.e+]+ ([-\d.e+]+)h0", chart["lines"][0]["dots"])
    return np.array([read(pixel) for pixel in points]), read(chart["tolerance"])


@pytest.mark.parametrize("within", [True, False])
def test_charts__draw_the_errors_that_the_table_holds_against_the_tolerance(within):
    """Steps between the kept times are beyond the tolerance; kept times only where the table says so."""
    ds = made.hertz_creep((11, 9), frames=5)
    ds["stated_error"][:] = [0.0, 1e-4, 2e-3, 5e-4, 3e-3]
    tolerance = 4e-3 if within else 1e-3
    ds.attrs["tolerance"] = tolerance
    steps = np.linspace(0, float(ds.time[-1]), 17)
    ds["step_time"], ds["step_time_error"] = ("step", steps), ("step", np.full(17, 0.3))
    for name in ("force", "approach", "contact_area"):
        ds[f"step_{name}"] = "step", np.interp(steps, ds.time, ds[name])
    (chart,) = [one for one in frames_of(ds, 10**5)["charts"] if one["label"] == "Relative error"]
    assert chart["time"].startswith("Kept time")
    assert chart["lines"][0]["label"] == "stated"
    drawn, line = errors_drawn(chart)
    assert line == pytest.approx(tolerance, rel=0.02)
    np.testing.assert_allclose(drawn, [1e-4, 2e-3, 5e-4, 3e-3], rtol=0.02)
    row = table_row(ds, None, 0)
    assert float(row["stated_error"]) == pytest.approx(drawn.max(), rel=0.02)
    assert row["missed"] == (drawn.max() > line) == (not within)


def test_page__shows_the_surface_before_and_after_conditioning(page):
    text = page.read_text()
    assert "rotated" in text
    assert "<th>before</th>" in text
    assert 'alt="surface"' in text


def test_page__fetches_nothing_and_runs_no_text_of_the_user(page):
    text = page.read_text()
    assert "default-src 'none'" in text
    assert not re.findall(r'(?:src|href)="(?!data:|#)', text)
    assert "<b>dents" not in text
    assert "Bumps &amp; &lt;b&gt;dents" in text


def test_page__holds_the_study_that_gives_the_result_again(page, folder, tmp_path):
    found = [html.unescape(one) for one in re.findall(r"<pre>(title = .*?)</pre>", page.read_text(), re.S)]
    assert len(found) == 3
    study = tmp_path / "again.toml"
    for text in found:
        study.write_text(text)
        (case,) = read_cases(study)
        assert (folder / f"{case.key}.nc").exists()


def test_pictures__are_those_of_the_fields(page):
    for view in views(page.read_text()):
        assert [field["name"] for field in view["fields"]] == ["pressure", "gap"]
        assert len(view["frames"]) == 4
        assert [len(chart["marks"]) for chart in view["charts"]] == [4] * 4
        assert view["section"]["contacts"][0] == "", "no contact before the load"
        assert view["section"]["contacts"][-1].startswith("M")


@pytest.mark.parametrize("make", [made.one_frame, made.open_contact, made.rough_creep, made.hertz_cycle])
def test_frames__of_any_result(make):
    view = frames_of(make(), 200_000)
    assert 0 <= view["start"] < len(view["frames"])
    assert sum(len(uri) for frame in view["frames"] for uri in frame["maps"]) <= 200_000
    json.dumps(view, allow_nan=False)


def test_frames__fewer_and_coarser_for_a_smaller_budget():
    rich, poor = (frames_of(made.hertz_creep((300, 200)), budget) for budget in (10**7, 30_000))
    assert len(rich["frames"]) > len(poor["frames"])
    assert (rich["block"], poor["block"]) > (0, 1)
    assert poor["block"] > rich["block"]


def test_map__has_x_to_the_right_and_y_upwards():
    dataset = made.hertz_creep((30, 20), 4)
    dataset["pressure"][:] = 0.0
    dataset["pressure"][:, 27, 3] = 1e6
    uri = frames_of(dataset, 10**6)["frames"][-1]["maps"][0]
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2]))))
    assert picture.shape == (20, 30)
    assert np.argwhere(picture != 1).tolist() == [[20 - 1 - 3, 27]]


@pytest.mark.parametrize("count", [pytest.param(10, marks=pytest.mark.long), pytest.param(50, marks=pytest.mark.long)])
def test_fifty_cases__stay_below_ten_megabytes(tmp_path, monkeypatch, count):
    """Ten of them, with a fifth of what all maps may have, below a fifth of the size."""
    monkeypatch.setattr("roughvisc.views.report.page._MAPS", _MAPS * count // 50)
    for seed in range(count):
        dataset = made.rough_creep((160, 150), 12, seed=seed)
        dataset.attrs |= {"case": json.dumps({"title": "Many", "varied": {"surface.seed": seed}})}
        write_result(dataset, tmp_path / f"{seed:016x}.nc")
    out = report(tmp_path)
    text = out.read_text()
    assert out.name == "report.html"
    assert out.stat().st_size < 10e6 * count / 50
    assert len(rows(text)) == count
    assert min(len(view["frames"]) for view in views(text)) >= 3


@pytest.mark.thorough
def test_table__of_many_parameters_has_them_in_one_column(tmp_path):
    loads = ["1 mN", "2 mN"]
    for number, load in enumerate(loads):
        varied = {"program.0.load": 1e-3 * (1 + number), **{f"material.terms.{i}.time": float(i) for i in range(4)}}
        dataset = made.one_frame()
        dataset.attrs |= {"case": json.dumps({"title": "A", "varied": varied, "written": {"program.0.load": load}})}
        write_result(dataset, tmp_path / f"{number:016x}.nc")
    text = report(tmp_path).read_text()
    cells = re.findall(r'<td class="varied">(.*?)</td>', text)
    assert [cell[:10] for cell in cells] == [f"Load {load}," for load in loads]
    assert cells[0].endswith("time (material.terms.3) 3")
    assert "<th>Varied settings</th>" in text
    assert 'title="program.0.load"' not in text


@pytest.mark.thorough
def test_datasets__without_a_study_say_so(tmp_path):
    out = report(made.rough_creep(), tmp_path / "one.html")
    assert "do not record the whole study" in out.read_text()
    with pytest.raises(InputError, match="expected the name of the page"):
        report([made.one_frame()])


def test_command__writes_the_page_and_refuses_an_empty_folder(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = next(folder.glob("*.nc"))
    done = CliRunner().invoke(main, ["report", str(file), "-o", "mine.html"])
    assert (done.exit_code, done.output) == (0, "Report: mine.html\n")
    (tmp_path / "empty").mkdir()
    done = CliRunner().invoke(main, ["report", "empty"])
    assert done.exit_code == 2
    assert "holds no results" in done.output


def test_study_text__is_the_case():
    case = {
        "title": 'A "quoted" \u00b5',
        "surface": {"file": "a\\b.sur", "level": 1, "crop": {"x": [0.0, 1e-3]}},
        "program": [{"load": 1e-300, "over": 0}, {"table": {"times": [0.0, 1.0], "values": [0.0, 2.0]}}],
        "keep": {"times": "all", "fields": []},
    }
    assert tomllib.loads(study_text(case | {"origin": "here", "varied": {}})) == case


@pytest.mark.thorough
@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
@pytest.mark.parametrize("asked", ["#check", "#case=2&time=3"])
def test_browser__picks_every_case_and_time_without_complaint(page, tmp_path, asked):
    command = [
        CHROMIUM,
        *(f"--{flag}" for flag in FLAGS.split()),
        f"--user-data-dir={tmp_path}",
        f"file://{page}{asked}",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    body = re.search(r"<body[^>]*>", done.stdout)[0]
    assert "data-errors" not in body
    assert "CONSOLE" not in done.stderr
    assert ('data-checked="12"' if asked == "#check" else 'data-shown="1,2"') in body


@pytest.mark.thorough
@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
def test_browser__would_tell_of_an_error(page, tmp_path):
    broken = tmp_path / "broken.html"
    broken.write_text(page.read_text().replace('asked.has("check")', "nothing.has(1)"))
    command = [
        CHROMIUM,
        *(f"--{flag}" for flag in FLAGS.split()),
        f"--user-data-dir={tmp_path / 'd'}",
        f"file://{broken}",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert "nothing is not defined" in done.stderr


@pytest.mark.thorough
@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
@pytest.mark.parametrize("width", [400, 1100, 1600])
def test_browser__shows_the_page_without_horizontal_overflow(page, tmp_path, width):
    """In a frame, since a window of a browser without a screen is at least 500 pixels wide."""
    script = (
        "onload = () => { const root = frames[0].document.documentElement; "
        "document.body.dataset.widths = `${root.clientWidth},${root.scrollWidth}`; }"
    )
    frame = f'<iframe style="border: 0; width: {width}px; height: 900px" src="file://{page}"></iframe>'
    outer = tmp_path / "outer.html"
    outer.write_text(f"<body>{frame}<script>{script}</script></body>")
    flags = [f"--{flag}" for flag in FLAGS.split()]
    command = [
        CHROMIUM,
        *flags,
        "--allow-file-access-from-files",
        f"--user-data-dir={tmp_path / 'd'}",
        f"file://{outer}",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    seen, needed = map(int, re.search(r'data-widths="(\d+),(\d+)"', done.stdout).groups())
    assert width - 30 < seen <= width  # a scroll bar has its place
    assert needed <= seen


def test_frames__of_a_mirrored_surface_show_what_was_measured():
    mirrored = made.of_mirror_images()
    whole = mirrored.assign_attrs(history="read a.x3p")
    sizes = []
    for ds in (whole, mirrored):
        view = frames_of(ds, 10**6)
        with Image.open(io.BytesIO(base64.b64decode(view["frames"][0]["maps"][0].partition(",")[2]))) as picture:
            sizes.append(picture.size)
    assert sizes == [(22, 16), (11, 8)]
    assert view["plane"].endswith("as measured, without the mirror images")
