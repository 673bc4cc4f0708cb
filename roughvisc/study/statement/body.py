"""The body that is pressed, as a kernel: a half-space, or a sheet of the material on a rigid base."""

from __future__ import annotations

import math
from typing import Any

from roughvisc.errors import InputError
from roughvisc.mechanics.halfspace.kernel import Kernel
from roughvisc.mechanics.halfspace.love import HALF_SPACE
from roughvisc.mechanics.halfspace.sheet import Base, Sheet
from roughvisc.mechanics.materials.models import Material
from roughvisc.mechanics.materials.protocol import complete

#: Unless a base is given with a thickness.
BASE: Base = "bonded"


def make_body(
    material: Material, thickness: float | None, base: Base | None = None, kernel: Kernel = HALF_SPACE
) -> Kernel:
    """Kernel of a body of a material.

    Parameters
    ----------
    material : Material
        Its Poisson ratio matters to a sheet.
    thickness : float or None
        Of a sheet; None or infinite: a half-space. [m]
    base : {"bonded", "slipping"} or None
        What the sheet lies on; None: bonded.
    kernel : Kernel
        Of what is pressed if it is no sheet.

    Raises
    ------
    InputError
        If the thickness is not positive, the base is none of those, or given without a thickness; if the material
        stands for two bodies, or its Poisson ratio is below zero or changes in time: space and time do not separate.
    """
    if thickness is None:
        if base is not None:
            raise InputError(f"base is {base!r} without a thickness: expected both, or neither for a half-space")
        return kernel
    if kernel != HALF_SPACE:
        raise InputError(f"thickness is {thickness!r} beside the kernel {kernel!r}: expected one of them")
    amiss = separability_error(material)
    if amiss:
        raise InputError(
            f"thickness is {thickness!r}, and the material is {amiss}: expected one body, Poisson's ratio constant"
        )
    endless = thickness == math.inf
    sheet = Sheet(1.0 if endless else thickness, complete(material).poisson, base or BASE)  # checks all of it
    return HALF_SPACE if endless else sheet


def separability_error(material: Any) -> str:
    """What a material stands for that is no one body of a constant Poisson ratio; empty if it is one."""
    while material is not None:
        amiss: str = getattr(material, "stands_for", "")
        if amiss:
            return amiss
        material = getattr(material, "given", None)  # of one that was shifted or completed
    return ""
