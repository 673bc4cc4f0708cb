"""Evidence of an audit: surface, contact and bodies of a result."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import fft, ndimage

from roughvisc.errors import InputError
from roughvisc.experiment.base import facts_of
from roughvisc.experiment.loading import Loading
from roughvisc.labels import expect_declared_units
from roughvisc.mechanics.body import separability_error
from roughvisc.mechanics.sheet import BASE, Sheet, complement
from roughvisc.observables.histories import history
from roughvisc.study.audit.texture import Texture, loaded_slope, texture_of
from roughvisc.study.case import Case
from roughvisc.study.quantities import creep_time
from roughvisc.topography.framing import with_images
from roughvisc.topography.grid import spacing
from roughvisc.variables import OTHER_DIMS, axis_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Contact:
    """What the pressures of a result show.

    Attributes
    ----------
    peak : float
        Largest pressure of all rows. [Pa]
    spots : int
        Connected regions in contact where the force is largest; one across a border that repeats counts twice.
    curvature : float
        Mean curvature of the profile over them, positive at summits. [1/m]
    half_width : float
        Half of what they extend over, along the longer side. [m]
    pressure : ndarray, shape (nx, ny)
        There. [Pa]
    cells : tuple of float
        Cell sides. [m]
    """

    peak: float
    spots: int
    curvature: float
    half_width: float
    pressure: Array
    cells: tuple[float, float]

    def relief(self, sheet: Sheet) -> float:
        """What the base of a sheet takes off the displacement under the pressure, over the compliance. [m Pa]

        The mean weighted by the pressure, with periodic boundaries, the sheet's own compression left out.
        """
        power = np.abs(fft.rfft2(self.pressure)) ** 2
        (nx, ny), (dx, dy) = self.pressure.shape, self.cells
        q = 2 * np.pi * np.hypot(fft.fftfreq(nx, dx)[:, None], fft.rfftfreq(ny, dy))
        power[0, 0], q[0, 0] = 0.0, 1.0
        power[:, 1 : (ny + 1) // 2] *= 2  # conjugates are not stored
        lost = power * 2 / q * complement(q * sheet.thickness, sheet.poisson, sheet.base)
        return float(lost.sum() / (nx * ny * self.pressure.sum()))


def contact_of(dataset: xr.Dataset, row: xr.Dataset) -> Contact | None:
    """The contact of a result in one of its rows; None if nothing touches.

    Parameters
    ----------
    dataset : xarray.Dataset
        With ``pressure``, which is read a frame at a time.
    row : xarray.Dataset
        The same in that row.
    """
    pressures = dataset["pressure"].transpose(..., "x", "y")
    peak = max(float(np.nan_to_num(frame.values).max()) for frame in pressures)
    pressure = np.nan_to_num(row["pressure"].transpose("x", "y").values)
    touching = pressure > 0
    if not touching.any():
        return None
    height = dataset["height"].transpose("x", "y")
    cells = spacing(height, "audit")
    extents = (np.ptp(at) + 1 for at in np.nonzero(touching))
    return Contact(
        peak=peak,
        spots=int(ndimage.label(touching, np.ones((3, 3)))[1]),
        curvature=_curvature(height.values, cells, touching),
        half_width=max(n * d for n, d in zip(extents, cells, strict=True)) / 2,
        pressure=with_images(pressure) if dataset.attrs["boundary"] == "mirror" else pressure,
        cells=cells,
    )


def _curvature(z: Array, cells: tuple[float, float], where: NDArray[np.bool_]) -> float:
    """Mean of minus half the Laplacian over some cells whose neighbours are all there; NaN if none is."""
    padded = np.pad(z, [(1, 1) if n > 1 else (0, 0) for n in z.shape], constant_values=np.nan)
    curvature = np.zeros(z.shape)
    for axis, d in enumerate(cells):
        if z.shape[axis] > 1:
            across = 1 - axis
            inner = np.take(padded, range(1, padded.shape[across] - 1), across) if z.shape[across] > 1 else padded
            curvature -= np.diff(inner, 2, axis) / (2 * d**2)
    found = curvature[where & np.isfinite(curvature)]
    return float(found.mean()) if found.size else math.nan


@dataclass(frozen=True)
class Body:
    """A deformable body: contact compliance at once and after the creep that there is [1/Pa], and Poisson's ratio."""

    early: float
    late: float
    poisson: float


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What the verdicts rest on; NaN and None where it is not known.

    Attributes
    ----------
    boundary : {"free", "periodic", "mirror"}
    size : tuple of float
        Of the surface. [m]
    texture : Texture or None
        Of the surface.
    slope : float
        Root mean square slope where it may be loaded. [-]
    early, late : float
        Contact compliance at once, and when the material has crept as far as it does. [1/Pa]
    bodies : tuple of Body
        One or two of constant Poisson's ratio; none where these are not known.
    sheet : Sheet or None
        What was pressed, if no half-space.
    kernel : str
        What else was pressed, in words: layers, or a kernel of the user's own.
    time_scale : float
        Shortest time in which what is prescribed changes. [s]
    speed, friction_power : float
        The largest; the speed is zero where nothing slides. [m/s], [W]
    rubbed_area, rubbed_spots : float, int
        Contact area and number of spots where the friction power is largest; none: not known. [m2]
    force, approach, area : float
        Where the force is largest, and of such rows the contact area. [N], [m], [m2]
    fraction : float
        Contact fraction there.
    contact : Contact or None
        Pressures and spots there.
    """

    boundary: str
    size: tuple[float, float]
    texture: Texture | None
    slope: float
    early: float
    late: float
    bodies: tuple[Body, ...] = ()
    sheet: Sheet | None = None
    kernel: str = ""
    time_scale: float = math.nan
    speed: float = 0.0
    friction_power: float = math.nan
    rubbed_area: float = math.nan
    rubbed_spots: int = 0
    force: float = math.nan
    approach: float = math.nan
    area: float = math.nan
    fraction: float = math.nan
    contact: Contact | None = None
    given: Mapping[str, Any] = field(default_factory=dict)

    @property
    def modulus(self) -> float:
        """Contact modulus where the material is softest. [Pa]"""
        return 1 / self.late if self.late > 0 else math.nan

    @property
    def half_width(self) -> float:
        """Half of what is loaded: of the contact in free space, of the longer side under a surface that repeats. [m]"""
        if self.boundary != "free":
            return max(self.size) / 2
        return self.contact.half_width if self.contact else math.sqrt(self.area / math.pi)


def of_result(dataset: xr.Dataset) -> Evidence:
    """Evidence of a result.

    Raises
    ------
    InputError
        If it is no result of one case.
    """
    _check(dataset)
    case = Case.from_json(dataset.attrs["case"]) if "case" in dataset.attrs else None
    longest = _longest(dataset["height"]) if "height" in dataset else math.inf
    attrs = _facts(dataset, case, longest)
    row = dataset.isel({axis_of(dataset): _fullest(dataset)})
    area = float(row.get("contact_area", math.nan))
    texture, size, slope = None, (math.nan, math.nan), math.nan
    if "height" in dataset:
        height = dataset["height"].load()
        texture = texture_of(height, attrs["boundary"], str(height.attrs.get("recipe", "")))
        size, slope = texture.size, loaded_slope(height, attrs["boundary"], float(dataset["approach"].max()))
    speed, friction_power = _sliding(dataset)
    has_pressure = {"pressure", "height"} <= set(dataset.data_vars)
    contact = contact_of(dataset, row) if has_pressure else None
    rubbed, spots = row, contact
    if "speed" in dataset.dims and "friction_force" in dataset:
        power = np.nan_to_num((dataset["friction_force"] * dataset["speed"]).values)  # missing where not solved
        rubbed = dataset.isel(speed=int(power.argmax()))
        spots = contact_of(dataset, rubbed) if has_pressure else None
    thickness = float(attrs.get("thickness", math.inf))
    poisson = attrs.get("poisson", 0.5)
    return Evidence(
        boundary=attrs["boundary"],
        size=size,
        texture=texture,
        slope=slope,
        early=float(attrs.get("compliance_at_once", math.nan)),
        late=float(attrs.get("compliance_at_end", math.nan)),
        bodies=_bodies(attrs, case, longest),
        sheet=None if thickness == math.inf else Sheet(thickness, float(poisson), attrs.get("base", BASE)),
        kernel=str(attrs.get("kernel", "")),
        time_scale=float(attrs.get("time_scale", math.nan)),
        speed=speed,
        friction_power=friction_power,
        rubbed_area=float(rubbed.get("contact_area", math.nan)),
        rubbed_spots=0 if spots is None else spots.spots,
        force=float(row["force"]),
        approach=float(row["approach"]),
        area=area,
        fraction=float(row.get("contact_fraction", math.nan)),
        contact=contact,
        given={} if case is None else case.audit_inputs,
    )


def _longest(height: xr.DataArray) -> float:
    """Longer side of a surface, between the centres of its cells. [m]"""
    return max(float(np.ptp(height[axis].values)) for axis in ("x", "y"))


def _fullest(dataset: xr.Dataset) -> int:
    """Number of the row with the largest force: of such rows that with the largest contact area, the last of these."""
    force = dataset["force"].values
    most = force >= force.max() * (1 - 1e-9)
    area = np.where(most, dataset["contact_area"].values, -1.0) if "contact_area" in dataset else most.astype(float)
    area = np.nan_to_num(area, nan=-1.0)  # of a speed whose contact is not solved
    return int(np.flatnonzero(area >= area.max() * (1 - 1e-9))[-1])


def _sliding(dataset: xr.Dataset) -> tuple[float, float]:
    """Largest speed and friction power [m/s], [W]; zero and NaN where nothing slides."""
    if "speed" in dataset.dims:
        friction = dataset.get("friction_force", xr.DataArray(math.nan))
        return float(dataset["speed"].max()), float((friction * dataset["speed"]).max())
    if "sliding_distance" not in dataset:
        return 0.0, math.nan
    rows = history(dataset)
    time, distance, force = (rows[name].values for name in ("time", "sliding_distance", "friction_force"))
    lasts = np.diff(time) > 0
    if not lasts.any():
        return math.nan, math.nan
    speeds = np.diff(distance)[lasts] / np.diff(time)[lasts]
    return float(speeds.max()), float(np.max(force[1:][lasts] * speeds))


def bodies_of(case: Case, end: float) -> tuple[Body, ...]:
    """The deformable bodies of a case after a time [s]; none if Poisson's ratio of one changes in time."""
    materials = case.materials
    if any(map(separability_error, materials)):
        return ()
    return tuple(Body(*(float(one.contact_compliance(t)) for t in (0.0, end)), float(one.poisson)) for one in materials)


