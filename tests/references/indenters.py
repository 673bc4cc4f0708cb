"""Axisymmetric indenters: the paraboloid of Hertz and the cone of Sneddon, as the closed forms need them.

A rigid indenter of profile ``f(r)``, with ``f(0) = 0``, acts on a half-space like the one-dimensional profile

    g(x) = x int_0^x f'(r) / sqrt(x^2 - r^2) dr

on a row of independent springs. An elastic contact of radius ``a`` has then the approach ``g(a)``.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError

Array = NDArray[np.float64]


class Indenter(Hashable, Protocol):
    """Axisymmetric indenter for the closed forms."""

    def height(self, r: ArrayLike) -> Array:
        """Gap ``f(r)`` to the plane it touches. [m]"""
        ...

    def reduced(self, x: ArrayLike) -> Array:
        """One-dimensional profile ``g(x)``; the approach of an elastic contact of radius ``x``. [m]"""
        ...

    def radius_at_approach(self, approach: ArrayLike) -> Array:
        """Contact radius of an elastic contact: the inverse of ``g``. [m]"""
        ...

    def scaled_force(self, radius: ArrayLike) -> Array:
        """Force over contact modulus of an elastic contact of this radius. [m2]"""
        ...

    def radius_at_scaled_force(self, scaled_force: ArrayLike) -> Array:
        """Contact radius of an elastic contact: the inverse of :meth:`scaled_force`. [m]"""
        ...

    def scaled_pressure(self, r: ArrayLike, radius: ArrayLike) -> Array:
        """Pressure over contact modulus of an elastic contact; zero outside. [-]"""
        ...

    def displacement(self, r: ArrayLike, radius: ArrayLike) -> Array:
        """Surface displacement of an elastic contact, inside and outside. [m]"""
        ...


def places(r: ArrayLike, other: ArrayLike) -> tuple[Array, Array]:
    """Distances from the axis, not negative, and as many of another number. [m]"""
    at, numbers = np.broadcast_arrays(np.abs(np.asarray(r, dtype=float)), np.asarray(other, dtype=float))
    return at, numbers


def positive(name: str, value: float, unit: str) -> None:
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{name} is {value!r}: expected a positive number [{unit}]")


@dataclass(frozen=True)
class Paraboloid:
    """Paraboloid ``f = r^2 / (2 R)``, the small-slope form of a sphere.

    Parameters
    ----------
    radius : float
        Radius of curvature ``R``. [m]
    """

    radius: float

    def __post_init__(self) -> None:
        positive("radius", self.radius, "m")

    def height(self, r: ArrayLike) -> Array:
        """Gap ``r^2 / (2 R)``. [m]"""
        return np.asarray(np.asarray(r, dtype=float) ** 2 / (2 * self.radius))

    def reduced(self, x: ArrayLike) -> Array:
        """``g = x^2 / R``. [m]"""
        return np.asarray(np.asarray(x, dtype=float) ** 2 / self.radius)

    def radius_at_approach(self, approach: ArrayLike) -> Array:
        """``sqrt(R d)``. [m]"""
        return np.asarray(np.sqrt(self.radius * np.asarray(approach, dtype=float)))

    def scaled_force(self, radius: ArrayLike) -> Array:
        """``4 a^3 / (3 R)``. [m2]"""
        return np.asarray(4 * np.asarray(radius, dtype=float) ** 3 / (3 * self.radius))

    def radius_at_scaled_force(self, scaled_force: ArrayLike) -> Array:
        """``(3 R S / 4)^(1/3)``. [m]"""
        return np.asarray(np.cbrt(0.75 * self.radius * np.asarray(scaled_force, dtype=float)))

    def scaled_pressure(self, r: ArrayLike, radius: ArrayLike) -> Array:
        """``2 sqrt(a^2 - r^2) / (pi R)``. [-]"""
        r, a = places(r, radius)
        return np.asarray(2 / (np.pi * self.radius) * np.sqrt(np.maximum((a - r) * (a + r), 0.0)))

    def displacement(self, r: ArrayLike, radius: ArrayLike) -> Array:
        """``(2 a^2 - r^2) / (2 R)`` inside; ``((2 a^2 - r^2) asin(a/r) + a sqrt(r^2 - a^2)) / (pi R)`` outside. [m]"""
        r, a = places(r, radius)
        out = np.maximum(r, a)
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = np.where(out > 0, a / out, 1.0)
        outside = (2 * a**2 - out**2) * np.arcsin(ratio) + a * np.sqrt((out - a) * (out + a))
        return np.asarray(np.where(r <= a, (2 * a**2 - r**2) / 2, outside / np.pi) / self.radius)


@dataclass(frozen=True)
class Cone:
    """Cone ``f = m r``.

    Parameters
    ----------
    slope : float
        Slope ``m`` of its side; small. [-]
    """

    slope: float

    def __post_init__(self) -> None:
        positive("slope", self.slope, "-")

    def height(self, r: ArrayLike) -> Array:
        """Gap ``m r``. [m]"""
        return np.asarray(self.slope * np.abs(np.asarray(r, dtype=float)))

    def reduced(self, x: ArrayLike) -> Array:
        """``g = pi m x / 2``. [m]"""
        return np.asarray(np.pi / 2 * self.slope * np.abs(np.asarray(x, dtype=float)))

    def radius_at_approach(self, approach: ArrayLike) -> Array:
        """``2 d / (pi m)``. [m]"""
        return np.asarray(np.asarray(approach, dtype=float) * 2 / (np.pi * self.slope))

    def scaled_force(self, radius: ArrayLike) -> Array:
        """``pi m a^2 / 2``. [m2]"""
        return np.asarray(np.pi / 2 * self.slope * np.asarray(radius, dtype=float) ** 2)

    def radius_at_scaled_force(self, scaled_force: ArrayLike) -> Array:
        """``sqrt(2 S / (pi m))``. [m]"""
        return np.asarray(np.sqrt(np.asarray(scaled_force, dtype=float) * 2 / (np.pi * self.slope)))

    def scaled_pressure(self, r: ArrayLike, radius: ArrayLike) -> Array:
        """``(m / 2) arcosh(a / r)``; infinite at the apex. [-]"""
        r, radius = places(r, radius)
        with np.errstate(divide="ignore", invalid="ignore"):
            # arcosh(1 + e) without the rounding of 1 + e, which would be the whole value near the edge
            excess = np.where(r < radius, (radius - r) / r, 0.0)
            return np.asarray(self.slope / 2 * np.log1p(excess + np.sqrt(excess * (excess + 2))))

    def displacement(self, r: ArrayLike, radius: ArrayLike) -> Array:
        """``m (pi a / 2 - r)`` inside; ``m (a asin(a/r) - r + sqrt(r^2 - a^2))`` outside. [m]"""
        r, a = places(r, radius)
        out = np.maximum(r, a)
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = np.where(out > 0, a / out, 1.0)
        outside = a * np.arcsin(ratio) - out + np.sqrt((out - a) * (out + a))
        return np.asarray(self.slope * np.where(r <= a, np.pi / 2 * a - r, outside))
