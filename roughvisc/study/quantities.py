"""Quantities whose error is asked for: what each takes from a result, and how the grid's error of it behaves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.experiment.base import Experiment
from roughvisc.experiment.loading import Loading
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.observables.conductance import conductance
from roughvisc.observables.frozen import incremental_stiffness
from roughvisc.observables.leakage import leakage
from roughvisc.study.case import Case

Array = NDArray[np.float64]
#: Keyword arguments of the observables, as ``[observe]`` of a study states them.
Observe = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Observable:
    """A number that a result has at each of its rows.

    Attributes
    ----------
    name, units : str
        As in a result.
    derive : callable, optional
        Gives it over the axis, from a result and the arguments of its observable. Default: the result holds it.
    fields : tuple of str
        Fields that it is derived from.
    grid_factor : float
        Error of the grid over the difference to cells twice as long: Roache's factor of two grids, at the order 1.5.
        The larger factors, and the next, were chosen on 45 rough surfaces, and what they hold was measured on 45 others
        (workflows/benchmarks/whole_error.py).
    octave_factor : float
        What the next octave of waves changes at most, over what the last one did.
    stated : callable, optional
        Error that the rows of a result state of it, in its unit. Default: the stated error of the row over the largest
        value, which holds for any quantity that follows pressure or approach in proportion.
    """

    name: str
    units: str
    derive: Callable[[xr.Dataset, Observe], xr.DataArray] | None = None
    fields: tuple[str, ...] = ()
    grid_factor: float = 3 / (2**1.5 - 1)
    octave_factor: float = 1.1
    stated: Callable[[xr.Dataset, Array], Any] | None = None

    def of(self, result: xr.Dataset, case: Case) -> Array:
        """Its values in a whole result of a case, over the axis, observed as the study says."""
        if self.derive is None:
            return np.asarray(result[self.name].values, dtype=float)
        return np.asarray(self.derive(result, case.observed()).values, dtype=float)

    def stated_error(self, result: xr.Dataset, values: Array) -> Array:
        """What steps and solver leave of its logarithm, as the rows of a result state it. [-]"""
        error = None if self.stated is None else self.stated(result, values)
        if error is None:
            error = result["stated_error"].values * float(np.nanmax(np.abs(values)))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.log1p(np.asarray(error, dtype=float) / np.abs(values))


def _leak_rate(result: xr.Dataset, observe: Observe) -> xr.DataArray:
    return leakage(result, **observe.get("leakage", {}))["leak_rate"]


def _thermal(result: xr.Dataset, observe: Observe) -> xr.DataArray:
    stated = dict(observe.get("conductance", {}))
    found = conductance(result, **stated) if stated else conductance(result, (1.0, 1.0), kind="thermal")
    if "thermal_conductance" not in found:
        raise InputError(
            "quantity is 'thermal_conductance': the study observes an electrical one: expected a thermal one"
        )
    return found["thermal_conductance"]


def _stiffness(result: xr.Dataset, observe: Observe) -> xr.DataArray:
    return incremental_stiffness(result)["incremental_stiffness"]


def _of_approach(result: xr.Dataset, values: Array) -> Any:
    """The mean gap of a periodic surface is off by the error of the approach too."""
    return result["approach_error"].values if "approach_error" in result else None


def _of_area(result: xr.Dataset, values: Array) -> Any:
    """In proportion to the contact area, whose error is stated."""
    if "contact_area_error" not in result:
        return None
    error = result["contact_area_error"].values
    upper = result["contact_area"].values + error
    return np.abs(values) * np.divide(error, upper, out=np.zeros_like(upper), where=upper > 0)


def _of_gap(result: xr.Dataset, values: Array) -> Any:
    """A leak rate changes by up to six times as much as the mean gap, near the load that closes the gap."""
    if "approach_error" not in result:
        return None
    gap = np.abs(result["mean_gap"].values)
    return np.abs(values) * np.divide(6 * result["approach_error"].values, gap, out=np.zeros_like(gap), where=gap > 0)


_CONDUCTED: dict[str, Any] = {"fields": ("pressure",), "grid_factor": 2.5, "octave_factor": 2.5, "stated": _of_area}
#: name -> quantity
QUANTITIES = {
    one.name: one
    for one in (
        Observable("contact_area", "m^2", octave_factor=1.6, stated=_of_area),
        Observable("mean_gap", "m", stated=_of_approach),
        Observable("approach", "m", stated=_of_approach),
        Observable("force", "N"),
        Observable("friction_coefficient", "1", octave_factor=1.8),
        Observable("leak_rate", "m^3/s", _leak_rate, ("gap",), stated=_of_gap),
        Observable("thermal_conductance", "W/K", _thermal, **_CONDUCTED),
        Observable("incremental_stiffness", "N/m", _stiffness, **_CONDUCTED),
    )
}


def is_sliding(experiment: Experiment) -> bool:
    """Return whether the surface slides."""
    return not isinstance(experiment, Loading) or bool(experiment.program.slides)


def creep_time(experiment: Experiment, size: float) -> float:
    """Return the time till which the material under a surface of a length [m] creeps.

    It is the end of the program, or the time in which the surface slides by its length at the lowest speed. [s]
    """
    if isinstance(experiment, Loading):
        return experiment.program.duration
    assert isinstance(experiment, SteadySliding)
    return size / min(experiment.asked)


def observables_of(case: Case) -> list[str]:
    """Names of the quantities that the results of a case have."""
    slides = is_sliding(case.experiment())
    return [one for one in QUANTITIES if slides or one != "friction_coefficient"]


def known_quantity(name: Any, case: Case) -> Observable:
    """A quantity by its name, where the results of a case have it.

    Raises
    ------
    InputError
        If there is none of that name, or the results do not hold it.
    """
    if name not in QUANTITIES:
        raise InputError(key="quantity", found=name, expected=f"one of {', '.join(QUANTITIES)}")
    if name == "friction_coefficient" and name not in observables_of(case):
        raise InputError(key="quantity", found=name, expected="a number of a surface that does not slide")
    return QUANTITIES[name]
