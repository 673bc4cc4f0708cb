r"""Persson's integrals of rubber friction over the radial spectrum of a surface, with the temperature of each scale.

With :math:`C(q)` of the convention :math:`\langle h^2 \rangle = (2 \pi)^{-2} \int C\, \mathrm d^2 q`, a nominal
pressure :math:`\sigma_0`, and means over the directions :math:`\varphi` of the waves,

.. math::

    G(q) = \frac{1}{16 \pi \sigma_0^2} \int_{q_0}^q q'^3 C\, \langle |E^*|^2 \rangle \,\mathrm dq', \quad
    P = \operatorname{erf} \frac{1}{2 \sqrt G}, \quad
    \mu = \frac{1}{4 \pi \sigma_0} \int q^3 C P S\, \langle \cos \varphi \operatorname{Im} E^* \rangle \,\mathrm dq .

The contact fraction falls steeply where the waves begin. So :math:`P S` is integrated in closed form over :math:`G`
between two wave numbers, and the ratio of loss to squared modulus by the trapezoidal rule.

The plane-strain modulus :math:`E^*` is taken at the frequency :math:`a_T q V \cos \varphi`, with the shift factor of
the temperature of the scale. :math:`S = g + (1 - g) P^2` reduces the dissipation in partial contact.

References
----------
.. [1] B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840.
.. [2] B. N. J. Persson, J. Phys.: Condens. Matter 18 (2006) 7789.
.. [3] M. Scaraggi, B. N. J. Persson, J. Phys.: Condens. Matter 27 (2015) 105102: the factor S.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.special import erf, erfc

from roughvisc.errors import ConvergenceError
from roughvisc.mechanics.heating import Heating, MovingSpot
from roughvisc.mechanics.materials.material import Material
from roughvisc.mechanics.materials.series import complex_compliance
from roughvisc.mechanics.quadrature import rule

Array = NDArray[np.float64]

# Frequencies per decade at which the means over the directions are tabulated, decades by which a table grows, and
# points of the mean. Between the frequencies cubic splines of the logarithms have a relative error of 1e-6.
_PER_DECADE = 24
_GROWS = 3.0
_DIRECTIONS = 64
# Logarithm of a loss modulus that counts as zero. [Pa]
_NO_LOSS = -600.0
# Logarithms of G between which the integral of P^3 is tabulated, and their step.
_LOGARITHMS = np.arange(-10.0, 60.0, 0.05)
# Largest relative change of the rises of temperature when they agree with the heat; iterations with each damping, and
# remembered. On 480 random rubbers, roads and speeds all but one were solved, nearly all with the first damping.
_CONVERGED = 1e-9
_ITERATIONS = 60
_REMEMBERED = 6
_DAMPINGS = (1.0, 0.3)
# Least rise at the start over the rise by the friction without heat, and largest step of a logarithm.
_LEAST_START = 1e-6
_LARGEST_STEP = 2.0


class DirectionMeans:
    """Means of the squared modulus and of the loss modulus over the directions of waves, by the frequency ``q V``.

    Parameters
    ----------
    material : Material
        Material of a half-space.
    """

    def __init__(self, material: Material) -> None:
        self._material = material
        self._range = (math.inf, -math.inf)
        self._splines = (CubicSpline([0, 1], [0, 0]), CubicSpline([0, 1], [0, 0]))
        # cos(phi) = 1 - (1 - s)^4 collects nodes near the waves across the motion, which hardly move
        nodes, weights = rule(_DIRECTIONS)
        turn = (nodes + 1) / 2
        phi = np.pi / 2 * (1 - turn**3)
        self._cosines = np.cos(phi)
        self._weights = weights / 2 * 3 * turn**2

    def __call__(self, frequency: Array) -> tuple[Array, Array]:
        """Return the means of :math:`|E^*|^2` [Pa2] and of :math:`\\cos \\varphi \\, \\mathrm{Im} E^*` [Pa].

        Parameters
        ----------
        frequency : ndarray
            Wave number times speed times shift factor, positive. [rad/s]
        """
        logarithm = np.log(frequency)
        low = float(logarithm.min())
        high = float(logarithm.max())
        if low < self._range[0] or high > self._range[1]:
            self._tabulate(low, high)
        square, loss = (spline(logarithm) for spline in self._splines)
        return np.exp(square), np.where(loss > _NO_LOSS, np.exp(loss), 0.0)

    def _tabulate(self, low: float, high: float) -> None:
        """Tabulate the means for natural logarithms of the frequency in a range; keep the existing table."""
        if self._range[0] < math.inf:
            low = self._range[0] if low >= self._range[0] else low - _GROWS
            high = self._range[1] if high <= self._range[1] else high + _GROWS
            low = min(low, self._range[0])
            high = max(high, self._range[1])
        count = 8 + int((high - low) / math.log(10) * _PER_DECADE)
        grid = np.linspace(low, max(high, low + 1e-6), count)
        modulus = 1 / complex_compliance(self._material, np.exp(grid)[:, None] * self._cosines)
        square = (np.abs(modulus) ** 2) @ self._weights
        loss = modulus.imag @ (self._weights * self._cosines)
        loss = np.log(np.maximum(loss, math.exp(_NO_LOSS - 1)))
        self._splines = (CubicSpline(grid, np.log(square)), CubicSpline(grid, loss))
        self._range = (low, high)


@cache
def _cube() -> CubicSpline:
    """Return the integral of ``P^3`` over ``G`` from zero, as a function of ``ln G``."""
    values = np.exp(_LOGARITHMS)
    start = values[0]  # P is 1 below
    integral = CubicSpline(_LOGARITHMS, erf(0.5 / np.sqrt(values)) ** 3 * values).antiderivative()
    return CubicSpline(_LOGARITHMS, start + integral(_LOGARITHMS))


def contact_integral(variance: Array, dissipation_factor: float) -> Array:
    r"""Return :math:`\int_0^G P\, (g + (1 - g) P^2) \,\mathrm dG'` with :math:`P = \operatorname{erf}(1 / 2 \sqrt G)`.

    Parameters
    ----------
    variance : ndarray
        The numbers ``G``, not negative. [-]
    dissipation_factor : float
        The number ``g``. [-]

    Notes
    -----
    The integral of :math:`P` is :math:`G P + \sqrt{G/\pi}\, e^{-1/4G} - \tfrac12 \operatorname{erfc}(1 / 2 \sqrt G)`.
    """
    root = np.sqrt(np.maximum(variance, np.finfo(float).tiny))
    inverse = 0.5 / root
    whole = variance * erf(inverse) + root * np.exp(-(inverse**2)) / math.sqrt(math.pi) - erfc(inverse) / 2
    logarithm = np.clip(2 * np.log(root), _LOGARITHMS[0], _LOGARITHMS[-1])
    cube = np.where(logarithm > _LOGARITHMS[0], _cube()(logarithm), variance)
    return np.asarray(dissipation_factor * whole + (1 - dissipation_factor) * cube)


@dataclass(frozen=True)
class SlidingWaves:
    """Friction of the waves of a spectrum at one speed.

    Attributes
    ----------
    friction : ndarray, shape (n - 1,)
        Contribution of the waves between two wave numbers to the friction coefficient. [-]
    contact : ndarray, shape (n,)
        Fraction of the surface in contact if only the waves below ``q`` are seen. [-]
    rise : ndarray, shape (n,)
        Temperature of the body in the depth of the waves, above the temperature far from the contact. [K]
    heat : float
        Heat that flows into the body on the nominal area, by which the temperatures were computed. [W/m2]
    """

    friction: Array
    contact: Array
    rise: Array
    heat: float


class FrictionIntegrals:
    """Persson's integrals over a spectrum.

    Parameters
    ----------
    wave_numbers : ndarray, shape (n,)
        Evenly spaced in the logarithm, ascending. [rad/m]
    density : ndarray, shape (n,)
        Spectral density ``C(q)``. [m4]
    material : Material
        Material of the half-space at its temperature far from the contact, or at its reference temperature.
    pressure : float
        Nominal pressure. [Pa]
    dissipation_factor : float
        The number ``g`` in :math:`S = g + (1 - g) P^2`. [-]
    heating : Heating, optional
        Heat of sliding, with a radius of spots. Default: the material has one temperature, at which it is given.
    """

    def __init__(
        self,
        wave_numbers: Array,
        density: Array,
        material: Material,
        pressure: float,
        dissipation_factor: float,
        heating: Heating | None = None,
    ) -> None:
        self._q = wave_numbers
        self._weight = wave_numbers**4 * density / (4 * math.pi * pressure)
        self._pressure = pressure
        self._factor = dissipation_factor
        self._heating = heating
        self._means = DirectionMeans(material)
        step = math.log(wave_numbers[-1] / wave_numbers[0]) / (wave_numbers.size - 1)
        self._step = step

    def at(self, speed: float) -> SlidingWaves:
        """Return the friction of the waves at a speed. [m/s]

        Raises
        ------
        ConvergenceError
            If the temperatures are not found.
        """
        cold = np.zeros(self._q.size)
        if self._heating is None:
            friction, contact = self._friction(speed, np.ones(self._q.size))
            return SlidingWaves(friction, contact, cold, float(friction.sum()) * self._pressure * speed)
        heating = self._heating
        radius = float(self._heating.spot_radius or math.inf)
        spot = MovingSpot(radius, speed, heating.heat_conductivity, heating.volumetric_heat_capacity, self._q)

        def hotter(rise: Array) -> tuple[Array, SlidingWaves]:
            friction, contact = self._friction(speed, heating.shift_factor(rise))
            # each wave number has half of the heat of the interval to its neighbour
            heat = (np.append(friction, 0.0) + np.append(0.0, friction)) / 2 * self._pressure * speed
            in_spots = np.interp(math.log(math.pi / radius), np.log(self._q), contact)
            return spot.rise(heat / in_spots), SlidingWaves(friction, contact, rise, float(heat.sum()))

        return _fixed_point(hotter, cold)

    def _friction(self, speed: float, shift_factor: Array) -> tuple[Array, Array]:
        """Return the friction between the wave numbers, and the contact fraction, at a shift factor of each wave."""
        square, loss = self._means(self._q * speed * shift_factor)
        stress = self._weight * square / (4 * self._pressure)  # dG / d ln q
        variance = np.append(0.0, np.cumsum((stress[1:] + stress[:-1]) / 2 * self._step))
        ratio = 4 * self._pressure * loss / square
        friction = (ratio[1:] + ratio[:-1]) / 2 * np.diff(contact_integral(variance, self._factor))
        with np.errstate(divide="ignore"):
            return friction, erf(0.5 / np.sqrt(variance))


def _fixed_point(hotter: Callable[[Array], tuple[Array, SlidingWaves]], cold: Array) -> SlidingWaves:
    """Return the waves whose heat makes the temperatures at which they were computed.

    Heat reduces friction exponentially. So Anderson's iteration [1]_ works on the logarithms of the rises.

    Parameters
    ----------
    hotter : callable
        Returns the rises that the heat makes at some rises, and the waves at these.
    cold : ndarray
        Rises of zero. [K]

    References
    ----------
    .. [1] H. F. Walker, P. Ni, SIAM J. Numer. Anal. 49 (2011) 1715.
    """
    upper, waves = hotter(cold)
    if not upper.all():  # no loss, no heat
        return waves
    lower = np.maximum(hotter(upper)[0], _LEAST_START * upper)
    for damping in _DAMPINGS:
        point = np.log(upper * lower) / 2
        points: list[Array] = []
        changes: list[Array] = []
        for _ in range(_ITERATIONS):
            image, waves = hotter(np.exp(point))
            change = np.log(np.maximum(image, np.finfo(float).tiny)) - point
            size = float(np.abs(change).max())
            if size <= _CONVERGED:
                return waves
            points = [*points, point][-_REMEMBERED:]
            changes = [*changes, change][-_REMEMBERED:]
            point = point + damping * change
            if len(changes) > 1:
                differences = np.diff(changes, axis=0).T
                share = np.linalg.lstsq(differences, change)[0]
                point = point - (np.diff(points, axis=0).T + damping * differences) @ share
            point = np.clip(point, points[-1] - _LARGEST_STEP, points[-1] + _LARGEST_STEP)
    raise ConvergenceError(f"the temperatures still change by {size:.2g} of themselves")
