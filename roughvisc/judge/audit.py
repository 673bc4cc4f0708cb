"""``audit``: estimates of the effects that the model neglects, compared with limits.

A scene holds surface, contact and bodies of a result. Each check returns the size of one effect, and a sentence.
"""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import fft

from roughvisc.errors import InputError
from roughvisc.experiment.accuracy import loaded_depth
from roughvisc.mechanics.body import HALF_SPACE
from roughvisc.mechanics.heating import spot_count, surface_rise
from roughvisc.mechanics.sheet import BASE, Base, Sheet, factors
from roughvisc.observables.history import expect_result, history
from roughvisc.runs.netcdf import open_result
from roughvisc.runs.run import result_folder
from roughvisc.runs.sweep import run_one
from roughvisc.solve import Progress
from roughvisc.study.case import Case, case_given
from roughvisc.study.case_text import case_words
from roughvisc.study.properties import properties
from roughvisc.topography.borders import border_mismatch
from roughvisc.topography.framing import mirror
from roughvisc.topography.grid import rms_slope, spacing
from roughvisc.topography.recipes import is_analytic, recipe_name
from roughvisc.topography.spectrum import hann, is_narrow_band, last_octave
from roughvisc.units import Quantity, format_quantity
from roughvisc.variables import axis_of

Array = NDArray[np.float64]

#: The verdicts, from the best to the worst.
HOLDS, DOUBTFUL, BROKEN, NOT_KNOWN = VERDICTS = ("holds", "doubtful", "broken", "not known")
#: Width of the printed table, which fits into a page of the documentation.
_WIDTH = 98
#: Relative rounding of loads.
_ROUNDING = 1e-9
#: Contact fraction above which the contact spots have merged.
_MERGED = 0.5
#: Radius of curvature over width of the contact, above which a profile counts as flat.
_FLAT = 1e4
#: Poisson's ratio with the smallest shear modulus for a contact modulus.
_SOFTEST = 0.5
#: Margin of the shortest wavelength of a recipe.
_JUST_BELOW = 0.99
#: Number of the resolution check for a surface without roughness, such as a form or waves of one length:
#: 1 - sqrt(0.99).
_ONLY_FORM = 0.005

#: Number and sentence of a finding; None if the assumption does not apply.
Found = tuple[float, str] | None


# ---------------------------------------------------------------------------------------------------------------- scene


class NotKnown(Exception):
    """A number is not known; the message names the missing input."""


