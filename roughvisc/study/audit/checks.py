"""Checks of the assumptions of the model, each with its limits and their source."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from roughvisc.mechanics.sheet import BASE, Sheet, complement
from roughvisc.study.audit.scene import NotKnown, Scene
from roughvisc.topography.borders import border_mismatch, is_analytic, recipe_name
from roughvisc.units import format_quantity

#: Contact fraction above which the contact spots have merged.
_MERGED = 0.5
#: Radius of curvature over width of the contact, above which a profile counts as flat.
_FLAT = 1e4
#: Poisson's ratio with the smallest shear modulus for a contact modulus.
_SOFTEST = 0.5
#: Margin of the shortest wavelength of a recipe.
_JUST_BELOW = 0.99
#: Number of the resolution check for a surface without roughness: 1 - sqrt(0.99).
_ONLY_FORM = 0.005

#: Number and sentence of a finding; None if the assumption does not apply.
Found = tuple[float, str] | None


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

    check: Callable[[Scene], Found]
    doubtful: float
    broken: float
    source: str

    @property
    def number(self) -> str:
        """Meaning of the number: the summary of its check."""
        return (self.check.__doc__ or "").partition(".\n")[0].rstrip(".")


def adhesion(scene: Scene) -> Found:
    r"""Pull-off force of the spots over the largest load.

    Each spot of radius ``R`` holds :math:`\frac32 \pi w R` (JKR). A stiff and small one holds up to a third more (DMT).
    """
    force, curvature, fraction = scene.force, scene.curvature, float(scene.fullest["contact_fraction"])
    if scene.boundary != "free" and fraction > _MERGED:
        raise NotKnown(f"{percent(fraction)} of the area is in contact, without separate spots: see stickiness.")
    if not curvature * _FLAT * scene.half_width > 1:
        raise NotKnown("The contact is flat: its pull-off force is not estimated.")
    [w] = scene.need("work_of_adhesion")
    spots = _spots(scene.pressure)
    pull = spots * 1.5 * math.pi * w / curvature
    held = f"{_counted(spots)} of mean radius {as_text(1 / curvature, 'm')} would hold {as_text(pull, 'N')} when"
    return pull / force, f"{held} pulled off."


def stickiness(scene: Scene) -> Found:
    r"""Work of adhesion over the elastic energy of full contact.

    The energy per area is :math:`E^* \sum |q| |h_q|^2 / 4` over all waves of the surface. A softer surface stays
    in full contact without a load.
    """
    if scene.boundary == "free" and scene.is_smooth:
        return None
    energy = scene.waves[0] / (4 * scene.late)
    if math.isnan(energy):
        raise NotKnown("Points are missing, or the surface is flat: the energy of full contact is not known.")
    [w] = scene.need("work_of_adhesion")
    return w / energy, f"Full contact stores {as_text(energy, 'J/m^2')} of elastic energy."


def yielding(scene: Scene) -> Found:
    """Largest pressure over the yield strength in tension."""
    peak = float(scene.pressure.max())
    for frame in scene.dataset["pressure"]:  # one frame in memory at a time
        peak = max(peak, float(np.nan_to_num(frame.values).max()))
    [strength] = scene.need("yield_strength")
    return peak / strength, f"The largest pressure is {as_text(peak, 'Pa')}."


def thickness(scene: Scene) -> Found:
    """Relative error of the approach of a half-space, at the same load."""
    if scene.facts.get("thickness", math.inf) < math.inf:
        return 0.0, f"Modelled: a sheet of {as_text(scene.facts['thickness'], 'm', 3)}, {scene.facts['base']}."
    if "kernel" in scene.facts:
        return 0.0, f"Modelled: {scene.facts['kernel']}."
    if not scene.facts.get("poisson", -1.0) >= 0:
        raise NotKnown("Two bodies, or a Poisson ratio that changes or is negative: a sheet cannot be compared.")
    [depth] = scene.need("thickness")
    sheet = Sheet(depth, scene.facts["poisson"], scene.given.get("base", BASE))
    relief = sheet.relief * scene.force if scene.boundary == "free" else _periodic_relief(scene, sheet)
    reduction = scene.late * relief / float(scene.fullest["approach"])  # to first order
    excess = reduction / (1 + reduction)
    base = f"On a {sheet.base} sheet of {as_text(depth, 'm', 3)}"
    return excess, f"{base} the approach would be {percent(excess)} smaller at the same load."


def slope(scene: Scene) -> Found:
    """Rms slope of the loaded surface."""
    more = percent(scene.loaded_slope**2 / 2)
    return scene.loaded_slope, f"The loaded surface has {more} more area than its projection."


def strain(scene: Scene) -> Found:
    """Rms slope of the loaded surface over the largest strain at which the material is linear."""
    largest, [linear] = scene.loaded_slope, scene.need("linear_strain")
    return largest / linear, f"Strains are at most about {percent(largest)}, and on average {percent(0.2 * largest)}."


def inertia(scene: Scene) -> Found:
    r"""Lag of waves over the time scale of the program, or relative increase of the displacement in a slide.

    The lag is dashpot over spring of a round punch of radius ``a`` on a half-space, :math:`0.85\,a / c`, with the speed
    ``c`` of shear waves. The displacement under a load that moves with the speed ``V`` increases by about
    :math:`V^2 / (c^2 - V^2)`. Up to 0.7 ``c`` this is 0.85 to 1.4 times the exact increase for any Poisson ratio from
    0 to 0.5.
    """
    width, scale, speed = scene.half_width, float(scene.facts["time_scale"]), scene.slide[0]
    [density] = scene.need("density")
    shear = (1 - float(scene.facts.get("poisson", _SOFTEST))) / (2 * scene.late)
    waves = math.sqrt(shear / density)
    lag, excess = 0.85 * width / waves, speed**2 / (waves**2 - speed**2) if speed < waves else math.inf
    if excess > lag / scale:
        slides = f"the profile slides at {as_text(speed, 'm/s')}"
        return excess, f"Shear waves travel at {as_text(waves, 'm/s')}, and {slides}."
    program = f"the program changes within {as_text(scale, 's')}" if math.isfinite(scale) else "nothing changes"
    return lag / scale, f"Waves lag by {as_text(lag, 's')} over {as_text(2 * width, 'm')}; {program}."


def heating(scene: Scene) -> Found:
    r"""Mean temperature rise of the spots in a slide [K] if all heat flows into the body.

    The rise of a slow round spot of radius ``a`` under a heat flux ``q`` is :math:`0.849\,q a / k`, and of a fast one
    :math:`0.974\,(q a / k) / \sqrt P` with :math:`P = V a \rho c / k` (Jaeger, Archard). Between the limits their
    inverse squares are added, as Tian and Kennedy, J. Tribol. 116 (1994) 167, propose: the rise is at most 4 % too low.
    """
    speed, power, rubbed = scene.slide
    if speed == 0:
        return None
    spots, area, heat = _spots(scene.pressure_in(rubbed)), float(rubbed["contact_area"]), max(power, 0.0)
    conductivity, capacity = scene.need("heat_conductivity", "volumetric_heat_capacity")
    radius = math.sqrt(area / (math.pi * spots))
    peclet = speed * radius * capacity / conductivity
    rise = heat / area * radius / conductivity / math.sqrt(1 / 0.849**2 + peclet / 0.974**2)
    heats = f"{as_text(heat, 'W')} of friction heat {_counted(spots).lower()} of mean radius {as_text(radius, 'm')}"
    return rise, f"{heats} by {as_text(rise, 'K')} above the surface around."


def resolution(scene: Scene) -> Found:
    """Part of the rms slope from the last octave of wavelengths, about the part of the area that it removes."""
    _, last, longest = scene.waves
    complete = is_analytic(scene.period)
    if recipe_name(scene.period) == "self_affine":
        made = json.loads(scene.height.attrs["recipe"])["parameters"]
        shortest = made["shortcut"] / math.sqrt(made["anisotropy"])
        # conditioning may have added shorter waves
        complete = shortest > 2 * max(scene.cells) and longest / 2 > _JUST_BELOW * shortest
    if complete:
        return 0.0, "The recipe has no wavelengths shorter than two cells."
    if scene.is_smooth:
        return _ONLY_FORM, f"Only form: 99 % of the squared slope lies above {as_text(longest / 2, 'm')}."
    if math.isnan(last):
        raise NotKnown("Points are missing, or the surface is flat: its shortest wavelengths are not known.")
    adds = f"Wavelengths below {as_text(longest, 'm')} add {percent(last)} of the slope, and remove as much of the"
    return last, f"{adds} area; the next octave may do so again."


def border(scene: Scene) -> Found:
    """Difference between opposite borders over that between neighbouring rows."""
    if scene.boundary == "free":
        return None
    if scene.boundary == "mirror":
        return 0.0, "The surface repeats with its mirror images: its borders meet."
    number = max(border_mismatch(scene.height))
    advice = "" if number < LIMITS["border"].doubtful else ' Use boundary = "mirror".'
    return number, f"Opposite borders differ {number:.2g} times as much as neighbouring rows.{advice}"


def _periodic_relief(scene: Scene, sheet: Sheet) -> float:
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
    lost = power * 2 / q * complement(q * sheet.thickness, sheet.poisson, sheet.base)
    return float(lost.sum() / (pressure.size * pressure.sum()))


def _spots(pressure: NDArray[np.float64]) -> int:
    """Return the number of connected regions in contact; a region across a periodic border counts twice."""
    return int(ndimage.label(pressure > 0, np.ones((3, 3)))[1])


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
    Limit(stickiness, 0.1, 1, "contact area 10 % larger; sticks without a load: Persson, Tosatti (2001)"),
    Limit(yielding, 1.6, 3, "first yield under a sphere; full plasticity: Johnson (1985), sections 6.1 and 6.3"),
    Limit(thickness, 0.1, 0.5, "10 % off; twice the true approach: Johnson (1985), section 5.8"),
    Limit(slope, 0.3, 1, "true area 4.5 % larger than projected; 50 % larger: Johnson (1985), section 4.1"),
    Limit(strain, 1, 5, "largest strains exceed the linear range; the representative strain does: Tabor (1951)"),
    Limit(inertia, 0.1, 1, "10 % off the quasi-static value; 100 % off: Lysmer, Richart (1966); Cole, Huth (1958)"),
    Limit(heating, 1, 10, "retardation times a fifth shorter; six times shorter: Williams, Landel, Ferry (1955)"),
    Limit(resolution, 0.1, 0.5, "10 % of the area; half of it, and as much again for the next octave: Persson (2001)"),
    Limit(border, 2, 10, "a step is visible; on 100 rows the seam has as much mean square slope as all other rows"),
)
#: Name of an assumption -> its limits.
LIMITS = {one.check.__name__: one for one in _TABLE}
