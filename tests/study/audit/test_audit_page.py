"""The page on the audit: its table is that of the program, and what it says of the quick start is what comes out."""

import re
from pathlib import Path

import pytest

import roughvisc as rv
from roughvisc.study.audit.limits import LIMITS, STATED
from roughvisc.study.execution.run import run_case
from roughvisc.study.statement.case import read_study
from roughvisc.study.storage.store import open_result

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "howto" / "audit.md").read_text(encoding="utf-8")


def test_tables__are_those_of_the_program():
    shown = PAGE.split("limits.py: begin -->\n")[1].split("<!-- TABLE")[0].splitlines()
    rows = [line for line in shown if line.startswith("| `")]
    assert rows == [
        *(
            f"| `{name}`: {one.assumption} | {one.number} | {one.doubtful:g} | {one.broken:g} |"
            for name, one in LIMITS.items()
        ),
        *(f"| `{name}` | {one.meaning} | {one.source} |" for name, one in LIMITS.items()),
    ]


@pytest.mark.long
def test_quick_start__is_judged_as_the_page_says(tmp_path):
    defended = re.findall(r"^\| (\w+) \| ([\d.]+) \| (\w+) \|$", PAGE, re.M)
    assert [name for name, *_ in defended] == [name for name in LIMITS if name not in ("heating", STATED)]
    with open_result(run_case(read_study(ROOT / "workflows" / "quickstart.toml"), tmp_path)) as ds:
        found = rv.audit(
            ds,
            work_of_adhesion="50 mJ/m^2",
            yield_strength="10 MPa",
            thickness="5 mm",
            density="1100 kg/m^3",
            linear_strain=0.05,
        )
        for name, number, verdict in defended:
            assert found[name].verdict == verdict
            assert found[name].number == pytest.approx(float(number), rel=0.05, abs=1e-9)
