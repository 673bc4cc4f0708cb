"""What a contributor touches: a new setting and a new variable two files, a material and a conditioning step one.

The test adds one of each to a copy of the package, and uses it as a user would.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "roughvisc"
#: What is added -> file -> existing lines, and what is inserted after each.
ADDED = {
    "setting": {
        "settings.py": {'    grid_error: bool | Literal["auto"] = "auto"\n': "    suction: float = 0.0\n"},
        "api.py": {
            "    edge: Edge = Settings.edge,\n": "    suction: float = 0.0,\n",
            '        "edge": edge,\n': '        "suction": suction,\n',
        },
    },
    "variable": {
        "variables.py": {
            "VARIABLES: dict[str, Variable] = {\n": '    "stiffness": Variable(_SERIES, "N m-1", "secant stiffness"),\n'
        },
        "experiment/loading.py": {
            '            "approach": point.approach,\n': '            "stiffness": point.force / point.approach,\n'
        },
    },
    "conditioning step": {
        "topography/conditioning.py": {
            "STEPS: dict[str, Step] = {\n": '    "raised": Step(lambda h, by: h.copy(data=h.values + by), "by"),\n'
        }
    },
    "material": {
        "mechanics/materials/__init__.py": {
            "dynamic_table, pair)\n": "_OTHERS = (*_OTHERS, gel)\n",
            "import creep_table, dynamic_table, relaxation_table\n": """from roughvisc.units import Quantity, quantities


@quantities(modulus="Pa", drainage="s")
def gel(modulus: Quantity, drainage: Quantity) -> Prony:
    \"\"\"Gel that is twice as compliant after its drainage.\"\"\"
    return Prony(glassy=1 / modulus, compliances=(1 / modulus,), times=(drainage,))
""",
        }
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
assert case.material == rv.Prony(glassy=1e-6, compliances=(1e-6,), times=(0.1,))
again = rv.Case.from_json(case.to_json())
assert (again.material, again.settings) == (case.material, case.settings)
np.testing.assert_allclose(case.height() - rv.vary(case, {"surface.raised": None}).height(), 1e-6, atol=1e-18)
ds = rv.simulate(case.height(), case.body, case.program, suction=3.0, boundary="free", progress=False)
np.testing.assert_allclose(ds.stiffness, ds.force / ds.approach, rtol=1e-14)
stored = rv.run(case, out="out", progress=False)
assert stored.stiffness.units == "N m-1" and stored.stiffness.dims == ("time",)
for key, wrong in {"solve.sucktion": 1.0, "material.modulus": "3 kg"}.items():
    try:
        rv.vary(case, {key: wrong})
    except rv.InputError as error:
        assert error.key == key, error
    else:
        raise AssertionError(key)
"""


def test_setting_variable_step_and_material__are_added_in_two_files_or_one(tmp_path):
    assert {what: len(edits) for what, edits in ADDED.items()} == {
        "setting": 2,
        "variable": 2,
        "conditioning step": 1,
        "material": 1,
    }
    shutil.copytree(PACKAGE, tmp_path / "roughvisc", ignore=shutil.ignore_patterns("__pycache__"))
    for file, changes in (one for edits in ADDED.values() for one in edits.items()):
        path = tmp_path / "roughvisc" / file
        text = path.read_text(encoding="utf-8")
        for line, more in changes.items():
            assert text.count(line) == 1, f"{file} has {line!r} {text.count(line)} times"
            text = text.replace(line, line + more)
        path.write_text(text, encoding="utf-8")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    command = [sys.executable, "-W", "error", "-c", USE]
    done = subprocess.run(command, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
