"""``audit``: estimates of the effects that the model neglects, compared with limits."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import ndimage

from roughvisc.errors import InputError
from roughvisc.labels import expect_declared_units
from roughvisc.mechanics.sheet import BASE, Base, Sheet
from roughvisc.study.audit import effects
from roughvisc.study.audit.limits import LIMITS, STATED, AuditInputs, Limit
from roughvisc.study.audit.scene import NotKnown, Scene
from roughvisc.study.case import Case
from roughvisc.topography.borders import border_mismatch, is_analytic
from roughvisc.topography.framing import with_images
from roughvisc.topography.parameters import parameters
from roughvisc.units import format_quantity
from roughvisc.variables import OTHER_DIMS, axis_of

Array = NDArray[np.float64]

#: The verdicts, from the best to the worst.
HOLDS, DOUBTFUL, BROKEN, NOT_KNOWN = VERDICTS = ("holds", "doubtful", "broken", "not known")
#: Width of the printed table, which fits into a page of the documentation.
_WIDTH = 98
#: Numbers below it are shown as zero.
_LEAST = 1e-9
#: Contact fraction above which the contact spots have merged.
_MERGED = 0.5
#: Radius of curvature over width of the contact, above which a profile counts as flat.
_FLAT = 1e4
#: Tabor parameter up to which attraction does not change the shape of the spots.
_STIFF = 1.0
#: Largest exponent of the force, as a power of the approach, of a contact that counts as flat. The exponent is 1 for a
#: flat contact, 3/2 for a sphere and 2 for a cone.
_PROPORTIONAL = 1.25
#: Poisson's ratio with the smallest shear modulus for a contact modulus.
_SOFTEST = 0.5
#: Number of the resolution check for a surface without roughness: 1 - sqrt(0.99).
_ONLY_FORM = 0.005


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
        """The number to two digits, tiny numbers as 0; empty if it is not known."""
        return "" if math.isnan(self.number) else f"{float(f'{max(self.number, _LEAST) - _LEAST:.2g}'):g}"


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

    def __len__(self) -> int:
        return len(self.findings)

    def __getitem__(self, name: str) -> Finding:
        for finding in self.findings:
            if finding.name == name:
                return finding
        raise KeyError(f"{name!r}: expected one of {', '.join(one.name for one in self.findings)}")

    def __repr__(self) -> str:
        """Return a table of plain text."""
        lines = [self.title] if self.title else []
        for one in self.findings:
            head = f"{one.name:<11} {one.verdict:<9} {one.shown:>7}  "
            lines.append(textwrap.fill(one.sentence, _WIDTH, initial_indent=head, subsequent_indent=" " * len(head)))
        return "\n".join(lines)

    def to_dataset(self) -> xr.Dataset:
        """Return the findings over ``assumption``: number, verdict, sentence, and both limits with their source."""
        columns = {name: [getattr(one, name) for one in self] for name in ("number", "verdict", "sentence")} | {
            "doubtful_from": [one.limit.doubtful for one in self],
            "broken_from": [one.limit.broken for one in self],
            "source": [one.limit.source for one in self],
        }
        names = np.array([one.name for one in self])
        dataset = xr.Dataset({name: ("assumption", np.array(values)) for name, values in columns.items()})
        return dataset.assign_coords(assumption=names).assign_attrs(title=self.title)


# ------------------------------------------------------------------------------------------------------------- checks

#: Number and sentence of a finding.
Number = tuple[float, str]


def adhesion(scene: Scene) -> Number:
    """Return the pull-off force of the contact spots over the largest load."""
    force, curvature, fraction = scene.force, scene.curvature, float(scene.fullest["contact_fraction"])
    is_flat = not curvature * _FLAT * scene.extent > 1
    if scene.boundary != "free" and (is_flat or fraction > _MERGED):
        raise NotKnown(f"{percent(fraction)} of the area is in contact, without separate spots: see stickiness.")
    [w] = scene.need("work_of_adhesion")
    if is_flat:
        early = float(scene.facts["compliance_at_once"])
        if not early > 0:
            raise NotKnown("The contact is flat, and the material has no instantaneous modulus.")
        pull = effects.punch_pull_off(math.sqrt(float(scene.fullest["contact_area"]) / math.pi), 1 / early, w)
        return pull / force, f"A flat contact would hold {as_text(pull, 'N')} when pulled off fast (Kendall)."
    spots, tabor = _spots(scene.pressure), effects.tabor_parameter(1 / curvature, 1 / scene.late, w)
    pull = spots * effects.pull_off_force(1 / curvature, w, tabor)
    grown = 1 + pull / force if tabor <= _STIFF else effects.adhesive_load(1.0, pull / force)
    held = f"{_counted(spots)} of mean radius {as_text(1 / curvature, 'm')} would hold {as_text(pull, 'N')} when"
    larger = f"pulled off, and make the contact area {as_text(grown ** (2 / 3), '1', 3)} times as large"
    return pull / force, f"{held} {larger} (Tabor parameter {as_text(tabor, '1')})."


def stickiness(scene: Scene) -> Number | None:
    """Return the adhesion of a rough surface without a load; None for a smooth body in free space."""
    is_free = scene.boundary == "free"
    if is_free and scene.is_smooth:
        return None
    measures = parameters(scene.period, periodic=not is_free)
    slope, laplacian = float(measures["Sdq"]), 2 * float(measures["rms_curvature"])
    if not slope > 0:
        raise NotKnown("The surface is flat: it has no roughness.")
    [w] = scene.need("work_of_adhesion")
    tabor = effects.tabor_parameter(2 / laplacian, 1 / scene.late, w)
    spots = f"spots (Tabor parameter {as_text(tabor, '1')})"
    if tabor <= _STIFF:
        ratio = effects.rough_attraction(slope, laplacian, 1 / scene.late, w)
        return ratio, f"Stiff {spots}: attraction around them is {ratio:.2g} times the repulsion in them."
    energy = effects.conformal_energy(scene.waves[0], 1 / scene.late)
    if math.isnan(energy):
        raise NotKnown("Points are missing: the energy of full contact is not known.")
    return w / energy, f"Soft {spots}: full contact stores {as_text(energy, 'J/m^2')} of elastic energy."


def yielding(scene: Scene) -> Number:
    """Return the largest pressure of all rows over the yield strength."""
    peak = float(scene.pressure.max())
    for frame in scene.dataset["pressure"]:  # one frame in memory at a time
        peak = max(peak, float(np.nan_to_num(frame.values).max()))
    [strength] = scene.need("yield_strength")
    return peak / strength, f"The largest pressure is {as_text(peak, 'Pa')}."


def thickness(scene: Scene) -> Number:
    """Return the relative error of approach or force if a half-space replaces the real sheet."""
    modelled, stated = scene.facts.get("thickness", math.inf), scene.given.thickness
    if modelled < math.inf:
        if stated is not None and not math.isclose(stated, modelled, rel_tol=1e-9):
            raise NotKnown(f"The result is for a sheet of {as_text(modelled, 'm', 3)}: run the study with the other.")
        return 0.0, f"Modelled: a sheet of {as_text(modelled, 'm', 3)}, {scene.facts['base']}."
    if "kernel" in scene.facts:
        return 0.0, f"Modelled: {scene.facts['kernel']}."
    if len(scene.bodies) != 1 or scene.bodies[0][2] < 0:
        raise NotKnown("Two bodies, or a Poisson ratio that changes or is negative: a sheet cannot be compared.")
    [depth] = scene.need("thickness")
    sheet, approach = Sheet(depth, scene.bodies[0][2], scene.given.base or BASE), float(scene.fullest["approach"])
    shortfall = 0.0
    if scene.boundary == "free":
        first = sheet.relief * scene.late * scene.force / approach
        # stiffness 2 a / C of a round contact, equal to the stiffness of a flat punch of its radius
        if 2 * _half_width(scene) * approach / (scene.late * scene.force) > _PROPORTIONAL:
            shortfall = effects.half_space_shortfall(first)
    else:
        pressure = with_images(scene.pressure) if scene.boundary == "mirror" else scene.pressure
        first = scene.late * effects.periodic_relief(pressure, scene.cells, sheet) / approach
    excess = effects.half_space_excess(first)
    smaller = f"On a {sheet.base} sheet of {as_text(depth, 'm', 3)} the approach would be {percent(excess)} smaller at"
    larger = f"; at the same approach the force would be {percent(shortfall)} larger" if shortfall > excess else ""
    return max(excess, shortfall), f"{smaller} the same load{larger}."


def slope(scene: Scene) -> Number:
    """Return the root mean square slope of the loaded surface."""
    more = percent(scene.loaded_slope**2 / 2)
    return scene.loaded_slope, f"The loaded surface has {more} more area than its projection."


def strain(scene: Scene) -> Number:
    """Return the root mean square slope of the loaded surface over the linear range."""
    largest, [linear] = scene.loaded_slope, scene.need("linear_strain")
    return largest / linear, f"Strains are at most about {percent(largest)}, and on average {percent(0.2 * largest)}."


def inertia(scene: Scene) -> Number:
    """Return the lag by waves over the time scale of the program, or the excess displacement under a moving load."""
    width, scale, (speed, _) = _half_width(scene), float(scene.facts["time_scale"]), scene.slide
    [density] = scene.need("density")
    bodies = [(late, poisson) for _, late, poisson in scene.bodies] or [(scene.late, _SOFTEST)]
    solids = [((1 - poisson) / (2 * late), poisson) for late, poisson in bodies if late > 0]
    shear = min(modulus for modulus, _ in solids)
    lag = effects.radiation_lag(width, shear, density)
    excess = max(effects.moving_load_excess(speed, modulus, density, poisson) for modulus, poisson in solids)
    if speed > 0 and excess > lag / scale:
        waves = as_text(math.sqrt(shear / density), "m/s")
        return excess, f"Shear waves travel at {waves}, and the profile slides at {as_text(speed, 'm/s')}."
    program = f"the program changes within {as_text(scale, 's')}" if math.isfinite(scale) else "nothing changes"
    return lag / scale, f"Waves lag by {as_text(lag, 's')} over {as_text(2 * width, 'm')}; {program}."


def heating(scene: Scene) -> Number | None:
    """Return the temperature rise of the spots by friction; None if nothing slides."""
    (speed, power), rubbed = scene.slide, scene.fullest
    if speed == 0:
        return None
    if "speed" in scene.dataset.dims:
        powers = np.nan_to_num((scene.dataset["friction_force"] * scene.dataset["speed"]).values)  # NaN: not solved
        rubbed = scene.dataset.isel(speed=int(powers.argmax()))
    spots, area, heat = _spots(scene.pressure_in(rubbed)), float(rubbed["contact_area"]), max(power, 0.0)
    conductivity, capacity = scene.need("heat_conductivity", "volumetric_heat_capacity")
    radius = math.sqrt(area / (math.pi * spots))
    rise = effects.flash_temperature(heat / area, radius, speed, conductivity, capacity)
    heats = f"{as_text(heat, 'W')} of friction heat {_counted(spots).lower()} of mean radius {as_text(radius, 'm')}"
    return rise, f"{heats} by {as_text(rise, 'K')} above the surface around."


def coupling(scene: Scene) -> Number:
    """Return the larger of Dundurs' second constants for the early and the late compliances."""
    if not scene.bodies:
        raise NotKnown("Poisson's ratio of each body is not known, or changes in time.")
    early, late, poissons = zip(*scene.bodies, strict=True)
    number = max(effects.dundurs_coupling(each, poissons) for each in (early, late) if sum(each) > 0)
    change = "does not change the pressure" if number == 0 else "would change the pressure slightly"
    return number, f"Static friction {change}."


