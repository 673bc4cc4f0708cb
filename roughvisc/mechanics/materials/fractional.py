"""Fractional Zener solid: a spring parallel to a spring in series with a springpot."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.material import Creep, check_poisson, remembers_model
from roughvisc.units import Quantity, number, quantities

Array = NDArray[np.float64]
#: Smallest exponent; the number of points of the quadrature is inverse to it.
_LEAST = 0.05
#: Ends of the quadrature, and its step over the exponent: relative error 1e-14 (measured).
_END = 40.0
_STEP = 0.25


@quantities(instantaneous="Pa > 0", equilibrium="Pa > 0", relaxation_time="s > 0", exponent="1 > 0")
@remembers_model
def fractional_zener(
    instantaneous: Quantity, equilibrium: Quantity, relaxation_time: Quantity, exponent: float, poisson: float = 0.5
) -> Creep:
    r"""Fractional Zener solid, a model of polymers through the glass transition with four parameters.

    .. math:: G^*(\omega) = G_e + (G_0 - G_e) \frac{(i \omega \tau)^\alpha}{1 + (i \omega \tau)^\alpha}, \qquad
              J(t) = \frac{1}{G_0} + \Big(\frac{1}{G_e} - \frac{1}{G_0}\Big)
                     \Big[1 - E_\alpha\Big(-\frac{G_e}{G_0} \Big(\frac{t}{\tau}\Big)^\alpha\Big)\Big]

    Parameters
    ----------
    instantaneous : float or str
        Instantaneous modulus ``G_0``. [Pa]
    equilibrium : float or str
        Modulus after endless relaxation ``G_e``, below `instantaneous`. [Pa]
    relaxation_time : float or str
        ``tau``. [s]
    exponent : float
        ``alpha`` of the springpot, from 0.05 to 1; one makes the Zener solid.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    Creep

    Raises
    ------
    InputError
        If a value is out of its range.

    See Also
    --------
    roughvisc.zener, roughvisc.power_law, roughvisc.creep

    References
    ----------
    .. [1] F. Mainardi, *Fractional Calculus and Waves in Linear Viscoelasticity*, Imperial College Press, 2010,
       section 3.4; the Mittag-Leffler function ``E_alpha`` is in appendix E.

    Examples
    --------
    >>> rubber = fractional_zener("1 GPa", "1 MPa", "1 us", 0.5)
    >>> rubber.creep_compliance([0.0, float("inf")]).round(12).tolist()
    [1e-09, 1e-06]
    """
    check_poisson(poisson)
    number(exponent, "1", "exponent", least=_LEAST, most=1.0)
    if not equilibrium < instantaneous:
        expected = f"less than the instantaneous modulus, {instantaneous:g} Pa"
        raise InputError(key="equilibrium", found=equilibrium, expected=expected)
    parameters = instantaneous, equilibrium, relaxation_time, exponent
    return Creep(fractional_creep, parameters, poisson, transform=fractional_transform)


def fractional_creep(
    t: Array, instantaneous: float, equilibrium: float, relaxation_time: float, exponent: float
) -> Array:
    r"""Return the creep compliance of a fractional Zener solid. [1/Pa]

    Notes
    -----
    The Mittag-Leffler function is a sum of exponentials [1]_,

    .. math:: E_\alpha(-x^\alpha) = \int_0^1 e^{-x\, r(p)}\, dp, \qquad
              r(p) = \Big(\frac{\sin(\alpha \pi p)}{\sin(\alpha \pi (1 - p))}\Big)^{1/\alpha},

    by the trapezoidal rule over ``w``, with :math:`p = 1/(1 + e^{-w})`.

    References
    ----------
    .. [1] T. J. Kozubowski, J. Stat. Comput. Simul. 70 (2001) 1-21, eq. (2.6).
    """
    step = _STEP * exponent
    w = np.arange(-_END, _END + step / 2, step)
    p = 1 / (1 + np.exp(-w))
    rest = 1 / (1 + np.exp(w))
    weights = step * p * rest
    angle = exponent * np.pi
    ratio = np.log(np.sin(angle * p)) - np.log(np.sin(angle * rest)) - np.log(instantaneous / equilibrium)
    with np.errstate(divide="ignore", over="ignore"):  # at time zero, and of terms that have ended
        ages = np.exp(np.log(np.asarray(t, dtype=float) / relaxation_time)[..., None] + ratio / exponent)
    retarded = -np.expm1(-ages) @ weights / weights.sum()
    return np.asarray(1 / instantaneous + (1 / equilibrium - 1 / instantaneous) * retarded)


def fractional_transform(
    s: NDArray[Any], instantaneous: float, equilibrium: float, relaxation_time: float, exponent: float
) -> NDArray[Any]:
    """Return the shear compliance of a fractional Zener solid under a pressure that grows as ``exp(s t)``. [1/Pa]"""
    power = (s * relaxation_time) ** exponent
    return np.asarray((1 + power) / (equilibrium + instantaneous * power))
