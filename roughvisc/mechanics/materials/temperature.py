"""Time-temperature shift: a material at another temperature, its times all multiplied by one factor."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.constants import R as GAS_CONSTANT

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.checks import check_number
from roughvisc.mechanics.materials.models import Material, Pair, PowerLaw, Prony, Tabulated, pair
from roughvisc.mechanics.materials.protocol import complete
from roughvisc.units import Quantity, quantities, quantity

Array = NDArray[np.float64]

#: Shift factors beyond this, or below its inverse, come from a temperature in a wrong unit and not from a material.
LARGEST_SHIFT = 1e30


@quantities(temperature="K", reference_temperature="K")
def wlf_shift(temperature: Quantity, reference_temperature: Quantity, c1: float, c2: float | str) -> float:
    r"""Shift factor of Williams, Landel and Ferry, for polymers from the glass transition to about 100 K above it.

    Parameters
    ----------
    temperature : float or str
        Temperature ``T`` of the contact. [K]
    reference_temperature : float or str
        Temperature ``T_r`` at which the compliance was measured. [K]
    c1 : float
        First constant, with the decimal logarithm. [-]
    c2 : float or str
        Second constant, a difference of temperatures. [K]

    Returns
    -------
    float
        ``a_T``, the factor for all times of the material. [-]

    Raises
    ------
    InputError
        If a number is not positive and finite, or the temperature is not above ``T_r - c2``, where the formula is not
        defined.

    Notes
    -----
    .. math:: \log_{10} a_T = -\frac{c_1 (T - T_r)}{c_2 + T - T_r}

    References
    ----------
    .. [1] M. L. Williams, R. F. Landel and J. D. Ferry, J. Am. Chem. Soc. 77 (1955) 3701-3707.

    Examples
    --------
    >>> wlf_shift(298.15, 298.15, 17.44, 51.6)  # at the reference temperature nothing is shifted
    1.0
    """
    check_number("temperature", temperature, "K")
    check_number("reference_temperature", reference_temperature, "K")
    check_number("c1", c1, "1")
    c2 = quantity(c2, "K", "c2", difference=True)
    check_number("c2", c2, "K")
    above = temperature - reference_temperature
    if not c2 + above > 0:
        raise InputError(
            f"temperature is {temperature:g} K: expected above {reference_temperature - c2:g} K, where the WLF shift "
            "has its pole (reference temperature less c2)"
        )
    return _power(10.0, -c1 * above / (c2 + above))


@quantities(temperature="K", reference_temperature="K", activation_energy="J/mol")
def arrhenius_shift(temperature: Quantity, reference_temperature: Quantity, activation_energy: Quantity) -> float:
    r"""Shift factor of a thermally activated process, after Arrhenius.

    Parameters
    ----------
    temperature : float or str
        Temperature ``T`` of the contact. [K]
    reference_temperature : float or str
        Temperature ``T_r`` at which the compliance was measured. [K]
    activation_energy : float or str
        ``E_a``. [J/mol]

    Returns
    -------
    float
        ``a_T``, the factor for all times of the material. [-]

    Raises
    ------
    InputError
        If a number is not positive and finite.

    Notes
    -----
    .. math:: \ln a_T = \frac{E_a}{R} \left(\frac{1}{T} - \frac{1}{T_r}\right)

    References
    ----------
    .. [1] J. D. Ferry, *Viscoelastic Properties of Polymers*, 3rd ed., Wiley, 1980, chapter 11.

    Examples
    --------
    >>> round(arrhenius_shift(283.15, 293.15, 80e3), 3)  # 10 K colder
    3.187
    """
    check_number("temperature", temperature, "K")
    check_number("reference_temperature", reference_temperature, "K")
    check_number("activation_energy", activation_energy, "J/mol")
    return _power(math.e, activation_energy / GAS_CONSTANT * (1 / temperature - 1 / reference_temperature))


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
    factor = float(factor)
    if isinstance(material, Pair):
        return pair(shifted(material.a, factor), shifted(material.b, factor))
    if not isinstance(material, Prony | PowerLaw | Tabulated):
        return Shifted(complete(material), factor)
    note = _noted(material.note, factor)
    if isinstance(material, PowerLaw):
        return dataclasses.replace(material, time_scale=factor * material.time_scale, note=note)
    times = tuple(factor * time for time in material.times)
    if isinstance(material, Tabulated):
        return dataclasses.replace(material, times=times, remark=_noted(material.remark, factor))
    fit = None if material.fit is None else material.fit.shifted(factor)
    return dataclasses.replace(material, fluidity=material.fluidity / factor, times=times, note=note, fit=fit)


@dataclass(frozen=True)
class Shifted:
    """A material of the user's own with all its times multiplied by a factor; made by :func:`shifted`.

    Parameters
    ----------
    given : Material
        At its reference temperature.
    factor : float
        Shift factor. [-]
    """

    given: Material
    factor: float

    @property
    def poisson(self) -> float:
        """Poisson ratio; temperature does not change it."""
        return self.given.poisson

    @property
    def note(self) -> str:
        """What was said of the material, and the factor."""
        return _noted(self.given.note, self.factor)

    def contact_compliance(self, t: ArrayLike) -> Array:
        """Contact compliance ``C(t / a_T)``. [1/Pa]"""
        return self.given.contact_compliance(np.asarray(t, dtype=float) / self.factor)

    def contact_integral(self, t: ArrayLike) -> Array:
        """First antiderivative ``a_T int_0^(t / a_T) C``. [s/Pa]"""
        return self.factor * self.given.contact_integral(np.asarray(t, dtype=float) / self.factor)

    def mean_contact_compliance(self, s: ArrayLike, h: ArrayLike) -> Array:
        """Mean over ``[s, s + h]``. [1/Pa]"""
        s, h = np.asarray(s, dtype=float), np.asarray(h, dtype=float)
        return self.given.mean_contact_compliance(s / self.factor, h / self.factor)


def _noted(note: str, factor: float) -> str:
    said = f"all times multiplied by {factor:.6g} (time-temperature shift)"
    return f"{note}; {said}" if note else said


def _power(base: float, exponent: float) -> float:
    """A power, infinite where it is beyond all numbers."""
    with np.errstate(over="ignore", under="ignore"):
        return float(np.power(base, exponent))
