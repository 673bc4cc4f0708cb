r"""Sources of error of a number, each by a formula of the logarithms of a few more solves.

Of a number :math:`Q` its error is stated as :math:`\ln Q \pm U`. The factors were measured on rough surfaces whose true
numbers were known: see docs/howto/whole-error.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from roughvisc.errors import InputError
from roughvisc.study.budget.solves import Array
from roughvisc.study.budget.variants import PATCHES, STEP, Variants, slower, stiffer
from roughvisc.study.case import Case
from roughvisc.study.quantities import Observable, creep_time, is_sliding
from roughvisc.units import number, unit_for

Population = Literal["patch", "ensemble"]
#: Power with which the error of the grid is taken to vanish.
_ORDER = 1.5
#: Of six patches: of the standard deviation of the logarithm, what holds the mean of all in 95 of 100. Student has
#: 2.57; the patches have the spectrum of the one that was measured, whose longest waves scatter too.
_SAMPLE = 3.3
#: Names of the solves of the surrogates.
SURROGATES = tuple(f"patch {number}" for number in range(1, PATCHES + 1))
#: A spectrum that ends at a wavelength has 99 % of its slope above a wavelength longer by up to this factor.
_SAME = 1.15
#: Of the contact area where it slides, what the next octave changes over what the last one did.
_SLIDING_OCTAVE = 2.0


@dataclass(frozen=True)
class Asked:
    """What is known of a budget beside its case.

    Attributes
    ----------
    variants : Variants
        The case and its relatives.
    modulus_error, time_scale_error : float or None
        Relative errors of the material, at 95 %.
    cutoff : float or None
        Wavelength of the shortest waves that the real surface has. [m]
    population : {"patch", "ensemble"}
        Whether the number is of this patch, or of the roughness that it is a sample of.
    """

    variants: Variants
    modulus_error: float | None = None
    time_scale_error: float | None = None
    cutoff: float | None = None
    population: Population = "patch"

    def solves(self) -> dict[str, Case]:
        """Name -> case of every solve that the sources need; ``own`` is the case itself."""
        variants, found = self.variants, {"own": self.variants.case, "coarse": self.variants.on_cells(2.0)}
        compared = found[self.compared]
        if not variants.is_rough:  # two grids may agree by chance; a third one of a rough surface is another surface
            found["coarsest"] = variants.on_cells(4.0)
        if self.modulus_error:
            found["stiffer"] = stiffer(compared)
        if self.time_scale_error:
            found["slower"] = slower(compared)
        if self.octaves > 0:
            found["smooth"] = variants.without_last_octave(variants.case)
        if self.draws:
            found |= {name: variants.other_patch(number) for number, name in enumerate(SURROGATES, 1)}
        return found

    @property
    def draws(self) -> bool:
        """Whether surrogates of the surface are solved."""
        return self.population == "ensemble" and self.variants.is_rough

    @property
    def compared(self) -> str:
        """The solve that one with another material is compared with: where few cells touch, on the case's own grid."""
        return "coarse" if self.variants.is_rough else "own"

    @property
    def octaves(self) -> float:
        """Octaves of waves that the real surface has beyond the shortest of this one; zero where that is not known."""
        if self.cutoff is None or not self.variants.is_rough or self.variants.shortest_wave < _SAME * self.cutoff:
            return 0.0
        return math.log2(self.variants.shortest_wave / self.cutoff)


#: Names of the errors that a user knows.
KNOWN = ("modulus_error", "time_scale_error", "cutoff", "population")