@dataclass(frozen=True)
class AuditedContact:
    """Surface, contact and bodies of a result. A property that the result does not record raises :class:`NotKnown`.

    Attributes
    ----------
    dataset : xarray.Dataset
        Result of one case.
    given : mapping
        Stated properties, in SI.
    case : Case or None
        Case of a stored result, which states the material and the program.
    """

    dataset: xr.Dataset
    given: Mapping[str, Any]
    case: Case | None = None

    def need(self, *names: str) -> list[float]:
        """Return stated properties by name. [SI]"""
        if missing := [name for name in names if name not in self.given]:
            raise NotKnown("; ".join(f"{name} is not given" for name in missing) + ".")
        return [self.given[name] for name in names]

    @property
    def boundary(self) -> str:
        """``free``, ``periodic`` or ``mirror``."""
        return str(self.dataset.attrs["boundary"])

    # ---------------------------------------------------------------------------------------------------- surface

    @cached_property
    def height(self) -> xr.DataArray:
        """Heights over (x, y). [m]"""
        if "height" not in self.dataset:
            raise NotKnown("The result contains no heights.")
        return self.dataset["height"].transpose("x", "y").compute()

    @cached_property
    def period(self) -> xr.DataArray:
        """Heights of one period: with the mirror images under a mirror boundary. [m]"""
        return mirror(self.height) if self.boundary == "mirror" else self.height

    @property
    def cells(self) -> tuple[float, float]:
        """Cell sides. [m]"""
        return spacing(self.height, "audit")

    @property
    def sides(self) -> list[float]:
        """Sides of one period: with the mirror images under a mirror boundary. [m]"""
        return [count * side for count, side in zip(self.period.shape, self.cells, strict=True)]

    @cached_property
    def waves(self) -> tuple[float, float]:
        """Part of the rms slope from the last octave of wavelengths [-], and the longest wavelength of this octave [m].

        In free space a cosine window is applied to the heights. NaN if the surface is flat or points are missing.
        """
        z = self.period.values - self.period.values.mean()
        if not np.ptp(z) > 0:
            return math.nan, math.nan
        q, power, begins = last_octave(hann(z) if self.boundary == "free" else z, self.cells)
        squares = q**2 * power
        kept = float(squares[q <= begins].sum()) / float(squares.sum())
        return 1 - math.sqrt(kept), 2 * np.pi / begins if begins else 0.0

    @property
    def is_smooth(self) -> bool:
        """Whether the surface has no roughness: a smooth recipe, or wavelengths above a quarter of the shorter side."""
        return is_analytic(self.period) or self.waves[1] > min(self.sides) / 2

    @cached_property
    def loaded_slope(self) -> float:
        """Root mean square slope of the loaded surface, as the warning of a result judges it. [-]"""
        if self.boundary == "free":
            depth = float(self.dataset["approach"].max())
        else:
            depth = loaded_depth(self.height, float(self.dataset["contact_fraction"].max()))
        slope = rms_slope(self.height, self.boundary == "periodic", depth)
        if math.isnan(slope):
            raise NotKnown("The result contains no loaded heights.")
        return slope

    # ---------------------------------------------------------------------------------------------------- contact

    @cached_property
    def fullest(self) -> xr.Dataset:
        """Row with the largest force; among equal forces the last row with the largest contact area."""
        force = self.dataset["force"].values
        area = self.dataset["contact_area"].values
        ranks = np.lexsort((np.nan_to_num(area), force >= force.max() * (1 - _ROUNDING)))  # NaN: not solved
        return self.dataset.isel({axis_of(self.dataset): ranks[-1]})

    @property
    def force(self) -> float:
        """Largest force. [N]"""
        if not self.fullest["force"] > 0:
            raise NotKnown("The result has no load, and therefore no contact.")
        return float(self.fullest["force"])

    def pressure_in(self, row: xr.Dataset) -> Array:
        """Return the pressure in a row with contact, zero at missing points and under tension. [Pa]"""
        pressure = (
            np.nan_to_num(row["pressure"].transpose("x", "y").values).clip(0) if "pressure" in row else np.zeros(1)
        )
        if not pressure.any():
            raise NotKnown('Keep the pressure, fields = ["pressure"].')
        return pressure

    @cached_property
    def pressure(self) -> Array:
        """Pressure in the row with the largest force. [Pa]"""
        return self.pressure_in(self.fullest)

    @property
    def half_width(self) -> float:
        """Half the longer side of the contact in free space, otherwise half the longer side of the surface. [m]"""
        if self.boundary != "free":
            return max(self.sides) / 2
        spans = [np.ptp(at) + 1 for at in np.nonzero(self.pressure)]
        return max(count * side for count, side in zip(spans, self.cells, strict=True)) / 2

    @property
    def curvature(self) -> float:
        """Mean curvature of the profile over cells in contact with known neighbours; positive at summits. [1/m]"""
        z = self.height
        curvature = sum(
            (2 * z - z.shift({axis: 1}) - z.shift({axis: -1})) / (2 * side**2)
            for axis, side in zip(("x", "y"), self.cells, strict=True)
            if z.sizes[axis] > 1
        )
        return float(xr.DataArray(curvature).where(self.pressure > 0).mean())

    @cached_property
    def slide(self) -> tuple[float, float, xr.Dataset]:
        """Largest speed [m/s], largest friction power [W], and the row with this power; zeros if nothing slides."""
        if "speed" in self.dataset.dims:
            power = np.nan_to_num((self.dataset["friction_force"] * self.dataset["speed"]).values)  # NaN: not solved
            return float(self.dataset["speed"].max()), float(power.max()), self.dataset.isel(speed=power.argmax())
        if "sliding_distance" not in self.dataset:
            return 0.0, 0.0, self.fullest
        try:
            steps = history(self.dataset)
        except InputError as error:
            raise NotKnown(f"The speeds of the slides are not known: {error}.") from error
        lasting = np.diff(steps["time"]) > 0
        if not lasting.any():
            raise NotKnown("The speed of the slides is not known.")
        speeds = np.diff(steps["sliding_distance"])[lasting] / np.diff(steps["time"])[lasting]
        power = steps["friction_force"].values[1:][lasting] * speeds
        return float(speeds.max()), float(np.max(power)), self.fullest

    # ----------------------------------------------------------------------------------------------------- bodies

    @cached_property
    def facts(self) -> Mapping[Any, Any]:
        """Facts on material and program: attributes of the result, or derived from the case of a stored one."""
        if self.case is not None:
            return self.case.experiment.facts(self.case.body, self.height)
        if "time_scale" not in self.dataset.attrs:
            raise NotKnown("The material is not stated: audit the file from run, or the Dataset from simulate.")
        return self.dataset.attrs

    @property
    def late(self) -> float:
        """Contact compliance at the end of the program. [1/Pa]"""
        if not self.facts["compliance_at_end"] > 0:
            raise NotKnown("The body does not deform by the end of the program.")
        return float(self.facts["compliance_at_end"])


