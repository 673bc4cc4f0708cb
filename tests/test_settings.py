"""How a contact is computed, as one value: its defaults, what it refuses, and that all its doors agree."""

import inspect
import json
import os
import subprocess
import sys
from dataclasses import FrozenInstanceError, fields
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import changed_package

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.mechanics.hereditary.choice import Kind
from roughvisc.settings import WORDS, Numerics, Settings
from roughvisc.study.statement.case import Case, read_study, vary
from roughvisc.study.statement.schema.keys import study_schema
from roughvisc.study.statement.schema.settings import KeepSection, SolveSection
from roughvisc.study.statement.schema.surface import Conditioned
from roughvisc.study.trade.ladder import Setting
from roughvisc.variables import FIELDS

USUAL = {
    "boundary": "auto",
    "tolerance": 1e-3,
    "time_step": "auto",
    "times": None,
    "fields": ("pressure", "gap"),
    "method": "fast",
    "missing": "refuse",
    "edge": "error",
    "memory": "auto",
    "grid_error": False,
}


def test_defaults__are_the_same_in_python_in_a_study_and_in_the_value():
    assert {one.name: getattr(Settings(), one.name) for one in fields(Settings)} == USUAL
    signature = inspect.signature(rv.simulate).parameters
    given = {name: one.default for name, one in signature.items() if one.kind == one.KEYWORD_ONLY}
    assert given | vars(given.pop("numerics")) == USUAL | {"threads": None, "progress": True}
    assert given.keys().isdisjoint(vars(Numerics()))
    solve, keep = SolveSection(), KeepSection()
    assert dict(solve) == {name: USUAL[name] for name in dict(solve)}
    assert (keep.fields, keep.times) == (USUAL["fields"], "all")
    assert Conditioned().missing == USUAL["missing"]
    stated = {*dict(solve), "fields", "times", "missing"}
    assert stated == set(USUAL)
    assert all(getattr(Setting(), name) == USUAL[name] for name in ("tolerance", "method", "memory"))


def test_words__are_the_same_in_python_in_a_study_and_in_the_solver():
    assert WORDS["memory"] == get_args(Kind)
    properties = study_schema()["$defs"]["SolveSection"]["properties"]
    stated = {name: tuple(one["enum"]) for name, one in properties.items() if "enum" in one}
    assert stated == {name: words for name, words in WORDS.items() if name != "missing"}


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"boundary": "open"}, "boundary is 'open': expected 'auto' or 'free' or 'periodic'"),
        ({"method": "slow"}, "method is 'slow': expected 'fast' or 'seed'"),
        ({"missing": None}, "missing is None: expected 'refuse' or 'absent'"),
        ({"edge": "wrap"}, "edge is 'wrap': expected 'error' or 'accept'"),
        ({"memory": "none"}, "memory is 'none': expected 'auto' or 'direct'"),
        ({"tolerance": 1}, "tolerance is 1: expected a number at least 1e-12 and below 1"),
        ({"tolerance": "1e-3"}, "tolerance is '1e-3': expected a number at least 1e-12 and below 1"),
        ({"tolerance": float("nan")}, "tolerance is nan: expected a number at least 1e-12 and below 1"),
        ({"time_step": 0}, "time_step is 0: expected 'auto' or a time above 0 [s]"),
        ({"time_step": float("inf")}, "time_step is inf: expected 'auto' or a time above 0 [s]"),
        ({"time_step": "-10 ms"}, "time_step is -0.01: expected 'auto' or a time above 0 [s]"),
        (
            {"time_step": "10 mm"},
            "time_step is '10 mm', which is in millimeter: expected a number in s, "
            "or a string with a unit of its kind; or 'auto'",
        ),
        ({"times": 0}, "times is 0: expected a positive count, a list, or None; at most 1000000 times"),
        ({"times": {0.1}}, "times is {0.1}: expected a positive count, a list, or None"),
        (
            {"times": "all"},
            "times is 'all', which is no quantity: expected a number in s, or a string with a unit of its kind; "
            "times may be a positive count, a list, or None",
        ),
        (
            {"times": [0.1, "soon"]},
            "times[1] is 'soon', which is no quantity: expected a number in s, or a string with a unit of its kind; "
            "times may be a positive count, a list, or None",
        ),
        ({"fields": None}, "fields is None: expected some of pressure, gap, displacement"),
        ({"fields": ("gap", "stress")}, "fields holds 'stress': expected some of pressure, gap, displacement"),
    ],
)
def test_settings__refuse_with_what_was_found_and_what_was_expected(wrong, message):
    with pytest.raises(InputError) as caught:
        Settings(**wrong)
    assert str(caught.value) == message


