"""The page on study files: every key has its row, and every example is accepted."""

import re
import tomllib

import pytest
from test_docs import BASE, DOCS, there  # noqa: F401  a fixture

from roughvisc.errors import InputError
from roughvisc.study.statement.case import read_cases
from roughvisc.study.statement.schema.keys import meanings
from roughvisc.study.statement.schema.material import COLUMNS, MODELS, SPRINGS, TEMPERATURE
from roughvisc.study.statement.schema.program import TABLES
from roughvisc.views.sweep_figures.case_text import study_text

PAGE = (DOCS / "study-files.md").read_text(encoding="utf-8")
WLF = {"temperature": 313, "reference_temperature": 293, "wlf_c1": 8.86, "wlf_c2": 101.6}
ARRHENIUS = {"temperature": 313, "reference_temperature": 293, "activation_energy": 8e4}
#: what an example is tried beside, where it needs another key or excludes one
BESIDE = {
    **dict.fromkeys(TEMPERATURE, WLF),
    "activation_energy": ARRHENIUS,
    "shift_factor": {},
    "thickness": {},
    "base": {"thickness": 1e-3},
    "on": {"thickness": "1 mm"},
}
#: a CSV file whose headings have no units, for the keys that say them
PLAIN = "0.01, 1\n0.1, 2\n1, 3\n"
FALLING = "0.01, 3\n0.1, 2\n1, 1\n"


