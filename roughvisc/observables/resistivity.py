"""Resistivities of two bodies, as studies and the observable of conductance take them: thermal or electrical."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, get_args

from roughvisc.errors import InputError
from roughvisc.units import is_quantity, quantity

Kind = Literal["thermal", "electrical"]
#: What a resistivity is counted in.
UNITS: dict[str, str] = {"thermal": "K m/W", "electrical": "ohm m"}
WANTED = 'a list of two, one of each body, in K m/W or, as strings such as "2e-8 ohm m" or with kind, in ohm m'


def resistivities(stated: Any, kind: str | None = None) -> tuple[str, tuple[float, float]]:
    """What flows, and the resistivity of each body, in the unit of its kind.

    Parameters
    ----------
    stated : pair of float or str
        Zero for a perfect conductor. Strings with a unit tell the kind.
    kind : {"thermal", "electrical"}, optional
        Of numbers; default: thermal.

    Raises
    ------
    InputError
        If there are not two of one kind, one is negative, or both are zero.

    Examples
    --------
    >>> resistivities(["5 m K/W", 0]), resistivities([1, 2], "electrical"), resistivities(["2 uohm cm", 0])
    (('thermal', (5.0, 0.0)), ('electrical', (1.0, 2.0)), ('electrical', (2e-08, 0.0)))
    """
    if isinstance(stated, str) or not isinstance(stated, Sequence) or len(stated) != 2:
        raise InputError(key="resistivity", found=stated, expected=WANTED)
    if kind is not None and kind not in get_args(Kind):
        raise InputError(key="kind", found=kind, expected=" or ".join(map(repr, get_args(Kind))))
    if kind is None:
        kind = "electrical" if any(_is_electrical(one) for one in stated) else "thermal"
    first, second = (quantity(one, UNITS[kind], "resistivity") for one in stated)
    if min(first, second) < 0 or first + second == 0:
        raise InputError(key="resistivity", found=stated, expected="none below zero, and not both zero")
    return kind, (first, second)


def _is_electrical(one: Any) -> bool:
    return isinstance(one, str) and is_quantity(one, UNITS["electrical"]) and not is_quantity(one, "1")
