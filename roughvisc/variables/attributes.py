"""Attributes of a result: those that a user reads first stand by themselves, all others in one of them, as JSON.

Inside the package every attribute of a whole result stands by itself. In a file, and in what a user gets, the root has
at most twelve: those of :data:`AT_ROOT`. :func:`attributes_of` gives them all, whichever form they have.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from roughvisc.errors import InputError

#: Attribute that holds, as JSON, those that have no place of their own.
DETAILS = "details"
#: Attribute that holds the notes that warn, a line each.
NOTES = "notes"
#: Notes that warn of what a result is worth, in the order in which one should read them.
WARNINGS = ("accuracy_note", "edge_note", "border_note", "slope_note", "wake_note", "octave_note", "measurement_note")
#: Attributes of the root, in the order in which they are read.
AT_ROOT = (
    "title",
    NOTES,
    "boundary",
    "tolerance",
    "source",
    "history",
    "references",
    "Conventions",
    "result_format",
    "case_key",
    "case",
    DETAILS,
)
#: Attributes that stand among the details; an attribute that is not named here stays where the user has put it.
IN_DETAILS = (
    # how it was computed
    *("comment", "numerics_revision", "transforms", "method", "memory", "series_error", "left_out", "edge"),
    *("direction", "last_octave", "observed"),
    # the body
    *("thickness", "base", "kernel", "poisson", "compliance_at_once", "compliance_at_end", "time_scale"),
    # the surface
    *("surface_sha256", "source_file", "format", "instrument", "channel", "recipe", "filled_points", "fill_method"),
    # notes that do not warn
    *("model_note", "body_note", "material_note", "program_note", "slide_note"),
)
_NOTE = "_note"


def attributes_of(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """All that a result says of itself, each under its own name.

    Parameters
    ----------
    attributes : mapping
        Of a whole result, or of the root of one.

    Raises
    ------
    InputError
        If its details are no table in JSON.

    Examples
    --------
    >>> attributes_of({"title": "ball", "notes": "slope: too steep", "details": '{"method": "fast"}'})
    {'title': 'ball', 'method': 'fast', 'slope_note': 'too steep'}
    """
    found = {str(name): value for name, value in attributes.items() if name not in (DETAILS, NOTES)}
    if DETAILS in attributes:
        found |= {name: value for name, value in _table(attributes[DETAILS]).items() if name not in found}
    others = []
    for line in str(attributes.get(NOTES, "")).splitlines():
        about, _, text = line.partition(": ")
        if f"{about}{_NOTE}" in WARNINGS:
            found.setdefault(f"{about}{_NOTE}", text)
        else:
            others.append(line)
    return found | ({NOTES: "\n".join(others)} if others else {})


def for_root(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """The same as the root of a result has them: few, and the notes that warn among the first.

    Examples
    --------
    >>> for_root({"method": "fast", "slope_note": "too steep", "title": "ball"})
    {'title': 'ball', 'notes': 'slope: too steep', 'details': '{"method": "fast"}'}
    """
    known = attributes_of(attributes)
    notes = [f"{name.removesuffix(_NOTE)}: {' '.join(known.pop(name).split())}" for name in WARNINGS if name in known]
    if notes or NOTES in known:
        known[NOTES] = "\n".join([*notes, *([known[NOTES]] if NOTES in known else [])])
    details = {name: _plain(known.pop(name)) for name in IN_DETAILS if name in known}
    if details:
        known[DETAILS] = json.dumps(details, ensure_ascii=False)
    first = {name: known[name] for name in AT_ROOT if name in known}
    return first | known


def _table(text: Any) -> dict[str, Any]:
    try:
        found = json.loads(text)
    except (TypeError, ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise InputError(f"has an attribute {DETAILS} that is no table in JSON")
    return found


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value if isinstance(value, str | int | float | list | tuple) else str(value)
