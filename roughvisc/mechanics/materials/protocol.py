"""The protocol of a material, the defaults of its optional parts, and the check that it is a creep compliance."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_poisson

Array = NDArray[np.float64]
Function = Callable[[ArrayLike], Array]

REQUIRED = ("contact_compliance", "contact_integral")
OPTIONAL = ("poisson", "note", "mean_contact_compliance")
#: Intervals up to this part of their age are averaged by so many Gauss points: a difference of integrals loses digits.
_SHORT, _GAUSS = 0.1, np.polynomial.legendre.leggauss(8)
#: What numerical quadrature and rounding may leave, relative to the compliance and to the integral.
_DESCENT, _MISFIT = 1e-9, 1e-6


class Material(Protocol):
    """What is asked of a material: any object with two functions is one, and need not inherit from anything.

    Required are :meth:`contact_compliance` and :meth:`contact_integral`, for arrays of any shape. The rest is optional:
    a ``poisson`` ratio (a half if there is none), a ``note`` that results quote (none), and
    :meth:`mean_contact_compliance` (found from the other two).

    Notes
    -----
    A creep compliance is not negative and ascends. That of a passive material is a positive sum of exponentials, of
    however many; then there is a series as near to it as the tolerance asks. The compliance is sampled over the
    times that the program asks for, at a hundred instants a decade, and that series is pressed; how near it is was
    measured, and is part of what a result states. Of others the nearest series is pressed, which the result says.
    Equal materials should be equal, which frozen dataclasses are.
    """

    @property
    def poisson(self) -> float:
        """Poisson ratio; only a shear compliance is counted back by it, as a result depends on ``C`` alone."""
        return 0.5

    @property
    def note(self) -> str:
        """What a result should say of how the material was found; often empty."""
        return ""

    @abstractmethod
    def contact_compliance(self, t: ArrayLike) -> Array:
        """Contact compliance ``C(t)``, [1/Pa], at times after the load was applied, from zero on. [s]

        ``C(0)`` is what is there at once, and may be zero.
        """

    @abstractmethod
    def contact_integral(self, t: ArrayLike) -> Array:
        """First antiderivative ``int_0^t C``. [s/Pa]"""

    def mean_contact_compliance(self, s: ArrayLike, h: ArrayLike) -> Array:
        """Mean of ``C`` over ``[s, s + h]``, [1/Pa], to full precision for any ``s`` and ``h``. [s]"""
        return mean_of(self.contact_compliance, self.contact_integral, s, h)


def complete(material: Any) -> Material:
    """The material, with what it leaves out filled in: see :class:`~roughvisc.mechanics.materials.models.Material`.

    Raises
    ------
    InputError
        If it has no contact compliance, or no integral of it.
    """
    for name in REQUIRED:
        if not callable(getattr(material, name, None)):
            raise InputError(
                f"material is a {type(material).__name__}: expected one of roughvisc's materials, or an object with "
                f"contact_compliance(t) and contact_integral(t); it has no {name}"
            )
    has_all = all(hasattr(material, name) for name in OPTIONAL)
    return material if has_all else Completed(material)


@dataclass(frozen=True)
class Completed:
    """An object with the two functions that are required of a material.

    Parameters
    ----------
    given : object
        What it has of the others counts.
    """

    given: Any

    @property
    def poisson(self) -> float:
        """Poisson ratio; a half if not given."""
        return float(getattr(self.given, "poisson", 0.5))

    @property
    def note(self) -> str:
        """What a result says of the material; empty if not given."""
        return str(getattr(self.given, "note", ""))

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Contact compliance. [1/Pa]"""
        return np.asarray(self.given.contact_compliance(np.asarray(t, dtype=float)), dtype=float)

    def contact_integral(self, t: ArrayLike) -> Array:
        """First antiderivative. [s/Pa]"""
        return np.asarray(self.given.contact_integral(np.asarray(t, dtype=float)), dtype=float)

    def mean_contact_compliance(self, s: ArrayLike, h: ArrayLike) -> Array:
        """Mean over ``[s, s + h]``. [1/Pa]"""
        if hasattr(self.given, "mean_contact_compliance"):
            return np.asarray(self.given.mean_contact_compliance(s, h), dtype=float)
        return mean_of(self.contact_compliance, self.contact_integral, s, h)


def mean_of(compliance: Function, integral: Function, s: ArrayLike, h: ArrayLike) -> Array:
    """Mean of a compliance over ``[s, s + h]``, its value for ``h = 0``, from it and its antiderivative. [1/Pa]

    Notes
    -----
    By a difference of the antiderivative where that loses no more than a digit, elsewhere by Gauss quadrature: 1e-15
    where the compliance is smooth in the logarithm of time.
    """
    s, h = np.broadcast_arrays(np.asarray(s, dtype=float), np.asarray(h, dtype=float))
    mean = np.empty(s.shape)
    short = h <= _SHORT * s
    nodes, weights = _GAUSS
    mean[short] = compliance(s[short][:, None] + h[short][:, None] * (nodes + 1) / 2) @ weights / 2
    start, length = s[~short], h[~short]
    mean[~short] = (integral(start + length) - integral(start)) / length
    return mean


def check_creep(material: Material, times: Array) -> None:
    """Refuse what is no creep compliance: negative, descending, or with an integral that is not its own.

    Parameters
    ----------
    material : Material
    times : ndarray
        Where it is sampled, positive and ascending. [s]

    Raises
    ------
    InputError
        Naming the time, what was found and what is expected.
    """
    check_poisson(material.poisson)
    name, times = type(getattr(material, "given", material)).__name__, np.append(0.0, times)
    found = []
    for function in REQUIRED:
        values = np.asarray(getattr(material, function)(times))
        if values.shape != times.shape:
            raise InputError(f"{name}.{function} gives {values.shape} of {times.shape} times: expected a number each")
        _refuse(~(np.isfinite(values) & (values >= 0)), times, values, f"{name}.{function}", "no negative number")
        found.append(values)
    compliance, integral = found
    _refuse(
        np.append(False, np.diff(compliance) < -_DESCENT * compliance[1:]),
        times,
        compliance,
        f"{name}.contact_compliance",
        "no less than before: creep compliances ascend",
    )
    _refuse((compliance == 0) & (times > 0), times, compliance, f"{name}.contact_compliance", "creep from the first on")
    # of a compliance that ascends a piece of the integral lies between those by its two ends
    steps, piece, allowed = np.diff(times), np.diff(integral), _MISFIT * compliance[1:] * times[1:]
    amiss = (piece < compliance[:-1] * steps - allowed) | (piece > compliance[1:] * steps + allowed)
    _refuse(
        np.append(integral[0] != 0, amiss),
        times,
        integral,
        f"{name}.contact_integral",
        "the antiderivative of contact_compliance that is zero at zero",
    )


def _refuse(amiss: NDArray[np.bool_], times: Array, values: Array, what: str, expected: str) -> None:
    if amiss.any():
        at = int(np.argmax(amiss))
        raise InputError(f"{what} is {values[at]:g} at {times[at]:g} s: expected {expected}")