# --------------------------------------------------------------------------------------------------------------- checks


@dataclass(frozen=True)
class Limit:
    """Limits of one assumption.

    Attributes
    ----------
    check : callable
        Returns the number of a scene, and its meaning for the scene as a sentence. A larger number is worse.
    doubtful, broken : float
        Numbers from which the assumption is doubtful, and broken.
    source : str
        Meaning of both limits, and their source.
    """

    check: Callable[[AuditedContact], Found]
    doubtful: float
    broken: float
    source: str

    @property
    def number(self) -> str:
        """Meaning of the number: the summary of its check."""
        return (self.check.__doc__ or "").partition(".\n")[0].rstrip(".")


def adhesion(scene: AuditedContact) -> Found:
    r"""Pull-off force of the spots over the largest load.

    Each spot of radius ``R`` holds :math:`\frac32 \pi w R` (JKR). A stiff and small one holds up to a third more (DMT).
    """
    if "range_of_adhesion" in scene.dataset.attrs:
        w, reach = (scene.dataset.attrs[f"{name}_of_adhesion"] for name in ("work", "range"))
        return 0.0, f"Modelled: {as_text(w, 'J/m^2', 3)} with a range of {as_text(reach, 'm', 3)}."
    force = scene.force
    curvature = scene.curvature
    fraction = float(scene.fullest["contact_fraction"])
    if scene.boundary != "free" and fraction > _MERGED:
        raise NotKnown(f"{percent(fraction)} of the area is in contact, without separate spots.")
    if not curvature * _FLAT * scene.half_width > 1:
        raise NotKnown("The contact is flat: its pull-off force is not estimated.")
    [w] = scene.need("work_of_adhesion")
    spots = spot_count(scene.pressure)
    pull = spots * 1.5 * math.pi * w / curvature
    held = f"{_counted(spots)} of mean radius {as_text(1 / curvature, 'm')} would hold {as_text(pull, 'N')} when"
    return pull / force, f"{held} pulled off."


def yielding(scene: AuditedContact) -> Found:
    """Largest pressure over the yield strength in tension."""
    peak = float(scene.pressure.max())
    for frame in scene.dataset["pressure"]:  # one frame in memory at a time
        peak = max(peak, float(np.nan_to_num(frame.values).max()))
    [strength] = scene.need("yield_strength")
    return peak / strength, f"The largest pressure is {as_text(peak, 'Pa')}."


