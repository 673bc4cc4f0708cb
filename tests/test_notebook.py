"""What a notebook shows of cases."""

import re
from html import unescape

from support import BALL, case_of


def shown(one):
    """Title and rows of texts, of what a notebook shows of an object; no other tags are in it."""
    found = one._repr_html_()
    assert "<" not in re.sub(r"<(/?(table|tr|th|td|b|caption))( style=\"[^\"<>]*\")?>", "", found)
    rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in re.findall(r"<tr>(.*?)</tr>", found)]
    title = re.search(r"<b>(.*?)</b>", found).group(1)
    return unescape(title), [[unescape(text) for text in row] for row in rows]


def test_case__shows_what_it_is(tmp_path):
    case = case_of(tmp_path, BALL, program__0__load="6 mN", solve__tolerance=0.01)
    title, rows = shown(case)
    found = {row[0]: row[1] for row in rows}
    assert title == "A ball"
    assert (found["key"], found["study"]) == (case.key, "study.toml")
    assert (found["program.0.load"], found["solve.tolerance"]) == ("6 mN", "0.01")
