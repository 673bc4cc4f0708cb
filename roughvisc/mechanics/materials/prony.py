"""Creep compliance as a series of exponentials."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.units import Quantity, number, quantities

Array = NDArray[np.float64]
#: Type of test that measured a modulus or a compliance.
Kind = Literal["shear", "tensile"]


def check_poisson(poisson: float) -> None:
    if not -1 < poisson <= 0.5:
        raise InputError(key="poisson", found=poisson, expected="a number above -1 and up to 0.5")


def tensile_to_shear(kind: Kind, poisson: float) -> float:
    """Return the shear compliance over the measured compliance: ``2 (1 + nu)`` in tension, one in shear."""
    check_poisson(poisson)
    return 2 * (1 + poisson) if one_of("kind", kind, get_args(Kind)) == "tensile" else 1.0


@quantities(glassy="1/Pa >= 0", fluidity="1/(Pa s) >= 0", compliances="1/Pa", times="s")
@dataclass(frozen=True)
class Prony:
    r"""Exponential (Prony) series of the shear creep compliance.

    .. math:: J(t) = J_0 + \varphi t + \sum_i J_i \left(1 - e^{-t/\tau_i}\right)

    Parameters
    ----------
    glassy : float or str
        Instantaneous compliance ``J_0``; zero for a material without instantaneous response. [1/Pa]
    fluidity : float or str
        Inverse of the steady shear viscosity, zero for a solid. [1/(Pa s)]
    compliances, times : sequence of float or str
        Retarded compliances ``J_i`` [1/Pa] and retardation times ``tau_i`` [s].
    poisson : float
        Poisson ratio, constant in time.
    note : str
        Origin of a fitted series: number of terms, misfit. Ignored in comparisons.
    stands_for : str
        Name of the bodies if the series is not one body with this Poisson ratio; otherwise empty.
    longest : float
        Time of the last row of a creep table, up to which the series is known. [s]
    warning : str
        Warning about the measurements, for the result.
    misfit : float
        Largest relative deviation from the rows of a creep table, zero if it is within their noise.

    Raises
    ------
    InputError
        If a value is negative or not finite, a retardation time is not positive, the Poisson ratio lies
        outside (-1, 0.5], or the material is rigid.
    """

    glassy: Quantity
    fluidity: Quantity = 0.0
    compliances: tuple[Quantity, ...] = ()
    times: tuple[Quantity, ...] = ()
    poisson: float = 0.5
    note: str = field(default="", compare=False, repr=False)
    stands_for: str = field(default="", compare=False, repr=False)
    longest: float = field(default=math.inf, repr=False)
    warning: str = field(default="", compare=False, repr=False)
    misfit: float = field(default=0.0, compare=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "compliances", tuple(map(float, self.compliances)))
        object.__setattr__(self, "times", tuple(map(float, self.times)))
        count = len(self.times)
        if len(self.compliances) != count:
            raise InputError(key="compliances", found=len(self.compliances), expected=f"as many as times, {count}")
        for i, (compliance, time) in enumerate(zip(self.compliances, self.times, strict=True)):
            number(compliance, "1/Pa", f"compliances[{i}]", least=0)
            number(time, "s", f"times[{i}]", above=0)
        check_poisson(self.poisson)
        if self.glassy + self.fluidity + sum(self.compliances) == 0:
            raise InputError(key="glassy", found=self.glassy, expected="a positive compliance, not a rigid material")

    def creep_compliance(self, t: ArrayLike) -> Array:
        """Return the shear creep compliance ``J(t)``, [1/Pa]; times beyond the longest one are refused. [s]"""
        t = known_times(t, self.longest)
        retarded = np.add.reduce(self.compliances * -np.expm1(-t[..., None] / np.array(self.times)), axis=-1)
        flowed = self.fluidity * t if self.fluidity else 0.0  # a solid has a limit at inf
        return np.asarray(self.glassy + flowed + retarded)

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Return the contact compliance ``C(t) = (1 - nu) J(t) / 2``. [1/Pa]"""
        return 0.5 * (1 - self.poisson) * self.creep_compliance(t)

    def contact_integral(self, t: ArrayLike) -> Array:
        """Return the integral ``int_0^t C``. [s/Pa]"""
        t = known_times(t, self.longest)
        crept = np.add.reduce(self.compliances * one_less_mean_decay(t[..., None] / np.array(self.times)), axis=-1) * t
        return np.asarray(0.5 * (1 - self.poisson) * (self.glassy * t + self.fluidity * t**2 / 2 + crept))

    def scaled(self, time_factor: float, modulus_factor: float, note: str = "") -> Prony:
        """Return the series with all times multiplied by one factor and all moduli by another."""
        return replace(
            self,
            glassy=self.glassy / modulus_factor,
            fluidity=self.fluidity / (time_factor * modulus_factor),
            compliances=tuple(one / modulus_factor for one in self.compliances),
            times=tuple(time_factor * one for one in self.times),
            longest=time_factor * self.longest,
            note="; ".join(filter(None, (self.note, note))),
        )


def known_times(t: ArrayLike, longest: float) -> Array:
    """Return times up to the longest one, beyond which a material is not known. [s]"""
    t = np.asarray(t, dtype=float)
    if t.size and not np.max(t) <= longest * (1 + 1e-12):  # beyond rounding of a sum of steps
        late = f"creep is requested at {np.max(t):g} s, and the table ends at {longest:g} s"
        raise InputError(f"{late}: expected a table as long as the program; creep data are not extrapolated")
    return np.minimum(t, longest)


# (-1)^(k+1) / (k+1)! for k >= 1: up to 0.3 the next term is below rounding
_POWERS = np.arange(1.0, 14)
_SERIES = np.cumprod(np.append(0.5, -1.0 / np.arange(3, 15)))


def one_less_mean_decay(x: ArrayLike) -> Array:
    """Return ``1 - (1 - exp(-x)) / x`` to full relative precision for any ``x >= 0``; ``x / 2`` for small ``x``."""
    x = np.asarray(x, dtype=float)
    small, large = np.minimum(x, 0.3), np.maximum(x, 0.3)
    series = np.add.reduce(_SERIES * small[..., None] ** _POWERS, axis=-1)
    return np.where(x < 0.3, series, 1 + np.expm1(-large) / large)