def thickness(scene: AuditedContact) -> Found:
    """Relative error of the approach of a half-space, at the same load."""
    if scene.facts.get("thickness", math.inf) < math.inf:
        return 0.0, f"Modelled: a sheet of {as_text(scene.facts['thickness'], 'm', 3)}, {scene.facts['base']}."
    if scene.facts.get("body", HALF_SPACE.text) != HALF_SPACE.text:
        return 0.0, f"Modelled: {scene.facts['body']}."
    if not scene.facts.get("poisson", -1.0) >= 0:
        raise NotKnown("Two bodies, or a Poisson ratio that changes or is negative: a sheet cannot be compared.")
    [depth] = scene.need("thickness")
    sheet = Sheet(depth, scene.facts["poisson"], scene.given.get("base", BASE))
    relief = sheet.relief * scene.force if scene.boundary == "free" else _periodic_relief(scene, sheet)
    reduction = scene.late * relief / float(scene.fullest["approach"])  # to first order
    excess = reduction / (1 + reduction)
    base = f"On a {sheet.base} sheet of {as_text(depth, 'm', 3)}"
    return excess, f"{base} the approach would be {percent(excess)} smaller at the same load."


def slope(scene: AuditedContact) -> Found:
    """Rms slope of the loaded surface."""
    more = percent(scene.loaded_slope**2 / 2)
    return scene.loaded_slope, f"The loaded surface has {more} more area than its projection."


def inertia(scene: AuditedContact) -> Found:
    r"""Lag of waves over the time scale of the program, or relative increase of the displacement in a slide.

    The lag is dashpot over spring of a round punch of radius ``a`` on a half-space, :math:`0.85\,a / c`, with the speed
    ``c`` of shear waves. The displacement under a load that moves with the speed ``V`` increases by about
    :math:`V^2 / (c^2 - V^2)`. Up to 0.7 ``c`` this is 0.85 to 1.4 times the exact increase for any Poisson ratio from
    0 to 0.5.
    """
    width = scene.half_width
    scale = float(scene.facts["time_scale"])
    speed = scene.slide[0]
    [density] = scene.need("density")
    shear = (1 - float(scene.facts.get("poisson", _SOFTEST))) / (2 * scene.late)
    waves = math.sqrt(shear / density)
    lag = 0.85 * width / waves
    excess = speed**2 / (waves**2 - speed**2) if speed < waves else math.inf
    if excess > lag / scale:
        slides = f"the profile slides at {as_text(speed, 'm/s')}"
        return excess, f"Shear waves travel at {as_text(waves, 'm/s')}, and {slides}."
    program = f"the program changes within {as_text(scale, 's')}" if math.isfinite(scale) else "nothing changes"
    return lag / scale, f"Waves lag by {as_text(lag, 's')} over {as_text(2 * width, 'm')}; {program}."


def heating(scene: AuditedContact) -> Found:
    r"""Mean temperature rise of the spots in a slide [K] if all heat flows into the body.

    The rise of a slow round spot of radius ``a`` under a heat flux ``q`` is :math:`0.849\,q a / k`, and of a fast one
    :math:`0.974\,(q a / k) / \sqrt P` with :math:`P = V a \rho c / k` (Jaeger, Archard); see
    :mod:`roughvisc.mechanics.heating`. The heat of a curve that was computed with ``heating`` is modelled.
    """
    speed, power, rubbed = scene.slide
    if speed == 0:
        return None
    if "temperature" in scene.dataset:
        warmest = float(scene.dataset["temperature"].max())
        return 0.0, f"Modelled: the contact is warmed up to {warmest:.4g} K."
    spots = spot_count(scene.pressure_in(rubbed))
    area = float(rubbed["contact_area"])
    heat = max(power, 0.0)
    conductivity, capacity = scene.need("heat_conductivity", "volumetric_heat_capacity")
    radius = math.sqrt(area / (math.pi * spots))
    rise = surface_rise(heat / area, radius, speed, conductivity, capacity)
    heats = f"{as_text(heat, 'W')} of friction heat {_counted(spots).lower()} of mean radius {as_text(radius, 'm')}"
    return rise, f"{heats} by {as_text(rise, 'K')} above the surface around."


