"""Units of the values of a study, told by their dotted keys: the kinds of the schema know them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from roughvisc.study.statement.schema import Study
from roughvisc.study.statement.schema.entries import Unit
from roughvisc.study.statement.schema.material import SECTIONS, MaterialSection
from roughvisc.study.statement.schema.section import Section


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