def resolution(scene: Scene) -> Number | None:
    """Return the part of the rms slope from the last octave; None if the recipe states the shortest wavelength."""
    if scene.stated_wave is not None:
        return None
    _, last, shortest = scene.waves
    if is_analytic(scene.period):
        return 0.0, "The profile is analytic: it has no shorter wavelengths."
    if scene.is_smooth:
        return _ONLY_FORM, f"Only form: 99 % of the squared slope lies above {as_text(shortest / 2, 'm')}."
    if math.isnan(last):
        raise NotKnown("Points are missing, or the surface is flat: its shortest wavelengths are not known.")
    adds = f"Wavelengths below {as_text(shortest, 'm')} add {percent(last)} of the slope, and remove as much of the"
    return last, f"{adds} area; the next octave may do so again."


def stated_resolution(scene: Scene) -> Number | None:
    """Return the cell size over the shortest wavelength of the recipe; None if the recipe states none."""
    if scene.stated_wave is None:
        return None
    wave, cells = scene.stated_wave
    return 1 / cells, f"The shortest wavelength of the generator, {as_text(wave, 'm')}, has {cells:.3g} cells."


def border(scene: Scene) -> Number | None:
    """Return the step at borders where the surface repeats; None in free space."""
    if scene.boundary == "free":
        return None
    number = max(border_mismatch(scene.period).of_neighbours)
    advice = "" if number < LIMITS["border"].doubtful else ' Use boundary = "mirror".'
    return number, f"Opposite borders differ {number:.2g} times as much as neighbouring rows.{advice}"