def test_times__are_numbers_or_text():
    assert Settings(time_step="10 ms", times=["1 s", 0.25]) == Settings(time_step=0.01, times=(0.25, 1.0))


@pytest.mark.parametrize("name", [one.name for one in fields(Numerics)])
def test_numerics__are_one_argument(name):
    """What is rarely changed is refused where it stood once, and checked where it is written."""
    with pytest.raises(
        InputError, match=rf"^{name} is no argument of simulate any more: write numerics=rv\.Numerics\("
    ):
        rv.simulate(None, None, None, **{name: "auto"})
    with pytest.raises(InputError, match=f"^{name} is 'wrong'"):
        rv.Numerics(**{name: "wrong"})
    with pytest.raises(InputError, match=r"^numerics is \{'method': 'seed'\}: expected rv\.Numerics\("):
        rv.simulate(None, rv.elastic(1e6), rv.Program(), numerics={"method": "seed"})


def test_settings__are_one_frozen_value():
    one = Settings(times=np.array([0.5, 0.25, 0.5]), fields=["gap"], time_step=1)
    assert one == Settings(times=(0.25, 0.5), fields=("gap",), time_step=1.0)
    assert len({one, Settings(times=[0.25, 0.5], fields=iter(["gap"]), time_step=1.0)}) == 1
    with pytest.raises(FrozenInstanceError):
        one.tolerance = 0.1


BALL = """
[surface]
generate = "sphere"
radius = "1 mm"
size = "0.2 mm"
shape = [9, 8]
[material]
model = "elastic"
shear_modulus = "1 MPa"
[[program]]
load = "0.1 mN"
over = 0
[solve]
"""

STUDY = Case.from_json(
    json.dumps(
        {
            "surface": {"generate": "sphere", "radius": 1e-2, "size": 1e-3, "shape": 24},
            "material": {"model": "elastic", "shear_modulus": 1e6},
            "program": [{"load": 1e-3, "over": 1.0}],
        }
    )
)
TABLES = {"fields": "keep", "times": "keep", "missing": "surface"}


def decimal(least, most):
    """Numbers of fifteen digits, as a study file has them."""
    return st.floats(least, most).map(lambda value: float(f"{value:.15g}"))


@given(
    st.fixed_dictionaries(
        {},
        optional={
            **{name: st.sampled_from(words) for name, words in WORDS.items()},
            "tolerance": decimal(1e-9, 0.5),
            "time_step": st.one_of(st.just("auto"), decimal(1e-6, 1.0)),
            "times": st.one_of(st.none(), st.integers(1, 9), st.lists(decimal(0.0, 1.0), min_size=1)),
            "fields": st.lists(st.sampled_from(FIELDS), unique=True),
            "grid_error": st.booleans(),
        },
    )
)
def test_study__states_the_settings_that_the_solver_gets(chosen):
    wanted = Settings(**chosen)
    written = chosen | ({"times": "all"} if wanted.times is None else {})
    case = vary(STUDY, {f"{TABLES.get(name, 'solve')}.{name}": value for name, value in written.items()})
    kept = tuple(name for name in FIELDS if name in wanted.fields)
    boundary = "free" if wanted.boundary == "auto" else wanted.boundary  # of an indenter
    assert case.solving() == Settings(**{**vars(wanted), "fields": kept, "boundary": boundary})


