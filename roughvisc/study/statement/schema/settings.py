"""``[solve]`` and ``[keep]``: how it is computed, and what is kept of it."""

from __future__ import annotations

from typing import Any

from pydantic import create_model

from roughvisc.errors import InputError
from roughvisc.settings import ENTRIES, MOST_TIMES, WORD_OR_NUMBER, WORDS, Settings
from roughvisc.study.statement.schema.section import (
    Flag,
    Section,
    a_list,
    choice,
    kind,
    literal_or,
    measured,
    nearest,
    shown,
    validate,
    whole,
)
from roughvisc.units import range_in_words
from roughvisc.variables import FIELDS

_INSTANT = measured("s", least=0)
_FIELDS_WANTED = f"a list of fields out of {', '.join(FIELDS)}"
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
    names = a_list(value, _FIELDS_WANTED)
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

    fields: kind(tuple[str, ...], _fields, _FIELDS_WANTED, {"type": "array", "items": {"enum": list(FIELDS)}}) = (
        Settings.fields
    )
    times: kind(
        Any,
        _times,
        _TIMES_WANTED,
        {"type": ["integer", "array", "string"], "items": {"type": ["number", "string"]}},
    ) = "all"
    # relative, of the fields in the file; none: exact
    precision: measured("1", above=0, below=1) | None = None
