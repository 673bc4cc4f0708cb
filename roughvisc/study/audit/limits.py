"""Limits of the assumptions of the model, each with its source, and the properties that an audit needs."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, get_args

from roughvisc.errors import InputError
from roughvisc.mechanics.sheet import Base
from roughvisc.units import number


@dataclass(frozen=True)
class Limit:
    """Limits of one assumption.

    Attributes
    ----------
    assumption : str
        The assumption, as a sentence.
    number : str
        Meaning of the number. A larger number is worse.
    doubtful, broken : float
        Numbers from which the assumption is doubtful, and broken.
    source : str
        Meaning of both limits, and their source.
    """

    assumption: str
    number: str
    doubtful: float
    broken: float
    source: str


#: Name of the resolution limit for a surface whose generator states its shortest wavelength.
STATED = "resolution (stated)"
#: Margin for the rounding of a number exactly at a limit, so that 8 cells per wavelength are still accepted.
_JUST = 1 + 1e-9
#: Name -> limits, in the order of an audit. Unless a threshold has a physical meaning, an effect of some 10 % makes an
#: assumption doubtful, and an effect of the size of the computed quantity breaks the assumption.
LIMITS: dict[str, Limit] = {
    "adhesion": Limit(
        "The spots in contact do not stick.",
        "pull-off force of the spots over the largest load",
        0.005,
        0.3,
        "contact area 10 % larger; twice as large: Johnson, Kendall, Roberts (1971)",
    ),
    "stickiness": Limit(
        "A rough surface does not stick without a load.",
        "stiff spots: attraction over repulsion; soft ones: work of adhesion over elastic energy of full contact",
        0.1,
        1.0,
        "contact area 10 % larger; sticks without a load: Pastewka, Robbins (2014); Persson, Tosatti (2001)",
    ),
    "yielding": Limit(
        "Neither body yields.",
        "largest pressure over the yield strength in tension",
        1.6,
        3.0,
        "first yield under a sphere; full plasticity: Johnson (1985), sections 6.1 and 6.3",
    ),
    "thickness": Limit(
        "The body is deeper than the contact is wide.",
        "relative error of a half-space: of the approach at the same load, in free space also of the force",
        0.1,
        0.5,
        "10 % off; the approach twice the true one, or the force half of it: Johnson (1985), section 5.8",
    ),
    "slope": Limit(
        "Slopes are small.",
        "rms slope of the loaded surface",
        0.3,
        1.0,
        "true area 4.5 % larger than projected; 50 % larger: Johnson (1985), section 4.1",
    ),
    "strain": Limit(
        "The material is linear.",
        "rms slope of the loaded surface over the largest strain at which the material is linear",
        1.0,
        5.0,
        "largest strains exceed the linear range; the representative strain does: Tabor (1951)",
    ),
    "inertia": Limit(
        "The motion is slow.",
        "lag of waves over the time scale of the program, or relative increase of the displacement in a slide",
        0.1,
        1.0,
        "10 % off the quasi-static value; 100 % off: Lysmer, Richart (1966); Cole, Huth (1958)",
    ),
    "heating": Limit(
        "Friction does not heat the spots.",
        "mean temperature rise of the spots in a slide [K] if all heat flows into the body",
        1.0,
        10.0,
        "retardation times a fifth shorter; six times shorter: Williams, Landel, Ferry (1955)",
    ),
    "coupling": Limit(
        "Pressure causes no sideways displacement.",
        "Dundurs' second constant, (1 - 2 nu)/(2 - 2 nu) of one body",
        0.5,
        1.0,
        "a punch with full friction is 10 % stiffer; cannot be reached: Spence (1968)",
    ),
    "resolution": Limit(
        "The grid resolves all wavelengths that matter.",
        "part of the rms slope from the last octave of wavelengths, about the part of the area that it removes",
        0.1,
        0.5,
        "10 % of the area; half of it, and as much again for the next octave: Persson (2001)",
    ),
    STATED: Limit(
        "The grid resolves all wavelengths of a surface whose generator states the shortest.",
        "cell size over the shortest wavelength",
        _JUST / 8,
        _JUST / 4,
        "fewer than 8 cells per wavelength: a crest is 8 % too low; fewer than 4: 29 %, 1 - cos(pi / n)",
    ),
    "border": Limit(
        "The surface repeats without a step.",
        "difference between opposite borders over that between neighbouring rows",
        2.0,
        10.0,
        "a step is visible; on 100 rows the seam has as much mean square slope as all other rows",
    ),
}

#: Property -> its unit and the bound of its values.
PROPERTIES: dict[str, tuple[str, dict[str, float]]] = {
    "work_of_adhesion": ("J/m^2", {"least": 0}),
    "yield_strength": ("Pa", {"above": 0}),
    "thickness": ("m", {"above": 0}),
    "density": ("kg/m^3", {"above": 0}),
    "linear_strain": ("1", {"above": 0}),
    "heat_conductivity": ("W/m/K", {"above": 0}),
    "volumetric_heat_capacity": ("J/m^3/K", {"above": 0}),
}


@dataclass(frozen=True, kw_only=True)
class AuditInputs:
    """Properties of the bodies that only an audit uses; see :func:`roughvisc.audit`.

    Quantities are numbers in SI or text with a unit; None if they are not given.
    """

    work_of_adhesion: Any = None
    yield_strength: Any = None
    thickness: Any = None
    base: Any = None
    density: Any = None
    linear_strain: Any = None
    heat_conductivity: Any = None
    volumetric_heat_capacity: Any = None

    def __post_init__(self) -> None:
        for name, (unit, bound) in PROPERTIES.items():
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, number(value, unit, name, **bound))
        if self.base not in (None, *get_args(Base)):
            raise InputError(key="base", found=self.base, expected=" or ".join(map(repr, get_args(Base))))

    def stated(self) -> dict[str, Any]:
        """Return the given properties, in SI."""
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        return {name: value for name, value in values.items() if value is not None}