def resolution(scene: AuditedContact) -> Found:
    """Part of the rms slope from the last octave of wavelengths, about the part of the area that it removes."""
    last, longest = scene.waves
    complete = is_analytic(scene.period)
    if recipe_name(scene.period) == "self_affine":
        made = json.loads(scene.height.attrs["recipe"])["parameters"]
        shortest = made["shortcut"] / math.sqrt(made["anisotropy"])
        # conditioning may have added shorter waves
        complete = shortest > 2 * max(scene.cells) and longest / 2 > _JUST_BELOW * shortest
    if complete:
        return 0.0, "The recipe has no wavelengths shorter than two cells."
    if is_narrow_band(scene.height):
        ends = as_text(longest / 2, "m")
        return _ONLY_FORM, f"Waves of one length: 99 % of the squared slope lies above {ends}, in a narrow band."
    if scene.is_smooth:
        return _ONLY_FORM, f"Only form: 99 % of the squared slope lies above {as_text(longest / 2, 'm')}."
    if math.isnan(last):
        raise NotKnown("Points are missing, or the surface is flat: its shortest wavelengths are not known.")
    adds = f"Wavelengths below {as_text(longest, 'm')} add {percent(last)} of the slope, and remove as much of the"
    return last, f"{adds} area; the next octave may do so again."


def border(scene: AuditedContact) -> Found:
    """Difference between opposite borders over that between neighbouring rows."""
    if scene.boundary == "free":
        return None
    if scene.boundary == "mirror":
        return 0.0, "The surface repeats with its mirror images: its borders meet."
    number = max(border_mismatch(scene.height))
    advice = "" if number < LIMITS["border"].doubtful else ' Use boundary = "mirror".'
    return number, f"The difference of opposite borders is {number:.2g} times that of neighbouring rows.{advice}"


def _periodic_relief(scene: AuditedContact, sheet: Sheet) -> float:
    """Return the reduction of the approach by the base of a sheet under a periodic load, over the compliance. [m Pa]

    It is the mean of :math:`(K - K_h) * p` with the kernels of half-space and sheet, weighted by the pressure ``p``,
    without the compression of the sheet.
    """
    images = [(0, count if scene.boundary == "mirror" else 0) for count in scene.pressure.shape]
    pressure = np.pad(scene.pressure, images, mode="symmetric")
    along_x, along_y = (fft.fftfreq(count, side) for count, side in zip(pressure.shape, scene.cells, strict=True))
    q = 2 * np.pi * np.hypot(along_x[:, None], along_y)
    q[0, 0] = 1.0  # of the mean, which is subtracted
    power = np.abs(fft.fft2(pressure - pressure.mean())) ** 2
    lost = power * 2 / q * factors(q * sheet.thickness, sheet.poisson, sheet.base)[1]
    return float(lost.sum() / (pressure.size * pressure.sum()))


def _counted(spots: int) -> str:
    return "One spot" if spots == 1 else f"{spots} spots"


def as_text(value: float, unit: str, digits: int = 2) -> str:
    """Return a quantity in SI as text with some significant digits, as 490 kPa and not 4.9e+02 kPa."""
    return format_quantity(float(f"{value:.{digits}g}"), unit)


def percent(share: float) -> str:
    """Return a fraction as text with two digits, as 100 % and not 1e+02 %; a very small fraction as a bound."""
    return "less than 0.1 %" if 0 < share < 1e-3 else f"{float(f'{100 * share:.2g}'):g} %"


