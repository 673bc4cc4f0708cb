"""What a notebook shows of materials, programs, cases and plans."""

import re
from html import unescape

import pytest
import xarray as xr
from support import BALL, case_of

import roughvisc as rv
from roughvisc.study.statement.case import read_study


def shown(one):
    """Title and rows of texts, of what a notebook shows of an object; no other tags are in it."""
    found = one._repr_html_()
    assert "<" not in re.sub(r"<(/?(table|tr|th|td|b|caption))( style=\"[^\"<>]*\")?>", "", found)
    rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in re.findall(r"<tr>(.*?)</tr>", found)]
    title = re.search(r"<b>(.*?)</b>", found).group(1)
    return unescape(title), [[unescape(text) for text in row] for row in rows]


def test_material__shows_its_parameters():
    assert shown(rv.zener(3e6, 1e6, 1e5, poisson=0.3)) == (
        "zener",
        [
            ["shear_modulus", "3 MPa"],
            ["kelvin_modulus", "1 MPa"],
            ["kelvin_viscosity", "100 kPa s"],
            ["poisson", "0.3"],
        ],
    )


MATERIALS = {
    "power law": rv.PowerLaw(1e-7, 1e-7, 0.3),
    "table": rv.Tabulated((0.1, 1.0), (1e-7, 2e-7), remark="<script>alert(1)</script> & co"),
}


@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
def test_material__shows_what_its_repr_says(material):
    title, rows = shown(material)
    assert repr(material) == f"{title}({', '.join(f'{key}={text}' for key, text in rows)})"


def test_pair__shows_both_bodies():
    table, soft = MATERIALS["table"], rv.elastic(1e6)
    assert shown(rv.pair(table, soft)) == ("pair", [["a", repr(table)], ["b", repr(soft)]])


def test_program__shows_its_segments():
    program = rv.Program().load(2.0, over=0).hold("5 s").load(0.0, over="50 ms")
    assert shown(program)[0] == "Program"
    assert shown(program)[1] == [
        ["0", "load to 2 N at once", ""],
        ["1", "hold 5 s", "until 5 s"],
        ["2", "load to 0 N over 50 ms", "until 5.05 s"],
    ]
    assert shown(rv.Program()) == ("Program: nothing", [])
    long = shown(rv.Program.table([*range(21)], [*range(21)]))[1]
    assert [row[0] for row in long] == [*"01234567", "..."]
    assert long[-1] == ["...", "12 more segments", "until 20 s"]


def test_case__shows_what_it_is(tmp_path):
    case = case_of(tmp_path, BALL, program__0__load="6 mN", solve__tolerance=0.01)
    title, rows = shown(case)
    said = {row[0]: row[1] for row in rows}
    assert title == "A ball"
    assert said["key"] == case.key
    assert said["study"] == "study.toml"
    assert (said["program.0.load"], said["solve.tolerance"]) == ("6 mN", "0.01")
    assert said["surface"] == "sphere"
    assert said["material"] == "zener(shear_modulus=3 MPa, kelvin_modulus=1 MPa, kelvin_viscosity=100 kPa s)"
    assert said["program"] == "load to 6 mN at once, hold 200 ms"
    assert said["boundary"] == "free"


def test_case__of_a_scan_that_is_gone_says_so(tmp_path):
    scan = tmp_path / "a<b>c.x3p"
    rv.save_scan(rv.sphere(1e-3, 2e-4, (12, 9)), scan)
    recipe = 'generate = "sphere"\nradius = "10 mm"\nsize = "1 mm"\nshape = [24, 21]'
    (tmp_path / "study.toml").write_text(BALL.replace(recipe, 'file = "a<b>c.x3p"'))
    case = read_study(tmp_path / "study.toml")
    scan.unlink()
    said = {row[0]: row[1] for row in shown(case)[1]}
    assert said["surface"] == "a<b>c.x3p"
    assert "a<b>c.x3p" in said["key"], "why there is none"


def test_plan__shows_what_each_case_will_take(tmp_path):
    (tmp_path / "s.toml").write_text(
        BALL + f'[sweep]\n"program.0.load" = {[round(1e-3 * n, 3) for n in range(1, 11)]}\n'
    )
    costs = rv.plan(tmp_path / "s.toml", workers=3)
    title, rows = shown(costs)
    assert re.fullmatch(r"A ball: 10 cases, 3 side by side, wall time .*s, memory .* MB, disk .* [kM]B", title)
    assert rows[0] == ["", "program.0.load", "cells", "steps", "convolutions", "wall time", "memory", "disk", ""]
    assert [row[0] for row in rows[1:]] == [*"12345678", "..."]
    assert (rows[2][1:4], rows[-1]) == (["2 mN", "24 x 21", str(int(costs.steps[1]))], ["...", "2 more"])
    assert isinstance(costs, xr.Dataset)
    for part in (costs.isel(case=0), costs[["steps"]]):
        assert "xr-wrap" in part._repr_html_(), "as xarray shows it"
