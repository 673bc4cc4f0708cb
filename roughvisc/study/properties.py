"""Properties of a body that an audit needs and a solve does not: the table ``[audit]`` of a study."""

from __future__ import annotations

from typing import Any, get_args

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.mechanics.sheet import Base
from roughvisc.units import Quantity, quantities


@quantities(
    work_of_adhesion="J/m^2 >= 0",
    yield_strength="Pa > 0",
    thickness="m > 0",
    density="kg/m^3 > 0",
    heat_conductivity="W/m/K > 0",
    volumetric_heat_capacity="J/m^3/K > 0",
)
def properties(
    *,
    work_of_adhesion: Quantity | None = None,
    yield_strength: Quantity | None = None,
    thickness: Quantity | None = None,
    base: Base | None = None,
    density: Quantity | None = None,
    heat_conductivity: Quantity | None = None,
    volumetric_heat_capacity: Quantity | None = None,
) -> dict[str, Any]:
    """Return the stated properties, in SI.

    The parameters are described in :func:`roughvisc.audit`.

    Raises
    ------
    InputError
        If a value has a wrong type or is out of range, or a base is stated without a thickness.
    """
    if base is not None:
        one_of("base", base, get_args(Base))
        if thickness is None:
            raise InputError(key="base", found=base, expected="a thickness too")
    stated = {
        "work_of_adhesion": work_of_adhesion,
        "yield_strength": yield_strength,
        "thickness": thickness,
        "base": base,
        "density": density,
        "heat_conductivity": heat_conductivity,
        "volumetric_heat_capacity": volumetric_heat_capacity,
    }
    return {name: value for name, value in stated.items() if value is not None}
