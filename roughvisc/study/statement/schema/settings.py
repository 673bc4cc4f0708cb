"""``[solve]`` and ``[keep]``: how it is computed, and what is kept of it."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

from roughvisc.errors import InputError
from roughvisc.study.statement.schema.entries import Flag, a_list, checked, choice, measured, shown, whole, word_or
from roughvisc.study.statement.schema.section import Section, nearest
from roughvisc.study.statement.settings import FINEST_TOLERANCE, MOST_TIMES, WORDS, Settings
from roughvisc.variables import FIELDS

_INSTANT = measured("s", least=0)
_TIMES_WANTED = "'all', a count, or a list of times in s"


def _times(value: Any) -> Any:
    if value == "all":
        return value
    if isinstance(value, int) and not isinstance(value, bool):
        return checked(whole(1, MOST_TIMES), value)
    instants = a_list(value, _TIMES_WANTED)
    if not instants:
        raise InputError(f"found an empty list: expected {_TIMES_WANTED}")
    return tuple(sorted({checked(_INSTANT, instant) for instant in instants}))


def _fields(value: Any) -> Any:
    wanted = f"a list of fields out of {', '.join(FIELDS)}"
    names = a_list(value, wanted)
    for name in names:
        if name not in FIELDS:
            raise InputError(f"found {shown(name)}, which is no field{nearest(name, FIELDS)}")
    return tuple(name for name in FIELDS if name in names)


class SolveSection(Section):
    """How it is computed."""

    boundary: choice(*WORDS["boundary"]) = Settings.boundary
    tolerance: measured("1", least=FINEST_TOLERANCE, below=1) = Settings.tolerance
    time_step: word_or("auto", measured("s", above=0), "'auto', or a time in s above 0") = Settings.time_step
    method: choice(*WORDS["method"]) = Settings.method
    edge: choice(*WORDS["edge"]) = Settings.edge
    memory: choice(*WORDS["memory"]) = Settings.memory
    grid_error: Flag = Settings.grid_error


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
