"""Contact that only grows, on a linear viscoelastic half-space: Lee and Radok's solution under various loads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from references.indenters import Indenter, Paraboloid, places, positive
from references.quadrature import bisect, integrate
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.creep import Creep, Material
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.program import Program

Array = NDArray[np.float64]


def with_decays(first: float, weights: Array, times: Array, t: ArrayLike) -> Array:
    """``first + sum weights exp(-t / times)``."""
    t = np.asarray(t, dtype=float)
    total = np.full(t.shape, first)
    for weight, time in zip(weights, times, strict=True):
        total = total + weight * np.exp(-t / time)
    return total


@dataclass(frozen=True)
class ContactRelaxation:
    """Relaxation of the contact modulus, ``E(t) = E_e + sum E_k exp(-t / theta_k)``, of an exponential series.

    Parameters
    ----------
    equilibrium : float
        ``E_e``. [Pa]
    moduli, times : ndarray
        ``E_k`` [Pa] and ``theta_k`` [s].
    """

    equilibrium: float
    moduli: Array
    times: Array

    @classmethod
    def of(cls, material: Prony) -> ContactRelaxation:
        """Of a material; ``E(t) = 2 G(t) / (1 - nu)``. An instantaneous compliance is required."""
        equilibrium, moduli, times = material.relaxation_spectrum()
        factor = 2 / (1 - material.poisson)
        return cls(factor * equilibrium, factor * moduli, times)

    def __call__(self, t: ArrayLike) -> Array:
        """``E(t)``. [Pa]"""
        return with_decays(self.equilibrium, self.moduli, self.times, t)

    def integral(self, t: ArrayLike) -> Array:
        """``int_0^t E``. [Pa s]"""
        t = np.asarray(t, dtype=float)
        total = self.equilibrium * t
        for modulus, time in zip(self.moduli, self.times, strict=True):
            total = total - modulus * time * np.expm1(-t / time)
        return np.asarray(total)

    def loss(self, frequency: float) -> float:
        """Loss modulus ``E''`` at an angular frequency. [Pa]"""
        x = frequency * self.times
        return float(np.sum(self.moduli * x / (1 + x**2)))

    def rate(self, t: ArrayLike) -> Array:
        """``-dE/dt``, never negative. [Pa/s]"""
        return with_decays(0.0, self.moduli / self.times, self.times, t)


@dataclass(frozen=True)
class Growing:
    """Contact that only grows: elastic at every instant, under the force of unit modulus ``int C dW``."""

    indenter: Indenter

    def scaled_force(self, t: ArrayLike) -> Array:
        """``int C dW``. [m2]"""
        raise NotImplementedError

    def radius(self, t: ArrayLike) -> Array:
        """Contact radius at ``t >= 0``. [m]"""
        return self.indenter.radius_at_scaled_force(self.scaled_force(t))

    def approach(self, t: ArrayLike) -> Array:
        """Approach at ``t >= 0``. [m]"""
        return self.indenter.reduced(self.radius(t))


@dataclass(frozen=True)
class StepLoad(Growing):
    """Contact under a load that is applied at time zero and kept.

    Parameters
    ----------
    indenter : Indenter
        The rigid indenter.
    material : Material
        The half-space.
    force : float
        The load. [N]
    """

    material: Material
    force: float

    def scaled_force(self, t: ArrayLike) -> Array:
        """``W C(t)``. [m2]"""
        return self.force * self.material.contact_compliance(t)

    def pressure(self, r: ArrayLike, t: ArrayLike) -> Array:
        """Pressure at ``r`` [m] and ``t >= 0``, which are broadcast. [Pa]

        The material must be an exponential series with an instantaneous compliance.
        """
        if not isinstance(self.material, Prony):
            raise InputError("pressure under a step load is implemented for exponential series only")
        relaxation = ContactRelaxation.of(self.material)
        r, t = places(r, t)
        entry = bisect(lambda s: self.radius(s) - r, np.zeros(r.shape), t)
        entry = np.where(r <= self.radius(0.0), 0.0, entry)

        # by parts, so that nothing cancels: E(0) s(t) + int E'(t - t') s(t') dt' would lose E(0)/E(t)
        def growth(since_entry: Array, until_now: Array, entry: Array, r: Array, now: Array) -> Array:
            final = self.indenter.scaled_pressure(r, self.radius(now))
            then = self.indenter.scaled_pressure(r, self.radius(entry + since_entry))
            with np.errstate(invalid="ignore"):
                return relaxation.rate(until_now) * (final - then)

        memory = integrate(growth, entry, t, entry, r, t)
        final = self.indenter.scaled_pressure(r, self.radius(t))
        return np.where(r < self.radius(t), relaxation(t - entry) * final + memory, 0.0)


def lee_radok_step(sphere_radius: float, material: Material, force: float) -> StepLoad:
    r"""A sphere on a viscoelastic half-space under a step load (Lee and Radok).

    Parameters
    ----------
    sphere_radius : float
        Radius of curvature ``R``. [m]
    material : Material
        The half-space; the pressure needs an exponential series with an instantaneous compliance.
    force : float
        The load ``W``. [N]

    Returns
    -------
    StepLoad
        ``radius(t)``, ``approach(t)``, ``pressure(r, t)``.

    Raises
    ------
    InputError
        If a parameter is not positive and finite.

    Notes
    -----
    .. math:: a(t)^3 = \tfrac{3}{4} R W C(t), \quad \delta = \frac{a^2}{R}, \quad
              p = \frac{2}{\pi R} \left[ E(0) s(t) + \int_0^t E'(t - t') s(t') dt' \right], \quad
              s = \operatorname{Re} \sqrt{a^2 - r^2}

    with ``E(t)`` the relaxation of the contact modulus.

    References
    ----------
    .. [1] E. H. Lee, J. R. M. Radok, "The contact problem for viscoelastic bodies", *J. Appl. Mech.* 27 (1960)
       438-444.

    Examples
    --------
    >>> from roughvisc.mechanics.materials.models import maxwell
    >>> press = lee_radok_step(1.0, maxwell(shear_modulus=0.1875, viscosity=0.1875), force=1.0)
    >>> float(press.radius(0.0)), float(press.radius(7.0))
    (1.0, 2.0)
    """
    positive("force", force, "N")
    return StepLoad(Paraboloid(sphere_radius), material, force)


def hereditary_integral(
    kernel: Callable[[Array], Array], antiderivative: Callable[[Array], Array], program: Program, t: ArrayLike
) -> Array:
    """``int_0^t kernel(t - s) dv(s)`` over the values ``v`` of a program of ramps, holds and jumps of one control.

    Parameters
    ----------
    kernel, antiderivative : callable
        A function of time and its integral from zero, such as ``contact_compliance`` and ``contact_integral``.
    program : Program
        All of load or all of approach; no cycles.
    t : array_like of float
        Times; at a jump, the state after it. [s]

    Returns
    -------
    ndarray
        The integral: exact, a sum over the corners.
    """
    controls = {segment.control for segment in program.segments}
    if len(controls) > 1 or program.slides or any(segment.amplitude for segment in program.segments):
        raise InputError("expected a program of ramps, holds and jumps of one control")
    t = np.asarray(t, dtype=float)
    total = np.zeros(t.shape)
    value = 0.0
    for segment, start in zip(program.segments, program.corners, strict=False):
        end = value if segment.end is None else segment.end
        since = np.maximum(t - start, 0.0)
        if segment.duration == 0:
            total = total + np.where(t >= start, (end - value) * kernel(since), 0.0)
        else:
            over = np.maximum(since - segment.duration, 0.0)
            total = total + (end - value) / segment.duration * (antiderivative(since) - antiderivative(over))
        value = end
    return total


@dataclass(frozen=True)
class GrowingContact(Growing):
    """Contact under a load that never falls; see :func:`lee_radok`.

    Parameters
    ----------
    indenter : Indenter
        The rigid indenter.
    material : Prony or Creep
        The half-space.
    program : Program
        The load.
    """

    material: Prony | Creep
    program: Program

    def scaled_force(self, t: ArrayLike) -> Array:
        """``int C dW``. [m2]"""
        return hereditary_integral(self.material.contact_compliance, self.material.contact_integral, self.program, t)


def lee_radok(indenter: Indenter, material: Prony | Creep, program: Program) -> GrowingContact:
    """An axisymmetric indenter under a load that never falls, on any material.

    Parameters
    ----------
    indenter : Indenter
        A sphere (:class:`Paraboloid`) or a :class:`Cone`.
    material : Prony or Creep
        Anything with ``contact_compliance(t)`` and ``contact_integral(t)``.
    program : Program
        Rising ramps, holds and jumps of load.

    Returns
    -------
    GrowingContact
        ``radius(t)`` and ``approach(t)``.

    Raises
    ------
    InputError
        If the load falls or the program prescribes something else.

    Notes
    -----
    The radius is that of an elastic contact of unit modulus under the force ``int C dW``.
    """
    value = 0.0
    for segment in program.segments:
        falls = segment.end is not None and segment.end < value
        if segment.control != "load" or segment.amplitude or segment.slide or falls:
            raise InputError("a growing contact needs a program of load that never falls, and does not slide")
        value = value if segment.end is None else segment.end
    return GrowingContact(indenter, material, program)
