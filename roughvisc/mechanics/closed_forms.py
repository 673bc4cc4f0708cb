"""Closed forms of frictionless normal contact, for comparison with results.

Elastic solutions take the contact modulus ``E* = 2 G / (1 - nu) = E / (1 - nu^2)``. Viscoelastic solutions take a
material with the contact compliance ``C(t)``, which is ``1 / E*`` for an elastic material.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.arguments import one_of
from roughvisc.errors import InputError
from roughvisc.mechanics.materials.material import Material
from roughvisc.mechanics.program import Program
from roughvisc.units import Quantity, number, quantities

log = logging.getLogger("roughvisc")

Array = NDArray[np.float64]
#: Largest fall of a load below its earlier maximum, over the largest load. Noise of recorded loads: 0.002 to 0.06.
_FALL = 0.1
__all__ = ["cone", "flat_punch", "hertz", "johnson_greenwood_higginson", "lee_radok", "westergaard"]


def __dir__() -> list[str]:
    return __all__


@dataclass(frozen=True)
class RoundContact:
    """Elastic contact of an axisymmetric indenter with a half-space.

    Attributes
    ----------
    radius, approach, force : float
        Contact radius [m], rigid-body approach from first touch [m], normal force [N].
    pressure : callable
        Pressure at distances from the axis, zero outside the contact. [m] -> [Pa]
    """

    radius: float
    approach: float
    force: float
    pressure: Callable[[ArrayLike], Array] = field(compare=False, repr=False)

    @property
    def peak_pressure(self) -> float:
        """Pressure at the centre; infinite under a cone. [Pa]"""
        return float(self.pressure(0.0))


@quantities(sphere_radius="m > 0", contact_modulus="Pa > 0", force="N > 0")
def hertz(sphere_radius: Quantity, contact_modulus: Quantity, force: Quantity) -> RoundContact:
    r"""Return the elastic contact of a paraboloid ``r^2 / (2 R)`` (Hertz).

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
    RoundContact
        ``radius``, ``approach``, ``force``, ``peak_pressure``, ``pressure(r)``.

    Raises
    ------
    InputError
        If a parameter is not positive and finite.

    See Also
    --------
    roughvisc.sphere, roughvisc.closed_forms.lee_radok

    Notes
    -----
    .. math:: a^3 = \frac{3 W R}{4 E^*}, \quad \delta = \frac{a^2}{R}, \quad
              p = \frac{2 E^*}{\pi R} \sqrt{a^2 - r^2}

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, Cambridge University Press, 1985, sections 3.4 and 4.2.

    Examples
    --------
    >>> contact = hertz(sphere_radius=1.0, contact_modulus=0.75, force=1.0)
    >>> contact.radius, contact.approach
    (1.0, 1.0)
    """
    a = float(np.cbrt(0.75 * sphere_radius * force / contact_modulus))

    def pressure(r: ArrayLike) -> Array:
        s = np.abs(np.asarray(r, dtype=float))
        return np.asarray(2 * contact_modulus / (np.pi * sphere_radius) * np.sqrt(np.maximum((a - s) * (a + s), 0.0)))

    return RoundContact(a, a**2 / sphere_radius, force, pressure)


@quantities(slope="1 > 0", contact_modulus="Pa > 0", force="N > 0")
def cone(slope: float, contact_modulus: Quantity, force: Quantity) -> RoundContact:
    r"""Return the elastic contact of a cone ``m r`` (Sneddon).

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
    RoundContact
        Contact as in :func:`hertz`; the pressure at the apex is infinite.

    Raises
    ------
    InputError
        If a parameter is not positive and finite.

    See Also
    --------
    roughvisc.cone, roughvisc.closed_forms.hertz

    Notes
    -----
    .. math:: W = \frac{\pi}{2} E^* m a^2, \quad \delta = \frac{\pi}{2} m a, \quad
              p = \frac{E^* m}{2} \operatorname{arcosh} \frac{a}{r}

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, Cambridge University Press, 1985, section 5.2.

    Examples
    --------
    >>> import roughvisc as rv
    >>> contact = rv.closed_forms.cone(slope=0.1, contact_modulus="4 MPa", force="0.2 N")
    >>> round(contact.approach / contact.radius, 4)  # pi m / 2
    0.1571
    """
    a = float(np.sqrt(2 * force / (np.pi * contact_modulus * slope)))

    def pressure(r: ArrayLike) -> Array:
        s = np.abs(np.asarray(r, dtype=float))
        with np.errstate(divide="ignore", invalid="ignore"):
            # arcosh(1 + e) without the rounding of 1 + e, which would be the whole value near the edge
            excess = np.where(s < a, (a - s) / s, 0.0)
            return np.asarray(contact_modulus * slope / 2 * np.log1p(excess + np.sqrt(excess * (excess + 2))))

    return RoundContact(a, np.pi / 2 * slope * a, force, pressure)


@quantities(radius="m > 0", contact_modulus="Pa > 0", force="N > 0")
def flat_punch(radius: Quantity, contact_modulus: Quantity, force: Quantity) -> RoundContact:
    r"""Return the elastic contact of a rigid cylinder with a flat end (Boussinesq).

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
    RoundContact
        Contact as in :func:`hertz`; the pressure at the edge is infinite.

    Raises
    ------
    InputError
        If a parameter is not positive and finite.

    See Also
    --------
    roughvisc.flat_punch, roughvisc.closed_forms.hertz

    Notes
    -----
    .. math:: \delta = \frac{W}{2 E^* a}, \quad p = \frac{W}{2 \pi a \sqrt{a^2 - r^2}}

    References
    ----------
    .. [1] K. L. Johnson, *Contact Mechanics*, Cambridge University Press, 1985, section 3.4.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rv.closed_forms.flat_punch(radius="1 mm", contact_modulus="4 MPa", force="8 N").approach
    0.001
    """
    a = radius
    approach = force / (2 * contact_modulus * radius)

    def pressure(r: ArrayLike) -> Array:
        s = np.abs(np.asarray(r, dtype=float))
        with np.errstate(divide="ignore"):
            inside = force / (2 * np.pi * a * np.sqrt(np.maximum((a - s) * (a + s), 0.0)))
        return np.asarray(np.where(s <= a, inside, 0.0))

    return RoundContact(a, approach, force, pressure)


@dataclass(frozen=True)
class WavyContact:
    """Elastic contact of a one-dimensional cosine wave with a half-space, per period.

    Attributes
    ----------
    half_width : float
        Half-width of a contact strip; half the wavelength in full contact. [m]
    contact_fraction : float
        Contact area over nominal area. [-]
    full_contact_pressure : float
        Mean pressure ``p*`` at which the contact becomes full. [Pa]
    pressure : callable
        Pressure at distances from a crest, zero outside the contact. [m] -> [Pa]
    """

    half_width: float
    contact_fraction: float
    full_contact_pressure: float
    pressure: Callable[[ArrayLike], Array] = field(compare=False, repr=False)


@quantities(amplitude="m > 0", wavelength="m > 0", contact_modulus="Pa > 0", mean_pressure="Pa > 0")
def westergaard(
    amplitude: Quantity, wavelength: Quantity, contact_modulus: Quantity, mean_pressure: Quantity
) -> WavyContact:
    r"""Return the elastic contact of the profile ``amplitude cos(2 pi x / wavelength)``, plane strain (Westergaard).

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

    See Also
    --------
    roughvisc.wavy, roughvisc.closed_forms.johnson_greenwood_higginson

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
    mean = mean_pressure
    full = np.pi * contact_modulus * amplitude / wavelength

    def pressure(x: ArrayLike) -> Array:
        phase = np.pi * np.asarray(x, dtype=float) / wavelength
        if mean >= full:
            return mean + full * np.cos(2 * phase)
        return np.asarray(2 * full * np.abs(np.cos(phase)) * np.sqrt(np.maximum(mean / full - np.sin(phase) ** 2, 0.0)))

    fraction = 2 / np.pi * float(np.arcsin(np.sqrt(min(mean / full, 1.0))))
    return WavyContact(fraction * wavelength / 2, fraction, full, pressure)


