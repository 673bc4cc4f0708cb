"""A material whose times, or whose moduli, are all multiplied by one factor: another temperature, a stiffer batch."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_number
from roughvisc.mechanics.materials.models import Material, Pair, PowerLaw, Prony, Tabulated, pair
from roughvisc.mechanics.materials.protocol import complete

Array = NDArray[np.float64]

#: Shift factors beyond this, or below its inverse, come from a temperature in a wrong unit and not from a material.
LARGEST_SHIFT = 1e30


def shifted(material: Material, factor: float) -> Material:
    r"""Shift a material to another temperature: multiply all its times by one factor.

    Parameters
    ----------
    material : Material
        Material at its reference temperature, also one of your own. Both bodies of a pair are shifted.
    factor : float
        Shift factor ``a_T``, from :func:`wlf_shift`, :func:`arrhenius_shift` or a measurement; above one for slower
        response, at lower temperature. [-]

    Returns
    -------
    Material
        A material of the same type. Its ``note`` states the factor.

    Raises
    ------
    InputError
        If the factor is not between 1e-30 and 1e30.

    Notes
    -----
    .. math:: C(t;\, T) = C(t / a_T;\, T_r)

    The material is thermorheologically simple: temperature changes only times, not compliances. There is no vertical
    shift.

    Examples
    --------
    >>> from roughvisc.mechanics.materials.models import maxwell
    >>> float(shifted(maxwell(1e6, 1e6), 10.0).creep_compliance(20.0))  # J(2 s) at the reference temperature
    3e-06
    """
    if not (isinstance(factor, int | float | np.number) and 1 / LARGEST_SHIFT <= factor <= LARGEST_SHIFT):
        raise InputError(f"shift factor is {factor!r}: expected a number from 1e-30 to 1e30")
    remark = f"all times multiplied by {factor:.6g} (time-temperature shift)"
    return _scaled(material, remark, time_factor=float(factor))


def stiffened(material: Material, factor: float) -> Material:
    r"""The material with all its moduli and viscosities multiplied by one factor; its times stay.

    Parameters
    ----------
    material : Material
        One of the package's, or of the user's own. Both bodies of a pair are stiffened.
    factor : float
        Above one: stiffer. [-]

    Returns
    -------
    Material
        Of the same kind. Its ``note`` says the factor.

    Raises
    ------
    InputError
        If the factor is not positive and finite.

    Notes
    -----
    .. math:: C(t) \to C(t) / f

    Examples
    --------
    >>> from roughvisc.mechanics.materials.models import elastic
    >>> stiffened(elastic(1e6), 2.0).glassy
    5e-07
    """
    check_number("modulus_factor", factor, "1")
    return _scaled(material, f"all moduli multiplied by {factor:.6g}", modulus_factor=float(factor))


def _scaled(material: Material, remark: str, time_factor: float = 1.0, modulus_factor: float = 1.0) -> Material:
    """The material with its times and its moduli multiplied, of the same kind; its note ends with the remark."""
    if isinstance(material, Pair):
        return pair(*(_scaled(body, remark, time_factor, modulus_factor) for body in (material.a, material.b)))
    if isinstance(material, PowerLaw):
        return dataclasses.replace(
            material,
            glassy=material.glassy / modulus_factor,
            coefficient=material.coefficient / modulus_factor,
            time_scale=time_factor * material.time_scale,
            note=_joined(material.note, remark),
        )
    if not isinstance(material, Prony | Tabulated):
        return Scaled(complete(material), remark, time_factor, modulus_factor)
    times = tuple(time_factor * time for time in material.times)
    compliances = tuple(one / modulus_factor for one in material.compliances)
    if isinstance(material, Tabulated):
        remark = _joined(material.remark, remark)
        return dataclasses.replace(material, times=times, compliances=compliances, remark=remark)
    return dataclasses.replace(
        material,
        glassy=material.glassy / modulus_factor,
        fluidity=material.fluidity / (time_factor * modulus_factor),
        compliances=compliances,
        times=times,
        note=_joined(material.note, remark),
    )


@dataclass(frozen=True)
class Scaled:
    """A material of the user's own with other times or moduli; made by :func:`shifted` and :func:`stiffened`.

    Parameters
    ----------
    given : Material
        As it is.
    remark : str
        What was done to it.
    time_factor, modulus_factor : float
        Of all its times, and of all its moduli. [-]
    """

    given: Material
    remark: str
    time_factor: float
    modulus_factor: float

    @property
    def poisson(self) -> float:
        """Poisson ratio, which stays."""
        return self.given.poisson

    @property
    def note(self) -> str:
        """What was said of the material, and what was done."""
        return _joined(self.given.note, self.remark)

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Contact compliance. [1/Pa]"""
        return self.given.contact_compliance(np.asarray(t, dtype=float) / self.time_factor) / self.modulus_factor

    def contact_integral(self, t: ArrayLike) -> Array:
        """Its first antiderivative. [s/Pa]"""
        integral = self.given.contact_integral(np.asarray(t, dtype=float) / self.time_factor)
        return self.time_factor * integral / self.modulus_factor

    def mean_contact_compliance(self, s: ArrayLike, h: ArrayLike) -> Array:
        """Mean over ``[s, s + h]``. [1/Pa]"""
        s, h = np.asarray(s, dtype=float), np.asarray(h, dtype=float)
        mean = self.given.mean_contact_compliance(s / self.time_factor, h / self.time_factor)
        return mean / self.modulus_factor


def _joined(note: str, remark: str) -> str:
    return f"{note}; {remark}" if note else remark
