"""Quantities as texts say them: a reading that shares nothing with the package's own, which goes by pint."""

import math
import re
import unicodedata

#: Name -> size in SI, and powers of (m, kg, s, K, mol).
_LENGTH, _TIME = (1, 0, 0, 0, 0), (0, 0, 1, 0, 0)
_PRESSURE, _FORCE, _ENERGY = (-1, 1, -2, 0, 0), (1, 1, -2, 0, 0), (2, 1, -2, 0, 0)
_NONE = (0, 0, 0, 0, 0)
UNITS = {
    **dict.fromkeys(("m", "meter", "metre"), (1.0, _LENGTH)),
    **dict.fromkeys(("s", "second", "sec"), (1.0, _TIME)),
    **dict.fromkeys(("N", "newton"), (1.0, _FORCE)),
    **dict.fromkeys(("Pa", "pascal"), (1.0, _PRESSURE)),
    **dict.fromkeys(("g", "gram"), (1e-3, (0, 1, 0, 0, 0))),
    **dict.fromkeys(("K", "kelvin"), (1.0, (0, 0, 0, 1, 0))),
    **dict.fromkeys(("J", "joule"), (1.0, _ENERGY)),
    **dict.fromkeys(("W", "watt"), (1.0, (2, 1, -3, 0, 0))),
    "mol": (1.0, (0, 0, 0, 0, 1)),
    "bar": (1e5, _PRESSURE),
    "Hz": (1.0, (0, 0, -1, 0, 0)),
    "dyn": (1e-5, _FORCE),
    "eV": (1.602176634e-19, _ENERGY),
    "P": (0.1, (-1, 1, -1, 0, 0)),
}
#: Those that take no prefix here.
PLAIN = {
    **dict.fromkeys(("min", "minute"), (60.0, _TIME)),
    **dict.fromkeys(("h", "hour", "hr"), (3600.0, _TIME)),
    **dict.fromkeys(("d", "day"), (86400.0, _TIME)),
    **dict.fromkeys(("a", "year", "yr"), (365.25 * 86400.0, _TIME)),
    **dict.fromkeys(("inch",), (0.0254, _LENGTH)),
    **dict.fromkeys(("%", "percent"), (0.01, _NONE)),
    "micron": (1e-6, _LENGTH),
    "parsec": (149597870700.0 / math.tan(math.radians(1 / 3600)), _LENGTH),
    "psi": (6894.757293168361, _PRESSURE),
    "atm": (101325.0, _PRESSURE),
    "kp": (9.80665, _FORCE),
    "lbf": (4.4482216152605, _FORCE),
}
PREFIXES = dict(
    zip(
        "qryzafpnuµμmcdhkMGTPEZYRQ",
        (-30, -27, -24, -21, -18, -15, -12, -9, -6, -6, -6, -3, -2, -1, 2, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30),
        strict=True,
    )
)
PREFIXES |= {"da": 1, "": 0, "micro": -6, "milli": -3, "kilo": 3, "mega": 6, "nano": -9, "giga": 9, "centi": -2}
_FACTOR = re.compile(r"([^\W\d_]+|%)(?:(?:\^|\*\*)([+-]?\d+(?:\.\d)?)|([²³]))?")
_NUMBER = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)(.*)", re.S)


class UnknownUnit(Exception):
    """A unit that this reading does not know: nothing can be said."""


def unit_said(text):
    """Size in SI and dimension of a unit such as ``MPa s`` or ``N/m^2``; ``1/`` in front is allowed."""
    size, dimension, divides = 1.0, _NONE, False
    rest = re.sub(r"\s*(\^|\*\*)\s*", r"\1", text.strip())
    if rest.startswith(("1/", "1 /")):
        rest, divides = rest.partition("/")[2].strip(), True
    while rest:
        matched = _FACTOR.match(rest)
        if not matched:
            raise UnknownUnit(text)
        power = float(matched[2] or {"²": 2, "³": 3}.get(matched[3], 1)) * (-1 if divides else 1)
        one, of = _single(matched[1])
        size *= one**power
        dimension = tuple(a + power * b for a, b in zip(dimension, of, strict=True))
        rest = rest[matched.end() :]
        mark = re.match(r"\s*([*/·]?)\s*", rest)
        divides, rest = mark[1] == "/", rest[mark.end() :]
    return size, dimension


def _single(name):
    if name in PLAIN:
        return PLAIN[name]
    for unit, (size, dimension) in UNITS.items():
        prefix = name.removesuffix(unit)
        if name.endswith(unit) and prefix in PREFIXES:
            return size * 10.0 ** PREFIXES[prefix], dimension
    raise UnknownUnit(name)


def quantity_said(text):
    """Value in SI and dimension of a text such as ``"5 mN"``; None if it is no quantity."""
    # digits of other scripts, and those of full width that an input method has, are digits
    text = "".join(str(unicodedata.decimal(sign)) if sign.isdecimal() else sign for sign in text)
    matched = _NUMBER.fullmatch(text)
    if not matched:
        return None
    number, unit = float(matched[1]), matched[2].strip()
    if unit in ("degC", "°C"):
        return number + 273.15, (0, 0, 0, 1, 0)
    size, dimension = unit_said(unit)
    return number * size, dimension