def johnson_greenwood_higginson(mean_over_full: ArrayLike, limit: str) -> Array:
    r"""Return a limit of the contact fraction of ``a cos(kx) cos(ky)`` on an elastic half-space.

    Parameters
    ----------
    mean_over_full : array_like
        Mean pressure over the pressure ``p* = sqrt(2) pi E* a / l`` at which the contact becomes full. [-]
    limit : {"low", "high"}
        Isolated Hertzian contacts at the crests, or isolated round gaps at the troughs.

    Returns
    -------
    ndarray
        Contact area over nominal area. [-]

    See Also
    --------
    roughvisc.wavy, roughvisc.closed_forms.westergaard

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

    Examples
    --------
    >>> import roughvisc as rv
    >>> float(rv.closed_forms.johnson_greenwood_higginson(1.0, "high"))  # the pressure of full contact
    1.0
    """
    ratio = np.asarray(mean_over_full, dtype=float)
    if one_of("limit", limit, ("low", "high")) == "low":
        return np.asarray(np.pi * np.cbrt(3 * ratio / (8 * np.pi)) ** 2)
    return np.asarray(1 - 3 / (2 * np.pi) * (1 - ratio))


@dataclass(frozen=True)
class GrowingContact:
    """Contact of a sphere with a viscoelastic half-space under a load that never decreases.

    Attributes
    ----------
    sphere_radius : float
        Radius of curvature. [m]
    material : Prony or Creep
        The half-space.
    program : Program
        The load, without its falls; ``note`` states the largest fall.
    """

    sphere_radius: float
    material: Material
    program: Program

    def radius(self, t: ArrayLike) -> Array:
        """Return the contact radius at times ``t``, after a jump. [s] -> [m]"""
        since = np.asarray(t, dtype=float)
        # int C dW, a sum over the corners of the program
        crept = np.zeros(since.shape)
        load = 0.0
        for segment, start in zip(self.program.segments, self.program.corners, strict=False):
            rise = 0.0 if segment.end is None else segment.end - load
            age = np.maximum(since - start, 0.0)
            if segment.duration == 0:
                crept = crept + np.where(since >= start, rise * self.material.contact_compliance(age), 0.0)
            elif rise:
                later = np.maximum(age - segment.duration, 0.0)
                risen = self.material.contact_integral(age) - self.material.contact_integral(later)
                crept = crept + rise / segment.duration * risen
            load += rise
        return np.asarray(np.cbrt(0.75 * self.sphere_radius * crept))

    def approach(self, t: ArrayLike) -> Array:
        """Return the approach at times ``t``, after a jump. [s] -> [m]"""
        return self.radius(t) ** 2 / self.sphere_radius


