"""Linear viscoelastic materials: creep compliances ``J(t)`` and what the contact needs of them.

The half-space enters the contact through one function, the contact compliance
``C(t) = 1/E*(t) = (1 - nu) J(t) / 2`` with the shear creep compliance ``J``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from roughvisc.errors import InputError

Array = NDArray[np.float64]


class Material(Protocol):
    """What the solver asks of a material."""

    @property
    def poisson(self) -> float:
        """Poisson ratio."""
        ...

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Contact compliance ``C(t)``, [1/Pa], at times after the load was applied. [s]"""
        ...

    def contact_integral(self, t: ArrayLike) -> Array:
        """First antiderivative ``int_0^t C``. [s/Pa]"""
        ...


def _check_poisson(poisson: float) -> None:
    if not -1 < poisson <= 0.5:
        raise InputError(f"poisson is {poisson!r}: expected a number above -1 and up to 0.5")


def _check_number(name: str, value: float, unit: str, *, zero: bool = False) -> None:
    good = isinstance(value, int | float | np.number) and math.isfinite(value) and (value > 0 or (zero and value == 0))
    if not good:
        raise InputError(f"{name} is {value!r}: expected a {'non-negative' if zero else 'positive'} number [{unit}]")


@dataclass(frozen=True)
class Prony:
    r"""Exponential (Prony) series of the shear creep compliance.

    .. math:: J(t) = J_0 + \varphi t + \sum_i J_i \left(1 - e^{-t/\tau_i}\right)

    Parameters
    ----------
    glassy : float
        Instantaneous compliance ``J_0``; zero for a material that cannot jump. [1/Pa]
    fluidity : float
        Inverse of the steady shear viscosity, zero for a solid. [1/(Pa s)]
    compliances, times : sequence of float
        Retarded compliances ``J_i`` [1/Pa] and retardation times ``tau_i`` [s].
    poisson : float
        Poisson ratio, constant in time.

    Raises
    ------
    InputError
        If a value is negative or not finite, a retardation time is not positive, the Poisson ratio lies
        outside (-1, 0.5], or the material is rigid.
    """

    glassy: float
    fluidity: float = 0.0
    compliances: tuple[float, ...] = ()
    times: tuple[float, ...] = ()
    poisson: float = 0.5

    def __post_init__(self) -> None:
        object.__setattr__(self, "compliances", tuple(float(c) for c in self.compliances))
        object.__setattr__(self, "times", tuple(float(t) for t in self.times))
        if len(self.compliances) != len(self.times):
            raise InputError(f"{len(self.compliances)} compliances for {len(self.times)} times: expected as many")
        _check_number("glassy", self.glassy, "1/Pa", zero=True)
        _check_number("fluidity", self.fluidity, "1/(Pa s)", zero=True)
        for i, (compliance, time) in enumerate(zip(self.compliances, self.times, strict=True)):
            _check_number(f"compliances[{i}]", compliance, "1/Pa", zero=True)
            _check_number(f"times[{i}]", time, "s")
        _check_poisson(self.poisson)
        if self.glassy + self.fluidity + sum(self.compliances) == 0:
            raise InputError("all compliances are zero: a rigid material cannot be pressed")

    def creep_compliance(self, t: ArrayLike) -> Array:
        """Shear creep compliance ``J(t)``. [1/Pa]"""
        t = np.asarray(t, dtype=float)
        total = self.glassy + self.fluidity * t
        for compliance, time in zip(self.compliances, self.times, strict=True):
            total = total - compliance * np.expm1(-t / time)
        return np.asarray(total)

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
        weights, rates = _merged(self.compliances, self.times)
        poles = np.append(0.0, rates) if self.fluidity else rates
        strengths = np.append(self.fluidity, weights * rates) if self.fluidity else weights * rates
        roots = _secular_roots(strengths, poles, self.glassy)
        moduli = np.array([1 / (rate * float(np.sum(strengths / offset**2))) for rate, offset in roots])
        equilibrium = 0.0 if self.fluidity else 1 / (self.glassy + float(np.sum(weights)))
        return equilibrium, moduli, np.array([1 / rate for rate, _ in roots])


def one_less_mean_decay(x: ArrayLike) -> Array:
    """``1 - (1 - exp(-x)) / x`` to full relative precision for any ``x >= 0``; ``x / 2`` for small ``x``."""
    x = np.asarray(x, dtype=float)
    small = np.minimum(x, 0.3)
    series = np.zeros_like(small)
    for k in range(18, 0, -1):  # sum_{k>=1} (-1)^(k+1) x^k / (k+1)!
        series = small / (k + 1) * (1 - series)
    large = np.maximum(x, 0.3)
    with np.errstate(over="ignore"):
        return np.where(x < 0.3, series, 1 + np.expm1(-large) / large)


def _merged(weights: Sequence[float], times: Sequence[float]) -> tuple[Array, Array]:
    """Positive weights and their rates ``1/time``, rates ascending, equal rates merged."""
    sums: dict[float, float] = {}
    for weight, time in zip(weights, times, strict=True):
        if weight > 0:
            sums[1 / time] = sums.get(1 / time, 0.0) + weight
    rates = np.array(sorted(sums))
    return np.array([sums[rate] for rate in rates]), rates


