"""Constructors of materials and of bodies, for completion in an editor. Each is also a name of :mod:`roughvisc`."""

from roughvisc.mechanics.body import Body
from roughvisc.mechanics.layer import layer
from roughvisc.mechanics.materials.fractional import fractional_zener
from roughvisc.mechanics.materials.material import Prony, arrhenius, creep, pair, power_law, shift, thermal, wlf
from roughvisc.mechanics.materials.models import elastic, from_relaxation, kelvin_voigt, maxwell, zener
from roughvisc.mechanics.materials.tables import creep_table, dynamic_table, relaxation_table
from roughvisc.mechanics.sheet import sheet
from roughvisc.study.material_file import read_material

__all__ = [
    "Body",
    "Prony",
    "arrhenius",
    "creep",
    "creep_table",
    "dynamic_table",
    "elastic",
    "fractional_zener",
    "from_relaxation",
    "kelvin_voigt",
    "layer",
    "maxwell",
    "pair",
    "power_law",
    "read_material",
    "relaxation_table",
    "sheet",
    "shift",
    "thermal",
    "wlf",
    "zener",
]


def __dir__() -> list[str]:
    return __all__
