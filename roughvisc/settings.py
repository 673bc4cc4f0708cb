"""Settings of a solve, each declared once: its default, its allowed values, its meaning, and its table.

The signature in :mod:`roughvisc.api` and the table ``[keep]`` of a study only repeat the names. Settings that are
rarely changed are in :class:`Numerics`, which :func:`roughvisc.simulate` takes as one argument.

These entries determine the checks of :class:`Settings`, the tables ``[solve]`` and ``[keep]`` of a study file with the
page of their keys, the key of a case, and the settings that experiments over other axes than time refuse.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from roughvisc.errors import InputError
from roughvisc.units import in_si, quantity, range_in_words, within
from roughvisc.variables import FIELDS

#: ``auto`` becomes one of the others by :func:`known_boundary`
Boundary = Literal["auto", "free", "periodic", "mirror"]
Missing = Literal["refuse", "absent"]
Edge = Literal["error", "accept"]
TimeStep = float | str | Literal["auto"]

#: Rounding leaves so much of the numbers that are held against a tolerance: a march to a finer one would not end.
FINEST_TOLERANCE = 1e-12
#: Instants that a run may keep.
MOST_TIMES = 1_000_000
_ENTRY = "entry"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """Declaration of a setting, in addition to its type and its default.

    Attributes
    ----------
    about, example : str
        Its meaning, and an example value in a study file.
    table : {"solve", "keep", "surface"}
        Its table in a study file.
    bounds : dict
        For a number: some of ``above``, ``least``, ``most``, ``below``.
    noun, unit : str
        Name of the quantity, and its unit; ``"1"`` if it is dimensionless.
    in_attributes : bool
        Whether it is an attribute of a result, unless it is None.
    always_in_key : bool
        Whether the key of a case includes it even if it has its default value. This must be False for a new setting, so
        that the keys of existing cases do not change. It has no effect in ``[surface]``, whose keys
        count but for those of ``_LATER`` in :mod:`roughvisc.study.statement.identity`.
    only_over : str
        Name of the axis whose experiments have it; empty: all experiments.
    check : callable, optional
        For values that are neither one of a few words nor a number: returns the value to store, or raises.
    """

    about: str
    example: str
    table: str = "solve"
    bounds: Mapping[str, float] = field(default_factory=dict)
    noun: str = "a number"
    unit: str = "1"
    in_attributes: bool = False
    always_in_key: bool = False
    only_over: str = ""
    check: Callable[[Any], Any] | None = None


def setting(default: Any, about: str, example: str, **said: Any) -> Any:
    """A field of :class:`Settings` with its entry; see :class:`Entry`."""
    return field(default=default, metadata={_ENTRY: Entry(about=about, example=example, **said)})


def _refusal(name: str, found: Any, expected: str) -> InputError:
    return InputError(f"{name} is {found!r}: expected {expected}")


def _times(value: Any) -> int | tuple[float, ...] | None:
    if value is None:
        return None
    wanted = "a positive count, a list, or None"
    if isinstance(value, int | np.integer):
        if not 1 <= value <= MOST_TIMES:
            raise _refusal("times", int(value), f"{wanted}; at most {MOST_TIMES} times")
        return int(value)
    try:
        numbers = in_si(value, "s", "times")
    except InputError as error:
        raise InputError(f"{error}; times may be {wanted}") from None
    try:
        return tuple(np.unique(np.asarray(numbers, dtype=float)).tolist())
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


@dataclass(frozen=True, kw_only=True)
class Numerics:
    """Settings of a solve that are rarely changed.

    Parameters
    ----------
    time_step : "auto" or float or str
        Steps chosen by the tolerance, or a fixed step length. [s]

    Raises
    ------
    InputError
        If a value is none of those expected.

    Examples
    --------
    >>> Numerics(time_step="10 ms")
    Numerics(time_step=0.01)
    """

    time_step: TimeStep = setting(
        "auto",
        "steps chosen by the tolerance, or a fixed length",
        '"10 ms"',
        bounds={"above": 0},
        noun="a time",
        unit="s",
        always_in_key=True,
        only_over="time",
    )

    def __post_init__(self) -> None:
        for one in fields(self):
            object.__setattr__(self, one.name, _checked(one.name, ENTRIES[one.name], getattr(self, one.name)))


@dataclass(frozen=True, kw_only=True)
class Settings(Numerics):
    """How an experiment is computed and what is stored; see :func:`roughvisc.simulate`.

    The defaults of :func:`roughvisc.simulate` and of the tables of a study file are declared only here.

    Parameters
    ----------
    boundary, tolerance, times, fields, missing, edge, grid_error
        As :func:`roughvisc.simulate` has them; any sequence of times or fields becomes a tuple.
    time_step
        As :class:`Numerics` has them.

    Raises
    ------
    InputError
        If a value is none of those expected. What depends on the program or on the surface is refused where these
        meet, in :func:`roughvisc.experiment.scene.build_scene`.

    Examples
    --------
    >>> Settings(tolerance=1e-2, times=[1.0, 0.5]).times
    (0.5, 1.0)
    >>> Settings().to_attributes()
    {'boundary': 'auto', 'tolerance': 0.001}
    """

    boundary: Boundary = setting(
        "auto",
        "free space, for an indenter; periodic or mirror, for a nominally flat scan that repeats as it is or with its "
        "mirror images; auto: the one that the surface was made for",
        '"mirror"',
        in_attributes=True,
        always_in_key=True,
    )
    tolerance: float = setting(
        1e-3,
        "largest stated error of force, approach and pressure, relative to the largest so far",
        "1e-2",
        bounds={"least": FINEST_TOLERANCE, "below": 1},
        in_attributes=True,
        always_in_key=True,
    )
    times: int | Sequence[float | str] | None = setting(
        None,
        "times in the result: all steps, a number of times (denser after each corner), or a list",
        "50",
        table="keep",
        always_in_key=True,
        only_over="time",
        check=_times,
    )
    fields: Sequence[str] = setting(
        ("pressure", "gap"),
        "fields in the result",
        '["pressure", "gap"]',
        table="keep",
        always_in_key=True,
        check=_fields,
    )
    missing: Missing = setting(
        "refuse",
        "whether missing points are refused, or mark places without material",
        '"absent"',
        table="surface",
        only_over="time",
    )
    edge: Edge = setting(
        "error",
        "whether contact may reach the border in free space: the scan outline is then treated as a punch",
        '"accept"',
        always_in_key=True,
        only_over="time",
    )
    grid_error: bool = setting(False, "whether to estimate the grid error, with two more runs on coarser grids", "true")

    def to_attributes(self) -> dict[str, Any]:
        """Those that stand in the attributes of a result."""
        values = {name: getattr(self, name) for name, entry in ENTRIES.items() if entry.in_attributes}
        return {name: value for name, value in values.items() if value is not None}


#: setting -> what is said of it
ENTRIES: dict[str, Entry] = {one.name: one.metadata[_ENTRY] for one in fields(Settings) if _ENTRY in one.metadata}
_KINDS = get_type_hints(Settings)
#: setting -> the words that it may be, of those that are one of a few words
WORDS: dict[str, tuple[str, ...]] = {
    name: get_args(kind) for name, kind in _KINDS.items() if get_origin(kind) is Literal
}
#: setting -> the word that it may be in place of a number
WORD_OR_NUMBER: dict[str, str] = {
    name: get_args(word)[0]
    for name, kind in _KINDS.items()
    for word in get_args(kind)
    if float in get_args(kind) and get_origin(word) is Literal
}


#: What is said of ``auto`` where nothing tells the boundary, as a study file has it; in Python ``=`` has no spaces.
OPEN_BOUNDARY = """\
is 'auto', the default, and the surface does not tell what lies beyond its border: expected one of
  a nominally flat scan that stands for a larger surface: boundary = "mirror"; boundary = "periodic" if it \
