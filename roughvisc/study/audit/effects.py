"""Size of effects that the model neglects: adhesion, a base under the body, elastic waves, and friction heat."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from roughvisc.mechanics.sheet import Sheet, complement

Array = NDArray[np.float64]

#: Distance over which surfaces attract each other: the distance between atoms (D. Tabor, J. Colloid Interface Sci. 58
#: (1977) 2). The Tabor parameter is proportional to its inverse. [m]
ATTRACTION_RANGE = 3e-10
#: Maugis' parameter over Tabor's, for Lennard-Jones atoms (D. Maugis, J. Colloid Interface Sci. 150 (1992) 243).
_MAUGIS = 1.1570


def tabor_parameter(
    radius: float, contact_modulus: float, work_of_adhesion: float, attraction_range: float = ATTRACTION_RANGE
) -> float:
    r"""Return the Tabor parameter of a sphere: height of its adhesive neck over the range of the attraction.

    Parameters
    ----------
    radius : float
        Radius ``R`` of the sphere. [m]
    contact_modulus : float
        ``E*``. [Pa]
    work_of_adhesion : float
        ``w``. [J/m2]
    attraction_range : float
        Distance ``z`` over which the surfaces attract each other. [m]

    Returns
    -------
    float
        :math:`\mu = (R w^2 / E^{*2} z^3)^{1/3}`: JKR is valid far above one, DMT far below. [-]

    References
    ----------
    .. [1] D. Tabor, J. Colloid Interface Sci. 58 (1977) 2.

    Examples
    --------
    >>> round(tabor_parameter(1e-3, 3e6, 0.05))
    2175
    """
    return float(np.cbrt(radius * (work_of_adhesion / contact_modulus) ** 2) / attraction_range)


def pull_off_force(radius: float, work_of_adhesion: float, tabor: float = math.inf) -> float:
    r"""Return the force that separates a sphere from a flat half-space.

    Parameters
    ----------
    radius : float
        Radius ``R`` of the sphere. [m]
    work_of_adhesion : float
        ``w``. [J/m2]
    tabor : float
        Tabor parameter: infinite for JKR, 0 for DMT. [-]

    Returns
    -------
    float
        :math:`\frac32 \pi w R` (JKR) to :math:`2 \pi w R` (DMT). [N]

    Notes
    -----
    Between the limits the function uses the fit of [3]_ to the theory of Maugis, with an error of at most 1.7 %.

    References
    ----------
    .. [1] K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301.
    .. [2] B. V. Derjaguin, V. M. Muller, Yu. P. Toporov, J. Colloid Interface Sci. 53 (1975) 314.
    .. [3] R. W. Carpick, D. F. Ogletree, M. Salmeron, J. Colloid Interface Sci. 211 (1999) 395.

    Examples
    --------
    >>> pull_off_force(1.0, 1.0) / math.pi, pull_off_force(1.0, 1.0, tabor=0.0) / math.pi
    (1.5, 2.0)
    """
    grown = 4.04 * (_MAUGIS * tabor) ** 1.4
    share = 1.0 if math.isinf(grown) else (grown - 1) / (grown + 1)
    return math.pi * work_of_adhesion * radius * (7 - share) / 4


def conformal_energy(roughness: float, contact_modulus: float) -> float:
    r"""Return the elastic energy per area of a half-space that follows a rough surface everywhere.

    Parameters
    ----------
    roughness : float
        :math:`\sum |q| |h_q|^2` over all waves of the surface, with the mean square height :math:`\sum |h_q|^2`. [m]
    contact_modulus : float
        ``E*``. [Pa]

    Returns
    -------
    float
        :math:`E^* \sum |q| |h_q|^2 / 4`. Soft surfaces stay in full contact without a load if the work of adhesion
        exceeds it. [J/m2]

    References
    ----------
    .. [1] B. N. J. Persson, E. Tosatti, J. Chem. Phys. 115 (2001) 5597.

    Examples
    --------
    >>> k, a = 1e5, 1e-6
    >>> conformal_energy(k * a**2 / 2, 3e6) == 3e6 * k * a**2 / 8  # a cos(k x)
    True
    """
    return contact_modulus * roughness / 4


def periodic_relief(pressure: Array, cells: tuple[float, float], sheet: Sheet) -> float:
    r"""Return the reduction of the approach by the base of a sheet, over the contact compliance, for a periodic load.

    Parameters
    ----------
    pressure : ndarray, shape (nx, ny)
        Pressure in one period. [Pa]
    cells : tuple of float
        Cell sides. [m]
    sheet : Sheet
        The sheet.

    Returns
    -------
    float
        Mean of :math:`(K - K_h) * p`, weighted by the pressure, without the compression of the sheet. [m Pa]
    """
    power = np.abs(fft.rfft2(pressure)) ** 2
    (nx, ny), (dx, dy) = pressure.shape, cells
    q = 2 * np.pi * np.hypot(fft.fftfreq(nx, dx)[:, None], fft.rfftfreq(ny, dy))
    power[0, 0], q[0, 0] = 0.0, 1.0
    power[:, 1 : (ny + 1) // 2] *= 2  # conjugates are not stored
    lost = power * 2 / q * complement(q * sheet.thickness, sheet.poisson, sheet.base)
    return float(lost.sum() / (nx * ny * pressure.sum()))


def radiation_lag(radius: float, shear_modulus: float, density: float) -> float:
    r"""Return the time by which the force on a round punch leads its approach, because waves carry energy away.

    Parameters
    ----------
    radius : float
        Contact radius ``a``. [m]
    shear_modulus : float
        ``G`` of the half-space. [Pa]
    density : float
        :math:`\rho` of the half-space. [kg/m3]

    Returns
    -------
    float
        Dashpot over spring of the equivalent oscillator, :math:`0.85\,a \sqrt{\rho / G}`. [s]

    Notes
    -----
    The spring is :math:`4 G a / (1 - \nu)` and the dashpot :math:`3.4\,a^2 \sqrt{\rho G} / (1 - \nu)` [1]_. If a force
    changes over a time ``T``, its relative difference from the quasi-static force is about the lag over ``T``.

    References
    ----------
    .. [1] J. Lysmer, F. E. Richart, J. Soil Mech. Found. Div. ASCE 92 (1966) 65.

    Examples
    --------
    >>> round(radiation_lag(1e-3, 1e6, 1000.0) * 1e6)  # a millimetre of rubber: microseconds
    27
    """
    return 3.4 / 4 * radius * math.sqrt(density / shear_modulus)


def moving_load_excess(speed: float, shear_modulus: float, density: float, poisson: float) -> float:
    r"""Return the relative increase of the displacement by waves under a load that moves along a half-space.

    Parameters
    ----------
    speed : float
        Speed ``V`` of the load. [m/s]
    shear_modulus : float
        ``G`` of the half-space. [Pa]
    density : float
        :math:`\rho` of the half-space. [kg/m3]
    poisson : float
        Poisson's ratio :math:`\nu`. [-]

    Returns
    -------
    float
        Displacement under a moving normal line load over the displacement under a static one, minus one; infinite from
        the speed of Rayleigh waves on. [-]

    Notes
    -----
    With :math:`m = V / c_2`, :math:`c_2^2 = G / \rho`, :math:`\kappa^2 = (1 - 2\nu) / (2 - 2\nu)`,
    :math:`\alpha_1^2 = 1 - \kappa^2 m^2` and :math:`\alpha_2^2 = 1 - m^2` a steady pressure of any shape displaces the
    surface :math:`m^2 \alpha_1 / ((1 - \nu) R)` times as far as at rest, with Rayleigh's function
    :math:`R = 4 \alpha_1 \alpha_2 - (1 + \alpha_2^2)^2` [1]_. The code multiplies :math:`R` by its conjugate, which
    avoids cancellation at low speed. To leading order the excess is :math:`3 m^2 / 4` for :math:`\nu = 1/2`.

    References
    ----------
    .. [1] J. Cole, J. Huth, J. Appl. Mech. 25 (1958) 433.

    Examples
    --------
    >>> round(moving_load_excess(3.0, 1e6, 1000.0, 0.5), 5), moving_load_excess(31.0, 1e6, 1000.0, 0.5)
    (0.00681, inf)
    """
    square, ratio = density * speed**2 / shear_modulus, (1 - 2 * poisson) / (2 - 2 * poisson)
    # R (4 alpha_1 alpha_2 + (1 + alpha_2^2)^2) / m^2
    cubic = 16 * (1 - ratio) + (16 * ratio - 24) * square + 8 * square**2 - square**3
    if not (square < 1 and cubic > 0):
        return math.inf
    first, second = math.sqrt(1 - ratio * square), math.sqrt(1 - square)
    return first * (4 * first * second + (2 - square) ** 2) / ((1 - poisson) * cubic) - 1


def flash_temperature(
    heat_flux: float, radius: float, speed: float, heat_conductivity: float, volumetric_heat_capacity: float
) -> float:
    r"""Return the mean temperature rise of a round spot that slides on a half-space, for a uniform heat flux.

    Parameters
    ----------
    heat_flux : float
        Heat flux ``q`` into the half-space. [W/m2]
    radius : float
        Radius ``a`` of the spot. [m]
    speed : float
        Speed ``V`` of the spot along the half-space. [m/s]
    heat_conductivity : float
        Heat conductivity ``k`` of the half-space. [W/(m K)]
    volumetric_heat_capacity : float
        Heat capacity :math:`\rho c` of the half-space. [J/(m3 K)]

    Returns
    -------
    float
        Mean temperature of the spot in the steady state, above the temperature far away. [K]

    Notes
    -----
    The rise of a slow spot is :math:`8 q a / 3 \pi k`. A fast spot, whose heat has no time to flow sideways, has
    :math:`0.974\,(q a / k) / \sqrt P` with :math:`P = V a \rho c / k` [1]_ [2]_. The factor follows from the average of
    :math:`2 q \sqrt{t / \pi k \rho c}` over the circle, where ``t`` is the time since the leading edge. In between the
    inverse squares of both limits are added [3]_. The sum is at most 4 % below the exact value, near ``P`` = 2.

    References
    ----------
    .. [1] J. C. Jaeger, Proc. R. Soc. N.S.W. 76 (1942) 203.
    .. [2] J. F. Archard, Wear 2 (1959) 438.
    .. [3] X. Tian, F. E. Kennedy, J. Tribol. 116 (1994) 167.

    Examples
    --------
    >>> rubber = {"heat_conductivity": 0.2, "volumetric_heat_capacity": 1.8e6}
    >>> [round(flash_temperature(1e5, 1e-5, speed, **rubber), 2) for speed in (1e-6, 1.0)]
    [4.24, 0.51]
    """
    peclet = speed * radius * volumetric_heat_capacity / heat_conductivity
    # int (1 - t^2)^(3/4) dt over (-1, 1) is B(1/2, 7/4)
    beta = math.sqrt(math.pi) * math.gamma(7 / 4) / math.gamma(9 / 4)
    slow, fast = 8 / (3 * math.pi), 2 / math.sqrt(math.pi) * 2 / 3 * 2**1.5 * beta / math.pi
    return heat_flux * radius / heat_conductivity / math.sqrt(1 / slow**2 + peclet / fast**2)
