"""Every study of the workflows with one thing wrong is refused, with its file, key, value and what was expected."""

import copy
import random
import tomllib
from pathlib import Path

import pytest

from roughvisc.errors import InputError
from roughvisc.study.case import read_cases
from roughvisc.study.case_text import study_text

WORKFLOWS = sorted((Path(__file__).parents[3] / "workflows").glob("*.toml"))
#: Workflows that the short run tries.
FIRST = ("quickstart", "friction")
#: Texts that any text may replace.
FREE = ("title", "file")
#: A text of another unit than any key has, a table, a list, a switch and a word, each of which no key takes.
WRONG = ("3 kg", {"nonsense": 1}, [[]], ["x", "y", "z"], True, "nonsense")


def leaves(tables, above=()):
    """Path of each value, and of each table."""
    for key, value in tables.items() if isinstance(tables, dict) else enumerate(tables):
        if isinstance(value, dict) or (isinstance(value, list) and any(isinstance(one, dict) for one in value)):
            if isinstance(key, str) or isinstance(value, dict):
                yield from leaves(value, (*above, key))
        else:
            yield (*above, key)


def at(tables, path):
    for part in path:
        tables = tables[part]
    return tables


def mutations(stated):
    """Yield the path of a mistake and the tables that have it: keys misspelt, values of another kind, keys added."""
    for path in leaves(stated):
        *above, name = path
        changed = copy.deepcopy(stated)
        table = at(changed, above)
        table[f"{name}x"] = table.pop(name)
        yield path, changed
        value = at(stated, path)
        for wrong in WRONG:
            is_free = name in FREE and isinstance(wrong, str)
            is_varied = ".".join(map(str, path)) in stated.get("sweep", {})  # so that no case has the value
            is_switch = wrong is True and (isinstance(value, bool) or name in ("level", "fill", "outliers"))
            if is_free or is_varied or is_switch:
                continue
            changed = copy.deepcopy(stated)
            at(changed, above)[name] = wrong
            yield path, changed
    for table in dict.fromkeys(path[:-1] for path in leaves(stated)):
        changed = copy.deepcopy(stated)
        at(changed, table)["nonsense"] = 1
        yield (*table, "nonsense"), changed


@pytest.mark.parametrize(
    "workflow",
    [pytest.param(one, id=one.stem, marks=() if one.stem in FIRST else pytest.mark.thorough) for one in WORKFLOWS],
)
def test_mutation__is_refused_with_file_key_value_and_expectation(workflow, tmp_path):
    text = workflow.read_text(encoding="utf-8").replace("../surfaces", str(workflow.parents[1] / "surfaces"))
    stated, study = tomllib.loads(text), tmp_path / "study.toml"
    study.write_text(study_text(stated))
    assert len(read_cases(study)) == len(read_cases(workflow)), "the study is read again as it is written here"
    mistakes = list(mutations(stated))
    assert len(mistakes) >= 40
    for path, changed in mistakes:
        study.write_text(study_text(changed))
        with pytest.raises(InputError) as caught:
            read_cases(study)
        error = caught.value
        told = f"{path}: {error}"
        assert str(error).startswith(f"{study}: "), told
        assert error.expected, told
        table = next(part for part in path if part not in ("sweep", 0))
        assert error.key.split(".")[0] in (str(table).split(".")[0], f"{table}x", "sweep", "nonsense"), told
        assert error.key in str(error), told


def test_wrong_studies__end_with_status_2_and_write_nothing(invoke, tmp_path):
    drawn = random.Random(1)
    study, out = tmp_path / "study.toml", tmp_path / "results"
    for workflow in WORKFLOWS:
        text = workflow.read_text(encoding="utf-8").replace("../surfaces", str(workflow.parents[1] / "surfaces"))
        for path, changed in drawn.sample(list(mutations(tomllib.loads(text))), 20):
            study.write_text(study_text(changed))
            status, printed, refusal = invoke("run", study, "--out", out)
            told = f"{workflow.stem}, {path}: {printed}{refusal}"
            assert status == 2, told
            assert str(study) in refusal, told
            assert str(next(part for part in path if part not in ("sweep", 0))).split(".")[0] in refusal, told
            assert [one.name for one in tmp_path.iterdir()] == [study.name], told
