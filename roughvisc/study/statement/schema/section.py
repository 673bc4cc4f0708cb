"""The base of every table of a study file: nothing unknown gets in, and every problem is one sentence."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from roughvisc.errors import InputError
from roughvisc.study.statement.schema.entries import shown

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
