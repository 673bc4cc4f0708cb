"""What a loading program says in words, and which words it knows."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, get_args

from roughvisc.errors import InputError
from roughvisc.mechanics.stepping.segment import CONTROLS, UNITS, Control, Segment
from roughvisc.mechanics.stepping.slide import DIRECTIONS, Direction
from roughvisc.units import said, shown

#: what may be prescribed -> what may be meant where the unit is of another kind: keys and their units
INSTEAD = {control: {other: unit for other, unit in UNITS.items() if other != control} for control in UNITS}

#: Segments that a program tells one by one.
TOLD = 8


def known_control(control: Any, key: str) -> Any:
    """What is controlled, if there is such a thing."""
    if control not in get_args(Control):
        raise InputError(f"{key}: found {shown(control)}: expected {CONTROLS}")
    return control


def known_direction(direction: Any, key: str) -> Any:
    """A direction of sliding, if there is such a one."""
    if direction not in get_args(Direction):
        raise InputError(f"{key}: found {shown(direction)}: expected {DIRECTIONS}")
    return direction


def told(segments: Sequence[Segment]) -> list[str]:
    """The first segments, one by one."""
    first = segments[:TOLD]
    words = [str(segment) for segment in first]
    for number, (before, segment) in enumerate(pairwise(first), 1):
        if segment.holds and segment.control == before.control:
            words[number] = f"hold {said(segment.duration, 's')}"  # what else
    return words