def _secular_roots(strengths: Array, poles: Array, constant: float) -> list[tuple[float, Array]]:
    """Zeros of ``constant + sum strengths / (poles - mu)`` with the offsets ``poles - mu`` at each.

    One zero lies between each two poles, and one above the last pole if ``constant > 0``.

    Each is sought as an offset from the nearer of its two poles, on a logarithmic scale, so that a zero that
    hugs a pole keeps its relative distance: over many decades of rates the equivalent eigenproblem loses the
    slow modes (24 decades: a negative eigenvalue).
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
        offset = _log_bracketed(lambda d, o=origin, s=sign: s * value(s * d, o)[0], half)  # type: ignore[misc]
        roots.append((origin + sign * offset, value(sign * offset, origin)[1]))
    return roots


def _log_bracketed(function: Callable[[float], float], upper: float) -> float:
    """Zero of a function that rises from -inf at 0+ to a value >= 0 at ``upper``, sought in the logarithm."""
    if function(upper) <= 0:
        return upper
    lower = upper
    while function(lower) > 0:
        lower *= 1e-3
        if lower < 1e-300:
            return lower
    return math.exp(
        brentq(lambda y: function(math.exp(y)), math.log(lower), math.log(min(upper, lower * 1e3)), xtol=1e-15)
    )


def elastic(shear_modulus: float, poisson: float = 0.5) -> Prony:
    """Elastic half-space: a shear modulus [Pa] and no memory."""
    _check_number("shear_modulus", shear_modulus, "Pa")
    return Prony(1 / shear_modulus, poisson=poisson)


def maxwell(shear_modulus: float, viscosity: float, poisson: float = 0.5) -> Prony:
    """Maxwell fluid: a spring [Pa] in series with a dashpot [Pa s]; ``J = 1/G + t/eta``."""
    _check_number("shear_modulus", shear_modulus, "Pa")
    _check_number("viscosity", viscosity, "Pa s")
    return Prony(1 / shear_modulus, fluidity=1 / viscosity, poisson=poisson)


def kelvin_voigt(shear_modulus: float, viscosity: float, poisson: float = 0.5) -> Prony:
    """Kelvin-Voigt solid: a spring [Pa] beside a dashpot [Pa s]; no instantaneous compliance."""
    _check_number("shear_modulus", shear_modulus, "Pa")
    _check_number("viscosity", viscosity, "Pa s")
    return Prony(0.0, compliances=(1 / shear_modulus,), times=(viscosity / shear_modulus,), poisson=poisson)


def zener(shear_modulus: float, kelvin_modulus: float, kelvin_viscosity: float, poisson: float = 0.5) -> Prony:
    """Zener solid: a spring ``G`` [Pa] in series with a Kelvin element ``G_K`` [Pa], ``eta_K`` [Pa s]."""
    _check_number("shear_modulus", shear_modulus, "Pa")
    _check_number("kelvin_modulus", kelvin_modulus, "Pa")
    _check_number("kelvin_viscosity", kelvin_viscosity, "Pa s")
    return Prony(1 / shear_modulus, 0.0, (1 / kelvin_modulus,), (kelvin_viscosity / kelvin_modulus,), poisson)


def from_relaxation(equilibrium: float, moduli: Sequence[float], times: Sequence[float], poisson: float = 0.5) -> Prony:
    r"""Generalised Maxwell solid, ``G(t) = G_e + sum G_i exp(-t / theta_i)``, as finite-element codes state it.

    Parameters
    ----------
    equilibrium : float
        ``G_e``; exactly zero makes a fluid. [Pa]
    moduli, times : sequence of float
        ``G_i`` [Pa] and relaxation times ``theta_i`` [s].
    poisson : float
        Poisson ratio.

    Returns
    -------
    Prony
        The same material by its creep compliance.

    Notes
    -----
    The retardation rates are the zeros of ``G_e - sum G_i lambda / (r_i - lambda)``, found between
    consecutive rates ``r_i = 1/theta_i``.
    """
    _check_number("equilibrium", equilibrium, "Pa", zero=True)
    if len(moduli) != len(times):
        raise InputError(f"{len(moduli)} moduli for {len(times)} times: expected as many")
    for i, (modulus, time) in enumerate(zip(moduli, times, strict=True)):
        _check_number(f"moduli[{i}]", modulus, "Pa", zero=True)
        _check_number(f"times[{i}]", time, "s")
    weights, rates = _merged(moduli, times)
    glassy_modulus = equilibrium + float(np.sum(weights))
    if glassy_modulus == 0:
        raise InputError("all moduli are zero: expected a positive equilibrium modulus or one in `moduli`")
    # dividing G~(s) = G_e + sum G_i s/(s + r_i) by s makes the equilibrium modulus a pole at zero like the others:
    # G~(-m)/(-m) = -G_e/m + sum G_i/(r_i - m), one zero between each two poles and none above the last
    poles = np.append(0.0, rates) if equilibrium else rates
    strengths = np.append(equilibrium, weights) if equilibrium else weights
    compliances, retardations = [], []
    for rate, offset in _secular_roots(strengths, poles, 0.0):
        # 1/G~ has the residue J_k rate there, and d(G~)/ds is rate * sum strengths / offset^2
        compliances.append(1 / (rate * rate * float(np.sum(strengths / offset**2))))
        retardations.append(1 / rate)
    fluidity = 0.0 if equilibrium else 1 / float(np.sum(weights / rates))
    return Prony(1 / glassy_modulus, fluidity, tuple(compliances), tuple(retardations), poisson)
