"""The tables of a study file: nothing unknown gets in, and every problem is one sentence.

Each kind of value has its check, and words for what is expected.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    WrapValidator,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from roughvisc.errors import InputError
from roughvisc.units import number, range_in_words, shown, wanted_quantity, within


@dataclass(frozen=True)
class Unit:
    """What a kind says of its values beside their check: the SI unit; ``"1"`` of pure numbers."""

    symbol: str


def kind(values: Any, check: Callable[..., Any], wanted: str, schema: Any = None, *marks: Any) -> Any:
    """Kind of value that a key may have.

    Parameters
    ----------
    values : type
        What the check makes of a value.
    check : callable
        Gives the value as it is kept, or raises :class:`InputError`.
    wanted : str
        What is expected, in words.
    schema : dict, optional
        Its JSON schema. Default: that of the type.
    *marks : Unit
        What else is to be known of it.
    """
    shape = () if schema is None else (WithJsonSchema(schema),)
    return Annotated[(values, BeforeValidator(check), *shape, Field(description=wanted), *marks)]


def validate(kind: Any, value: Any) -> Any:
    """The value as the check of a kind leaves it."""
    return kind.__metadata__[0].func(value)


def nullable(kind: Any) -> Any:
    """Kind: the same, or nothing; without a union, whose errors name branches that no user knows of."""
    return Annotated[kind, WrapValidator(lambda value, check: None if value is None else check(value))]


def measured(
    unit: str, *, instead: Mapping[str, str] | None = None, difference: bool = False, **bounds: float | None
) -> Any:
    """Kind: a quantity in SI as a float, from a number or a string with a unit; ``unit="1"`` is a pure number.

    Values are rounded to 15 significant digits, so that ``"10 um"`` and ``1e-5`` are the same to the last bit. All else
    is as :func:`roughvisc.units.number` has it.
    """

    def check(value: Any) -> float:
        found = number(value, unit, instead=instead, difference=difference, **bounds)
        return float(f"{found:.15g}") + 0.0  # no negative zero

    schema = {"type": "number" if unit == "1" else ["number", "string"]}
    return kind(float, check, wanted_quantity(unit, **bounds), schema, Unit(unit))


def literal_or(word: str, quantity: Any, wanted: str) -> Any:
    """Kind: a word, or a quantity of another kind."""

    def check(value: Any) -> Any:
        if value == word:
            return value
        try:
            return validate(quantity, value)
        except InputError:
            raise InputError(f"found {shown(value)}: expected {wanted}") from None

    units = [one for one in quantity.__metadata__ if isinstance(one, Unit)]
    return kind(Any, check, wanted, {"type": ["number", "string"]}, *units)


def whole(least: int, most: int | None = None) -> Any:
    """Kind: a whole number; ``true`` and ``2.0`` are none."""
    wanted = f"a whole number{range_in_words(least=least, most=most)}"

    def check(value: Any) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not within(value, least=least, most=most):
            raise InputError(f"found {shown(value)}: expected {wanted}")
        return int(value)

    schema = {"type": "integer", "minimum": least} | ({} if most is None else {"maximum": most})
    return kind(int, check, wanted, schema)


def a_list(value: Any, wanted: str, count: int | None = None) -> list[Any]:
    """The value if it is a list (of so many entries); a string, which Python would iterate, is none."""
    if not isinstance(value, list | tuple) or (count is not None and len(value) != count):
        raise InputError(f"found {shown(value)}: expected {wanted}")
    return list(value)


def listed(entry: Any, name: str) -> Any:
    """Kind: a list of any length; ``name`` says of what."""
    wanted = f"a list of {name}"
    return kind(tuple[entry, ...], lambda value: a_list(value, wanted), wanted)


def paired(entry: Any, name: str) -> Any:
    """Kind: a list of two, along x and along y, or one for both; ``name`` says of what."""
    wanted = f"{name}, or a list of two, along x and along y"

    def spread(value: Any) -> Any:
        if isinstance(value, list | tuple):
            return a_list(value, wanted, 2)
        validate(entry, value)  # so that a problem is told of the value that was written
        return (value, value)

    return kind(tuple[entry, entry], spread, wanted)


def choice(*words: str) -> Any:
    """Kind: one of a few words."""
    wanted = " or ".join(repr(word) for word in words)

    def check(value: Any) -> Any:
        if value not in words:
            hint = close(value, words) if isinstance(value, str) else ""
            raise InputError(f"found {shown(value)}: expected {wanted}{hint}")
        return value

    return kind(str, check, wanted, {"enum": list(words)})


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


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"found {shown(value)}: expected true or false")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise InputError(f"found {shown(value)}: expected a text")
    return value


FilePath = kind(str, located, "the path of a file, relative to the study", {"type": "string"})
Flag = kind(bool, _flag, "true or false")
Text = kind(str, _text, "a text")

_OURS = "problem"


class Section(BaseModel):
    """A table of a study file: frozen, no unknown keys, messages that say what was found and what was expected."""

    model_config = ConfigDict(extra="forbid", frozen=True, ser_json_inf_nan="constants")

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: Callable[[Any], Any]) -> Any:
        if not isinstance(data, Mapping | cls):
            raise InputError(f"found {shown(data)}: expected a table")
        try:
            return handler(data)
        except ValidationError as error:
            raise ValidationError.from_exception_data(
                cls.__name__, [_problem(_sentence(cls, e), e["loc"], e["input"]) for e in error.errors()]
            ) from None


def one_of(
    base: type[Section],
    sections: Iterable[type[Section]],
    make: Callable[[Any, ValidationInfo], Any],
    table: str,
    wanted: str,
) -> Any:
    """Kind: one of several tables, told by what they hold.

    Parameters
    ----------
    base : type of Section
        What the tables have in common: one that is made already stays.
    sections : iterable of type of Section
        The tables.
    make : callable
        Makes one of a dict.
    table, wanted : str
        What is expected in place of something that is no table, and of the key.
    """

    def check(data: Any, _: Any, info: ValidationInfo) -> Any:
        if isinstance(data, base):
            return data
        if not isinstance(data, dict):
            raise InputError(f"found {shown(data)}: expected {table}")
        return make(data, info)

    return Annotated[reduce(or_, sections), WrapValidator(check), Field(description=wanted)]


def _problem(sentence: str, loc: tuple[int | str, ...], found: Any = None) -> InitErrorDetails:
    return InitErrorDetails(type=PydanticCustomError(_OURS, "{sentence}", {"sentence": sentence}), loc=loc, input=found)


def refuse(key: str, sentence: str) -> ValidationError:
    """The error to raise for one key of the table being checked."""
    return ValidationError.from_exception_data("study", [_problem(sentence, (key,))])


def of_file(path: str, columns: Mapping[str, str], error: ValidationError, key: str = "") -> ValidationError:
    """The problems of a table whose columns were read from a file: those of columns, and of the whole, are the file's.

    ``columns`` are keys and their names in the file, ``key`` is the one that names the file. Rows count from 0, as they
    do where a row is named elsewhere.
    """
    told = []
    for one in error.errors():
        loc = one["loc"]
        sentence = str(one["ctx"]["error"]) if one["type"] == "value_error" else one["msg"]
        if loc and loc[0] in columns:
            row = f", table row {loc[1]}" if len(loc) > 1 else ""
            sentence = f"{columns[str(loc[0])]}{row}: {sentence}"
        if not loc or loc[0] in columns:
            loc, sentence = (key,) if key else (), f"{path}: {sentence}"
        told.append(_problem(sentence, loc, one["input"]))
    return ValidationError.from_exception_data("study", told)


def close(word: str, known: Iterable[str]) -> str:
    """``"; did you mean 'load'?"``, empty where nothing comes near."""
    near = difflib.get_close_matches(str(word), list(known), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def nearest(word: str, known: Iterable[str]) -> str:
    """The word that is likely meant, or the list of all that are known where nothing comes near."""
    known = list(known)
    return close(word, known) or f": expected one of {', '.join(known)}"


def _sentence(cls: type[Section], error: Any) -> str:
    """One problem as pydantic sees it, in the words of a study file."""
    kind, loc, message = error["type"], error["loc"], error["msg"]
    if kind == _OURS:
        return str(message)
    if kind == "value_error":
        return str(error["ctx"]["error"])
    if kind == "extra_forbidden":
        return "unknown key" + nearest(loc[-1], cls.model_fields)
    field = cls.model_fields.get(str(loc[0])) if loc else None
    wanted = field.description if field is not None and len(loc) == 1 else None
    if kind == "missing":
        return "missing: expected " + (wanted or "a value")
    return f"found {shown(error['input'])}: " + (
        f"expected {wanted}" if wanted else message.replace("Input should be", "expected")
    )