def known_errors(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the errors that a user states, checked and in SI.

    Raises
    ------
    InputError
        If a value is none of those expected.
    """
    known = {name: one for name, one in given.items() if one is not None}
    for name in ("modulus_error", "time_scale_error"):
        if name in known:
            known[name] = number(known[name], "1", name, least=0, below=1)
    if "cutoff" in known:
        known["cutoff"] = number(known["cutoff"], "m", "cutoff", above=0)
    found: dict[str, Any] = {"population": "patch"} | known
    if found["population"] not in get_args(Population):
        expected = " or ".join(map(repr, get_args(Population)))
        raise InputError(key="population", found=found["population"], expected=expected)
    return found


@dataclass(frozen=True)
class Found:
    """What a source makes of a number.

    Attributes
    ----------
    half_width : ndarray, float or None
        Of the logarithm, at each place [-]; None where it is not known.
    method : str
        How it was found, or what would be needed to know it.
    direction : int
        1 or -1 of an error that only raises or lowers the number, 0 of any other; an array where places differ.
    solves : tuple of str
        The solves that it took, beside the first.
    counts : bool
        Whether the source has a meaning here.
    """

    half_width: Array | float | None
    method: str
    direction: Any = 0
    solves: tuple[str, ...] = ()
    counts: bool = True

    @property
    def state(self) -> Literal["counted", "none", "open"]:
        """Whether it is part of the whole error."""
        if self.half_width is None:
            return "open"
        return "counted" if self.counts else "none"


def _no_source(why: str) -> Found:
    """What has no meaning here."""
    return Found(0.0, why, counts=False)


Values = Mapping[str, Array]


def together(found: Iterable[Found], shape: tuple[int, ...], side: int) -> Array:
    """Half-width of all sources on one side."""
    squares = np.zeros(shape)
    for one in found:
        if one.half_width is not None:
            towards = np.broadcast_to(one.direction, shape)
            squares += np.where((towards == 0) | (towards == side), one.half_width, 0.0) ** 2
    return np.sqrt(squares)


def _apart(values: Values, one: str, other: str) -> Array:
    """Difference of the logarithms of two solves."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.log(values[one]) - np.log(values[other])


def _length(metres: float) -> str:
    return unit_for(metres, "m").text(metres, 3)


def _time_and_solver(asked: Asked, quantity: Observable, values: Values, stated: Array) -> Found:
    return Found(stated, "errors that the result states")


def _grid(asked: Asked, quantity: Observable, values: Values, stated: Array) -> Found:
    coarse = np.abs(_apart(values, "own", "coarse"))
    solves, words = ("coarse",), "cells twice as long"
    if "coarsest" in values:
        coarse = np.maximum(coarse, np.abs(_apart(values, "coarse", "coarsest")) / 2**_ORDER)
        solves, words = ("coarse", "coarsest"), "cells twice and four times as long"
    return Found(quantity.grid_factor * coarse, words, solves=solves)


def _sample(asked: Asked, quantity: Observable, values: Values, stated: Array) -> Found:
    if not asked.variants.is_rough:
        return _no_source("the surface is the whole body, and no sample")
    if asked.population == "patch":
        return _no_source("the number is of this patch; population 'ensemble' asks for its roughness")
    with np.errstate(divide="ignore", invalid="ignore"):
        scatter = np.std(np.log([values[name] for name in SURROGATES]), axis=0, ddof=1)
    words = f"{PATCHES} Gaussian surrogates on cells twice as long"
    closed = sum(not (values[name] > 0).all() for name in SURROGATES)
    if closed:  # zero has no logarithm
        words += f"; zero in {closed} of them: not how large it is but how often it is zero is to be asked"
    return Found(_SAMPLE * scatter, words, solves=SURROGATES)


def _next_octave(asked: Asked, quantity: Observable, values: Values, left: Array) -> Found:
    if not asked.variants.is_rough:
        return _no_source("the surface is no sample of a roughness")
    if asked.cutoff is None:
        return Found(None, "state cutoff, the shortest wavelength that the real surface has")
    if not asked.octaves:
        return Found(0.0, f"the grid holds all waves down to {_length(asked.cutoff)}")
    change = _apart(values, "own", "smooth")
    factor = quantity.octave_factor
    if is_sliding(asked.variants.case.experiment()) and quantity.name == "contact_area":
        factor = _SLIDING_OCTAVE
    words = f"without the shortest octave; {asked.octaves:.2g} octaves down to {_length(asked.cutoff)} are not held"
    return Found(factor * asked.octaves * np.abs(change), words, np.sign(change).astype(int), ("smooth",))


def _modulus(asked: Asked, quantity: Observable, values: Values, stated: Array) -> Found:
    if asked.modulus_error is None:
        return Found(None, "state modulus_error, the relative error of the moduli")
    return _of_material(asked, asked.modulus_error, "stiffer", "moduli", values)


def _time_scale(asked: Asked, quantity: Observable, values: Values, stated: Array) -> Found:
    if not _creeps(asked.variants.case):
        return _no_source("the material does not creep")
    if asked.time_scale_error is None:
        return Found(None, "state time_scale_error, the relative error of the times of the material")
    return _of_material(asked, asked.time_scale_error, "slower", "times of the material", values)


def _of_material(asked: Asked, error: float, solve: str, what: str, values: Values) -> Found:
    """By the change that a tenth more makes."""
    if not error:
        return Found(0.0, f"{what} are exact")
    slope = np.abs(_apart(values, solve, asked.compared)) / math.log(STEP)
    return Found(math.log1p(error) * slope, f"{what} {100 * (STEP - 1):.0f} % larger", solves=(solve,))


def _creeps(case: Case) -> bool:
    material = case.material()
    at_once, later = (float(material.contact_compliance(time)) for time in (0.0, 1e-9))
    end = creep_time(case.experiment(), 1.0)
    return float(material.contact_compliance(end)) > at_once or later > at_once


#: Name -> what it makes of a quantity from the values of the solves and the stated errors, in the order of a table.
SOURCES: dict[str, Callable[[Asked, Observable, Values, Array], Found]] = {
    "time steps and solver": _time_and_solver,
    "grid": _grid,
    "sample": _sample,
    "next octave of waves": _next_octave,
    "modulus": _modulus,
    "time scale": _time_scale,
}


def judge(asked: Asked, quantity: Observable, values: Values, stated: Array) -> dict[str, Found]:
    """Name -> what each source makes of a quantity."""
    return {name: source(asked, quantity, values, stated) for name, source in SOURCES.items()}