def _spots(pressure: Array) -> int:
    """Return the number of connected regions in contact; a region across a periodic border counts twice."""
    return int(ndimage.label(pressure > 0, np.ones((3, 3)))[1])


def _counted(spots: int) -> str:
    return "One spot" if spots == 1 else f"{spots} spots"


def _half_width(scene: Scene) -> float:
    """Return half the width of the contact in free space, otherwise half the longer side of the surface. [m]"""
    width = max(scene.sides) / 2
    if scene.boundary == "free":
        width = math.sqrt(float(scene.fullest["contact_area"]) / math.pi)
        with suppress(NotKnown):
            width = scene.extent
    if not width > 0:
        raise NotKnown("The result has no contact.")
    return width


#: Name of a limit -> its check.
CHECKS: dict[str, Callable[[Scene], Number | None]] = {
    "adhesion": adhesion,
    "stickiness": stickiness,
    "yielding": yielding,
    "thickness": thickness,
    "slope": slope,
    "strain": strain,
    "inertia": inertia,
    "heating": heating,
    "coupling": coupling,
    "resolution": resolution,
    STATED: stated_resolution,
    "border": border,
}


def audit(
    result: xr.Dataset,
    *,
    work_of_adhesion: float | str | None = None,
    yield_strength: float | str | None = None,
    thickness: float | str | None = None,
    base: Base | None = None,
    density: float | str | None = None,
    linear_strain: float | None = None,
    heat_conductivity: float | str | None = None,
    volumetric_heat_capacity: float | str | None = None,
) -> Audit:
    """Check the assumptions of the model for a result.

    Parameters
    ----------
    result : xarray.Dataset
        A result of one case.
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
    linear_strain : float, optional
        Largest strain at which the material is linear. [-]
    heat_conductivity : float or str, optional
        Heat conductivity of the body. [W/(m K)]
    volumetric_heat_capacity : float or str, optional
        Volumetric heat capacity of the body: density times specific heat. [J/(m3 K)]

    Returns
    -------
    Audit
        A number, a verdict and a sentence for each assumption that applies. Values that are not given come from the
        table ``[audit]`` of the study, if there is one. If a value is missing, the verdict is ``not known``, and the
        sentence names the missing input.

    Raises
    ------
    InputError
        If a value has a wrong type or is out of range, or the result contains several cases.

    Notes
    -----
    :data:`roughvisc.study.audit.limits.LIMITS` contains the limits of the verdicts and their sources. The audit uses
    the lowest modulus: the modulus at the end of the program, or for the longest wavelength at the lowest speed. With
    this modulus adhesion and inertia are largest.

    Examples
    --------
    >>> import roughvisc as rv
    >>> ball = rv.sphere(radius=1e-2, size=1e-3, shape=24)
    >>> ds = rv.simulate(ball, rv.elastic(1e6), rv.Program().load(5e-3, over=1.0), progress=False)
    >>> found = rv.audit(ds, work_of_adhesion="50 mJ/m^2")
    >>> found["adhesion"].verdict, found["slope"].verdict, found["yielding"].verdict
    ('broken', 'holds', 'not known')
    """
    given = AuditInputs(
        work_of_adhesion=work_of_adhesion,
        yield_strength=yield_strength,
        thickness=thickness,
        base=base,
        density=density,
        linear_strain=linear_strain,
        heat_conductivity=heat_conductivity,
        volumetric_heat_capacity=volumetric_heat_capacity,
    )
    if base is not None and thickness is None:
        raise InputError(key="base", found=base, expected="a thickness too")
    if not isinstance(result, xr.Dataset):
        raise InputError(key="audit", found=type(result).__name__, expected="a result (xarray.Dataset)")
    axis = axis_of(result.variables)
    if extra := [str(dim) for dim in result.dims if dim not in (axis, *OTHER_DIMS)]:
        raise InputError(key="audit", found=extra[0], expected="the result of one case, as open_result opens its file")
    for name in (axis, "force", "approach", "contact_area", "contact_fraction"):
        if name not in result.variables:
            raise InputError(key="audit", found=[*map(str, result.variables)], expected=f"a result with {name!r}")
    if not result.sizes.get(axis):
        raise InputError(key="audit", found=[], expected=f"a {axis} at least")
    expect_declared_units(result)
    case = Case.from_json(result.attrs["case"]) if "case" in result.attrs else None
    scene = Scene(result, case, AuditInputs(**{**(case.audit_inputs if case else {}), **given.stated()}))
    findings = []
    for name, limit in LIMITS.items():
        try:
            found = CHECKS[name](scene)
        except NotKnown as missing:
            found = math.nan, str(missing)
        if found is not None:
            findings.append(Finding(name.partition(" ")[0], *found, limit))
    return Audit(str(result.attrs.get("title", "")), tuple(findings))


# -------------------------------------------------------------------------------------------------------------- words


def as_text(value: float, unit: str, digits: int = 2) -> str:
    """Return a quantity in SI as text with some significant digits, as 490 kPa and not 4.9e+02 kPa."""
    return format_quantity(float(f"{value:.{digits}g}"), unit)


def percent(share: float) -> str:
    """Return a fraction as text with two digits, as 100 % and not 1e+02 %; a very small fraction as a bound."""
    return "less than 0.1 %" if 0 < share < 1e-3 else f"{float(f'{100 * share:.2g}'):g} %"
