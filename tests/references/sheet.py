r"""Axisymmetric contact with a sheet on a rigid base, or with a layer on a half-space, by a Fredholm equation.

With the Hankel transform of the pressure ``p_q = pi E* int_0^a phi(t) cos(q t) dt`` a contact of radius ``a`` obeys

    phi(x) + int_0^a M(x, t) phi(t) dt = (2/pi) (d - g(x)),     M = (2/pi) int_0^inf (S(q h) - 1) cos(q x) cos(q t) dq

with the approach ``d``, the factor ``S`` of the sheet or layer, and the one-dimensional profile ``g`` that the indenter
has on a half-space. The force is ``pi E* int_0^a phi``, with the modulus of the layer. The edge of a smooth indenter is
free of pressure: ``phi(a) = 0`` gives ``d``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import j0

from references.indenters import Indenter, places, positive
from references.layer import ElasticLayer
from roughvisc.errors import InputError
from roughvisc.mechanics.sheet import SHORTEST_WAVE, Sheet, complement, panels

Array = NDArray[np.float64]

# Gauss nodes in the contact: so many, and so many more for each thickness in its radius, as its edge is that sharp.
_NODES, _NODES_PER_THICKNESS = 40, 12
# Gauss nodes of a panel of waves, and the phase that it may span.
_IN_PANEL, _PHASE = 16, 10.0
# Where a contact on a stiff layer is checked: parts of a quarter circle, from its middle to its edge and on to far off.
_DISC = (np.arange(40) + 0.5) / 40


@dataclass(frozen=True)
class OnSheet:
    """An indenter on a sheet or a layer, for the solutions that follow from elastic contact alone.

    The growing contact of Lee and Radok holds on a sheet too. So does the single maximum of Ting, which takes minutes:
    it asks for thousands of radii, and each is a solution of the Fredholm equation. The reduction to independent
    elements does not hold: :func:`~roughvisc.mechanics.closed_forms.reduction.reduced_contact` refuses a sheet.

    Parameters
    ----------
    indenter : Indenter
        The rigid indenter: a :class:`~references.indenters.Paraboloid` or a ``Cone``.
    sheet : Sheet or ElasticLayer
        What it is pressed on.

    Raises
    ------
    InputError
        If a solution is asked for where the contact is not a disc: a stiff layer bends, and a cone leaves it.

    Notes
    -----
    The Fredholm equation of this module, by Gauss nodes: 1e-10 of the force for contacts of up to ten thicknesses.

    References
    ----------
    .. [1] W. C. Hayes, L. M. Keer, G. Herrmann, L. F. Mockros, J. Biomech. 5 (1972) 541.

    Examples
    --------
    >>> from references.indenters import Paraboloid
    >>> thick = OnSheet(Paraboloid(1.0), Sheet(1e3, base="slipping"))
    >>> round(float(thick.scaled_force(0.1)), 6)  # 4 a^3 / 3 R
    0.001333
    """

    indenter: Indenter
    sheet: Sheet | ElasticLayer

    def height(self, r: ArrayLike) -> Array:
        """Gap ``f(r)`` to the plane it touches. [m]"""
        return self.indenter.height(r)

    def reduced(self, x: ArrayLike) -> Array:
        """Approach of an elastic contact of radius `x`. [m]"""
        return self._of_each(x, lambda contact: contact.approach * self.sheet.thickness)

    def scaled_force(self, radius: ArrayLike) -> Array:
        """Force over contact modulus of an elastic contact of this radius. [m2]"""
        return self._of_each(radius, lambda contact: contact.force * self.sheet.thickness**2)

    def radius_at_approach(self, approach: ArrayLike) -> Array:
        """Contact radius of an elastic contact of this approach. [m]"""
        return self._inverse(self.reduced, self.indenter.radius_at_approach, approach)

    def radius_at_scaled_force(self, scaled_force: ArrayLike) -> Array:
        """Contact radius of an elastic contact under this force over contact modulus. [m]"""
        return self._inverse(self.scaled_force, self.indenter.radius_at_scaled_force, scaled_force)

    def scaled_pressure(self, r: ArrayLike, radius: ArrayLike) -> Array:
        """Pressure over contact modulus of an elastic contact; zero outside. [-]"""
        r, radius = places(r, radius)
        return self.indenter.scaled_pressure(r, radius) + self._within(r, radius, _Contact.added_pressure)

    def displacement(self, r: ArrayLike, radius: ArrayLike) -> Array:
        """Surface displacement of an elastic contact, inside and outside. [m]"""
        r, radius = places(r, radius)
        beyond = self._within(r, radius, _Contact.displacement) * self.sheet.thickness
        return np.asarray(np.where(r <= radius, self.reduced(radius) - self.height(r), beyond))

    def _of_each(self, radius: ArrayLike, value: Callable[[_Contact], float]) -> Array:
        radius = np.asarray(radius, dtype=float)
        different, back = np.unique(radius, return_inverse=True)
        return np.array([value(self._contact(one)) if one else 0.0 for one in different])[back].reshape(radius.shape)

    def _within(self, r: Array, radius: Array, value: Callable[[_Contact, Array], Array]) -> Array:
        found = np.zeros(r.shape)
        for one in np.unique(radius[radius > 0]):
            here = radius == one
            found[here] = value(self._contact(float(one)), r[here] / self.sheet.thickness)
        return found

    def _contact(self, radius: float) -> _Contact:
        sheet = self.sheet
        return _smooth(self.indenter, sheet, float(radius) / sheet.thickness)

    def _inverse(self, function: Callable[[Any], Array], nearby: Callable[[Any], Array], value: ArrayLike) -> Array:
        """Of a function that rises from zero; `nearby` is its inverse on a half-space."""
        value = np.asarray(value, dtype=float)
        different, back = np.unique(value, return_inverse=True)
        found = [_inverted(function, float(one), float(nearby(one))) for one in different]
        return np.array(found)[back].reshape(value.shape)


@dataclass(frozen=True)
class PunchOnSheet:
    """A flat round punch on a sheet or a layer.

    Parameters
    ----------
    radius : float
        Radius ``a`` of the punch. [m]
    sheet : Sheet or ElasticLayer
        What it is pressed on.

    Examples
    --------
    >>> punch = PunchOnSheet(1e-3, Sheet(1.0))
    >>> round(punch.scaled_stiffness, 6)  # 2 a on a half-space
    0.002002
    """

    radius: float
    sheet: Sheet | ElasticLayer

    def __post_init__(self) -> None:
        positive("radius", self.radius, "m")

    @property
    def scaled_stiffness(self) -> float:
        """Force over approach and contact modulus; ``2 a`` on a half-space. [m]"""
        return self._contact.force * self.sheet.thickness

    @property
    def _contact(self) -> _Contact:
        return _flat(self.sheet, self.radius / self.sheet.thickness)


@dataclass(frozen=True)
class _Contact:
    """A solved contact: lengths in thicknesses, pressures in the contact modulus.

    The potential is ``phi(x) = (2/pi) (approach - g(x)) + sum_s spectrum_s cos(s x)``.
    """

    radius: float
    approach: float
    profile: Callable[[Array], Array]
    force: float
    waves: Array
    spectrum: Array

    def potential_at(self, x: Array) -> Array:
        smooth = np.cos(np.outer(x, self.waves)) @ self.spectrum
        return np.asarray(2 / math.pi * (self.approach - self.profile(x)) + smooth)

    def added_pressure(self, r: Array) -> Array:
        """What the base adds to the pressure on a half-space, of the same contact radius and edge."""
        nodes, weights = np.polynomial.legendre.leggauss(_NODES + int(_NODES_PER_THICKNESS * self.radius))
        added = np.zeros(r.shape)
        for index in zip(*np.nonzero(r < self.radius), strict=True):
            width = math.sqrt((self.radius - r[index]) * (self.radius + r[index]))
            x = np.hypot(r[index], width * (nodes + 1) / 2)  # dx / sqrt(x^2 - r^2) is smooth in sqrt(x^2 - r^2)
            slope = np.sin(np.outer(x, self.waves)) @ (self.spectrum * self.waves)
            added[index] = width / 4 * float(weights @ (slope / x))
        return added

    def displacement(self, r: Array) -> Array:
        """Displacement outside."""
        nodes, weights = np.polynomial.legendre.leggauss(_NODES + int(_NODES_PER_THICKNESS * self.radius))
        angle = math.pi / 4 * (nodes + 1)  # x = a sin(angle): smooth also next to the edge, where phi is zero
        x = self.radius * np.sin(angle)
        density = math.pi / 4 * weights * self.radius * np.cos(angle) * self.potential_at(x)
        outside = np.maximum(r, self.radius).ravel()
        direct = (density / np.sqrt((outside[:, None] - x) * (outside[:, None] + x))).sum(axis=1)
        return np.asarray(direct - math.pi / 2 * j0(np.outer(outside, self.waves)) @ self.spectrum).reshape(r.shape)


def _inverted(function: Callable[[float], Array], value: float, near: float) -> float:
    """Where a function that rises from zero has a value."""
    if value == 0:
        return 0.0
    low = high = near
    while float(function(low)) > value:
        low /= 2
    while float(function(high)) < value:
        high *= 2
    if low == high:
        return low
    return float(brentq(lambda a: float(function(a)) - value, low, high, xtol=1e-14 * high, rtol=1e-14))


@lru_cache(maxsize=4096)
def _smooth(indenter: Indenter, sheet: Sheet | ElasticLayer, radius: float) -> _Contact:
    """A contact whose edge carries no pressure."""

    def profile(x: Array) -> Array:
        return indenter.reduced(x * sheet.thickness) / sheet.thickness

    contact = _solved(profile, radius, sheet)
    if _long_wave_factor(sheet) > 1:
        _check_disc(contact, indenter, sheet)
    return contact


def _long_wave_factor(sheet: Sheet | ElasticLayer) -> float:
    """Return ``S`` of the longest waves: they do not displace a surface above a rigid base."""
    return 0.0 if isinstance(sheet, Sheet) else sheet.long_wave_factor


def _complement(sheet: Sheet | ElasticLayer, x: Array) -> Array:
    """Return ``1 - S`` of waves, without cancellation."""
    return complement(x, sheet.poisson, sheet.base) if isinstance(sheet, Sheet) else sheet.complement(x)


def _check_disc(contact: _Contact, indenter: Indenter, layer: Sheet | ElasticLayer) -> None:
    """Refuse what a stiff layer does to a cone: it bends out of the contact, or meets the indenter again beyond it."""
    h, a = layer.thickness, contact.radius
    inside, outside = a * np.sin(math.pi / 2 * _DISC), a / np.cos(math.pi / 2 * _DISC)
    pressure = indenter.scaled_pressure(inside * h, a * h) + contact.added_pressure(inside)
    opening = contact.displacement(outside) - contact.approach + indenter.height(outside * h) / h
    if pressure.min() < 0 or opening.min() < -1e-6 * contact.approach:
        raise InputError(
            f"{indenter!r} on {layer!r} does not touch a disc of radius {a * h:.6g} m: the stiff layer bends, and the "
            "closed form holds for a disc only; expected a contact that is smaller, or a layer less stiff"
        )


@lru_cache(maxsize=64)
def _flat(sheet: Sheet | ElasticLayer, radius: float) -> _Contact:
    return _solved(lambda x: np.zeros_like(x), radius, sheet, approach=1.0)


def _solved(
    profile: Callable[[Array], Array], radius: float, sheet: Sheet | ElasticLayer, approach: float | None = None
) -> _Contact:
    """The Fredholm equation; without an approach the one for which the edge carries no pressure."""
    nodes, weights = panels(1, radius, _NODES + int(_NODES_PER_THICKNESS * radius))
    count = math.ceil(2 * SHORTEST_WAVE * max(radius, 2.0) / _PHASE)
    waves, wave_weights = panels(count, SHORTEST_WAVE, _IN_PANEL)
    if _long_wave_factor(sheet) > 1:  # a stiff layer gives way by x^-3 down to waves that feel the base alone
        waves, wave_weights = _graded(waves, wave_weights, math.ceil(math.log2(_long_wave_factor(sheet))))
    lost = 2 / math.pi * wave_weights * _complement(sheet, waves)
    cosines = np.cos(np.outer(nodes, waves))
    matrix = np.eye(nodes.size) - (cosines * lost) @ cosines.T * weights
    sides = 2 / math.pi * np.stack([np.ones_like(nodes), profile(nodes)], axis=1)
    of_approach, of_profile = np.linalg.solve(matrix, sides).T
    if approach is None:
        edge = np.cos(radius * waves)
        at_edge = [
            2 / math.pi * value + float(edge @ (lost * ((weights * phi) @ cosines)))
            for value, phi in ((1.0, of_approach), (float(profile(np.array([radius]))[0]), of_profile))
        ]
        approach = at_edge[1] / at_edge[0]
    density = weights * (approach * of_approach - of_profile)
    force = math.pi * float(density.sum())
    return _Contact(radius, approach, profile, force, waves, lost * (density @ cosines))


def _graded(waves: Array, weights: Array, halvings: int) -> tuple[Array, Array]:
    """The same nodes and weights, their first panel halved towards zero so many times."""
    at, weight, rest = waves[:_IN_PANEL], weights[:_IN_PANEL], slice(_IN_PANEL, None)
    side = float(weight.sum())
    ends = np.append(0.0, side * 0.5 ** np.arange(halvings, -1, -1))[:, None]
    finer = (ends[:-1] + np.diff(ends, axis=0) * at / side).ravel(), (np.diff(ends, axis=0) * weight / side).ravel()
    return np.append(finer[0], waves[rest]), np.append(finer[1], weights[rest])
