"""Calls of functions with tables of arguments, as study files and surface cards contain them.

The signature of a function defines the keys of its table and their types. The function itself checks the values. Errors
name the key, the value and the valid values.
"""

from __future__ import annotations

import dataclasses
import difflib
import inspect
import re
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache, partial
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from roughvisc.errors import InputError, short_repr


class DataNeeded(Exception):
    """Signal that a function has checked its other arguments and needs data, which are absent."""


class NoData:
    """Placeholder for data, with which a function checks its other arguments only.

    Any access to it raises :class:`DataNeeded`.
    """

    def __getattr__(self, name: Any) -> Any:
        raise DataNeeded(name)

    __getitem__ = __contains__ = __getattr__


def call(function: Callable[..., Any], where: str, table: Mapping[str, Any], *first: Any) -> Any:
    """Call a function with the entries of a table as keyword arguments.

    Parameters
    ----------
    function : callable
        Function, or a dataclass.
    where : str
        Dotted name of the table, for messages.
    table : mapping
        Argument -> value, with the types of TOML.
    *first : object
        First arguments, which are not in the table.

    Raises
    ------
    InputError
        If a key of the table is unknown or a required one is missing, a value has another type, or the function refuses
        a value. The key of the error begins with `where`.
    """
    check_keys(function, where, table, len(first))
    try:
        return function(*first, **table)
    except InputError as error:
        if error.key in list(inspect.signature(function).parameters)[: len(first)]:
            raise located(InputError(found=error.found, expected=error.expected), where) from error
        raise located(error, where) from error


def check_keys(function: Callable[..., Any], where: str, table: Mapping[str, Any], skipped: int = 0) -> None:
    """Check the keys of a table, and the types of its values, by the signature of a function.

    Parameters
    ----------
    function, where, table
        As in :func:`call`.
    skipped : int
        Number of first arguments that are not in the table.
    """
    known = arguments(function, skipped)
    refuse_unknown(where, table, known)
    for key, (hint, default) in known.items():
        if (key not in table and default is not inspect.Parameter.empty) or (key in table and suits(table[key], hint)):
            continue
        name = dotted(where, key)
        expected = in_words(hint, units_of(function).get(key, "1"))
        if key not in table:
            raise InputError(f"{name}: missing: expected {expected}", key=name, expected=expected)
        raise InputError(key=name, found=table[key], expected=expected)


def check(function: Callable[..., Any], where: str, table: Mapping[str, Any], data: int = 1) -> None:
    """Check the arguments of a function whose first arguments are data, without the data.

    Parameters
    ----------
    function : callable
        Function that checks its other arguments before it uses the data.
    where, table
        As in :func:`call`.
    data : int
        Number of first arguments that are data.
    """
    with suppress(DataNeeded):
        call(function, where, table, *[NoData()] * data)


@cache
def arguments(function: Callable[..., Any], skipped: int = 0) -> dict[str, tuple[Any, Any]]:
    """Return type and default of each argument of a function, without the first ones and fields outside the repr."""
    hints = get_type_hints(function)
    parameters = list(inspect.signature(function).parameters.values())[skipped:]
    stated = dataclasses.fields(function) if dataclasses.is_dataclass(function) else ()
    hidden = {parameter.name for parameter in stated if not parameter.repr}
    return {
        parameter.name: (hints.get(parameter.name, Any), parameter.default)
        for parameter in parameters
        if parameter.name not in hidden
    }


@cache
def units_of(function: Callable[..., Any]) -> dict[str, str]:
    """Return the unit of each argument of a function that is a quantity; ``"1"`` for pure numbers.

    Examples
    --------
    >>> from roughvisc.mechanics.materials.models import maxwell
    >>> units_of(maxwell)["viscosity"], units_of(maxwell)["poisson"]
    ('Pa s', '1')
    """
    numbers = {name: "1" for name, (hint, _) in arguments(function).items() if float in (hint, *get_args(hint))}
    called = function.__init__ if isinstance(function, type) else function  # type: ignore[misc]
    return numbers | getattr(called, "quantities", {})


def refuse_unknown(where: str, table: Mapping[str, Any], known: Iterable[str]) -> None:
    """Refuse a table with an unknown key."""
    for key in table:
        if key not in known:
            name = dotted(where, key)
            expected = f"one of {', '.join(known)}" if known else "no key"
            raise InputError(f"{name}: unknown key{nearest(key, known)}", key=name, found=table[key], expected=expected)


def nearest(word: Any, known: Iterable[str], otherwise: str | None = None) -> str:
    """Return a suggestion for an unknown word; if no known word is similar, `otherwise` or all known words."""
    known = list(known)
    if near := difflib.get_close_matches(str(word), known, n=1):
        return f"; did you mean {near[0]!r}?"
    if otherwise is None:
        return f": expected one of {', '.join(known)}" if known else ": expected no key"
    return otherwise


