"""Contact on an area that does not change: a flat punch, also one that sticks, and full contact of a wave."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from references.growing_contact import ContactRelaxation, hereditary_integral
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.creep import Material
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.program import Program

Array = NDArray[np.float64]


def _control(program: Program, control: str) -> None:
    if any(segment.control != control for segment in program.segments):
        raise InputError(f"expected a program of {control}")


def punch_approach(radius: float, material: Material, program: Program, t: ArrayLike) -> Array:
    r"""Approach of a flat round punch under a history of load, which never falls to zero once it acts.

    Parameters
    ----------
    radius : float
        Radius ``a`` of the punch. [m]
    material : Material
        The half-space.
    program : Program
        Ramps, holds and jumps of load.
    t : array_like of float
        Times. [s]

    Returns
    -------
    ndarray
        Approach. [m]

    Notes
    -----
    The pressure has no memory, :func:`punch_pressure`; the approach is

    .. math:: \delta(t) = \frac{1}{2 a} \int_0^t C(t - s) \, dW(s)
    """
    _control(program, "load")
    return hereditary_integral(material.contact_compliance, material.contact_integral, program, t) / (2 * radius)


def punch_force(radius: float, material: Prony, program: Program, t: ArrayLike) -> Array:
    r"""Force on a flat round punch under a history of approach, as long as it stays in contact.

    Parameters
    ----------
    radius : float
        Radius ``a`` of the punch. [m]
    material : Prony
        Exponential series with an instantaneous compliance.
    program : Program
        Ramps, holds and jumps of approach.
    t : array_like of float
        Times. [s]

    Returns
    -------
    ndarray
        Force; a negative one would need adhesion. [N]

    Notes
    -----
    .. math:: W(t) = 2 a \int_0^t E(t - s) \, d\delta(s)
    """
    _control(program, "approach")
    relaxation = ContactRelaxation.of(material)
    return 2 * radius * hereditary_integral(relaxation, relaxation.integral, program, t)


def punch_dissipation(radius: float, material: Prony, amplitude: float, period: float) -> float:
    r"""Energy lost in a settled cycle of a flat round punch that stays in contact.

    Parameters
    ----------
    radius : float
        Radius ``a`` of the punch. [m]
    material : Prony
        Exponential series with an instantaneous compliance.
    amplitude : float
        Amplitude ``d`` of the approach, a sine about any mean. [m]
    period : float
        Period. [s]

    Returns
    -------
    float
        ``2 pi a E'' d^2``. [J]
    """
    return 2 * np.pi * radius * ContactRelaxation.of(material).loss(2 * np.pi / period) * amplitude**2


def full_contact_wave(amplitude: float, wavenumber: float, material: Prony, t: ArrayLike) -> Array:
    r"""Amplitude of the pressure that keeps a wave flat after a jump to full contact.

    Parameters
    ----------
    amplitude : float
        Of the profile, a cosine. [m]
    wavenumber : float
        Length of the wave vector, ``2 pi / wavelength``. [rad/m]
    material : Prony
        Exponential series with an instantaneous compliance.
    t : array_like of float
        Times since then. [s]

    Returns
    -------
    ndarray
        Amplitude of the pressure about its mean, in phase with the profile. [Pa]

    Notes
    -----
    .. math:: p_q(t) = \tfrac{1}{2} E(t) |q| h_q

    Contact stays full as long as the sum of the waves and the mean pressure is nowhere negative.
    """
    return ContactRelaxation.of(material)(t) * wavenumber * amplitude / 2


def sticking_stiffness(poisson: float) -> float:
    r"""Stiffness of a round flat punch that sticks to a half-space, over that of one without friction.

    Parameters
    ----------
    poisson : float
        Poisson's ratio of the half-space.

    Returns
    -------
    float
        :math:`(1 - \nu) \ln(3 - 4 \nu) / (1 - 2 \nu)`. [-]

    References
    ----------
    .. [1] D. A. Spence, Proc. R. Soc. A 305 (1968) 55.
    """
    x = 1 - 2 * poisson
    return 1.0 if x == 0 else (1 - poisson) * math.log1p(2 * x) / x
