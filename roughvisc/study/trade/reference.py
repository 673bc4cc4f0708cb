"""What settings are measured against: the closed form of a case where there is one, and its finest run."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.errors import ConvergenceError, InputError
from roughvisc.experiment.coarser import pressure_distance
from roughvisc.experiment.grid_error import TWO_GRIDS, grid_uncertainty
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
from roughvisc.study.statement.case import Case
from roughvisc.study.trade.bench import QUANTITIES, NotRun, TimedRuns
from roughvisc.study.trade.ladder import Setting, is_data
from roughvisc.topography.grid import spacing
from roughvisc.variables.axes import AXES, axis_of

Array = NDArray[np.float64]
Pressure = Callable[[Array, float], Array]
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

    return replace(growing, name="Hertz, Sneddon", pressure=pressure)


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


#: The reference's tolerance is the sharpest measured one over this.
_SHARPER = 5.0
#: How many times longer the cells are on which it is run again.
_SECOND, _THIRD = 2.0, 4.0


def _finest_grids(rungs: Sequence[Setting], data: bool) -> list[float]:
    """Grids that the finest run may be on, by how many times longer their cells are, the finest first."""
    measured = {setting.coarsening for setting in rungs}
    return [1.0] if data else sorted(c for c in measured if c <= max(1.0, min(measured)))


def all_grids(rungs: Sequence[Setting], data: bool) -> list[float]:
    """Grids of all runs, by how many times longer their cells are: of the settings, and of the finest run."""
    compared = {part * grid for grid in _finest_grids(rungs, data) for part in (1.0, _SECOND, _THIRD)}
    return sorted(compared | {setting.coarsening for setting in rungs if setting.coarsening >= 1 or not data})


class ReferenceRun:
    """The finest run of a case, on the finest grid that half of the time allows, and how far it may be off.

    Parameters
    ----------
    bench : TimedRuns
        Where it is run.
    rungs : sequence of Setting
        What is to be measured against it.
    data : bool
        Whether the grid is data: then it is on that one.

    Attributes
    ----------
    name : str
        What it is.
    time, grid : dict
        Quantity -> relative error that steps and grid may have left in it; missing where that is not known.

    Raises
    ------
    InputError
        If it would take longer than half of the time there is, or fails.
    """

    def __init__(self, bench: TimedRuns, rungs: Sequence[Setting], data: bool) -> None:
        fast = [setting for setting in rungs if setting.method == "fast"] or list(rungs)
        self._sharpest = min(setting.tolerance for setting in fast)
        candidates = [Setting(self._sharpest / _SHARPER, coarsening=grid) for grid in _finest_grids(rungs, data)]
        allowed = bench.left / 2
        self._bench = bench
        self._setting = next((one for one in candidates if bench.expected(one) <= allowed), candidates[-1])
        where = f"{bench.case.origin}: " if bench.case.origin else ""
        if (expected := bench.expected(self._setting)) > allowed:
            raise InputError(
                f"{where}surface: the reference run would take about {expected:.3g} s, "
                f"more than half of the {bench.left:.0f} s allowed: give a larger budget, or resample the surface"
            )
        try:
            self._dataset = bench.run(self._setting).dataset
        except NotRun as error:
            raise InputError(f"{where}the reference run: {error}") from error
        self.name = f"finest run: {bench.label(self._setting)}"
        self._of_coarsening = {self._setting.coarsening: dict.fromkeys(bench.quantities, 0.0)}
        self.time, self.grid = self._uncertainties()

    def check(self, setting: Setting) -> None:
        """Refuse a setting that is finer than what it would be measured against."""
        if setting.coarsening < self._setting.coarsening:
            raise NotRun("finer than the run to measure it against, for which there is no time")

    def errors(self, dataset: xr.Dataset) -> dict[str, float]:
        """Of a result with the same rows."""
        return differences(dataset, self._dataset, self._bench.quantities)

    def of_coarsening(self, factor: float) -> dict[str, float]:
        """Errors that a grid alone makes: of a run on it that is as sharp as the finest one."""
        if factor not in self._of_coarsening:
            self._run_on(factor)
        return self._of_coarsening[factor]

    def _run_on(self, factor: float) -> xr.Dataset | None:
        """The run on cells so many times longer, whose errors are kept; None where it cannot be had."""
        try:
            found = self._bench.run(replace(self._setting, coarsening=factor)).dataset
            self._of_coarsening[factor] = self.errors(found)
        except NotRun:
            self._of_coarsening[factor] = dict.fromkeys(self._bench.quantities, math.nan)
            return None
        return found

    def _uncertainties(self) -> tuple[dict[str, float], dict[str, float]]:
        """What the steps and what the grid leave unknown; missing where the runs for it cannot be had."""
        names, own, fine = self._bench.quantities, self._setting.coarsening, self._dataset
        unknown = dict.fromkeys(names, math.nan)
        try:
            looser = self.errors(self._bench.run(replace(self._setting, tolerance=self._sharpest)).dataset)
        except NotRun:
            return unknown, unknown
        # the error follows the tolerance, unevenly: hence the larger safety factor
        in_time = {name: TWO_GRIDS * value / (_SHARPER - 1) for name, value in looser.items()}
        if (second := self._run_on(_SECOND * own)) is None:
            return in_time, unknown
        third = self._run_on(_THIRD * own)
        near = self._of_coarsening[_SECOND * own]
        far = unknown if third is None else differences(third, second, names)
        ratio = math.sqrt(fine.sizes["x"] * fine.sizes["y"] / (second.sizes["x"] * second.sizes["y"]))
        moving = "friction_coefficient" in fine
        return in_time, {
            name: float(grid_uncertainty(name, near[name], far[name], ratio, moving=moving)) for name in names
        }


def differences(found: xr.Dataset, wanted: xr.Dataset, quantities: Sequence[str]) -> dict[str, float]:
    """Differences between results with the same rows: the worst of the rows, over the largest value of the second.

    The pressure's is its absolute difference summed (L1) over the largest force. What neither has in a row, such as
    friction before anything is pressed, does not differ there.

    Raises
    ------
    NotRun
        If the rows lie at other places.
    """
    rows = axis_of(wanted.dims)
    if found[rows].shape != wanted[rows].shape or not np.allclose(found[rows], wanted[rows], rtol=1e-9, atol=0):
        raise NotRun(f"its {AXES[rows].rows} are others than those of the run to measure it against")
    largest = float(wanted["force"].max())
    errors = dict.fromkeys(quantities, math.nan)
    for name in quantities:
        if name == "pressure":
            errors[name] = float(pressure_distance(found, wanted).max()) / largest if largest else math.nan
        elif name in found and name in wanted:
            one, other = found[name].values, wanted[name].values
            errors[name] = relative(np.where(np.isnan(one) & np.isnan(other), 0.0, one - other), other)
    return errors


def relative(difference: Array, values: Array) -> float:
    """Largest difference over the largest value; missing where all values are zero."""
    largest = float(np.fmax.reduce(np.abs(values), initial=0.0))
    return float(np.max(np.abs(difference))) / largest if largest else np.nan
