"""What the keys of a study file mean, and the units of their values."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.resources import files
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from roughvisc.study.statement.schema import Study, StudyFile
from roughvisc.study.statement.schema.material import SECTIONS, MaterialSection
from roughvisc.study.statement.schema.program import KINDS, TABLES
from roughvisc.study.statement.schema.section import Section, Unit
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
    **{one.wave.__name__: ("program.cycle",) for one in TABLES.values()},
    "Crop": ("surface.crop",),
    "FrictionSection": ("friction",),
    "SolveSection": ("solve",),
    "KeepSection": ("keep",),
    "ObserveSection": ("observe",),
    "LeakageTable": ("observe.leakage",),
    "ConductanceTable": ("observe.conductance",),
    "AuditSection": ("audit",),
}


@cache
def meanings() -> dict[str, dict[str, Any]]:
    """Table -> key -> meaning and example."""
    return tomllib.loads(files(__package__).joinpath("keys.toml").read_text(encoding="utf-8"))


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


def unit_of(key: str, case: Mapping[str, Any] | None = None) -> str:
    """Unit of the value at a dotted key of a study, or of the values of a list there; empty where the key tells none.

    Parameters
    ----------
    key : str
        Such as ``"program.0.load"``.
    case : mapping, optional
        The case in JSON, which tells where a key is of several units: a cycle is one of load or of approach.

    Examples
    --------
    >>> unit_of("program.0.load"), unit_of("surface.seed"), unit_of("program.1.cycle.mean")
    ('N', '', '')
    >>> unit_of("program.0.cycle.amplitude", {"program": [{"cycle": {}, "control": "approach"}]})
    'm'
    """
    found = _units_at(key, case) or _units_at(key, None)
    return found.pop() if len(found) == 1 and found != {"1"} else ""


def _units_at(key: str, stated: Any) -> set[str]:
    kinds: list[Any] = [Study]
    for part in key.split("."):
        kinds = [inner for kind in kinds for one in _choices(kind) for inner in _inside(one, part, stated)]
        stated = _entry(stated, part)
    return {unit for kind in kinds for unit in _units(kind)}


def _choices(kind: Any) -> Iterator[Any]:
    """The types that a value of a kind may have."""
    if get_origin(kind) is Annotated:
        yield from _choices(get_args(kind)[0])
    elif get_origin(kind) in (Union, UnionType):
        for one in get_args(kind):
            yield from _choices(one)
    elif kind is MaterialSection:  # of any model
        yield from SECTIONS.values()
    else:
        yield kind


def _inside(kind: Any, part: str, stated: Any) -> Iterator[Any]:
    """The kind at a key of a table, or at a number of a list."""
    if isinstance(kind, type) and issubclass(kind, Section):
        if part in kind.model_fields and _may_be(kind, stated):
            field = kind.model_fields[part]
            yield Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation
    elif get_origin(kind) is tuple and part.isdecimal():
        yield get_args(kind)[0]


def _may_be(section: type[Section], stated: Any) -> bool:
    """Whether a table may be of a class, by the words that name it, such as ``model`` and ``control``."""
    if not isinstance(stated, Mapping):
        return True
    words = {name: one for name, one in section.model_fields.items() if get_origin(one.annotation) is Literal}
    return all(stated.get(name, one.default) in get_args(one.annotation) for name, one in words.items())


def _entry(stated: Any, part: str) -> Any:
    """What a case has at a key or at a number; None if nothing."""
    if isinstance(stated, Mapping):
        return stated.get(part)
    if isinstance(stated, list | tuple) and part.isdecimal() and int(part) < len(stated):
        return stated[int(part)]
    return None


def _units(kind: Any) -> Iterator[str]:
    """Units of a kind, or of the entries of its list."""
    told = [one.symbol for one in getattr(kind, "__metadata__", ()) if isinstance(one, Unit)]
    if told:
        yield from told
    elif get_origin(kind) is Annotated:
        yield from _units(get_args(kind)[0])
    elif get_origin(kind) in (Union, UnionType, tuple):
        for inner in get_args(kind):
            yield from _units(inner)


def study_schema() -> dict[str, Any]:
    """JSON schema of a study file, for editors that check TOML while it is written.

    Examples
    --------
    >>> sorted(study_schema()["properties"])
    ['audit', 'friction', 'keep', 'material', 'observe', 'program', 'solve', 'surface', 'sweep', 'title']
    >>> study_schema()["$defs"]["SolveSection"]["properties"]["edge"]["description"].partition(";")[0]
    'whether contact may reach the border in free space: the scan outline is then treated as a punch'
    """
    schema = StudyFile.model_json_schema()
    described = [(schema["properties"], ("study",))]
    for name, section in schema["$defs"].items():
        of_material = (f"material: {name}", "material: any", "material: temperature", "material: thickness")
        if name in _TABLES or of_material[0] in meanings():  # one that was added says itself what it means
            described.append((section["properties"], _TABLES.get(name, of_material)))
    for properties, tables in described:
        for key, one in properties.items():  # what a key means, before what is expected of it
            about = re.sub(r"[$\\]", "", meaning(tables, key)[0])  # formulas as plain letters
            one["description"] = f"{about}; {one['description']}" if "description" in one else about
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "roughvisc study"}
