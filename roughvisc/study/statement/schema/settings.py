"""``[solve]`` and ``[keep]``: how it is computed, and what is kept of it."""

from __future__ import annotations

from typing import Any

from roughvisc.errors import InputError
from roughvisc.settings import FINEST_TOLERANCE, MOST_TIMES, WORDS, Settings
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


class SolveSection(Section):
    """How it is computed."""

    boundary: choice(*WORDS["boundary"]) = Settings.boundary
    tolerance: measured("1", least=FINEST_TOLERANCE, below=1) = Settings.tolerance
    edge: choice(*WORDS["edge"]) = Settings.edge
    grid_error: Flag = Settings.grid_error
    time_step: literal_or("auto", measured("s", above=0), "'auto', or a time in s above 0") = Settings.time_step


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
