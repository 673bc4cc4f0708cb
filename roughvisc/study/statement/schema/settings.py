"""``[solve]`` and ``[keep]``: how it is computed, and what is kept of it."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema, create_model

from roughvisc.errors import InputError
from roughvisc.settings import ENTRIES, MOST_TIMES, WORD_OR_NUMBER, WORDS, Settings
from roughvisc.study.statement.schema.entries import Flag, a_list, choice, literal_or, measured, shown, validate, whole
from roughvisc.study.statement.schema.section import Section, nearest
from roughvisc.units import range_in_words
from roughvisc.variables import FIELDS

_INSTANT = measured("s", least=0)
_TIMES_WANTED = "'all', a count, or a list of times in s"


def _times(value: Any) -> Any:
    if value == "all":
        return value
    if isinstance(value, int) and not isinstance(value, bool):
        return validate(whole(1, MOST_TIMES), value)
    instants = a_list(value, _TIMES_WANTED)
    if not instants:
        raise InputError(f"found an empty list: expected {_TIMES_WANTED}")
    return tuple(sorted({validate(_INSTANT, instant) for instant in instants}))


def _fields(value: Any) -> Any:
    wanted = f"a list of fields out of {', '.join(FIELDS)}"
    names = a_list(value, wanted)
    for name in names:
        if name not in FIELDS:
            raise InputError(f"found {shown(name)}, which is not a field{nearest(name, FIELDS)}")
    return tuple(name for name in FIELDS if name in names)


def _kind(name: str) -> Any:
    """Kind of a setting, as a study file has it."""
    entry = ENTRIES[name]
    if name in WORDS:
        return choice(*WORDS[name])
    if isinstance(getattr(Settings, name), bool):
        return Flag
    number = measured(entry.unit, **entry.bounds)
    if name not in WORD_OR_NUMBER:
        return number
    word = WORD_OR_NUMBER[name]
    return literal_or(word, number, f"{word!r}, or {entry.noun} in {entry.unit}{range_in_words(**entry.bounds)}")


SolveSection = create_model(
    "SolveSection",
    __base__=Section,
    __doc__="How it is computed.",
    __module__=__name__,
    **{name: (_kind(name), getattr(Settings, name)) for name, entry in ENTRIES.items() if entry.table == "solve"},
)


class KeepSection(Section):
    """What is kept of it."""

    fields: Annotated[
        tuple[str, ...],
        BeforeValidator(_fields),
        WithJsonSchema({"type": "array", "items": {"enum": list(FIELDS)}}),
        Field(description=f"a list of fields out of {', '.join(FIELDS)}"),
    ] = Settings.fields
    times: Annotated[
        Any,
        BeforeValidator(_times),
        WithJsonSchema({"type": ["integer", "array", "string"], "items": {"type": ["number", "string"]}}),
        Field(description=_TIMES_WANTED),
    ] = "all"
    # relative, of the fields in the file; none: exact
    precision: measured("1", above=0, below=1) | None = None
