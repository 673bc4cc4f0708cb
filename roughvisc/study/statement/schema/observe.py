"""``[observe]``: what is derived from a result once it is there; a table for each observable.

An observable changes no run, so it does not count in a case's key.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, get_args

from pydantic import Field, model_validator

from roughvisc.errors import InputError
from roughvisc.study.statement.resistivity import WANTED, Kind, resistivities
from roughvisc.study.statement.schema.entries import choice, measured, nullable
from roughvisc.study.statement.schema.section import Section, refuse


class Observable(Section):
    """What one observable is asked with.

    ``NEEDS`` are fields of which one must be kept.
    """

    NEEDS: ClassVar[tuple[str, ...]] = ()

    def problem(self, boundary: str) -> tuple[str, str] | None:
        """Key and sentence of what does not go with the border of the study; None if all does."""
        return None


class LeakageTable(Observable):
    """Leakage of a fluid through the gap."""

    NEEDS = ("gap",)

    viscosity: measured("Pa s", above=0) = 1e-3
    pressure_drop: measured("Pa", above=0) = 1e5
    along: choice("x", "y") = "x"
    sides: nullable(choice("closed", "periodic")) = None

    def problem(self, boundary: str) -> tuple[str, str] | None:
        if self.sides == "periodic" and boundary != "periodic":
            return "sides", f"found 'periodic' where solve.boundary is {boundary!r}: expected 'closed'"
        return None


class ConductanceTable(Observable):
    """Thermal or electrical conductance of the contact spots."""

    NEEDS = ("pressure", "gap")

    resistivity: Annotated[tuple[float, float], Field(description=WANTED)]
    kind: nullable(choice(*get_args(Kind))) = None

    @model_validator(mode="before")
    @classmethod
    def _of_one_kind(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or "resistivity" not in data:
            return data
        try:
            kind, values = resistivities(data["resistivity"], data.get("kind"))
        except InputError as error:
            raise refuse("resistivity", str(error)) from None
        return {**data, "resistivity": values, "kind": kind}


class ObserveSection(Section):
    """What is derived from the result."""

    leakage: nullable(LeakageTable) = Field(None, description="a table")
    conductance: nullable(ConductanceTable) = Field(None, description="a table")

    def asked(self) -> Iterator[tuple[str, Observable]]:
        """Name and table of each observable that is asked for."""
        return ((name, table) for name, table in self if table is not None)

    def problem(self, fields: tuple[str, ...], boundary: str) -> tuple[str, str] | None:
        """Dotted key and sentence of the first thing that does not go with the study; None if all does."""
        for name, table in self.asked():
            if table.NEEDS and not set(table.NEEDS) & set(fields):
                needed = " or ".join(repr(one) for one in table.NEEDS)
                return name, f"needs a field that is not kept: expected {needed} in keep.fields"
            if found := table.problem(boundary):
                return f"{name}.{found[0]}", found[1]
        return None

    def stated(self) -> dict[str, Any]:
        """Name -> keyword arguments of each observable that is asked for, in SI."""
        return {name: table.model_dump(exclude_none=True) for name, table in self.asked()}
