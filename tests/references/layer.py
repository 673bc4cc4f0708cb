r"""An elastic layer bonded to an elastic half-space: what its surface gives way by under a wave of pressure.

With ``x = |q| h``, ``mu = G1 / G2`` (layer over base), ``k = 3 - 4 nu`` of each, and

    l = (mu k2 - k1) / (mu k2 + 1),        m = (mu - 1) / (mu + k1)

the displacement over that of a half-space of the layer's material is

    S = [1 + 4 m x exp(-2x) - l m exp(-4x)] / [1 - (l + m + 4 m x^2) exp(-2x) + l m exp(-4x)].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_number as positive

# Below this, sinh(2x) - 2x and cosh(2x) - 1 - 2x^2 come from their series.
_SERIES_BELOW = 0.5
# exp(-2x) is zero from here.
_ENDLESS = 400.0


@dataclass(frozen=True)
class ElasticLayer:
    r"""A layer bonded to a half-space of another material, for the elastic closed forms.

    Parameters
    ----------
    thickness : float
        [m]
    poisson, base_poisson : float
        Poisson's ratio of the layer and of the half-space, from 0 to 1/2.
    modulus_ratio : float
        Shear modulus of the layer over that of the half-space.

    Raises
    ------
    InputError
        If a value is none of those expected.

    Notes
    -----
    Of viscoelastic materials the closed forms hold where both moduli relax alike, so that their ratio does not change.

    Examples
    --------
    A punch of a radius of one thickness, on a layer of a tenth of the modulus of its base; and on equal materials:

    >>> from references.sheet import PunchOnSheet
    >>> for ratio in (0.1, 1.0):
    ...     layer = ElasticLayer(1.0, poisson=0.5, base_poisson=0.5, modulus_ratio=ratio)
    ...     print(round(PunchOnSheet(1.0, layer).scaled_stiffness / 2, 4))
    2.8064
    1.0
    """

    thickness: float
    poisson: float
    base_poisson: float
    modulus_ratio: float

    def __post_init__(self) -> None:
        positive("thickness", self.thickness, "m")
        positive("modulus_ratio", self.modulus_ratio, "-")
        for name, value in (("poisson", self.poisson), ("base_poisson", self.base_poisson)):
            if not 0 <= value <= 0.5:
                raise InputError(f"{name} is {value!r}: expected 0 to 1/2")

    @property
    def long_wave_factor(self) -> float:
        """``S`` of the longest waves, which feel the base alone: the ratio of the contact moduli."""
        return self.modulus_ratio * (1 - self.base_poisson) / (1 - self.poisson)

    def factor(self, x: ArrayLike) -> NDArray[np.float64]:
        """``S`` of waves of so many wave numbers times the thickness."""
        return layer_factor(x, self.poisson, self.base_poisson, self.modulus_ratio)

    def complement(self, x: ArrayLike) -> NDArray[np.float64]:
        """``1 - S``, of which nothing is lost where it is small."""
        return layer_complement(x, self.poisson, self.base_poisson, self.modulus_ratio)


def layer_factor(x: ArrayLike, poisson: float, base_poisson: float, modulus_ratio: ArrayLike) -> NDArray[Any]:
    r"""The factor ``S`` of a wave on a layer: its displacement over that of a half-space of the layer's material.

    Parameters
    ----------
    x : array_like
        Wave number times thickness, not negative.
    poisson, base_poisson : float
        Poisson's ratio of the layer and of the half-space below it.
    modulus_ratio : array_like of float or complex
        Shear modulus of the layer over that of the half-space. Complex moduli are those of an oscillation or of a
        Laplace transform; broadcast with `x`.

    Returns
    -------
    ndarray
        One for short waves, the ratio of the contact moduli for long ones.

    Notes
    -----
    The equation of this module, by Burmister [1]_ for materials that keep their volume, by O'Sullivan and King [2]_ for
    any. Both sides of the fraction are taken times ``(mu k2 + 1) (mu + k1)`` and arranged so that nothing large
    cancels: neither on a rigid base nor under a stiff layer, whose bending gives way by ``x^-3``.

    References
    ----------
    .. [1] D. M. Burmister, J. Appl. Phys. 16 (1945) 89.
    .. [2] T. C. O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235.

    Examples
    --------
    >>> layer_factor([0.0, 1.0, 100.0], poisson=0.3, base_poisson=0.3, modulus_ratio=0.5).round(6)
    array([0.5     , 0.725772, 1.      ])
    """
    y, shorter, e, ratio, k, base_k = _terms(x, poisson, base_poisson, modulus_ratio)
    sine = np.where(y < _SERIES_BELOW, 2 * e * _series(y, 3), -np.expm1(-4 * y) - 4 * y * e)  # 2 e (sinh 2x - 2x)
    numerator = (
        ratio * (1 + k) * (1 + base_k)
        + (ratio * base_k - k) * (ratio - 1) * sine
        + 4 * y * e * (ratio - 1) * (2 * ratio * base_k + (1 - k))
    )
    return np.asarray(numerator / _denominator(y, shorter, e, ratio, k, base_k))


def layer_complement(x: ArrayLike, poisson: float, base_poisson: float, modulus_ratio: ArrayLike) -> NDArray[Any]:
    """``1 - S`` of :func:`layer_factor`, of which nothing is lost where it is small."""
    y, shorter, e, ratio, k, base_k = _terms(x, poisson, base_poisson, modulus_ratio)
    stiffer, other = ratio - 1, ratio * base_k - k
    less = (
        (1 + k) * (other + stiffer) + 4 * y * (1 + y) * stiffer * (ratio * base_k + 1) + 2 * other * stiffer * shorter
    )
    return np.asarray(-e * less / _denominator(y, shorter, e, ratio, k, base_k))


def _terms(x: ArrayLike, poisson: float, base_poisson: float, modulus_ratio: ArrayLike) -> tuple[Any, ...]:
    """``x``, ``1 - exp(-2x)``, ``exp(-2x)``, the ratio of the moduli, and ``k`` of both materials."""
    y = np.minimum(np.asarray(x, dtype=float), _ENDLESS)
    return y, -np.expm1(-2 * y), np.exp(-2 * y), np.asarray(modulus_ratio), 3 - 4 * poisson, 3 - 4 * base_poisson


def _denominator(x: Any, shorter: Any, e: Any, ratio: Any, k: float, base_k: float) -> Any:
    """Of the factor, times ``(mu k2 + 1) (mu + k1)``."""
    # (1 - exp(-2x))^2 - 4 x^2 exp(-2x), whose terms cancel where x is small
    cosine = np.where(x < _SERIES_BELOW, 2 * e * _series(x, 4), shorter**2 - 4 * x**2 * e)
    stiffer, other = ratio - 1, ratio * base_k - k
    return (1 + k) ** 2 + (1 + k) * (stiffer * (shorter - 4 * x**2 * e) + other * shorter) + other * stiffer * cosine


def _series(x: Any, first: int) -> Any:
    """``sinh(2x)`` or ``cosh(2x)`` from the power `first` on, for small ``x``."""
    small = np.minimum(x, _SERIES_BELOW)
    term = (2 * small) ** first / math.factorial(first)
    total = np.zeros_like(small)
    for n in range(first, first + 24, 2):
        total = total + term
        term = term * (2 * small) ** 2 / ((n + 1) * (n + 2))
    return total
