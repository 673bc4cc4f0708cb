"""The page on study files has every key with its unit and its meaning."""

import inspect
import re

import pytest
from test_docs import DOCS

import roughvisc as rv
from roughvisc.arguments import arguments
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.materials.models import MODELS
from roughvisc.settings import Settings
from roughvisc.study.machine_history import read_history
from roughvisc.study.study_file import COLUMNS, GEOMETRY, PROGRAMS, SEGMENTS, TABLES, TEMPERATURE
from roughvisc.topography.conditioning import STEPS
from roughvisc.topography.synthesis import RECIPES

PAGE = (DOCS / "study-files.md").read_text(encoding="utf-8")


@pytest.fixture
def study_keys(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    import study_keys

    return study_keys


def test_page__has_every_table_and_every_model(study_keys):
    assert sorted(study_keys.MARK.findall(PAGE)) == sorted(study_keys.TABLES)
    assert set(re.findall(r"^### `(\w+)`$", PAGE, re.M)) == set(MODELS)
    for model in MODELS:
        section = PAGE.split(f"### `{model}`")[1].split("study_keys.py")[0]
        assert "$$" in section, f"{model} has no formula"
    assert "prints these keys" not in study_keys.filled(PAGE)


def keys_of(function, skipped=0):
    """Keys of the table of a function; notes are not on the page."""
    return {
        name
        for name in arguments(function, skipped)
        if name not in ("note", "stands_for", "longest", "warning", "misfit")
    }


#: tables of the page that belong together -> keys that a study may have there
EXPECTED = {
    ("study",): {*TABLES, "sweep"},
    ("surface: a file",): {"file", *keys_of(rv.open_scan, 1)},
    ("surface: steps of a face", "surface: steps of the profile"): {*STEPS, "missing"},
    **{("generate: any", f"generate: {name}"): {"generate", *keys_of(one)} for name, one in RECIPES.items()},
    **{(f"material: {name}",): keys_of(one) for name, one in MODELS.items() if name not in COLUMNS},
    **{(f"material: {name}",): keys_of(MODELS[name]) | {"file"} for name in COLUMNS},
    ("material: any", "material: temperature", "material: thickness"): {
        "model",
        "modulus_factor",
        *TEMPERATURE,
        *GEOMETRY,
    },
    **{(f"program: {kind}",): {kind, *list(inspect.signature(one).parameters)[2:]} for kind, one in SEGMENTS.items()},
    **{(f"program: {kind}",): {kind, "control"} for kind in PROGRAMS},
    ("program.cycle",): keys_of(rv.Program.cycle) - {"control"},
    ("program.table",): keys_of(rv.Program.table) - {"control"},
    ("program.table: a file",): {"file", *keys_of(read_history, 1)},
    ("friction",): keys_of(SteadySliding),
    ("solve", "keep"): keys_of(Settings) - {"missing"},
    ("observe.leakage",): keys_of(rv.observables.leakage, 1),
    ("observe.conductance",): keys_of(rv.observables.conductance, 1),
    ("audit",): keys_of(rv.audit, 1),
}


@pytest.mark.parametrize("tables", EXPECTED, ids=str)
def test_page__has_every_key_with_its_meaning(study_keys, tables):
    rows = [row for table in tables for row in study_keys.rows(table)]
    assert {key for key, *_ in rows} == EXPECTED[tables]
    assert all(meaning for *_, meaning in rows)
