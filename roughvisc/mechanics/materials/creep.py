"""Materials by a creep function: power laws, measured creep, two bodies, and the user's own.

A creep function is not negative and increases; a passive material has a positive sum of exponentials. The solver uses
the Prony series that :func:`roughvisc.mechanics.materials.series.series` fits for the times of the program.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_number, check_poisson
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.words import in_words
from roughvisc.units import Quantity, quantities

Array = NDArray[np.float64]

#: Panels and points of the quadrature of :meth:`Creep.contact_integral` over ``y = log(t / s)``, and its upper limit.
_PANELS, _POINTS, _LIMIT = 80, 8, 40.0
#: Largest relative decrease of a creep function that counts as rounding.
_ROUNDING = 1e-9


class Material(Protocol):
    """Any object with the contact compliance of a material.

    Two attributes are optional: ``poisson``, the Poisson ratio (a half if missing), and ``note``, a text on how the
    material was found. Equal materials should compare equal, which frozen dataclasses do.
    """

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Return ``C(t) = (1 - nu) J(t) / 2``, [1/Pa], at times since the load was applied, for arrays of any shape."""
        ...


@dataclass(frozen=True, repr=False)
class Creep:
    """A shear creep compliance ``J(t)``, given as a function and its numbers.

    Parameters
    ----------
    function : callable
        ``function(t, *parameters)`` returns ``J`` [1/Pa] for an array of times [s]. It does not decrease.
    parameters : tuple
        Numbers of the function.
    poisson : float
        Poisson ratio, constant in time.
    longest : float
        Longest time at which the function is known. [s]
    time_factor, modulus_factor : float
        Factors of all times and of all moduli. [-]
    label : str
        The material in words.
    note : str
        How the material was found.
    warning : str
        Doubts about the measurements, for the warnings of a result.
    misfit : float
        Largest relative deviation from the rows of a table, zero if it is within their noise.
    stands_for : str
        Name of the bodies if the function is not one body with this Poisson ratio; otherwise empty.
    """

    function: Callable[..., Any]
    parameters: tuple[Any, ...] = ()
    poisson: float = 0.5
    longest: float = math.inf
    time_factor: float = 1.0
    modulus_factor: float = 1.0
    label: str = field(default="", compare=False)
    note: str = field(default="", compare=False)
    warning: str = field(default="", compare=False)
    misfit: float = field(default=0.0, compare=False)
    stands_for: str = field(default="", compare=False)

    def __repr__(self) -> str:
        return self.label

    def creep_compliance(self, t: ArrayLike) -> Array:
        """Return the shear creep compliance ``J(t)``, [1/Pa]; times beyond the longest one are refused. [s]"""
        t = np.asarray(t, dtype=float)
        end = self.longest * self.time_factor
        if t.size and not np.max(t) <= end * (1 + 1e-12):  # beyond rounding of a sum of steps
            raise InputError(
                f"creep is asked for at {np.max(t):g} s, and the table ends at {end:g} s: expected a table as long as "
                "the program; creep data are not extrapolated"
            )
        found = self.function(np.minimum(t, end) / self.time_factor, *self.parameters)
        return np.asarray(found, dtype=float) / self.modulus_factor

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Return the contact compliance ``C(t) = (1 - nu) J(t) / 2``. [1/Pa]"""
        return 0.5 * (1 - self.poisson) * self.creep_compliance(t)

    def contact_integral(self, t: ArrayLike) -> Array:
        """Return ``int_0^t C``, [s/Pa], by Gauss quadrature over the logarithm of time: 1e-13 for smooth creep."""
        nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
        width = _LIMIT / _PANELS
        y = (width * (np.arange(_PANELS)[:, None] + (nodes + 1) / 2)).ravel()
        weights = np.tile(weights * width / 2, _PANELS) * np.exp(-y)
        t = np.asarray(t, dtype=float)
        return np.asarray(t * (self.contact_compliance(t[..., None] * np.exp(-y)) @ weights))


def creep(function: Callable[[Array], Any], poisson: float = 0.5, *, longest: float = math.inf) -> Creep:
    """Material by its shear creep compliance.

    Parameters
    ----------
    function : callable
        ``J(t)``, [1/Pa], for an array of times from zero on [s]. It must not decrease.
    poisson : float
        Poisson ratio, constant in time.
    longest : float
        Longest time at which the function is known; longer programs are refused. [s]

    Returns
    -------
    Creep

    Raises
    ------
    InputError
        If the function cannot be called, or a number is out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> import roughvisc as rv
    >>> rubber = rv.creep(lambda t: 1e-6 * (1 + 0.2 * np.log1p(t / 1e-3)), poisson=0.5)
    >>> float(rubber.contact_compliance(0.0))  # (1 - nu)/2 J
    2.5e-07
    """
    if not callable(function):
        found = type(function).__name__
        raise InputError(key="function", found=found, expected="a function of time, the creep compliance [1/Pa]")
    check_poisson(poisson)
    if not longest > 0:
        check_number("longest", longest, "s")
    name = getattr(function, "__qualname__", type(function).__name__)
    ratio = "" if poisson == 0.5 else f", poisson={poisson:g}"
    return Creep(function, (), poisson, longest, label=f"creep({name}{ratio})")


@quantities(glassy="1/Pa", coefficient="1/Pa", time_scale="s")
def power_law(
    glassy: Quantity, coefficient: Quantity, exponent: float, time_scale: Quantity = 1.0, poisson: float = 0.5
) -> Creep:
    r"""Power-law creep, :math:`J(t) = J_0 + c \, (t/T)^\alpha`.

    Parameters
    ----------
    glassy : float or str
        Instantaneous compliance ``J_0``; zero for a material without instantaneous response. [1/Pa]
    coefficient : float or str
        Creep ``c`` at the time ``T``. [1/Pa]
    exponent : float
        ``alpha``, between 0 (elastic) and 1 (a dashpot), both excluded.
    time_scale : float or str
        ``T``. [s]
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    Creep

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> gel = power_law(glassy=0.0, coefficient=1e-4, exponent=0.5)
    >>> float(gel.contact_compliance(4.0))  # (1 - nu)/2 J
    5e-05
    """
    check_number("glassy", glassy, "1/Pa", zero=True)
    check_number("coefficient", coefficient, "1/Pa")
    check_number("time_scale", time_scale, "s")
    check_poisson(poisson)
    if not 0 < exponent < 1:
        raise InputError(key="exponent", found=exponent, expected="a number above 0 and below 1")
    parameters = (glassy, coefficient, exponent, time_scale)
    names, units = ("glassy", "coefficient", "exponent", "time_scale"), ("1/Pa", "1/Pa", "1", "s")
    words = dict(zip(names, zip(parameters, units, strict=True), strict=True))
    return Creep(power_creep, parameters, poisson, label=in_words("power_law", poisson, "", **words))


def power_creep(t: Array, glassy: float, coefficient: float, exponent: float, time_scale: float) -> Array:
    """Return the creep compliance of a power law. [1/Pa]"""
    return np.asarray(glassy + coefficient * (t / time_scale) ** exponent)


def series_creep(t: Array, series: Prony) -> Array:
    """Return the creep compliance of measured creep: of the series that was fitted to the rows. [1/Pa]"""
    return series.creep_compliance(t)


def pair_creep(t: Array, a: Prony | Creep, b: Prony | Creep) -> Array:
    """Return the creep compliance of an incompressible body with the contact compliance of two bodies. [1/Pa]"""
    return 4 * (a.contact_compliance(t) + b.contact_compliance(t))


def own_creep(t: Array, material: Material) -> Any:
    """Return the creep compliance of an object of the user's own, from its contact compliance. [1/Pa]"""
    return 2 / (1 - getattr(material, "poisson", 0.5)) * np.asarray(material.contact_compliance(t))


