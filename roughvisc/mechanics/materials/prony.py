"""Creep compliance as a series of exponentials."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_number, check_poisson
from roughvisc.mechanics.materials.secular import merged, secular_roots
from roughvisc.mechanics.materials.words import in_words
from roughvisc.units import Quantity, quantities

Array = NDArray[np.float64]


@quantities(glassy="1/Pa", fluidity="1/(Pa s)", compliances="1/Pa", times="s")
@dataclass(frozen=True, repr=False)
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
        How a fitted series was found: number of terms, misfit. Ignored in comparisons.
    stands_for : str
        Name of the bodies if the series is not one body with this Poisson ratio; otherwise empty.

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
    note: str = field(default="", compare=False)
    stands_for: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "compliances", tuple(float(c) for c in self.compliances))
        object.__setattr__(self, "times", tuple(float(t) for t in self.times))
        if len(self.compliances) != len(self.times):
            expected = f"as many as times, {len(self.times)}"
            raise InputError(key="compliances", found=len(self.compliances), expected=expected)
        check_number("glassy", self.glassy, "1/Pa", zero=True)
        check_number("fluidity", self.fluidity, "1/(Pa s)", zero=True)
        for i, (compliance, time) in enumerate(zip(self.compliances, self.times, strict=True)):
            check_number(f"compliances[{i}]", compliance, "1/Pa", zero=True)
            check_number(f"times[{i}]", time, "s")
        check_poisson(self.poisson)
        if self.glassy + self.fluidity + sum(self.compliances) == 0:
            expected = "a positive compliance: a rigid material cannot be pressed"
            raise InputError(key="glassy", found=self.glassy, expected=expected)

    def __repr__(self) -> str:
        """The constructor of springs and dashpots that makes the series, if there is one; otherwise the series."""
        parameters: dict[str, tuple[Any, str]]
        name, spring = "Prony", (1 / self.glassy if self.glassy else np.inf, "Pa")
        parameters = {"glassy": (self.glassy, "1/Pa")}
        if self.fluidity and self.glassy and not self.times:
            name, parameters = "maxwell", {"shear_modulus": spring, "viscosity": (1 / self.fluidity, "Pa s")}
        elif not self.fluidity and not self.times:
            name, parameters = "elastic", {"shear_modulus": spring}
        elif not self.fluidity and len(self.times) == 1 and self.compliances[0]:
            modulus, viscosity = (1 / self.compliances[0], "Pa"), (self.times[0] / self.compliances[0], "Pa s")
            name, parameters = "kelvin_voigt", {"shear_modulus": modulus, "viscosity": viscosity}
            if self.glassy:
                kelvin = {"kelvin_modulus": modulus, "kelvin_viscosity": viscosity}
                name, parameters = "zener", {"shear_modulus": spring, **kelvin}
        else:
            parameters |= {"fluidity": (self.fluidity, "1/(Pa s)")} if self.fluidity else {}
            parameters |= {"compliances": (self.compliances, "1/Pa"), "times": (self.times, "s")} if self.times else {}
        return in_words(name, self.poisson, self.note, **parameters)

    def creep_compliance(self, t: ArrayLike) -> Array:
        """Shear creep compliance ``J(t)``. [1/Pa]"""
        t = np.asarray(t, dtype=float)
        retarded = np.add.reduce(self._terms[0] * -np.expm1(-t[..., None] / self._terms[1]), axis=-1)
        flowed = self.fluidity * t if self.fluidity else 0.0  # a solid has a limit at inf
        return np.asarray(self.glassy + flowed + retarded)

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Contact compliance ``C(t) = (1 - nu) J(t) / 2``. [1/Pa]"""
        return 0.5 * (1 - self.poisson) * self.creep_compliance(t)

    def contact_integral(self, t: ArrayLike) -> Array:
        """First antiderivative ``int_0^t C``. [s/Pa]"""
        t = np.asarray(t, dtype=float)
        total = self.glassy * t + self.fluidity * t**2 / 2
        for compliance, time in zip(self.compliances, self.times, strict=True):
            total = total + compliance * time * one_less_mean_decay(t / time) * (t / time)
        return np.asarray(0.5 * (1 - self.poisson) * total)

    def mean_contact_compliance(self, s: ArrayLike, h: ArrayLike) -> Array:
        """Mean of ``C`` over ``[s, s + h]``, [1/Pa]; ``C(s)`` for ``h = 0``. [s]"""
        s, h = np.asarray(s, dtype=float), np.asarray(h, dtype=float)
        compliances, times = self._terms
        risen = one_less_mean_decay(h[..., None] / times)
        if s.any():  # 1 - exp(-s/tau) (1 - exp(-x))/x as a sum of positive terms
            age = s[..., None] / times
            risen = np.exp(-age) * risen - np.expm1(-age)
        retarded = np.add.reduce(compliances * risen, axis=-1)
        return np.asarray(0.5 * (1 - self.poisson) * (self.glassy + self.fluidity * (s + h / 2) + retarded))

    def scaled(self, time_factor: float, modulus_factor: float, note: str = "") -> Prony:
        """Return the series with all times and all moduli multiplied by a factor each."""
        return replace(
            self,
            glassy=self.glassy / modulus_factor,
            fluidity=self.fluidity / (time_factor * modulus_factor),
            compliances=tuple(one / modulus_factor for one in self.compliances),
            times=tuple(time_factor * one for one in self.times),
            note="; ".join(filter(None, (self.note, note))),
        )

    @cached_property
    def _terms(self) -> tuple[Array, Array]:
        """Retarded compliances [1/Pa] and times [s]."""
        return np.array(self.compliances), np.array(self.times)

    def relaxation_spectrum(self) -> tuple[float, Array, Array]:
        r"""Shear relaxation modulus as ``G(t) = G_e + sum G_k exp(-t / theta_k)``.

        Returns
        -------
        equilibrium : float
            ``G_e``, zero for a fluid. [Pa]
        moduli, times : ndarray
            ``G_k`` [Pa] and ``theta_k`` [s].

        Raises
        ------
        InputError
            If there is no instantaneous compliance: the relaxation modulus then holds an impulse.

        Notes
        -----
        The relaxation rates are the zeros of ``J_0 - phi/mu + sum J_i r_i / (r_i - mu)``, ``r_i = 1/tau_i``,
        one above each pole (the fluidity is a pole at zero).
        """
        if self.glassy == 0:
            raise InputError("a material without instantaneous compliance has no finite relaxation modulus")
        strengths, poles = self.poles()
        roots = secular_roots(strengths, poles, self.glassy)
        moduli = np.array([1 / (rate * float(np.sum(strengths / offset**2))) for rate, offset in roots])
        retarded = float(np.sum(merged(self.compliances, self.times)[0]))
        equilibrium = 0.0 if self.fluidity else 1 / (self.glassy + retarded)
        return equilibrium, moduli, np.array([1 / rate for rate, _ in roots])

    def poles(self) -> tuple[Array, Array]:
        """Strengths and poles of the transformed compliance, ``J^(s) = J_0 + sum strengths / (poles + s)``. [1/s]"""
        weights, rates = merged(self.compliances, self.times)
        if self.fluidity:
            return np.append(self.fluidity, weights * rates), np.append(0.0, rates)
        return weights * rates, rates


# (-1)^(k+1) / (k+1)! for k >= 1: up to 0.3 the next term is below rounding
_POWERS = np.arange(1.0, 14)
_SERIES = np.cumprod(np.append(0.5, -1.0 / np.arange(3, 15)))


def one_less_mean_decay(x: ArrayLike) -> Array:
    """``1 - (1 - exp(-x)) / x`` to full relative precision for any ``x >= 0``; ``x / 2`` for small ``x``."""
    return by_size(
        np.asarray(x, dtype=float),
        0.3,
        lambda x: np.add.reduce(_SERIES * x[..., None] ** _POWERS, axis=-1),
        lambda x: 1 + np.expm1(-x) / x,
    )


def by_size(x: Array, limit: float, small: Callable[[Array], Array], large: Callable[[Array], Array]) -> Array:
    """Evaluate one form of a function below a limit and another form above it, each only for its own arguments."""
    below = x < limit
    count = np.count_nonzero(below)
    if count == below.size:
        return np.asarray(small(x))
    if count == 0:
        return np.asarray(large(x))
    return np.where(below, small(np.minimum(x, limit)), large(np.maximum(x, limit)))
