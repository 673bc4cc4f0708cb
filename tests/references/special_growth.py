"""Growing contact in two special cases: a step load on a Kelvin-Voigt solid, and a ramp on a power-law material."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from references.growing_contact import Growing, StepLoad
from references.indenters import Paraboloid, places, positive, punch_pressure
from references.quadrature import integrate
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.units import Quantity, quantities

Array = NDArray[np.float64]


@dataclass(frozen=True)
class KelvinVoigtStep(StepLoad):
    """Step load on a Kelvin-Voigt solid, which has no instantaneous deformation."""

    def pressure(self, r: ArrayLike, t: ArrayLike) -> Array:
        """Pressure at ``r`` [m] and ``t > 0``; infinite at the edge. [Pa]"""
        assert isinstance(self.material, Prony)
        decay = np.exp(-np.asarray(t, dtype=float) / self.material.times[0])
        modulus = 2 / ((1 - self.material.poisson) * self.material.compliances[0])
        radius = self.radius(t)
        viscous = punch_pressure(r, radius, self.force * decay)
        return viscous + modulus * self.indenter.scaled_pressure(r, radius)


@quantities(sphere_radius="m", force="N")
def kelvin_voigt_step(sphere_radius: Quantity, material: Prony, force: Quantity) -> KelvinVoigtStep:
    r"""A sphere on a Kelvin-Voigt half-space under a step load.

    Parameters
    ----------
    sphere_radius : float or str
        Radius of curvature ``R``. [m]
    material : Prony
        One retarded compliance and nothing else; see :func:`roughvisc.mechanics.materials.models.kelvin_voigt`.
    force : float or str
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
    positive("force", force, "N")
    return KelvinVoigtStep(Paraboloid(sphere_radius), material, force)


@dataclass(frozen=True)
class PowerLawRamp(Growing):
    """A sphere pressed at a constant loading rate on a power-law material; see :func:`power_law_ramp`."""

    indenter: Paraboloid
    loading_rate: float
    coefficient: float
    exponent: float

    def scaled_force(self, t: ArrayLike) -> Array:
        """``int C dW``. [m2]"""
        t = np.asarray(t, dtype=float)
        return self.loading_rate * self.coefficient * t ** (1 + self.exponent) / (1 + self.exponent)

    def pressure(self, r: ArrayLike, t: ArrayLike) -> Array:
        """Pressure at ``r`` [m] and ``t > 0`` [s], which are broadcast. [Pa]"""
        r, t = places(r, t)
        power = (1 + self.exponent) / 3  # a ~ t^power
        radius = self.radius(t)
        share = np.minimum(r / radius, 1.0) ** (1 / power)  # of the time, when the edge passes r
        late = 1 - self.exponent

        def rate(since: Array, share: Array) -> Array:
            """``d sqrt(a^2 - r^2) / d(time)`` at a time ``share + since``, in units of now."""
            start = np.where(share > 0, share, 1.0)
            with np.errstate(over="ignore"):
                ratio = start ** (2 * power) * np.expm1(2 * power * np.log1p(since / start))
            squared = np.where(share > 0, ratio, since ** (2 * power))
            return power * (share + since) ** (2 * power - 1) / np.sqrt(squared)

        # both halves in a power of the distance to their end that leaves nothing singular there
        half = (1 - share) / 2

        def first(z: Array, _: Array, share: Array) -> Array:
            return rate(z**6, share) * (1 - share - z**6) ** (-self.exponent) * 6 * z**5

        def second(q: Array, _: Array, share: Array) -> Array:
            return rate(1 - share - q ** (1 / late), share) / late

        total = integrate(first, 0.0, half ** (1 / 6), share) + integrate(second, 0.0, half**late, share)
        modulus = np.sinc(self.exponent) / self.coefficient * t ** (-self.exponent)
        return np.where(r < radius, 2 / (np.pi * self.indenter.radius) * modulus * radius * total, 0.0)


@quantities(sphere_radius="m", loading_rate="N/s")
def power_law_ramp(
    sphere_radius: Quantity, loading_rate: Quantity, coefficient: float, exponent: float
) -> PowerLawRamp:
    r"""A sphere pressed at a constant loading rate on a material of contact compliance ``C = c t^alpha``.

    Parameters
    ----------
    sphere_radius : float or str
        Radius of curvature ``R``. [m]
    loading_rate : float or str
        ``dW/dt``. [N/s]
    coefficient, exponent : float
        ``c`` [1/(Pa s^alpha)] and ``0 < alpha < 1`` of the contact compliance.

    Returns
    -------
    PowerLawRamp
        ``radius(t)``, ``approach(t)``, ``pressure(r, t)``.

    Raises
    ------
    InputError
        If a parameter is not positive, or the exponent not below one.

    Notes
    -----
    .. math:: a^3 = \frac{3 R \dot W c}{4 (1 + \alpha)} t^{1 + \alpha}, \qquad
              p = \frac{2}{\pi R} \int_{t_r}^t E(t - s) \frac{d}{ds} \sqrt{a(s)^2 - r^2} \, ds, \qquad
              E(t) = \frac{\sin \pi\alpha}{\pi \alpha c} t^{-\alpha}
    """
    if not (loading_rate > 0 and coefficient > 0 and 0 < exponent < 1):
        raise InputError("loading_rate and coefficient must be positive and exponent between 0 and 1")
    return PowerLawRamp(Paraboloid(sphere_radius), loading_rate, coefficient, exponent)
