"""Kinds of value that a study file may hold, each with its check and the words for what is expected."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema, WrapValidator

from roughvisc.errors import InputError
from roughvisc.units import bounded_quantity, range_in_words, shown, wanted_quantity

Check = Callable[[Any], Any]


@dataclass(frozen=True)
class Unit:
    """What a kind says of its values beside their check: the SI unit; ``"1"`` of pure numbers."""

    symbol: str


def measured(
    unit: str,
    *,
    above: float | None = None,
    least: float | None = None,
    most: float | None = None,
    below: float | None = None,
    instead: Mapping[str, str] | None = None,
    difference: bool = False,
) -> Any:
    """Kind: a quantity in SI as a float, from a number or a string with a unit; ``unit="1"`` is a pure number.

    Values are rounded to 15 significant digits, so that ``"10 um"`` and ``1e-5`` are the same to the last bit.
    ``instead`` are keys to suggest for quantities of other units; ``difference``: it is one of temperatures.
    """
    wanted = wanted_quantity(unit, above, least, most, below)

    def check(value: Any) -> float:
        bounds = {"above": above, "least": least, "most": most, "below": below}
        number = bounded_quantity(value, unit, **bounds, instead=instead, difference=difference)
        return float(f"{number:.15g}") + 0.0  # no negative zero

    schema = {"type": "number"} if unit == "1" else {"type": ["number", "string"]}
    return Annotated[float, BeforeValidator(check), WithJsonSchema(schema), Field(description=wanted), Unit(unit)]


def validate(kind: Any, value: Any) -> Any:
    """The value as the check of a kind leaves it."""
    return kind.__metadata__[0].func(value)


def literal_or(word: str, kind: Any, wanted: str) -> Any:
    """Kind: a word, or a quantity of another kind."""

    def check(value: Any) -> Any:
        if value == word:
            return value
        try:
            return validate(kind, value)
        except InputError:
            raise InputError(f"found {shown(value)}: expected {wanted}") from None

    units = [one for one in kind.__metadata__ if isinstance(one, Unit)]
    schema = WithJsonSchema({"type": ["number", "string"]})
    return Annotated[Any, BeforeValidator(check), schema, Field(description=wanted), *units]


def whole(least: int, most: int | None = None) -> Any:
    """Kind: a whole number; ``true`` and ``2.0`` are none."""
    wanted = f"a whole number{range_in_words(None, least, most, None)}"

    def check(value: Any) -> int:
        good = isinstance(value, int) and not isinstance(value, bool)
        if not good or value < least or (most is not None and value > most):
            raise InputError(f"found {shown(value)}: expected {wanted}")
        return int(value)

    schema: dict[str, Any] = {"type": "integer", "minimum": least} | ({} if most is None else {"maximum": most})
    return Annotated[int, BeforeValidator(check), WithJsonSchema(schema), Field(description=wanted)]


def a_list(value: Any, wanted: str, count: int | None = None) -> list[Any]:
    """The value if it is a list (of so many entries); a string, which Python would iterate, is none."""
    if not isinstance(value, list | tuple) or (count is not None and len(value) != count):
        raise InputError(f"found {shown(value)}: expected {wanted}")
    return list(value)


def listed(kind: Any, name: str) -> Any:
    """Kind: a list of any length; ``name`` says of what."""
    wanted = f"a list of {name}"
    return Annotated[tuple[kind, ...], BeforeValidator(lambda v: a_list(v, wanted)), Field(description=wanted)]


def paired(kind: Any, name: str) -> Any:
    """Kind: a list of two, along x and along y, or one for both; ``name`` says of what."""
    wanted = f"{name}, or a list of two, along x and along y"

    def spread(value: Any) -> Any:
        if isinstance(value, list | tuple):
            return a_list(value, wanted, 2)
        validate(kind, value)  # so that a problem is told of the value that was written
        return (value, value)

    return Annotated[tuple[kind, kind], BeforeValidator(spread), Field(description=wanted)]


def located(value: Any, info: ValidationInfo) -> str:
    """Absolute path of a file named relative to the study, which must exist while a study is being read."""
    if not isinstance(value, str | Path) or not str(value):
        raise InputError(f"found {shown(value)}: expected the path of a file")
    folder = (info.context or {}).get("folder")
    if folder is None:  # a stored case: its file may be elsewhere today, and is missed when it is opened
        return str(value)
    path = (Path(folder) / Path(value).expanduser()).resolve()
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "does not exist"
        raise InputError(f"found {shown(str(value))}, which {what}: expected a file ({path})")
    return str(path)


FilePath = Annotated[
    str,
    BeforeValidator(located),
    WithJsonSchema({"type": "string"}),
    Field(description="the path of a file, relative to the study"),
]


def flag(value: Any) -> bool:
    """``true`` or ``false`` and nothing else."""
    if not isinstance(value, bool):
        raise InputError(f"found {shown(value)}: expected true or false")
    return value


Flag = Annotated[bool, BeforeValidator(flag), Field(description="true or false")]


def nullable(kind: Any) -> Any:
    """Kind: the same, or nothing; without a union, whose errors name branches that no user knows of."""
    return Annotated[kind, WrapValidator(lambda value, check: None if value is None else check(value))]


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise InputError(f"found {shown(value)}: expected a text")
    return value


Text = Annotated[str, BeforeValidator(_text), Field(description="a text")]


def choice(*words: str) -> Any:
    """Kind: one of a few words."""
    wanted = " or ".join(repr(word) for word in words)

    def check(value: Any) -> Any:
        if value not in words:
            hint = difflib.get_close_matches(value, words, n=1) if isinstance(value, str) else []
            raise InputError(
                f"found {shown(value)}: expected {wanted}" + (f"; did you mean {hint[0]!r}?" if hint else "")
            )
        return value

    return Annotated[str, BeforeValidator(check), WithJsonSchema({"enum": list(words)}), Field(description=wanted)]
