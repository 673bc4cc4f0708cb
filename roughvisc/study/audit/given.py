"""What a user states for an audit: quantities that no contact result depends on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, get_args

from roughvisc.errors import InputError
from roughvisc.mechanics.sheet import Base
from roughvisc.units import number

#: Unit and bounds of each quantity.
BOUNDS: dict[str, tuple[str, dict[str, float]]] = {
    "work_of_adhesion": ("J/m^2", {"least": 0}),
    "yield_strength": ("Pa", {"above": 0}),
    "thickness": ("m", {"above": 0}),
    "density": ("kg/m^3", {"above": 0}),
    "linear_strain": ("1", {"above": 0}),
    "heat_conductivity": ("W/m/K", {"above": 0}),
    "volumetric_heat_capacity": ("J/m^3/K", {"above": 0}),
}


@dataclass(frozen=True, kw_only=True)
class AuditInputs:
    """What is stated, None where nothing is; see :func:`roughvisc.audit`. Quantities are numbers in SI, or texts."""

    work_of_adhesion: Any = None
    yield_strength: Any = None
    thickness: Any = None
    base: Any = None
    density: Any = None
    linear_strain: Any = None
    heat_conductivity: Any = None
    volumetric_heat_capacity: Any = None

    def __post_init__(self) -> None:
        for name, (unit, bounds) in BOUNDS.items():
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, number(value, unit, name, **bounds))
        if self.base not in (None, *get_args(Base)):
            raise InputError(key="base", found=self.base, expected=" or ".join(map(repr, get_args(Base))))

    def over(self, others: Mapping[str, Any]) -> AuditInputs:
        """These, and the others where these state nothing."""
        return AuditInputs(**{**others, **self.stated()})

    def stated(self) -> dict[str, Any]:
        """What is stated, in SI."""
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        return {name: value for name, value in values.items() if value is not None}


def of_study(path: Path) -> dict[str, Any]:
    """What a study file states for an audit, in SI; of a sweep, what its first case does.

    Raises
    ------
    InputError
        If the study is wrong.
    """
    from roughvisc.study.case import read_cases  # which checks what it reads by this module

    return read_cases(path)[0].audit_inputs
