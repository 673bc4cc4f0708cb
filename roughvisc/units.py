"""Quantities with units: conversion of text such as "5 mN" to floats in SI, and of floats to readable text.

Study files and surface cards have ``"10 um"`` or ``"0.1 MPa s"``; the package computes with floats in SI. Figures,
tables and reprs choose one :class:`Unit` with a suitable prefix for all values that they show together.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Set
from contextlib import suppress
from dataclasses import dataclass
from functools import wraps
from inspect import signature
from numbers import Real
from operator import ge, gt, le, lt
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError, short_repr

if TYPE_CHECKING:
    # mypy cannot express that the decorator converts text: inside a function a quantity has the type of a number
    Quantity = float | Any
else:
    #: An argument that :func:`quantities` converts: a number in SI, or text with a unit.
    Quantity = float | str

_Taking = TypeVar("_Taking", bound=Callable[..., Any])

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_FACTOR = r"[^\W\d_]+(?:_[^\W\d_]+)*(?:\s*(?:\^|\*\*)\s*[+-]?\d(?:\.\d)?|[²³]|-?[1-4])?"
# A grammar in front of pint: pint evaluates arithmetic, and "9**9**9**9 m" would not end.
_PRODUCT = rf"{_FACTOR}(?:(?:\s*[*/·]\s*|\s+){_FACTOR})*"
# in "0.31/MPa" the number is 0.31: the 1 of an inverse unit has to be separated by a blank
_INVERSE = rf"(?:(?<=\s)1\s*)?/\s*(?:{_FACTOR}|\({_PRODUCT}\))"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(%|{_PRODUCT}|{_INVERSE})?\s*")
# pint counts angles as pure numbers, but a slope of 45 degrees is 1 and not 0.785
_ANGLES = {"degree", "radian", "turn", "grade", "arcminute", "arcsecond", "gradian"}


_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
#: Power of ten of each prefix in text, with both signs for micro; and the units that take a prefix unambiguously.
_POWERS = {prefix: power for power, prefix in _PREFIXES.items()} | {"u": -6, "\N{GREEK SMALL LETTER MU}": -6}
_WITH_PREFIX = frozenset({"m", "N", "Pa", "s"})
_CLOCK = ((2 * 86400.0, 86400.0, "d"), (2 * 3600.0, 3600.0, "h"))
_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def number(
    value: Any,
    unit: str,
    key: str = "",
    *,
    above: float | None = None,
    least: float | None = None,
    most: float | None = None,
    below: float | None = None,
    difference: bool = False,
) -> float:
    """Return a quantity as a number in a given unit.

    Parameters
    ----------
    value : str or float
        A number in `unit`, also a scalar of NumPy or xarray; or text of a number and a unit, such as ``"10 um"``,
        ``"0.1 MPa s"`` or ``"3 N/m^2"``.
    unit : str
        Unit of the result, such as ``"m"``, ``"Pa s"`` or ``"1"`` for a pure number.
    key : str, optional
        Name of the quantity in messages: a key of a study file, or a parameter.
    above, least, most, below : float, optional
        Bounds, of which `above` and `below` are excluded. [unit]
    difference : bool
        Whether the quantity is a difference of temperatures, so that degrees Celsius, which count from 273.15 K, are
        refused.

    Returns
    -------
    float
        The value in `unit`, finite. Text is rounded to 15 significant digits, because conversions leave noise in the
        last one (``"10 um"`` would be 9.999999999999999e-06 m).

    Raises
    ------
    InputError
        If the value is not a finite number or a quantity, its unit is unknown or of another dimension, or it is outside
        the bounds.

    Examples
    --------
    >>> number("10 um", "m"), number("0.1 MPa s", "Pa s"), number(2, "N")
    (1e-05, 100000.0, 2.0)
    >>> number("25 degC", "K"), number("25 °C", "K")
    (298.15, 298.15)
    >>> number("0.3 1/MPa", "1/Pa"), number("0.31/MPa", "1/Pa"), number("2 1/(kPa s)", "1/(Pa s)")
    (3e-07, 3.1e-07, 0.002)
    >>> number("-5 mN", "N", "load", above=0)  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    InputError: load: found '-5 mN': expected a number [N], or text with a unit, above 0
    """
    if getattr(value, "shape", None) == ():
        value = value.item()
    magnitude = math.nan
    problem = ""
    if isinstance(value, str):
        try:
            magnitude = _parsed(value, unit, difference)
        except ValueError as error:
            problem = f", {error}"
    elif isinstance(value, Real) and not isinstance(value, bool):
        with suppress(OverflowError):  # an integer of hundreds of digits
            magnitude = float(value)
    is_within = math.isfinite(magnitude) and not (
        above == 0 and magnitude < sys.float_info.min
    )  # its reciprocal overflows
    words = []
    bounds = (("above", gt, above), ("at least", ge, least), ("up to", le, most), ("below", lt, below))
    for word, compare, limit in bounds:
        if limit is not None:
            is_within = is_within and compare(magnitude, limit)
            has_unit = limit != 0 and unit not in ("", "1")
            words.append(f"{word} {format_quantity(limit, unit) if has_unit else f'{limit:g}'}")
    if is_within:
        return magnitude
    kind = "a number" if unit in ("", "1") else f"a number [{unit}], or text with a unit,"
    expected = f"{kind} {' and '.join(words)}" if words else kind.rstrip(",")
    named = f"{key}: " if key else ""
    raise InputError(
        f"{named}found {short_repr(value)}{problem}: expected {expected}", key=key, found=value, expected=expected
    )


def in_si(value: Any, unit: str, name: str) -> Any:
    """Convert text in a value to numbers in SI; anything else stays unchanged.

    Parameters
    ----------
    value : Any
        A number or text; or a list, tuple or dictionary of such values.
    unit : str
        Unit of the numbers.
    name : str
        Name of the value in messages.

    Raises
    ------
    InputError
        As for :func:`number`, for the first text that is not a quantity of this unit.

    Examples
    --------
    >>> in_si(("1 mm", 2.0), "m", "size"), in_si(None, "m", "size")
    ((0.001, 2.0), None)
    """
    if isinstance(value, str):
        return number(value, unit, name)
    if isinstance(value, Mapping):
        return {key: in_si(inner, unit, f"{name}[{key!r}]") for key, inner in value.items()}
    if not isinstance(value, list | tuple) or {str, np.str_, list, tuple}.isdisjoint(map(type, value)):
        return value
    return type(value)([in_si(inner, unit, f"{name}[{place}]") for place, inner in enumerate(value)])


def listed(value: Any, unit: str, key: str, otherwise: str = "") -> NDArray[np.float64]:
    """Return the quantities of a list, or of one text with a unit, as an array of numbers.

    A bare number is refused: it could also be a number of rows.

    Parameters
    ----------
    value : Any
        List or array of numbers and texts, or one text.
    unit : str
        Unit of the result.
    key : str
        Name of the list in messages.
    otherwise : str
        Meaning of a bare whole number, for the message.

    Raises
    ------
    InputError
        If the value is a bare number or nothing of this kind, or an entry is not a quantity of this unit.

    Examples
    --------
    >>> listed([0, "5 ms"], "s", "times", "a whole number counts rows")
    array([0.   , 0.005])
    """
    plain = np.asarray(value).tolist() if hasattr(value, "dtype") else value
    if isinstance(plain, str):
        return np.array([number(plain, unit, key)])
    if not isinstance(plain, Iterable) or isinstance(plain, Mapping | Set | bytes):
        pure = unit in ("", "1")
        expected = "a list of numbers" if pure else f"a list [{unit}], or text with a unit"
        if isinstance(plain, Real) and not isinstance(plain, bool):
            expected = f"[{plain:g}]" if pure else f"[{plain:g}] or '{plain:g} {unit}'"
        raise InputError(key=key, found=value, expected="; ".join(filter(None, (expected, otherwise))))
    entries = list(plain)
    if {float, int}.issuperset(map(type, entries)):
        return np.array(entries, dtype=float)
    return np.array([number(entry, unit, f"{key}[{place}]") for place, entry in enumerate(entries)])


def quantities(**units: str) -> Callable[[_Taking], _Taking]:
    """Decorate a function or a dataclass whose named arguments are numbers in SI or text with a unit.

    Text is converted before the call. An argument whose unit is followed by ``> 0`` or ``>= 0`` is one such number, or
    None if that is its default; one whose unit is followed by ``...`` is a list of numbers.
    Other values are passed on unchanged. Wrong names of arguments are refused with the name of the function.

    Parameters
    ----------
    **units : str
        Name of the argument -> its unit, as for :func:`number`.

    Examples
    --------
    >>> @quantities(radius="m > 0")
    ... def area(radius):
    ...     return 3.0 * radius**2
    >>> area("10 mm") == area(0.01)
    True
    >>> area("2 s")  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    InputError: radius: found '2 s', in second: expected a number [m], or text with a unit, above 0
    """
    declared = {name: stated.removesuffix(" ...").partition(" >")[::2] for name, stated in units.items()}
    lists = {name for name, stated in units.items() if stated.endswith(" ...")}

    def decorate(function: Any) -> Any:
        if isinstance(function, type):
            function.__init__ = decorate(function.__init__)  # type: ignore[misc]
            return function
        taking = signature(function)
        owner = function.__qualname__.removesuffix(".__init__")

        @wraps(function)
        def called(*args: Any, **given: Any) -> Any:
            try:
                bound = taking.bind(*args, **given)
            except TypeError as error:
                unknown = [name for name in given if name not in taking.parameters]
                problem = f"unexpected argument {unknown[0]!r}" if unknown else str(error)
                names = ", ".join(name for name in taking.parameters if name != "self")
                raise TypeError(f"{owner}(): {problem}: expected {names}") from None
            for name in filter(bound.arguments.__contains__, declared):
                unit, limit = declared[name]
                value = bound.arguments[name]
                if name in lists:
                    numbers = listed(value, unit, name).tolist()
                    bound.arguments[name] = tuple(numbers) if isinstance(value, tuple) else numbers
                elif not limit or (value is None and taking.parameters[name].default is None):
                    bound.arguments[name] = in_si(value, unit, name)
                else:
                    bound.arguments[name] = (
                        number(value, unit, name, least=0.0) if limit == "= 0" else number(value, unit, name, above=0.0)
                    )
            return function(*bound.args, **bound.kwargs)

        called.quantities = {name: unit for name, (unit, _) in declared.items()}  # type: ignore[attr-defined]
        return called

    return decorate


def is_quantity(value: Any, unit: str) -> bool:
    """Return whether a value is a number, or text that converts to this unit."""
    try:
        number(value, unit)
    except InputError:
        return False
    return True


def _parsed(text: str, unit: str, difference: bool) -> float:
    """Return the value of a text in a unit; a :class:`ValueError` describes an invalid text."""
    matched = _QUANTITY.fullmatch(text.replace("°C", "degC").replace("°F", "degF")) if len(text) <= 100 else None
    if matched is None:
        raise ValueError("not a quantity")
    value = float(matched[1])
    unit_text = matched[2]
    dimensionless = unit in ("", "1")
    if unit_text is None:
        if dimensionless:
            return value
        raise ValueError(f"without a unit (such as {f'{matched[1]} {unit}'!r})")
    if (plain := _prefixed(matched[1], unit_text, unit)) is not None:
        return plain
    from pint import PintError, get_application_registry  # slow to import

    registry = get_application_registry()
    try:
        known = "percent" if unit_text == "%" else _written_powers(unit_text.replace("·", "*"))
        names = registry.parse_units_as_container(f"1{known}" if known.startswith("/") else known)
        given = registry.Unit(names)
        expected = registry.Unit("" if dimensionless else unit)
        if given.dimensionality != expected.dimensionality or (dimensionless and not _ANGLES.isdisjoint(names)):
            raise ValueError(f"in {given}")
        converted, begins = (
            float(registry.Quantity(magnitude, given).to(expected).magnitude) for magnitude in (value, 0.0)
        )
    # pint raises the last two for a unit to the power 0, and letters that are invalid in names
    except (PintError, KeyError, AssertionError) as error:
        raise ValueError(f"in an unknown unit {unit_text!r}") from error
    if difference and begins:
        raise ValueError(f"a temperature and not a difference of temperatures (such as {f'{value:g} K'!r})")
    return float(f"{converted:.15g}")


def _written_powers(unit: str) -> str:
    """Return a unit with the sign of each power: ``N/mm2`` is ``N/mm^2``."""
    return re.sub(r"(?<=[^\W\d_])(?=-?\d)", "^", unit)


def _prefixed(number: str, found: str, unit: str) -> float | None:
    """Return the value of a number if its unit is the expected unit with SI prefixes, otherwise None.

    Most quantities of a study are of this form, and the registry of pint takes 0.2 s to build. A number of at most 15
    digits equals the one of pint rounded to 15 digits.
    """
    expected = unit.split(" ")
    factors = found.split(" ")
    power = 0
    if len(expected) != len(factors) or not _WITH_PREFIX.issuperset(expected) or len(number) > 15:
        return None
    for name, wanted in zip(factors, expected, strict=True):
        prefix = name.removesuffix(wanted)
        if name == prefix or prefix not in _POWERS:
            return None
        power += _POWERS[prefix]
    mantissa, _, exponent = number.lower().partition("e")
    return float(f"{mantissa}e{int(exponent or 0) + power}")


@dataclass(frozen=True)
class Unit:
    """A unit to show values in: ``shown = values / factor``.

    Parameters
    ----------
    factor : float
        Size of the unit in SI.
    symbol : str
        How it is written; empty for a pure number.
    """

    factor: float
    symbol: str

    def __call__(self, values: ArrayLike) -> NDArray[np.float64]:
        """Return values [SI] in this unit."""
        return np.asarray(values, dtype=float) / self.factor

    def label(self, name: str) -> str:
        """Return an axis label: the name and, in brackets, the unit."""
        return f"{name} [{self.symbol}]" if self.symbol else name

    def text(self, value: float, digits: int = 3) -> str:
        """Return one value [SI] with its unit as text, for sentences."""
        shown = float(value) / self.factor
        if 1e3 <= abs(shown) < 1e6:  # not 5e+03
            return f"{shown:.0f} {self.symbol}".rstrip()
        return f"{shown:.{digits}g} {self.symbol}".rstrip()


def unit_for(values: ArrayLike, si: str) -> Unit:
    """Return the unit with the engineering prefix that suits the largest of some values.

    Parameters
    ----------
    values : array_like
        Values of one axis; missing and infinite values are ignored. [SI]
    si : str
        Their unit as the vocabulary writes it: ``"m"``, ``"Pa"``, ``"Pa s"``, ``"m^2"``, ``"N/m"``,
        ``"s"``, ``"1"``, ``"1/Pa"``.

    Returns
    -------
    Unit

    Examples
    --------
    >>> unit_for([0, 2.5e-6], "m").symbol, unit_for([3e-8], "m^2").symbol, unit_for([0.04, 2e6], "Pa").symbol
    ('µm', 'mm²', 'MPa')
    >>> unit_for([9000.0], "s")
    Unit(factor=3600.0, symbol='h')
    >>> unit_for([2e-7], "1/Pa").text(2e-7)
    '0.2 1/MPa'
    """
    size = np.abs(np.asarray(values, dtype=float))
    largest = float(np.max(size, initial=0.0, where=np.isfinite(size)))
    if si in ("1", ""):
        return Unit(1.0, "")
    if si.startswith("1/"):
        bare = si[2:].strip("()")
        inverse = unit_for([100 / largest if largest else 1.0], bare)  # shown from 0.1 to 100
        return Unit(1 / inverse.factor, "1/" + (f"({inverse.symbol})" if " " in inverse.symbol else inverse.symbol))
    if si == "s":
        for least, factor, symbol in _CLOCK:
            if largest >= least:
                return Unit(factor, symbol)
    head, _, tail = si.partition("/")
    name, _, exponent_of_name = head.partition("^")
    power = int(exponent_of_name or 1)
    least = 1.0 if power == 1 else 10.0**-power  # 0.05 mm² reads better than 50000 µm²
    rounded = largest / least * 1.0005 or 1.0  # 0.99999 N is not 1000 mN
    exponent = 3 * math.floor(math.log10(rounded) / (3 * power))
    exponent = min(max(exponent, min(_PREFIXES)), 0 if si == "s" else max(_PREFIXES))
    symbol = _PREFIXES[exponent] + name + (str(power).translate(_SUPERSCRIPTS) if power > 1 else "")
    return Unit(10.0 ** (exponent * power), symbol + (f"/{tail}" if tail else ""))


def format_quantity(value: float, unit: str) -> str:
    """Return a value in SI as text with a suitable prefix, to six digits.

    Examples
    --------
    >>> format_quantity(1e5, "Pa s"), format_quantity(0.05, "s"), format_quantity(2.0, "N")
    ('100 kPa s', '50 ms', '2 N')
    """
    return unit_for([value], unit).text(value, 6)
