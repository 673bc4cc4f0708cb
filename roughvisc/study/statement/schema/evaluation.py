"""``[observe]``, ``[audit]``: what is made of results. They change no result, and no case's key."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, get_args

from pydantic import Field, create_model, model_validator

from roughvisc.errors import InputError
from roughvisc.mechanics.sheet import Base
from roughvisc.observables.resistivity import WANTED as RESISTIVITIES
from roughvisc.observables.resistivity import Kind, resistivities
from roughvisc.study.statement.schema.section import Section, choice, measured, nullable, refuse


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

    resistivity: Annotated[tuple[float, float], Field(description=RESISTIVITIES)]
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


#: key -> unit, and the bounds of its values
BOUNDS: dict[str, tuple[str, dict[str, float]]] = {
    "work_of_adhesion": ("J/m^2", {"least": 0}),
    "yield_strength": ("Pa", {"above": 0}),
    "thickness": ("m", {"above": 0}),
    "density": ("kg/m^3", {"above": 0}),
    "linear_strain": ("1", {"above": 0}),
    "heat_conductivity": ("W/m/K", {"above": 0}),
    "volumetric_heat_capacity": ("J/m^3/K", {"above": 0}),
}
_KINDS: dict[str, Any] = {
    **{key: measured(unit, **bounds) for key, (unit, bounds) in BOUNDS.items()},
    "base": choice(*get_args(Base)),
}


class _Stated(Section):
    """What an audit of the results is told."""

    @model_validator(mode="after")
    def _base_has_a_thickness(self) -> _Stated:
        if getattr(self, "base", None) is not None and getattr(self, "thickness", None) is None:
            raise refuse("base", "found without a thickness: expected both, or neither")
        return self


AuditSection: type[Section] = create_model(
    "AuditSection",
    __base__=_Stated,
    __doc__=_Stated.__doc__,
    **{key: (nullable(kind), None) for key, kind in _KINDS.items()},
)
