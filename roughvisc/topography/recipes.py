"""Names, arguments, defaults and units of surface recipes, for cards and studies.

Arguments and defaults are those of the functions themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from inspect import Parameter, signature
from typing import Any, Literal

import xarray as xr

from roughvisc.topography import synthesis

#: recipe -> its arguments and their defaults; ``...``: none
RECIPES: dict[str, dict[str, Any]] = {
    name: {
        key: ... if argument.default is Parameter.empty else argument.default
        for key, argument in signature(getattr(synthesis, name)).parameters.items()
    }
    for name in ("sphere", "cone", "flat_punch", "wavy", "self_affine")
}
#: argument -> its unit, the same in all recipes; what is not here is taken as it is
UNITS = {
    **dict.fromkeys(("size", "radius", "amplitude", "wavelength", "rms_height", "rolloff", "shortcut"), "m"),
    **dict.fromkeys(("slope", "hurst", "rms_slope", "anisotropy"), "1"),
}
#: recipe -> the boundary that its surfaces are made for
BOUNDARIES: dict[str, Literal["free", "periodic"]] = {
    "sphere": "free",
    "cone": "free",
    "flat_punch": "free",
    "wavy": "periodic",
    "self_affine": "periodic",
}


def make(name: str, arguments: Mapping[str, Any]) -> xr.DataArray:
    """Heights of a recipe over (x, y). [m]

    Raises
    ------
    TypeError
        If an argument is unknown or missing.
    InputError
        If an argument has a wrong value.
    """
    made: xr.DataArray = getattr(synthesis, name)(**arguments)
    return made