@pytest.fixture
def study_keys(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    import study_keys

    return study_keys


def value(example):
    return tomllib.loads(f"key = {example}")["key"]


def test_page__has_every_table_and_every_model(study_keys):
    marks = re.findall(r"^STUDY_KEYS (.+)$", PAGE, re.M)
    assert sorted(marks) == sorted(study_keys.TABLES)
    assert set(re.findall(r"^### `(\w+)`$", PAGE, re.M)) == set(MODELS)
    for model in MODELS:
        section = PAGE.split(f"### `{model}`")[1].split("STUDY_KEYS")[0]
        assert "$$" in section, f"{model} has no formula"
    assert "STUDY_KEYS" not in study_keys.filled(PAGE)


def test_meanings__are_of_keys_that_exist(study_keys):
    for name, keys in meanings().items():
        if name.endswith(": any") and name != "generate: any":
            known = {
                key for table in study_keys.TABLES if table.startswith("material") for key, *_ in study_keys.rows(table)
            }
            known.add("model")
        else:
            known = {key for key, *_ in study_keys.rows(name)}
        assert set(keys) - {"beside"} <= known, name


def test_page__has_every_control_and_every_key_of_a_recording(study_keys):
    for table in ("program: hold", "program: cycle", "program: table"):
        (words,) = (words for key, words, *_ in study_keys.rows(table) if key == "control")
        assert all(f"'{name}'" in words for name in TABLES), table
    recording = PAGE.split("STUDY_KEYS program.table")[1].split("##")[0]
    for kind in TABLES.values():
        assert not [key for key in kind.recording.model_fields if not re.search(rf"\b{key}\b", recording)]


def surfaces(study_keys, name, key, example):
    """``[surface]`` with an example of one of its keys."""
    if name == "surface: a file":
        return {"file": "surfaces/ground_steel.x3p"} | ({key: example} if key not in ("file", "channel") else {})
    if name.startswith("generate: "):
        recipe = name.removeprefix("generate: ").replace("any", "sphere")
        base = tomllib.loads(meanings()[name].get("beside", ""))
        needed = {k: value(e) for k, _, _, default, _, e in study_keys.rows(name) if default == "required"}
        shared = (
            {"size": "1 mm", "shape": 32, "radius": "10 mm"} if recipe == "sphere" else {"size": "1 mm", "shape": 32}
        )
        if key == "rms_height":
            base = {}
        return {**shared, **base, **needed, key: example, "generate": recipe}
    inner = name.partition("surface.")[2]
    scan = {"file": "surfaces/ground_steel.x3p", "fill": True}
    if inner == "second":
        return scan | {"second": {**scan, key: example}}
    if inner:
        return scan | {inner: ({"cutoff": "20 um"} if inner == "filter" else {}) | {key: example}}
    return scan | {key: example}


def materials(study_keys, name, key, example, folder):
    """``[material]`` with an example of one of its keys."""
    model = name.removeprefix("material: ")
    if model in ("temperature", "thickness"):
        return {**BASE["material"], **BESIDE[key], key: example}
    needed = {k: value(e) for k, _, _, default, _, e in study_keys.rows(name) if default == "required"}
    base = {} if name not in meanings() else tomllib.loads(meanings()[name].get("beside", ""))
    columns = {} if key == "file" else {k: value(study_keys.meaning(name, k)[1]) for k in COLUMNS.get(model, {})}
    if key.endswith("_unit") and key not in needed:
        read = [column for column in COLUMNS[model].values() if not column.optional]
        units = [f" [{column.unit}]" if column.unit and column.unit_key != key else "" for column in read]
        heads = ", ".join(column.name + unit for column, unit in zip(read, units, strict=True))
        rows = PLAIN if len(read) == 2 else "1, 2, 1\n9, 3, 1\n"
        (folder / "plain.csv").write_text(f"{heads}\n" + (FALLING if model == "relaxation_table" else rows))
        columns = {"file": "plain.csv"}
    base = {} if key == "file" or "file" in columns else base
    base = {k: v for k, v in base.items() if SPRINGS.get(k) != key}
    return {"model": model, **needed, **base, **columns, key: example}


def programs(study_keys, name, key, example):
    """``[[program]]`` with an example of one of its keys."""
    if "." in name:
        kind = name.partition(".")[2]
        return [{kind: {**value(study_keys.meaning(f"program: {kind}", kind)[1]), key: example}}]
    kind = name.removeprefix("program: ")
    needed = {k: value(e) for k, _, _, default, _, e in study_keys.rows(name) if default == "required"}
    before = [{"load": 1, "over": 0}] if kind in ("hold", "slide") else []
    needed |= {"over": 1} if kind == "slide" and key not in ("speed", "over") else {}
    return [*before, {**needed, key: example}]


#: Keys of a file that states no unit, or that has several channels.
_OF_OTHERS = ("channel", "unit", "height_unit")


def test_examples__are_accepted(study_keys, there):  # noqa: F811
    tried = 0
    for name in study_keys.TABLES:
        for key, *_, example in study_keys.rows(name):
            if example.strip("[]") == key:
                continue  # the heading of a table
            data, one = dict(BASE), value(example)
            try:
                example_in(study_keys, data, name, key, one, there)
                (there / "study.toml").write_text(study_text(data))
                case = read_cases("study.toml")[0]
                if name.startswith("generate") or (name.startswith("surface") and key not in _OF_OTHERS):
                    assert case.height().size > 1
            except (InputError, KeyError) as error:
                raise AssertionError(f"[{name}] {key} = {example}: {error}") from error
            tried += 1
    assert tried > 100


def example_in(study_keys, data, name, key, one, folder):
    head = name.partition(":")[0].partition(".")[0]
    if head in ("surface", "generate"):
        example = one.replace("../", "") if isinstance(one, str) else one
        if key == "second":
            example = {**one, "file": one["file"].replace("../", ""), "fill": True}
        data["surface"] = surfaces(study_keys, name, key, example)
    elif head == "material":
        data["material"] = materials(study_keys, name, key, one, folder)
    elif head == "program":
        data["program"] = programs(study_keys, name, key, one)
    elif head == "friction":
        del data["program"], data["keep"]
        asked = {"speeds": "1 mm/s", **({} if key == "load" else {"pressure": "0.2 MPa"})}
        data["friction"] = asked | (
            {"speeds": value(study_keys.meaning("friction", "speeds")[1]) | {key: one}} if "." in name else {key: one}
        )
    elif head == "study":
        data[key] = one
    elif name.startswith("observe."):
        needed = {"resistivity": [1, 0]} if name == "observe.conductance" else {}
        data["observe"] = {name.partition(".")[2]: {**needed, key: one}}
    else:
        data[head] = {**BASE.get(head, {}), **(BESIDE.get(key, {}) if head == "audit" else {}), key: one}
        data["program"] = [{"load": 1e-4, "over": 0.1}]
