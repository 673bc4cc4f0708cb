"""Accuracy of a result: the memory of the body for the kept rows, stated errors, and warnings."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.experiment.kept_times import kept_times
from roughvisc.experiment.profile import Profile
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.contact.solver import PERIMETER_CORRECTION
from roughvisc.mechanics.grid import namespace
from roughvisc.mechanics.materials.material import Material, Prony
from roughvisc.mechanics.materials.models import creep_series
from roughvisc.mechanics.memory import SERIES_SHARE, Memory, choose_memory
from roughvisc.mechanics.program import Program
from roughvisc.mechanics.scene import Scene
from roughvisc.mechanics.step_control import SHORTEST_PAIR, least_approach
from roughvisc.mechanics.stepping import Step
from roughvisc.settings import Settings
from roughvisc.topography.borders import JUMP, border_mismatch
from roughvisc.topography.grid import squared_slopes
from roughvisc.topography.recipes import indenter_of, is_analytic
from roughvisc.units import format_quantity
from roughvisc.variables import VARIABLES

Array = NDArray[np.float64]
#: Errors inherited from the contact solver in earlier steps, over its largest error so far: of the pressure, and of the
#: approach. With 0.25 4.3 % of rows are off by more than is stated for the solver, with 0.5 1.6 %, with 1 1.3 %
#: (`inherited_errors.py`).
INHERITED = 0.5
INHERITED_APPROACH = 0.06
#: Least stated error of the pressure of an elastic body, over the tolerance. Measured on rows whose other errors are
#: small.
LEAST = 0.015
#: Error of the work of an elastic body due to the contact solver, over its error of the pressure times the largest
#: force and approach. An error ``dp`` of the pressure changes the stored energy by the integral of ``u dp``, and the
#: displacement ``u`` of a contact cell lies between zero and the approach. Under a given load the integral of ``dp``
#: vanishes, so ``u`` may count from half the approach.
OF_WORK = {"approach": 1.0, "load": 0.5}
#: The same for a body with memory, whose work is an integral over steps with independent errors.
OF_WORK_OF_STEPS = 0.2
#: Error of the pressure at the edge of contact, over the mean error of the pressure.
SOLVER_AT_EDGE = 3.0
#: Unrecovered part of the creep after a period from which a result warns. Measured error of the friction of a sphere on
#: a period of 6 to 11 contact radii, with a retarded compliance of 1 and 9 times the instantaneous one: 0.4 to 0.6 % if
#: 1e-6 of the creep is left, 5 to 6 % if 1 to 2 % are left, 26 % if 7 to 12 % are left.
_LEFT = 0.01
#: A contact is a single one if a gap without contact spans at least this part of the period along the motion.
_FREE = 0.25
#: Root mean square slope beyond which a result warns. The half-space is loaded as if its surface were flat. The error
#: is of the order of the ratio of surface to projected area less one, ``slope^2 / 2``, here 4.5 % (K. L. Johnson,
#: Contact Mechanics, CUP, 1985, section 4.1: slopes and strains are taken to be small).
LARGEST_SLOPE = 0.3
#: Largest share of filled points of a surface without a warning.
LARGEST_FILLED = 0.05


def memory_of(body: Body, program: Program, settings: Settings, **options: Any) -> Memory:
    """Return the memory of a body for the kept rows of a program.

    Parameters
    ----------
    body, program, settings
        Body, program and settings of the case.
    **options
        Further arguments of :func:`~roughvisc.mechanics.memory.choose_memory`.
    """
    return choose_memory(body, program.duration, settings.tolerance, shortest_age(program, settings), **options)


def shortest_age(program: Program, settings: Settings) -> float:
    """Return the shortest age above zero at which the compliance affects the kept rows. [s]

    Zero for a program of jumps alone.

    Notes
    -----
    Let ``h`` be the shortest interval between a corner of the program and the next kept time. Only
    pressure applied in the last part ``f`` of the interval has an age below ``f h``. If the compliance is exact at age
    zero, its error at these ages is at most the creep, which is less than ``f C(h)`` over the interval. With ``f`` a
    tenth of the tolerance this equals the error allowed at longer ages. No step is shorter than a millionth of a
    segment, so a smaller ``f`` is not needed.
    """
    shortest = math.inf
    kept = kept_times(program, settings.times)
    for segment in program.segments:
        if segment.duration > 0:
            shortest = min(shortest, segment.duration, segment.period)
    if math.isinf(shortest):
        shortest = 0.0
    elif kept is None:
        shortest *= SHORTEST_PAIR
    else:
        corners = np.array(program.corners)
        times = np.array(kept)
        after = np.searchsorted(times, corners, side="right")
        corners = corners[after < times.size]
        after = after[after < times.size]
        shortest = min(shortest, float(np.min(times[after] - corners, initial=math.inf)))
        shortest *= max(SERIES_SHARE * settings.tolerance, SHORTEST_PAIR)
    return shortest


def series_of_run(material: Material, program: Program, settings: Settings) -> Prony:
    """Return the series that replaces a creep function in a run, with the error of the series."""
    memory = memory_of(Body(material), program, settings)
    series = memory.series
    if not memory.series_error:
        return series
    return creep_series(
        series.glassy,
        series.fluidity,
        series.compliances,
        series.times,
        series.poisson,
        error=memory.series_error,
        shortest=memory.shortest,
        longest=program.duration,
        early=memory.early,
    )


def error_columns(step: Step, scene: Scene) -> dict[str, float]:
    """Return the stated errors of a step.

    Parameters
    ----------
    step, scene : Step, Scene
        An accepted step.

    Returns
    -------
    dict
        ``time_error`` of the time steps alone [-], ``stated_error`` [-], ``residual`` [-], ``force_error`` [N],
        ``approach_error`` [m], ``work_error`` [J].

    Notes
    -----
    The stated error is the sum of the errors of the time steps, of the contact solver in this and earlier steps, and
    of the series. Under a given load the solver's error of the approach is the duality gap over the load, which is of
    second order in the error of the pressure. Errors of pressure, force and approach are relative to the largest
    values of the kept rows so far and of the step. Errors of the series and of the work are computed with the largest
    values of all steps: values left after unloading are differences of large values. Errors of the work add up. At the
    end of a pair the error of the solver in earlier steps contains that of the row itself.
    """
    point = step.point
    state = step.state
    error = step.errors
    control = scene.program.segments[step.segment].control
    given = scene.program.prescribes[step.segment]
    remembers = not scene.memory.is_elastic
    force_scale = max(state.kept_force, point.size)
    approach_scale = max(state.kept_approach, abs(point.approach))
    series_error = scene.memory.series_error  # from the shortest known age on
    loaded = max(state.largest_force, point.size, 1e-300)
    reached = max(state.largest_approach, abs(point.approach), 1e-300)
    age = point.time - scene.program.corners[step.segment]
    if age > 0 and scene.memory.early > 0:
        change = (
            (point.force - point.segment_start) / loaded
            if control == "load"
            else (point.approach - point.segment_start) / reached
        )
        share = 1.0 if age < scene.memory.shortest else min(abs(change), 1.0)
        series_error += share * scene.memory.error_of_young(age)
    of_force = series_error * loaded
    if remembers:
        solved = point.solver_error + INHERITED * state.solver_error
    else:
        solved = max(point.solver_error, LEAST * scene.tolerance * (force_scale > 0))
    work = abs(state.work_difference) + state.work_curved + state.work_relaxed
    of_work = OF_WORK_OF_STEPS if remembers else OF_WORK["load" if control == "load" else "approach"]
    work += (of_work * solved + series_error) * loaded * reached
    force = approach = 0.0
    if control == "approach" or not given:
        force = error.force + solved * point.size + of_force
    if control == "load" or not given:
        approach = error.approach + point.solver_error_approach + series_error * reached
        approach += INHERITED_APPROACH * state.solver_error * reached if remembers else 0.0
    stepped = error.pressure + error.shared
    pressure = (stepped + solved * point.size + of_force) / force_scale if force_scale > 0 else solved
    per_force = force_scale or math.inf
    per_approach = max(approach_scale or math.inf, least_approach(scene, point.time, force_scale))
    return {
        "time_error": max(stepped / per_force, error.force / per_force, error.approach / per_approach),
        "stated_error": max(pressure, force / per_force, approach / per_approach),
        "residual": point.solver_error,
        "force_error": force,
        "approach_error": approach,
        "work_error": work,
    }


def uncertain_area(
    pressure: Any, gap: Any, off: float, closed: float, cell_area: float, present: Any = None
) -> tuple[float, float]:
    """Return the area in contact and the area out of contact that the contact solver may misjudge. [m2]

    Parameters
    ----------
    pressure, gap : array, shape (nx, ny)
        Pressure in contact [Pa] and gap between the surfaces. [m]
    off : float
        Error of the pressure at the edge of contact. A contact cell of lower pressure may be open. [Pa]
    closed : float
        Displacement of a cell under this pressure. An open cell of smaller gap may be in contact. [m]
    cell_area : float
        Area of a cell. [m2]
    present : array of bool, shape (nx, ny), or None
        Cells with material; None: all.
    """
    count = namespace(pressure).count_nonzero
    closing = (pressure == 0) & (gap <= closed)
    if present is not None:
        closing &= present
    opening = (pressure > 0) & (pressure <= off)
    return cell_area * int(count(opening)), cell_area * int(count(closing))


def area_error(counted: float, area: float, inside: float, outside: float) -> float:
    """Return the error of the contact area due to uncertain cells. [m2]

    A cell that enters or leaves the contact changes the count by one cell and the staircase by at most its four faces.
    Its area exceeds the correction for its faces: the area grows with each cell, and never exceeds the count.

    Parameters
    ----------
    counted, area : float
        Contact area, counted and corrected for the grid. [m2]
    inside, outside : float
        Uncertain area in contact and out of contact. [m2]
    """
    most = 1 + 4 * PERIMETER_CORRECTION
    lower = max(area - most * inside, 0.0)
    upper = min(area + most * outside, counted + outside)
    return float(max(area - lower, upper - area))


# -------------------------------------------------------------------------------------------------- derived quantities


@dataclass(frozen=True)
class Stated:
    """Value with its stated error, both in one unit.

    Attributes
    ----------
    value : float
        The value; NaN if it does not exist.
    error : float
        Its stated error; NaN if it is not known.
    """

    value: float
    error: float = math.nan

    def over(self, divisor: Stated) -> Stated:
        """Return the ratio of two positive values; NaN if the divisor is zero, and without an error if it may be zero.

        The error is the distance to the largest ratio within both errors. The smallest ratio is nearer.

        Examples
        --------
        >>> Stated(6.0, 1.0).over(Stated(3.0, 1.0))
        Stated(value=2.0, error=1.5)
        """
        if not divisor.value > 0:
            return Stated(math.nan)
        ratio = self.value / divisor.value
        least = divisor.value - divisor.error
        return Stated(ratio, (self.error + abs(ratio) * divisor.error) / least if least > 0 else math.nan)


def columns_of(force: Stated, area: Stated, nominal: float, friction: Stated | None = None) -> dict[str, float]:
    """Return force, contact area and friction force of a row, and the quantities that follow, with their stated errors.

    Parameters
    ----------
    force, area : Stated
        Normal force [N] and contact area. [m2]
    nominal : float
        Area of all cells. [m2]
    friction : Stated, optional
        Friction force. [N]
    """
    quantities = {"force": force, "contact_area": area, "mean_contact_pressure": force.over(area)}
    if friction is not None:
        quantities |= {"friction_force": friction, "friction_coefficient": friction.over(force)}
    columns = {"contact_fraction": area.value / nominal}
    for name, quantity in quantities.items():
        columns |= {name: quantity.value, VARIABLES[name].error: quantity.error}
    return columns


# ---------------------------------------------------------------------------------------------------------- warnings


def border_warning(height: xr.DataArray) -> str:
    """Return a warning if opposite borders of a periodic surface [m] do not meet, else ''."""
    x, y = border_mismatch(height)
    if max(x, y) <= JUMP:
        return ""
    return (
        f"The surface repeats with a step: opposite borders differ {x:.2g} (x) and {y:.2g} times (y) as much as "
        "neighbouring rows. Use boundary = 'mirror'."
    )


def loaded_depth(height: xr.DataArray, fraction: float) -> float:
    """Return how far the loaded surface of a periodic contact reaches below the highest cell. [m]

    The loaded surface is twice as large as the contact, as the part of a ball above its approach is. It has the highest
    cells; under friction the contact lies on one side of its crest.

    Parameters
    ----------
    height : DataArray, dims (x, y)
        The rigid profile. [m]
    fraction : float
        Largest contact area over nominal area. [-]
    """
    heights = height.values[np.isfinite(height.values)]
    count = math.ceil(2 * fraction * heights.size)
    if count >= heights.size:
        return math.inf
    return float(heights.max() - np.partition(heights, -max(count, 1))[-max(count, 1)])


def filled_warning(height: xr.DataArray) -> str:
    """Return a warning if many points of a surface [m] were missing and are filled, else ''."""
    share = float(height["filled"].mean()) if "filled" in height.coords else height.attrs.get("filled_fraction", 0.0)
    if share <= LARGEST_FILLED:
        return ""
    return (
        f"{100 * share:.2g} % of the surface is filled because its points are missing: contact there is not measured. "
        "Crop to a part without holes, or state missing = 'absent' if they hold no material."
    )


def slope_warning(height: xr.DataArray, boundary: str, depth: float) -> str:
    """Return a warning if a surface is too steep for small slopes, else ''.

    Parameters
    ----------
    height : DataArray, dims (x, y)
        The rigid profile. [m]
    boundary : {"free", "periodic", "mirror"}
        Boundary of the grid.
    depth : float
        Depth of the loaded surface below the highest cell: in free space the largest approach at kept times, otherwise
        :func:`loaded_depth`. Only its slopes count. [m]
    """
    slope = math.sqrt(squared_slopes(height, boundary == "periodic", depth).mean())
    if not slope > LARGEST_SLOPE:
        return ""
    return (
        f"The rms slope of the loaded surface is {slope:.2g}: the method assumes small slopes, with an error of the "
        f"order of the squared slope. Beyond {LARGEST_SLOPE:g} the results are a rough estimate."
    )


def stands_alone(height: xr.DataArray, pressure: Array | None, axis: int) -> bool:
    """Return whether a periodic contact is a single one, from the recipe of its surface or from its pressure.

    Parameters
    ----------
    height : DataArray, dims (x, y)
        Heights. The contact of an indenter is single, the contact of a regular wave is not. [m]
    pressure : ndarray, shape (nx, ny), or None
        Pressure. The contact of any other surface is single if a gap without contact spans a quarter of the period or
        more. [Pa]
    axis : {0, 1}
        Axis of the motion.
    """
    if indenter_of(height) is not None:
        return True
    if is_analytic(height) or pressure is None or not (pressure > 0).any():
        return False
    touching = np.flatnonzero((pressure > 0).any(axis=1 - axis))
    count = pressure.shape[axis]
    free = np.diff(touching, append=touching[0] + count) - 1
    return bool(free.max() >= _FREE * count)


def wakes_of(scene: Scene, profile: Profile, pressure: Array | None) -> str:
    """Return a warning if contacts slide into each other's wake in a program, else ''.

    Parameters
    ----------
    scene, profile : Scene, Profile
        Input of the time stepping, and the surface.
    pressure : ndarray, shape (nx, ny), or None
        Pressure at the last kept time, if kept. [Pa]
    """
    wakes = []
    end = scene.program.duration
    for axis in (0, 1):
        period = profile.height.shape[axis] * profile.spacing[axis]
        path = 0.0
        left = dict[float, float]()
        for segment in scene.program.segments:
            if segment.slide is not None and segment.slide.axis == axis:
                path = path + segment.slide.distance
                speed = segment.slide.distance / segment.duration
                crept = scene.memory.compliance(min(period / speed, end))
                left[speed] = 1.0 - crept / scene.memory.compliance(end)
        # on a shorter path the contact does not reach the wake of its neighbour
        if path >= period / 2 and stands_alone(profile.height, pressure, axis):
            wakes.append(wake_warning(left, period))
    return " ".join(wakes)


def wake_warning(left: Mapping[float, float], period: float) -> str:
    """Return a warning if contacts slide into each other's wake, else ''.

    Parameters
    ----------
    left : mapping
        Speed of a single contact [m/s] -> unrecovered part of the creep after a period.
    period : float
        Period along the motion. [m]
    """
    speeds = sorted(speed for speed, share in left.items() if share >= _LEFT)
    if not speeds:
        return ""
    slowest = format_quantity(speeds[0], "m/s")
    where = f"at {slowest}" if len(speeds) == 1 else f"from {slowest} on"
    percent = float(f"{100 * max(left.values()):.2g}")
    return (
        f"The surface repeats every {format_quantity(period, 'm')}, and {where} the contact slides into the wake of "
        f"the one before: after a period up to {percent:g} % of the creep has not recovered. Friction and area are "
        "those of a row of such contacts; those of a single one are not known. Use a longer period."
    )
