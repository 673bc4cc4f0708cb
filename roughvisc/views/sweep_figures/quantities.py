"""Labels and units of the quantities of many cases, as figures show them."""

from __future__ import annotations

import numpy as np

from roughvisc.variables import VARIABLES
from roughvisc.views.figures.axes import Unit, unit_for
from roughvisc.views.sweep_figures.cases import Cases, middle_of_decades


def quantity_unit(cases: Cases, quantity: str, values) -> Unit:
    """Unit to show values [SI] of a quantity in."""
    if quantity == "contact_fraction":
        return Unit(0.01, "%")
    declared = VARIABLES[quantity].units if quantity in VARIABLES else ""
    return unit_for(middle_of_decades(np.ravel(values)), str(cases.members[0][quantity].attrs.get("units", declared)))


def label_of(cases: Cases, quantity: str, unit: Unit) -> str:
    """Axis label of a quantity."""
    if quantity in VARIABLES:
        return unit.label(VARIABLES[quantity].label)
    said = str(cases.members[0][quantity].attrs.get("long_name", quantity)).replace("_", " ")
    return unit.label(said[:1].upper() + said[1:])
