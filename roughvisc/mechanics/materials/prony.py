"""Creep compliance as a series of exponentials."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy  # which imports a submodule when it is first used: scipy.optimize takes 0.2 s
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_poisson
from roughvisc.units import Quantity, number, quantities

Array = NDArray[np.float64]


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
        object.__setattr__(self, "compliances", tuple(float(c) for c in self.compliances))
        object.__setattr__(self, "times", tuple(float(t) for t in self.times))
        if len(self.compliances) != len(self.times):
            expected = f"as many as times, {len(self.times)}"
            raise InputError(key="compliances", found=len(self.compliances), expected=expected)
        for i, (compliance, time) in enumerate(zip(self.compliances, self.times, strict=True)):
            number(compliance, "1/Pa", f"compliances[{i}]", least=0)
            number(time, "s", f"times[{i}]", above=0)
        check_poisson(self.poisson)
        if self.glassy + self.fluidity + sum(self.compliances) == 0:
            expected = "a positive compliance: a rigid material cannot be pressed"
            raise InputError(key="glassy", found=self.glassy, expected=expected)

    def creep_compliance(self, t: ArrayLike) -> Array:
        """Return the shear creep compliance ``J(t)``, [1/Pa]; times beyond the longest one are refused. [s]"""
        t = known_times(t, self.longest)
        retarded = np.add.reduce(self._terms[0] * -np.expm1(-t[..., None] / self._terms[1]), axis=-1)
        flowed = self.fluidity * t if self.fluidity else 0.0  # a solid has a limit at inf
        return np.asarray(self.glassy + flowed + retarded)

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Return the contact compliance ``C(t) = (1 - nu) J(t) / 2``. [1/Pa]"""
        return 0.5 * (1 - self.poisson) * self.creep_compliance(t)

    def contact_integral(self, t: ArrayLike) -> Array:
        """Return the integral ``int_0^t C``. [s/Pa]"""
        t = known_times(t, self.longest)
        compliances, times = self._terms
        crept = np.add.reduce(compliances * one_less_mean_decay(t[..., None] / times), axis=-1) * t
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

    @cached_property
    def _terms(self) -> tuple[Array, Array]:
        """Retarded compliances [1/Pa] and times [s]."""
        return np.array(self.compliances), np.array(self.times)

    def poles(self) -> tuple[Array, Array]:
        """Return strengths and poles of the transform ``J^(s) = J_0 + sum strengths / (poles + s)``. [1/s]"""
        weights, rates = merged(self.compliances, self.times)
        if self.fluidity:
            return np.append(self.fluidity, weights * rates), np.append(0.0, rates)
        return weights * rates, rates


def known_times(t: ArrayLike, longest: float) -> Array:
    """Return times up to the longest one, beyond which a material is not known. [s]"""
    t = np.asarray(t, dtype=float)
    if t.size and not np.max(t) <= longest * (1 + 1e-12):  # beyond rounding of a sum of steps
        raise InputError(
            f"creep is requested at {np.max(t):g} s, and the table ends at {longest:g} s: expected a table as long as "
            "the program; creep data are not extrapolated"
        )
    return np.minimum(t, longest)


# (-1)^(k+1) / (k+1)! for k >= 1: up to 0.3 the next term is below rounding
_POWERS = np.arange(1.0, 14)
_SERIES = np.cumprod(np.append(0.5, -1.0 / np.arange(3, 15)))


def one_less_mean_decay(x: ArrayLike) -> Array:
    """Return ``1 - (1 - exp(-x)) / x`` to full relative precision for any ``x >= 0``; ``x / 2`` for small ``x``."""
    x = np.asarray(x, dtype=float)
    small, large = np.minimum(x, 0.3), np.maximum(x, 0.3)
    return np.where(
        x < 0.3, np.add.reduce(_SERIES * small[..., None] ** _POWERS, axis=-1), 1 + np.expm1(-large) / large
    )


def merged(weights: Sequence[float], times: Sequence[float]) -> tuple[Array, Array]:
    """Return positive weights and rates ``1/time``, with ascending rates and equal rates merged."""
    sums: dict[float, float] = {}
    for weight, time in zip(weights, times, strict=True):
        if weight > 0:
            sums[1 / time] = sums.get(1 / time, 0.0) + weight
    rates = np.array(sorted(sums))
    return np.array([sums[rate] for rate in rates]), rates


def secular_roots(strengths: Array, poles: Array, constant: float) -> list[tuple[float, Array]]:
    """Return the zeros of ``constant + sum strengths / (poles - mu)``, each with its offsets ``poles - mu``.

    One zero lies between each two poles, and one above the last pole if ``constant > 0``.

    Each zero is computed as an offset from the nearer of its two poles, on a logarithmic scale, so that the offset of a
    zero close to a pole is accurate. The equivalent eigenproblem loses the slow modes over many decades of rates (24
    decades: a negative eigenvalue).
    """

    def value(offset: float, origin: float) -> tuple[float, Array]:
        offsets = (poles - origin) - offset
        return constant + float(np.sum(strengths / offsets)), offsets

    roots = []
    for i, pole in enumerate(poles):
        if i + 1 < len(poles):
            half = float(poles[i + 1] - pole) / 2
            from_below = value(half, pole)[0] > 0
            origin, sign = (float(pole), 1.0) if from_below else (float(poles[i + 1]), -1.0)
        elif constant > 0:
            origin, sign, half = float(pole), 1.0, float(np.sum(strengths)) / constant
        else:
            break
        offset = sign * _log_bracketed(lambda d, o=origin, s=sign: s * value(s * d, o)[0], half)  # type: ignore[misc]
        # the logarithm leaves an error of some 30 eps in the offset; a Newton step removes it
        found, offsets = value(offset, origin)
        step = found / float(np.sum(strengths / offsets**2))
        if abs(step) < 1e-9 * abs(offset):
            offset -= step
        roots.append((origin + offset, value(offset, origin)[1]))
    return roots


def _log_bracketed(function: Callable[[float], float], upper: float) -> float:
    """Return the zero of a function that rises from -inf at 0+ to at least 0 at ``upper``, found in log scale."""
    if function(upper) <= 0:
        return upper
    lower = upper
    while function(lower) > 0:
        lower *= 1e-3
        if lower < 1e-300:
            return lower
    # slightly wider, so that rounding of the logarithm cannot exclude a zero at an end of the bracket
    low, high = math.log(lower) - 1e-9, math.log(min(upper, lower * 1e3)) + 1e-9
    return math.exp(scipy.optimize.brentq(lambda y: function(math.exp(y)), low, high, xtol=1e-15))
