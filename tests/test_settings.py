"""Settings of a contact: the same defaults and refusals in Python, in a study and in the stored case."""

import inspect
import json
from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import refused

import roughvisc as rv
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.problem import Problem
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.settings import WORDS, Numerics, Settings
from roughvisc.study.case import Case, vary
from roughvisc.variables import FIELDS


def test_defaults__are_the_same_in_python_in_a_study_and_in_the_value():
    usual = vars(Settings())
    signature = inspect.signature(rv.simulate).parameters
    given = {name: one.default for name, one in signature.items() if one.kind == one.KEYWORD_ONLY}
    assert given | vars(given.pop("numerics")) == usual | {"threads": None, "progress": True}
    assert given.keys().isdisjoint(vars(Numerics()))
    assert vars(STUDY.settings) == usual | {"boundary": "free"}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("boundary", "open"),
        ("missing", None),
        ("tolerance", 1),
        ("tolerance", float("nan")),
        ("time_step", 0),
        ("time_step", "10 mm"),
        ("times", 0),
        ("times", {0.1}),
        ("times", 1.0),
        ("times", True),
        ("times", np.float64(2)),
        ("fields", None),
        ("fields", ("gap", "stress")),
        ("device", "tpu"),
    ],
)
def test_settings__refuse_and_name_the_setting(name, value):
    with refused(name, value):
        Settings(**{name: value})


@pytest.mark.parametrize("name", [one.name for one in fields(Numerics)])
def test_numerics__are_checked(name):
    with refused(name, "wrong"):
        rv.Numerics(**{name: "wrong"})
    with pytest.raises(rv.InputError, match="numerics"):
        rv.simulate(None, rv.elastic(1e6), rv.Program(), numerics={"time_step": 0.1})


def test_settings__are_one_frozen_value():
    one = Settings(times=np.array([0.5, 0.25, 0.5]), fields=["gap"], time_step="1 s")
    assert one == Settings(times=(0.25, 0.5), fields=("gap",), time_step=1.0)
    assert Settings(fields="gap").fields == vary(STUDY, {"keep.fields": "gap"}).settings.fields == ("gap",)
    assert Settings(times="0.5 s").times == Settings(times=[0.5]).times == (0.5,)
    assert len({one, Settings(times=[0.25, 0.5], fields=iter(["gap"]), time_step=1.0)}) == 1
    with pytest.raises(FrozenInstanceError):
        one.tolerance = 0.1


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
    boundary = "free" if wanted.boundary == "auto" else wanted.boundary  # of an indenter
    assert case.settings == Settings(**{**vars(wanted), "boundary": boundary})


@pytest.mark.parametrize(("cells", "stated"), [(255, False), (256, True), (512, True), (513, False)])
def test_grid_error__is_estimated_by_default_if_it_takes_at_most_a_third(cells, stated):
    ball, body = rv.sphere(1e-3, 2e-4, cells), rv.Body(rv.elastic(1e6))
    pressed, slid = Loading(rv.Program().load(1e-3, over=0)), SteadySliding(speeds=1.0, load=1.0)

    def found(experiment, **settings):
        return experiment.resolved(Problem(ball, body, Settings(**settings))).settings.grid_error

    assert found(pressed) is stated
    assert not found(pressed, fields=()), "no pressure is kept"
    assert found(slid, fields=()) is stated
    assert found(pressed, grid_error=True)
    assert not found(pressed, grid_error=False)
