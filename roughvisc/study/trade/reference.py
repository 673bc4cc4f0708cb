"""Closed form of a case, where there is one, and the error of a result against it."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.experiment.scene import kept_times
from roughvisc.mechanics.bodies.half_space import HALF_SPACE
from roughvisc.mechanics.closed_forms import (
    Cone,
    Indenter,
    Paraboloid,
    lee_radok,
    punch_approach,
    reduced_contact,
    ting,
)
from roughvisc.mechanics.materials.models import Material, Prony
from roughvisc.mechanics.stepping.program import Program
from roughvisc.study.quantities import QUANTITIES as DERIVED
from roughvisc.study.statement.case import Case
from roughvisc.study.trade.ladder import is_data
from roughvisc.topography.grid import spacing
from roughvisc.variables.axes import AXES

Array = NDArray[np.float64]


Pressure = Callable[[Array, float], Array]


#: What is compared, in the order of the results; and where something slides.
QUANTITIES = ("pressure", "approach", "contact_area", "contact_area_counted", "mean_gap")


SLIDING_QUANTITIES = ("friction_coefficient",)


#: A cell whose centre has no finite pressure is averaged over so many points each way.
_POINTS = 32


@dataclass(frozen=True)
class ClosedForm:
    """What is known of an axisymmetric contact at some times.

    Attributes
    ----------
    name : str
        Whose solution it is.
    centre : tuple of float
        Of the contact. [m]
    times, radius, approach : ndarray
        [s], [m], [m]
    pressure : callable or None
        Pressure at distances from the centre [m] and a time [s], where that is known. [Pa]
    growing : Indenter or None
        The indenter, if the contact has never been larger: then its displacement is the elastic one of its radius.
    """

    name: str
    centre: tuple[float, float]
    times: Array
    radius: Array
    approach: Array
    pressure: Pressure | None = None
    growing: Indenter | None = None

    @property
    def quantities(self) -> tuple[str, ...]:
        """The quantities that it knows."""
        known = {"pressure": self.pressure is not None, "mean_gap": self.growing is not None}
        return tuple(name for name in QUANTITIES if known.get(name, True))

    def errors(self, dataset: xr.Dataset) -> dict[str, float]:
        """Errors of a result at these times: the worst over the times, over the largest exact value."""
        area = np.pi * self.radius**2
        wanted = {"approach": self.approach, "contact_area": area, "contact_area_counted": area}
        found = {name: relative(dataset[name].values - exact, exact) for name, exact in wanted.items()}
        offsets = (dataset[axis].values - at for axis, at in zip(("x", "y"), self.centre, strict=True))
        x, y = np.meshgrid(*offsets, indexing="ij")
        if self.pressure is not None:
            found["pressure"] = self._pressure_error(dataset, x, y)
        if self.growing is not None:
            gap = self._mean_gap(np.hypot(x, y), np.isfinite(dataset["height"].values))
            found["mean_gap"] = relative(dataset["mean_gap"].values - gap, gap)
        return found

    def _pressure_error(self, dataset: xr.Dataset, x: Array, y: Array) -> float:
        assert self.pressure is not None
        sides = spacing(dataset)
        distance, back = np.unique(np.round(np.hypot(x, y) / sides[0], 9), return_inverse=True)
        distance, back = distance * sides[0], back.reshape(x.shape)
        worst = 0.0
        for n, (time, radius) in enumerate(zip(self.times, self.radius, strict=True)):
            exact = np.zeros(distance.shape)
            inside = distance < radius
            exact[inside] = self.pressure(distance[inside], float(time))
            field = exact[back]
            for i, j in np.argwhere(~np.isfinite(field)):  # a cone's apex
                field[i, j] = self._cell_mean(x[i, j], y[i, j], sides, float(time))
            difference = np.abs(dataset["pressure"][n].values - field).sum() * sides[0] * sides[1]
            worst = max(worst, float(difference))
        largest = float(dataset["force"].max())
        return worst / largest if largest else np.nan

    def _cell_mean(self, x: float, y: float, sides: list[float], time: float) -> float:
        assert self.pressure is not None
        points = (np.arange(_POINTS) + 0.5) / _POINTS - 0.5
        r = np.hypot(x + points[:, None] * sides[0], y + points * sides[1]).ravel()
        return float(np.mean(self.pressure(r, time)))

    def _mean_gap(self, r: Array, present: NDArray[np.bool_]) -> Array:
        assert self.growing is not None
        means = []
        for radius, approach in zip(self.radius, self.approach, strict=True):
            gap = self.growing.height(r) + self.growing.displacement(r, radius) - approach
            means.append(np.mean(np.where(r > radius, np.maximum(gap, 0.0), 0.0)[present]))
        return np.array(means)


def quantities_of(case: Case) -> tuple[str, ...]:
    """What can be compared in the results of a case."""
    experiment = case.experiment()
    names = QUANTITIES + (SLIDING_QUANTITIES if experiment.largest_speed > 0 else ())
    return tuple(name for name in names if name in AXES[experiment.axis].variables)


def further_quantities_of(case: Case) -> tuple[str, ...]:
    """What else can be: what is derived from the fields of the results, and what is given in most."""
    experiment, usual = case.experiment(), quantities_of(case)
    slides = experiment.largest_speed > 0
    has = (name for name, one in DERIVED.items() if one.fields or name in AXES[experiment.axis].variables)
    return tuple(name for name in has if name not in usual and (slides or name not in SLIDING_QUANTITIES))


def relative(difference: Array, values: Array) -> float:
    """Largest difference over the largest value; missing where all values are zero."""
    largest = float(np.fmax.reduce(np.abs(values), initial=0.0))
    return float(np.max(np.abs(difference))) / largest if largest else np.nan


def closed_form(case: Case, times: Array | None = None) -> ClosedForm | None:
    """The closed form of a case at some times [s], the one that knows most; None where there is none.

    Without times it is that at those which the case keeps.

    Spheres, cones and flat punches in free space have one, under loads that grow, have one maximum, or any history;
    the last is a reduction to independent elements, accurate to some millionths.
    """
    surface = case.settings.surface
    recipe = getattr(surface, "generate", "")
    if (
        case.settings.program is None
        or case.body().kernel != HALF_SPACE
        or case.settings.solve.boundary != "free"
        or is_data(case)
        or getattr(surface, "exact", False)
    ):
        return None
    centre = (surface.size[0] / 2, surface.size[1] / 2)
    material, program = case.material(), case.program().on_area(math.prod(surface.size))
    if times is None:
        times = np.array(kept_times(program, case.solving().times))
    if recipe == "flat_punch":
        return _punch(surface.radius, centre, material, program, times)
    if recipe not in ("sphere", "cone"):
        return None
    indenter: Indenter = Paraboloid(surface.radius) if recipe == "sphere" else Cone(surface.slope)
    growing = None
    with suppress(InputError):
        grown = lee_radok(indenter, material, program)
        growing = ClosedForm("Lee and Radok", centre, times, grown.radius(times), grown.approach(times), None, indenter)
        if _is_elastic(material):
            return _elastic(growing, indenter, material)
    with suppress(InputError):
        if isinstance(material, Prony) and material.glassy > 0 and not _is_elastic(material):
            one = ting(indenter, material, program)
            radius, approach = one.radius(times), one.approach(times)
            name = "Lee and Radok, Ting" if growing else "Ting and Graham"
            return ClosedForm(name, centre, times, radius, approach, one.pressure, indenter if growing else None)
    if growing is not None:
        return growing
    with suppress(InputError, ConvergenceError):
        found = reduced_contact(indenter, material, program, times)
        return ClosedForm("reduction to independent elements", centre, times, found.radius, found.approach)
    return None


def _is_elastic(material: Material) -> bool:
    return isinstance(material, Prony) and material.glassy > 0 and not (len(material.times) or material.fluidity)


def _elastic(growing: ClosedForm, indenter: Indenter, material: Material) -> ClosedForm:
    """Hertz or Sneddon: the pressure is that of the present radius."""
    modulus = 1 / float(material.contact_compliance(0.0))
    radius = dict(zip(growing.times.tolist(), growing.radius.tolist(), strict=True))

    def pressure(r: Array, t: float) -> Array:
        return modulus * indenter.scaled_pressure(r, radius[t])

    return ClosedForm(
        "Hertz, Sneddon", growing.centre, growing.times, growing.radius, growing.approach, pressure, indenter
    )


def _punch(
    radius: float, centre: tuple[float, float], material: Material, program: Program, times: Array
) -> ClosedForm | None:
    """The approach under a punch whose contact is whole; its pressure is singular at the edge, and left out."""
    loads = [segment for segment in program.segments if segment.end is not None]
    if not loads or any(segment.end <= 0 for segment in loads if segment.end is not None):
        return None
    with suppress(InputError):
        approach = punch_approach(radius, material, program, times)
        at_once = program.segments[0].duration == 0 and float(material.contact_compliance(0.0)) > 0
        touching = np.where((times > 0) | at_once, radius, 0.0)
        return ClosedForm("flat punch", centre, times, touching, np.asarray(approach))
    return None
