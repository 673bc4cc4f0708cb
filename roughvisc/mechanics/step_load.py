"""A load applied at once and kept, on a linear viscoelastic half-space: the contact only grows (Lee and Radok)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.indenters import Indenter, Paraboloid, punch_pressure
from roughvisc.mechanics.materials import Material, Prony
from roughvisc.mechanics.quadrature import bisect, integrate

Array = NDArray[np.float64]


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
        t = np.asarray(t, dtype=float)
        total = np.full(t.shape, self.equilibrium)
        for modulus, time in zip(self.moduli, self.times, strict=True):
            total = total + modulus * np.exp(-t / time)
        return total

    def rate(self, t: ArrayLike) -> Array:
        """``-dE/dt``, never negative. [Pa/s]"""
        t = np.asarray(t, dtype=float)
        total = np.zeros(t.shape)
        for modulus, time in zip(self.moduli, self.times, strict=True):
            total = total + modulus / time * np.exp(-t / time)
        return total


@dataclass(frozen=True)
class StepLoad:
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

    indenter: Indenter
    material: Material
    force: float

    def radius(self, t: ArrayLike) -> Array:
        """Contact radius at ``t >= 0``. [m]"""
        return self.indenter.radius_at_scaled_force(self.force * self.material.contact_compliance(t))

    def approach(self, t: ArrayLike) -> Array:
        """Approach at ``t >= 0``. [m]"""
        return self.indenter.reduced(self.radius(t))

    def pressure(self, r: ArrayLike, t: ArrayLike) -> Array:
        """Pressure at ``r`` [m] and ``t >= 0``, which are broadcast. [Pa]

        The material must be an exponential series with an instantaneous compliance.
        """
        if not isinstance(self.material, Prony):
            raise InputError("pressure under a step load is implemented for exponential series only")
        relaxation = ContactRelaxation.of(self.material)
        r, t = np.broadcast_arrays(np.abs(np.asarray(r, dtype=float)), np.asarray(t, dtype=float))
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
    r"""A sphere on a viscoelastic half-space under a load applied at once and kept (Lee and Radok).

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
    >>> from roughvisc.mechanics.materials import maxwell
    >>> press = lee_radok_step(1.0, maxwell(shear_modulus=0.1875, viscosity=0.1875), force=1.0)
    >>> float(press.radius(0.0)), float(press.radius(7.0))
    (1.0, 2.0)
    """
    if not (np.isfinite(force) and force > 0):
        raise InputError(f"force is {force!r}: expected a positive number [N]")
    return StepLoad(Paraboloid(sphere_radius), material, force)


@dataclass(frozen=True)
class KelvinVoigtStep(StepLoad):
    """A load applied at once and kept on a Kelvin-Voigt solid, which does not yield at once."""

    def pressure(self, r: ArrayLike, t: ArrayLike) -> Array:
        """Pressure at ``r`` [m] and ``t > 0``; infinite at the edge. [Pa]"""
        assert isinstance(self.material, Prony)
        decay = np.exp(-np.asarray(t, dtype=float) / self.material.times[0])
        modulus = 2 / ((1 - self.material.poisson) * self.material.compliances[0])
        radius = self.radius(t)
        viscous = punch_pressure(r, radius, self.force * decay)
        return viscous + modulus * self.indenter.scaled_pressure(r, radius)


def kelvin_voigt_step(sphere_radius: float, material: Prony, force: float) -> KelvinVoigtStep:
    r"""A sphere on a Kelvin-Voigt half-space under a load applied at once and kept.

    Parameters
    ----------
    sphere_radius : float
        Radius of curvature ``R``. [m]
    material : Prony
        One retarded compliance and nothing else; see :func:`roughvisc.mechanics.materials.kelvin_voigt`.
    force : float
        The load ``W``. [N]

    Returns
    -------
    KelvinVoigtStep
        ``radius(t)``, ``approach(t)``, ``pressure(r, t)``.

    Raises
    ------
    InputError
        If a parameter is not positive and finite, or the material is another one.

    Notes
    -----
    With ``C(t) = (1 - exp(-t/tau)) / E*`` the dashpot carries ``W exp(-t/tau)`` as a flat punch does:

    .. math:: a^3 = \tfrac{3}{4} R W C(t), \quad
              p = \frac{W e^{-t/\tau}}{2 \pi a \sqrt{a^2 - r^2}} + \frac{2 E^*}{\pi R} \sqrt{a^2 - r^2}
    """
    if not isinstance(material, Prony) or material.glassy or material.fluidity or len(material.compliances) != 1:
        raise InputError("material is not a Kelvin-Voigt solid: expected one retarded compliance and nothing else")
    if not (np.isfinite(force) and force > 0):
        raise InputError(f"force is {force!r}: expected a positive number [N]")
    return KelvinVoigtStep(Paraboloid(sphere_radius), material, force)