#: Limits of each check, in the order of an audit. Unless a threshold has a physical meaning, an effect of some 10 %
#: makes an assumption doubtful, and an effect of the size of the computed quantity breaks the assumption.
_TABLE = (
    Limit(adhesion, 0.005, 0.3, "contact area 10 % larger; twice as large: Johnson, Kendall, Roberts (1971)"),
    Limit(yielding, 1.6, 3, "first yield under a sphere; full plasticity: Johnson (1985), sections 6.1 and 6.3"),
    Limit(thickness, 0.1, 0.5, "10 % off; twice the true approach: Johnson (1985), section 5.8"),
    Limit(slope, 0.3, 1, "true area 4.5 % larger than projected; 50 % larger: Johnson (1985), section 4.1"),
    Limit(inertia, 0.1, 1, "10 % off the quasi-static value; 100 % off: Lysmer, Richart (1966); Cole, Huth (1958)"),
    Limit(heating, 1, 10, "retardation times a fifth shorter; six times shorter: Williams, Landel, Ferry (1955)"),
    Limit(resolution, 0.1, 0.5, "10 % of the area; half of the area, also in the next octave: Persson (2001)"),
    Limit(border, 2, 10, "a step is visible; on 100 rows the seam has as much mean square slope as all other rows"),
)
#: Name of an assumption -> its limits.
LIMITS = {one.check.__name__: one for one in _TABLE}


# ------------------------------------------------------------------------------------------------------------- findings


@dataclass(frozen=True)
class Finding:
    """Result of the check of one assumption.

    Attributes
    ----------
    name : str
        Name of the assumption.
    number : float
        Number that is compared with the limits; NaN if not known.
    sentence : str
        Meaning of the number for this result, or the missing input.
    limit : Limit
        Limits with which the number is compared.
    """

    name: str
    number: float
    sentence: str
    limit: Limit

    @property
    def verdict(self) -> str:
        """``holds``, ``doubtful``, ``broken`` or ``not known``."""
        if math.isnan(self.number):
            return NOT_KNOWN
        return BROKEN if self.number >= self.limit.broken else DOUBTFUL if self.number >= self.limit.doubtful else HOLDS

    @property
    def shown(self) -> str:
        """The number with two significant digits, 0 if it is tiny; empty if it is not known."""
        return "" if math.isnan(self.number) else f"{float(f'{round(max(self.number, 0.0), 9):.2g}'):g}"


@dataclass(frozen=True)
class Audit:
    """Findings on the assumptions of the model for a result.

    An audit prints as a table. ``audit["thickness"]`` is the finding of one assumption, with ``number``,
    ``verdict``, ``sentence`` and ``limit``.

    Attributes
    ----------
    title : str
        Title of the result.
    findings : tuple of Finding
        In the order of the table of limits.
    """

    title: str
    findings: tuple[Finding, ...]

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.findings)

    def __getitem__(self, name: str) -> Finding:
        return {one.name: one for one in self.findings}[name]

    def __repr__(self) -> str:
        """Return a table of plain text."""
        lines = [self.title] if self.title else []
        for one in self.findings:
            head = f"{one.name:<11} {one.verdict:<9} {one.shown:>7}  "
            lines.append(textwrap.fill(one.sentence, _WIDTH, initial_indent=head, subsequent_indent=" " * len(head)))
        return "\n".join(lines)


