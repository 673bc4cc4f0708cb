r"""Sources of error of a number, each by a formula of the logarithms of a few more solves.

Of a number :math:`Q` its error is stated as :math:`\ln Q \pm U`. The factors were measured on rough surfaces whose true
numbers were known: see docs/howto/whole-error.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.fit import AnyFit
from roughvisc.mechanics.materials.frequency import complex_compliance
from roughvisc.mechanics.materials.spectrum import lattice
from roughvisc.study.budget.solves import Array, Stated
from roughvisc.study.budget.variants import PATCHES, STEP, Variants, slower, stiffer
from roughvisc.study.quantities import Observable
from roughvisc.study.statement.case import Case
from roughvisc.study.statement.schema.evaluation import KNOWN
from roughvisc.units import stated_quantity, unit_for

Population = Literal["patch", "ensemble"]
#: Of two grids: the power with which the error of the grid is taken to vanish, and Roache's factor.
_ORDER, _TWO_GRIDS = 1.5, 3.0
#: Of six patches: of the standard deviation of the logarithm, what holds the mean of all in 95 of 100. Student has
#: 2.57; the patches have the spectrum of the one that was measured, whose longest waves scatter too.
_SAMPLE = 3.3
#: Names of the solves of the surrogates.
SURROGATES = tuple(f"patch {number}" for number in range(1, PATCHES + 1))
#: A spectrum that ends at a wavelength has 99 % of its slope above a wavelength longer by up to this factor.
_SAME = 1.15
#: Of the contact area where it slides, what the next octave changes over what the last one did.
_SLIDING_OCTAVE = 2.0
#: Instants in a decade at which the error of a fit is looked at, and how far beyond the measured times it is taken.
_INSTANTS, _BEYOND = 10, 3.0
#: Of the whole time: what a place at its beginning asks for.
_AT_ONCE = 1e-9
#: Fewer waves than these: the number hangs on the few that the patch happens to hold.
_FEW_WAVES = 30.0


@dataclass(frozen=True)
class Asked:
    """What is known of a budget beside its case.

    Attributes
    ----------
    variants : Variants
        The case and its relatives.
    sharp : bool
        Whether a grid twice as fine is computed, and gives the value.
    modulus_error, time_scale_error : float or None
        Relative errors of the material, at 95 %.
    cutoff : float or None
        Wavelength of the shortest waves that the real surface has. [m]
    population : {"patch", "ensemble"}
        Whether the number is of this patch, or of the roughness that it is a sample of.
    stated : Stated
        What a result of the case states already.
    """

    variants: Variants
    sharp: bool = False
    modulus_error: float | None = None
    time_scale_error: float | None = None
    cutoff: float | None = None
    population: Population = "patch"
    stated: Stated = field(default_factory=Stated)

    def solves(self) -> dict[str, Case]:
        """Name -> case of every solve that the sources need; ``own`` is the case itself."""
        variants, found = self.variants, {"own": self.variants.case, "coarse": self.variants.on_cells(2.0)}
        compared = found[self.compared]
        stiffened = bool(self.modulus_error or self.fits)
        if self.sharp:
            found["fine"] = variants.on_cells(0.5)
        elif self.stated.grid:
            if not (variants.is_rough and (stiffened or self.time_scale_error or self.draws)):
                del found["coarse"]
        elif not variants.is_rough:  # two grids may agree by chance; a third one of a rough surface is another surface
            found["coarsest"] = variants.on_cells(4.0)
        if stiffened:
            found["stiffer"] = stiffer(compared)
        if self.time_scale_error:
            found["slower"] = slower(compared)
        if self.octaves > 0 and (self.sharp or not self.stated.octave):
            found["smooth"] = variants.without_last_octave(found["fine" if self.sharp else "own"])
        if self.draws:
            found |= {name: variants.other_patch(number) for number, name in enumerate(SURROGATES, 1)}
        return found

    @property
    def fits(self) -> list[AnyFit]:
        """Of the materials that were fitted to a measurement, what that leaves unknown."""
        found = (getattr(material, "fit", None) for material in self.variants.case.body().materials)
        return [one for one in found if one is not None]

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


def stated_errors(case: Case) -> dict[str, Any]:
    """What the study of a case knows of errors."""
    want = case.settings.want
    return {} if want is None else want.model_dump(include=set(KNOWN), exclude_none=True)


def known_errors(case: Case, given: Mapping[str, Any]) -> dict[str, Any]:
    """What is known of the errors of a case's numbers: as given, else as its study states it.

    Raises
    ------
    InputError
        If a value is none of those expected.
    """
    known = {name: one for name, one in given.items() if one is not None}
    for name in ("modulus_error", "time_scale_error"):
        value = known.get(name, 0.0)
        if not (isinstance(value, int | float) and 0 <= value < 1):
            raise InputError(f"{name} is {value!r}: expected a relative error, at least 0 and below 1")
    if "cutoff" in known:
        known["cutoff"] = stated_quantity(known["cutoff"], "m", "cutoff", above=0)
    found: dict[str, Any] = {"population": "patch"} | stated_errors(case) | known
    if found["population"] not in get_args(Population):
        expected = " or ".join(map(repr, get_args(Population)))
        raise InputError(f"population is {found['population']!r}: expected {expected}")
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
    if asked.stated.grid and not asked.sharp:
        return Found(asked.stated.grid[quantity.name], "cells twice and four times as long, as the result states")
    coarse = np.abs(_apart(values, "own", "coarse"))
    if not asked.sharp:
        solves, words = ("coarse",), "cells twice as long"
        if "coarsest" in values:
            coarse = np.maximum(coarse, np.abs(_apart(values, "coarse", "coarsest")) / 2**_ORDER)
            solves, words = ("coarse", "coarsest"), "cells twice and four times as long"
        return Found(_TWO_GRIDS * coarse / (2**_ORDER - 1), words, solves=solves)
    fine = np.abs(_apart(values, "fine", "own"))
    half = quantity.grid_factor * np.maximum(fine, coarse / 4)
    return Found(half, "cells half and twice as long; the value is of the former", solves=("coarse", "fine"))


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
    stated = asked.stated.octave and not asked.sharp
    change = (
        asked.stated.octave[quantity.name] if stated else _apart(values, "fine" if asked.sharp else "own", "smooth")
    )
    factor = quantity.octave_factor
    if asked.variants.case.experiment().largest_speed > 0 and quantity.name == "contact_area":
        factor = _SLIDING_OCTAVE
    words = "what the shortest octave adds, as the result states" if stated else "without the shortest octave"
    words += f"; {asked.octaves:.2g} octaves down to {_length(asked.cutoff)} are not held"
    solves = () if stated else ("smooth",)
    return Found(factor * asked.octaves * np.abs(change), words, np.sign(change).astype(int), solves)


def _longest_waves(asked: Asked, quantity: Observable, values: Values, stated: Array) -> Found:
    if not asked.variants.is_rough:
        return _no_source("the surface is no sample of a roughness")
    count = asked.variants.number_of_waves
    if not quantity.of_longest_waves or count >= _FEW_WAVES:
        return _no_source(f"{count:.0f} waves carry the height")
    words = f"{count:.2g} waves carry the height (below {_FEW_WAVES:.0f})"
    if asked.population == "patch":
        return _no_source(f"{words}: the number is of this patch alone")
    return Found(None, f"{words}, so that it depends on the size of the scan: scan a larger patch")


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


def _material_fit(asked: Asked, quantity: Observable, values: Values, stated: Array) -> Found:
    """By the largest error of the modulus over the times that a place asks for, and the change by the modulus."""
    fits = asked.fits
    if not fits:
        return _no_source("the material is given by its parameters")
    intervals = _times(asked.variants, values["own"].size)
    errors, outside = np.zeros(values["own"].shape), np.zeros(values["own"].shape, bool)
    of_loss = np.zeros_like(errors)
    over = [lattice(shortest, longest, _INSTANTS) for shortest, longest in intervals]
    for fit in fits:  # of a layer and its base: as if each ruled
        first, last = fit.span()
        errors = np.maximum(errors, [float(np.max(fit.error(one))) for one in over])
        if quantity.name == "friction_coefficient":  # in proportion to the loss
            of_loss = np.maximum(of_loss, [float(np.max(fit.error(one, _loss))) for one in over])
        outside |= (intervals[:, 0] < first / _BEYOND) | (intervals[:, 1] > last * _BEYOND)
    if np.isnan(errors).any():
        return Found(None, "too few rows of the measurement to leave some out: measure more")
    reach = " to ".join(unit_for(one, "s").text(one, 2) for one in fits[0].span())
    if outside.all():
        return Found(None, f"the measurement covers {reach}, and not the times that matter here: extend it")
    words = f"rows of the measurement left out in turn: {100 * errors.max():.2g} % of the modulus"
    words += f", {100 * of_loss.max():.2g} % of the loss" if of_loss.any() else ""
    if outside.any():
        words += f"; {outside.sum()} of {outside.size} places need times beyond {reach}"
    slope = np.abs(_apart(values, "stiffer", asked.compared)) / math.log(STEP)
    return Found(np.hypot(np.log1p(errors) * slope, np.log1p(of_loss)), words, solves=("stiffer",))


def _loss(material: Any, times: Array) -> Array:
    """What a material loses in oscillations of such periods over 2 pi: the imaginary part of its compliance. [1/Pa]"""
    return -complex_compliance(material, 1 / times).imag


def _times(variants: Variants, places: int) -> Array:
    """First and last of the times that each place of a case asks of its material. [s]

    Nine tenths of what has crept at a time did so within its last decade. At a speed: those in which the waves pass.
    """
    case, experiment = variants.case, variants.case.experiment()
    times, end = case.solving().times, experiment.creep_time(1.0)
    if experiment.axis == "speed":
        waves = np.array([variants.shortest_wave, max(float(np.ptp(variants.height[axis].values)) for axis in "xy")])
        speeds = np.array(getattr(experiment, "asked", experiment.largest_speed), dtype=float)
        found = waves / (2 * math.pi * np.atleast_1d(speeds)[:, None])
    else:
        known = np.maximum(times if isinstance(times, tuple) else [end], _AT_ONCE * end)
        found = np.column_stack([known / 10, known])
    if len(found) != places:  # as where all steps are kept
        found = np.array([[found[:, 0].min(), found[:, 1].max()]])
    return np.broadcast_to(found, (places, 2))


def _of_material(asked: Asked, error: float, solve: str, what: str, values: Values) -> Found:
    """By the change that a tenth more makes."""
    if not error:
        return Found(0.0, f"{what} are exact")
    slope = np.abs(_apart(values, solve, asked.compared)) / math.log(STEP)
    return Found(math.log1p(error) * slope, f"{what} {100 * (STEP - 1):.0f} % larger", solves=(solve,))


def _creeps(case: Case) -> bool:
    material = case.material()
    at_once, later = (float(material.contact_compliance(time)) for time in (0.0, 1e-9))
    end = case.experiment().creep_time(1.0)
    return float(material.contact_compliance(end)) > at_once or later > at_once


#: Name -> what it makes of a quantity from the values of the solves and the stated errors, in the order of a table.
SOURCES: dict[str, Callable[[Asked, Observable, Values, Array], Found]] = {
    "time steps and solver": _time_and_solver,
    "grid": _grid,
    "sample": _sample,
    "next octave of waves": _next_octave,
    "longest waves": _longest_waves,
    "modulus": _modulus,
    "time scale": _time_scale,
    "material fit": _material_fit,
}


def judge(asked: Asked, quantity: Observable, values: Values, stated: Array) -> dict[str, Found]:
    """Name -> what each source makes of a quantity."""
    return {name: source(asked, quantity, values, stated) for name, source in SOURCES.items()}