@quantities(sphere_radius="m > 0", load="N")
def lee_radok(sphere_radius: Quantity, material: Material, load: Quantity | Program) -> GrowingContact:
    r"""Return the contact of a sphere with a viscoelastic half-space under a load that never decreases (Lee and Radok).

    Parameters
    ----------
    sphere_radius : float or str
        Radius of curvature ``R``. [m]
    material : Prony or Creep
        The half-space.
    load : float or str, or Program
        A load ``W`` that is applied at time zero and kept [N], or rising ramps, holds and jumps of load. A recorded
        load may fall below its earlier maximum by up to 10 % of its largest value, such as noise in a hold: then the
        running maximum is used, and a warning states the fall.

    Returns
    -------
    GrowingContact
        ``radius(t)``, ``approach(t)``.

    Raises
    ------
    InputError
        If a parameter is not positive and finite; if the load falls further, or the program prescribes something else.

    See Also
    --------
    roughvisc.closed_forms.hertz

    Notes
    -----
    .. math:: a(t)^3 = \tfrac{3}{4} R \int_0^t C(t - s) \, \mathrm dW(s), \quad \delta = \frac{a^2}{R}

    References
    ----------
    .. [1] E. H. Lee, J. R. M. Radok, "The contact problem for viscoelastic bodies", *J. Appl. Mech.* 27 (1960)
       438-444.

    Examples
    --------
    >>> import roughvisc as rv
    >>> press = lee_radok(1.0, rv.maxwell(shear_modulus=0.1875, viscosity=0.1875), load=1.0)
    >>> float(press.radius(0.0)), float(press.radius(7.0))
    (1.0, 2.0)
    """
    if not isinstance(load, Program):
        load = Program().load(number(load, "N", "load", above=0), over=0)
    if not all(segment.control == "load" and not (segment.amplitude or segment.slide) for segment in load.segments):
        raise InputError(key="load", found=load, expected="a load, without approaches, pressures, cycles and slides")
    return GrowingContact(sphere_radius, material, _rising(load))


def _rising(load: Program) -> Program:
    """Return the running maximum of a load; refuse a load that falls by more than :data:`_FALL`."""
    highest = 0.0
    fall = 0.0
    segments = []
    for segment in load.segments:
        if segment.end is not None:
            highest = max(highest, segment.end)
            fall = max(fall, highest - segment.end)
            segment = replace(segment, end=highest)
        segments.append(segment)
    if fall == 0:
        return load
    fallen = f"falls below its earlier maximum by {100 * fall / highest:.2g} % of the largest load"
    if fall > _FALL * highest:
        expected = f"a load that falls by at most {100 * _FALL:g} %, as noise does in a hold; this one {fallen}"
        raise InputError(key="load", found=load, expected=expected)
    note = f"The load {fallen}: the running maximum is used."
    log.warning("%s", note)
    return Program(tuple(segments), " ".join(filter(None, (load.note, note))))
