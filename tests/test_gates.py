"""What a contributor touches: a new setting three files, a variable and a material two, a conditioning step one.

The test adds one of each to a copy of the package, and uses it as a user would. The variable is that of the guide.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "roughvisc"
#: What is added -> file -> existing lines, and what is inserted after each.
ADDED = {
    "setting": {
        "settings.py": {'    grid_error: bool | Literal["auto"] = "auto"\n': "    suction: float = 0.0\n"},
        "api.py": {
            "    edge: Edge = Settings.edge,\n": "    suction: float = 0.0,\n",
            '        "edge": edge,\n': '        "suction": suction,\n',
        },
        "study/case.py": {
            "        edge: Edge = Settings.edge,\n": "        suction: float = 0.0,\n",
            "            edge=edge,\n": "            suction=suction,\n",
        },
    },
    "conditioning step": {
        "topography/conditioning.py": {
            "STEPS: dict[str, ConditioningStep] = {\n": (
                '    "raised": ConditioningStep(lambda h, by: h.copy(data=h.values + by), "by"),\n'
            )
        }
    },
    "material": {
        "mechanics/materials/__init__.py": {
            "    pair,\n)\n": "_OTHERS = (*_OTHERS, gel)\n",
            "import creep_table, dynamic_table, relaxation_table\n": """from roughvisc.units import Quantity, quantities


@quantities(modulus="Pa", drainage="s")
def gel(modulus: Quantity, drainage: Quantity) -> Prony:
    \"\"\"Gel that is twice as compliant after its drainage.\"\"\"
    return Prony(glassy=1 / modulus, compliances=(1 / modulus,), times=(drainage,))
""",
        },
        "materials.py": {
            "from roughvisc.mechanics.layer import layer\n": "from roughvisc.mechanics.materials import gel\n",
            '    "from_relaxation",\n': '    "gel",\n',
        },
    },
}
STUDY = """
[surface]
generate = "sphere"
radius = "1 mm"
size = "0.2 mm"
shape = 9
raised = 1e-6
[material]
model = "gel"
modulus = "1 MPa"
drainage = "0.1 s"
[[program]]
load = "0.1 mN"
over = 0
[solve]
boundary = "free"
tolerance = 0.01
suction = 3.0
"""
USE = """
import numpy as np, roughvisc as rv
case = rv.read_study("study.toml")
assert case.settings.suction == 3.0
assert rv.vary(case, {"solve.suction": 4.0}).key != case.key
assert case.material == rv.gel("1 MPa", "0.1 s") == rv.materials.gel(1e6, 0.1)
assert rv.Case(case.height(), case.material, case.program, boundary="free", suction=3.0).settings.suction == 3.0
assert case.material == rv.Prony(glassy=1e-6, compliances=(1e-6,), times=(0.1,))
again = rv.Case.from_json(case.to_json())
assert (again.material, again.settings) == (case.material, case.settings)
np.testing.assert_allclose(case.height() - rv.vary(case, {"surface.raised": None}).height(), 1e-6, atol=1e-18)
ds = rv.simulate(case.height(), case.body, case.program, suction=3.0, boundary="free", progress=False)
stored = rv.run(case, out="out", progress=False)
assert stored.largest_pressure.units == "Pa" and stored.largest_pressure.dims == ("time",)
assert "largest_pressure [Pa]" in rv.to_table("out")
for key, wrong in {"solve.sucktion": 1.0, "material.modulus": "3 kg"}.items():
    try:
        rv.vary(case, {key: wrong})
    except rv.InputError as error:
        assert error.key == key, error
    else:
        raise AssertionError(key)
"""


def guide(part):
    """Return the change of a part of the guide: file -> existing line, and what is inserted after it."""
    text = (PACKAGE.parent / "docs" / "development.md").read_text(encoding="utf-8")
    block = text.split(f"### {part}\n")[1].split("```diff\n")[1].split("```")[0]
    changes = {}
    for line in block.splitlines(keepends=True):
        if line.startswith(" # ") and line.strip().endswith(".py"):
            lines = changes.setdefault(line.removeprefix(" # ").strip(), {})
            before = ""
        elif line.startswith("+"):
            lines[before] = lines.get(before, "") + line[1:]
        else:
            before = line[1:]
    return changes


@pytest.mark.thorough
def test_setting_variable_step_and_material__are_added_in_few_files(tmp_path):
    changes = guide("A variable")
    ((_, test),) = changes.pop("tests/experiment/test_rows.py").items()
    variable = {file.removeprefix("roughvisc/"): lines for file, lines in changes.items()}
    added = ADDED | {"variable": variable}
    assert {what: len(edits) for what, edits in added.items()} == {
        "setting": 3,
        "conditioning step": 1,
        "material": 2,
        "variable": 2,
    }
    shutil.copytree(PACKAGE, tmp_path / "roughvisc", ignore=shutil.ignore_patterns("__pycache__"))
    for file, changes in (edit for edits in added.values() for edit in edits.items()):
        path = tmp_path / "roughvisc" / file
        text = path.read_text(encoding="utf-8")
        for line, more in changes.items():
            assert text.count(line) == 1, f"{file} has {line!r} {text.count(line)} times"
            text = text.replace(line, line + more)
        path.write_text(text, encoding="utf-8")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    code = "\n".join([USE, "import pytest", test, *re.findall(r"def (test_\w+)\(", test)]) + "()\n"
    command = [sys.executable, "-W", "error", "-c", code]
    done = subprocess.run(command, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
