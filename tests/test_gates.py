"""What a contributor touches: a new setting and a new variable two files, a material and a conditioning step one.

Each test adds one of them to a copy of the package, and uses it as a user would.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "roughvisc"
STUDY = """
[surface]
generate = "sphere"
radius = "1 mm"
size = "0.2 mm"
shape = 9
{surface}
[material]
{material}
[[program]]
load = "0.1 mN"
over = 0
[[program]]
hold = "0.1 s"
[keep]
times = 2
[solve]
tolerance = 0.01
{solve}
"""
USE = """
from pathlib import Path
import numpy as np, xarray as xr, roughvisc as rv
ball = rv.sphere(radius=1e-3, size=2e-4, shape=9)
rubber = rv.zener(shear_modulus=3e6, kelvin_modulus=1e6, kelvin_viscosity=1e5)
press = rv.Program().load(1e-4, over=0).hold(0.1)
case = rv.read_study("study.toml")
"""


@pytest.fixture
def added(tmp_path):
    """Add lines to a copy of the package, and run a script with it; a study lies beside it."""

    def run(edits, script, *, surface="", material='model = "elastic"\nshear_modulus = "1 MPa"', solve=""):
        shutil.copytree(PACKAGE, tmp_path / "roughvisc", ignore=shutil.ignore_patterns("__pycache__"))
        for file, changes in edits.items():
            path = tmp_path / "roughvisc" / file
            text = path.read_text(encoding="utf-8")
            for line, more in changes.items():
                assert text.count(line) == 1, f"{file} has {line!r} {text.count(line)} times"
                text = text.replace(line, line + more)
            path.write_text(text, encoding="utf-8")
        study = STUDY.format(surface=surface, material=material, solve=solve)
        (tmp_path / "study.toml").write_text(study, encoding="utf-8")
        environment = os.environ | {"PYTHONPATH": str(tmp_path)}
        command = [sys.executable, "-W", "error", "-c", USE + script]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    return run


def test_setting__is_added_in_two_files(added):
    edits = {
        "settings.py": {'    grid_error: bool | Literal["auto"] = "auto"\n': "    suction: float = 0.0\n"},
        "api.py": {
            "    edge: Edge = Settings.edge,\n": "    suction: float = 0.0,\n",
            "        edge=edge,\n": "        suction=suction,\n",
        },
    }
    script = """
assert case.settings.suction == 3.0
assert rv.vary(case, {"solve.suction": 4.0}).key != case.key
assert rv.Case.from_json(case.to_json()).settings.suction == 3.0
rv.simulate(ball, rubber, press, suction=3.0, times=2, progress=False)
try:
    rv.read_study("misspelt.toml")
except rv.InputError as error:
    assert "did you mean 'suction'" in str(error), error
else:
    raise AssertionError("a misspelt key is read")
"""
    misspelt = 'from pathlib import Path; p = Path("study.toml").read_text(); '
    misspelt += 'Path("misspelt.toml").write_text(p.replace("suction", "sucktion"))'
    added(edits, misspelt + script, solve="suction = 3.0")


def test_variable__is_added_in_two_files(added):
    edits = {
        "variables.py": {
            "VARIABLES: dict[str, Variable] = {\n": '    "stiffness": Variable(_SERIES, "N m-1", "secant stiffness"),\n'
        },
        "experiment/loading.py": {
            '            "force": point.force,\n': '            "stiffness": point.force / point.approach,\n'
        },
    }
    script = """
ds = rv.simulate(ball, rubber, press, times=2, progress=False)
np.testing.assert_allclose(ds.stiffness, ds.force / ds.approach, rtol=1e-14)
rv.run(case, out="out", progress=False)
stored = rv.open_result(next(Path("out").glob("**/*.nc")))
assert stored.stiffness.units == "N m-1" and stored.stiffness.long_name == "secant stiffness"
assert stored.stiffness.dims == ("time",)
"""
    added(edits, script)


def test_conditioning_step__is_added_in_one_file(added):
    edits = {
        "topography/conditioning.py": {
            "STEPS: dict[str, Step] = {\n": '    "raised": Step(lambda h, by: h.copy(data=h.values + by), "by"),\n',
        }
    }
    script = """
plain = rv.vary(case, {"surface.raised": None})
np.testing.assert_allclose(case.height(), plain.height() + 1e-6, rtol=0, atol=1e-18)
Path("card.toml").write_text('''generate = "sphere"
radius = "1 mm"
size = "0.2 mm"
shape = 9
raised = 1e-6
''')
np.testing.assert_array_equal(rv.open_scan("card.toml").values, case.height().values)
"""
    added(edits, script, surface="raised = 1e-6", solve='boundary = "free"')


def test_material__is_added_in_one_file(added):
    edits = {
        "mechanics/materials/models.py": {
            "MODELS: dict[str, Callable[..., Material]] = {\n": '    "gel": gel,\n',
            "from roughvisc.units import Quantity, number, quantities\n": """

@quantities(modulus="Pa", drainage="s")
def gel(modulus: Quantity, drainage: Quantity) -> Prony:
    \"\"\"Gel that gives way twice as much after its drainage.\"\"\"
    return Prony(glassy=1 / modulus, compliances=(1 / modulus,), times=(drainage,))
""",
        }
    }
    script = """
assert case.material == rv.Prony(glassy=1e-3, compliances=(1e-3,), times=(5.0,))
assert rv.Case.from_json(case.to_json()).material == case.material
try:
    rv.vary(case, {"material.modulus": "3 kg"})
except rv.InputError as error:
    assert error.key == "material.modulus", error
else:
    raise AssertionError("a wrong unit is read")
"""
    added(edits, script, material='model = "gel"\nmodulus = "1 kPa"\ndrainage = "5 s"')