repeats as it is
  an indenter or a single bump whose contact stays inside: boundary = "free"
  a scan that is itself the whole body: boundary = "free" with edge = "accept\""""


def known_boundary(
    stated: Any, only: Literal["free", "periodic"] | None, made_for: Callable[[], Literal["free", "periodic"] | None]
) -> Literal["free", "periodic", "mirror"] | None:
    """Boundary of a solve: the one that is stated, or what ``auto`` stands for; None where it has to be stated.

    Parameters
    ----------
    stated : Settings, or anything with ``boundary`` and ``edge``
        An edge that is accepted is one in free space.
    only : {"free", "periodic"} or None
        The one that the experiment has, if it has but one.
    made_for : callable
        Gives the one that the surface was made for, or None; asked last.
    """
    if stated.boundary != "auto":
        return stated.boundary
    return only or ("free" if stated.edge == "accept" else made_for())


def _checked(name: str, entry: Entry, value: Any) -> Any:
    """A value as it is kept, if it is one of those expected."""
    if entry.check is not None:
        return entry.check(value)
    if name in WORDS:
        if value not in WORDS[name]:
            raise _refusal(name, value, " or ".join(map(repr, WORDS[name])))
        return value
    if _KINDS[name] is bool:
        return bool(value)
    word = WORD_OR_NUMBER.get(name)
    if isinstance(value, str) and value == word:
        return value
    if isinstance(value, str) and entry.unit != "1":
        try:
            value = quantity(value, entry.unit, name)
        except InputError as error:
            raise InputError(f"{error}; or {word!r}" if word else str(error)) from None
    if not (isinstance(value, int | float) and math.isfinite(value) and within(value, **entry.bounds)):
        wanted = f"{entry.noun}{range_in_words(**entry.bounds)}" + (f" [{entry.unit}]" if entry.unit != "1" else "")
        raise _refusal(name, value, wanted if word is None else f"{word!r} or {wanted}")
    return float(value)
