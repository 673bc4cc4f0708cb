"""Quantities with units: a number in SI or a string such as "5 mN" becomes a float in SI, and a float a readable text.

Study files and surface cards write ``"10 um"`` or ``"0.1 MPa s"``; inside the package there are only floats. Figures,
tables and reprs show them with a prefix that suits: a :class:`Unit` is chosen from the data, then used for all of it.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, wraps
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError

if TYPE_CHECKING:
    # mypy cannot say that text ends at the decorator: to it a quantity inside a function is a number
    Quantity = float | Any
else:
    #: What an argument that :func:`quantities` converts may be: a number in SI, or text with a unit.
    Quantity = float | str

_Taking = TypeVar("_Taking", bound=Callable[..., Any])

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_FACTOR = r"[^\W\d_]+(?:_[^\W\d_]+)*(?:\s*(?:\^|\*\*)\s*[+-]?\d(?:\.\d)?|[²³])?"
# A grammar of our own in front of pint: pint evaluates arithmetic, and "9**9**9**9 m" would never come back.
_PRODUCT = rf"{_FACTOR}(?:(?:\s*[*/·]\s*|\s+){_FACTOR})*"
# of "0.31/MPa" the number is 0.31: the 1 of an inverse stands apart
_INVERSE = rf"(?:(?<=\s)1\s*)?/\s*(?:{_FACTOR}|\({_PRODUCT}\))"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(%|{_PRODUCT}|{_INVERSE})?\s*")
# pint counts angles as pure numbers, but a slope of 45 degrees is 1 and not 0.785
_ANGLES = {"degree", "radian", "turn", "grade", "arcminute", "arcsecond", "gradian"}


_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
#: The same from texts, and the units that they may stand before without another meaning; both signs for micro.
_POWERS = {prefix: power for power, prefix in _PREFIXES.items()} | {"u": -6, "\N{GREEK SMALL LETTER MU}": -6}
_WITH_PREFIX = frozenset({"m", "N", "Pa", "s"})
_CLOCK = ((2 * 86400.0, 86400.0, "d"), (2 * 3600.0, 3600.0, "h"))
_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def quantity(value: str | float, unit: str, name: str = "", *, difference: bool = False) -> float:
    """Value of a quantity in a given unit.

    Parameters
    ----------
    value : str or float
        A number, taken to be in `unit` already, or a string of a number and a unit, such as ``"10 um"``,
        ``"0.1 MPa s"`` or ``"3 N/m^2"``.
    unit : str
        The unit expected, as ``"m"``, ``"Pa s"`` or ``"1"`` for a pure number.
    name : str, optional
        What the quantity is, for the message: a key of a study file, or a parameter.
    difference : bool
        Whether it is a difference of temperatures, so that degrees Celsius, which count from 273.15 K, are refused.

    Returns
    -------
    float
        The value in `unit`, finite. Strings are rounded to 15 significant digits, since conversions leave
        noise in the last one (``"10 um"`` would be 9.999999999999999e-06 m).

    Raises
    ------
    InputError
        If the value is no finite number or no quantity, its unit is unknown, or it is of another dimension.

    Examples
    --------
    >>> quantity("10 um", "m"), quantity("0.1 MPa s", "Pa s"), quantity(2, "N")
    (1e-05, 100000.0, 2.0)
    >>> quantity("25 degC", "K"), quantity("25 °C", "K")
    (298.15, 298.15)
    >>> quantity("0.3 1/MPa", "1/Pa"), quantity("0.31/MPa", "1/Pa"), quantity("2 1/(kPa s)", "1/(Pa s)")
    (3e-07, 3.1e-07, 0.002)
    """
    label = f"{name} is {shown(value)}" if name else f"found {shown(value)}"
    wanted = "a number" if unit in ("", "1") else f"a number in {unit}, or a string with a unit of its kind"
    if isinstance(value, str):
        try:
            result = _parsed(value, unit, label, wanted, difference)
        except InputError as error:
            raise InputError(str(error), key=name, found=value, expected=wanted) from error.__cause__
    elif isinstance(value, Real) and not isinstance(value, bool):
        try:
            result = float(value)
        except OverflowError:  # an integer of hundreds of digits
            result = math.inf
    else:
        raise InputError(f"{label}: expected {wanted}", key=name, found=value, expected=wanted)
    if not math.isfinite(result):
        raise InputError(f"{label}: expected {wanted}, finite", key=name, found=value, expected=f"{wanted}, finite")
    return result


def in_si(value: Any, unit: str, name: str) -> Any:
    """A value with the texts in it as numbers; anything else stays as it is.

    Parameters
    ----------
    value : Any
        A number or text; or a list, tuple or dictionary of such values.
    unit : str
        The unit expected of text.
    name : str
        What the value is given as, for the message.

    Raises
    ------
    InputError
        As :func:`quantity` does, of the first text that is no quantity of this kind.

    Examples
    --------
    >>> in_si(("1 mm", 2.0), "m", "size"), in_si(None, "m", "size")
    ((0.001, 2.0), None)
    """
    if isinstance(value, str):
        return quantity(value, unit, name)
    if isinstance(value, Mapping):
        return {key: in_si(one, unit, f"{name}[{key!r}]") for key, one in value.items()}
    if not isinstance(value, list | tuple) or not any(
        issubclass(kind, str | list | tuple) for kind in {*map(type, value)}
    ):
        return value
    return type(value)([in_si(one, unit, f"{name}[{number}]") for number, one in enumerate(value)])


def quantities(**units: str) -> Callable[[_Taking], _Taking]:
    """Decorator of a function or a dataclass: the arguments named are numbers in SI, or text with a unit.

    Text becomes a number before the function sees it; numbers and all else are handed on.

    Parameters
    ----------
    **units : str
        Name of the argument -> its unit, as :func:`quantity` takes it.

    Examples
    --------
    >>> @quantities(radius="m")
    ... def area(radius):
    ...     return 3.0 * radius**2
    >>> area("10 mm") == area(0.01)
    True
    >>> area("2 s")  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    InputError: radius is '2 s', which is in second: expected a number in m, or a string with a unit of its kind
    """

    def decorate(function: Any) -> Any:
        if isinstance(function, type):
            function.__init__ = decorate(function.__init__)  # type: ignore[misc]
            return function
        code = function.__code__
        names = code.co_varnames[: code.co_argcount]

        @wraps(function)
        def called(*args: Any, **given: Any) -> Any:
            for name in units.keys() & given.keys():
                given[name] = in_si(given[name], units[name], name)
            known = [
                in_si(one, units[name], name) if name in units else one for name, one in zip(names, args, strict=False)
            ]
            return function(*known, *args[len(names) :], **given)

        called.quantities = units  # type: ignore[attr-defined]
        return called

    return decorate


def number_and_unit(text: str) -> tuple[float, str]:
    """Number and unit of a quantity as they are written.

    Parameters
    ----------
    text : str
        A quantity that :func:`quantity` takes.

    Examples
    --------
    >>> number_and_unit("0.1 MPa s"), number_and_unit("1e-3")
    ((0.1, 'MPa s'), (0.001, ''))
    """
    number, unit = _QUANTITY.fullmatch(text).groups()  # type: ignore[union-attr]
    return float(number), unit or ""


def is_quantity(value: Any, unit: str) -> bool:
    """Whether a value is a number, or a string of a number and a unit that converts to this one."""
    try:
        quantity(value, unit)
    except InputError:
        return False
    return True


def shown(value: Any) -> str:
    """What was found, short enough for a message."""
    if isinstance(value, Mapping):
        return f"a table with {', '.join(map(str, value)) or 'no keys'}"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def within(
    number: float,
    *,
    above: float | None = None,
    least: float | None = None,
    most: float | None = None,
    below: float | None = None,
) -> bool:
    """Whether a number lies between bounds, the first and the last excluded; NaN lies in none."""
    return (
        (above is None or number > above)
        and (above != 0 or number >= sys.float_info.min)  # whose reciprocal a double can hold
        and (least is None or number >= least)
        and (most is None or number <= most)
        and (below is None or number < below)
    )


def range_in_words(**bounds: float | None) -> str:
    """``" above 0 and up to 0.5"`` and the like, of bounds as :func:`within` has them; empty without any."""
    words = {"above": "above", "least": "at least", "most": "up to", "below": "below"}
    told = [f"{word} {bounds[key]:g}" for key, word in words.items() if bounds.get(key) is not None]
    return " " + " and ".join(told) if told else ""


def wanted_quantity(unit: str, **bounds: float | None) -> str:
    """What is expected of a quantity, in words."""
    wanted = "a number" if unit == "1" else f"a number in {unit}, or a string with a unit of its kind,"
    return (wanted + range_in_words(**bounds)).rstrip(",")


def bounded_quantity(
    value: str | float,
    unit: str,
    *,
    instead: Mapping[str, str] | None = None,
    difference: bool = False,
    **bounds: float | None,
) -> float:
    """Value of a quantity in a given unit and between bounds: the check of study files and of loading programs.

    Parameters
    ----------
    value : str or float
        As :func:`quantity` takes it.
    unit : str
        The unit expected.
    instead : mapping of str to str, optional
        Key -> unit of quantities that may be meant where the unit is of another kind; the message suggests the key.
    difference : bool
        Whether it is a difference of temperatures.
    **bounds : float, optional
        ``above``, ``least``, ``most`` and ``below``, the first and the last excluded. [unit]

    Returns
    -------
    float
        The value in `unit`.

    Raises
    ------
    InputError
        If the value is no quantity of this kind, or outside the bounds.

    Examples
    --------
    >>> bounded_quantity("2 MPa", "N", instead={"pressure": "Pa"})  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    InputError: found '2 MPa', which is in megapascal: expected ...; did you mean pressure = '2 MPa'?
    """
    try:
        number = quantity(value, unit, difference=difference)
    except InputError as error:
        for key, other in (instead or {}).items():
            if is_quantity(value, other):
                hint = f"{error}; did you mean {key} = {value!r}?"
                raise InputError(hint, found=value, expected=error.expected) from None
        raise
    if not within(number, **bounds):
        raise InputError(found=value, expected=wanted_quantity(unit, **bounds))
    return number


def stated_quantity(value: Any, unit: str, key: str, **bounds: Any) -> float:
    """The same of a value that is known by a key, which messages begin with; scalars of NumPy and xarray are taken.

    Parameters
    ----------
    value, unit, bounds
        As :func:`bounded_quantity` has them.
    key : str
        What the value is given as.

    Raises
    ------
    InputError
        As :func:`bounded_quantity` does, beginning with the key.
    """
    if getattr(value, "shape", None) == ():
        value = value.item()
    try:
        return bounded_quantity(value, unit, **bounds)
    except InputError as error:
        raise InputError(f"{key}: {error}", key=key, found=value, expected=error.expected) from None


def _parsed(text: str, unit: str, label: str, wanted: str, difference: bool) -> float:
    text = text.replace("°C", "degC").replace("°F", "degF")
    matched = _QUANTITY.fullmatch(text) if len(text) <= 100 else None
    if matched is None:
        raise InputError(f"{label}, which is no quantity: expected {wanted}")
    number, found = float(matched[1]), matched[2]
    dimensionless = unit in ("", "1")
    if found is None:
        if dimensionless:
            return number
        raise InputError(f"{label}, a text without a unit: expected {wanted} (such as {f'{matched[1]} {unit}'!r})")
    if (plain := _prefixed(matched[1], found, unit)) is not None:
        return plain
    from pint import PintError  # slow to import

    expected = _registry().Unit("" if dimensionless else unit)
    try:
        names = _registry().parse_units_as_container(_for_pint(found))
        given = _registry().Unit(names)
        same_kind = given.dimensionality == expected.dimensionality
        converted, begins = (
            float(_registry().Quantity(value, given).to(expected).magnitude) if same_kind else math.nan
            for value in (number, 0.0)
        )
    # the last three of a unit called nan, of one to the power 0, of letters that no name in Python may have
    except (PintError, ValueError, KeyError, AssertionError) as error:
        raise InputError(f"{label}, whose unit {found!r} is not known: expected {wanted}") from error
    angle = expected.dimensionless and any(name in _ANGLES for name in names)
    if not same_kind or (angle and str(expected) not in _ANGLES):
        raise InputError(f"{label}, which is in {given}: expected {wanted}")
    if difference and begins:
        raise InputError(f"{label}, a temperature: expected a difference of temperatures, such as {f'{number:g} K'!r}")
    return float(f"{converted:.15g}")


def _for_pint(unit: str) -> str:
    """A unit as pint reads it."""
    if unit.startswith("/"):
        return f"1{unit}"
    return "percent" if unit == "%" else unit.replace("·", "*")


def _prefixed(number: str, found: str, unit: str) -> float | None:
    """Value of a number in a unit whose factors are those expected, with prefixes; None: that is for pint to say.

    Most quantities of a study are such, and the registry of pint takes 0.2 s to build. A number
    of at most 15 digits comes out as pint's does once that is rounded to 15 digits.
    """
    expected, factors, power = unit.split(" "), found.split(" "), 0
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
        """Values [SI] in this unit."""
        return np.asarray(values, dtype=float) / self.factor

    def label(self, name: str) -> str:
        """Axis label: the name and, in brackets, the unit."""
        return f"{name} [{self.symbol}]" if self.symbol else name

    def text(self, value: float, digits: int = 3) -> str:
        """One value [SI] with its unit, as read in running text."""
        shown = float(value) / self.factor
        if 1e3 <= abs(shown) < 1e6:  # not 5e+03
            return f"{shown:.0f} {self.symbol}".rstrip()
        return f"{shown:.{digits}g} {self.symbol}".rstrip()


def unit_for(values: ArrayLike, si: str) -> Unit:
    """Unit with the engineering prefix that suits the largest of some values.

    Parameters
    ----------
    values : array_like
        Values of one axis; missing and infinite ones are ignored. [SI]
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
    name = head.rstrip("^0123456789")  # results of old have m2
    power = int(head[len(name) :].strip("^") or 1)
    least = 1.0 if power == 1 else 10.0**-power  # 0.05 mm² reads better than 50000 µm²
    exponent = 0
    if largest > 0:
        exponent = 3 * math.floor(math.log10(largest / least * 1.0005) / (3 * power))  # 0.99999 N is not 1000 mN
    exponent = min(max(exponent, min(_PREFIXES)), 0 if si == "s" else max(_PREFIXES))
    symbol = _PREFIXES[exponent] + name + (str(power).translate(_SUPERSCRIPTS) if power > 1 else "")
    return Unit(10.0 ** (exponent * power), symbol + (f"/{tail}" if tail else ""))


def said(value: float, unit: str) -> str:
    """One value in SI as read in running text, to six digits.

    Examples
    --------
    >>> said(1e5, "Pa s"), said(0.05, "s"), said(2.0, "N")
    ('100 kPa s', '50 ms', '2 N')
    """
    return unit_for([value], unit).text(value, 6)
