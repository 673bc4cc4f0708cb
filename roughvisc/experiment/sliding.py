"""Steady sliding: a surface that slides at given speeds gives rows over speed."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from roughvisc.arguments import one_of
from roughvisc.errors import ConvergenceError, InputError
from roughvisc.experiment.accuracy import (
    Stated,
    area_error,
    border_warning,
    columns_of,
    loaded_depth,
    slope_warning,
    stands_alone,
    uncertain_area,
    wake_warning,
)
from roughvisc.experiment.base import Experiment, Row, Rows
from roughvisc.experiment.grid_error import (
    at_least,
    by_column,
    coarser_shape,
    counting_error,
    grid_uncertainty,
    hidden_opening,
    hidden_peak,
    missing_of_zero,
)
from roughvisc.experiment.memory_limit import curve_bytes, require_memory
from roughvisc.experiment.problem import Problem
from roughvisc.experiment.profile import Profile
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.contact.solver import contact_area
from roughvisc.mechanics.grid import arrays_of, to_host
from roughvisc.mechanics.heating import Heating, spot_count, surface_rise
from roughvisc.mechanics.program import Direction
from roughvisc.mechanics.steady_sliding import Sliding, SteadyState, steady_state
from roughvisc.mechanics.tangential import slope
from roughvisc.settings import OVER_TIME, Settings
from roughvisc.topography.framing import mirror
from roughvisc.topography.spectrum import resample_periodic
from roughvisc.units import Quantity, format_quantity, number, quantities
from roughvisc.variables import STATUS_MEANINGS, VARIABLES

log = logging.getLogger("roughvisc")

Array = NDArray[np.float64]

#: Direction -> quarter turns of the grid, counter-clockwise, after which the profile moves along +x.
_QUARTERS = {"x": 0, "-y": 1, "-x": 2, "y": 3}
# A profile is constant across the motion if its change there is below this fraction of its range.
_ROUNDING = 1e-12
#: Quantities that runs on different grids are compared by, in the order of their values.
_COMPARED = ("friction_force", "contact_area", "approach", "mean_gap")
#: Stated error of the area over the counting error at rest. On 24 rough surfaces, at three pressures and three speeds,
#: the stated error is then at least 0.8 of the true one, and 4.8 times as large in the median. With 1 and the orders of
#: a contact at rest the ratio was below 0.8 in 15 of these 216 cases.
_COUNTING_CAUTION = 1.5
#: The friction force from the slope is meaningful if it differs from the force from the power by at most this fraction.
#: At low speed on a rough surface it is the difference of two large forces. Then the error is at least the largest
#: change between the grids, up to the error of an area whose edge lies anywhere in its cells. Of 964 rows of line
#: contacts 1.1 % then state less than half of the true error of friction, 3.1 % without this term.
_MEANINGFUL = 0.1
# Largest difference between the rise of temperature and the rise by the heat of friction: relative, and in kelvin; and
# most temperatures that are tried.
_SAME_RISE = 1e-3
_SAME_TEMPERATURE = 0.01
_MOST_TEMPERATURES = 40
_MORE_INSTANTANEOUS = "a material with more instantaneous compliance"


@quantities(speeds="m/s", load="N > 0", pressure="Pa > 0")
@dataclass(frozen=True, kw_only=True)
class SteadySliding(Experiment):
    """Steady sliding at given speeds under a given load; see :func:`roughvisc.friction`.

    Parameters
    ----------
    speeds, load, pressure, direction, heating
        See :func:`roughvisc.friction`. The speeds become a tuple, in the order given.

    Raises
    ------
    InputError
        If a value is invalid, or both or neither of load and pressure are given.

    See Also
    --------
    roughvisc.friction, roughvisc.Case

    Examples
    --------
    >>> SteadySliding(speeds=[1e-3, 1.0], load=2.0)
    Steady sliding: 2 speeds from 1 mm/s to 1 m/s along x, under 2 N
    """

    speeds: Any
    load: Quantity | None = None
    pressure: Quantity | None = None
    direction: Direction = "x"
    heating: Heating | None = field(default=None, repr=False)

    axis: ClassVar[str] = "speed"
    boundary: ClassVar[Literal["free", "periodic"] | None] = "periodic"

    def __post_init__(self) -> None:
        speeds = np.atleast_1d(np.asarray(self.speeds, dtype=object)).tolist()
        if not speeds:
            raise InputError(key="speeds", found=self.speeds, expected="at least one speed [m/s]")
        positive = partial(number, unit="m/s", key="speeds", above=0)
        object.__setattr__(self, "speeds", tuple(map(positive, speeds)))
        one_of("direction", self.direction, _QUARTERS)
        if self.load is None and self.pressure is None:
            raise InputError(key="load", expected="a load, or a pressure")
        if self.load is not None and self.pressure is not None:
            raise InputError(key="pressure", found=self.pressure, expected=f"either this or the load, {self.load!r}")
        if self.heating is not None and not isinstance(self.heating, Heating):
            raise InputError(key="heating", found=self.heating, expected="rv.Heating(...)")

    def __repr__(self) -> str:
        ends = dict.fromkeys(format_quantity(speed, "m/s") for speed in (min(self.speeds), max(self.speeds)))
        count = f"{len(self.speeds)} speeds from " if len(self.speeds) > 1 else ""
        pressed = format_quantity(self.pressure or 0.0, "Pa") if self.load is None else format_quantity(self.load, "N")
        return f"Steady sliding: {count}{' to '.join(ends)} along {self.direction}, under {pressed}"

    def rows(self, problem: Problem, state: int | None = None, *, in_memory: bool = True) -> SlidingRows:
        """Return the steady states in the order of the speeds; the state is their number so far.

        With mirror boundaries the surface is unfolded first: sliding breaks the symmetry.
        """
        if problem.settings.boundary == "mirror":
            log.info("the surface is unfolded: it slides with its mirror images, on four times as many cells")
            settings = replace(problem.settings, boundary="periodic")
            problem = replace(problem, height=mirror(problem.height), settings=settings)
        return SlidingRows(problem, self, state or 0)

    def unsupported(self, settings: Settings, body: Body) -> Iterator[tuple[str, Any, str]]:
        """Yield the settings that steady sliding does not support: name, value and expected value."""
        if settings.boundary not in ("periodic", "mirror"):
            yield "boundary", settings.boundary, "'periodic' or 'mirror', because steady sliding repeats"
        if settings.boundary == "mirror" and self.load is not None:
            yield "boundary", "mirror", "a pressure for the surface, which is unfolded to four times its area"
        if "displacement" in settings.fields:
            yield "fields", "displacement", "some of pressure, gap in steady sliding"
        for name in OVER_TIME:
            if (value := getattr(settings, name)) != (usual := getattr(Settings, name)):
                yield name, value, f"the default in steady sliding, {usual!r}"

    def facts(self, body: Body, height: xr.DataArray) -> dict[str, Any]:
        """Return facts about the body after the time in which the surface slides past a point, at the lowest speed."""
        longest = max(float(np.ptp(height["x"].values)), float(np.ptp(height["y"].values)))
        return body.facts(longest / min(self.speeds)) | {"time_scale": math.inf}

    def progress(self, done: float, end: float) -> str:
        """Return the number of solved speeds, in words."""
        return f"speed {done:.0f} of {end:.0f}"


@dataclass(frozen=True)
class SlidingGrid:
    """Cells of a profile that slides along +x.

    Attributes
    ----------
    gap : ndarray, shape (nx, ny)
        Undeformed gap, with axis 0 along the motion; ``ny = 1`` if it does not change across the motion. [m]
    spacing : tuple of float
        Cell sides along and across the motion; if ``ny = 1`` the cell is as wide as the surface. [m]
    """

    gap: Array
    spacing: tuple[float, float]

    @classmethod
    def of(cls, gap: Array, spacing: tuple[float, float], direction: str) -> SlidingGrid:
        """Return the cells of a surface that slides in a direction, from its gap [m] and cell sides [m]."""
        turned = np.rot90(gap, _QUARTERS[direction])
        dx, dy = spacing[::-1] if _QUARTERS[direction] % 2 else spacing
        if float(np.ptp(turned, axis=1).max()) <= _ROUNDING * float(np.ptp(turned)):
            turned, dy = turned[:, :1], dy * turned.shape[1]
        return cls(np.ascontiguousarray(turned), (dx, dy))

    def law(self, body: Body, speed: float, tolerance: float) -> Body:
        """Return the body with materials that represent its own at the frequencies of a speed. [m/s]"""
        return body.over_frequencies(speed * 2 * np.pi * np.fft.fftfreq(self.gap.shape[0], self.spacing[0]), tolerance)


class Warm(NamedTuple):
    """Steady state at a temperature.

    Attributes
    ----------
    rise : float
        Temperature of the body above its temperature far from the contact. [K]
    seen : float
        Speed times the shift factor of the temperature, which the material sees. [m/s]
    law : Body
        Body whose materials represent its own at this speed.
    state : SteadyState
        Steady state.
    sliding : Sliding
        Operator of the body at this speed.
    """

    rise: float
    seen: float
    law: Body
    state: SteadyState
    sliding: Sliding


class SlidingRows(Rows):
    """Steady states of one curve, in the order of the speeds.

    Parameters
    ----------
    problem : Problem
        Surface, body and settings.
    curve : SteadySliding
        Speeds, load and direction.
    found : int
        Number of speeds already solved, the first ones.
    """

    def __init__(self, problem: Problem, curve: SteadySliding, found: int = 0) -> None:
        self._body = problem.body
        self._curve = curve
        self._settings = problem.settings
        self._done = found
        profile = Profile(problem.height, "refuse")
        shape = (profile.gap.shape[0], profile.gap.shape[1])
        settings = problem.settings
        require_memory(shape, partial(curve_bytes, settings), device=settings.device)
        if not profile.all_present:  # a punch has absent cells by its recipe
            raise InputError("height is missing at some points: expected none, because the surface repeats")
        self.problem = replace(problem, height=profile.height)
        self.end = len(curve.speeds)
        self.profile = profile
        self._force = float(curve.load) if curve.load is not None else float(curve.pressure or 0.0) * profile.area
        #: The grid of the surface, and up to two coarser grids for the error of the grid.
        self._grids = [SlidingGrid.of(profile.gap, profile.spacing, curve.direction)]
        self._period = self._grids[0].gap.shape[0] * self._grids[0].spacing[0]
        if problem.settings.grid_error:
            nx, ny = self._grids[0].gap.shape
            dx, dy = self._grids[0].spacing
            for factor in (2.0, 4.0):  # on longer cells, with the waves that these can resolve
                few = coarser_shape((nx, ny), factor, False)
                if few != self._grids[-1].gap.shape:
                    gap = resample_periodic(self._grids[0].gap, few, first_kept=True)
                    gap = np.ascontiguousarray(gap - gap.min())
                    self._grids.append(SlidingGrid(gap, (dx * nx / few[0], dy * ny / few[1])))
            if len(self._grids) == 1:
                log.warning("no grid error: %d x %d cells cannot be coarsened", *profile.gap.shape)

    def __iter__(self) -> Iterator[Row]:
        """Slide at each speed."""
        for done, speed in enumerate(self._curve.speeds[self._done :], self._done + 1):
            warm = self._warmed(speed)
            states = []
            runs = []
            for cells in self._grids:
                state = warm.state
                sliding = warm.sliding
                if cells is not self._grids[0]:
                    state, sliding = self._steady(cells, warm.law, speed, warm.seen)
                pressure = to_host(state.pressure)
                contact = to_host(state.pressure) > 0
                gap = np.where(contact, 0.0, np.maximum(cells.gap + to_host(state.displacement) - state.approach, 0.0))
                counted, area, _ = contact_area(contact, ~contact, math.prod(cells.spacing), "periodic")
                states.append((state, sliding, pressure, gap, counted, area))
                runs.append((state.power_force, area, state.approach, float(gap.mean())))
            row, fields = self._row(*states[0])  # on the grid of the surface
            pressure = states[0][2]
            creep = 0.0
            if self._settings.grid_error:
                row |= sliding_grid_errors(self._grids, pressure, runs)
            if stands_alone(self.profile.height, pressure, 0):
                for material in warm.law.materials:  # without an end of the creep nothing counts as recovered
                    crept = float(material.contact_compliance(self._period / warm.seen))
                    creep = max(creep, 1.0 - crept / float(material.contact_compliance(math.inf)))
            row["creep_left"] = creep  # left when the next contact arrives
            if self._curve.heating is not None:
                row["temperature"] = self._curve.heating.temperature + warm.rise
            yield Row(speed, row, fields, state=done, done=float(done))

    def _steady(self, cells: SlidingGrid, law: Body, speed: float, seen: float) -> tuple[SteadyState, Sliding]:
        """Return the steady state on a grid at a speed, which the body sees times its shift factor. [m/s]"""
        xp = arrays_of(self._settings.device)
        sliding = Sliding(law, cells.gap.shape, cells.spacing, seen, xp)
        try:
            state = steady_state(sliding, xp.asarray(cells.gap), self._force, tolerance=self._settings.tolerance)
        except ConvergenceError as error:
            softer = "layers whose moduli differ less" if len(law.materials) > 1 else _MORE_INSTANTANEOUS
            advice = f"try a looser tolerance, a coarser grid, or {softer}"
            raise ConvergenceError(f"at {format_quantity(speed, 'm/s')}: {error}; {advice}") from error
        return state, sliding

    def _at(self, speed: float, rise: float) -> Warm:
        """Return the steady state at a speed [m/s] on the grid of the surface, at a rise of temperature. [K]"""
        heating = self._curve.heating
        grid = self._grids[0]
        seen = speed if heating is None else speed * float(heating.shift_factor(rise))
        law = grid.law(self._body, seen, 0.1 * self._settings.tolerance)  # a table needs a fit
        return Warm(rise, seen, law, *self._steady(grid, law, speed, seen))

    def _warmed(self, speed: float) -> Warm:
        """Return the steady state at a speed [m/s] and at the temperature that the heat of friction makes.

        Heat reduces friction exponentially. So the method of false position (Illinois) works on the logarithms of the
        rises. The number of spots jumps when they merge: the interval may end around a jump.
        """
        warm = self._at(speed, 0.0)
        if self._curve.heating is None or (rise := self._rise(warm, speed)) <= _SAME_TEMPERATURE:
            return warm
        was_cold = False
        ends: dict[bool, tuple[float, float]] = {}  # too cold or not -> logarithms of the rise and of its excess
        for _ in range(_MOST_TEMPERATURES):
            warm = self._at(speed, rise)
            excess = math.log(max(self._rise(warm, speed), _SAME_TEMPERATURE**2) / rise)
            is_cold = excess > 0
            allowed = max(_SAME_RISE, _SAME_TEMPERATURE / rise)
            if abs(excess) <= allowed or (len(ends) == 2 and abs(ends[True][0] - ends[False][0]) <= allowed):
                return warm
            if len(ends) == 2 and is_cold == was_cold:
                place, value = ends[not is_cold]
                ends[not is_cold] = place, value / 2
            ends[is_cold] = math.log(rise), excess
            was_cold = is_cold
            if len(ends) == 1:
                rise *= math.exp(2 * excess if is_cold else excess)
            else:
                cold, above = ends[True]
                hot, below = ends[False]
                rise = math.exp((hot * above - cold * below) / (above - below))
        advice = "try other thermal properties, or a lower speed"
        raise ConvergenceError(f"at {format_quantity(speed, 'm/s')}: no temperature of the contact; {advice}")

    def _rise(self, warm: Warm, speed: float) -> float:
        """Return the rise of temperature by the heat of friction at a speed [m/s], in the mean spot. [K]"""
        heating = self._curve.heating
        pressure = to_host(warm.state.pressure)
        assert heating is not None
        area = contact_area(pressure > 0, pressure <= 0, math.prod(self._grids[0].spacing), "periodic")[1]
        radius = math.sqrt(area / (math.pi * spot_count(pressure)))
        flux = max(warm.state.power_force, 0.0) * speed / area
        return surface_rise(flux, radius, speed, heating.heat_conductivity, heating.volumetric_heat_capacity)

    def _row(
        self, found: SteadyState, sliding: Sliding, pressure: Array, gap: Array, counted: float, area: float
    ) -> tuple[dict[str, Any], dict[str, Array]]:
        """Return the variables of a steady state, and its fields in the frame of the surface."""
        force = self._force
        nominal = self.profile.area
        quarters = _QUARTERS[self._curve.direction]
        status = "full_contact" if (pressure > 0).all() else "converged"
        across = (found.pressure * sliding.slope(found.pressure, axis=1)).sum()
        stated_error = max(found.residual, found.friction_residual)
        closed = found.cell_error * sliding.self_influence
        uncertain = uncertain_area(pressure, gap, found.cell_error, closed, sliding.cell_area)
        row = columns_of(
            Stated(force, 0.0),
            Stated(area, area_error(counted, area, *uncertain)),
            nominal,
            # the residual of friction alone is below the true error in 5 % of the rows on rough surfaces
            Stated(found.power_force, stated_error * abs(found.power_force)),
        )
        row |= {
            "nominal_pressure": force / nominal,
            "approach": found.approach,
            "contact_area_counted": counted,
            "mean_gap": float(gap.mean()),
            "friction_force_across": -float(across) * sliding.cell_area,
            "stated_error": stated_error,
            "residual": found.residual,
            "convolutions": sliding.convolutions,
            "status": STATUS_MEANINGS.index(status),
        }
        fields = {}
        for name in self._settings.fields:
            turned = np.rot90({"pressure": pressure, "gap": gap}[name], -quarters)
            fields[name] = np.ascontiguousarray(np.broadcast_to(turned, self.profile.gap.shape))
        return row, fields

    def finish(self, dataset: xr.Dataset) -> tuple[xr.Dataset, dict[str, str]]:
        """Return the result with the direction, and its warnings."""
        height = self.problem.height
        speeds = dataset["speed"].values.tolist()
        left = dict(zip(speeds, dataset["creep_left"].values.tolist(), strict=True))
        warnings = {
            "slope": slope_warning(height, "periodic", loaded_depth(height, float(dataset["contact_fraction"].max()))),
            "border": border_warning(height),
            "wake": wake_warning(left, self._period),
        }
        return dataset.drop_vars("creep_left").assign_attrs(direction=self._curve.direction), warnings


def sliding_grid_errors(
    grids: Sequence[SlidingGrid], pressure: Array, runs: Sequence[tuple[float, float, float, float]]
) -> dict[str, float]:
    """Return the relative errors of friction, area, mean pressure, approach and gap that the grid causes at a speed.

    Parameters
    ----------
    grids : sequence of SlidingGrid
        Grid of the surface, and up to two coarser grids, the finest first.
    pressure : ndarray, shape (nx, ny)
        Pressure on the finest grid. [Pa]
    runs : sequence of tuple
        Friction force [N], contact area [m2], approach [m] and mean gap [m] on each grid.

    Returns
    -------
    dict
        Name of a variable -> error. NaN without friction, or without a coarser grid. The error of friction is NaN if no
        contact is three cells wide along the motion, the error of the gap if the gap is zero and may be open.
    """
    grid = grids[0]
    friction, _, deep, wide = runs[0]
    if len(grids) == 1 or friction <= 0:
        return {VARIABLES[name].grid_error: math.nan for name in (*_COMPARED, "mean_contact_pressure")}
    ratio = max(many / few for many, few in zip(grid.gap.shape, grids[1].gap.shape, strict=True))
    errors: dict[str, ArrayLike] = {}
    for name, values in zip(_COMPARED, np.transpose(runs), strict=True):
        near, far = np.append(np.abs(np.diff(values)) / max(abs(values[0]), 1e-300), math.nan)[:2]
        errors[name] = grid_uncertainty(name, near, far, ratio, moving=True)

    contact = pressure > 0
    hidden_area, hidden_gap = hidden_opening(pressure, -grid.gap, True)
    *_, faces = contact_area(contact, ~contact, 1.0, "periodic")
    counting = counting_error(contact, faces)
    # Friction from pressure times slope of the profile. The surface follows the profile at the centres of the contact
    # cells but not at the edges of contact; this is an error of the grid.
    inclined = float(np.sum(pressure * slope(grid.gap, grid.spacing[0], 0))) * grid.spacing[0] * grid.spacing[1]
    apart = abs(inclined / friction - 1)
    changes = float(np.abs(np.diff([run[0] for run in runs])).max()) / friction
    least = {
        "friction_force": apart if apart <= _MEANINGFUL else min(counting, changes),
        "contact_area": max(hidden_area, _COUNTING_CAUTION * counting),
        "approach": hidden_peak(-grid.gap, True) / max(abs(deep), 1e-300),
        "mean_gap": hidden_gap / max(wide, 1e-300),
    }
    if not _is_resolved(contact):
        errors["friction_force"] = math.nan
    columns = by_column(at_least(errors, least))
    of_gap = VARIABLES["mean_gap"].grid_error
    columns[of_gap] = missing_of_zero(columns[of_gap], wide)
    of_area = float(columns[VARIABLES["contact_area"].grid_error])
    of_pressure = Stated(1.0, 0.0).over(Stated(1.0, of_area)).error
    return {name: float(error) for name, error in columns.items()} | {
        VARIABLES["mean_contact_pressure"].grid_error: of_pressure
    }


def _is_resolved(contact: NDArray[np.bool_]) -> bool:
    """Return whether any contact is three cells wide along the motion; the surface repeats."""
    return bool((contact & np.roll(contact, 1, axis=0) & np.roll(contact, -1, axis=0)).any())
