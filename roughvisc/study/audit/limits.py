"""The limits of every verdict of an audit, in one table, each with its source; and a finding, judged by them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from roughvisc.units import format_quantity

#: The verdicts, from the best to the worst; without a number none is given.
HOLDS, DOUBTFUL, BROKEN, NOT_KNOWN = "holds", "doubtful", "broken", "not known"
VERDICTS = (HOLDS, DOUBTFUL, BROKEN, NOT_KNOWN)
#: Distance over which surfaces attract each other: that between atoms (D. Tabor, J. Colloid Interface Sci. 58 (1977)
#: 2). The Tabor parameter goes with its inverse, the attraction of stiff rough surfaces with that of its cube root. [m]
ATTRACTION_RANGE = 3e-10
#: Tabor parameter up to which the attraction leaves the spots' shape alone, as stiff rough surfaces have it.
STIFF = 1.0


@dataclass(frozen=True)
class Limit:
    """Limits by which an assumption is judged.

    Attributes
    ----------
    assumption : str
        The assumption, as a sentence.
    number : str
        Meaning of the number. A larger number is worse.
    doubtful, broken : float
        Numbers from which the assumption is doubtful, and broken.
    meaning : str
        Meaning of these two limits.
    source : str
        Source of the limits.
    """

    assumption: str
    number: str
    doubtful: float
    broken: float
    meaning: str
    source: str

    def verdict(self, number: float) -> str:
        """Verdict on a number; NaN is not known."""
        if math.isnan(number):
            return NOT_KNOWN
        return BROKEN if number >= self.broken else DOUBTFUL if number >= self.doubtful else HOLDS


#: Of a number that is exact on the limit: what has just so many cells is on its better side.
_JUST = 1 + 1e-9
#: The entry by which waves are judged whose shortest one is stated.
STATED = "resolution (stated)"
#: name -> limits, in the order of an audit. Unless a threshold has a meaning of its own, an effect of some 10 % makes
#: an assumption doubtful, and one of the size of what is computed breaks it.
LIMITS: dict[str, Limit] = {
    "adhesion": Limit(
        "The spots in contact do not stick.",
        "pull-off force of the spots over the largest load",
        0.005,
        0.3,
        "contact area 10 % larger; twice as large (JKR)",
        "K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301",
    ),
    "stickiness": Limit(
        "A rough surface does not stick without a load.",
        "stiff spots (Tabor parameter up to 1): attraction over repulsion; soft ones: work of adhesion over the "
        "elastic energy of full contact",
        0.1,
        1.0,
        "contact area 10 % larger; sticks without a load",
        "L. Pastewka, M. O. Robbins, PNAS 111 (2014) 3298; B. N. J. Persson, E. Tosatti, J. Chem. Phys. 115 (2001) "
        "5597",
    ),
    "yielding": Limit(
        "Neither body yields.",
        "largest pressure over the yield strength in tension",
        1.6,
        3.0,
        "first yield under a sphere, at a mean pressure of 1.1 times the strength; full plasticity",
        "K. L. Johnson, Contact Mechanics, CUP, 1985, sections 6.1 and 6.3",
    ),
    "thickness": Limit(
        "The body is deeper than the contact is wide.",
        "estimated relative error of a half-space: too large an approach at the same load or, in free space, too small "
        "a force at the same approach, whichever is larger",
        0.1,
        0.5,
        "10 % off; the approach twice the true one, or the force half the true one",
        "K. L. Johnson, Contact Mechanics, CUP, 1985, section 5.8",
    ),
    "slope": Limit(
        "Slopes are small.",
        "rms slope of the loaded surface",
        0.3,
        1.0,
        "true area 4.5 % larger than projected (half the squared slope); 50 % larger",
        "K. L. Johnson, Contact Mechanics, CUP, 1985, section 4.1",
    ),
    "strain": Limit(
        "The material is linear.",
        "rms slope of the loaded surface (a/R for a sphere) over the largest strain at which the material is linear",
        1.0,
        5.0,
        "the largest strains, about the slope, exceed the linear range; the representative strain, 0.2 a/R, does",
        "D. Tabor, The Hardness of Metals, OUP, 1951; K. L. Johnson, Contact Mechanics, CUP, 1985, section 6.3",
    ),
    "inertia": Limit(
        "The motion is slow.",
        "lag by radiated waves over the shortest time scale of the program or, in a slide, relative increase of the "
        "displacement under a moving load, whichever is larger",
        0.1,
        1.0,
        "force or displacement 10 % off its quasi-static value; 100 % off",
        "J. Lysmer, F. E. Richart, J. Soil Mech. Found. Div. ASCE 92 (1966) 65; J. Cole, J. Huth, J. Appl. Mech. 25 "
        "(1958) 433",
    ),
    "heating": Limit(
        "Friction does not heat the spots.",
        "mean temperature rise of the spots in a slide [K] if all heat flows into the body",
        1.0,
        10.0,
        "retardation times of a rubber a fifth shorter; six times shorter (universal WLF constants)",
        "J. C. Jaeger, Proc. R. Soc. N.S.W. 76 (1942) 203; J. F. Archard, Wear 2 (1959) 438; M. L. Williams, R. F. "
        "Landel, J. D. Ferry, J. Am. Chem. Soc. 77 (1955) 3701",
    ),
    "coupling": Limit(
        "Pressure causes no sideways displacement.",
        "Dundurs' second constant, (1 - 2 nu)/(2 - 2 nu) of one body",
        0.5,
        1.0,
        "a punch with full friction is 10 % stiffer than one without; cannot be reached",
        "D. A. Spence, Proc. R. Soc. A 305 (1968) 55",
    ),
    "resolution": Limit(
        "The grid resolves all wavelengths that matter.",
        "part of the rms slope from the last octave of wavelengths; under light loads also the part of the contact "
        "area that it removes",
        0.1,
        0.5,
        "10 % of the area; half of it, and as much again for the next octave",
        "B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840",
    ),
    STATED: Limit(
        "The grid resolves all wavelengths of a surface whose generator states the shortest.",
        "cell size over the shortest wavelength",
        _JUST / 8,
        _JUST / 4,
        "fewer than 8 cells per wavelength: a crest interpolated between cells is 8 % too low; fewer than 4: 29 %",
        "arithmetic: 1 - cos(pi / n) for n cells per wavelength",
    ),
    "border": Limit(
        "The surface repeats without a step.",
        "difference between opposite borders over that between neighbouring rows",
        2.0,
        10.0,
        "a step is visible; on 100 rows the seam has as much of the mean square slope as all other rows",
        "topography.borders; arithmetic: the square of the number over the number of rows",
    ),
}
#: Shown as nothing.
_LEAST = 1e-9


@dataclass(frozen=True)
class Finding:
    """What was found of one assumption.

    Attributes
    ----------
    name : str
        Of the assumption, as :data:`LIMITS` has it.
    number : float
        What it is judged by; NaN where it is not known.
    sentence : str
        What the number says here, or what to give so that it is known.
    judged_by : str
        Entry of that table which the number belongs to; that of the name unless given.
    """

    name: str
    number: float
    sentence: str
    judged_by: str = ""

    @property
    def limit(self) -> Limit:
        """What it is judged by."""
        return LIMITS[self.judged_by or self.name]

    @property
    def verdict(self) -> str:
        """``holds``, ``doubtful``, ``broken`` or ``not known``."""
        return self.limit.verdict(self.number)

    @property
    def shown(self) -> str:
        """The number to two digits, next to nothing as 0; empty where it is not known."""
        return "" if self.verdict == NOT_KNOWN else f"{float(f'{max(self.number, _LEAST) - _LEAST:.2g}'):g}"


def unknown(name: str, sentence: str) -> Finding:
    """A finding without a number."""
    return Finding(name, math.nan, sentence)


def as_text(value: float, unit: str, digits: int = 2) -> str:
    """A quantity in SI to so many digits, as 490 kPa and not 4.9e+02 kPa."""
    return format_quantity(float(f"{value:.{digits}g}"), unit)


def percent(share: float) -> str:
    """A share to two digits, as 100 % and not 1e+02 %; of next to nothing a bound."""
    if 0 < share < 1e-3:
        return "less than 0.1 %"
    return f"{float(f'{100 * share:.2g}'):g} %"
