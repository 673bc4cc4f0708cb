"""What is known of a scene, from a result or from a case that has not run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from roughvisc.errors import InputError
from roughvisc.groups import whole_of
from roughvisc.labels import expect_declared_units
from roughvisc.mechanics.halfspace.sheet import Sheet
from roughvisc.mechanics.materials.protocol import complete
from roughvisc.study.audit.contact import Contact, contact_of
from roughvisc.study.audit.texture import Texture, loaded_slope, texture_of
from roughvisc.study.statement.body import BASE, separability_error
from roughvisc.study.statement.case import Case
from roughvisc.topography.grid import nominal_area
from roughvisc.variables import of_step


@dataclass(frozen=True)
class Body:
    """A deformable body: contact compliance at once and at the end of the program [1/Pa], and Poisson's ratio."""

    early: float
    late: float
    poisson: float


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What the verdicts rest on; NaN and None where it is not known.

    Attributes
    ----------
    boundary : {"free", "periodic"}
    size : tuple of float
        Of the surface. [m]
    texture : Texture or None
        Of the surface.
    slope : float
        Root mean square slope where it may be loaded. [-]
    early, late : float
        Contact compliance at once, and at the end of the program. [1/Pa]
    bodies : tuple of Body
        One or two of constant Poisson's ratio; none where these are not known.
    sheet : Sheet or None
        What was pressed, if no half-space.
    time_scale : float
        Shortest time in which what is prescribed changes. [s]
    speed, friction_power : float
        The largest of all slides; the speed is zero where nothing slides. [m/s], [W]
    force, approach, area : float
        Where the force is largest, at the last such time. [N], [m], [m2]
    fraction : float
        Contact fraction there.
    contact : Contact or None
        Pressures and spots there.
    ran : bool
        Whether there is a result.
    """

    boundary: str
    size: tuple[float, float]
    texture: Texture | None
    slope: float
    early: float
    late: float
    bodies: tuple[Body, ...] = ()
    sheet: Sheet | None = None
    time_scale: float = math.nan
    speed: float = 0.0
    friction_power: float = math.nan
    force: float = math.nan
    approach: float = math.nan
    area: float = math.nan
    fraction: float = math.nan
    contact: Contact | None = None
    ran: bool = True
    given: Mapping[str, Any] = field(default_factory=dict)

    @property
    def modulus(self) -> float:
        """Contact modulus at the end of the program, where the material is softest. [Pa]"""
        return 1 / self.late if self.late > 0 else math.nan

    @property
    def half_width(self) -> float:
        """Half of what is loaded: of the contact in free space, of the longer side under a surface that repeats. [m]"""
        if self.boundary == "periodic":
            return max(self.size) / 2
        return self.contact.half_width if self.contact else math.sqrt(self.area / math.pi)


def of_result(dataset: xr.Dataset) -> Evidence:
    """Evidence of a result.

    Raises
    ------
    InputError
        If it is no result of one case over time.
    """
    _check(dataset)
    dataset = whole_of(dataset)
    case = Case.from_json(dataset.attrs["case"]) if "case" in dataset.attrs else None
    attrs = _with_the_case(dataset.attrs, case)
    force = dataset["force"].values
    row = dataset.isel(time=int(np.flatnonzero(force >= force.max() * (1 - 1e-9))[-1]))  # crept as far as it has
    area = float(row.get("contact_area", math.nan))
    texture, size, slope = None, (math.nan, math.nan), math.nan
    if "height" in dataset:
        height = dataset["height"].load()
        texture = texture_of(height, attrs["boundary"], str(attrs.get("recipe", "")))
        size, slope = texture.size, loaded_slope(height, attrs["boundary"], float(dataset["approach"].max()))
    speed, friction_power = _sliding(dataset)
    thickness = float(attrs.get("thickness", math.inf))
    poisson = attrs.get("poisson", 0.5)
    return Evidence(
        boundary=attrs["boundary"],
        size=size,
        texture=texture,
        slope=slope,
        early=float(attrs.get("compliance_at_once", math.nan)),
        late=float(attrs.get("compliance_at_end", math.nan)),
        bodies=_bodies(attrs, case),
        sheet=None if thickness == math.inf else Sheet(thickness, float(poisson), attrs.get("base", BASE)),
        time_scale=float(attrs.get("time_scale", math.nan)),
        speed=speed,
        friction_power=friction_power,
        force=float(row["force"]),
        approach=float(row["approach"]),
        area=area,
        fraction=float(row.get("contact_fraction", math.nan)),
        contact=contact_of(dataset, row) if {"pressure", "height"} <= set(dataset.data_vars) else None,
        given=_stated(case),
    )


def of_case(
    case: Case,
    height: xr.DataArray,
    texture: Texture | None = None,
    *,
    force: float = math.nan,
    approach: float = math.nan,
    fraction: float = math.nan,
) -> Evidence:
    """Evidence of a case before it runs.

    Parameters
    ----------
    case : Case
    height : xarray.DataArray
        Its surface. [m]
    texture : Texture, optional
        Of the surface, if it has been measured before.
    force, approach, fraction : float
        The largest that are foreseen. [N], [m], [-]
    """
    boundary, kernel = case.settings.solve.boundary, case.kernel()
    program = case.program().on_area(nominal_area(height))
    material = case.material()
    early, late = (float(complete(material).contact_compliance(t)) for t in (0.0, program.duration))
    texture = texture or texture_of(height, boundary, str(height.attrs.get("recipe", "")))
    return Evidence(
        boundary=boundary,
        size=texture.size,
        texture=texture,
        slope=loaded_slope(height, boundary, approach),
        early=early,
        late=late,
        bodies=bodies_of(case),
        sheet=kernel if isinstance(kernel, Sheet) else None,
        time_scale=program.time_scale,
        speed=max((one.slide.distance / one.duration for one in program.segments if one.slide), default=0.0),
        force=force,
        approach=approach,
        area=fraction * math.prod(texture.size),
        fraction=fraction,
        ran=False,
        given=_stated(case),
    )


def _sliding(dataset: xr.Dataset) -> tuple[float, float]:
    """Largest speed and friction power of the accepted steps [m/s], [W]; zero and NaN where nothing slides."""
    if "sliding_distance" not in dataset:
        return 0.0, math.nan
    names = ["time", "sliding_distance", "friction_force"]
    if "step_sliding_distance" in dataset:
        names = [of_step(name) for name in names]
    time, distance, force = (dataset[name].values for name in names)
    lasts = np.diff(time) > 0
    if not lasts.any():
        return math.nan, math.nan
    speeds = np.diff(distance)[lasts] / np.diff(time)[lasts]
    return float(speeds.max()), float(np.max(force[1:][lasts] * speeds))


def bodies_of(case: Case) -> tuple[Body, ...]:
    """The deformable bodies of a case; none if Poisson's ratio of one changes in time."""
    stated = case.settings.material
    parts = [stated.a, stated.b] if stated.model == "pair" else [stated]
    materials = [complete(part.build()) for part in parts]
    if any(map(separability_error, materials)):
        return ()
    end = case.program().duration
    return tuple(Body(*(float(one.contact_compliance(t)) for t in (0.0, end)), float(one.poisson)) for one in materials)


