"""How an audit is told: on the command line, in the plan, in the report."""

import re

import pytest
from support import BALL

from roughvisc.study.execution.run import run_case
from roughvisc.study.statement.case import read_cases
from roughvisc.views.report import page as page_module

AUDITED = BALL + '[audit]\nwork_of_adhesion = "50 mJ/m^2"\nthickness = "0.6 mm"\n'
LOADS = '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two results with what their study states for an audit."""
    folder = tmp_path_factory.mktemp("audited")
    (folder / "study.toml").write_text(AUDITED + LOADS)
    for case in read_cases(folder / "study.toml"):
        run_case(case, folder)
    return folder


def test_audit__of_a_folder_tells_of_every_result(invoke, folder):
    status, out, err = invoke("audit", folder)
    assert (status, err) == (0, "")
    assert out.count("assumption") == 2
    assert out.count("broken") == 2
    assert out.count("bonded sheet of 600 µm") == 2
    assert max(map(len, out.splitlines())) <= 80


def test_audit__options_and_another_study_take_the_place_of_what_was_stated(invoke, folder, tmp_path):
    result = next(folder.glob("*.nc"))
    (tmp_path / "other.toml").write_text(BALL + '[audit]\nthickness = "7 mm"\n')
    for options, words in (
        (["--thickness", "6 mm"], "6 mm"),
        (["--study", tmp_path / "other.toml"], "7 mm"),
        (["--study", tmp_path / "other.toml", "--thickness", "0.008"], "8 mm"),
    ):
        status, out, _ = invoke("audit", result, *options)
        assert status == 0
        assert f"bonded sheet of {words}" in " ".join(out.split())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--density", "3 m"], "--density: found '3 m', which is in meter: expected a number in kg/m^3"),
        (["--work-of-adhesion", "sticky"], "--work-of-adhesion: found 'sticky', which is no quantity"),
        (["--yield-strength", "-3"], "--yield-strength: found -3.0: expected"),
        (["--base", "glue", "--thickness", "1e-3"], "--base is 'glue': expected 'bonded' or 'slipping'"),
        (["--study", "none.toml"], "none.toml: does not exist: expected a study file"),
    ],
)
def test_audit__bad_input_is_status_2_and_one_message(invoke, folder, options, words):
    status, out, err = invoke("audit", next(folder.glob("*.nc")), *options)
    assert (status, out) == (2, "")
    assert err.startswith("roughvisc: ")
    assert words in err
    assert err.count("\n") == 1


def test_audit__of_what_is_no_result_is_status_2(invoke, tmp_path):
    assert invoke("audit", tmp_path)[0] == 2
    assert invoke("audit", tmp_path / "none.nc")[0] == 2


def test_plan__tells_what_is_doubtful(invoke, tmp_path):
    (tmp_path / "study.toml").write_text(AUDITED)
    status, out, _ = invoke("plan", tmp_path / "study.toml")
    assert status == 0
    assert re.search(r"Assumptions +doubtful: thickness \(0\.[1-4]\d*\)\s*\n", out)


def test_report__has_a_row_for_each_assumption_of_each_case(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(page_module, "_DRAWN", 0)  # its figures take long, and are others' concern
    monkeypatch.setattr(page_module, "_swept", lambda folder: [])
    page = page_module.report(folder, tmp_path / "report.html").read_text(encoding="utf-8")
    part = page.split('<h2 id="audit">')[1].split('<h2 id="run">')[0]
    assert part.count('<section class="study"') == 2
    assert part.count('<span class="verdict broken">broken</span>') == 2
    assert part.count('<span class="verdict not-known">not known</span>') >= 2
    assert part.count("The body is deeper than the contact is wide.") == 2
    numbers = [int(case) for case in re.findall(r'class="study" data-case="(\d)"', page)]
    assert numbers == [0, 1, 0, 1]
