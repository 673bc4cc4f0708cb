"""Quantities with units: a number in SI or a string such as "5 mN" becomes a float in SI.

Study files and surface cards write ``"10 um"`` or ``"0.1 MPa s"``; inside the package there are only floats.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Mapping
from functools import cache
from numbers import Real
from typing import Any

from roughvisc.errors import InputError

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_FACTOR = r"[^\W\d_]+(?:_[^\W\d_]+)*(?:\s*(?:\^|\*\*)\s*[+-]?\d(?:\.\d)?|[²³])?"
# A grammar of our own in front of pint: pint evaluates arithmetic, and "9**9**9**9 m" would never come back.
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(%|{_FACTOR}(?:(?:\s*[*/·]\s*|\s+){_FACTOR})*)?\s*")
# pint counts angles as pure numbers, but a slope of 45 degrees is 1 and not 0.785
_ANGLES = {"degree", "radian", "turn", "grade", "arcminute", "arcsecond", "gradian"}


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
    """
    label = f"{name} is {shown(value)}" if name else f"found {shown(value)}"
    wanted = "a number" if unit in ("", "1") else f"a number in {unit}, or a string with a unit of its kind"
    if isinstance(value, str):
        result = _parsed(value, unit, label, wanted, difference)
    elif isinstance(value, Real) and not isinstance(value, bool):
        try:
            result = float(value)
        except OverflowError:  # an integer of hundreds of digits
            result = math.inf
    else:
        raise InputError(f"{label}: expected {wanted}")
    if not math.isfinite(result):
        raise InputError(f"{label}: expected {wanted}, finite")
    return result


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


def range_in_words(above: float | None, least: float | None, most: float | None, below: float | None) -> str:
    """``" above 0 and up to 0.5"`` and the like; empty without bounds."""
    words = [
        f"{word} {bound:g}"
        for word, bound in (("above", above), ("at least", least), ("up to", most), ("below", below))
        if bound is not None
    ]
    return " " + " and ".join(words) if words else ""


def wanted_quantity(
    unit: str,
    above: float | None = None,
    least: float | None = None,
    most: float | None = None,
    below: float | None = None,
) -> str:
    """What is expected of a quantity, in words."""
    wanted = "a number" if unit == "1" else f"a number in {unit}, or a string with a unit of its kind,"
    return (wanted + range_in_words(above, least, most, below)).rstrip(",")


def bounded_quantity(
    value: str | float,
    unit: str,
    *,
    above: float | None = None,
    least: float | None = None,
    most: float | None = None,
    below: float | None = None,
    instead: Mapping[str, str] | None = None,
    difference: bool = False,
) -> float:
    """Value of a quantity in a given unit and between bounds: the check of study files and of loading programs.

    Parameters
    ----------
    value : str or float
        As :func:`quantity` takes it.
    unit : str
        The unit expected.
    above, least, most, below : float, optional
        Bounds, the first and the last excluded. [unit]
    instead : mapping of str to str, optional
        Key -> unit of quantities that may be meant where the unit is of another kind; the message suggests the key.
    difference : bool
        Whether it is a difference of temperatures.

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
                raise InputError(f"{error}; did you mean {key} = {value!r}?") from None
        raise
    outside = (
        (above is not None and not number > above)
        or (above == 0 and number < sys.float_info.min)  # whose reciprocal no double can hold
        or (least is not None and not number >= least)
        or (most is not None and not number <= most)
        or (below is not None and not number < below)
    )
    if outside:
        raise InputError(f"found {shown(value)}: expected {wanted_quantity(unit, above, least, most, below)}")
    return number


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
    try:
        given = _registry().Unit("percent" if found == "%" else found.replace("·", "*"))
        expected = _registry().Unit("" if dimensionless else unit)
    except Exception as error:  # pint raises half a dozen kinds, AssertionError and tokenizer errors among them
        raise InputError(f"{label}, whose unit {found!r} is not known: expected {wanted}") from error
    angle = expected.dimensionless and any(part in _ANGLES for part in given._units)
    if given.dimensionality != expected.dimensionality or (angle and str(expected) not in _ANGLES):
        raise InputError(f"{label}, which is in {given}: expected {wanted}")
    try:
        converted = float(_registry().Quantity(number, given).to(expected).magnitude)
        begins = float(_registry().Quantity(0.0, given).to(expected).magnitude)
    except Exception as error:  # logarithmic units: decibels
        raise InputError(f"{label}, which does not convert: expected {wanted}") from error
    if difference and begins:
        raise InputError(f"{label}, a temperature: expected a difference of temperatures, such as {f'{number:g} K'!r}")
    return float(f"{converted:.15g}")
