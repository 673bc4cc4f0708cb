"""Linear viscoelastic materials, and the certified exponential series that the solver uses."""

from __future__ import annotations

from collections.abc import Callable

from roughvisc.mechanics.materials.fractional import fractional_zener
from roughvisc.mechanics.materials.material import Material, Prony, pair, power_law
from roughvisc.mechanics.materials.models import creep_series, elastic, from_relaxation, kelvin_voigt, maxwell, zener
from roughvisc.mechanics.materials.tables import creep_table, dynamic_table, relaxation_table

_SERIES = (elastic, maxwell, kelvin_voigt, zener, from_relaxation, Prony)
_OTHERS = (
    power_law,
    fractional_zener,
    creep_series,
    creep_table,
    relaxation_table,
    dynamic_table,
    pair,
)
#: Function of each model of a material that a study may name; its arguments are the keys of the table.
MODELS: dict[str, Callable[..., Material]] = {one.__name__.lower(): one for one in (*_SERIES, *_OTHERS)}
