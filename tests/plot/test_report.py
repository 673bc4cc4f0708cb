"""The page about results: what it states, that it holds everything itself, and that it repeats the study."""

import html
import json
import re
import tomllib

import pytest
import sample_results as made
from click.testing import CliRunner
from support import BALL, refused

from roughvisc.cli import main
from roughvisc.plot.report import report
from roughvisc.runs.csv_files import to_table
from roughvisc.runs.folder import write_json
from roughvisc.runs.run import run_case
from roughvisc.runs.sweep_data import SWEEP as LISTED
from roughvisc.runs.sweep_data import sweep_cases
from roughvisc.study.case import read_cases
from roughvisc.study.case_text import study_text

HOSTILE = 'Bumps & <b>dents</b> "quoted" <script>alert(1)</script>'
SWEEP = BALL.replace('"A ball"', f"'{HOSTILE}'") + '[sweep]\n"program.0.load" = ["2 mN", "10 mN", "1 mN"]\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of a small sweep, and the record of a case that failed."""
    folder = tmp_path_factory.mktemp("results")
    study = folder / "bumps.toml"
    study.write_text(SWEEP)
    cases = read_cases(study)
    for case in cases:
        run_case(case, folder)
    write_json(folder / LISTED, sweep_cases(cases))
    failed = {"title": "<i>Too far</i>", "varied": {"program.0.load": 9.0}}
    record = {"message": "contact reached the <u>border</u>", "case": failed}
    (folder / "0123456789abcdef.failed.json").write_text(json.dumps(record))
    return folder


@pytest.fixture(scope="module")
def page(folder):
    return report(folder, folder / "page" / "report.html").read_text()


@pytest.mark.thorough
def test_page__numbers_the_cases_as_their_table(folder, page):
    table = re.search(r'<table id="table">.*?</table>', page, re.S)[0]
    loads = to_table(folder)["program.0.load [N]"]
    assert loads.index.tolist() == [0, 1, 2]
    shown = re.findall(r'<tr><td>(\d)</td><td class="name">Load (.*?) mN</td>', table)
    assert [(int(number), float(load)) for number, load in shown] == [
        (n, pytest.approx(1e3 * x)) for n, x in loads.items()
    ]
    assert "3 cases, 1 failed" in page
    assert "<td>&lt;i&gt;Too far&lt;/i&gt; Load 9 N</td><td>contact reached the &lt;u&gt;border&lt;/u&gt;</td>" in page


@pytest.mark.thorough
def test_page__has_one_audit_for_cases_with_the_same_verdicts_and_links_the_page_to_explore(folder, tmp_path):
    (tmp_path / "page.html").write_text("to explore")
    text = report(folder, tmp_path / "report.html").read_text()
    audit = text[text.index('id="audit"') : text.index('id="run"')]
    assert re.findall("<h3>(.*?)</h3>", audit) == ["Cases 0, 1, 2"]
    assert audit.count("<table") == 1
    assert '<a href="page.html">' in text
    assert "prefers-color-scheme: dark" in text


@pytest.mark.thorough
def test_page__escapes_what_users_write_and_needs_no_other_file(page):
    assert "default-src 'none'" in page
    assert not re.findall(r'(?:src|href)="(?!data:|#)', page)
    assert not re.findall(r"<(b|i|u|script)\b", page)
    assert html.escape(HOSTILE, quote=False) in page.replace("&#34;", '"')


@pytest.mark.thorough
def test_page__shows_each_surface_once(tmp_path):
    study = tmp_path / "radii.toml"
    study.write_text(BALL + '[sweep]\n"surface.radius" = ["1 mm", "2 mm"]\n"program.0.load" = ["1 mN", "2 mN"]\n')
    for case in read_cases(study):
        run_case(case, tmp_path / "found")
    text = report(tmp_path / "found").read_text()
    shown = re.findall(r"<h3>(.*?)</h3>", text[text.index('id="surface"') : text.index('id="audit"')])
    assert sorted(re.findall(r"Radius . mm", " ".join(shown))) == ["Radius 1 mm", "Radius 2 mm"]
    assert len(shown) == 2


@pytest.mark.parametrize("within", [True, False])
def test_page__of_a_result_without_a_study(within, tmp_path):
    ds = made.one_frame().drop_vars(["height", "gap", "displacement"])
    ds["stated_error"][:] = 3e-3
    ds.attrs |= {"tolerance": 4e-3 if within else 1e-3, "memory": "<b>a.sur</b>", "history": "<i>read</i>"}
    text = report(ds, tmp_path / "one.html").read_text()
    assert not re.findall(r"<(b|i|u)\b", text)
    assert "&lt;b&gt;a.sur" in text
    assert ("<td>0.003, above the tolerance of 0.001</td>" in text) == (not within)
    assert ("<td>0.003</td>" in text) == within
    assert "do not record the whole study" in text
    assert "<td>not estimated (grid_error = true in [solve])</td>" in text
    with refused("path", None):
        report(ds)


@pytest.mark.thorough
def test_page__holds_the_study_that_gives_the_result_again(page, folder, tmp_path):
    found = [html.unescape(one) for one in re.findall(r"<pre>(title = .*?)</pre>", page, re.S)]
    assert len(found) == 3
    study = tmp_path / "again.toml"
    for text in found:
        study.write_text(text)
        (case,) = read_cases(study)
        assert (folder / f"{case.key}.nc").exists()


@pytest.mark.thorough
def test_command__writes_the_page_and_refuses_an_empty_folder(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = next(folder.glob("*.nc"))
    done = CliRunner().invoke(main, ["report", str(file), "-o", "mine.html"])
    assert (done.exit_code, done.output.endswith("Report: mine.html\n")) == (0, True)
    (tmp_path / "empty").mkdir()
    assert CliRunner().invoke(main, ["report", "empty"]).exit_code == 2


def test_study_text__is_the_case():
    case = {
        "title": 'A "quoted" \u00b5',
        "surface": {"file": "a\\b.sur", "level": 1, "crop": {"x": [0.0, 1e-3]}},
        "program": [{"load": 1e-300, "over": 0}, {"table": {"times": [0.0, 1.0], "values": [0.0, 2.0]}}],
        "keep": {"times": "all", "fields": []},
    }
    assert tomllib.loads(study_text(case | {"origin": "here", "varied": {}})) == case
