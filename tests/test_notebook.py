"""What a notebook shows of programs, cases and plans."""

import re
from html import unescape

import xarray as xr
from support import BALL, case_of

import roughvisc as rv


def shown(one):
    """Title and rows of texts, of what a notebook shows of an object; no other tags are in it."""
    found = one._repr_html_()
    assert "<" not in re.sub(r"<(/?(table|tr|th|td|b|caption))( style=\"[^\"<>]*\")?>", "", found)
    rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in re.findall(r"<tr>(.*?)</tr>", found)]
    title = re.search(r"<b>(.*?)</b>", found).group(1)
    return unescape(title), [[unescape(text) for text in row] for row in rows]


def test_program__shows_its_segments():
    assert len(shown(rv.Program().load(2.0, over=0).hold("5 s").load(0.0, over="50 ms"))[1]) == 3
    assert len(shown(rv.Program.table([*range(21)], [*range(21)]))[1]) < 10


def test_case__shows_what_it_is(tmp_path):
    case = case_of(tmp_path, BALL, program__0__load="6 mN", solve__tolerance=0.01)
    title, rows = shown(case)
    found = {row[0]: row[1] for row in rows}
    assert title == "A ball"
    assert (found["key"], found["study"]) == (case.key, "study.toml")
    assert (found["program.0.load"], found["solve.tolerance"]) == ("6 mN", "0.01")


def test_plan__shows_a_row_for_each_case(tmp_path):
    (tmp_path / "s.toml").write_text(BALL + '[sweep]\n"program.0.load" = [1e-3, 2e-3]\n')
    costs = rv.plan(tmp_path / "s.toml", workers=3)
    rows = shown(costs)[1]
    assert len(rows) == 3
    assert rows[2][1:4] == ["2 mN", "24 x 21", str(int(costs.steps[1]))]
    assert isinstance(costs, xr.Dataset)
