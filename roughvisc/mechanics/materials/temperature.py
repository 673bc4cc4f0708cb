"""Factors of the time-temperature shift, by which all times of a material are longer at another temperature."""

from __future__ import annotations

import math

import numpy as np
from scipy.constants import R as GAS_CONSTANT

from roughvisc.errors import InputError
from roughvisc.units import Quantity, number, quantities


@quantities(temperature="K > 0", reference_temperature="K > 0", wlf_c1="1 > 0")
def wlf(temperature: Quantity, reference_temperature: Quantity, wlf_c1: float, wlf_c2: float | str) -> float:
    r"""Shift factor of Williams, Landel and Ferry, for polymers from the glass transition to about 100 K above it.

    Parameters
    ----------
    temperature : float or str
        Temperature ``T`` of the contact. [K]
    reference_temperature : float or str
        Temperature ``T_r`` at which the compliance was measured. [K]
    wlf_c1 : float
        First constant, with the decimal logarithm. [-]
    wlf_c2 : float or str
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
    >>> wlf(298.15, 298.15, 17.44, 51.6)  # at the reference temperature nothing is shifted
    1.0
    """
    c2 = number(wlf_c2, "K", "wlf_c2", above=0, difference=True)
    above = temperature - reference_temperature
    if not c2 + above > 0:
        pole = (
            f"{reference_temperature - c2:g} K, the reference temperature less wlf_c2, where the WLF shift has its pole"
        )
        raise InputError(key="temperature", found=temperature, expected=f"a temperature above {pole}")
    return _power(10.0, -wlf_c1 * above / (c2 + above))


@quantities(temperature="K > 0", reference_temperature="K > 0", activation_energy="J/mol > 0")
def arrhenius(temperature: Quantity, reference_temperature: Quantity, activation_energy: Quantity) -> float:
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
    >>> round(arrhenius(283.15, 293.15, 80e3), 3)  # 10 K colder
    3.187
    """
    return _power(math.e, activation_energy / GAS_CONSTANT * (1 / temperature - 1 / reference_temperature))


def _power(base: float, exponent: float) -> float:
    """Return a power, infinite beyond the largest number."""
    with np.errstate(over="ignore", under="ignore"):
        return float(np.power(base, exponent))