def _check(dataset: Any) -> None:
    if not isinstance(dataset, xr.Dataset):
        raise InputError(key="audit", found=type(dataset).__name__, expected="a result (xarray.Dataset)")
    axis = axis_of(dataset.variables)
    if extra := [str(dim) for dim in dataset.dims if dim not in (axis, *OTHER_DIMS)]:
        raise InputError(key="audit", found=extra[0], expected="the result of one case, as open_result opens its file")
    for name in (axis, "force", "approach"):
        if name not in dataset.variables:
            raise InputError(key="audit", found=[*map(str, dataset.variables)], expected=f"a result with {name!r}")
    if not dataset.sizes.get(axis):
        raise InputError(key="audit", found=[], expected=f"a {axis} at least")
    expect_declared_units(dataset)


def _facts(dataset: xr.Dataset, case: Case | None, longest: float) -> Mapping[str, Any]:
    """Return the attributes of a result, with the facts that only the case of a stored one states."""
    if case is None or "time_scale" in dataset.attrs:
        return dataset.attrs
    experiment = case.experiment
    time_scale = experiment.program.time_scale if isinstance(experiment, Loading) else math.inf
    return facts_of(case.body, creep_time(experiment, longest), time_scale) | dataset.attrs


def _bodies(attrs: Mapping[str, Any], case: Case | None, size: float) -> tuple[Body, ...]:
    if "poisson" in attrs and "compliance_at_end" in attrs:
        return (Body(*(float(attrs[name]) for name in ("compliance_at_once", "compliance_at_end", "poisson"))),)
    return bodies_of(case, creep_time(case.experiment, size)) if case is not None else ()