def _check(dataset: Any) -> None:
    if not isinstance(dataset, xr.Dataset):
        raise InputError(f"audit: found {type(dataset).__name__}: expected a result (xarray.Dataset), or a Case")
    if "speed" in dataset.dims:
        raise InputError(
            "audit: found a result over speed: expected one over time, as simulate gives it for the same load"
        )
    if extra := [str(dim) for dim in dataset.dims if dim not in ("time", "step", "x", "y")]:
        raise InputError(
            f"audit: found a dimension {extra[0]!r}: expected the result of one case, as open_result opens its file"
        )
    for name in ("time", "force", "approach"):
        if name not in dataset.variables:
            raise InputError(f"audit: the result holds no {name!r}: expected a result of one case over time")
    if not dataset.sizes.get("time"):
        raise InputError("audit: the result holds no time at all: expected one at least")
    expect_declared_units(dataset)


def _with_the_case(attrs: Mapping[Any, Any], case: Case | None) -> dict[str, Any]:
    """Attributes of a result, with what those of an earlier version lack and their case says."""
    known = {"boundary": "free", **attrs}
    if case is None or "compliance_at_end" in known:
        return known
    material, program = complete(case.material()), case.program()
    found = {
        "compliance_at_once": float(material.contact_compliance(0.0)),
        "compliance_at_end": float(material.contact_compliance(program.duration)),
        "time_scale": program.time_scale,
    }
    return found | ({} if separability_error(material) else {"poisson": material.poisson}) | known


def _bodies(attrs: Mapping[str, Any], case: Case | None) -> tuple[Body, ...]:
    if "poisson" in attrs and "compliance_at_end" in attrs:
        return (Body(*(float(attrs[name]) for name in ("compliance_at_once", "compliance_at_end", "poisson"))),)
    return bodies_of(case) if case is not None else ()


def _stated(case: Case | None) -> dict[str, Any]:
    stated = case.settings.audit if case is not None else None
    return {} if stated is None else stated.model_dump(exclude_none=True)
