r"""Heat of sliding: temperature of a body under moving round spots in which friction dissipates power.

The waves of roughness with the wave number :math:`q'` dissipate power down to a depth of about :math:`1 / 2q'`, with
the density :math:`2 q' e^{-2 q' z}`. They deform the body in a depth of about :math:`1 / 2q`, whose mean temperature
has the weight :math:`2 q e^{-2 q z}`. For a uniform flux :math:`Q` over a round spot of radius :math:`a` that moves at
the speed :math:`V` on a half-space, without loss of heat through its surface, the mean of the rise over the spot is

.. math:: \Delta T = \frac{Q}{\rho c} \frac{2}{\pi} \int_0^\infty s_q(k)\, s_{q'}(k)\, m(k)\, \mathrm dk, \quad
          s_q = \frac{4 q^2}{k^2 + 4 q^2}, \quad
          m = \int_0^\infty \frac{2 J_1(x)^2 \,\mathrm dx / x}{\sqrt{D^2 (k^2 + x^2/a^2)^2 + (x V / a)^2}} .

This is the steady solution of the equation of heat in the frame of the spot, as a Fourier integral: cosines over depth,
and the transform :math:`2 J_1(x) / x` of the disc in the plane. At the surface, :math:`s = 1`, it has the limits of
Jaeger, :math:`8 Q a / 3 \pi k` (slow) and :math:`0.974\, Q a / k / \sqrt{V a / D}` (fast), with the conductivity
:math:`k`.

References
----------
.. [1] B. N. J. Persson, J. Phys.: Condens. Matter 18 (2006) 7789: heat of each scale, in one dimension.
.. [2] J. C. Jaeger, J. Proc. R. Soc. N.S.W. 76 (1942) 203.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, special

from roughvisc.errors import InputError
from roughvisc.mechanics.quadrature import rule
from roughvisc.units import Quantity, number, quantities

Array = NDArray[np.float64]

# Argument of the Bessel function above which its square counts as its mean 1 / (pi x), and ends of the range.
_OSCILLATES = 60.0
_LEAST = 1e-9
_MOST = 1e12
# Points per panel of this integral, and panels per decade below the oscillations.
_POINTS = 4
_PER_DECADE = 1.5
# Step of the logarithm of k, and margin of k beyond the wave numbers of source, depth and spot. The integrand is
# analytic in a strip of half-width pi / 4, so that the trapezoidal rule has an error of exp(-pi^2 / 2 / step).
_STEP = 0.25
_MARGIN = 1e7
# Spacing of the temperatures at which the shift factor is evaluated. Between them its logarithm is linear. [K]
_BETWEEN = 0.25


@quantities(
    temperature="K > 0",
    density="kg/m^3 > 0",
    heat_capacity="J/kg/K > 0",
    heat_conductivity="W/m/K > 0",
    spot_radius="m > 0",
)
@dataclass(frozen=True)
class Heating:
    """Heat of sliding: thermal properties of the body, its temperature far from the contact, and its shift factor.

    Parameters
    ----------
    shift : callable
        ``shift(T)`` returns the shift factor ``a_T`` at a temperature [K], relative to the given material:
        such as ``lambda T: rv.wlf(T, "20 degC", 8.86, 101.6)`` for a material measured at 20 degC.
    temperature : float or str
        Temperature of the body far from the contact. [K]
    density : float or str
        [kg/m3]
    heat_capacity : float or str
        Specific heat. [J/(kg K)]
    heat_conductivity : float or str
        [W/(m K)]
    spot_radius : float or str, optional
        Radius of the spots that the long waves of a surface leave in contact, such as the summits of the grains of a
        road, for :func:`roughvisc.friction_theory`. [m] :func:`roughvisc.friction` computes the mean radius itself.

    Raises
    ------
    InputError
        If a value is not positive and finite, or `shift` is not a function.

    See Also
    --------
    roughvisc.friction, roughvisc.friction_theory, roughvisc.wlf

    Notes
    -----
    All heat flows into this body. The counterface takes a part in a real contact, and the temperature is then lower.

    Examples
    --------
    >>> import roughvisc as rv
    >>> tread = rv.Heating(
    ...     lambda T: rv.wlf(T, "20 degC", 8.86, 101.6),
    ...     temperature="20 degC", density=1.2e3, heat_capacity=1.5e3, heat_conductivity=0.3, spot_radius="1 mm",
    ... )
    >>> tread.volumetric_heat_capacity
    1800000.0
    """

    shift: Callable[[float], float]
    temperature: Quantity
    density: Quantity
    heat_capacity: Quantity
    heat_conductivity: Quantity
    spot_radius: Quantity | None = None
    _logarithms: list[float] = field(default_factory=list, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not callable(self.shift):
            expected = (
                "a function of the temperature [K] that returns the shift factor, such as lambda T: rv.wlf(T, ...)"
            )
            raise InputError(key="shift", found=self.shift, expected=expected)

    @property
    def volumetric_heat_capacity(self) -> float:
        """Density times specific heat. [J/(m3 K)]"""
        return self.density * self.heat_capacity

    def shift_factor(self, rise: Array | float) -> Array:
        """Return the shift factor of temperatures above :attr:`temperature`. [-]

        Parameters
        ----------
        rise : array_like
            Differences of the temperatures from :attr:`temperature`, not negative. [K]

        Raises
        ------
        InputError
            If `shift` does not return a positive, finite number at a temperature.
        """
        place = np.maximum(np.asarray(rise, dtype=float), 0.0) / _BETWEEN
        last = int(np.max(place, initial=0.0)) + 1
        while len(self._logarithms) <= last:
            temperature = self.temperature + _BETWEEN * len(self._logarithms)
            factor = number(self.shift(temperature), "1", f"shift({temperature:.6g} K)", above=0)
            self._logarithms.append(math.log(factor))
        return np.exp(np.interp(place, np.arange(last + 1), self._logarithms[: last + 1]))


@cache
def _disc() -> tuple[Array, Array]:
    """Return nodes x and weights of the integral over ``2 J1(x)^2 / x``; the weights have the sum one."""
    below = np.geomspace(_LEAST, 1.0, 1 + int(_PER_DECADE * -math.log10(_LEAST)))
    beyond = np.geomspace(_OSCILLATES, _MOST, 1 + int(_PER_DECADE * math.log10(_MOST / _OSCILLATES)))
    small, d_small = _gauss(np.log(below))
    middle, d_middle = _gauss(np.arange(1.0, _OSCILLATES + 1))
    large, d_large = _gauss(np.log(beyond))
    x = np.concatenate([np.exp(small), middle])
    share = 2 * special.j1(x) ** 2 * np.concatenate([d_small, d_middle / middle])
    tail = d_large * np.exp(-large)  # in proportion to the mean of the oscillations, 2 / (pi x)
    return np.append(x, np.exp(large)), np.append(share, tail * (1 - share.sum()) / tail.sum())


def _gauss(edges: Array) -> tuple[Array, Array]:
    """Return Gauss nodes and weights on the panels between some edges."""
    nodes, weights = rule(_POINTS)
    sides = np.diff(edges)[:, None]
    return (edges[:-1, None] + (nodes + 1) / 2 * sides).ravel(), (weights / 2 * sides).ravel()


class MovingSpot:
    """Temperature in a round spot that moves over a body, by the depth of heat and temperature.

    Parameters
    ----------
    radius : float
        Radius of the spot. [m]
    speed : float
        [m/s]
    conductivity : float
        Heat conductivity of the body. [W/(m K)]
    capacity : float
        Volumetric heat capacity of the body. [J/(m3 K)]
    wave_numbers : ndarray, shape (n,)
        Wave numbers of the depths of heat and temperature. An infinite number is the surface. [1/m]
    """

    def __init__(self, radius: float, speed: float, conductivity: float, capacity: float, wave_numbers: Array) -> None:
        diffusivity = conductivity / capacity
        layer = math.sqrt(speed / (radius * diffusivity))  # inverse depth to which heat flows under a fast spot
        scales = [1 / radius, layer, *wave_numbers[np.isfinite(wave_numbers)].tolist()]
        low = math.log(min(scales) / _MARGIN)
        high = math.log(max(scales) * _MARGIN)
        k = np.exp(np.linspace(low, high, 2 + int((high - low) / _STEP)))
        x, share = _disc()
        flow = np.square(diffusivity * (k[:, None] ** 2 + (x / radius) ** 2)) + np.square(x * (speed / radius))
        self._flows = (2 / math.pi / capacity * math.log(k[1] / k[0])) * k * ((1 / np.sqrt(flow)) @ share)
        self._depths = 1 / (1 + (k / (2 * wave_numbers[:, None])) ** 2)

    def rise(self, flux: Array) -> Array:
        """Return the mean rise of the temperature at each depth [K] by the flux of heat at each depth. [W/m2]"""
        return np.asarray(self._depths @ (self._flows * (flux @ self._depths)))


def surface_rise(flux: float, radius: float, speed: float, conductivity: float, capacity: float) -> float:
    """Return the mean temperature rise of a moving round spot by a uniform flux into its surface. [K]

    Parameters
    ----------
    flux : float
        Power over the area of the spot. [W/m2]
    radius, speed, conductivity, capacity : float
        As for :class:`MovingSpot`.
    """
    spot = MovingSpot(radius, speed, conductivity, capacity, np.array([math.inf]))
    return float(spot.rise(np.array([flux]))[0])


def spot_count(pressure: Array) -> int:
    """Return the number of connected regions in contact; a region across a periodic border counts twice."""
    return int(ndimage.label(pressure > 0, np.ones((3, 3)))[1])
