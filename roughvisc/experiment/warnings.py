"""Warnings about a result: missed tolerances, steep slopes, borders that do not meet, wakes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from roughvisc.experiment.profile import Profile
from roughvisc.mechanics.materials.creep import Material
from roughvisc.mechanics.memory import Choice
from roughvisc.mechanics.stepping import Scene
from roughvisc.topography.borders import JUMP, border_mismatch, is_analytic
from roughvisc.topography.indenters import is_indenter
from roughvisc.topography.parameters import rms_slope
from roughvisc.units import format_quantity

Array = NDArray[np.float64]
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


def loading_warnings(
    scene: Scene, profile: Profile, dataset: xr.Dataset, choice: Choice, *, loaded: xr.DataArray, border: float | None
) -> dict[str, str]:
    """Return the warnings about a loading by subject; a text is empty if it does not apply.

    Parameters
    ----------
    scene, profile : Scene, Profile
        Input of the time stepping, and the surface.
    dataset : Dataset
        The result.
    choice : Choice
        Memory of the body.
    loaded : DataArray
        Heights of the domain, the part of the surface on which the contact was solved. [m]
    border : float or None
        End of the first step in which contact reached the border of a free surface. [s]
    """
    boundary, end, limit = scene.grid.boundary, scene.program.duration, scene.tolerance
    tolerance = edge = series = ""
    errors = dataset["stated_error"].values
    missed = errors[errors > limit]
    if missed.size:
        tolerance = (
            f"{missed.size} of {errors.size} rows {'states' if missed.size == 1 else 'state'} an error above the "
            f"tolerance {limit:g}, {missed.max():.3g} at worst (stated_error)."
        )
        if scene.time_step is not None:
            tolerance += " The time step is fixed, and not chosen by the tolerance."
        if scene.program.slides:
            tolerance += " A slide takes one cell a step: what its steps leave falls with the square of the cell alone."
    if border is not None:
        edge = (
            f"Contact reached the border of the surface, first in the step to {border:.3g} s: there the surface acts "
            "as a punch of its outline, whose edge carries pressure that no larger surface would have (edge = "
            '"accept").'
        )
    off = max(choice.series_error, choice.misfit)
    if off > limit:
        series = (
            f"The series in place of the material is {100 * off:.2g} % off at worst, more than the tolerance "
            f"{limit:g} (memory): no passive material comes nearer to it."
        )

    wakes, pressure = [], dataset["pressure"][-1].values if "pressure" in dataset else None
    for axis in (0, 1):
        period = profile.height.shape[axis] * profile.spacing[axis]
        path, left = 0.0, dict[float, float]()
        for segment in scene.program.segments:
            if segment.slide is not None and segment.slide.axis == axis:
                path, speed = path + segment.slide.distance, segment.slide.distance / segment.duration
                crept = scene.memory.compliance(min(period / speed, end))
                left[speed] = 1.0 - crept / scene.memory.compliance(end)
        # on a shorter path the contact does not reach the next wake
        if path >= period / 2 and stands_alone(profile.height, pressure, axis):
            wakes.append(wake_warning(left, period))

    approach = float(np.fmax.reduce(dataset["approach"].values)) - profile.least_gap  # below the highest cell
    return {
        "tolerance": tolerance,
        "slope": slope_warning(loaded, boundary, approach),
        "border": border_warning(profile.height) if boundary == "periodic" else "",
        "edge": edge,
        "wake": " ".join(filter(None, wakes)),
        "series": series,
    }


def table_warning(materials: Sequence[Material]) -> str:
    """Return the warnings of creep tables, such as rows more than a decade apart, else ''."""
    return " ".join(dict.fromkeys(filter(None, (one.warning for one in materials))))


def border_warning(height: xr.DataArray) -> str:
    """Return a warning if opposite borders of a periodic surface [m] do not meet, else ''."""
    x, y = border_mismatch(height)
    if max(x, y) <= JUMP:
        return ""
    return (
        f"The surface repeats with a step: opposite borders differ {x:.2g} (x) and {y:.2g} times (y) as much as "
        "neighbouring rows. Use boundary = 'mirror'."
    )


def slope_warning(height: xr.DataArray, boundary: str, approach: float) -> str:
    """Return a warning if a surface is too steep for small slopes, else ''.

    Parameters
    ----------
    height : DataArray, dims (x, y)
        The rigid profile. [m]
    boundary : {"free", "periodic", "mirror"}
        In free space only cells whose undeformed gap is at most the approach can touch, and only their slopes count.
    approach : float
        Largest approach at kept times, from the highest cell. [m]
    """
    slope = rms_slope(height, boundary == "periodic", approach if boundary == "free" else np.inf)
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
    if is_indenter(height):
        return True
    if is_analytic(height) or pressure is None or not (pressure > 0).any():
        return False
    touching = np.flatnonzero((pressure > 0).any(axis=1 - axis))
    count = pressure.shape[axis]
    free = np.diff(touching, append=touching[0] + count) - 1
    return bool(free.max() >= _FREE * count)


def wake_warning(left: Mapping[float, float], period: float) -> str:
    """Return a warning if contacts slide into each other's wake, else ''.

    Parameters
    ----------
    left : mapping
        Speed of a single contact [m/s] -> unrecovered part of the creep after a period.
    period : float
        Period along the motion. [m]
    """
    speeds = sorted(speed for speed, part in left.items() if part >= _LEFT)
    if not speeds:
        return ""
    slowest = format_quantity(speeds[0], "m/s")
    where = f"at {slowest}" if len(speeds) == 1 else f"from {slowest} on"
    percent = float(f"{100 * max(left[speed] for speed in speeds):.2g}")
    return (
        f"The surface repeats every {format_quantity(period, 'm')}, and {where} the contact slides into the wake of "
        f"the one before: after a period up to {percent:g} % of the creep has not recovered. Friction and area are "
        "those of a row of such contacts; those of a single one are not known. Use a longer period."
    )
