"""Quantities of a budget or a trade: their values in a result, and factors of their errors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.experiment.loading import Loading
from roughvisc.observables import conductance, leakage
from roughvisc.study.case import Case

Array = NDArray[np.float64]
#: Keyword arguments of the observables, as ``[observe]`` of a study states them.
Observe = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Observable:
    """A number that a result has at each of its rows.

    Attributes
    ----------
    name : str
        Name of the number in a result.
    derive : callable, optional
        Returns the number over the axis, from a result and the arguments of its observable. Default: the result
        contains the number.
    fields : tuple of str
        Fields that `derive` needs.
    octave_factor : float
        Largest change by the next octave of waves, over the change by the last octave. The factors were chosen on 45
        rough surfaces, and their coverage was measured on others (workflows/benchmarks/whole_error.py). [-]
    follows : {"pressure", "approach", "area", "gap"}
        Quantity whose stated error determines the error of the number.
    """

    name: str
    derive: Callable[[xr.Dataset, Observe], xr.DataArray] | None = None
    fields: tuple[str, ...] = ()
    octave_factor: float = 1.1
    follows: Literal["pressure", "approach", "area", "gap"] = "pressure"

    def of(self, result: xr.Dataset, case: Case) -> Array:
        """Return the values of the number in a result of a case, over the axis."""
        found = result[self.name] if self.derive is None else self.derive(result, case.observed)
        return np.asarray(found.values, dtype=float)

    def stated_error(self, result: xr.Dataset, values: Array) -> Array:
        """Return the error of the number's logarithm by steps and solver, from the stated errors of the rows. [-]

        The mean gap of a periodic surface has the error of the approach. The relative change of a leak rate is up to
        six times the change of the mean gap, near the load that closes the gap. A conductance follows the contact area.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.follows == "area" and "contact_area_error" in result:
                error = result["contact_area_error"].values
                relative = error / (result["contact_area"].values + error)
            elif self.follows in ("approach", "gap") and "approach_error" in result:
                size = values if self.follows == "approach" else result["mean_gap"].values / 6
                relative = result["approach_error"].values / np.abs(size)
            else:
                relative = result["stated_error"].values * float(np.nanmax(np.abs(values))) / np.abs(values)
        return np.log1p(np.where(values == 0, np.nan, relative))


def _thermal_conductance(result: xr.Dataset, observe: Observe) -> xr.DataArray:
    found = conductance(result, **observe.get("conductance", {"resistivity": (1.0, 1.0)}))
    if "thermal_conductance" not in found:
        expected = "a study that observes a thermal conductance, not an electrical one"
        raise InputError(key="quantity", found="thermal_conductance", expected=expected)
    return found["thermal_conductance"]


def _leak_rate(result: xr.Dataset, observe: Observe) -> xr.DataArray:
    return leakage(result, **observe.get("leakage", {}))["leak_rate"]


#: Name -> quantity.
QUANTITIES = {
    one.name: one
    for one in (
        Observable("contact_area", octave_factor=2.0, follows="area"),
        Observable("mean_gap", follows="approach"),
        Observable("approach", follows="approach"),
        Observable("force"),
        Observable("friction_coefficient", octave_factor=1.8),
        Observable("leak_rate", _leak_rate, ("gap",), follows="gap"),
        Observable("thermal_conductance", _thermal_conductance, ("pressure",), 2.5, "area"),
    )
}


def quantities_of(case: Case) -> dict[str, Observable]:
    """Return the quantities that the results of a case have, by name."""
    slides = not isinstance(case.experiment, Loading) or case.experiment.program.slides
    return {name: one for name, one in QUANTITIES.items() if slides or name != "friction_coefficient"}


def quantity_of(case: Case, name: str) -> Observable:
    """Return a quantity by its name.

    Raises
    ------
    InputError
        If the results of the case have no such quantity.
    """
    known = quantities_of(case)
    return known[one_of("quantity", name, known)]