def complete(material: Any) -> Prony | Creep:
    """Return a material of roughvisc; an object of the user's own becomes a :class:`Creep`.

    Raises
    ------
    InputError
        If it has no contact compliance.
    """
    if isinstance(material, Prony | Creep):
        return material
    name = type(material).__name__
    if not callable(getattr(material, "contact_compliance", None)):
        raise InputError(
            f"material is a {name}: expected one of roughvisc's materials, creep(function), or an object with "
            "contact_compliance(t)"
        )
    poisson, note = float(getattr(material, "poisson", 0.5)), str(getattr(material, "note", ""))
    check_poisson(poisson)
    return Creep(own_creep, (material,), poisson, label=name, note=note)


def check_creep(material: Creep, times: Array) -> Array:
    """Return the creep compliance at some times, [1/Pa], if it is one: not negative and not decreasing.

    Parameters
    ----------
    material : Creep
    times : ndarray
        Positive and ascending. [s]

    Raises
    ------
    InputError
        If the number of values is wrong, or a value is negative, not finite, lower than an earlier one, or zero after
        time zero. The message names the time.
    """
    times = np.append(0.0, times)
    values = material.creep_compliance(times)
    if values.shape != times.shape:
        raise InputError(f"creep of {material!r} gives {values.shape} of {times.shape} times: expected a number each")
    for wrong, expected in (
        (~(np.isfinite(values) & (values >= 0)), "a number that is not negative"),
        (np.append(False, np.diff(values) < -_ROUNDING * values[1:]), "no less than before: creep compliances ascend"),
        ((values == 0) & (times > 0), "a positive compliance after time zero"),
    ):
        for at in np.flatnonzero(wrong)[:1]:
            raise InputError(f"creep of {material!r} is {values[at]:g} 1/Pa at {times[at]:g} s: expected {expected}")
    return values[1:]
