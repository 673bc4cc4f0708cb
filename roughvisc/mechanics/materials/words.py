"""Materials in words: their ``repr``, in units that read well."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from roughvisc.units import format_quantity, unit_for

#: Longest series or table that is listed in full.
_LISTED = 4


def in_words(name: str, poisson: float, note: str, **parameters: tuple[Any, str]) -> str:
    """Return a material as the call that builds it.

    Parameters
    ----------
    name : str
        Name of the constructor.
    poisson : float
        Poisson ratio, left out if it is a half.
    note : str
        Left out if empty.
    **parameters
        Value and unit of each.

    Examples
    --------
    >>> in_words("maxwell", 0.5, "", shear_modulus=(3e6, "Pa"), viscosity=(1e5, "Pa s"))
    'maxwell(shear_modulus=3 MPa, viscosity=100 kPa s)'
    >>> in_words("Prony", 0.3, "", compliances=((1e-6, 2e-6), "1/Pa"), times=((0.01, 0.1), "s"))
    'Prony(compliances=(1, 2) 1/MPa, times=(10, 100) ms, poisson=0.3)'
    """
    arguments = [f"{key}={_text(value, unit)}" for key, (value, unit) in parameters.items()]
    arguments += [f"poisson={poisson:g}"] if poisson != 0.5 else []
    arguments += [f"note={note!r}"] if note else []
    return f"{name}({', '.join(arguments)})"


def _text(value: Any, unit: str) -> str:
    if not isinstance(value, Sequence):
        return format_quantity(value, unit) if value else "0"
    if len(value) > _LISTED:
        return f"{len(value)} from {format_quantity(value[0], unit)} to {format_quantity(value[-1], unit)}"
    shown = unit_for(value, unit)
    return f"({', '.join(f'{number:.6g}' for number in shown(value))}) {shown.symbol}"