#: What a new setting touches, and above which line: its entry, the signature that takes it, and where it is used.
NEW_SETTING = [
    ("settings.py", "    def to_attributes(self) -> dict[str, Any]:"),
    (
        "api.py",
        '    threads: int | None = None,\n    progress: bool | Progress = True,\n) -> xr.Dataset:\n    """Press',
    ),
    ("api.py", "    )\n    problem = Problem(height, body_of(material), settings)\n    return root_of("),
    ("experiment/loading.py", "        scene, choice, profile, settings = self._scene, self._choice, self.profile"),
]

USED = """
import logging, sys, tomllib
from pathlib import Path
from unittest.mock import patch
import roughvisc as rv
from roughvisc.experiment import loading
from roughvisc.study.statement.case import read_study
from roughvisc.study.statement.schema.keys import meaning

def refused(call):
    try:
        call()
    except rv.InputError as error:
        return str(error)

path = Path(sys.argv[1])
text = path.read_text()
plain = read_study(path)
path.write_text(text + 'patience = "3 s"\\n')
patient = read_study(path)
assert plain.solving().patience == 2.0 and patient.solving().patience == 3.0
assert len({plain.key, patient.key}) == 2
path.write_text(text + "patience = 2\\n")
assert read_study(path).key == plain.key == sys.argv[2], "the keys of former cases stay"
path.write_text(text + "patience = 0.5\\n")
told = refused(lambda: read_study(path))
wanted = "expected a number in s, or a string with a unit of its kind, at least 1"
assert told.endswith(f"solve.patience: found 0.5: {wanted}"), told
about = rv.study_schema()["$defs"]["SolveSection"]["properties"]["patience"]["description"]
assert about.startswith("how long a solve may take before it says so; a number in s")
assert meaning(["solve"], "patience")[1] == '"3 s"'
friction = '[friction]\\nspeeds = [1]\\nload = 1\\n[solve]\\nboundary = "periodic"\\npatience = 3\\n'
path.write_text(text.split("[[program]]")[0] + friction)
assert "patience: found 3.0: steady sliding has none" in refused(lambda: read_study(path))
ball, press = rv.sphere(1e-3, 2e-4, (9, 8)), rv.Program().load(1e-4, over=0)
found = rv.simulate(ball, rv.elastic(1e6), press, patience=4, progress=False)
assert found.attrs["patience"] == 4.0
told = refused(lambda: rv.simulate(ball, rv.elastic(1e6), press, patience=0))
assert told == "patience is 0: expected a time at least 1 [s]", told
heard = []
logging.getLogger("roughvisc").addFilter(lambda record: heard.append((patience, record.getMessage())))
slow = patch.object(loading.LoadingRows, "columns", lambda self, found: found | {"wall_time": 9 + 0 * found["force"]})
for patience in (10, 8):
    with slow:
        rv.simulate(ball, rv.elastic(1e6), press, patience=patience, progress=False)
assert [said for said in heard if "took" in said[1]] == [(8, "this took 9 s")], heard
"""


def test_new_setting__touches_three_files(tmp_path):
    """Study file, key, schema, page of keys, refusals and checks follow from its entry, as the page about it has it."""
    package = changed_package(tmp_path, "howto/add-a-variable.md", "test_settings.py", NEW_SETTING)
    assert len({name for name, _ in NEW_SETTING}) == 3
    study = tmp_path / "ball.toml"
    study.write_text(BALL)
    env = os.environ | {"PYTHONPATH": str(package)}
    command = [sys.executable, "-c", USED, str(study), read_study(study).key]
    done = subprocess.run(command, capture_output=True, text=True, env=env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
