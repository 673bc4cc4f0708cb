"""Constructors of materials and of bodies, for completion in an editor. Each is also a name of :mod:`roughvisc`."""

from roughvisc.mechanics.body import Body
from roughvisc.mechanics.layer import layer
from roughvisc.mechanics.materials.material import Prony, arrhenius, creep, pair, power_law, shift, wlf
from roughvisc.mechanics.materials.models import elastic, from_relaxation, kelvin_voigt, maxwell, zener
from roughvisc.mechanics.materials.tables import creep_table, dynamic_table, relaxation_table
from roughvisc.mechanics.sheet import sheet

__all__ = [
    "Body",
    "Prony",
    "arrhenius",
    "creep",
    "creep_table",
    "dynamic_table",
    "elastic",
    "from_relaxation",
    "kelvin_voigt",
    "layer",
    "maxwell",
    "pair",
    "power_law",
    "relaxation_table",
    "sheet",
    "shift",
    "wlf",
    "zener",
]


def __dir__() -> list[str]:
    return __all__