def one_key(where: str, table: Mapping[str, Any], keys: Iterable[str]) -> str:
    """Return the only one of some keys in a table; refuse a table with none or several."""
    keys = list(keys)
    named = table.keys() & keys
    if len(named) != 1:
        expected = f"exactly one of {', '.join(keys)}"
        hint = "" if named else next(filter(None, (nearest(key, keys, "") for key in table)), "")
        message = f"{where}: found {short_repr(table)}: expected {expected}{hint}"
        raise InputError(message, key=where, found=table, expected=expected)
    return named.pop()


def one_of(key: str, value: Any, words: Iterable[Any]) -> Any:
    """Return the value if it is one of the allowed words; refuse it otherwise."""
    words = list(words)
    if value not in words:
        known = list(map(str, words))
        expected = f"one of {', '.join(known)}"
        hint = nearest(value, known) if isinstance(value, str) and value not in known else f": expected {expected}"
        raise InputError(f"{key}: found {short_repr(value)}{hint}", key=key, found=value, expected=expected)
    return value


def count(key: str, value: Any, least: int) -> int | None:
    """Return a whole number of at least `least`, or None; refuse any other value."""
    if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < least):
        raise InputError(key=key, found=value, expected=f"a whole number of at least {least}, or None")
    return value


def listed_names(value: Any) -> tuple[Any, ...]:
    """Return the names of a list of names; a text is one name, and any other value a wrong one."""
    return tuple(value) if isinstance(value, Iterable) and not isinstance(value, str) else (value,)


def a_table(where: str, value: Any) -> dict[str, Any]:
    """Return a copy of the value if it is a table; refuse it otherwise."""
    if not isinstance(value, Mapping):
        raise InputError(key=where, found=value, expected="a table")
    return dict(value)


def split(table: Mapping[str, Any], *names: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the entries of a table under some keys, and all others."""
    chosen: dict[str, Any] = {}
    rest: dict[str, Any] = {}
    for key, value in table.items():
        (chosen if key in names else rest)[key] = value
    return chosen, rest


def located(error: InputError, where: str) -> InputError:
    """Convert an error about an argument to an error about a key of a table."""
    key = re.sub(r"\[(\d+)\]", r".\1", dotted(where, error.key))
    text = str(error)
    message = f"{key}{text[len(error.key) :]}" if error.key and text.startswith(f"{error.key}: ") else f"{key}: {text}"
    expected = error.expected or text.rpartition("expected ")[2]
    return type(error)(message, key=key, found=error.found, expected=expected, transient=error.transient)


def dotted(*names: str) -> str:
    """Join the names of tables and keys by dots; empty names are left out."""
    return ".".join(filter(None, names))


def suits(value: Any, hint: Any) -> bool:
    """Return whether a TOML value has the type of an argument.

    Examples
    --------
    >>> suits(2, float | None), suits(True, float), suits("2 m", float | str), suits([1, 2], tuple[float, float])
    (True, False, True, True)
    """
    kind = get_origin(hint)
    inner = get_args(hint)
    if kind in (Union, types.UnionType):
        return any(map(partial(suits, value), inner))
    if kind is Literal:
        return any(value == word and isinstance(value, type(word)) for word in inner)
    if kind in (tuple, Sequence):
        if not isinstance(value, list | tuple):
            return False
        hints = inner if kind is tuple and ... not in inner else inner[:1] * len(value)
        return len(value) == len(hints) and all(map(suits, value, hints))
    if hint in (float, int):
        return isinstance(value, (int, float) if hint is float else int) and not isinstance(value, bool)
    is_plain = hint is not Any and isinstance(hint, type) and not getattr(hint, "_is_protocol", False)
    return isinstance(value, hint) if is_plain else True


def in_words(hint: Any, unit: str = "1") -> str:
    """Return the type of an argument in words.

    Parameters
    ----------
    hint : type
        Annotation of the argument.
    unit : str
        Its unit; ``"1"`` if it has none.

    Examples
    --------
    >>> in_words(float | str | None, "Pa"), in_words(Literal["x", "y"]), in_words(Sequence[float])
    ('a number [Pa], or text with a unit', "'x' or 'y'", 'a list')
    """
    kind = get_origin(hint)
    inner = [choice for choice in get_args(hint) if choice is not type(None)]
    if kind is Literal:
        return " or ".join(map(repr, inner))
    if kind in (Union, types.UnionType):
        if {float, str} <= set(inner) and unit != "1":
            others = [in_words(choice) for choice in inner if choice not in (float, str)]
            return " or ".join([f"a number [{unit}], or text with a unit", *others])
        return " or ".join(dict.fromkeys(map(in_words, inner)))
    named = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
    return (named | {tuple: "a list", Sequence: "a list"}).get(kind or hint, "a value")
