"""What each key of a study file means, for the schema and for its page: ``keys.toml``, and the settings' entries."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any

from roughvisc.settings import ENTRIES
from roughvisc.study.statement.schema.program import KINDS, RECORDINGS
from roughvisc.study.statement.schema.surface import RECIPES

_STEPS = ("surface: steps of a face", "surface: steps of the profile")
_RECIPES = {name: (f"generate: {name}", "generate: any", *_STEPS) for name in RECIPES}
#: class of a table of a study -> tables of ``keys.toml`` that say what its keys mean, the first that does counts; the
#: class of a material has the name of its model.
_TABLES = {
    "FileSurface": ("surface: a file", *_STEPS),
    "SecondFile": ("surface.second", "surface: a file", *_STEPS),
    **_RECIPES,
    **{f"second_{name}": ("surface.second", *tables) for name, tables in _RECIPES.items()},
    **{one.__name__: (f"program: {kind}",) for kind, sections in KINDS.items() for one in sections.values()},
    **{f"{control.capitalize()}Wave": ("program.cycle",) for control in RECORDINGS},
    "Crop": ("surface.crop",),
    "FrictionSection": ("friction",),
    "SolveSection": ("solve",),
    "KeepSection": ("keep",),
    "ObserveSection": ("observe",),
    "LeakageTable": ("observe.leakage",),
    "ConductanceTable": ("observe.conductance",),
    "AuditSection": ("audit",),
    "WantSection": ("want",),
}


@cache
def meanings() -> dict[str, dict[str, Any]]:
    """Table -> key -> meaning and example; those of settings come from their entries."""
    found = tomllib.loads(files(__package__).joinpath("keys.toml").read_text(encoding="utf-8"))
    for name, entry in ENTRIES.items():
        table = {"surface": _STEPS[1]}.get(entry.table, entry.table)
        found.setdefault(table, {})[name] = [entry.about, entry.example]
    return found


def meaning(tables: Sequence[str], key: str) -> list[str]:
    """Meaning and example of a key in the first of some tables that has it.

    Raises
    ------
    KeyError
        If none has.
    """
    for table in tables:
        if key in meanings().get(table, {}):
            return list(meanings()[table][key])
    raise KeyError(f"keys.toml: [{tables[0]!r}] has no {key}: expected its meaning and an example")


def with_meanings(schema: dict[str, Any]) -> dict[str, Any]:
    """A JSON schema whose descriptions say what a key means, before what is expected of it."""
    _describe(schema["properties"], ("study",))
    for name, section in schema["$defs"].items():
        of_material = (f"material: {name}", "material: any", "material: temperature", "material: thickness")
        if name in _TABLES or of_material[0] in meanings():  # one that was added says itself what it means
            _describe(section["properties"], _TABLES.get(name, of_material))
    return schema


def _describe(properties: dict[str, Any], tables: Sequence[str]) -> None:
    for key, one in properties.items():
        about = re.sub(r"[$\\]", "", meaning(tables, key)[0])  # formulas as plain letters
        one["description"] = f"{about}; {one['description']}" if "description" in one else about
