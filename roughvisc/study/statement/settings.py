"""Settings of a solve: one frozen value with its defaults, checked where it is made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.halfspace.kernel import Kernel
from roughvisc.mechanics.halfspace.love import HALF_SPACE
from roughvisc.mechanics.halfspace.operator import Boundary
from roughvisc.variables import FIELDS

Method = Literal["fast", "seed"]
Missing = Literal["refuse", "absent"]
Edge = Literal["error", "accept"]
Memory = Literal["auto", "direct"]
TimeStep = float | Literal["auto"]

#: Rounding leaves so much of the numbers that are held against a tolerance: a march to a finer one would not end.
FINEST_TOLERANCE = 1e-12
#: Instants that a run may keep.
MOST_TIMES = 1_000_000
#: What marks a setting that stands in a result's attributes, unless it is None.
_TOLD = {"told": True}


@dataclass(frozen=True, kw_only=True)
class Settings:
    """All that a solve needs beside a surface, a material and a program; see :func:`roughvisc.simulate`.

    The defaults stand here alone: of :func:`roughvisc.simulate`, and of the tables of a study file.

    Parameters
    ----------
    boundary, tolerance, time_step, times, fields, method, missing, edge, memory, grid_error, kernel
        As :func:`roughvisc.simulate` has them; any sequence of times or fields becomes a tuple.

    Raises
    ------
    InputError
        If a value is none of those expected. What depends on the program or on the surface is refused where these
        meet, in :func:`roughvisc.study.simulation.scene.prepare`.

    Examples
    --------
    >>> Settings(tolerance=1e-2, times=[1.0, 0.5]).times
    (0.5, 1.0)
    >>> Settings().told()
    {'boundary': 'free', 'tolerance': 0.001, 'method': 'fast'}
    """

    boundary: Boundary = field(default="free", metadata=_TOLD)
    tolerance: float = field(default=1e-3, metadata=_TOLD)
    time_step: TimeStep = "auto"
    times: int | Sequence[float] | None = None
    fields: Sequence[str] = ("pressure", "gap")
    method: Method = field(default="fast", metadata=_TOLD)
    missing: Missing = "refuse"
    edge: Edge = "error"
    memory: Memory = "auto"
    grid_error: bool = False
    kernel: Kernel = HALF_SPACE

    def __post_init__(self) -> None:
        for name, words in WORDS.items():
            if getattr(self, name) not in words:
                raise _refusal(name, getattr(self, name), " or ".join(map(repr, words)))
        for name, checked in (
            ("tolerance", _tolerance(self.tolerance)),
            ("time_step", _time_step(self.time_step)),
            ("times", _times(self.times)),
            ("fields", _fields(self.fields)),
        ):
            object.__setattr__(self, name, checked)

    def told(self) -> dict[str, Any]:
        """Those that stand in the attributes of a result."""
        values = {one.name: getattr(self, one.name) for one in fields(self) if one.metadata == _TOLD}
        return {name: value for name, value in values.items() if value is not None}


#: setting -> the words that it may be, of those that are one of a few words
WORDS: dict[str, tuple[str, ...]] = {
    name: get_args(kind) for name, kind in get_type_hints(Settings).items() if get_origin(kind) is Literal
}


def _refusal(name: str, found: Any, expected: str) -> InputError:
    return InputError(f"{name} is {found!r}: expected {expected}")


def _tolerance(value: Any) -> float:
    if not (isinstance(value, int | float) and FINEST_TOLERANCE <= value < 1):
        raise _refusal("tolerance", value, f"a number of at least {FINEST_TOLERANCE:g} and below 1")
    return float(value)


def _time_step(value: Any) -> TimeStep:
    if isinstance(value, str) and value == "auto":
        return "auto"
    if not (isinstance(value, int | float) and 0 < value < math.inf):
        raise _refusal("time_step", value, "'auto' or a positive number [s]")
    return float(value)


def _times(value: Any) -> int | tuple[float, ...] | None:
    if value is None:
        return None
    wanted = "a positive count, a list, or None"
    if isinstance(value, int | np.integer):
        if not 1 <= value <= MOST_TIMES:
            raise _refusal("times", int(value), f"{wanted}; at most {MOST_TIMES} times")
        return int(value)
    try:
        return tuple(np.unique(np.asarray(value, dtype=float)).tolist())
    except (TypeError, ValueError):
        raise _refusal("times", value, wanted) from None


def _fields(value: Any) -> tuple[str, ...]:
    wanted = f"some of {', '.join(FIELDS)}"
    try:
        names = tuple(value)
    except TypeError:
        raise _refusal("fields", value, wanted) from None
    for name in names:
        if name not in FIELDS:
            raise InputError(f"fields holds {name!r}: expected {wanted}")
    return names