def audit(
    result: xr.Dataset | Case | str | Path,
    *,
    work_of_adhesion: Quantity | None = None,
    yield_strength: Quantity | None = None,
    thickness: Quantity | None = None,
    base: Base | None = None,
    density: Quantity | None = None,
    heat_conductivity: Quantity | None = None,
    volumetric_heat_capacity: Quantity | None = None,
    out: str | Path | None = None,
    progress: bool | Progress = True,
    threads: int | None = None,
) -> xr.Dataset:
    """Check the assumptions of the model for a result.

    Parameters
    ----------
    result : xarray.Dataset, Case or path
        A result of one case. A case or its study file is computed first, as :func:`roughvisc.run` does, unless it is
        finished.
    work_of_adhesion : float or str, optional
        Work of adhesion of the two surfaces. [J/m2]
    yield_strength : float or str, optional
        Tensile yield strength of the body that yields first. [Pa]
    thickness : float or str, optional
        True thickness of the body that is modelled as a half-space. [m]
    base : {"bonded", "slipping"}, optional
        Contact of this body with its base; default: bonded.
    density : float or str, optional
        Density of the body. [kg/m3]
    heat_conductivity : float or str, optional
        Heat conductivity of the body. [W/(m K)]
    volumetric_heat_capacity : float or str, optional
        Volumetric heat capacity of the body: density times specific heat. [J/(m3 K)]
    out, progress, threads
        Of the computation of a case, as in :func:`roughvisc.run`.

    Returns
    -------
    xarray.Dataset
        Over ``assumption``, for each assumption that applies: ``verdict`` (holds, doubtful, broken or not known);
        ``number``, which is compared with the limits ``doubtful`` and ``broken`` [-]; ``sentence``, the meaning of the
        number. Values that are not given come from the table ``[audit]`` of the study, if there is one. If a value is
        missing, the verdict is ``not known``, and the sentence names the missing input.

    Raises
    ------
    InputError
        If a value has a wrong type or is out of range, or the result contains several cases.

    Notes
    -----
    :data:`roughvisc.judge.audit.LIMITS` contains the limits of the verdicts and their sources. The audit uses
    the lowest modulus: the modulus at the end of the program, or for the longest wavelength at the lowest speed. With
    this modulus adhesion and inertia are largest.

    See Also
    --------
    roughvisc.budget : the errors of a number.

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-2, size=1e-3, shape=24)
    >>> ds = rv.simulate(ball, rv.elastic(1e6), rv.Program().load(5e-3, over=1.0), progress=False)
    >>> found = rv.audit(ds, work_of_adhesion="50 mJ/m^2")
    >>> found.verdict.sel(assumption=["adhesion", "slope", "yielding"]).values.tolist()
    ['broken', 'holds', 'not known']
    """
    stated = {
        "work_of_adhesion": work_of_adhesion,
        "yield_strength": yield_strength,
        "thickness": thickness,
        "base": base,
        "density": density,
        "heat_conductivity": heat_conductivity,
        "volumetric_heat_capacity": volumetric_heat_capacity,
    }
    if not isinstance(result, xr.Dataset):
        case = case_given(result, "result")
        result = open_result(run_one(case, result_folder(case, out), progress=progress, threads=threads))
    findings = audit_of(result, **stated)
    columns = {
        "verdict": ("verdict", [one.verdict for one in findings]),
        "number": ("number that is compared with the limits", [one.number for one in findings]),
        "doubtful": ("number from which the assumption is doubtful", [one.limit.doubtful for one in findings]),
        "broken": ("number from which the assumption is broken", [one.limit.broken for one in findings]),
        "sentence": ("meaning of the number", [one.sentence for one in findings]),
    }
    variables = {name: ("assumption", values, {"long_name": text}) for name, (text, values) in columns.items()}
    return xr.Dataset(variables, {"assumption": [one.name for one in findings]}, {"title": findings.title})


def audit_of(result: xr.Dataset, **given: Any) -> Audit:
    """Return the findings for a result; see :func:`audit`."""
    given = properties(**given)
    result = expect_result(result, "force", "approach", "contact_area", "contact_fraction")
    expect_result(result, *(name for name in ("height", "pressure") if name in result))
    case = None
    if "case" in result.attrs:
        source = result.encoding.get("source")
        case = Case.from_json(result.attrs["case"], Path(source).parent if source else None)
        given = {**case.audit_inputs, **given}
    scene = AuditedContact(result, given, case)
    findings = []
    for name, limit in LIMITS.items():
        try:
            checked = limit.check(scene)
        except NotKnown as missing:
            checked = math.nan, str(missing)
        if checked is not None:
            findings.append(Finding(name, *checked, limit))
    title = str(result.attrs.get("title", ""))
    if case is not None and case.varied:
        words = case_words({"varied": dict(case.varied)})
        title = f"{case.title}, {words[:1].lower()}{words[1:]}"
    return Audit(title, tuple(findings))
