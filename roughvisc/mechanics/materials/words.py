"""Materials in words: what their ``repr`` says, in units that read well."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Any

from roughvisc.notebook import table
from roughvisc.units import said, unit_for

#: Values of a series or a table up to which all of them are listed.
_LISTED = 4


@dataclass(frozen=True)
class Built:
    """The call that builds a material, in words: its name, and each argument with its value."""

    name: str
    arguments: tuple[tuple[str, str], ...]

    def __str__(self) -> str:
        return f"{self.name}({', '.join(f'{key}={text}' for key, text in self.arguments)})"


class PrintedAsBuilt:
    """A material whose ``repr`` is the call that builds it, with readable units; a subclass says which call."""

    def _built(self) -> Built:
        raise NotImplementedError

    def __repr__(self) -> str:
        return str(self._built())

    def _repr_html_(self) -> str:
        return table(*astuple(self._built()))


def as_built(name: str, poisson: float, note: str, **parameters: tuple[Any, str]) -> Built:
    """A material as the call that builds it.

    Parameters
    ----------
    name : str
        Of the constructor.
    poisson : float
        Told unless it is a half.
    note : str
        Told unless it is empty.
    **parameters
        Value and unit of each.

    Examples
    --------
    >>> print(as_built("maxwell", 0.5, "", shear_modulus=(3e6, "Pa"), viscosity=(1e5, "Pa s")))
    maxwell(shear_modulus=3 MPa, viscosity=100 kPa s)
    >>> print(as_built("Prony", 0.3, "", compliances=((1e-6, 2e-6), "1/Pa"), times=((0.01, 0.1), "s")))
    Prony(compliances=(1, 2) 1/MPa, times=(10, 100) ms, poisson=0.3)
    """
    arguments = [(key, _text(value, unit)) for key, (value, unit) in parameters.items()]
    arguments += [("poisson", f"{poisson:g}")] if poisson != 0.5 else []
    arguments += [("note", repr(note))] if note else []
    return Built(name, tuple(arguments))


def _text(value: Any, unit: str) -> str:
    if not isinstance(value, Sequence):
        return said(value, unit) if value else "0"
    if len(value) > _LISTED:
        return f"{len(value)} from {said(value[0], unit)} to {said(value[-1], unit)}"
    shown = unit_for(value, unit)
    return f"({', '.join(f'{number:.6g}' for number in shown(value))}) {shown.symbol}"
