"""Elastic contact: Hertz's paraboloid, Sneddon's cone, the flat punch, and waves with periodic boundaries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.closed_forms.indenters import Cone, Indenter, Paraboloid, positive, punch_pressure
from roughvisc.units import Quantity, quantities

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AxisymmetricContact:
    """Elastic contact of an axisymmetric indenter with a half-space.

    Parameters
    ----------
    indenter : Indenter
        The rigid indenter.
    contact_modulus : float
        ``E*``. [Pa]
    radius, approach, force : float
        Contact radius [m], rigid-body approach from first touch [m], normal force [N].
    """

    indenter: Indenter
    contact_modulus: float
    radius: float
    approach: float
    force: float

    @property
    def peak_pressure(self) -> float:
        """Pressure at the centre; infinite under a cone. [Pa]"""
        return float(self.pressure(0.0))

    def pressure(self, r: ArrayLike) -> Array:
        """Pressure at a distance ``r`` [m] from the axis; zero outside the contact. [Pa]"""
        return self.contact_modulus * self.indenter.scaled_pressure(r, self.radius)

    def displacement(self, r: ArrayLike) -> Array:
        """Normal displacement of the surface at ``r`` [m], inside and outside the contact. [m]"""
        return self.indenter.displacement(r, self.radius)


def _elastic(indenter: Indenter, contact_modulus: float, force: float) -> AxisymmetricContact:
    positive("contact_modulus", contact_modulus, "Pa")
    positive("force", force, "N")
    radius = float(indenter.radius_at_scaled_force(force / contact_modulus))
    return AxisymmetricContact(indenter, contact_modulus, radius, float(indenter.reduced(radius)), force)


@quantities(sphere_radius="m", contact_modulus="Pa", force="N")
def hertz(sphere_radius: Quantity, contact_modulus: Quantity, force: Quantity) -> AxisymmetricContact:
    r"""Elastic contact of a paraboloid ``r^2 / (2 R)`` (Hertz).

    Parameters
    ----------
    sphere_radius : float or str
        Radius of curvature ``R``. [m]
    contact_modulus : float or str
        ``E*``. [Pa]
    force : float or str
        Normal force ``W``. [N]

    Returns
    -------
    AxisymmetricContact
        ``radius``, ``approach``, ``force``, ``peak_pressure``, ``pressure(r)``, ``displacement(r)``.

    Raises
    ------
    InputError
        If a parameter is not positive and finite.

    Notes
    -----
    .. math:: a^3 = \frac{3 W R}{4 E^*}, \quad \delta = \frac{a^2}{R}, \quad
              p = \frac{2 E^*}{\pi R} \sqrt{a^2 - r^2}

    The displacement outside loses about ``(r/a)^2`` roundings far from the contact.

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, Cambridge University Press, 1985, sections 3.4 and 4.2.

    Examples
    --------
    >>> contact = hertz(sphere_radius=1.0, contact_modulus=0.75, force=1.0)
    >>> contact.radius, contact.approach
    (1.0, 1.0)
    """
    return _elastic(Paraboloid(sphere_radius), contact_modulus, force)


@quantities(contact_modulus="Pa", force="N")
def sneddon_cone(slope: float, contact_modulus: Quantity, force: Quantity) -> AxisymmetricContact:
    r"""Elastic contact of a cone ``m r`` (Sneddon).

    Parameters
    ----------
    slope : float
        Slope ``m`` of the cone's side. [-]
    contact_modulus : float or str
        ``E*``. [Pa]
    force : float or str
        Normal force ``W``. [N]

    Returns
    -------
    AxisymmetricContact
        As for :func:`hertz`; the pressure at the apex is infinite.

    Raises
    ------
    InputError
        If a parameter is not positive and finite.

    Notes
    -----
    .. math:: W = \frac{\pi}{2} E^* m a^2, \quad \delta = \frac{\pi}{2} m a, \quad
              p = \frac{E^* m}{2} \operatorname{arcosh} \frac{a}{r}

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, Cambridge University Press, 1985, section 5.2.
    """
    return _elastic(Cone(slope), contact_modulus, force)


@dataclass(frozen=True)
class FlatPunchContact:
    """Elastic contact of a rigid cylinder with a flat end.

    Parameters
    ----------
    contact_modulus : float
        ``E*``. [Pa]
    radius, approach, force : float
        Radius of the punch [m], approach [m], force [N].
    """

    contact_modulus: float
    radius: float
    approach: float
    force: float

    def pressure(self, r: ArrayLike) -> Array:
        """``W / (2 pi a sqrt(a^2 - r^2))``; infinite at the edge, zero outside. [Pa]"""
        return punch_pressure(r, self.radius, self.force)

    def displacement(self, r: ArrayLike) -> Array:
        """The approach inside, ``(2 / pi) d asin(a / r)`` outside. [m]"""
        ratio = self.radius / np.maximum(np.abs(np.asarray(r, dtype=float)), self.radius)
        return np.asarray(2 / np.pi * self.approach * np.arcsin(ratio))


@quantities(radius="m", contact_modulus="Pa", force="N")
def flat_punch(radius: Quantity, contact_modulus: Quantity, force: Quantity) -> FlatPunchContact:
    r"""Elastic contact of a rigid cylinder with a flat end (Boussinesq).

    Parameters
    ----------
    radius : float or str
        Radius ``a`` of the punch. [m]
    contact_modulus : float or str
        ``E*``. [Pa]
    force : float or str
        Normal force ``W``. [N]

    Returns
    -------
    FlatPunchContact
        ``radius``, ``approach``, ``force``, ``pressure(r)``, ``displacement(r)``.

    Raises
    ------
    InputError
        If a parameter is not positive and finite.

    Notes
    -----
    .. math:: \delta = \frac{W}{2 E^* a}, \quad p = \frac{W}{2 \pi a \sqrt{a^2 - r^2}}

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, Cambridge University Press, 1985, section 3.4.
    """
    for name, value, unit in (
        ("radius", radius, "m"),
        ("contact_modulus", contact_modulus, "Pa"),
        ("force", force, "N"),
    ):
        positive(name, value, unit)
    return FlatPunchContact(contact_modulus, radius, force / (2 * contact_modulus * radius), force)


@dataclass(frozen=True)
class WavyContact:
    """Elastic contact of a one-dimensional cosine wave with a half-space, per period.

    Parameters
    ----------
    wavelength : float
        Period ``l``. [m]
    full_contact_pressure : float
        Mean pressure ``p*`` at which the contact becomes full. [Pa]
    mean_pressure : float
        Force over nominal area. [Pa]
    half_width : float
        Half-width of a contact strip; half the wavelength in full contact. [m]
    """

    wavelength: float
    full_contact_pressure: float
    mean_pressure: float
    half_width: float

    @property
    def contact_fraction(self) -> float:
        """Contact area over nominal area. [-]"""
        return 2 * self.half_width / self.wavelength

    def pressure(self, x: ArrayLike) -> Array:
        """Pressure at a distance ``x`` [m] from a crest; zero outside the contact. [Pa]"""
        x = np.asarray(x, dtype=float)
        if self.mean_pressure >= self.full_contact_pressure:
            return self.mean_pressure + self.full_contact_pressure * np.cos(2 * np.pi * x / self.wavelength)
        inside = self.mean_pressure / self.full_contact_pressure - np.sin(np.pi * x / self.wavelength) ** 2
        crest = 2 * self.full_contact_pressure * np.abs(np.cos(np.pi * x / self.wavelength))
        return np.asarray(crest * np.sqrt(np.maximum(inside, 0.0)))


@quantities(amplitude="m", wavelength="m", contact_modulus="Pa", mean_pressure="Pa")
def westergaard(
    amplitude: Quantity, wavelength: Quantity, contact_modulus: Quantity, mean_pressure: Quantity
) -> WavyContact:
    r"""Elastic contact of the profile ``amplitude cos(2 pi x / wavelength)``, plane strain (Westergaard).

    Parameters
    ----------
    amplitude : float or str
        Amplitude ``a`` of the cosine: half its height from trough to crest. [m]
    wavelength : float or str
        Period ``l``. [m]
    contact_modulus : float or str
        ``E*``. [Pa]
    mean_pressure : float or str
        Force over nominal area. [Pa]

    Returns
    -------
    WavyContact
        ``half_width``, ``contact_fraction``, ``full_contact_pressure``, ``pressure(x)`` with a crest at zero.

    Raises
    ------
    InputError
        If a parameter is not positive and finite.

    Notes
    -----
    .. math:: p^* = \frac{\pi E^* a}{l}, \quad \sin^2 \frac{\pi b}{l} = \frac{\bar p}{p^*}, \quad
              p = 2 p^* \cos\frac{\pi x}{l} \sqrt{\sin^2 \frac{\pi b}{l} - \sin^2 \frac{\pi x}{l}}

    At mean pressures of ``p*`` and above contact is full and ``p = pbar + p* cos(2 pi x / l)``.

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, Cambridge University Press, 1985, section 13.2.

    Examples
    --------
    >>> contact = westergaard(amplitude=1e-6, wavelength=1e-3, contact_modulus=1e9, mean_pressure=0.5e6 * np.pi)
    >>> round(contact.contact_fraction, 12)
    0.5
    """
    positive("mean_pressure", mean_pressure, "Pa")
    full = full_contact_pressure(amplitude, wavelength, contact_modulus, waves=1)
    sine = np.sqrt(min(mean_pressure / full, 1.0))
    return WavyContact(wavelength, full, mean_pressure, float(wavelength / np.pi * np.arcsin(sine)))


@quantities(amplitude="m", wavelength="m", contact_modulus="Pa")
def full_contact_pressure(
    amplitude: Quantity, wavelength: Quantity, contact_modulus: Quantity, waves: int = 2
) -> float:
    """Mean pressure ``p*`` that closes the gap under a wavy surface.

    Parameters
    ----------
    amplitude, wavelength : float or str
        Of ``a cos(kx)`` (``waves=1``) or ``a cos(kx) cos(ky)`` (``waves=2``), ``k = 2 pi / wavelength``. [m]
    contact_modulus : float or str
        ``E*``. [Pa]
    waves : {1, 2}
        How many directions are wavy.

    Returns
    -------
    float
        ``pi E* a / l`` or ``sqrt(2) pi E* a / l``. [Pa]

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, Cambridge University Press, 1985, section 13.2.
    """
    if waves not in (1, 2):
        raise InputError(f"waves is {waves!r}: expected 1 or 2")
    positive("amplitude", amplitude, "m")
    positive("wavelength", wavelength, "m")
    positive("contact_modulus", contact_modulus, "Pa")
    return float(np.sqrt(waves) * np.pi * contact_modulus * amplitude / wavelength)


def johnson_greenwood_higginson(mean_over_full: ArrayLike, limit: str) -> Array:
    r"""Limits of the contact fraction of ``a cos(kx) cos(ky)`` on an elastic half-space.

    Parameters
    ----------
    mean_over_full : array_like
        Mean pressure over ``p* = sqrt(2) pi E* a / l`` of :func:`full_contact_pressure`. [-]
    limit : {"low", "high"}
        Isolated Hertzian contacts at the crests, or isolated round gaps at the troughs.

    Returns
    -------
    ndarray
        Contact area over nominal area. [-]

    Notes
    -----
    With two crests and two troughs in each square of side ``l``, a crest of radius ``l^2 / (4 pi^2 a)`` and a
    pressure free of singularity around the gap,

    .. math:: \frac{A}{l^2} \to \pi \left(\frac{3 \bar p}{8 \pi p^*}\right)^{2/3}, \qquad
              1 - \frac{A}{l^2} \to \frac{3}{2 \pi} \left(1 - \frac{\bar p}{p^*}\right)

    References
    ----------
    .. [1] K. L. Johnson, J. A. Greenwood, J. G. Higginson, "The contact of elastic regular wavy surfaces",
       *Int. J. Mech. Sci.* 27 (1985) 383-396.
    """
    ratio = np.asarray(mean_over_full, dtype=float)
    if limit == "low":
        return np.asarray(np.pi * np.cbrt(3 * ratio / (8 * np.pi)) ** 2)
    if limit == "high":
        return np.asarray(1 - 3 / (2 * np.pi) * (1 - ratio))
    raise InputError(f"limit is {limit!r}: expected 'low' or 'high'")
