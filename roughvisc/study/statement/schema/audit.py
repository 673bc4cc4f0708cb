"""``[audit]``: what an audit of the results is told. It changes no result, and no case's key."""

from __future__ import annotations

from typing import Any, get_args

from pydantic import create_model, model_validator

from roughvisc.mechanics.bodies.sheet import Base
from roughvisc.study.statement.schema.entries import choice, measured, nullable
from roughvisc.study.statement.schema.section import Section, refuse

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
